"""Cells of a mesh in which points lie, and P1 fields between meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from warmslip.typing import Array

NEAREST = (8, 64, 512)  # cells that are tried for a point, by the distance of their centroids
INSIDE = -1e-9  # smallest barycentric coordinate of a point that lies in a cell


def located(nodes: Array, cells: Any, points: Array, outside: float = 0.0) -> tuple[Any, Array]:
    """The cell of every point, (points,), and its barycentric coordinates there, (points, d + 1), no smaller than -`outside`.

    Raises ValueError for a point outside.
    """
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
        cell[todo[best < INSIDE - (outside if many == NEAREST[-1] or many == len(cells) else 0)]] = -1
    if (cell < 0).any():
        raise ValueError(f"{int((cell < 0).sum())} points of one mesh lie in no cell of the other; the bodies differ")
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
