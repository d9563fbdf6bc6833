"""Scenes that begin with a state: of another run, or one that was set by hand."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.small import scene

import warmslip
from warmslip.scene.reader import build
from warmslip.simulation.simulation import Simulation


def test_a_state_of_another_run(tmp_path: Path) -> None:
    """The initial fields are those of the stored state: to the last bit on the same mesh, interpolated on another one."""
    first = warmslip.run(scene(), out=tmp_path / "one")
    begin = {"initial": {"from": str(first.trajectory)}}
    for n, nearness in ((6, 0.0), (12, 1e-14)):
        started = Simulation(scene(**begin, **{"mesh.n": n}))
        d = started.discretisation
        grid = np.arange(0, n + 1, n // 6)
        index = (grid[:, None] * (n + 1) + grid[None, :]).ravel()
        for name in ("u", "theta"):
            values = np.asarray(d.field(getattr(started.stepper, name)))[index]
            assert np.abs(values - getattr(first, name)).max() <= nearness, name
    early = Simulation(scene(initial={"from": str(first.trajectory), "time": 0.25}))
    with warmslip.Trajectory(first.trajectory) as stored:
        assert np.array_equal(early.discretisation.field(early.stepper.u), stored.u[4])


@pytest.mark.parametrize(
    ("initial", "message"),
    [
        ({"from": "nowhere.h5"}, "initial.from: 'nowhere.h5' is no file"),
        ({"time": 0.5}, "of which run"),
        ({"from": "a.h5", "temperature": 2.0}, "holds all fields"),
    ],
)
def test_states_that_are_not_there(initial: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Simulation(scene(initial=initial))


def test_supports_begin_where_the_state_has_them(tmp_path: Path) -> None:
    """A state whose support has moved does not jump back."""
    moving = scene(**{"supports.displacement": {"top": [0.0, "-0.01 * t"]}})
    first = warmslip.run(moving, out=tmp_path / "one")
    begin = {"from": str(first.trajectory)}
    with pytest.raises(ValueError, match=r"supports are up to 0.005 away"):
        warmslip.run(moving.override(initial=begin))
    on = moving.override(**{"supports.displacement": {"top": [0.0, "-0.005 - 0.01 * t"]}, "initial": begin})
    assert warmslip.run(on).completed
    with pytest.raises(ValueError, match="would overwrite"):
        warmslip.run(on, out=tmp_path / "one")
    assert first.trajectory is not None and first.trajectory.exists()


def test_the_path_of_a_state_does_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = warmslip.run(scene(), out=tmp_path / "one")
    monkeypatch.chdir(tmp_path)
    one, other = (scene(initial={"from": path}) for path in ("one/trajectory.h5", str(first.trajectory)))
    assert one.digest() == other.digest()


def test_a_time_that_is_not_stored(tmp_path: Path) -> None:
    first = warmslip.run(scene(), out=tmp_path)
    with pytest.raises(ValueError, match=r"holds no state at t = 0.3; the nearest is at 0.3125"):
        Simulation(scene(initial={"from": str(first.trajectory), "time": 0.3}))


def test_the_file_counts_in_the_digest(tmp_path: Path) -> None:
    """A scene that begins with another run's state is another scene when that run was another one."""
    path = tmp_path / "trajectory.h5"
    digests = []
    for content in (b"one", b"two"):
        path.write_bytes(content)
        os.utime(path, ns=(1, len(digests)))
        digests.append(scene(initial={"from": str(path)}).digest())
    assert digests[0] != digests[1]


def test_steps_begin_at_the_time_of_a_state_that_was_set() -> None:
    """After `restart` the loads are those of the time of the state."""
    moving = scene(2.0, 20, **{"loads.body": [0.0, "-1 - t"]})
    whole = Simulation(moving)
    states = [(state.u, state.w, state.theta) for state, _ in whole.steps()]
    again = Simulation(moving)
    again.discretisation.restart(again.stepper, *states[9], 1.0)
    ends = [state.time for state, _ in again.steps()]
    assert ends[0] == pytest.approx(1.1)
    assert ends[-1] == 2.0
    assert len(ends) == 10
    assert np.abs(again.discretisation.field(again.stepper.u) - states[-1][0]).max() <= 1e-12
    for at, first in ((0.5, 0.6), (0.0, 0.1)):  # also of a simulation that has stepped, back to an earlier time
        state = states[round(10 * at) - 1] if at else (0 * states[0][0], 0 * states[0][1], 0 * states[0][2])
        whole.discretisation.restart(whole.stepper, *state, at)
        ends = [one.time for one, _ in whole.steps()]
        assert ends[0] == pytest.approx(first)
        assert ends[-1] == 2.0
        assert np.abs(whole.discretisation.field(whole.stepper.u) - states[-1][0]).max() <= 1e-12
    between = Simulation(moving)
    between.discretisation.restart(between.stepper, *states[9], 1.05)
    with pytest.raises(ValueError, match=r"at t = 1.05, where no step of the scene ends"):
        next(between.steps())


def test_a_state_of_another_body_is_refused(tmp_path: Path) -> None:
    run = warmslip.run(scene(**{"mesh.lengths": [1.0, 1.0]}), out=tmp_path)
    for lengths in ([1.1, 1.0], [0.5, 1.0], [1.0, 1.05]):
        other = scene(**{"mesh.lengths": lengths, "mesh.n": 9, "initial.from": str(run.trajectory)})
        with pytest.raises(ValueError, match=r"initial.from: the body of .* lies in \[0, 1\] x \[0, 1\]"):
            warmslip.run(other)


def test_a_temperature_that_another_run_does_not_have_is_said(tmp_path: Path) -> None:
    still = {
        "mesh": {"n": 4},
        "time": {"steps": 1},
        "elasticity": {"lame": [1.0, 1.0]},
        "supports": {"displacement": ["top"]},
    }
    heat = {"conductivity": 1.0, "capacity": 1.0}
    for begun, told in ((still, 1), (still | {"heat": heat}, 0)):
        run = warmslip.run(build(begun), out=tmp_path)
        found = warmslip.run(build(still | {"heat": heat, "initial": {"from": str(run.trajectory)}}))
        assert sum("has no temperature, which is taken as 0" in one for one in found.summary["warnings"]) == told


def test_supports_whose_shape_no_coarse_mesh_has(tmp_path: Path) -> None:
    """A state between meshes fits its supports to the error of interpolation."""
    bent = {
        "supports.displacement": {"top": ["0.01 * sin(pi * x)", 0.0]},
        "initial.displacement": ["0.01 * sin(pi * x) * y", "0"],
    }
    run = warmslip.run(scene(**bent), out=tmp_path)
    finer = scene(
        **{"supports.displacement": bent["supports.displacement"], "mesh.n": 15, "initial.from": str(run.trajectory)}
    )
    assert warmslip.run(finer).completed
    away = finer.override(**{"supports.displacement": {"top": ["0.02 * sin(pi * x)", 0.0]}})
    with pytest.raises(ValueError, match="let them begin there"):
        warmslip.run(away)
