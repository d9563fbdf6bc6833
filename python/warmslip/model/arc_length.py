"""Points of a part along its line."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip.typing import Array

MANY = 1000  # points that are compared with all edges at once
ROUNDING = 1e-9  # of the longest edge: points that are as near to two edges lie on both


def along_part(mesh: Any, part: str, points: Array) -> tuple[Any, Array]:
    """The order of points on a part along its line, and the arc length of each in that order.

    Points at the same place, such as those of a corner with a normal for each facet, keep their order.

    Parameters
    ----------
    mesh : _core.Mesh2
        The mesh.
    part : str
        Name of a boundary part.
    points : array (points, 2)
        Positions on the part, length.

    Returns
    -------
    order : array (points,)
        Numbers of the points along the line.
    length : array (points,)
        Arc length of `points[order]`, not decreasing.
    """
    length = arc_length(np.asarray(mesh.nodes), np.asarray(mesh.parts[part]), points)
    order = np.argsort(length, kind="stable")
    return order, length[order]


def arc_length(nodes: Array, edges: Any, points: Array) -> Array:
    """Arc length of points on a line of edges from its first end.

    The first end of an open line is the one with the smaller x, then y; a closed line begins at such a node. A part of several
    lines goes from one to the next without a gap.

    Parameters
    ----------
    nodes : array (nodes, 2)
        Positions of all nodes, length.
    edges : array (edges, 2)
        Nodes of each edge of the line.
    points : array (points, 2)
        Positions on the line, length; a point beside it takes the nearest place.

    Returns
    -------
    array (points,)
        Length.
    """
    first, last, start = _walked(nodes, edges)
    a, along = nodes[first], nodes[last] - nodes[first]
    size = np.linalg.norm(along, axis=1)
    out = np.empty(len(points))
    for begin in range(0, len(points), MANY):
        some = points[begin : begin + MANY, None]
        share = np.clip(np.einsum("ped,ed->pe", some - a, along) / size**2, 0, 1)
        away = np.linalg.norm(some - (a + share[..., None] * along), axis=2)
        near = away <= away.min(axis=1, keepdims=True) + ROUNDING * size.max()
        out[begin : begin + MANY] = np.where(near, start + share * size, np.inf).min(axis=1)
    return out


def _walked(nodes: Array, edges: Any) -> tuple[Any, Any, Array]:
    """First and last node of every edge in the direction of the walk, and the length at the first, each (edges,)."""
    at: dict[int, list[int]] = {}
    for number, edge in enumerate(edges.tolist()):
        for node in edge:
            at.setdefault(node, []).append(number)
    first, last, start = np.full(len(edges), -1), np.empty(len(edges), dtype=int), np.empty(len(edges))
    reached = 0.0
    for begin in sorted(at, key=lambda node: (len(at[node]), *nodes[node])):  # ends first, then any of a closed line
        node = begin
        while (edge := next((e for e in at[node] if first[e] < 0), None)) is not None:
            one, other = (int(i) for i in edges[edge])
            first[edge], last[edge], start[edge] = node, other if one == node else one, reached
            node = int(last[edge])
            reached += float(np.linalg.norm(nodes[node] - nodes[first[edge]]))
    return first, last, start
