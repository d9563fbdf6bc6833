"""The scenes of the library: each runs from its file and from Python to the same numbers, and says beforehand what it does."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from support.folders import DOCS
from support.processes import Command

import warmslip
from warmslip.model import meshes
from warmslip.report import cost
from warmslip.scene import plan
from warmslip.scene.reader import library
from warmslip.studies import refinement_study

# one number of each, regression: norm of the last state, or what its file states
PINNED = {
    "heat_slab": ("theta_L2", 4.590521916),
    "quasistatic_punch": ("u_V", 0.0128852955),
    "elastic_drop": ("w_L2", 0.9097956351),
    "sliding_block": ("theta_L2", 0.1813131821),
    "brake_pad": ("theta_L2", 1.026810617),
    "two_materials": ("u_V", 0.06233801862),
    "plate_with_hole": ("theta_L2", 2.363267372),
    "block_with_hole": ("u_V", 0.088526593),
    "creep_column": ("u_L2", 0.3169927902),
    "hertz": ("u_V", 0.1941622024),
    "belt": ("w_L2", 0.2826249710),
    "drum": ("theta_L2", 1.664430192),
    "quarter_sphere": ("u_V", 0.01781753075),
    "wavy_road": ("w_L2", 0.00477215511),
}
LARGE = {"paper_printed", "paper_mixed", "paper_isotropic", "paper_consistent", "block_3d"}  # the studies run them


def test_every_scene_has_its_number() -> None:
    assert set(library()) == set(PINNED) | LARGE


def test_first_steps_lists_what_the_command_lists(command: Command) -> None:
    page = (DOCS / "tutorial.md").read_text()
    display = page.partition("$ warmslip list\n")[2].partition("$ ")[0]
    assert display == command("list").stdout


@pytest.mark.parametrize("name", PINNED)
def test_a_scene_from_its_file_and_from_python(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path(str(resources.files("warmslip") / "scenes"))
    result = warmslip.run(warmslip.load(name))
    assert result.outcome == "completed"
    norm, value = PINNED[name]
    assert result.summary["norms"][norm] == pytest.approx(value, rel=2e-9)
    for file in (*folder.glob("*.msh"), folder / f"{name}.toml"):  # elsewhere, the mesh beside it
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path.parent)
    again = warmslip.run(warmslip.load(tmp_path / f"{name}.toml"))
    assert again.summary["norms"] == result.summary["norms"]


def test_the_thrown_block_stops_where_coulomb_says() -> None:
    """V^2/(2 mu g) on, with half of its energy in it as heat but for what damping takes."""
    result = warmslip.run(warmslip.load("sliding_block"))
    assert result.u[:, 0].mean() == pytest.approx(1 / (2 * 0.2 * 10), rel=2e-2)
    assert np.abs(result.w[:, 0]).max() < 1e-4


def test_the_dropped_block_jumps_up_again() -> None:
    """Without friction and viscosity nearly all of its speed comes back."""
    result = warmslip.run(warmslip.load("elastic_drop"))
    assert 0.9 < result.w[:, 1].mean() < 1


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


@pytest.mark.parametrize("name", ["quasistatic_punch", "heat_slab", "two_materials", "sliding_block"])
def test_a_study_of_a_scene_without_some_blocks(name: str, tmp_path: Path) -> None:
    """Its errors fall, those of absent fields are 0, and the axes keep their ratio."""
    levels, reference = ([8, 16], 32) if name == "heat_slab" else ([4, 8], 16)
    scene = warmslip.load(name).override(**{"time.end": 0.25})
    rows = refinement_study.study(scene, levels=levels, reference=reference)
    assert (rows[0]["e_u_V"] > rows[1]["e_u_V"] > 0) == scene.moves
    assert (rows[0]["e_theta_L2"] > rows[1]["e_theta_L2"] > 0) == (scene.heat is not None)
    counts = scene.mesh.counts
    assert rows[0]["unknowns"] == (2 * scene.moves + (scene.heat is not None)) * (levels[0] + 1) * (
        levels[0] * counts[1] // counts[0] + 1
    )


def test_a_moving_support_has_the_velocity_of_every_step_size() -> None:
    """Members of a study share their data; each has its own step."""
    scene = warmslip.load("quasistatic_punch").override(**{"mesh.n": 4, "time.steps": 8})
    alone = warmslip.run(scene.override(**{"time.steps": 4})).u
    shared = warmslip.discretise(scene)
    run = warmslip.Simulation(
        scene.override(**{"time.steps": 4}),
        discretisation=replace(shared, scene=scene.override(**{"time.steps": 4})),
    )
    assert len(list(run.steps())) == 4
    assert np.abs(shared.field(run.stepper.u) - alone).max() <= 1e-15


@pytest.mark.parametrize(("name", "words"), [("plate_with_hole", "no power of two"), ("brake_pad", "are not nested")])
def test_what_cannot_be_refined_is_said(name: str, words: str) -> None:
    with pytest.raises(warmslip.SceneError, match=words):
        refinement_study.study(warmslip.load(name), levels=[3, 6], reference=12)


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["plate_with_hole", "block_with_hole", "brake_pad", "heat_slab"])
def test_two_ranks_give_the_answer_of_one(command: Command, tmp_path: Path, name: str) -> None:
    summaries = []
    for ranks in (1, 2):
        result = command("run", name, "--out", f"run{ranks}", ranks=ranks)
        assert result.returncode == 0, result.stderr
        summaries.append(json.loads((tmp_path / f"run{ranks}/summary.json").read_text()))
    assert summaries[1]["norms"] == pytest.approx(summaries[0]["norms"], rel=1e-9)
    assert summaries[1]["contact"]["normal_force"] == pytest.approx(summaries[0]["contact"]["normal_force"], rel=1e-9)


def test_the_column_creeps_as_its_two_exponentials_say() -> None:
    """The final contact force is that of its file; the touch is where the Kelvin-Voigt column reaches the gap."""
    simulation = warmslip.Simulation(warmslip.load("creep_column"))
    force = [report.normal_force for _, report in simulation.steps()]
    young, height, stiffness, gap, traction = 3.0, 2.0, 7.0, 0.3, 1.2
    final = stiffness * (height * (traction + stiffness * gap) / (young + stiffness * height) - gap)
    assert final == pytest.approx(0.618, abs=5e-4)  # as its file states
    assert force[-1] == pytest.approx(final, rel=1e-11)
    touch = -0.5 * np.log(1 - gap / height / (traction / young))
    assert simulation.scene.step * np.count_nonzero(np.array(force) == 0) == pytest.approx(touch, abs=0.05)


@pytest.mark.parametrize(("gap", "within"), [("(x - 6)**2 / 8", 1e-2), (None, 2e-2)])
def test_the_cylinder_presses_as_hertz_says(gap: str | None, within: float) -> None:
    """From a block of finite size: peak pressure and half-width belong to the force within a hundredth for Hertz's parabola. The
    circle of the scene is steeper at the edge of the contact."""
    scene = warmslip.load("hertz")
    simulation = warmslip.Simulation(scene.override(**{"contact.gap": gap}) if gap else scene)
    for state, report in simulation.steps():
        pressure, force = state.contact["pressure"], report.normal_force
    peak = np.sqrt(force / (1 - 0.3**2) / (np.pi * 4.0))
    x, weights = (
        np.asarray(simulation.discretisation.surface.positions)[:, 0] - 6,
        np.asarray(simulation.discretisation.surface.weights),
    )
    width = 2 * np.sqrt((weights * pressure) @ x**2 / force)
    assert pressure.max() == pytest.approx(peak, rel=within)
    assert width == pytest.approx(2 * force / (np.pi * peak), rel=within)


def test_half_the_cylinder_is_the_whole_one() -> None:
    """Half of Hertz's block on a symmetry plane, with friction: the whole block to 1e-12."""
    whole = warmslip.load("hertz").override(**{"mesh.n": [48, 24], "contact.friction": {"coefficient": 0.3}})
    half = whole.override(
        **{
            "mesh.n": [24, 24],
            "mesh.lengths": [6.0, 6.0],
            "contact.gap.at": [0.0, -4.0],
            "supports.displacement": {"top": [0.0, "-0.25 * t"], "left": [0.0, "free"]},
        }
    )
    ends = []
    for scene, shift in ((whole, 6.0), (half, 0.0)):
        simulation = warmslip.Simulation(scene)
        for _, report in simulation.steps():
            force = report.normal_force
        x = np.asarray(simulation.discretisation.mesh.nodes) - [shift, 0.0]
        u = np.asarray(simulation.discretisation.field(simulation.stepper.u))
        right = x[:, 0] >= -1e-12
        order = np.lexsort(np.round(x[right].T, 9))
        ends.append((u[right][order], force))
    assert ends[1][1] == pytest.approx(ends[0][1] / 2, rel=1e-12)
    assert np.abs(ends[0][0] - ends[1][0]).max() <= 1e-12 * np.abs(ends[0][0]).max()


def test_the_quarter_sphere_presses_as_hertz_says() -> None:
    simulation = warmslip.Simulation(warmslip.load("quarter_sphere"))
    for state, report in simulation.steps():
        pressure, force = state.contact["pressure"], 4 * report.normal_force
    modulus, radius = 1 / (1 - 0.3**2), 2.0
    peak = (6 * force * modulus**2 / (np.pi**3 * radius**2)) ** (1 / 3)
    assert pressure.max() == pytest.approx(peak, rel=2e-2)
    x, weights = (
        np.asarray(simulation.discretisation.surface.positions),
        np.asarray(simulation.discretisation.surface.weights),
    )
    contact_radius = np.sqrt(2.5 * 4 * (weights * pressure) @ (x[:, :2] ** 2).sum(axis=1) / force)
    assert contact_radius == pytest.approx((3 * force * radius / (4 * modulus)) ** (1 / 3), rel=4e-2)


def test_the_belt_takes_the_block_along() -> None:
    """The block gains mu g while it slips, and moves with the belt when it sticks."""
    simulation = warmslip.Simulation(warmslip.load("belt"))
    speeds = []
    for state, report in simulation.steps():
        speeds.append((state.time, float(state.w[:, 0].mean()), report.stick))
    slipping = [(t, speed) for t, speed, stick in speeds if 0.2 < t < 0.6]
    assert max(abs(speed - 0.6 * t) for t, speed in slipping) < 1e-3
    assert speeds[-1][2] > 15
    assert speeds[-1][1] == pytest.approx(0.4, rel=2e-2)


def test_the_drum_drags_the_shoe_with_its_friction() -> None:
    simulation = warmslip.Simulation(warmslip.load("drum"))
    for _, report in simulation.steps():
        last = report
    assert last.open > 0 and last.stick == 0
    assert last.friction_traction[0] == pytest.approx(-0.3 * last.normal_force, rel=1e-12)
    reactions = simulation.discretisation.field(simulation.stepper.reactions)
    assert reactions.sum(axis=0) == pytest.approx([0.3 * last.normal_force, -last.normal_force], rel=1e-10)
    assert last.balances.foundation_work == pytest.approx(last.balances.friction, rel=1e-10)


def test_the_waves_shake_the_body_and_do_not_drag_it() -> None:
    simulation = warmslip.Simulation(warmslip.load("wavy_road"))
    touching = []
    for state, report in simulation.steps():
        assert np.abs(state.contact["friction traction"]).max() == 0
        touching.append(report.stick + report.slip)
    assert min(touching[10:]) > 0 and max(touching[10:]) < len(state.contact["gap"])  # always in part


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


SAID = {
    **{f"paper_{reading}": ["the largest strain is 2"] for reading in ("consistent", "isotropic", "mixed", "printed")},
    "brake_pad": [
        "the friction coefficient of 'bottom' falls from 0.4 to 0.3 over a slip speed of 0.5, which may feed vibrations",
        "the friction of 'bottom', 0.4, heats a body that expands and then presses harder: rounding may then grow",
        "the friction coefficient is 0.4, and no value of a coefficient is known up to which every step has one solution",
    ],
    "block_with_hole": ["the largest strain is 23.3 %"],
    "creep_column": ["the body sinks into the foundation by 0.0882, 4.4 %"],
    "sliding_block": ["18 of 153 temperatures lie below 0"],
    "wavy_road": ["the gap of 'bottom' is -0.01 at its nearest point", "the body sinks into the foundation by 0.0142"],
}


@pytest.mark.parametrize("name", [name for name in library() if name != "hertz"])
def test_what_a_run_says(name: str) -> None:
    message, expected = warmslip.run(warmslip.load(name)).summary["warnings"], SAID.get(name, [])
    assert len(message) == len(expected) and all(
        one.startswith(words) for one, words in zip(message, expected, strict=True)
    ), message
