"""Refinement of a mesh, uniform or graded: triangles into 4, tetrahedra into 8, parts and regions kept, P1 spaces nested.

Where a solution behaves like r^L in the distance r to a place, L < 1, uniform meshes give h^L. Edges that end there are divided
in the ratio kappa < 1/2 in place of 1/2 (Bacuta, Nistor & Zikatanov, Numer. Math. 100, 2005); with kappa < 2^(-1/L) P1 elements
regain order 1 in the energy norm with as many cells as the uniform mesh has. Along an edge in space, cells become long and thin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warmslip.mesh.conversion import MeshFile

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


MARGIN = 0.75  # strictly below 2^(-1/L): equality costs a logarithm


@dataclass(frozen=True)
class Grading:
    """A place towards which cells shrink: its `simplices` (n, j + 1), nodes of points, edges or facets, and the `fraction` of
    an edge that a cut leaves at the place, in (0, 1/2]."""

    simplices: Any
    fraction: float


def fraction(exponent: float) -> float:
    """kappa for a place with singular exponent L (dimensionless); 1/2, no grading, for L >= 1."""
    return 0.5 if exponent >= 1 else float(2 ** (-1 / (MARGIN * exponent)))


class _Midpoints:
    """The nodes with a node of every edge behind them; `of` finds the node of a corner or an edge of each simplex.

    The node of an edge is its middle, or nearer to the one of its ends that lies in a graded place.
    """

    def __init__(self, nodes: Any, cells: Any, graded: Sequence[Grading] = ()) -> None:
        pairs = [(i, j) for i in range(cells.shape[1]) for j in range(i)]
        edges = np.sort(np.concatenate([cells[:, pair] for pair in pairs]), axis=1)
        self._count = len(nodes)
        self._keys = np.unique(edges[:, 0].astype(np.int64) * self._count + edges[:, 1])
        first, second = self._keys // self._count, self._keys % self._count
        middle = (nodes[first] + nodes[second]) / 2
        if graded:
            share = _shares(len(nodes), first, second, graded)[:, None]
            middle = np.where(share == 0.5, middle, (1 - share) * nodes[first] + share * nodes[second])
        self.nodes = np.concatenate([nodes, middle])

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


def _shares(count: int, first: Any, second: Any, graded: Sequence[Grading]) -> Any:
    """Where every edge is cut, as a fraction of its length: 1/2 unless just one end lies in a graded place."""
    near = np.full((2, len(first)), 0.5)
    for one in graded:
        inside = np.zeros(count, dtype=bool)
        inside[np.asarray(one.simplices)] = True
        at = inside[first], inside[second]
        for end in (0, 1):
            here = at[end] & ~at[1 - end]
            near[end, here] = np.minimum(near[end, here], one.fraction)
    both = (near < 0.5).all(axis=0)
    return np.where(both, 0.5, np.where(near[0] < 0.5, near[0], 1 - near[1]))


def refined(mesh: MeshFile, times: int = 1, graded: Sequence[Grading] = ()) -> MeshFile:
    """The mesh with every cell cut `times` times into 4 or 8, of half its size unless it lies at a `graded` place.

    The octahedron inside a tetrahedron is cut along its shortest diagonal. A facet of a part is cut as its cell is. Every child
    lies in one parent, so the meshes are nested.
    """
    for _ in range(times):
        middle = _Midpoints(mesh.nodes, mesh.cells, graded)
        graded = [replace(one, simplices=_cut(middle, np.asarray(one.simplices))) for one in graded]
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


def _cut(middle: _Midpoints, simplices: Any) -> Any:
    """The children of points, edges or facets."""
    template = {1: ["0"], 2: EDGE, 3: TRIANGLE}[simplices.shape[1]]
    return middle.children(simplices, template).reshape(-1, simplices.shape[1])


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
