"""Points on a boundary part: the facet that each lies on, and in the plane its arc length along the part."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip.typing import Array

NEAREST = 8  # facets that are tried first for a point, by the distance of their centroids
ON_FACET = 1e-9  # distance from a point to its facet, over the size of the part


def located(nodes: Array, facets: Any, points: Array) -> tuple[Any, Array]:
    """The nearest facet of each point, (points,), and the barycentric coordinates there, (points, d).

    `nodes` are (nodes, d), `facets` (facets, d), `points` (points, d).
    """
    from scipy.spatial import cKDTree  # a tenth of a second, for what draws

    corners = nodes[facets]
    facet, shares = np.zeros(len(points), dtype=int), np.zeros((len(points), facets.shape[1]))
    away = np.full(len(points), np.inf)
    small = ON_FACET * float(np.ptp(corners.reshape(-1, corners.shape[-1]), axis=0).max())
    tree, todo, count = cKDTree(corners.mean(axis=1)), np.arange(len(points)), min(NEAREST, len(facets))
    while len(todo):
        _, near = tree.query(points[todo], k=count)
        for column in near.reshape(len(todo), count).T:
            share = _barycentric(corners[column], points[todo])
            distance = np.linalg.norm(np.einsum("pk,pki->pi", share, corners[column]) - points[todo], axis=1)
            better = distance < away[todo] - small
            chosen = todo[better]
            facet[chosen], shares[chosen], away[chosen] = column[better], share[better], distance[better]
        if count == len(facets):
            break
        todo, count = todo[away[todo] > small], min(8 * count, len(facets))
    return facet, shares


def _barycentric(corners: Array, points: Array) -> Array:
    """Barycentric coordinates of the projections of points to their facets (points, d, d), cut off at 0: (points, d)."""
    edges = corners[:, 1:] - corners[:, :1]
    gram = np.einsum("pki,pli->pkl", edges, edges)
    right = np.einsum("pki,pi->pk", edges, points - corners[:, 0])
    inner = np.linalg.solve(gram, right[..., None])[..., 0]
    share = np.clip(np.concatenate([1 - inner.sum(axis=1, keepdims=True), inner], axis=1), 0, None)
    return np.asarray(share / share.sum(axis=1, keepdims=True))


def arc_length(nodes: Array, edges: Any, points: Array) -> tuple[Array, Array]:
    """Arc length of points along a part of the plane, (points,), and the direction in which it grows there, (points, 2).

    It is measured from the end of the line with the smallest x, of equal ones the smallest y; of a closed line from its node
    with the smallest x. The lines of a part of several pieces follow one another.
    """
    length = _lengths(nodes, edges)
    nearest, shares = located(nodes, edges, points)
    ends = np.array([[length[i] for i in edge] for edge in edges.tolist()])
    sides = np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1)
    first = ends.argmin(axis=1)
    rows = np.arange(len(edges))
    closing = np.abs(ends.max(axis=1) - ends.min(axis=1) - sides) > 1e-9 * sides  # from the last node to the first
    first[closing] = ends[closing].argmax(axis=1)
    begin = ends[rows, first][nearest]
    onwards = nodes[edges[rows, 1 - first]] - nodes[edges[rows, first]]
    found = begin + shares[np.arange(len(points)), 1 - first[nearest]] * sides[nearest]
    at_node = shares.max(axis=1) > 1 - ON_FACET  # of a closed line the first node, not its end
    node = edges[nearest, shares.argmax(axis=1)]
    found[at_node] = [length[i] for i in node[at_node].tolist()]
    return found, (onwards / sides[:, None])[nearest]


def _lengths(nodes: Array, edges: Any) -> dict[int, float]:
    """Arc length of the nodes of edges."""
    joined: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        joined.setdefault(a, []).append(b)
        joined.setdefault(b, []).append(a)
    length: dict[int, float] = {}
    starts = sorted(joined, key=lambda node: (len(joined[node]), *nodes[node]))  # ends first, then any of a closed line
    reached = 0.0
    for start in starts:
        node: int | None = start if start not in length else None
        while node is not None:
            length[node] = reached
            onwards = next((other for other in joined[node] if other not in length), None)
            if onwards is not None:
                reached += float(np.linalg.norm(nodes[onwards] - nodes[node]))
            node = onwards
    return length
