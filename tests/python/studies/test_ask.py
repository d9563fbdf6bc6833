"""Errors that are asked for: the answer has them, the choice is the cheap one, what cannot be had is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaign import asked
from support.processes import Command

import warmslip
from warmslip import SceneError
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene
from warmslip.studies import ask, pilots
from warmslip.studies.companions import QUANTITIES, Companion, march
from warmslip.studies.error_estimate import JUMPS, ORDERS, orders

TUNED = 10_000  # seed of the scenes that a factor was chosen on
HOT = {"contact.heat_exchange.foundation_temperature": 10.0}
FLAT = {
    "mesh": {"n": 4},
    "time": {"end": 1.0, "steps": 4},
    "heat": {"conductivity": 1.0},
    "supports": {"temperature": ["top"]},
}
SMOOTH = Scene.model_validate(FLAT | {"heat": {"conductivity": 1.0, "source": "t * sin(3.14159265 * x)"}})
CASES: dict[str, tuple[Scene, float, str]] = {
    "paper": (warmslip.load("paper_mixed").override(**HOT), 0.1, "all"),
    "mean temperature": (warmslip.load("heat_slab"), 0.02, "theta_mean"),
    "smooth": (SMOOTH, 0.01, "theta_L2"),
    "file": (warmslip.load("plate_with_hole"), 0.1, "all"),
    "space": (warmslip.load("block_3d").override(**HOT), 0.1, "theta_L2"),
}


def true_error(one: Scene, quantities: list[str]) -> float:
    """Against twice the cells and four times the steps, whose own error is a part of it."""
    table, time = one.mesh, one.time
    finer: dict[str, Any] = (
        {"mesh.refine": table.refine + 1} if table.file else {"mesh.n": [2 * n for n in table.counts]}
    )
    finer |= {"time.steps": 4 * time.steps} if time.tolerance is None else {"time.tolerance": time.tolerance / 16}
    fine, run = Companion(one.override(**finer)), Companion(one)
    (distance,), size = march([fine, run], [(0, 1)])
    return max(distance.values[name] / size[name] for name in quantities)


@pytest.mark.parametrize("case", CASES)
def test_the_error_is_what_was_asked_for(case: str) -> None:
    scene, error, of = CASES[case]
    answer = ask.solve(scene, error, of, seconds=20.0)
    assert answer.error <= error
    assert answer.simulation.outcome == "completed"
    assert true_error(answer.scene, answer.plan.quantities) <= error
    assert len(answer.tries) <= ask.TRIES
    assert answer.seconds >= answer.plan.pilot_seconds > 0


def test_a_choice_that_errs_too_much_is_followed_by_a_finer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = ask._plan

    def too_coarse(*given: Any) -> Any:
        found, runs = plan(*given)
        setting = replace(found.choice.setting, steps="equal", count=16)
        found.choice = replace(found.choice, setting=setting, scene=runs.make(setting))
        return found, runs

    monkeypatch.setattr(ask, "_plan", too_coarse)
    answer = ask.solve(warmslip.load("heat_slab"), 0.02, "theta_L2")
    assert answer.error <= 0.02
    assert len(answer.tries) >= 2 and answer.tries[-1].setting.count > 16


SUDDEN: dict[str, Any] = {
    "mesh": {"n": 8},
    "time": {"end": 1.0, "steps": 8},
    "inertia": {"density": 0.3},
    "elasticity": {"lame": [10.0, 8.0]},
    "viscosity": {"lame": [3.0, 3.0]},
    "supports": {"displacement": ["top"]},
    "loads": {"body": [0.3, -0.8], "traction": {"left": [0.4, -0.2]}},
    "contact": {"part": "bottom", "stiffness": 100.0, "friction": {"coefficient": 0.4}},
}


def test_an_order_in_time_at_its_bound_asks_for_a_finer_pilot() -> None:
    lines: list[str] = []
    found = ask.plan(asked.scene(25, TUNED), 0.1, say=lines.append)  # a viscous body whose loads begin at once
    assert "pilot runs: equal steps, up to 64" in lines
    assert "pilot runs: equal steps, up to 128" in lines  # although its choice takes fewer steps
    assert found.orders["equal steps"]["w_L2"] > 0.45
    assert found.choice.setting.count < pilots.FAR * 128
    assert not [one for one in lines if "graded steps, up to 128" in one]  # their order is seen at once


def test_finer_pilots_leave_time_for_the_run() -> None:
    scene = build({key: value for key, value in SUDDEN.items() if key != "viscosity"})
    runs = pilots.Pilots(scene, ["u_V"], lambda _: None, limit=1.0)
    runs.measure_space("uniform", 32)
    runs.measure_time("equal", 64)
    choice = runs.cheapest("uniform", "equal", 0.01, 1e3, 1e12)  # its order in time is the smallest that is believed
    runs.seconds = 0.6
    assert not runs.look_closer([choice])
    runs.seconds, runs.limit = 0.2, 10.0
    assert runs.look_closer([choice])


def test_waves_without_damping_have_half_the_order_of_a_jump() -> None:
    damped = build(SUDDEN)
    bare = build({key: value for key, value in SUDDEN.items() if key != "viscosity"})
    assert orders(damped, "time") == ORDERS["time"]
    assert orders(bare, "time") == (JUMPS, ORDERS["time"][1])
    assert orders(bare, "space") == ORDERS["space"]
    still = build({key: value for key, value in SUDDEN.items() if key not in ("viscosity", "inertia")})
    assert orders(still, "time") == ORDERS["time"]


@pytest.mark.parametrize("p", [0.5, 1.0, 1.5])
def test_an_order_is_also_seen_between_pilot_and_answer(p: float) -> None:
    gap = dict.fromkeys(QUANTITIES, 8.0**-p)
    model = pilots.Model(gap, dict.fromkeys(QUANTITIES, 0.4), 8.0, gap)
    assert model.order_to("u_V", 40.0, 40.0**-p, (0.1, 2.0)) == pytest.approx(p, rel=1e-12)
    assert model.order_to("u_V", 40.0, 40.0**-p, (0.1, 0.3)) == 0.3
    assert model.order_to("u_V", 10.0, 10.0**-p, (0.1, 2.0)) == 0.4  # too near to each other
    assert model.order_to("u_V", 40.0, 0.0, (0.1, 2.0)) == 0.4


@pytest.mark.parametrize("power", [1.0, 1.3, 2.0])
@pytest.mark.parametrize("time", [0.3, 1.0, 3.0])
def test_how_parts_add_up_is_found_from_three_distances(power: float, time: float) -> None:
    both = pilots.together(1.0, time, power)
    assert both == pytest.approx((1 + time**power) ** (1 / power), rel=1e-14)
    assert pilots.power_of(1.0, time, both) == pytest.approx(power, rel=1e-9)
    assert pilots.power_of(1.0, time, 2 + time) == 1.0 and pilots.power_of(1.0, time, 0.0) == 2.0
    assert pilots.together(0.0, 0.0, power) == 0.0


def test_a_part_that_hardly_matters_does_not_tell_how_parts_add_up() -> None:
    runs = pilots.Pilots(warmslip.load("heat_slab"), ["theta_L2"], lambda _: None)
    runs.learn_power("theta_L2", 1.0, 0.5, np.hypot(1.0, 0.5))
    assert runs.power["theta_L2"] == pytest.approx(2.0)
    runs.learn_power("theta_L2", 1.0, 0.01, 1.01)
    assert runs.power["theta_L2"] == pytest.approx(2.0)


def test_a_coarse_graded_mesh_in_space_is_found() -> None:
    """Half of it cannot be graded: its error in space is that of the pilot runs."""
    answer = ask.solve(asked.scene(10, TUNED), 0.25, seconds=30.0)
    (choice,) = answer.tries
    assert choice.setting.mesh == "graded" and choice.setting.cells < 16
    uniform = next(one for one in answer.plan.alternatives if one.setting.mesh == "uniform")
    assert uniform.seconds > 2 * choice.seconds
    assert asked.true_error(answer) <= 0.25


def test_meshes_in_space_may_be_as_coarse_as_their_pilots() -> None:
    """In space the next size costs several times as much: four cells along a side are enough for a rough answer."""
    runs = pilots.Pilots(asked.scene(10, TUNED), ["u_V"], lambda _: None)
    assert min(one.cells for one in runs.settings("uniform", "equal")) == 4


def test_errors_are_raised_where_waves_jump() -> None:
    for number, factor in ((14, 1.25), (10, 1.0)):  # without viscosity, and without inertia
        runs = pilots.Pilots(asked.scene(number, TUNED), ["u_V"], lambda _: None)
        assert runs.total("u_V", 0.3, 0.4) == pytest.approx(factor * 0.7, rel=1e-15)
        runs.power["u_V"] = 2.0
        assert runs.total("u_V", 0.3, 0.4) == pytest.approx(factor * 0.5, rel=1e-15)


def test_waves_without_damping_need_three_graded_meshes() -> None:
    """Their errors in space grow with the number of steps, and pilots have few."""
    runs = pilots.Pilots(asked.scene(14, TUNED), ["u_V"], lambda _: None)
    assert asked.scene(14, TUNED).mesh.dim == 3 and asked.scene(14, TUNED).viscosity is None
    with pytest.raises(SceneError, match="three graded meshes"):
        runs.measure_space("graded", 16)
    flat = pilots.Pilots(
        build({key: value for key, value in SUDDEN.items() if key != "viscosity"}), ["u_V"], lambda _: None
    )
    damped = pilots.Pilots(build(SUDDEN), ["u_V"], lambda _: None)
    fewest = [min(one.cells for one in runs.settings("graded", "equal")) for runs in (flat, damped)]
    assert fewest == [16, 8]


def test_the_next_setting_may_be_of_another_kind() -> None:
    """Equal steps err more than their pilots showed, and graded ones are cheaper then."""
    answer = ask.solve(asked.scene(17, TUNED), 0.1, seconds=5.0)
    assert [one.setting.steps for one in answer.tries] == ["equal", "graded"]
    assert asked.true_error(answer) <= 0.1


def test_singular_corners_ask_for_a_graded_mesh() -> None:
    scene = warmslip.load("paper_mixed")
    found = ask.plan(scene, 0.03, "u_V", seconds=60.0)
    assert found.choice.setting.mesh == "graded"
    assert found.orders["uniform mesh"]["u_V"] < found.orders["graded mesh"]["u_V"]
    kinds = {(one.setting.mesh, one.setting.steps) for one in [found.choice, *found.alternatives]}
    assert len(kinds) == 6
    assert all(one.seconds >= found.choice.seconds for one in found.alternatives if one.met)
    text = ask.text(found)
    assert "graded to the singular corners" in text and "alternatives" in text
    assert "mesh.graded_to=['corners']" in pilots.keys_of(found.choice.scene)


def test_no_grading_without_a_singular_corner() -> None:
    found = ask.plan(SMOOTH, 0.02, "theta_L2")
    assert {one.setting.mesh for one in [found.choice, *found.alternatives]} == {"uniform"}


def test_meshes_keep_the_ratio_of_their_sides() -> None:
    found = ask.plan(warmslip.load("paper_mixed").override(**{"mesh.n": [3, 4]}), 0.2, seconds=30.0)
    for one in [found.choice, *found.alternatives]:
        assert 4 * one.scene.mesh.counts[0] == 3 * one.scene.mesh.counts[1]


def test_a_smaller_error_costs_more() -> None:
    loose, tight = (ask.plan(warmslip.load("heat_slab"), error, "theta_L2").choice for error in (0.05, 0.005))
    assert tight.seconds > loose.seconds
    assert tight.error <= 0.005 / ask.SAFETY


@pytest.mark.parametrize(
    ("error", "of", "seconds", "message"),
    [
        (0.0, "all", 10.0, "no relative error"),
        (2.0, "all", 10.0, "no relative error"),
        (1e-13, "all", 10.0, "rounding"),
        (0.01, "pressure", 10.0, "unknown; give all"),
        (0.01, "theta_L2", 10.0, "the scene has no theta_L2"),
        (0.1, "u_V", 1e-3, "pilot runs alone took"),
        (0.1, "u_V", -1.0, "no time to run in"),
        (1e-6, "u_V", 5.0, "cannot be had in 5 s; the best is"),
    ],
)
def test_refusals(error: float, of: str, seconds: float, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        ask.plan(warmslip.load("quasistatic_punch"), error, of, seconds=seconds)


def test_run_takes_an_error(tmp_path: Path) -> None:
    scene = warmslip.load("heat_slab")
    answer = warmslip.run(scene, error=0.05, of="theta_L2")
    known = answer.summary["error"]
    assert known["estimated"] <= known["asked"] == 0.05
    assert known["parts"].keys() == known["errors"].keys() == {"theta_L2"}
    (together,), (parts,) = known["errors"].values(), known["parts"].values()
    assert together == known["estimated"] and max(parts.values()) <= together <= sum(parts.values()) * (1 + 1e-12)
    stored = warmslip.run(scene, error=0.05, of="theta_L2", out=tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["error"]["setting"] == known["setting"]
    assert stored.theta.shape == answer.theta.shape
    with pytest.raises(ValueError, match="resume: a run with error="):
        warmslip.run(scene, error=0.05, out=tmp_path, resume=True)


def test_the_commands(command: Command, tmp_path: Path) -> None:
    planned = command("plan", "heat_slab", "--error", "5%")
    assert planned.returncode == 0, planned.stderr
    assert "choice: a mesh with n = " in planned.stdout
    line = next(line for line in planned.stdout.splitlines() if line.startswith("run it with"))
    assert line.startswith("run it with: warmslip run heat_slab --set ")
    done = command("run", "heat_slab", "--error", "5%", "--out", "run")
    assert done.returncode == 0, done.stderr
    assert "estimated error" in done.stdout
    assert json.loads((tmp_path / "run/summary.json").read_text())["error"]["asked"] == 0.05
    for words, message in (
        (("--error", "5"), "write 1% or 0.01"),
        (("--error", "x%"), "write 1% or 0.01"),
        (("--error", "5%", "--resume"), "leave --resume"),
        (("--error", "5%", "--of", "force"), "unknown"),
    ):
        refused = command("run", "heat_slab", *words)
        assert refused.returncode == 2 and message in refused.stderr
