"""Files that gmsh's own library writes of a mesh, in every format, and what it reads in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gmsh
import numpy as np


def write(case: Callable[[], Any], folder: Path) -> Iterator[Path]:
    """The mesh of a case in both versions, as text and binary, with all elements and with those of groups only."""
    gmsh.clear()
    gmsh.option.restoreDefaults()
    gmsh.option.setNumber("General.Verbosity", 0)
    case()
    for version in (2.2, 4.1):
        for binary in (0, 1):
            for all_elements in (0, 1):
                for name, value in (("MshFileVersion", version), ("Binary", binary), ("SaveAll", all_elements)):
                    gmsh.option.setNumber(f"Mesh.{name}", value)
                path = folder / f"{case.__name__}_{version}_{'binary' if binary else 'text'}_{'all' * all_elements}.msh"
                gmsh.write(str(path))
                yield path


def rounded(places: Any) -> Any:
    """Coordinates to eight decimals: gmsh moves the nodes of a periodic curve by round-off when it opens a file."""
    return np.round(places, 8) + 0.0


@dataclass
class Read:
    """A mesh as gmsh reads it: elements as sets of places of corners, those of each group of the two highest dimensions."""

    dim: int
    volume: float
    cells: set[frozenset[Any]]
    groups: dict[tuple[int, str], tuple[float, set[frozenset[Any]]]] = field(default_factory=dict)


def read(path: Path) -> Read:
    gmsh.clear()
    gmsh.option.restoreDefaults()
    gmsh.option.setNumber("General.Verbosity", 0)
    gmsh.open(str(path))
    tags, places, _ = gmsh.model.mesh.getNodes()
    x = dict(zip(tags.tolist(), map(tuple, rounded(places.reshape(-1, 3)).tolist()), strict=True))
    dim = gmsh.model.getDimension()
    found = Read(dim, *_elements(dim, [tag for _, tag in gmsh.model.getEntities(dim)], x))
    for of in (dim - 1, dim):
        for _, tag in gmsh.model.getPhysicalGroups(of):
            entities = gmsh.model.getEntitiesForPhysicalGroup(of, tag).tolist()
            name = gmsh.model.getPhysicalName(of, tag) or str(tag)
            found.groups[of, name] = _elements(of, entities, x)
    return found


def _elements(dim: int, entities: list[int], x: dict[int, Any]) -> tuple[float, set[frozenset[Any]]]:
    """The length, area or volume of the different elements of some entities, and their corners."""
    cells: dict[frozenset[Any], float] = {}
    for entity in entities:
        for kind, tags, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            _, _, _, size, _, corners = gmsh.model.mesh.getElementProperties(kind)
            sizes = gmsh.model.mesh.getElementQualities(tags, "volume") if dim else np.zeros(len(tags))
            for element, volume in zip(nodes.reshape(-1, size)[:, :corners].tolist(), sizes.tolist(), strict=True):
                cells[frozenset(x[node] for node in element)] = abs(volume)
    return sum(cells.values()), set(cells)
