"""Uniform refinement of a mesh from a file: triangles into 4, tetrahedra into 8, parts and regions kept, P1 spaces nested."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from warmslip.mesh.files import MeshFile

# children by corner and edge midpoint: i is corner i, ij the middle of corners i and j
EDGE = ["0 01", "01 1"]
TRIANGLE = ["0 01 02", "01 1 12", "02 12 2", "01 12 02"]
CORNERS = ["0 01 02 03", "01 1 12 13", "02 12 2 23", "03 13 23 3"]
# the octahedron that is left, around each of its three diagonals
AROUND = {
    ("01", "23"): ["01 23 02 12", "01 23 12 13", "01 23 13 03", "01 23 03 02"],
    ("02", "13"): ["02 13 01 12", "02 13 12 23", "02 13 23 03", "02 13 03 01"],
    ("03", "12"): ["03 12 01 13", "03 12 13 23", "03 12 23 02", "03 12 02 01"],
}


class _Midpoints:
    """The nodes with the middles of all edges behind them; `of` finds the node of a corner or an edge of each simplex."""

    def __init__(self, nodes: Any, cells: Any) -> None:
        pairs = [(i, j) for i in range(cells.shape[1]) for j in range(i)]
        edges = np.sort(np.concatenate([cells[:, pair] for pair in pairs]), axis=1)
        self._count = len(nodes)
        self._keys = np.unique(edges[:, 0].astype(np.int64) * self._count + edges[:, 1])
        first, second = self._keys // self._count, self._keys % self._count
        self.nodes = np.concatenate([nodes, (nodes[first] + nodes[second]) / 2])

    def of(self, simplices: Any, name: str) -> Any:
        if len(name) == 1:
            return simplices[:, int(name)]
        pair = np.sort(simplices[:, [int(name[0]), int(name[1])]].astype(np.int64), axis=1)
        return self._count + np.searchsorted(self._keys, pair[:, 0] * self._count + pair[:, 1])

    def children(self, simplices: Any, template: list[str]) -> Any:
        """(simplices, children, corners)."""
        return np.stack(
            [np.stack([self.of(simplices, name) for name in child.split()], axis=1) for child in template], axis=1
        )


def refined(mesh: MeshFile, times: int = 1) -> MeshFile:
    """The mesh with every cell cut `times` times into 4 or 8 of half its size.

    The octahedron inside a tetrahedron is cut along its shortest diagonal. A facet of a part is cut as its cell is.
    """
    for _ in range(times):
        middle = _Midpoints(mesh.nodes, mesh.cells)
        if mesh.dim == 2:
            cells, facet = middle.children(mesh.cells, TRIANGLE), EDGE
        else:
            cells, facet = _tetrahedra(middle, mesh.cells), TRIANGLE
        several = cells.shape[1]
        mesh = replace(
            mesh,
            nodes=middle.nodes,
            cells=_positive(middle.nodes, cells.reshape(-1, mesh.dim + 1)).astype(np.int32),
            parts={
                name: middle.children(part, facet).reshape(-1, mesh.dim).astype(np.int32)
                for name, part in mesh.parts.items()
            },
            regions={name: (several * own[:, None] + np.arange(several)).ravel() for name, own in mesh.regions.items()},
        )
    return mesh


def _tetrahedra(middle: _Midpoints, cells: Any) -> Any:
    ends = [tuple(middle.nodes[middle.of(cells, name)] for name in diagonal) for diagonal in AROUND]
    shortest = np.argmin([np.linalg.norm(a - b, axis=1) for a, b in ends], axis=0)
    inside = np.stack([middle.children(cells, template) for template in AROUND.values()])
    return np.concatenate([middle.children(cells, CORNERS), inside[shortest, np.arange(len(cells))]], axis=1)


def _positive(nodes: Any, cells: Any) -> Any:
    volumes = np.linalg.det(nodes[cells[:, 1:]] - nodes[cells[:, :1]])
    turned = volumes < 0
    cells[turned] = cells[turned][:, [1, 0, *range(2, cells.shape[1])]]
    return cells
