"""Where the points of a probe lie: positions, cells, and means over the cells around."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csr_array

from warmslip.mesh.part_points import arc_length
from warmslip.model.point_location import cells_of, distance
from warmslip.scene.probe_tables import DEFAULT_COUNT, ProbeTable
from warmslip.typing import Array

ON_NODES = 1e-9  # barycentric coordinates below are rounding


def places(table: ProbeTable, mesh: Any, touching: Array | None) -> tuple[Array, Array | None, Any]:
    """Positions of a probe (points, d), their lengths, and of a part the order that they are in; `touching` contact points."""
    if table.at is not None:
        return np.array([table.at]), None, None
    if table.line is not None:
        first, last = np.array(table.line)
        share = np.linspace(0, 1, table.count or DEFAULT_COUNT)[:, None]
        return first + share * (last - first), share[:, 0] * float(np.linalg.norm(last - first)), None
    assert table.part is not None
    if touching is None:
        touching = np.asarray(mesh.nodes)[np.unique(np.asarray(mesh.parts[table.part]))]
    if touching.shape[1] == 3:
        return touching, None, np.arange(len(touching))
    length, _ = arc_length(np.asarray(mesh.nodes), np.asarray(mesh.parts[table.part]), touching)
    order = np.argsort(length, kind="stable")
    return touching[order], length[order], order


def average(mesh: Any, at: Any, weights: Array) -> Any:
    """See `Probe.average`, of points in the cells `at` with these barycentric coordinates."""
    nodes, cells = np.asarray(mesh.nodes), np.asarray(mesh.cells)
    on = weights > ON_NODES  # the nodes that a point depends on: all cells with these have the point in them
    many = np.arange(len(cells))
    of_cell = csr_array(
        (np.ones(cells.size), (cells.ravel(), np.repeat(many, cells.shape[1]))), (len(nodes), len(cells))
    )
    rows = np.repeat(np.arange(len(at)), cells.shape[1])
    of_point = csr_array((on.ravel().astype(float), (rows, cells[at].ravel())), (len(at), len(nodes)))
    shared = (of_point @ of_cell).tocoo()
    within = shared.data == on.sum(axis=1)[shared.row]
    row, column = shared.row[within], shared.col[within]
    corners = nodes[cells[column]]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    whole = np.bincount(row, volume, minlength=len(at))
    return csr_array((volume / whole[row], (row, column)), (len(at), len(cells)))


def inside(key: str, mesh: Any, points: Array) -> tuple[Any, Array]:
    """Cells of points (points,) and barycentric coordinates (points, d + 1). Raises ValueError for a point outside."""
    nodes, cells = np.asarray(mesh.nodes), np.asarray(mesh.cells)
    cell, weights = cells_of(nodes, cells, points)
    if (cell < 0).any():
        outside = points[cell < 0]
        where = ", ".join(f"{x:.6g}" for x in outside[0])
        far = distance(nodes, cells, outside[0])
        others = f" and {len(outside) - 1} more lie" if len(outside) > 1 else " lies"
        raise ValueError(
            f"{key}: the point ({where}){others} outside the body, at a distance of {far:.3g}; correct the place"
        )
    return cell, weights
