"""The reader of gmsh files against gmsh's own library, on a corpus that the library writes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from warmslip.mesh import files, measures
from warmslip.mesh.elements import GMSH, SHAPES

try:
    import gmsh
except (ImportError, OSError) as error:  # OSError: a system library of its graphics is missing
    pytest.skip(f"gmsh's Python package cannot be loaded: {error}", allow_module_level=True)

from support import gmsh_corpus, gmsh_files
from support.gmsh_corpus import CASES, REFUSED

SAID = {  # of remarks and notes; numbers of cells are those of gmsh's version
    "second_order": "cells are of second or higher order; only their corners are used",
    "quadrangles": "quadrangles divided into triangles",
    "hexahedra": "hexahedra divided into tetrahedra",
    "prisms": "prisms divided into tetrahedra",
    "pyramids": "pyramids divided into tetrahedra",
    "coincident": "facets occur more than once in a group",
    "curved": "nodes without a cell, such as centres of arcs, left out",
}
BOUNDARY = {"curved": 2 + 1.5 + 0.5 + 1 + np.pi / 4, "pyramids": 6.0, 2: 6.0, 3: 10.0}


@pytest.fixture(scope="module", autouse=True)
def library() -> Iterator[None]:
    gmsh.initialize(["", "-v", "0"], interruptible=False)
    yield
    gmsh.finalize()


@pytest.mark.parametrize("case", CASES, ids=[case.__name__ for case in CASES])
def test_the_same_mesh_or_one_true_sentence(case: Callable[[], Any], tmp_path: Path) -> None:
    paths = list(gmsh_files.write(case, tmp_path))
    assert len(paths) == 8
    for path in paths:
        if words := _refusal(case.__name__, path.name):
            with pytest.raises(ValueError, match=words):
                files.read(str(path))
        else:
            _compare(case.__name__, path)


def _refusal(case: str, file: str) -> str:
    if "2.2" in file and case == "parametric":
        return "save it with Mesh.SaveParametric = 0"
    if "2.2" in file and "all" in file and case not in ("unnamed", "no_groups"):
        return "its physical groups have names but no elements, .*; save it with Mesh.SaveAll = 0"
    return REFUSED.get(case, "")


def _compare(case: str, path: Path) -> None:
    ours, theirs = files.read(str(path)), gmsh_files.read(path)
    assert ours.dim == theirs.dim
    places = np.zeros((len(ours.nodes), 3))
    places[:, : ours.dim] = ours.nodes
    third = {cell[2] for corners in theirs.cells for cell in corners}
    if ours.dim == 2 and len(third) == 1:
        places[:, 2] = third.pop()
    assert measures.measure(ours.nodes, ours.cells) == pytest.approx(theirs.volume, rel=1e-12)
    assert _same_places(places, ours.cells, theirs.cells)
    names = {name for dim, name in theirs.groups if dim == ours.dim - 1}
    assert names == {*ours.parts, *(name for name, why in ours.no_parts.items() if " facets " in why)}
    assert {name for dim, name in theirs.groups if dim == ours.dim} == set(ours.regions)
    for (dim, name), (size, elements) in theirs.groups.items():
        if dim == ours.dim or name in ours.parts:
            found = ours.cells[ours.regions[name]] if dim == ours.dim else ours.parts[name]
            assert measures.measure(ours.nodes, found) == pytest.approx(size, rel=1e-12)
            assert _same_places(places, found, elements)
    around = sum(measures.measure(ours.nodes, facets) for facets in _boundary(ours))
    assert around == pytest.approx(BOUNDARY.get(case, BOUNDARY[ours.dim]), rel=0.02 if case == "curved" else 1e-12)
    assert case not in SAID or any(SAID[case] in sentence for sentence in (*ours.remarks, *ours.notes))


def _boundary(mesh: files.MeshFile) -> list[Any]:
    """The boundary in pieces that share no facet."""
    pieces = [facets for name, facets in mesh.parts.items() if name != "some"]  # which overlaps
    if "some" not in mesh.parts:
        return [*pieces, measures.bare(mesh)]
    return [measures.bare(files.MeshFile(mesh.dim, mesh.nodes, mesh.cells, {}, {}, ""))]


def _same_places(places: Any, simplices: Any, elements: set[frozenset[Any]]) -> bool:
    """Whether simplices are the elements, or lie each in one of them and together in all."""
    found = {frozenset(map(tuple, corners)) for corners in gmsh_files.rounded(places)[simplices].tolist()}
    if {len(element) for element in elements} == {simplices.shape[1]}:
        return found == elements and len(found) == len(simplices)
    inside: dict[Any, set[frozenset[Any]]] = {}
    for element in elements:
        for corner in element:
            inside.setdefault(corner, set()).add(element)
    used = [set.intersection(*(inside[corner] for corner in simplex)) for simplex in found]
    return all(used) and set.union(*used) == elements


def test_the_table_of_elements_is_that_of_gmsh() -> None:
    dims: dict[str, str] = {"quadrilateral": "quadrangle"}
    for kind, (shape, size) in GMSH.items():
        name, dim, _, nodes, _, corners = gmsh.model.mesh.getElementProperties(kind)
        theirs = name.split()[0].lower()
        assert (dims.get(theirs, theirs), nodes, dim, corners) == (shape, size, *SHAPES[shape])


def test_a_file_cut_anywhere_is_refused(tmp_path: Path) -> None:
    """Neither text nor binary is read as a smaller mesh."""
    for path in gmsh_files.write(gmsh_corpus.plain, tmp_path):
        whole = path.read_bytes()
        if _refusal("plain", path.name):
            continue
        ends = [found.start() for found in re.finditer(rb"\$End", whole)]
        for start, end in pairwise([0, *ends]):
            path.write_bytes(whole[: (start + end) // 2])
            with pytest.raises(ValueError, match=r"is missing; save the mesh again|it holds no cells"):
                files.read(str(path))
            files._read.cache_clear()


def test_a_file_of_one_partition_alone_is_refused(tmp_path: Path) -> None:
    gmsh.clear()
    gmsh_corpus.partitioned()
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.PartitionSplitMeshFiles", 1)
    try:
        gmsh.write(str(tmp_path / "plate.msh"))
    finally:
        gmsh.option.setNumber("Mesh.PartitionSplitMeshFiles", 0)
    found = sorted(tmp_path.glob("plate_*.msh"))
    assert len(found) == 3
    for number, path in enumerate(found, 1):
        with pytest.raises(
            ValueError, match=rf"the file holds partition {number} of 3 alone; save the mesh in one file"
        ):
            files.read(str(path))
