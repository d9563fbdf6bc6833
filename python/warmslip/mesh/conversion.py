"""From what a file holds to a mesh that can be computed on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from warmslip.mesh.body import check_apart, check_connected, oriented, simplices
from warmslip.mesh.elements import SHAPES
from warmslip.mesh.facets import incidence
from warmslip.mesh.groups import boundary_parts, lower, named
from warmslip.mesh.raw import Block, Raw

LARGEST = 1e100  # coordinate whose cube is a number
PLANE = 1e-10  # spread of z over that of x and y, up to which a body is plane


@dataclass(frozen=True)
class MeshFile:
    """A mesh from a file.

    Attributes
    ----------
    dim : int
        2 or 3.
    nodes : array (n, d)
        Coordinates, length; nodes without a cell are left out.
    cells : array (c, d + 1)
        Triangles or tetrahedra of positive volume.
    parts : dict of arrays (f, d)
        Boundary facets by name.
    regions : dict of arrays
        Numbers of the cells of each region.
    digest : str
        A hash of the file.
    no_parts : dict of str
        Named groups that are no boundary parts, and why; a scene may not use them.
    remarks : tuple of str
        What the reader changed and may not have been meant; a run warns of it.
    notes : tuple of str
        What else it changed: cells divided into simplices, nodes without a cell left out.
    """

    dim: int
    nodes: NDArray[np.float64]
    cells: NDArray[np.int32]
    parts: dict[str, NDArray[np.int32]]
    regions: dict[str, NDArray[np.int64]]
    digest: str
    no_parts: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def convert(raw: Raw, digest: str) -> MeshFile:
    """The mesh of a file. Raises ValueError with the fault and its cure."""
    dim = max((SHAPES[block.shape][0] for block in raw.blocks if len(block.nodes)), default=0)
    if dim < 2:
        raise ValueError("it holds no cells; mesh the body (gmsh -2 or -3), and save its surface or volume too")
    cells, of_cells, cells_again = simplices(raw, dim, plane=dim == 2)
    facets, of_facets, facets_again = simplices(raw, dim - 1, plane=False)
    used = np.zeros(len(raw.nodes), bool)
    used[cells] = True
    _check_places(raw.nodes[used], dim)
    points = np.ascontiguousarray(raw.nodes[:, :dim])
    cells = oriented(points, cells, raw.tags)
    found = incidence(cells, facets, raw.tags)
    number = np.cumsum(used) - 1
    body = points[used], number[cells], number[found.boundary], raw.tags[used]
    check_connected(*body)
    check_apart(*body)
    groups, remarks = named(raw, dim - 1, of_facets)
    regions, more = named(raw, dim, of_cells)
    parts, others = boundary_parts(groups, facets, found.cells)
    again = [(cells_again, "cells"), (facets_again, "facets")]
    return MeshFile(
        dim,
        points[used],
        number[cells].astype(np.int32),
        {name: number[part].astype(np.int32) for name, part in parts.items()},
        regions,
        digest,
        {name: why for name, why in (lower(raw, dim) | others).items() if name not in parts},
        (*raw.remarks, *_curved(raw, dim), *remarks, *more, *(_again(*one) for one in again if one[0])),
        (*_divided(raw, dim), *_loose(raw, dim)),
    )


def _check_places(nodes: NDArray[np.float64], dim: int) -> None:
    """Raises ValueError for nodes of cells that are nowhere, or for triangles that are no plane body."""
    if not np.isfinite(nodes).all():
        raise ValueError("a node has a coordinate that is not finite; repair the mesh")
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    reach, size = float(np.abs(nodes).max()), float((high / 2 - low / 2).max())
    if reach > LARGEST or 0 < size < 1 / LARGEST:
        raise ValueError(
            f"its coordinates reach {reach:.3g}, and its size is {2 * size:.3g}; take another unit of length"
        )
    if dim == 2 and high[2] - low[2] > PLANE * (high - low)[:2].max():
        raise ValueError(
            f"its cells are a surface in space, with z from {low[2]:.3g} to {high[2]:.3g}; mesh the volume (gmsh -3), or turn a "
            "plane body into a plane z = constant"
        )


def _cells(raw: Raw, dim: int) -> list[Block]:
    return [block for block in raw.blocks if SHAPES[block.shape][0] == dim and len(block.nodes)]


def _curved(raw: Raw, dim: int) -> Iterator[str]:
    curved = [len(block.nodes) for block in _cells(raw, dim) if block.nodes.shape[1] > SHAPES[block.shape][1]]
    if curved:
        yield f"{sum(curved)} cells are of second or higher order; only their corners are used, and curved sides become straight"


def _divided(raw: Raw, dim: int) -> Iterator[str]:
    for shape in ("quadrangle", "hexahedron", "prism", "pyramid"):
        if count := sum(len(block.nodes) for block in _cells(raw, dim) if block.shape == shape):
            plural = "hexahedra" if shape == "hexahedron" else f"{shape}s"
            yield f"{plural} divided into {'triangles' if dim == 2 else 'tetrahedra'}: {count}"


def _loose(raw: Raw, dim: int) -> Iterator[str]:
    used = np.zeros(len(raw.nodes), bool)
    for block in _cells(raw, dim):
        used[block.nodes] = True
    if count := int((~used).sum()):
        yield f"nodes without a cell, such as centres of arcs, left out: {count}"


def _again(count: int, what: str) -> str:
    return f"{count} {what} occur more than once in a group, because two of its entities coincide; each is counted once"
