"""A run: what its summary, its stamp and its files hold, how it restarts, and what its data do."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Loads, Scene, Trajectory
from warmslip.io.trajectory_writer import BALANCES
from warmslip.model.discretisation import discretise
from warmslip.scene.reader import build
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

MakeScene = Callable[..., Scene]
FIELDS = ("u", "w", "theta")


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


@pytest.mark.parametrize(
    "tables",
    [
        {
            "heat": {"conductivity": 1e160, "capacity": 1e160},
            "contact": {"part": "bottom", "heat_exchange": {"conductance": 1e160, "foundation_temperature": 10.0}},
        },
        {
            "mesh": {"n": 4, "lengths": [1e90, 1e90]},
            "elasticity": {"young": 1.0, "poisson": 0.3, "assumption": "plane_strain"},
            "viscosity": {"young": 1.0, "poisson": 0.3, "assumption": "plane_strain"},
            "inertia": {"density": 1e-180},
            "supports": {"displacement": ["top"]},
            "heat": {
                "conductivity": 1e180,
                "capacity": 1.0,
                "expansion": {"tensor": 1e-3},
                "heating": {"tensor": -1e-3},
            },
            "initial": {"temperature": 1.0},
        },
    ],
    ids=["conductance", "coupling"],
)
def test_a_warning_that_cannot_be_computed_ends_no_run(tables: dict[str, Any]) -> None:
    """Squares of the data overflow in the warnings alone."""
    result = warmslip.run(build({"mesh": {"n": 4}, "time": {"end": 1.0, "steps": 4}} | tables))
    assert result.outcome == "completed" and result.summary["steps"] == 4
