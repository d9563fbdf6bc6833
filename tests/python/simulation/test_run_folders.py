"""Folders of runs: they travel, and are not written twice at a time or under a reader."""

from __future__ import annotations

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
from support.small import scene

import warmslip


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
