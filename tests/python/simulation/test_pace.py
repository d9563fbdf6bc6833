"""Steps of several sizes: what is chosen, what is taken back, what a resumed run knows, and whether it pays."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.processes import Command
from support.stopped import KilledError, same, scene, stop_after

import warmslip
from warmslip import Trajectory
from warmslip.model.discretisation import discretise
from warmslip.scene.scene import Scene
from warmslip.simulation.local_error import LocalError
from warmslip.simulation.pace import FLOOR, AdaptivePace

GRADED = ("time.graded_to=[0.0, 0.4]", "time.steps=16", "time.halvings=3")
ADAPTIVE = ("time.tolerance=3e-3", "time.steps=4")
BLOCK = {
    "mesh": {"shape": "cube", "n": 2},
    "time": {"end": 1.0, "steps": 4},
    "inertia": {"density": 1.0},
    "elasticity": {"lame": [10.0, 5.0]},
    "viscosity": {"lame": [1.0, 0.5]},
    "heat": {"conductivity": 1.0, "expansion": {"tensor": 1.0}, "heating": {"tensor": -1.0}},
    "loads": {"body": [0.0, 0.0, "where(t > 0.4, -1, 0)"]},
    "supports": {"displacement": ["top"], "temperature": ["top"]},
    "contact": {
        "part": "bottom",
        "stiffness": 100.0,
        "friction": {"coefficient": 0.2},
        "heat_exchange": {"conductance": 1.0, "foundation_temperature": 5.0},
    },
}


@pytest.mark.parametrize("more", [GRADED, ADAPTIVE, (*ADAPTIVE, "time.coupling=monolithic")], ids=str)
@pytest.mark.parametrize("steps", [3, 23])
def test_a_resumed_run_ends_the_same(tmp_path: Path, more: tuple[str, ...], steps: int) -> None:
    whole = warmslip.run(scene(*more), out=tmp_path / "whole")
    assert whole.completed
    with pytest.raises(KilledError):
        warmslip.run(scene(*more), out=tmp_path / "torn", progress=stop_after(steps))
    again = warmslip.run(scene(*more), out=tmp_path / "torn", resume=True)
    for name in ("u", "w", "theta"):
        assert np.array_equal(getattr(whole, name), getattr(again, name))
    for key in ("balances", "digits", "steps", "step_sizes", "rejected_steps", "warnings"):
        assert again.summary[key] == whole.summary[key], key
    same(tmp_path / "whole", tmp_path / "torn")
    once_more = warmslip.run(scene(*more), out=tmp_path / "torn", resume=True)  # it is there
    assert once_more.summary["cpu_seconds"] == again.summary["cpu_seconds"]


@pytest.mark.parametrize("d", [2, 3])
def test_balances_hold_in_steps_of_every_size(d: int) -> None:
    one = (
        scene(*ADAPTIVE) if d == 2 else warmslip.Scene.model_validate(BLOCK | {"time": {"tolerance": 0.01, "steps": 4}})
    )
    found = warmslip.run(one)
    assert found.completed
    assert len(found.summary["step_sizes"]) >= 3
    assert max(found.summary["balances"].values()) <= 1e-11
    assert min(found.summary["digits"].values()) >= 9
    assert sum(size * count for size, count in found.summary["step_sizes"]) == pytest.approx(1.0, rel=1e-12)
    assert found.summary["time"] == 1.0


def test_a_graded_clock_is_blocks_of_plain_runs() -> None:
    """Each block is a run of its own that starts from the state before, to round-off."""
    one = scene("time.graded_to=[0.0]", "time.steps=4", "time.halvings=2", "mesh.n=4")
    simulation = warmslip.Simulation(one)
    states = {state.time: (state.u, state.theta) for state, _ in simulation.steps()}
    state: tuple[Any, Any, Any] | None = None
    for block in one.clock.blocks:
        part = warmslip.Simulation(
            scene(f"time.end={block.size * block.steps}", f"time.steps={block.steps}", "mesh.n=4")
        )
        if state is not None:
            part.discretisation.restart(part.stepper, *state, 0.0)  # data at rest: the time does not matter
        for _ in part.steps():
            pass
        state = tuple(np.array(part.discretisation.field(getattr(part.stepper, name))) for name in ("u", "w", "theta"))
        assert states[block.end][0] == pytest.approx(state[0], abs=1e-12)
        assert states[block.end][1] == pytest.approx(state[2], abs=1e-12)


def distance(one: Scene, exact: Any) -> tuple[float, int]:
    """Largest error of theta at the stored times of both, and the number of steps."""
    simulation = warmslip.Simulation(one)
    worst = 0.0
    for state, _ in simulation.steps():
        worst = max(worst, float(np.abs(state.theta - exact(state.time)).max()))
    return worst, simulation.taken


def cooling(**keys: Any) -> Scene:
    """A uniform temperature that a foundation takes away at the rate 1/time scale: theta = exp(-50 t), then nothing."""
    data = {
        "mesh": {"n": 1},
        "time": {"end": 1.0, "steps": 4},
        "heat": {"conductivity": 1e9, "capacity_matrix": "lumped"},
        "initial": {"temperature": 1.0},
        "contact": {"part": "bottom", "heat_exchange": {"conductance": 50.0}},
    }
    return warmslip.Scene.model_validate(data).override(**keys)


def test_fewer_steps_for_the_same_error() -> None:
    exact = lambda t: np.exp(-50 * t)  # noqa: E731
    error, steps = distance(cooling(**{"time.tolerance": 1e-3}), exact)
    plain, many = distance(cooling(**{"time.steps": 1024}), exact)
    assert error <= plain
    assert steps < many / 4
    graded, few = distance(cooling(**{"time.steps": 16, "time.graded_to": [0.0], "time.halvings": 5}), exact)
    same_number, _ = distance(cooling(**{"time.steps": few}), exact)
    assert graded < same_number / 2


def test_the_error_falls_like_the_root_of_the_tolerance() -> None:
    errors = [
        distance(cooling(**{"time.tolerance": tol}), lambda t: np.exp(-50 * t))[0] for tol in (4e-3, 1e-3, 2.5e-4)
    ]
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.7)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.7)


def test_the_estimate_is_half_the_second_derivative() -> None:
    """Of theta = t^2, at steps of different sizes: k^2/2 times 2, relative to the largest value so far."""
    d = discretise(cooling())
    theta = d.layout.vector(1)
    state = SimpleNamespace(u=None, w=None, theta=theta)
    error, time = LocalError(d, state, 1.0), 0.0
    for size, expected in ((0.25, None), (0.5, 0.25 / 0.5625), (0.125, 0.015625 / 0.765625)):
        error.remember(state)
        time += size
        theta.set(time**2)
        found = error.of(state, size)
        assert expected is None or found == pytest.approx(expected, rel=1e-12)
        error.take(size)


DROP: dict[str, Any] = {
    "mesh": {"n": 4},
    "time": {"end": 1.0, "steps": 8},
    "inertia": {"density": 1.0},
    "elasticity": {"lame": [100.0, 50.0]},
    "viscosity": {"lame": [1.0, 0.5]},
    "loads": {"body": [0.0, -1.0]},
    "initial": {"velocity": [0.3, 0.0]},
    "contact": {"part": "bottom", "stiffness": 1e3, "gap": 0.2, "friction": {"coefficient": 0.3}},
}


def moved(one: Scene, exact: dict[float, Any]) -> tuple[float, int]:
    """Largest error of u at the times that are in `exact`, and the number of steps."""
    simulation, worst = warmslip.Simulation(one), 0.0
    for state, _ in simulation.steps():
        if (u := exact.get(round(state.time, 12))) is not None:
            worst = max(worst, float(np.abs(state.u - u).max()))
    return worst, simulation.taken


def fine(one: Scene, steps: int) -> dict[float, Any]:
    return {
        round(state.time, 12): state.u
        for state, _ in warmslip.Simulation(one.override(**{"time.steps": steps})).steps()
    }


def test_a_body_that_drops_is_followed() -> None:
    """It flies, strikes and slides: |.|_V alone would not see the flight."""
    one = Scene.model_validate(DROP)
    exact = fine(one, 4096)
    found = [moved(one.override(**{"time.tolerance": tolerance}), exact) for tolerance in (1e-2, 1e-3, 2.5e-4)]
    assert found[1][0] < 0.5 * found[0][0]
    assert found[2][0] < 0.7 * found[1][0]
    uniform, many = moved(one.override(**{"time.steps": 512}), exact)
    assert found[1][0] < uniform and found[1][1] < many


def test_nothing_happens_in_a_flight_without_forces() -> None:
    data = {name: table for name, table in DROP.items() if name not in ("contact", "loads")}
    for tolerance in (1e-3, 1e-6):
        simulation = warmslip.Simulation(Scene.model_validate(data).override(**{"time.tolerance": tolerance}))
        assert sum(1 for _ in simulation.steps()) == 8


@pytest.mark.parametrize("inertial", [True, False])
def test_the_motion_is_followed_to_the_root_of_the_tolerance(inertial: bool) -> None:
    """A load that starts quickly and then rests, with the estimate of the displacement alone or with that of the velocity."""
    data = {name: BLOCK[name] for name in ("elasticity", "viscosity")} | {
        "mesh": {"n": 4},
        "time": {"steps": 4},
        "loads": {"body": [0.0, "1 - exp(-40 * t)"]},
        "supports": {"displacement": ["top"]},
    }
    one = Scene.model_validate(data | ({"inertia": {"density": 1.0}} if inertial else {}))
    exact = fine(one, 4096)
    errors = [moved(one.override(**{"time.tolerance": tolerance}), exact)[0] for tolerance in (4e-3, 2.5e-4)]
    assert 2 < errors[0] / errors[1] < 8
    uniform, _ = moved(one.override(**{"time.steps": 64}), exact)
    assert errors[1] < uniform


def test_equilibrium_without_history_needs_no_short_steps() -> None:
    data = {"mesh": {"n": 4}, "time": {"steps": 4, "tolerance": 1e-3}, "elasticity": {"lame": [10.0, 5.0]}}
    data |= {"loads": {"body": [0.0, "t"]}, "supports": {"displacement": ["top"]}}
    simulation = warmslip.Simulation(Scene.model_validate(data))
    assert sum(1 for _ in simulation.steps()) == 4


def test_a_jump_of_the_load_is_found() -> None:
    data = {name: BLOCK[name] for name in ("inertia", "elasticity", "viscosity")} | {
        "mesh": {"n": 4},
        "time": {"tolerance": 3e-3, "steps": 4},
        "loads": {"body": [0.0, "where(t > 0.63, -1, 0)"]},
        "supports": {"displacement": ["top"]},
    }
    one = warmslip.Scene.model_validate(data)
    simulation = warmslip.Simulation(one)
    sizes = [(simulation.stepper.time, simulation.stepper.step) for _ in simulation.steps()]
    shortest = min(size for _, size in sizes)
    jump = next(time for time, size in sizes if size <= 2 * shortest)
    assert jump == pytest.approx(0.63, abs=0.07)
    assert simulation.pace.record.rejected >= 1
    assert sizes[0][1] == 0.25  # nothing happens before


def test_a_step_that_cannot_be_solved_is_repeated_with_a_smaller_one(monkeypatch: pytest.MonkeyPatch) -> None:
    one = scene("time.tolerance=0.5", "time.steps=2")
    simulation = warmslip.Simulation(one)
    failing = iter([True, False])
    advance = type(simulation.stepper).advance

    def once(self: Any, *args: Any, **keys: Any) -> Any:
        report = advance(self, *args, **keys)
        if next(failing, False):
            self.revert()

            class Failed:
                outcome = warmslip._core.Outcome.contact_not_converged
                newton_iterations, stage = report.newton_iterations, report.stage

            return Failed()
        return report

    monkeypatch.setattr(type(simulation.stepper), "advance", once)
    taken = [simulation.stepper.step for _ in simulation.steps()]
    assert simulation.outcome == "completed"
    assert simulation.pace.record.failed == 1
    assert taken[0] <= 0.5 / 4


def test_a_step_is_taken_back_whole() -> None:
    simulation = warmslip.Simulation(scene("time.steps=6"))
    steps = simulation.steps()
    next(steps)
    next(steps)
    stepper, d = simulation.stepper, simulation.discretisation
    before = [np.array(d.field(getattr(stepper, name))) for name in ("u", "w", "theta")]
    force, status, time = np.array(stepper.contact_force), list(stepper.status), stepper.time
    next(steps)
    after = np.array(d.field(stepper.u))
    stepper.revert()
    assert (stepper.time, list(stepper.status)) == (time, status)
    assert np.array_equal(stepper.contact_force, force)
    for name, values in zip(("u", "w", "theta"), before, strict=True):
        assert np.array_equal(d.field(getattr(stepper, name)), values)
    with pytest.raises(ValueError, match="no step that could be taken back"):
        stepper.revert()
    report = stepper.advance(*d.load_vectors.at(3 / 6))
    assert report.outcome.name == "completed"
    assert np.array_equal(d.field(stepper.u), after)


def test_a_step_that_is_not_taken_leaves_no_extents() -> None:
    """Digits are those of the steps that were taken: a needle has none in its first step."""
    simulation = warmslip.Simulation(scene("mesh.lengths=[1e-6, 1.0]", "mesh.n=4", "time.steps=4"))
    before = list(simulation.stepper.extents)
    assert list(simulation.steps()) == []
    assert simulation.outcome == "precision_lost"
    assert list(simulation.stepper.extents) == before


def test_factors_are_kept_within_their_bound() -> None:
    simulation = warmslip.Simulation(scene())
    stepper = simulation.stepper
    first, one = stepper.step, stepper.cost.factor_bytes
    stepper.set_step(first / 2)
    assert stepper.has_factored(first)
    assert stepper.cost.factor_bytes == pytest.approx(2 * one)
    factorizations = stepper.cost.factorizations
    stepper.set_step(first)
    assert stepper.cost.factorizations == factorizations
    with pytest.raises(ValueError, match="positive and finite"):
        stepper.set_step(0.0)
    assert stepper.step == first
    assert stepper.refactoring_price > 0


def test_the_pace_is_aligned_and_ends_at_the_end() -> None:
    pace = AdaptivePace(scene("time.tolerance=0.1", "time.steps=3", "time.end=0.7"))
    random = np.random.default_rng(1)
    times = [0.0]
    while (step := pace.next()) is not None:
        estimate = 10 ** random.uniform(-4, 0)
        if not pace.judge(estimate):
            continue
        pace.accept(estimate, 3.0)
        assert step.time - times[-1] == pytest.approx(step.size, rel=1e-9)
        ratio = times[-1] / step.size  # a step begins at a multiple of its size
        assert ratio == pytest.approx(round(ratio), abs=1e-6)
        times.append(step.time)
        assert pace.expected >= pace.taken
    assert times[-1] == 0.7
    assert sum(pace.record.sizes.values()) == pace.taken == len(times) - 1


def test_the_smallest_step_is_taken_whatever_it_errs() -> None:
    pace = AdaptivePace(scene("time.tolerance=0.1", "time.steps=3"))
    while not pace.judge(1e9):
        pass
    assert pace.level == FLOOR
    assert pace.record.beyond == 1
    assert not pace.fail()


@pytest.mark.mpi
def test_two_ranks_take_the_same_steps(command: Command, tmp_path: Path) -> None:
    summaries = []
    for ranks in (1, 2):
        options = [word for one in ("mesh.n=8", *ADAPTIVE) for word in ("--set", one)]
        result = command("run", "paper_mixed", *options, "--out", f"run{ranks}", "--backend", "petsc", ranks=ranks)
        assert result.returncode == 0, result.stderr
        summaries.append(json.loads((tmp_path / f"run{ranks}/summary.json").read_text()))
    one, two = summaries
    assert one["step_sizes"] == two["step_sizes"]
    assert two["norms"] == pytest.approx(one["norms"], rel=1e-9)


def test_states_of_unequal_steps_are_found_again(tmp_path: Path) -> None:
    warmslip.run(scene(*GRADED), out=tmp_path)
    with Trajectory(tmp_path / "trajectory.h5") as t:
        steps = t.series("steps")["time"]
        assert t.step_of(0) == -1
        for state in range(1, len(t.time)):
            assert steps[t.step_of(state)] == t.time[state]
