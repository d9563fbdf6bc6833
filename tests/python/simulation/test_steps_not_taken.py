"""Steps that are not taken: data, solvers and balances that fail, what is kept of the run, and digits that are left."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Loads, Scene, Trajectory, _core
from warmslip.model.discretisation import discretise
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.statistics import digits, worse

MakeScene = Callable[..., Scene]
FIELDS = ("u", "w", "theta")


@pytest.fixture(name="options")
def _options() -> Iterator[dict[str, str]]:
    """PETSc options for one test."""
    from petsc4py import PETSc

    chosen: dict[str, str] = {}

    class Chosen(dict[str, str]):
        def __setitem__(self, key: str, value: str) -> None:
            chosen[key] = value
            PETSc.Options()[key] = value

    yield Chosen()
    for key in chosen:
        PETSc.Options().delValue(key)


def test_a_run_that_stops_leaves_nothing_of_another(small: MakeScene, tmp_path: Path) -> None:
    warmslip.run(small(), out=tmp_path)
    assert (tmp_path / "final.vtu").exists()
    with pytest.raises(ValueError, match="not finite"):
        warmslip.run(small(), out=tmp_path, loads=replace(Loads.of(small()), source=float("nan")))
    failing = replace(Loads.of(small()), source=lambda x, t: np.full(len(x), np.nan if t > 0.6 else 0.0))
    assert not (tmp_path / "summary.json").exists() and not (tmp_path / "final.vtu").exists()
    warmslip.run(small(), out=tmp_path)
    assert warmslip.run(small(), out=tmp_path, loads=failing).outcome == "data_not_finite"
    assert json.loads((tmp_path / "summary.json").read_text())["failure"]["step"] == 3


def test_a_load_that_fails_leaves_the_states_before_it(small: MakeScene, tmp_path: Path) -> None:
    scene = small(time__steps=8)

    def failing(x: Any, t: float) -> Any:
        return np.full((len(x), 2), np.nan if t > 0.6 else -1.0)

    done = warmslip.run(scene, out=tmp_path, loads=replace(Loads.of(scene), body=failing))
    assert done.outcome == "data_not_finite" and done.summary["failure"]["step"] == 5
    assert "not finite at t = 0.625" in done.summary["failure"]["reason"]
    with Trajectory(tmp_path / "trajectory.h5") as t:
        assert t.time == pytest.approx(np.arange(5) / 8)
        assert all(np.isfinite(getattr(t, name)[:]).all() for name in FIELDS)


def test_contact_that_does_not_converge_keeps_the_last_good_step(
    small: MakeScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The solver is left without a method; the loads press from the third step on, so two steps are good."""
    ordinary = _core.ContactOptions

    def powerless() -> Any:
        options = ordinary()
        options.newton_steps = options.fixed_point_steps = options.enumerate_points = 0
        return options

    monkeypatch.setattr("warmslip.model.discretisation.ContactOptions", powerless)
    scene = small(time__steps=6, loads__traction={})
    loads = replace(Loads.of(scene), body=lambda x, t: np.full((len(x), 2), -1.0 if t > 0.4 else 0.0), source=0.0)
    result = warmslip.run(scene, out=tmp_path, loads=loads)
    assert result.outcome == "contact_not_converged"
    assert not result.completed
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["norms"]["u_V"] == 0
    assert (summary["outcome"], summary["steps"]) == ("contact_not_converged", 2)
    with Trajectory(tmp_path / "trajectory.h5") as t:
        assert t.time == pytest.approx([0, 1 / 6, 2 / 6])
        np.testing.assert_array_equal(t.u[-1], result.u)


def test_a_linear_solver_that_fails_keeps_the_last_good_step(small: MakeScene, options: dict[str, str]) -> None:
    """An iteration of one step serves a heat equation without sources, until they are switched on after two steps."""
    for key, value in {"ksp_type": "cg", "pc_type": "none", "ksp_max_it": "1"}.items():
        options[f"heat_{key}"] = value
    scene = small(time__steps=6, loads__traction={}, loads__body=[0.0, 0.0])
    loads = replace(Loads.of(scene), source=lambda x, t: np.full(len(x), 1.0 if t > 0.4 else 0.0))
    result = warmslip.run(scene, loads=loads, backend="petsc")
    assert (result.outcome, result.summary["steps"], result.summary["failure"]["step"]) == ("solver_failed", 2, 3)
    assert result.summary["failure"] == {"step": 3, "reason": result.summary["failure"]["reason"]}  # no made-up numbers
    assert "change the PETSc options that start with heat_" in result.summary["failure"]["reason"]
    assert not result.theta.any()


def test_a_compliance_that_cannot_be_solved_for_is_refused(small: MakeScene, options: dict[str, str]) -> None:
    for key, value in {"ksp_type": "cg", "pc_type": "none", "ksp_max_it": "2"}.items():
        options[f"momentum_{key}"] = value
    with pytest.raises(ValueError, match="the momentum solver ended with DIVERGED_ITS; change the PETSc options"):
        Simulation(small(), backend="petsc")


@pytest.mark.parametrize("field", ["heat", "momentum"])
def test_loose_iterations_are_seen(small: MakeScene, options: dict[str, str], field: str) -> None:
    """Conjugate gradients leave a residual that is orthogonal to the answer: sums close, the equations do not. Refinement
    mends it, and says so."""
    for key, value in {"ksp_type": "cg", "pc_type": "none", "ksp_rtol": "1e-3"}.items():
        options[f"{field}_{key}"] = value
    free = {"heat__expansion__tensor": [[0.0, 0.0], [0.0, 0.0]], "supports__temperature": []}
    alone = {"contact__gap": 1.0, "contact__heat_exchange__conductance": 0.0, "heat__source": 0.0}
    sheared = {"loads__body": [1.0, 0.0], "loads__traction": {}, "heat__heating__tensor": [[1.0, 0.0], [0.0, 1.0]]}
    scene = small(mesh__n=16, mesh__diagonal="crisscross", time__steps=8, **free, **alone, **sheared)
    result, direct = warmslip.run(scene, backend="petsc"), warmslip.run(scene)
    assert (
        result.completed and result.summary["cost"]["refinements"] >= 8 and direct.summary["cost"]["refinements"] == 0
    )
    for name in FIELDS:
        exact = getattr(direct, name)
        assert np.abs(getattr(result, name) - exact).max() <= 1e-9 * np.abs(exact).max()


def test_loose_iterations_are_seen_where_every_sum_closes(small: MakeScene, options: dict[str, str]) -> None:
    """A floating body on a mesh that is its own mirror image, pulled apart: no sum of forces or moments sees the defect."""
    for key, value in {"ksp_type": "cg", "pc_type": "none", "ksp_rtol": "1e-2"}.items():
        options[f"momentum_{key}"] = value
    apart = {"loads__body": [0.0, 0.0], "loads__traction": {"left": [-1.0, 0.0], "right": [1.0, 0.0]}}
    free = {"supports__displacement": [], "heat__expansion__tensor": [[0.0, 0.0], [0.0, 0.0]], "contact__gap": 1.0}
    scene = small(mesh__n=16, mesh__diagonal="crisscross", time__steps=1, time__end=0.125, **apart, **free)
    result = warmslip.run(scene, backend="petsc")
    assert result.outcome == "balance_violated"
    assert result.summary["failure"]["force"] > 1e-8


@pytest.mark.parametrize("speed", [1.0, 1e6, 1e12])
def test_a_body_that_moves_far_for_its_strain(small: MakeScene, speed: float) -> None:
    """Its rigid motion is solved for apart: the strain does not feel how far it flies, until the velocity has no digits."""
    pulled = {"loads__body": [0.0, 0.0], "loads__traction": {"left": [-1e-3, 0.0], "right": [1e-3, 0.0]}}
    result = warmslip.run(
        small("isotropic", supports__displacement=[], contact__gap=1e3, initial__velocity=[speed, 0.0], **pulled)
    )
    if speed > 1e10:
        assert result.outcome == "precision_lost" and result.summary["failure"]["digits"]["stress"] < 4
        return
    still = warmslip.run(small("isotropic", supports__displacement=[], contact__gap=1e3, **pulled))
    assert result.completed and result.summary["digits"]["stress"] > (5 if speed > 1 else 10)
    moved = np.array([speed, 0.0])
    assert np.abs(result.w - still.w - moved).max() <= 2e-14 * speed


def test_digits_are_rounded_down() -> None:
    """A field with fewer than four digits is never reported to have four."""
    assert digits({"u": 1.05e-4, "theta": 1e-4, "stress": 0.0, "contact_force": 2.0}) == {
        "u": 3.9,
        "theta": 4.0,
        "stress": 16.0,
        "contact_force": 0.0,
    }


def test_a_foundation_out_of_reach_costs_no_digits(small: MakeScene) -> None:
    far, near = (warmslip.run(small(contact__gap=gap)) for gap in (1e9, 1.0))
    assert far.completed and far.summary["digits"]["u"] > 10
    assert np.abs(far.u - near.u).max() <= 1e-14 * np.abs(near.u).max()


@pytest.mark.parametrize(
    "keys",
    [
        {"contact__gap": 0.1, "contact__stiffness": 1e4},
        {"contact__gap": 0.1, "contact__stiffness": 1e10},
        {
            "loads__traction": {"left": [1.4, 0.0], "right": [-0.8, 0.0]},
            "contact__stiffness": 2e12,
            "mesh__lengths": [1e-3, 1.0],
        },
    ],
)
def test_a_needle_has_the_digits_it_states(small: MakeScene, keys: dict[str, Any]) -> None:
    """Nearly all of its energy is cancelled; two factorizations agree to the digits that the summary names."""
    scene = small(
        "isotropic", **{"mesh__n": 8, "time__steps": 1, "time__end": 0.125, "mesh__lengths": [1e-4, 1.0]} | keys
    )
    one, other = warmslip.run(scene), warmslip.run(scene, backend="petsc")
    stated = one.summary["digits"]["u"]
    assert one.completed and other.completed and 4 < stated < 9
    assert np.abs(one.u - other.u).max() <= 10 ** (1 - stated) * np.abs(one.u).max()


def test_an_operator_without_inverse_is_refused(small: MakeScene) -> None:
    """A stiffness beyond the numbers of the machine: one sentence with the cure instead of PETSc's error."""
    with pytest.raises(ValueError, match=r"momentum operator could not be factored: .*; check the material"):
        Simulation(small(elasticity__young=1e308, elasticity__poisson=0.9))


def test_an_impossible_tolerance_is_an_outcome(small: MakeScene) -> None:
    d = discretise(small())
    report = d.stepper(tolerance=-1.0).advance(*d.load_vectors.at(0.25))
    assert report.outcome.name == "contact_not_converged"


def test_a_state_that_is_not_finite_is_said(small: MakeScene) -> None:
    """Numbers that overflow inside the step: the outcome says so and the state stays as it was."""
    result = warmslip.run(small(loads__body=[0.0, -1e308]))
    assert result.outcome != "completed"
    assert all(np.isfinite(getattr(result, name)).all() for name in FIELDS)


@pytest.mark.parametrize(
    ("outcome", "loose", "keys"),
    [
        ("balance_violated", {"heat_ksp_type": "cg", "heat_pc_type": "none", "heat_ksp_rtol": "0.9"}, {}),
        ("precision_lost", {}, {"mesh__lengths": [1e-6, 1.0]}),  # bending of a needle: no digits left in u
    ],
)
def test_a_step_that_does_not_close_its_books_is_not_taken(
    small: MakeScene, options: dict[str, str], outcome: str, loose: dict[str, str], keys: dict[str, object]
) -> None:
    for key, value in loose.items():
        options[key] = value
    result = warmslip.run(small(mesh__n=8, time__steps=8, **keys), backend="petsc")
    assert (result.outcome, result.completed) == (outcome, False)
    failure = result.summary["failure"]
    assert result.summary["steps"] == failure["step"] - 1
    if outcome == "precision_lost":
        assert failure["digits"]["u"] < 4 and "fewer than four digits of u" in failure["reason"]
    else:
        assert failure["heat"] > 1e-10 and "heat residual above 1e-10" in failure["reason"]
    assert all(value <= 1e-10 for value in result.summary["balances"].values())
    if failure["step"] == 1:
        assert not result.u.any()  # the initial state is kept


def test_a_nan_residual_is_the_worst() -> None:
    assert worse(1.0, 2.0) == 2.0
    assert np.isnan(worse(1.0, float("nan")))
