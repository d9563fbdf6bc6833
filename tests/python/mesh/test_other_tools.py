"""Meshes of other tools through meshio: parts and regions from cell sets."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import warmslip
from warmslip.mesh import files, measures, other_tools
from warmslip.scene.reader import build

POINTS = np.array([[x, y, 0.0] for y in (0, 1) for x in (0, 1, 2)])
CELLS = [("triangle", np.array([[0, 1, 4], [0, 4, 3]])), ("quad", np.array([[1, 2, 5, 4]]))]
LINES = np.array([[0, 1], [1, 2], [3, 4], [4, 5]])
SETS = {
    "bottom": [[], [], [0, 1]],
    "top": [[], [], [2, 3]],
    "left_half": [[0, 1], [], []],
    "right_half": [[], [0], []],
}


def with_sets() -> meshio.Mesh:
    sets = {name: [np.array(block, dtype=int) for block in blocks] for name, blocks in SETS.items()}
    return meshio.Mesh(POINTS, [*CELLS, ("line", LINES)], cell_sets=sets)


def numbered(name: str) -> meshio.Mesh:
    data = {name: [np.array([5, 5]), np.array([6]), np.array([1, 1, 2, 2])]}
    return meshio.Mesh(POINTS, [*CELLS, ("line", LINES)], cell_data=data)


def families(path: Path) -> None:
    """Cells of MED are in one family each, and a family in groups."""
    mesh = meshio.Mesh(POINTS, [*CELLS, ("line", LINES)])
    mesh.cell_data["cell_tags"] = [np.array([-6, -6]), np.array([-7]), np.array([-8, -8, -9, -9])]
    mesh.cell_tags = {-6: ["left_half"], -7: ["right_half"], -8: ["bottom", "outside"], -9: ["top", "outside"]}
    meshio.med.write(path, mesh)


def abaqus(path: Path) -> None:
    """As preprocessors write it: numbers from 1, sets of elements."""
    lines = ["*NODE", *(f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(POINTS, 1))]
    number = 0
    for kind, block in (("CPS3", CELLS[0][1]), ("CPS4", CELLS[1][1]), ("T2D2", LINES)):
        lines.append(f"*ELEMENT, TYPE={kind}")
        lines += [f"{(number := number + 1)}, " + ", ".join(str(n + 1) for n in row) for row in block]
    sets = {"bottom": "4, 5", "top": "6, 7", "left_half": "1, 2", "right_half": "3,"}
    for name, members in sets.items():
        lines += [f"*ELSET, ELSET={name}", members]
    path.write_text("\n".join(lines) + "\n")


NUMBERS = {"bottom": "1", "top": "2", "left_half": "5", "right_half": "6"}
BLOCKS = {"left_half": "1", "right_half": "2", "bottom": "3", "top": "4"}
WRITERS: dict[str, tuple[Callable[[Path], Any], dict[str, str]]] = {
    "sets.vtu": (lambda path: with_sets().write(path), {}),
    "numbers.vtu": (lambda path: numbered("part").write(path), NUMBERS),
    "sets.inp": (abaqus, {}),
    "families.med": (families, {}),
    "numbers.bdf": (lambda path: numbered("nastran:ref").write(path), NUMBERS),
}


def sizes(path: Path) -> tuple[files.MeshFile, dict[str, float]]:
    mesh = files.read(str(path))
    found = {name: measures.measure(mesh.nodes, part) for name, part in mesh.parts.items()}
    return mesh, found | {name: measures.measure(mesh.nodes, mesh.cells[own]) for name, own in mesh.regions.items()}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("file", WRITERS)
def test_sets_of_cells_are_parts_and_regions(file: str, tmp_path: Path) -> None:
    writer, names = WRITERS[file]
    writer(tmp_path / file)
    mesh, found = sizes(tmp_path / file)
    assert found.pop("outside", 4.0) == 4.0
    expected = {"bottom": 2.0, "top": 2.0, "left_half": 1.0, "right_half": 1.0}
    assert found == {names.get(name, name): size for name, size in expected.items()}
    assert set(mesh.parts) >= {names.get(name, name) for name in ("bottom", "top")}
    assert mesh.notes == ("quadrangles divided into triangles: 1",)


def test_a_scene_on_a_mesh_of_abaqus(tmp_path: Path) -> None:
    """Keywords of a step do not matter."""
    abaqus(tmp_path / "plate.inp")
    with (tmp_path / "plate.inp").open("a") as file:
        file.write("*STEP\n*NODE OUTPUT\nU\n*ELEMENT OUTPUT, ELSET=bottom\nS\n*END STEP\n")
    found = warmslip.run(
        build(
            {
                "mesh": {"file": str(tmp_path / "plate.inp")},
                "time": {"end": 1.0, "steps": 1},
                "elasticity": {"young": 1000.0, "poisson": 0.0, "assumption": "plane_strain"},
                "supports": {"displacement": {"top": [0.0, "-0.01 * t"]}},
                "contact": {"part": "bottom", "stiffness": 1e4},
            }
        )
    )
    assert found.summary["contact"]["normal_force"] == pytest.approx(0.02 / (1e-4 + 1e-3), rel=1e-10)


@pytest.mark.filterwarnings("ignore")
def test_blocks_of_exodus_are_parts_and_regions(tmp_path: Path) -> None:
    pytest.importorskip("netCDF4", reason="meshio reads Exodus with the package netCDF4")
    blocks = [*CELLS, ("line", LINES[:2]), ("line", LINES[2:])]
    meshio.Mesh(POINTS, blocks).write(tmp_path / "plate.exo")
    assert sizes(tmp_path / "plate.exo")[1] == {"1": 1.0, "2": 1.0, "3": 2.0, "4": 2.0}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("*ELSET, ELSET=bottom\n4, 5", "*ELSET, ELSET=bottom\n", "its cell set 'bottom' is empty; list its cells"),
        (
            "right_half\n3,",
            "right_half\nbottom, top, left_half",
            "'right_half' lists other sets, or",
        ),
        ("TYPE=CPS4", "TYPE=CPS4, elset = bottom", "some .ELEMENT lines share an ELSET or have none"),
        (
            "*ELEMENT, TYPE=CPS3",
            "*NODE\n9, 5, 5, 0\n*ELEMENT, TYPE=CPS3",
            "several .NODE blocks, of which meshio reads the last",
        ),
        (
            "*ELEMENT, TYPE=CPS3",
            "*Include, input=more.inp\n*ELEMENT, TYPE=CPS3",
            "it includes another file; write the mesh into one",
        ),
        ("TYPE=CPS4", "TYPE=CPS4, ELSET=right", "some .ELEMENT lines share an ELSET or have none; give each line"),
        ("TYPE=T2D2", "TYPE=NOTHING", "meshio cannot read it .*; export the mesh again, or as MSH 4.1"),
        ("7, 5, 6", "7, 5, 66", "meshio cannot read it .66.; export the mesh again"),
        (
            "*ELEMENT, TYPE=T2D2",
            "*ELSET, ELSET=early\n1, 2\n*ELEMENT, TYPE=T2D2",
            "'early' lists other sets, or stands before some of the cells; list its cells",
        ),
    ],
    ids=[
        "empty",
        "set of sets",
        "shared",
        "nodes",
        "include",
        "half of the lines",
        "type",
        "node",
        "early",
    ],
)
def test_what_would_be_lost_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    abaqus(tmp_path / "plate.inp")
    text = (tmp_path / "plate.inp").read_text()
    assert old in text
    (tmp_path / "plate.inp").write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=words):
        files.read(str(tmp_path / "plate.inp"))


@pytest.mark.filterwarnings("ignore")
def test_cells_in_no_set_are_in_none(tmp_path: Path) -> None:
    """meshio marks them by -1 in the array that it writes."""
    mesh = with_sets()
    del mesh.cell_sets["top"], mesh.cell_sets["left_half"]
    mesh.write(tmp_path / "plate.vtu")
    assert sizes(tmp_path / "plate.vtu")[1] == {"bottom": 2.0, "right_half": 1.0}
    mesh = with_sets()
    mesh.cell_sets["right_half"] = [np.empty(0, int)] * 3
    mesh.write(tmp_path / "empty.vtu")
    with pytest.raises(ValueError, match="its cell set 'right_half' is empty"):
        files.read(str(tmp_path / "empty.vtu"))


@pytest.mark.filterwarnings("ignore")
def test_several_arrays_are_no_sets(tmp_path: Path) -> None:
    mesh = numbered("part")
    mesh.cell_data["other"] = mesh.cell_data["part"]
    mesh.write(tmp_path / "plate.vtu")
    found = files.read(str(tmp_path / "plate.vtu"))
    assert not found.parts and not found.regions
    (remark,) = found.remarks
    assert remark.startswith("its cells have several integer arrays (part, other), and none is taken")


def test_cells_that_do_not_divide_are_refused(tmp_path: Path) -> None:
    mesh = meshio.Mesh(POINTS, [("polygon", np.array([[0, 1, 2, 5, 4, 3]]))])
    mesh.write(tmp_path / "plate.vtu")
    with pytest.raises(ValueError, match="it holds cells of the type polygon; mesh with triangles"):
        files.read(str(tmp_path / "plate.vtu"))


@pytest.mark.parametrize("suffix", [".vtu", ".inp", ".med", ".exo", ".bdf"])
def test_what_is_no_mesh_is_refused(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"noise{suffix}"
    path.write_bytes(b"\x00\x01 no mesh \xff" * 20)
    with pytest.raises(ValueError, match=r"meshio cannot read it|it holds no nodes|meshio needs the package"):
        files.read(str(path))


@pytest.mark.parametrize(
    ("members", "words"),
    [([[0], [1]], "lists other sets"), ([0, 3], "lists a cell that the file does not hold"), ([-1], "lists a cell")],
)
def test_what_is_no_set_of_cells_is_refused(members: list[Any], words: str) -> None:
    """meshio puts sets into a set of sets where a block of cells should be."""
    with pytest.raises(ValueError, match=f"its cell set 'some' {words}"):
        other_tools._members("some", members, 3)


def test_a_block_without_cells_is_none(tmp_path: Path) -> None:
    abaqus(tmp_path / "plate.inp")
    text = (tmp_path / "plate.inp").read_text()
    (tmp_path / "plate.inp").write_text(
        text.replace("3, 2, 3, 6, 5\n", "").replace("*ELSET, ELSET=right_half\n3,\n", "")
    )
    mesh, found = sizes(tmp_path / "plate.inp")
    assert found == {"left_half": 1.0}
    assert mesh.no_parts["bottom"] == "has 1 of 2 facets that are no side of any cell"
    assert mesh.notes == ("nodes without a cell, such as centres of arcs, left out: 2",)
