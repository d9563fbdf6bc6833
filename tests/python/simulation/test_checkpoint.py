"""A run that is killed and resumed ends as one that was not, bit by bit; torn and foreign checkpoints are told apart."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from support.processes import Command, child_environment
from support.stopped import KilledError, readable, same, scene, stop_after

import warmslip
from warmslip import Scene
from warmslip.io import paraview
from warmslip.scene.reader import build
from warmslip.simulation import checkpoint
from warmslip.simulation.simulation import Simulation


@pytest.mark.parametrize(
    "more",
    [
        (),
        ("time.coupling=monolithic",),
        ("contact.quadrature=gauss-2",),
        ("contact.friction.kinetic=0.1", "contact.friction.speed=0.5", "loads.body=['t', '-cos(t)']"),
    ],
    ids=["plain", "monolithic", "Gauss", "weakening under moving loads"],
)
@pytest.mark.parametrize("steps", [3, 5, 23])
def test_a_resumed_run_ends_the_same(tmp_path: Path, more: tuple[str, ...], steps: int) -> None:
    whole = warmslip.run(scene(*more), out=tmp_path / "whole")
    with pytest.raises(KilledError):
        warmslip.run(scene(*more), out=tmp_path / "torn", progress=stop_after(steps))
    taken: list[int] = []
    again = warmslip.run(scene(*more), out=tmp_path / "torn", resume=True, progress=lambda step, *_: taken.append(step))
    assert taken[0] == steps // 5 * 5 + 1
    assert again.outcome == "completed"
    for name in ("u", "w", "theta"):
        assert np.array_equal(getattr(whole, name), getattr(again, name))
    for output in ("balances", "digits"):
        assert again.summary[output] == whole.summary[output]
    assert again.summary["steps"] == 24
    same(tmp_path / "whole", tmp_path / "torn")
    assert not any((tmp_path / "torn" / name).exists() for name in checkpoint.NAMES)


def test_a_resumed_run_knows_the_largest_values_so_far(tmp_path: Path) -> None:
    """Errors are relative to them: the digits of what has died away would else be fewer."""
    whole = Simulation(scene())
    for state, _ in whole.steps():
        if state.step == 5:
            break
    with pytest.raises(KilledError):
        warmslip.run(scene(), out=tmp_path, progress=stop_after(7))
    again = Simulation(scene())
    assert again.resume(tmp_path) == 5
    assert again.stepper.extents == whole.stepper.extents
    assert min(again.stepper.extents[:-1]) > 0 == again.stepper.extents[-1]  # the plane has no third axis


@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
def test_a_free_body_goes_on_with_its_rigid_motion_apart(tmp_path: Path, coupling: str) -> None:
    """Its strain would else lose the digits of its speed at every checkpoint."""
    table = {
        "mesh": {"shape": "square", "n": 3},
        "time": {"end": 1.0, "steps": 4, "coupling": coupling},
        "inertia": {"density": 1.0},
        "elasticity": {"young": 100.0, "poisson": 0.3, "assumption": "plane_strain"},
        "heat": {
            "conductivity": 1.0,
            "capacity": 1.0,
            "expansion": {"tensor": 0.1},
            "heating": {"tensor": -0.1},
        },
        "initial": {"velocity": [1e8, 0.0]},
        "loads": {"traction": {"right": ["sin(3*t)", 0.3]}},
    }
    one = build(table | {"output": {"checkpoint": 1}})
    warmslip.run(one, out=tmp_path / "whole")
    with pytest.raises(KilledError):
        warmslip.run(one, out=tmp_path / "resumed", progress=stop_after(3))
    warmslip.run(one, out=tmp_path / "resumed", resume=True)
    warmslip.run(build(table), out=tmp_path / "without")
    same(tmp_path / "whole", tmp_path / "resumed")
    same(tmp_path / "whole", tmp_path / "without")


def test_a_torn_checkpoint_is_passed_over_for_the_one_before(tmp_path: Path) -> None:
    with pytest.raises(KilledError):
        warmslip.run(scene(), out=tmp_path, progress=stop_after(13))
    newest, previous = (tmp_path / name for name in checkpoint.NAMES)
    whole = newest.read_bytes()
    simulation = Simulation(scene())
    assert simulation.resume(tmp_path) == 10
    for spoiled in (whole[: len(whole) // 2], whole[:-200] + bytes(200), b"", whole[:900] + b"x" + whole[901:]):
        newest.write_bytes(spoiled)
        assert Simulation(scene()).resume(tmp_path) == 5
    previous.write_bytes(b"nothing")
    assert Simulation(scene()).resume(tmp_path) == 0  # from the start


def test_a_checkpoint_of_another_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(KilledError):
        warmslip.run(scene(), out=tmp_path, progress=stop_after(7))
    with pytest.raises(ValueError, match=r"is of another scene; run it as it was.*start; inertia.density differs$"):
        warmslip.run(scene("inertia.density=2.0", "output.every=3"), out=tmp_path, resume=True)
    with pytest.raises(ValueError, match=r"; inertia.density, mesh.n differ$"):
        warmslip.run(scene("inertia.density=2.0", "mesh.n=9"), out=tmp_path, resume=True)
    shutil.copy(tmp_path / checkpoint.NAMES[0], tmp_path / checkpoint.NAMES[1])
    (tmp_path / checkpoint.NAMES[0]).write_bytes(b"torn")
    assert Simulation(scene()).resume(tmp_path) == 5


LONG = ["mesh.n=32", "time.steps=1200", "output.every=50", "output.checkpoint=40"]


@pytest.mark.parametrize("shorter", ["steps/slip", "balances/friction", "contact/status", "states/theta"])
def test_a_series_that_lacks_its_last_row_cuts_the_others(tmp_path: Path, shorter: str) -> None:
    warmslip.run(scene("output.every=1"), out=tmp_path)
    path = tmp_path / "trajectory.h5"
    with warmslip.Trajectory(path) as t:
        whole = t.series("contact")["force"], t.u[:]
    with h5py.File(path, "r+") as file:
        file[shorter].resize(len(file[shorter]) - 1, axis=0)
    readable(path)
    with warmslip.Trajectory(path) as t:
        steps = 24 - (not shorter.startswith("states"))
        assert np.array_equal(t.series("contact")["force"], whole[0][:steps])
        assert np.array_equal(t.u, whole[1][:24]) and len(t.series("contact")["weights"]) == 9
        assert np.array_equal(t.contact("force", -1), whole[0][steps - 1])
        with pytest.raises(IndexError, match=f"there are {steps} steps"):
            t.contact("force", steps)
    assert paraview.export(tmp_path, tmp_path / "series") == 24


def killed(folder: Path, after: float | None) -> bool:
    """Starts or goes on with a run and kills it `after` seconds beyond its first checkpoint; whether it ended by itself."""
    words = [word for key in LONG for word in ("--set", key)]
    program = str(Path(sys.executable).parent / "warmslip")
    newest = folder / checkpoint.NAMES[0]

    def written() -> int:
        try:
            return newest.stat().st_mtime_ns
        except FileNotFoundError:  # none yet, or being replaced
            return 0

    begin = written()
    process = subprocess.Popen(
        [program, "run", "paper_mixed", *words, "--out", str(folder), "--resume"],
        env=child_environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    while after is not None and process.poll() is None:
        if written() > begin:  # so that every process brings the run on
            readable(folder / "trajectory.h5")  # while it is being written
            time.sleep(after)
            process.send_signal(signal.SIGKILL)
            break
        time.sleep(0.002)
    _, errors = process.communicate(timeout=600)
    if process.returncode:
        readable(folder / "trajectory.h5")
    assert process.returncode in (0, -signal.SIGKILL), errors.decode()
    return process.returncode == 0


def kill_at_random(folder: Path, times: int, seed: int = 1) -> None:
    """Kills runs `times` times while they step and resumes them each time, against the run that was left alone."""
    assert killed(folder / "whole", None)
    moments, count, torn = random.Random(seed), 0, 0
    while count < times:
        here = folder / f"torn{torn}"
        while count < times and not killed(here, moments.uniform(0.0, 0.4)):
            count += 1
        if count == times:
            assert killed(here, None)
        same(folder / "whole", here)
        torn += 1
    assert torn <= times


@pytest.mark.slow
def test_killed_at_random_moments(tmp_path: Path) -> None:
    kill_at_random(tmp_path, int(os.environ.get("WARMSLIP_KILLS", "6")))


def test_resume_by_command(command: Command, tmp_path: Path) -> None:
    command("run", "heat_slab", "--out", "one")
    again = command("run", "heat_slab", "--out", "two", "--resume")  # nothing to go on from
    assert again.returncode == 0, again.stderr
    same(tmp_path / "one", tmp_path / "two")


@pytest.mark.parametrize("more", [(), ("contact.quadrature=gauss-2",), ("time.coupling=monolithic",)])
def test_a_checkpoint_changes_no_bit(more: tuple[str, ...]) -> None:
    """Wherever it is written, as an interruption or the clock has it: what a stepper forgets there it makes again alike."""
    plain, forgetful = warmslip.Simulation(scene(*more)), warmslip.Simulation(scene(*more))
    for _ in zip(plain.steps(), forgetful.steps(), strict=True):
        forgetful.stepper.clear_cache()
    for name in ("u", "w", "theta"):
        one, other = (np.asarray(getattr(simulation.stepper, name).array) for simulation in (plain, forgetful))
        assert np.array_equal(one, other), name


def test_checkpoints_by_the_clock(tmp_path: Path) -> None:
    often = scene("output.checkpoint=1000", "output.checkpoint_minutes=1e-9")
    with pytest.raises(KilledError):
        warmslip.run(often, out=tmp_path, progress=stop_after(7))
    taken: list[int] = []
    warmslip.run(often, out=tmp_path, resume=True, progress=lambda step, *_: taken.append(step))
    assert taken[0] == 8


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_is_resumable(tmp_path: Path, number: signal.Signals) -> None:
    """One signal stops after the step, leaves a checkpoint and says so; the resumed run ends as one that was let alone."""
    whole = warmslip.run(scene(), out=tmp_path / "whole")

    def interrupt(step: int, steps: int, report: Any) -> None:
        if step == 7:
            os.kill(os.getpid(), number)

    before = signal.getsignal(number)
    if number == signal.SIGINT:  # a loop in Python ends as well
        with pytest.raises(KeyboardInterrupt):
            warmslip.run(scene(), out=tmp_path / "torn", progress=interrupt)
    else:
        torn = warmslip.run(scene(), out=tmp_path / "torn", progress=interrupt)
        assert torn.outcome == "interrupted" and not torn.completed and torn.summary["steps"] == 8
    assert signal.getsignal(number) is before
    assert json.loads((tmp_path / "torn" / "summary.json").read_text())["outcome"] == "interrupted"
    taken: list[int] = []
    again = warmslip.run(scene(), out=tmp_path / "torn", resume=True, progress=lambda step, *_: taken.append(step))
    assert taken[0] == 9  # from where it was, not from the checkpoint of step 5
    assert again.completed and np.array_equal(again.u, whole.u) and np.array_equal(again.theta, whole.theta)
    assert not (tmp_path / "torn" / "checkpoint.npz").exists()


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 2])
def test_ctrl_c_ends_with_its_own_exit_code(tmp_path: Path, ranks: int) -> None:
    start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    program = str(Path(sys.executable).parent / "warmslip")
    long = ["run", "paper_mixed", "--set", "mesh.n=8", "--set", "time.steps=100000", "--out", str(tmp_path)]
    process = subprocess.Popen([*start, program, *long], env=child_environment(), stdout=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 300
    while not (tmp_path / "checkpoint.npz").exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    process.send_signal(signal.SIGINT)
    message, _ = process.communicate(timeout=300)
    assert process.returncode == 130 or ranks > 1  # mpirun has an exit code of its own
    assert process.returncode != 0 and "--resume goes on" in message


def test_a_run_with_functions_is_not_resumed_without_them(tmp_path: Path) -> None:
    law = {"bottom": warmslip.Law(friction=lambda p, s: (0.1 * p, 0.1, 0.0))}
    with pytest.raises(KilledError):
        warmslip.run(scene(), out=tmp_path, laws=law, progress=stop_after(7))
    with pytest.raises(ValueError, match="is of another set of Python functions"):
        warmslip.run(scene(), out=tmp_path, resume=True)
    assert warmslip.run(scene(), out=tmp_path, laws=law, resume=True).summary["steps"] == 24


def test_functions_are_told_apart_by_name(tmp_path: Path) -> None:
    """A run with functions in the place of its loads is not resumed without them, nor with a law besides."""
    still = replace(warmslip.Loads.of(scene()), body=lambda x, t: np.full(x.shape, -1.0))
    with pytest.raises(KilledError):
        warmslip.run(scene(), out=tmp_path, loads=still, progress=stop_after(7))
    for other in ({}, {"loads": still, "laws": {"bottom": warmslip.Law(friction=lambda p, s: (0.2 * p, 0.2, 0.0))}}):
        with pytest.raises(ValueError, match="is of another set of Python functions"):
            warmslip.run(scene(), out=tmp_path, resume=True, **other)
    assert warmslip.run(scene(), out=tmp_path, loads=still, resume=True).summary["steps"] == 24


def test_a_trajectory_without_a_state_is_refused(tmp_path: Path) -> None:
    warmslip.run(scene(), out=tmp_path)
    with h5py.File(tmp_path / "trajectory.h5", "r+") as file:
        file["states/u"].resize(0, axis=0)
    with pytest.raises(ValueError, match="there is no whole state in it yet"):
        warmslip.Trajectory(tmp_path / "trajectory.h5")
    with h5py.File(tmp_path / "trajectory.h5", "r+") as file:
        del file["steps/slip"]
    with pytest.raises(ValueError, match="steps/slip is missing"):
        warmslip.Trajectory(tmp_path / "trajectory.h5")


def test_the_end_of_another_scene_is_not_overwritten(tmp_path: Path) -> None:
    warmslip.run(scene(), out=tmp_path)
    with pytest.raises(ValueError, match=r"checkpoint.end.npz is of another scene; run it as it was"):
        warmslip.run(scene("contact.stiffness=20.0"), out=tmp_path, resume=True)
    assert json.loads((tmp_path / "summary.json").read_text())["stamp"]["scene_hash"] == scene().digest()
    assert warmslip.run(scene(), out=tmp_path, resume=True).completed


def test_a_run_that_has_ended_right_is_not_computed_again(tmp_path: Path) -> None:
    taken: list[int] = []

    def again(one: Scene, **more: Any) -> Any:
        taken.clear()
        return warmslip.run(one, out=tmp_path, resume=True, progress=lambda step, *_: taken.append(step), **more)

    first = again(scene())
    assert len(taken) == 24
    written = (tmp_path / "trajectory.h5").stat().st_mtime_ns
    second = again(scene())
    assert not taken and (tmp_path / "trajectory.h5").stat().st_mtime_ns == written
    assert second.completed and second.summary == json.loads(json.dumps(first.summary))
    assert all(np.array_equal(getattr(first, name), getattr(second, name)) for name in ("u", "w", "theta"))
    law = {"bottom": warmslip.Law(friction=lambda p, s: (0.1 * p, 0.1, 0.0))}
    again(scene(), laws=law)  # a law is not told from another by its end
    assert len(taken) == 24
    again(scene())
    assert len(taken) == 24
    summary = json.loads((tmp_path / "summary.json").read_text())
    summary["stamp"]["fingerprint"] = "of other code"
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    (tmp_path / "checkpoint.end.npz").unlink()  # whose owner is the code as well
    again(scene())
    assert len(taken) == 24
