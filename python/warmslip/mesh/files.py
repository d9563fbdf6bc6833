"""Meshes from gmsh: nodes, cells, and parts and regions by their physical names. No compiled code is needed."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warmslip.mesh import gmsh

MAX_MESH_BYTES = 2**31  # bytes of a file that is read


@dataclass(frozen=True)
class MeshFile:
    """A mesh as it lies on disk: nodes (n, d), cells (c, d+1), facets of every part (f, d), cell numbers of every region."""

    dim: int
    nodes: NDArray[np.float64]
    cells: NDArray[np.int32]
    parts: dict[str, NDArray[np.int32]]
    regions: dict[str, NDArray[np.int64]]
    digest: str


def find(name: str) -> Path:
    """The file `name`, or the one of that name that comes with the package."""
    packaged = Path(str(resources.files("warmslip") / "scenes" / name))
    # os.path: Path.exists raises for names that no file can have
    return packaged if not os.path.exists(name) and os.path.exists(packaged) else Path(name)


def read(name: str) -> MeshFile:
    """Reads a gmsh file of triangles or tetrahedra, first order. Raises ValueError with one sentence and its cure."""
    path = find(name)
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no such file"
        raise ValueError(f"mesh file '{name}' cannot be read ({reason}); check the path") from None
    if not path.is_file() or not 0 < status.st_size <= MAX_MESH_BYTES:
        raise ValueError(f"mesh file '{name}' is empty or no file of at most 2 GB; check the path")
    return _read(path, name, status.st_mtime_ns)


@lru_cache(maxsize=8)
def _read(path: Path, name: str, _: int) -> MeshFile:
    data = path.read_bytes()
    try:
        raw = gmsh.parse(data)
    except ValueError as error:
        raise ValueError(f"'{name}' is not a gmsh mesh that can be read ({error}); save it as MSH 4.1 or 2.2") from None
    try:
        return _convert(raw, hashlib.sha256(data).hexdigest()[:16])
    except ValueError as error:
        raise ValueError(f"mesh file '{name}': {error}") from None


def _convert(raw: gmsh.Raw, digest: str) -> MeshFile:
    dim = max((size for size, _, _ in raw.blocks), default=0) - 1
    if dim < 2:
        raise ValueError("it holds no triangles and no tetrahedra; mesh the body")
    points = raw.nodes
    if not np.isfinite(points).all():
        raise ValueError("a node has a coordinate that is not finite; repair the mesh")
    if dim == 2 and np.ptp(points[:, 2]) > 0:
        raise ValueError("its triangles do not lie in a plane z = constant; mesh a plane body or a solid one")

    def gather(size: int) -> Any:
        return np.concatenate([np.empty((0, size), np.int64), *(nodes for n, nodes, _ in raw.blocks if n == size)])

    def members(size: int, tag: int) -> Any:
        marks = [np.full(len(nodes), tag in groups) for n, nodes, groups in raw.blocks if n == size]
        return np.flatnonzero(np.concatenate([np.empty(0, bool), *marks]))

    cells, facets = gather(dim + 1), gather(dim)
    parts = {name: facets[members(dim, tag)].astype(np.int32) for (d, tag), name in raw.names.items() if d == dim - 1}
    regions = {name: members(dim + 1, tag) for (d, tag), name in raw.names.items() if d == dim}
    for kind, found in (("part", parts), ("region", regions)):
        for key, there in found.items():
            if len(there) == 0:
                raise ValueError(f"the {kind} '{key}' is empty; remove the physical group or give it entities")
    nodes = np.ascontiguousarray(points[:, :dim])
    cells = _oriented(nodes, cells)
    _connected(cells, len(nodes))
    return MeshFile(dim, nodes, cells.astype(np.int32), parts, regions, digest)


def _oriented(nodes: Any, cells: Any) -> Any:
    """The cells with positive volume when all of them have been numbered the other way round, as gmsh may do."""
    edges = nodes[cells[:, 1:]] - nodes[cells[:, :1]]
    volumes = np.linalg.det(edges)
    if (volumes < 0).all():
        cells = cells.copy()
        cells[:, [0, 1]] = cells[:, [1, 0]]
    elif (volumes <= 0).any():
        worst = int(np.flatnonzero(volumes <= 0)[0])
        what = "flat" if volumes[worst] == 0 else "inverted"
        raise ValueError(f"cell {worst} (nodes {', '.join(map(str, cells[worst]))}) is {what}; repair the mesh")
    return cells


def _connected(cells: Any, nodes: int) -> None:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, others = np.repeat(cells[:, 0], cells.shape[1] - 1), cells[:, 1:].ravel()
    count, label = connected_components(coo_array((np.ones(len(first)), (first, others)), shape=(nodes, nodes)))
    used = np.zeros(nodes, bool)
    used[cells] = True
    if not used.all():
        raise ValueError(f"node {int(np.flatnonzero(~used)[0])} belongs to no cell; save the mesh without it")
    if count > 1:
        stray = int(np.flatnonzero(label[cells[:, 0]] != label[cells[0, 0]])[0])
        raise ValueError(f"the body is in {count} pieces (cell {stray} hangs on nothing of cell 0); mesh one body")
