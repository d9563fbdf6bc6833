"""Meshes of other tools through meshio: VTU, Abaqus and CalculiX, MED, Exodus, Nastran."""

from __future__ import annotations

import importlib
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.mesh.elements import SHAPES
from warmslip.mesh.raw import Block, Raw

FORMATS = {".vtu": "vtu", ".inp": "abaqus", ".med": "med", ".exo": "exodus", ".e": "exodus", ".bdf": "nastran"}
NAMES = {
    "vertex": "point",
    "line": "line",
    "triangle": "triangle",
    "quad": "quadrangle",
    "tetra": "tetrahedron",
    "hexahedron": "hexahedron",
    "wedge": "prism",
    "pyramid": "pyramid",
}
REFERENCES = ("gmsh:physical", "medit:ref", "nastran:ref")  # cell data that number groups


def parse(path: Path) -> Raw:
    """A mesh with the cell sets of the file as its groups.

    Parameters
    ----------
    path : Path
        A file whose suffix is in FORMATS.

    Returns
    -------
    Raw
        Cell sets are those of Abaqus, the families of MED, the blocks of Exodus, or the values of an integer array of the cells.

    Raises
    ------
    ValueError
        For a file that meshio cannot read, or reads wrongly. Unlike the reader of gmsh files, meshio believes what a file says
        of its sizes.
    """
    suffix = path.suffix.lower()
    if suffix == ".inp":
        _check_abaqus(path.read_text(errors="replace"))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = importlib.import_module(f"meshio.{FORMATS[suffix]}").read(str(path))
    except ModuleNotFoundError as error:
        raise ValueError(f"meshio needs the package {error.name} to read it; install it with pip") from None
    except Exception as error:  # meshio raises whatever a broken file leads to
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise ValueError(f"meshio cannot read it ({reason}); export the mesh again, or as MSH 4.1") from None
    return _raw(mesh, _sets(mesh, suffix))


def _raw(mesh: Any, found: tuple[dict[str, list[Any]], list[str]]) -> Raw:
    points, (sets, remarks) = np.asarray(mesh.points, float), found
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError("it holds no nodes in the plane or in space; export the mesh again")
    raw = Raw(np.zeros((len(points), 3)), np.arange(1, len(points) + 1), remarks=remarks)
    raw.nodes[:, : points.shape[1]] = points
    names: dict[tuple[int, int, str], None] = {}
    for i, cells in enumerate(mesh.cells):
        shape, nodes = _elements(cells, len(points))
        inside = [_members(name, members[i], len(nodes)) for name, members in sets.items()]
        names |= {(SHAPES[shape][0], k, name): None for k, name in enumerate(sets, 1) if len(inside[k - 1])}
        group = np.repeat(np.arange(1, len(sets) + 1), [len(members) for members in inside])
        raw.blocks.append(Block(shape, nodes, np.concatenate([np.empty(0, np.int64), *inside]), group))
    raw.names = list(names)
    if empty := sorted(set(sets).difference(name for *_, name in names)):
        raise ValueError(f"its cell set '{empty[0]}' is empty; remove it, or give it cells")
    return raw


def _elements(cells: Any, count: int) -> tuple[str, Any]:
    """Shape and nodes of a block of cells, in a mesh of `count` nodes."""
    shape = NAMES.get(re.sub(r"\d+$", "", cells.type))
    if shape is None:
        raise ValueError(
            f"it holds cells of the type {cells.type}; mesh with triangles, tetrahedra, or what divides into them"
        )
    corners = SHAPES[shape][1]
    nodes = np.asarray(cells.data, np.int64)
    if nodes.size == 0:
        nodes = np.empty((0, corners), np.int64)
    elif nodes.ndim != 2 or nodes.shape[1] < corners or nodes.min() < 0 or nodes.max() >= count:
        raise ValueError("a cell names a node that the file does not hold; export the mesh again")
    return shape, nodes


def _members(name: str, members: Any, count: int) -> Any:
    """The cells of a set in a block of `count` cells."""
    if any(np.ndim(one) for one in members):
        raise ValueError(f"its cell set '{name}' lists other sets; list its cells")
    found = np.unique(np.asarray(members, np.int64))
    if len(found) and not 0 <= found[0] <= found[-1] < count:
        raise ValueError(f"its cell set '{name}' lists a cell that the file does not hold; export the mesh again")
    return found


def _sets(mesh: Any, suffix: str) -> tuple[dict[str, list[Any]], list[str]]:
    """Cells of each set in every block of cells, and remarks."""
    if mesh.cell_sets:
        for name, members in mesh.cell_sets.items():
            if len(members) != len(mesh.cells):
                fault = "lists other sets, or stands before some of the cells" if any(map(len, members)) else "is empty"
                raise ValueError(f"its cell set '{name}' {fault}; list its cells behind all cells")
        return mesh.cell_sets, []
    if FORMATS[suffix] == "exodus":
        sizes = [len(block.data) for block in mesh.cells]
        blocks = range(len(sizes))
        return {str(k + 1): [np.arange(sizes[i] if i == k else 0) for i in blocks] for k in blocks}, []
    data = {
        name: [np.asarray(values) for values in blocks]
        for name, blocks in mesh.cell_data.items()
        if all(np.asarray(values).ndim == 1 and np.asarray(values).dtype.kind in "iu" for values in blocks)
    }
    if (families := getattr(mesh, "cell_tags", None)) and "cell_tags" in data:
        return _families(families, data["cell_tags"]), []
    chosen = [name for name in REFERENCES if name in data] or list(data)
    if len(chosen) > 1:
        several = f"its cells have several integer arrays ({', '.join(chosen)})"
        return {}, [f"{several}, and none is taken for parts and regions; keep the one that numbers them"]
    return (_by_value(chosen[0], data[chosen[0]]) if chosen else {}), []


def _families(families: dict[int, list[str]], tags: list[Any]) -> dict[str, list[Any]]:
    """Groups of MED: a cell is in one family, a family in several groups."""
    numbers: dict[str, list[int]] = {}
    for number, names in families.items():
        for name in names:
            numbers.setdefault(name, []).append(number)
    return {name: [np.flatnonzero(np.isin(values, of)) for values in tags] for name, of in numbers.items()}


def _by_value(name: str, blocks: list[Any]) -> dict[str, list[Any]]:
    """Cells by the value of an array. meshio writes sets as an array called after all of them, with their positions."""
    values, names = np.unique(np.concatenate(blocks)).tolist(), name.split("-")
    if len(names) > 1 and set(values) <= {-1, *range(len(names))}:  # -1 is in no set
        numbers = dict(enumerate(names))
    else:
        numbers = {value: str(value) for value in values}
    return {one: [np.flatnonzero(block == value) for block in blocks] for value, one in numbers.items()}


def _check_abaqus(text: str) -> None:
    """Raises ValueError for what meshio assigns to other elements, or loses."""
    lines = re.findall(r"^\*\s*(NODE|ELEMENT|ELSET|INCLUDE)\s*(?:,(.*))?$", text.upper(), re.MULTILINE)
    if any(word == "INCLUDE" for word, _ in lines):
        raise ValueError("it includes another file; write the mesh into one")
    if sum(word == "NODE" for word, _ in lines) > 1:
        raise ValueError("it has several *NODE blocks, of which meshio reads the last; write all nodes into one")
    sets = [(word, re.search(r"\bELSET\s*=\s*([^,\s]+)", options)) for word, options in lines]
    of_elements = [name and name[1] for word, name in sets if word == "ELEMENT"]
    others = {name[1] for word, name in sets if word == "ELSET" and name}
    if any(of_elements) and (
        None in of_elements or len(set(of_elements)) < len(of_elements) or others & set(of_elements)
    ):
        raise ValueError(
            "some *ELEMENT lines share an ELSET or have none; give each line an ELSET of its own, or write *ELSET lines"
        )
