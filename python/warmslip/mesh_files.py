"""Meshes from gmsh, through meshio: nodes, cells, and parts and regions by their physical names. No compiled code is needed."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

CELLS = {2: "triangle", 3: "tetra"}
FACETS = {2: "line", 3: "triangle"}
LARGEST = 2**31  # bytes of a file that is read


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
    return packaged if not Path(name).exists() and packaged.exists() else Path(name)


def read(name: str) -> MeshFile:
    """Reads a gmsh file of triangles or tetrahedra, first order. Raises ValueError with one sentence and its cure."""
    path = find(name)
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no such file"
        raise ValueError(f"mesh file '{name}' cannot be read ({reason}); check the path") from None
    if not path.is_file() or status.st_size > LARGEST:
        raise ValueError(f"mesh file '{name}' is no file of at most 2 GB; check the path")
    return _read(path, name, status.st_mtime_ns)


@lru_cache(maxsize=8)
def _read(path: Path, name: str, _: int) -> MeshFile:
    import meshio

    try:
        raw = meshio.gmsh.read(path)
        return _convert(raw, hashlib.sha256(path.read_bytes()).hexdigest()[:16])
    except ValueError as error:
        raise ValueError(f"mesh file '{name}': {error}") from None
    except (Exception, SystemExit) as error:  # meshio raises what comes
        told = (str(error).splitlines() or [type(error).__name__])[0]
        raise ValueError(f"'{name}' is not a gmsh mesh that can be read ({told}); save it as MSH 4.1 or 2.2") from None


def _convert(raw: Any, digest: str) -> MeshFile:
    blocks = [(block.type, np.asarray(block.data), i) for i, block in enumerate(raw.cells)]
    kinds = {kind for kind, _, _ in blocks}
    if higher := sorted(kinds - {"vertex", "line", "triangle", "tetra"}):
        raise ValueError(f"it holds {', '.join(higher)}; only triangles and tetrahedra of first order can be read")
    if not kinds & {"triangle", "tetra"}:
        raise ValueError("it holds no triangles and no tetrahedra; mesh the body")
    dim = 3 if "tetra" in kinds else 2
    points = np.asarray(raw.points, dtype=float)
    if dim == 2 and points.shape[1] > 2 and np.ptp(points[:, 2]) > 0:
        raise ValueError("its triangles do not lie in a plane z = constant; mesh a plane body or a solid one")
    tags = raw.cell_data.get("gmsh:physical", [np.zeros(len(data), int) for _, data, _ in blocks])
    names = {(int(tag), int(d)): key for key, (tag, d) in raw.field_data.items()}

    def gather(kind: str) -> tuple[Any, Any]:
        chosen = [(data, np.asarray(tags[i])) for k, data, i in blocks if k == kind]
        empty = np.empty((0, {"line": 2, "triangle": 3, "tetra": 4}[kind]), int)
        return (
            np.concatenate([data for data, _ in chosen] or [empty]),
            np.concatenate([tag for _, tag in chosen] or [np.empty(0, int)]),
        )

    cells, cell_tags = gather(CELLS[dim])
    facets, facet_tags = gather(FACETS[dim])
    parts = {n: facets[facet_tags == tag].astype(np.int32) for (tag, d), n in names.items() if d == dim - 1}
    regions = {n: np.flatnonzero(cell_tags == tag) for (tag, d), n in names.items() if d == dim}
    for kind, found in (("part", parts), ("region", regions)):
        for key, members in found.items():
            if len(members) == 0:
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
