"""Cells of a mesh in which points lie, and P1 fields between meshes."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip.typing import Array

NEAREST = (8, 64, 512)  # cells that are tried for a point, by the distance of their centroids
INSIDE = -1e-9  # smallest barycentric coordinate of a point that lies in a cell


def located(nodes: Array, cells: Any, points: Array, outside: float = 0.0) -> tuple[Any, Array]:
    """The cell of every point, (points,), and its barycentric coordinates there, (points, d + 1), no smaller than -`outside`.

    Raises ValueError for a point outside.
    """
    cell, weights = cells_of(nodes, cells, points, outside)
    if (cell < 0).any():
        raise ValueError(f"{int((cell < 0).sum())} points of one mesh lie in no cell of the other; the bodies differ")
    return cell, weights


def cells_of(nodes: Array, cells: Any, points: Array, outside: float = 0.0) -> tuple[Any, Array]:
    """As `located`, with the cell -1 for a point outside."""
    from scipy.spatial import cKDTree  # a tenth of a second, for few scenes

    corners = nodes[cells]
    inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    tree = cKDTree(corners.mean(axis=1))
    cell = np.full(len(points), -1)
    weights = np.empty((len(points), cells.shape[1]))
    for many in NEAREST:
        todo = np.flatnonzero(cell < 0)
        if not len(todo):
            break
        many = min(many, len(cells))
        _, near = tree.query(points[todo], k=many)
        near = near.reshape(len(todo), many)
        best = np.full(len(todo), -np.inf)
        for column in near.T:
            inner = np.einsum("pij,pj->pi", inverse[column], points[todo] - corners[column, 0])
            found = np.concatenate([1 - inner.sum(axis=1, keepdims=True), inner], axis=1)
            least = found.min(axis=1)
            better = least > best
            best[better] = least[better]
            cell[todo[better]], weights[todo[better]] = column[better], found[better]
        last = many == NEAREST[-1] or many == len(cells)
        if last and many < len(cells):  # centroids of slender cells are far from some of their points
            low, high = corners.min(axis=1), corners.max(axis=1)
            for i in np.flatnonzero(best < INSIDE):
                one = points[todo[i]]
                for other in np.flatnonzero(((low <= one) & (one <= high)).all(axis=1)):
                    inner = inverse[other] @ (one - corners[other, 0])
                    found = np.concatenate([[1 - inner.sum()], inner])
                    if found.min() > best[i]:
                        best[i], cell[todo[i]], weights[todo[i]] = found.min(), other, found
        cell[todo[best < INSIDE - (outside if last else 0)]] = -1
    return cell, weights


def interpolated(values: Array, nodes: Array, cells: Any, points: Array, outside: float = 0.0) -> Array:
    """A P1 field, (nodes,) or (nodes, d), at points (points, d).

    Points that lie outside by less than `outside` of a cell, beside a curved boundary, take the value of the nearest cell's edge.

    Raises
    ------
    ValueError
        For a point further outside.
    """
    cell, weights = located(nodes, cells, points, outside)
    weights = np.maximum(weights, 0)
    weights /= weights.sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("pi,pi...->p...", weights, values[cells[cell]]))


def distance(nodes: Array, cells: Any, point: Array) -> float:
    """The distance of a point outside from the body, length."""
    faces = np.concatenate([np.delete(cells, i, axis=1) for i in range(cells.shape[1])])
    found, count = np.unique(np.sort(faces, axis=1), axis=0, return_counts=True)
    corners = nodes[found[count == 1]]
    least = _to_segments(corners[:, 0], corners[:, 1], point).min()
    if corners.shape[1] == 3:
        for i in (0, 1):
            least = min(least, _to_segments(corners[:, i], corners[:, 2], point).min())
        least = min(least, _to_insides(corners, point).min())
    return float(least)


def _to_segments(a: Array, b: Array, point: Array) -> Array:
    along = b - a
    share = np.clip(np.sum((point - a) * along, axis=1) / np.sum(along**2, axis=1), 0, 1)
    return np.asarray(np.linalg.norm(point - a - share[:, None] * along, axis=1))


def _to_insides(corners: Array, point: Array) -> Array:
    """Distances to the planes of triangles where the foot lies inside, else infinite."""
    edges = corners[:, 1:] - corners[:, :1]
    share = np.einsum("fdi,fd->fi", np.linalg.pinv(edges), point - corners[:, 0])
    foot = corners[:, 0] + np.einsum("fi,fid->fd", share, edges)
    inside = (share.min(axis=1) >= 0) & (share.sum(axis=1) <= 1)
    return np.asarray(np.where(inside, np.linalg.norm(point - foot, axis=1), np.inf))
