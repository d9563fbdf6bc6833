"""A run: what its summary and stamp hold, how it stops, what it leaves on disk, how it restarts."""

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
from warmslip.io.trajectory_writer import BALANCES
from warmslip.model.discretisation import discretise
from warmslip.scene.reader import build
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.statistics import worse
from warmslip.simulation.summary import summary

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


def test_summary_holds_what_others_script_against(small: MakeScene, tmp_path: Path) -> None:
    result = warmslip.run(small(), out=tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary == json.loads(json.dumps(result.summary))
    assert summary["outcome"] == "completed"
    assert result.completed
    assert summary["steps"] == 4
    assert summary["time"] == pytest.approx(1)
    assert set(summary["norms"]) == {"u_V", "u_L2", "w_L2", "theta_L2"}
    assert {"normal_force", "tangential_force", "max_penetration", "open", "stick", "slip"} <= set(summary["contact"])
    assert {"energy", "heat", "force", "law"} <= set(summary["balances"])
    assert all(summary["balances"][i] <= 1e-11 for i in ("energy", "heat", "force", "law"))
    assert summary["newton"]["iterations"] >= summary["newton"]["largest_step"] >= 1
    assert summary["cpu_seconds"] > 0
    assert summary["memory_bytes"] > 2**20
    contact = summary["contact"]
    assert contact["open"] + contact["stick"] + contact["slip"] == 5
    assert contact["traction"] == pytest.approx([-contact["tangential_force"], contact["normal_force"]], rel=1e-12)


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


def test_stamp_says_what_produced_it_and_not_who(small: MakeScene) -> None:
    scene = small()
    stamp = warmslip.run(scene).summary["stamp"]
    expected = {"version", "commit", "dirty", "fingerprint", "python", "cpu", "threads", "scene", "scene_hash"}
    assert expected | {"petsc", "compiler", "ranks", "solver", "petsc_options"} <= set(stamp)
    assert stamp["scene"] == scene.resolved()
    assert stamp["scene_hash"] == scene.digest()
    assert stamp["ranks"] == 1
    assert not {"host", "hostname", "user", "node"} & set(stamp)


def test_trajectory_holds_the_run(small: MakeScene, tmp_path: Path) -> None:
    result = warmslip.run(small(), out=tmp_path)
    with Trajectory(tmp_path / "trajectory.h5") as t:
        assert t.time == pytest.approx([0, 0.25, 0.5, 0.75, 1])
        assert (t.u.shape, t.w.shape, t.theta.shape) == ((5, 25, 2), (5, 25, 2), (5, 25))
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(t, name)[-1], getattr(result, name))
        np.testing.assert_allclose(t.u[2] - t.u[1], 0.25 * t.w[2], rtol=0, atol=1e-16)
        assert len(t.series("steps")["newton_iterations"]) == 4
        assert set(t.series("balances")) == set(BALANCES)
        contact = t.series("contact")
        assert contact["force"].shape == contact["displacement"].shape == (4, 5, 2)
        assert contact["status"].shape == (4, 5)
        # the friction law, read from the file alone
        lam, pressure = contact["force"][..., 0], -contact["force"][..., 1]
        assert (np.abs(lam) <= 0.2 * pressure * (1 + 1e-12) + 1e-15).all()
        assert (pressure[contact["status"] == 0] == 0).all()
        assert t.scene == small().resolved()


def test_trajectory_and_summary_agree(small: MakeScene, tmp_path: Path) -> None:
    """Times of the steps, worst identities as maxima over the steps, penetration against displacement and gap."""
    scene = small(contact__gap=-1e-3, time__steps=5)
    contact = warmslip.run(scene, out=tmp_path).summary
    with Trajectory(tmp_path / "trajectory.h5") as t:
        steps, balances = t.series("steps"), t.series("balances")
        assert steps["time"] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
        for name in ("energy", "heat", "force", "law"):
            assert contact["balances"][name] == balances[f"{name}_residual"].max()
        bottom = t.u[-1][:5]
    assert contact["contact"]["max_penetration"] == pytest.approx((-bottom[:, 1]).max() + 1e-3, rel=1e-12)


def test_restart_under_a_moving_gap(small: MakeScene) -> None:
    """The energy that a moving foundation puts in is that of the gap before and after, and a restart knows the former."""
    scene = small("isotropic", time__steps=6)
    loads = replace(warmslip.Loads.of(scene), gap=lambda x, t: -1e-3 * (1 + t) + 0 * x[:, 0])
    simulation = warmslip.Simulation(scene, loads=loads)
    every_balance = [report.balances for _, report in simulation.steps()]
    gained = sum(balances.contact_change for balances in every_balance)
    d, half = simulation.discretisation, warmslip.Simulation(scene, loads=loads)
    assert gained == pytest.approx(
        every_balance[-1].contact - 0.5 * 1e4 * 1e-6, rel=1e-9
    )  # c_nu/2 g(0)^2 over a side of 1
    marching = half.steps()
    for _ in range(3):
        next(marching)
    state = [d.field(getattr(half.stepper, name)) for name in FIELDS]
    again = d.stepper()
    d.restart(again, state[0], state[1], state[2], 0.5)
    balances = again.advance(*d.load_vectors.at(4 / 6)).balances
    for name in ("gap_work", "contact_change", "contact"):
        assert getattr(balances, name) == pytest.approx(getattr(every_balance[3], name), rel=1e-9), name


def test_states_are_thinned(small: MakeScene, tmp_path: Path) -> None:
    warmslip.run(small(time__steps=5, output__every=2), out=tmp_path)
    with Trajectory(tmp_path / "trajectory.h5") as t:
        assert t.time == pytest.approx([0, 0.4, 0.8, 1])
        assert len(t.series("steps")["time"]) == 5


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


@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
def test_restart_gives_the_same_end(small: MakeScene, tmp_path: Path, coupling: str) -> None:
    scene = small(
        mesh__n=6, time__steps=8, time__coupling=coupling, contact__heat_exchange__foundation_temperature=10.0
    )
    whole = warmslip.run(scene, out=tmp_path)
    d = discretise(scene)
    stepper = d.stepper()
    with Trajectory(tmp_path / "trajectory.h5") as t:
        d.restart(stepper, t.u[3], t.w[3], t.theta[3], float(t.time[3]))
    for n in range(4, 9):
        assert stepper.advance(*d.load_vectors.at(n * scene.step)).outcome.name == "completed"
    assert stepper.time == pytest.approx(1)
    for name in FIELDS:
        found, expected = d.field(getattr(stepper, name)), getattr(whole, name)
        assert np.abs(found - expected).max() <= 1e-12 * np.abs(expected).max()


def test_moving_loads_equal_constant_ones(small: MakeScene) -> None:
    scene = small(contact__heat_exchange__foundation_temperature=10.0)
    plain = Loads.of(scene)
    moving = Loads(
        body=lambda x, t: np.tile(plain.body, (len(x), 1)),
        source=lambda x, t: np.full(len(x), plain.source),
        traction={part: (lambda x, t, v=value: np.tile(v, (len(x), 1))) for part, value in plain.traction.items()},
        gap=lambda x, t: np.zeros(len(x)),
        foundation_temperature=lambda x, t: np.full(len(x), 10.0),
    )
    a, b = warmslip.run(scene), warmslip.run(scene, loads=moving)
    for name in FIELDS:
        assert np.abs(getattr(a, name) - getattr(b, name)).max() <= 1e-12 * np.abs(getattr(a, name)).max()


def test_backends_agree(small: MakeScene) -> None:
    for coupling in ("staggered", "monolithic"):
        scene = small("consistent", time__coupling=coupling)
        a, b = (warmslip.run(scene, backend=backend) for backend in ("cholmod", "petsc"))
        assert a.summary["norms"] == pytest.approx(b.summary["norms"], rel=1e-11)
        assert a.summary["stamp"]["solver"] != b.summary["stamp"]["solver"]
    scene = small("mixed", heat__heating__tensor=[[1.0, 0.5], [0.5, 1.0]], time__coupling="monolithic")
    with pytest.raises(ValueError, match="CHOLMOD"):
        warmslip.run(scene, backend="cholmod")


def test_initial_data_are_used_and_held_on_supports(small: MakeScene) -> None:
    simulation = Simulation(
        small(initial__velocity=[1.0, 0.5], initial__temperature=2.0, initial__displacement=[0.1, 0.2])
    )
    d = simulation.discretisation
    u, w, theta = (d.field(getattr(simulation.stepper, name)) for name in FIELDS)
    top = np.unique(d.mesh.parts["top"])
    cooled = np.unique(np.concatenate([d.mesh.parts[p] for p in ("top", "left", "right")]))
    assert (u[top] == 0).all()
    assert (w[top] == 0).all()
    assert (theta[cooled] == 0).all()
    assert (theta[np.setdiff1d(np.arange(25), cooled)] == 2).all()
    assert (w[0] == [1, 0.5]).all()
    assert (u[0] == [0.1, 0.2]).all()
    assert all(report.outcome.name == "completed" for _, report in simulation.steps())


def test_a_body_at_rest_away_from_the_foundation_stays_there(small: MakeScene) -> None:
    still = {"loads__body": [0.0, 0.0], "loads__traction": {}, "heat__source": 0.0}
    result = warmslip.run(small(contact__gap=0.1, contact__heat_exchange__foundation_temperature=0.0, **still))
    assert (result.outcome, result.summary["contact"]["open"]) == ("completed", 5)
    assert not result.u.any()
    assert not result.theta.any()


def test_the_largest_pressure_on_a_curved_part_is_that_of_a_node() -> None:
    """A node of a hole has a point for the normal of each of its facets, one of which may bear all of its force."""
    scene = build(
        {
            "mesh": {"file": warmslip.load("plate_with_hole").mesh.file},
            "time": {"steps": 2},
            "elasticity": {"young": 100.0, "poisson": 0.3, "assumption": "plane_stress"},
            "supports": {"displacement": {"top": [0.0, "0.05 * t"]}},
            "contact": {
                "part": "hole",
                "stiffness": 1e4,
                "gap": {"shape": "cylinder", "at": [1.0, 0.55], "radius": 0.24},
            },
        }
    )
    simulation = Simulation(scene)
    list(simulation.steps())
    surface = simulation.discretisation.surface
    force, places = np.reshape(simulation.stepper.contact_force, (-1, 2)), np.asarray(surface.positions)
    weights = np.asarray(surface.weights)
    single = np.linalg.norm(force, axis=1) / weights
    at = np.abs(places - places[single.argmax()]).max(axis=1) < 1e-12
    assert at.sum() == 2
    mean = np.linalg.norm(force[at].sum(axis=0)) / weights[at].sum()
    stated = summary(simulation)["largest"]["pressure"]
    assert stated == pytest.approx(mean, rel=0.05)
    assert single.max() > 1.9 * stated
