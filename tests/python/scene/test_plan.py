"""What a scene says before it runs: fields and solver, what can be left out, what is suspicious."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from support.processes import Command

import warmslip
from warmslip.model import meshes
from warmslip.report import cost
from warmslip.scene import plan
from warmslip.scene.reader import library


@pytest.mark.parametrize("name", library())
def test_a_plan_needs_no_run(name: str) -> None:
    scene = warmslip.load(name)
    found = plan.plan(scene)
    assert found.fields
    assert found.every_step
    assert found.removable == {}  # the library carries nothing that does nothing
    assert plan.pruned(scene) == scene
    message = plan.text(found)
    assert ("no viscosity" in message) == (scene.moves and scene.viscosity is None)
    assert ("displacement" in message) == scene.moves


IDLE: dict[str, dict[str, Any]] = {
    "contact.friction": {"contact.friction.coefficient": 0.0},
    "contact.heat_exchange": {"contact.heat_exchange.conductance": 0.0},
    "heat.heating": {"heat.heating.tensor": 0.0},
    "heat.expansion": {"heat.expansion.tensor": [[0.0, 0.0], [0.0, 0.0]]},
    "elasticity": {"elasticity": {"lame": [0.0, 0.0]}},
    "viscosity": {"viscosity": {"young": 0.0, "poisson": 0.1, "assumption": "plane_stress"}},
    "inertia": {"inertia.density": 0.0},
    "loads.body": {"loads.body": [0.0, 0.0]},
    "loads.traction.left": {"loads.traction.left": [0.0, 0.0]},
    "loads.heat_flux.left": {"loads.heat_flux": {"left": 0.0}, "supports.temperature": ["top"]},
    "contact": {"contact": {"part": "bottom", "stiffness": 0.0}},
    "heat": {
        "heat": {"conductivity": 1.0, "expansion": {"tensor": 1.0}},
        "contact.heat_exchange.foundation_temperature": 0.0,
    },
}


@pytest.mark.parametrize("key", IDLE)
def test_what_can_be_left_out_changes_nothing(key: str) -> None:
    values = {"mesh.n": 6, "time.steps": 4, "contact.heat_exchange.foundation_temperature": 10.0} | IDLE[key]
    scene = warmslip.load("paper_isotropic").override(**values)
    assert key in plan.removable(scene)
    smaller = plan.pruned(scene)
    assert smaller != scene
    full, less = warmslip.run(scene), warmslip.run(smaller)
    assert full.outcome == less.outcome == "completed"
    for name in ("u", "w", "theta"):
        one, other = getattr(less, name), getattr(full, name)
        assert one is not None or np.abs(other).max() == 0
        if one is not None:
            assert np.abs(one - other).max() <= 1e-12 * max(1e-300, np.abs(other).max())


def test_heat_is_left_out_of_several_contact_parts() -> None:
    cold = {"part": "bottom", "stiffness": 1e3, "heat_exchange": {"conductance": 1.0}}
    walls = [cold, {"part": "left", "stiffness": 10.0}]
    values = {"mesh.n": 4, "time.steps": 3, "supports.temperature": ["top"], "loads.traction": {}}
    scene = warmslip.load("paper_isotropic").override(heat={"conductivity": 1.0}, contact=walls, **values)
    smaller = plan.pruned(scene)
    assert smaller.heat is None
    assert np.array_equal(warmslip.run(smaller).u, warmslip.run(scene).u)
    apart = scene.override(contact=[*walls, {"part": "right", "heat_exchange": {"conductance": 1.0}}])
    assert "heat" not in plan.removable(apart)  # that part would be left with nothing


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("quasistatic_punch", "kept while statuses stay"),
        ("brake_pad", "computed in every iteration"),
        ("block_3d", "computed in every iteration"),
    ],
)
def test_a_plan_says_what_newton_keeps(scene: str, words: str) -> None:
    assert words in plan.text(plan.plan(warmslip.load(scene)))


@pytest.mark.parametrize(
    "change",
    [
        {"contact.heat_exchange.foundation_temperature": "0 * t"},
        {"heat.source": 1.0},
        {"initial.temperature": 1.0},
        {"contact.friction": {"coefficient": 0.2}, "contact.friction_heating": {"share": 0.1}},
        {"heat.heating": {"tensor": 1.0}},
    ],
)
def test_heat_that_may_be_there_is_not_left_out(change: dict[str, Any]) -> None:
    cold = {"heat": {"conductivity": 1.0}, "contact.heat_exchange.foundation_temperature": 0.0}
    scene = warmslip.load("paper_isotropic").override(**cold)
    assert "heat" in plan.removable(scene)
    assert "heat" not in plan.removable(scene.override(**change))


def test_the_command_says_what_it_costs(command: Command) -> None:
    output = command("explain", "paper_mixed", "--set", "mesh.n=8").stdout
    assert "CHOLMOD" in output
    assert "243 unknowns, 9 contact points" in output
    assert "ms a step" in output
    assert "contact on 'bottom': whether it touches is known only by running" in output
    assert "cost here" not in command("explain", "heat_slab", "--no-trial").stdout


def test_a_plan_lists_what_is_held() -> None:
    """In all directions, in some, at points and on springs."""
    scene = warmslip.load("quasistatic_punch").override(
        supports={
            "displacement": {"top": ["0.01 * t", 0.0], "left": [0.0, "free"]},
            "points": [{"at": [1.0, 0.5], "displacement": ["free", 0.0]}],
            "springs": {"right": {"stiffness": 1.0}},
        }
    )
    held = [line for line in plan.plan(scene).fields if "held" in line or "springs" in line]
    assert held == [
        "'top' is held in all directions",
        "'left' is held along x",
        "the node nearest to (1, 0.5) is held along y",
        "'right' is on springs or dashpots",
    ]


def test_what_a_plan_counts_and_warns_of() -> None:
    found = cost.measured(warmslip.load("two_materials"))
    assert any(line.startswith("region 'insert': ") and line.endswith("of 512 cells") for line in found.fields)
    sunk = plan.plan(warmslip.load("quasistatic_punch").override(**{"contact.gap": -0.01}))
    assert "the gap of 'bottom' is negative: the body starts inside the foundation" in sunk.suspicious


def test_what_is_there_and_suspicious_has_its_own_paragraph() -> None:
    scene = warmslip.load("quasistatic_punch")
    assert "second look" not in plan.text(plan.plan(scene))
    odd = scene.override(
        **{"contact.gap": -0.01, "loads.traction": {"bottom": [0.0, "t"]}, "contact.friction.cohesion": 0.1}
    )
    found = plan.plan(odd.override(**{"initial.velocity": [1.0, 0.0]}))
    _, heading, remarks = plan.text(found).partition("there, and worth a second look\n")
    assert heading and len(remarks.splitlines()) == 4
    for words in ("starts inside", "'bottom', which is also a contact part", "has a cohesion", "moves nothing"):
        assert words in remarks
        assert not any(words in line for line in found.missing)
    idle = plan.plan(scene.override(**{"loads.traction": {"bottom": [0.0, 0.0]}}))
    assert idle.suspicious == []


def test_a_plan_states_the_heat_that_contact_leads_and_makes() -> None:
    scene = warmslip.load("brake_pad")
    exchange, share = scene.contacts[0].heat_exchange, scene.contacts[0].friction_heating.share
    values = {"contact.heat_exchange.conductance": 2.0, "contact.heat_exchange.per_pressure": 0.5}
    message = plan.text(plan.plan(scene.override(**values)))
    assert "heat exchange on 'bottom' at its contact nodes, with the conductance 2 + 0.5 times the pressure" in message
    assert f"heat of friction on 'bottom', of which {share:g} goes into the body" in message
    assert (exchange.per_pressure > 0) == ("times the pressure" in plan.text(plan.plan(scene)))
    assert "times the pressure" not in plan.text(plan.plan(warmslip.load("paper_mixed")))


def test_a_bent_contact_part_is_worth_a_second_look(tmp_path: Path) -> None:
    """Two sides of a square as one part: their corner has a point for each."""
    bent = warmslip.load("quasistatic_punch").override(**{"mesh.n": 4, "time.steps": 5, "contact.part": "left"})
    assert not any("differ in normal" in message for message in cost.measured(bent).suspicious)
    mesh = meshes.make_mesh(bent)
    parts = {name: np.array(facets) for name, facets in mesh.parts.items()}
    parts = {"top": parts["top"], "shoe": np.concatenate([parts["left"], parts["bottom"]])}
    cells = [("triangle", np.array(mesh.cells)), ("line", np.concatenate(list(parts.values())))]
    tags = [np.ones(len(mesh.cells), int), np.repeat([2, 3], [len(f) for f in parts.values()])]
    meshio.Mesh(
        np.column_stack([mesh.nodes, np.zeros(len(mesh.nodes))]),
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"body": np.array([1, 2]), "top": np.array([2, 1]), "shoe": np.array([3, 1])},
    ).write(tmp_path / "bent.msh", file_format="gmsh22")
    file = bent.override(
        **{"mesh.file": str(tmp_path / "bent.msh"), "mesh.n": None, "mesh.shape": None, "contact.part": "shoe"}
    )
    (message,) = [s for s in cost.measured(file).suspicious if "differ in normal" in s]
    assert message.startswith("10 contact points at 9 nodes: around 1 of them")
