"""A disk that is full at a checkpoint or at the end: one sentence, and all that was written before can be gone on from."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.processes import Command
from support.stopped import KilledError, readable, same, scene, stop_after

import warmslip
from warmslip.io import vtu
from warmslip.simulation import checkpoint
from warmslip.simulation.simulation import Simulation


@pytest.fixture(name="small_disk")
def _small_disk(tmp_path: Path) -> Any:
    """A file system of two megabytes; only root can make one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    made = ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(made, capture_output=True, check=False).returncode != 0:
        pytest.skip("a small file system cannot be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_ends_in_a_sentence_and_can_be_gone_on_from(
    command: Command, small_disk: Path, tmp_path: Path
) -> None:
    keys = ["mesh.n=16", "time.steps=300", "output.every=1", "output.checkpoint=3"]
    call = ["run", "paper_mixed", *(word for key in keys for word in ("--set", key)), "--out"]
    full = command(*call, small_disk / "run")
    assert full.returncode == 1
    assert (
        full.stderr.split()
        == (
            f"error: the disk is full ({small_disk / 'run'}); make room and give the command again with --resume"
        ).split()
    )
    readable(small_disk / "run" / "trajectory.h5")
    assert {path.name for path in (small_disk / "run").iterdir()} == {*checkpoint.NAMES, "trajectory.h5"}
    shutil.copytree(small_disk / "run", tmp_path / "run")
    assert command(*call, tmp_path / "whole").returncode == 0
    again = command(*call, tmp_path / "run", "--resume")
    assert again.returncode == 0, again.stderr
    same(tmp_path / "whole", tmp_path / "run")


@pytest.mark.parametrize("every", [5, 100], ids=["checkpoints", "too short for one"])
def test_a_disk_that_is_full_at_the_end_loses_nothing(tmp_path: Path, monkeypatch: Any, every: int) -> None:
    one = scene(f"output.checkpoint={every}")
    whole = warmslip.run(one, out=tmp_path / "whole")

    def full(path: Path, *fields: Any) -> None:
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(vtu, "write_vtu", full)
    with pytest.raises(OSError, match="No space left") as raised:
        warmslip.run(one, out=tmp_path / "run")
    assert raised.value.filename == str(tmp_path / "run")  # what the command names in its sentence
    left = {path.name for path in (tmp_path / "run").iterdir()}
    assert left == {"trajectory.h5", "summary.json", checkpoint.END, *(checkpoint.NAMES if every == 5 else ())}
    same(tmp_path / "whole", tmp_path / "run")
    monkeypatch.undo()
    again = warmslip.run(one, out=tmp_path / "run", resume=True)
    assert again.completed and np.array_equal(again.u, whole.u)
    left = {path.name for path in (tmp_path / "run").iterdir()}
    assert left == {"trajectory.h5", "summary.json", "final.vtu", checkpoint.END}
    assert (tmp_path / "run" / "final.vtu").read_bytes() == (tmp_path / "whole" / "final.vtu").read_bytes()


def test_a_checkpoint_that_cannot_be_written_leaves_those_before(tmp_path: Path, monkeypatch: Any) -> None:
    with pytest.raises(KilledError):
        warmslip.run(scene(), out=tmp_path, progress=stop_after(7))
    before = (tmp_path / checkpoint.NAMES[0]).read_bytes()

    def full(path: Path, **arrays: Any) -> None:
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="No space left"):
        warmslip.run(scene(), out=tmp_path, resume=True)
    assert (tmp_path / checkpoint.NAMES[0]).read_bytes() == before
    assert not (tmp_path / "checkpoint.part.npz").exists()
    monkeypatch.undo()
    assert Simulation(scene()).resume(tmp_path) == 5
