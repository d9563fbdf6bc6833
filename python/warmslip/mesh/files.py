"""Mesh files by name: nodes, cells, and parts and regions by their names. No compiled code is needed."""

from __future__ import annotations

import hashlib
import os
from functools import lru_cache
from importlib import resources
from pathlib import Path

from warmslip.mesh import gmsh, other_tools
from warmslip.mesh.conversion import MeshFile, convert

__all__ = ["MAX_MESH_BYTES", "MeshFile", "find", "read"]

MAX_MESH_BYTES = 2**31  # bytes of a file that is read


def find(name: str) -> Path:
    """The file `name`, or the one of that name that comes with the package."""
    packaged = Path(str(resources.files("warmslip") / "scenes" / name))
    # os.path: Path.exists raises for names that no file can have
    return packaged if not os.path.exists(name) and os.path.exists(packaged) else Path(name)


def read(name: str) -> MeshFile:
    """Reads a mesh file.

    Parameters
    ----------
    name : str
        Path of a gmsh file (MSH 4.1 or 2.2, whatever its suffix), or of a file with a suffix of `other_tools.FORMATS`; or the
        name of a mesh of the package.

    Returns
    -------
    MeshFile
        Cells are triangles or tetrahedra; other shapes are divided, and cells of higher order are used by their corners.

    Raises
    ------
    ValueError
        For a file that cannot be read or is no sound mesh: one sentence with the fault and its cure.
    """
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
    data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    try:
        suffix = path.suffix.lower()
        if suffix not in (*other_tools.FORMATS, ".msh", "") and b"$MeshFormat" not in data:
            raise ValueError(
                f"files of the kind {suffix} are not read; save it as .msh, {', '.join(other_tools.FORMATS)}"
            )
        raw = other_tools.parse(path) if suffix in other_tools.FORMATS else gmsh.parse(data)
        return convert(raw, hashlib.sha256(data).hexdigest()[:16])
    except ValueError as error:
        raise ValueError(f"mesh file '{name}': {error}") from None
