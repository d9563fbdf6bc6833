"""Lengths, areas and volumes of a mesh file: what shows that a part of the boundary was lost."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from warmslip.mesh.conversion import MeshFile
from warmslip.mesh.facets import of_cells, row_codes

UNITS = {2: ("length", "area", "triangles"), 3: ("area", "volume", "tetrahedra")}


def measure(nodes: Any, simplices: Any) -> float:
    """The length, area or volume of simplices (m, k) together."""
    edges = nodes[simplices[:, 1:]] - nodes[simplices[:, :1]]
    gram = np.linalg.det(edges @ edges.transpose(0, 2, 1))
    return float(np.sqrt(np.maximum(gram, 0)).sum()) / math.factorial(simplices.shape[1] - 1)


def bare(mesh: MeshFile) -> Any:
    """The boundary facets that are in no part, (b, d)."""
    facets = of_cells(mesh.cells)
    named = np.concatenate([np.empty((0, mesh.dim), np.int32), *mesh.parts.values()])
    _, first, inverse, count = np.unique(
        row_codes(np.concatenate([facets, named])), return_index=True, return_inverse=True, return_counts=True
    )
    cells = np.bincount(inverse[: len(facets)], minlength=len(count))
    return facets[first[(cells == 1) & (count == 1)]]


def lines(mesh: MeshFile) -> list[str]:
    """Sizes of the mesh, of its parts and of its regions, a line each."""
    facet, cell, cells = UNITS[mesh.dim]
    out = [
        f"the file: {len(mesh.nodes)} nodes, {len(mesh.cells)} {cells}, {cell} {measure(mesh.nodes, mesh.cells):.6g}"
    ]
    out += mesh.notes
    out += [f"part '{name}': {_of(mesh.nodes, facets, 'facets', facet)}" for name, facets in mesh.parts.items()]
    out += [f"no part: {_of(mesh.nodes, bare(mesh), 'facets', facet)}"]
    out += [f"region '{name}': {_of(mesh.nodes, mesh.cells[own], cells, cell)}" for name, own in mesh.regions.items()]
    inside = np.concatenate([np.empty(0, np.int64), *mesh.regions.values()])
    if mesh.regions and len(rest := np.setdiff1d(np.arange(len(mesh.cells)), inside)):
        out.append(f"no region: {_of(mesh.nodes, mesh.cells[rest], cells, cell)}")
    return [*out, *(f"'{name}' is no part: it {why}" for name, why in mesh.no_parts.items())]


def _of(nodes: Any, simplices: Any, what: str, unit: str) -> str:
    return f"{len(simplices)} {what}, {unit} {measure(nodes, simplices):.6g}"
