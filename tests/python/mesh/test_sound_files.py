"""Meshes that are sound give the right answer, or are refused with the fault and its cure.

A plate, 2 x 1, with E = 1000 and nu = 0, rests on a foundation of stiffness 1e4. Its top goes down by 0.01. The force of the
whole bottom is 2 * 0.01 / (1e-4 + 1e-3).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.folders import TESTS

import warmslip
from warmslip.mesh import files, measures
from warmslip.scene import plan
from warmslip.scene.reader import build

FOLDER = TESTS / "fuzz" / "corpus" / "mesh"
SOUND = [
    "signed_groups_41", "signed_groups_41_binary", "facets_twice_bottom_41", "facets_twice_top_22", "opposite_senses",
    "two_groups_22", "unused_interface_41", "partitioned_41", "plane_noise", "second_order_41", "quadrangles_41", "mixed_22",
    "embedded_41_binary",
]  # fmt: skip


def scene(name: str, **tables: Any) -> warmslip.Scene:
    data: dict[str, Any] = {
        "mesh": {"file": str(FOLDER / f"{name}.msh")},
        "time": {"end": 1.0, "steps": 1},
        "elasticity": {"young": 1000.0, "poisson": 0.0, "assumption": "plane_strain"},
        "supports": {"displacement": {"top": [0.0, "-0.01 * t"]}},
        "contact": {"part": "bottom", "stiffness": 1e4},
    }
    return build(data | tables)


@pytest.mark.parametrize("name", SOUND)
def test_the_force_on_the_whole_bottom(name: str) -> None:
    found = warmslip.run(scene(name))
    assert found.completed
    assert found.summary["contact"]["normal_force"] == pytest.approx(0.02 / (1e-4 + 1e-3), rel=1e-10)


def test_a_load_on_facets_that_are_there_twice_acts_once() -> None:
    pulled = scene(
        "facets_twice_top_22",
        supports={"displacement": ["bottom"]},
        loads={"traction": {"top": [0.0, -10.0]}},
        contact=None,
    )
    found = warmslip.run(pulled)
    top = np.unique(files.read(str(pulled.mesh.file)).parts["top"])
    assert found.u is not None and found.u[top, 1] == pytest.approx(-0.01, rel=1e-12)
    assert "8 facets occur more than once in a group" in found.summary["warnings"][0]


def test_a_rounded_corner_is_read_without_the_centre_of_its_arc() -> None:
    mesh = files.read(str(FOLDER / "arc_centre_41.msh"))
    assert mesh.notes == ("nodes without a cell, such as centres of arcs, left out: 1",)
    assert len(mesh.nodes) == 67 and len(np.unique(mesh.cells)) == 67
    assert {name: measures.measure(mesh.nodes, part) for name, part in mesh.parts.items()} == pytest.approx(
        {"bottom": 2.0, "top": 2.0}
    )
    assert warmslip.run(scene("arc_centre_41")).completed


@pytest.mark.parametrize("name", ["same_name_41", "same_name_22"])
def test_two_groups_of_one_name_of_which_gmsh_names_one(name: str) -> None:
    with pytest.raises(
        warmslip.SceneError,
        match=r"the physical group 32 of curves has no name, .*: name every group, and each differently$",
    ):
        scene(name)


def test_two_groups_of_one_name_are_joined(tmp_path: Path) -> None:
    whole = (FOLDER / "same_name_41.msh").read_bytes()
    path = tmp_path / "both.msh"
    path.write_bytes(whole.replace(b'3\n1 12 "top"\n', b'4\n1 12 "top"\n1 32 "bottom"\n'))
    found = warmslip.run(scene("same_name_41", mesh={"file": str(path)}))
    assert found.summary["contact"]["normal_force"] == pytest.approx(0.02 / (1e-4 + 1e-3), rel=1e-10)
    assert found.summary["warnings"] == [
        "mesh.file: the groups 32, 31 of curves are all called 'bottom' and taken as one"
    ]


def test_an_interface_is_no_part() -> None:
    why = "'interface' is no boundary part: it has 4 of its 4 facets inside the body; a mesh '.*' has"
    with pytest.raises(warmslip.SceneError, match=f"contact.part: {why} bottom, top"):
        scene("unused_interface_41", contact={"part": "interface", "stiffness": 1e4})
    mesh = {"file": str(FOLDER / "unused_interface_41.msh"), "refine": 1, "graded_to": ["interface"]}
    with pytest.raises(warmslip.SceneError, match=f"graded_to: {why} corners, bottom, top, or give a point"):
        scene("unused_interface_41", mesh=mesh)


def test_points_are_no_part() -> None:
    with pytest.raises(
        warmslip.SceneError, match="'point' is no boundary part: it is a group of points, and parts are curves"
    ):
        scene("embedded_41_binary", contact={"part": "point", "stiffness": 1e4})


def test_the_corners_of_a_curved_cell_are_used_with_a_warning() -> None:
    found = warmslip.run(scene("second_order_41"))
    assert found.summary["warnings"] == [
        "mesh.file: 86 cells are of second or higher order; only their corners are used, and curved sides become straight"
    ]


def test_regions_that_share_cells_are_worth_a_warning() -> None:
    stiff = {"elasticity": {"young": 2e3, "poisson": 0.0, "assumption": "plane_strain"}}
    both = scene("two_groups_22", regions={"body": stiff, "lefthalf": stiff})
    assert plan.plan(both).warnings == [
        "regions.lefthalf: it has 42 cells of the mesh file in common with regions before it, and replaces them"
    ]


def test_explain_prints_every_size() -> None:
    assert plan.plan(scene("two_groups_22")).mesh == [
        "the file: 56 nodes, 86 triangles, area 2",
        "part 'bottom': 8 facets, length 2",
        "part 'top': 8 facets, length 2",
        "no part: 8 facets, length 2",
        "region 'body': 86 triangles, area 2",
        "region 'lefthalf': 42 triangles, area 1",
    ]
    assert "'interface' is no part: it has 4 of its 4 facets inside the body" in plan.text(
        plan.plan(scene("unused_interface_41"))
    )
    assert plan.plan(warmslip.load("paper_mixed")).mesh == []


def test_sizes_in_space() -> None:
    mesh = files.read(str(FOLDER / "prisms_22_binary.msh"))
    assert mesh.notes == ("prisms divided into tetrahedra: 156",)
    assert measures.lines(mesh)[2:] == [
        "part 'bottom': 52 facets, area 2",
        "part 'top': 52 facets, area 2",
        "part 'front': 36 facets, area 2",
        "no part: 72 facets, area 4",
        "region 'body': 468 tetrahedra, volume 2",
    ]
