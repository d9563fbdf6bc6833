"""Meshes graded towards given points and time steps graded towards t = 0, both nested under refinement.

Where u behaves like r^L at a corner, L < 1, uniform meshes give h^L. Edges at such a corner are divided in the ratio
kappa < 1/2 in place of 1/2 (Bacuta, Nistor & Zikatanov, Numer. Math. 100, 2005); with kappa < 2^(-1/L) P1 elements
regain order 1 in the energy norm with as many cells as the uniform mesh has. Time steps are constant on blocks whose
lengths double away from t = 0, so that a few factorizations serve them all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warmslip._core import Mesh2

# strictly below 2^(-1/L): equality costs a logarithm
MARGIN = 0.75


@dataclass(frozen=True)
class Triangulation:
    """Nodes (n, 2), cells (c, 3) counterclockwise, and the edges (f, 2) of every boundary part."""

    nodes: NDArray[np.float64]
    cells: NDArray[np.int32]
    parts: Mapping[str, NDArray[np.int32]]

    @classmethod
    def of(cls, mesh: Any) -> Triangulation:
        return cls(np.asarray(mesh.nodes), np.asarray(mesh.cells), {k: np.asarray(v) for k, v in mesh.parts.items()})

    def mesh(self) -> Any:
        """As a `_core.Mesh2`."""
        return Mesh2.from_lists(self.nodes, self.cells, dict(self.parts))


def ratio(exponent: float) -> float:
    """kappa for a corner with singular exponent L (dimensionless); 1/2, no grading, for L >= 1."""
    return 0.5 if exponent >= 1 else float(2 ** (-1 / (MARGIN * exponent)))


def refined(mesh: Triangulation, grading: Mapping[int, float]) -> Triangulation:
    """Every triangle cut in four; an edge at node i of `grading` is divided at the fraction grading[i] from it.

    Every child lies in one parent, so the meshes are nested. Raises ValueError when an edge joins two graded nodes.
    """
    pairs = np.sort(mesh.cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, number = np.unique(pairs, axis=0, return_inverse=True)
    fraction = np.full(len(mesh.nodes), np.nan)
    fraction[list(grading)] = list(grading.values())
    first, second = fraction[edges[:, 0]], fraction[edges[:, 1]]
    if (~np.isnan(first) & ~np.isnan(second)).any():
        raise ValueError("an edge joins two graded nodes; start from a finer mesh")
    share = np.where(~np.isnan(first), first, np.where(~np.isnan(second), 1 - second, 0.5))[:, None]
    points = (1 - share) * mesh.nodes[edges[:, 0]] + share * mesh.nodes[edges[:, 1]]
    middle = (len(mesh.nodes) + number.reshape(-1, 3)).astype(np.int32)
    (a, b, c), (ab, bc, ca) = mesh.cells.T, middle.T
    children = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    index = {(int(i), int(j)): len(mesh.nodes) + k for k, (i, j) in enumerate(edges)}
    parts = {}
    for name, facets in mesh.parts.items():
        cut = np.array([index[min(i, j), max(i, j)] for i, j in facets.tolist()], dtype=np.int32)
        parts[name] = np.vstack([np.stack([facets[:, 0], cut], axis=1), np.stack([cut, facets[:, 1]], axis=1)])
    return Triangulation(
        np.vstack([mesh.nodes, points]), np.vstack([np.stack(child, axis=1) for child in children]), parts
    )


def family(coarsest: Triangulation, exponents: Mapping[tuple[float, float], float], levels: int) -> list[Triangulation]:
    """Nested meshes, `levels` of them, graded towards the points of `exponents` by their singular exponents.

    Raises ValueError when a point is no node of the coarsest mesh.
    """
    grading = {}
    for point, exponent in exponents.items():
        distance = np.abs(coarsest.nodes - point).max(axis=1)
        if distance.min() > 1e-12:
            raise ValueError(f"the corner {point} is no node of the coarsest mesh")
        if exponent < 1:
            grading[int(distance.argmin())] = ratio(exponent)
    out = [coarsest]
    while len(out) < levels:
        out.append(refined(out[-1], grading))
    return out


@dataclass(frozen=True)
class TimeBlock:
    """`steps` steps of size `k` (time), from `begin`."""

    begin: float
    k: float
    steps: int


def time_blocks(end: float, steps: int, halvings: int) -> list[TimeBlock]:
    """[0, T 2^-m], [T 2^-m, T 2^(1-m)], ..., [T/2, T] with `steps` steps each; the whole of [0, T] at once for m = 0.

    Doubling `steps` nests the times. A start like t^(3/4) costs the first block (2^-m k)^(3/4) and the others O(k).
    """
    lengths = [end * 2.0**-halvings, *(end * 2.0 ** (i - halvings) for i in range(halvings))]
    begins = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    return [TimeBlock(float(b), length / steps, steps) for b, length in zip(begins, lengths, strict=True)]
