"""Runs that go on: to a later end, from a state of another run, from a state set by hand; results that travel."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from support.processes import child_environment
from support.stopped import KilledError, stop_after

import warmslip
from warmslip.scene.reader import build
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary


def scene(end: float = 0.5, steps: int = 8, **keys: Any) -> warmslip.Scene:
    small = {"mesh.n": 6, "time.end": end, "time.steps": steps, "output.checkpoint": 3}
    return warmslip.load("paper_mixed").override(**{**small, **keys})


@pytest.mark.parametrize(
    "keys", [{}, {"time.tolerance": 3e-2}, {"output.every": 5}, {"supports.displacement": [], "loads.traction": {}}]
)
def test_a_later_end(tmp_path: Path, keys: dict[str, Any]) -> None:
    """A run of twice the length, at once and in two pieces with another cadence of output: the same to the last bit."""
    whole = warmslip.run(scene(1.0, 16, **keys), out=tmp_path / "whole")
    warmslip.run(scene(0.5, 8, **keys), out=tmp_path / "pieces")
    taken: list[int] = []
    longer = scene(1.0, 16, **keys | {"output.every": 2})
    end = warmslip.run(longer, out=tmp_path / "pieces", resume=True, progress=lambda step, *_: taken.append(step))
    assert end.completed
    assert taken[0] > 8 if "time.tolerance" in keys else taken[0] == 9
    for name in ("u", "w", "theta"):
        assert np.array_equal(getattr(whole, name), getattr(end, name)), name
    with warmslip.Trajectory(tmp_path / "whole" / "trajectory.h5") as one, warmslip.Trajectory(end.trajectory) as other:
        for group in ("steps", "balances"):
            for name, values in one.series(group).items():
                assert np.array_equal(values, other.series(group)[name]), name
        assert other.time[-1] == 1.0
        assert np.all(np.diff(other.time) > 0)


def test_a_run_that_stops_at_once_says_what_it_said(tmp_path: Path) -> None:
    """A large strain, an interruption, then a load without a value: the run stops where it goes on, with its warnings."""
    keys = {"loads.body": [0.0, -20.0], "viscosity.lame": [0.1, 0.1], "output.checkpoint": 1}
    broken = scene(**{"loads.traction.left": ["sqrt(0.4 - t)", 0.4], **keys})
    whole = warmslip.run(broken)
    with pytest.raises(KilledError):
        warmslip.run(broken, out=tmp_path, progress=stop_after(whole.summary["steps"]))
    again = warmslip.run(broken, out=tmp_path, resume=True)
    assert whole.outcome == again.outcome == "data_not_finite"
    assert any("strain" in one for one in whole.summary["warnings"])
    assert again.summary["warnings"] == whole.summary["warnings"]


def test_an_end_that_is_past_is_refused(tmp_path: Path) -> None:
    warmslip.run(scene(0.5, 8), out=tmp_path)
    with pytest.raises(ValueError, match=r"is at t = 0.5 after 8 steps, where this scene has no such step"):
        warmslip.run(scene(0.25, 4), out=tmp_path, resume=True)
    with pytest.raises(ValueError, match="is of another scene"):
        warmslip.run(scene(1.0, 8), out=tmp_path, resume=True)  # steps of another size
    assert warmslip.run(scene(0.5, 8), out=tmp_path, resume=True).completed


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


def test_results_travel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A trajectory is read, and its scene assembled, in another folder and without the mesh file."""
    from warmslip.mesh import files
    from warmslip.report.page import view

    home, away = tmp_path / "home", tmp_path / "away"
    home.mkdir()
    away.mkdir()
    mesh = home / "body.msh"
    shutil.copy(files.find("plate_with_hole.msh"), mesh)
    monkeypatch.chdir(home)
    one = warmslip.load("plate_with_hole").override(**{"mesh.file": "body.msh", "time.steps": 2})
    result = warmslip.run(one, out="run")
    shutil.copy("run/trajectory.h5", away)
    mesh.unlink()
    monkeypatch.chdir(away)
    with warmslip.Trajectory("trajectory.h5") as stored:
        d = stored.discretisation()
        assert np.array_equal(d.mesh.nodes, stored.nodes)
        last = (None if one is None else one[-1] for one in (stored.u, stored.w, stored.theta))
        assert np.abs(d.mises_of(*last)).max() > 0
    assert result.completed
    assert view(Path(), Path("view"))[-1].name == "report.html"


def test_two_runs_in_one_folder(tmp_path: Path) -> None:
    """The second says so and leaves the files of the first as they are."""
    warmslip.run(scene(), out=tmp_path)
    before = (tmp_path / "summary.json").read_bytes()
    holder = h5py.File(tmp_path / "trajectory.h5", "r+")
    try:
        with pytest.raises(ValueError, match=r"trajectory.h5 is being written by another run"):
            warmslip.run(scene(), out=tmp_path)
    finally:
        holder.close()
    assert (tmp_path / "summary.json").read_bytes() == before
    assert warmslip.run(scene(), out=tmp_path).completed


def test_a_run_that_is_under_way_keeps_its_folder(tmp_path: Path) -> None:
    """HDF5 locks no file that others may read while it is written: the run itself holds its folder, also if it is killed."""
    program = f"""
import warmslip
keys = {{"mesh.n": 4, "time.steps": 100000, "output.every": 100, "output.checkpoint": 100}}
scene = warmslip.load("paper_mixed").override(**keys)
warmslip.run(scene, out={str(tmp_path)!r})
"""
    first = subprocess.Popen([sys.executable, "-c", program], env=child_environment())
    try:
        began = time.monotonic()
        while not list(tmp_path.glob("checkpoint*")) and time.monotonic() - began < 60:
            time.sleep(0.05)
        for _ in range(2):
            with pytest.raises(ValueError, match="is being written by another run; wait for its end"):
                warmslip.run(scene(), out=tmp_path)
        assert first.poll() is None
    finally:
        first.kill()
        first.wait()
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        assert len(stored.time) >= 1
    assert warmslip.run(scene(), out=tmp_path).completed


def test_a_run_may_end_while_its_trajectory_is_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that is being written opens in one way only, and a moment later only in the other."""
    warmslip.run(scene(), out=tmp_path)
    opened, ways = h5py.File, iter([OSError("unable to open file"), OSError("not already open for SWMR writing"), None])

    def late(*arguments: Any, **keys: Any) -> Any:
        if error := next(ways):
            raise error
        return opened(*arguments, **keys)

    monkeypatch.setattr("warmslip.io.trajectory.h5py.File", late)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        assert stored.time[-1] == 0.5


def test_a_trajectory_that_is_open_here_is_not_replaced(tmp_path: Path) -> None:
    warmslip.run(scene(), out=tmp_path)
    with (
        warmslip.Trajectory(tmp_path / "trajectory.h5") as stored,
        pytest.raises(ValueError, match=r"trajectory.h5 is open in this program; close its Trajectory"),
    ):
        warmslip.run(scene(), out=tmp_path)
    assert stored is not None and warmslip.run(scene(), out=tmp_path).completed


LOOP = """
import os, signal, sys, warmslip
scene = warmslip.load("paper_mixed").override(**{"mesh.n": 4, "time.steps": 8})
def press(step, steps, report):
    if step == 3:
        os.kill(os.getpid(), signal.SIGINT)
runs = 0
for mu in (0.1, 0.2, 0.3):
    runs += 1
    print(runs, flush=True)
    warmslip.run(scene, out=sys.argv[1], progress=press)
"""


def test_ctrl_c_ends_a_loop_in_python(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOOP, str(tmp_path)],
        env=child_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == ["1"]
    assert done.returncode in (-signal.SIGINT, 130)
    assert "KeyboardInterrupt" in done.stderr
    assert (tmp_path / "checkpoint.npz").exists()


def contact_numbers(result: warmslip.Result) -> dict[str, Any]:
    return {name: value for name, value in result.summary["contact"].items() if name != "parts"}


def test_a_complete_run_stays_as_it_is(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    whole = warmslip.run(scene(), out=tmp_path)
    assert whole.summary["contact"]["normal_force"] > 0
    files = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for keys in ({}, {"output.every": 2}):
        again = warmslip.run(scene(**keys), out=tmp_path, resume=True)
        assert again.summary == whole.summary
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == files
    (told,) = caplog.messages
    assert "is complete and stays as it is; output.every holds for new steps alone" in told


def test_the_contact_of_a_summary_is_that_of_the_last_report() -> None:
    simulation = Simulation(scene())
    *_, (_, report) = simulation.steps()
    found = summary(simulation)["contact"]
    assert min(report.open, report.slip) > 0 and report.normal_force > 0
    for name in ("open", "stick", "slip"):
        assert found[name] == getattr(report, name)
    assert (found["normal_force"], found["max_penetration"]) == (report.normal_force, report.max_penetration)
    assert found["tangential_force"] == pytest.approx(np.linalg.norm(report.friction_traction), rel=1e-14)
    np.testing.assert_allclose(found["traction"], report.traction, rtol=1e-14)


def test_a_summary_that_was_lost_is_written_from_the_state(tmp_path: Path) -> None:
    """No step is left to take: forces, statuses and penetration are those of the stored state."""
    whole = warmslip.run(scene(), out=tmp_path)
    (tmp_path / "summary.json").unlink()
    again = warmslip.run(scene(), out=tmp_path, resume=True)
    one, other = contact_numbers(whole), contact_numbers(again)
    assert min(one["normal_force"], one["max_penetration"], one["slip"] + one["stick"]) > 0
    assert one.keys() == other.keys()
    for name, value in one.items():
        np.testing.assert_allclose(other[name], value, rtol=1e-13)


def test_a_load_that_ends_at_a_step_ends_there_in_pieces_too(tmp_path: Path) -> None:
    """The times of a run to 0.4 and of one to 1 in steps of 0.1 are the same numbers, and formulas in t do the same."""

    def pushed(end: float, steps: int) -> warmslip.Scene:
        keys = {"time.end": end, "time.steps": steps, "loads.body": ["0", "-1*(t<=0.3)"]}
        return scene(**keys)

    whole = warmslip.run(pushed(1.0, 10), out=tmp_path / "whole")
    warmslip.run(pushed(0.4, 4), out=tmp_path / "pieces")
    end = warmslip.run(pushed(1.0, 10), out=tmp_path / "pieces", resume=True)
    assert np.array_equal(whole.u, end.u)
    with warmslip.Trajectory(end.trajectory) as stored:
        assert np.asarray(stored.time).tolist() == [n / 10 for n in range(11)]


def test_states_that_are_stored_stay_whatever_the_new_cadence(tmp_path: Path) -> None:
    warmslip.run(scene(0.5, 8, **{"output.every": 3}), out=tmp_path)
    end = warmslip.run(scene(1.0, 16, **{"output.every": 5}), out=tmp_path, resume=True)
    with warmslip.Trajectory(end.trajectory) as stored:
        assert (np.asarray(stored.time) * 16).tolist() == [0, 3, 6, 10, 15, 16]
    with pytest.raises(KilledError):
        warmslip.run(scene(1.0, 16, **{"output.every": 2}), out=tmp_path / "killed", progress=stop_after(7))
    end = warmslip.run(scene(1.0, 16, **{"output.every": 5}), out=tmp_path / "killed", resume=True)
    with warmslip.Trajectory(end.trajectory) as stored:
        assert (np.asarray(stored.time) * 16).tolist() == [0, 2, 4, 6, 10, 15, 16]


READER = """
import sys, warmslip
with warmslip.Trajectory(sys.argv[1]) as stored:
    print(float(stored.time[-1]), flush=True)
    sys.stdin.readline()
    print(float(stored.time[-1]), float(abs(stored.u[-1]).max()), flush=True)
"""


def test_a_trajectory_that_another_program_reads_stays_whole_there(tmp_path: Path) -> None:
    first = warmslip.run(scene(), out=tmp_path)
    assert first.trajectory is not None
    reader = subprocess.Popen(
        [sys.executable, "-c", READER, str(first.trajectory)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=child_environment(),
        text=True,
    )
    assert reader.stdout is not None and reader.stdout.readline() == "0.5\n"
    warmslip.run(scene(1.0, 4), out=tmp_path)
    found, _ = reader.communicate("\n", timeout=60)
    assert found == f"0.5 {float(np.abs(first.u).max())!r}\n"


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
