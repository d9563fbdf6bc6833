"""Scenes of the campaign that were once stopped or wrong: each ends right, and as near to 80 digits as it says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from campaign import judge
from support.folders import TESTS
from support.processes import Command

import warmslip
from warmslip.io.trajectory import Trajectory

FOLDER = TESTS / "campaign/scenes"
SCENES = sorted(path.stem for path in FOLDER.glob("*.toml"))
# judged by the digits that the run states; all others to 1e-6
STATED = {
    "near_its_reference_temperature",
    "setting_off",
    "slender_and_incompressible",
    "soft_and_warm",
    "thin_and_sliding",
    "thin_and_soft",
}
RANKS = ["free_warm", "gauss_2_moving_support", "regularised_steep", "slender", "solid_gauss", "waves_on_the_way_solid"]


def well(name: str, simulation: judge.Ran) -> None:
    """Asserts that a run of a scene is what 80 digits say."""
    assert simulation.outcome == "completed", simulation.reason
    row = judge.judge(warmslip.load(FOLDER / f"{name}.toml"), simulation)
    errors = {field: float(row[f"error_{field}"]) for field in judge.FIELDS}
    assert row["class"] in ("right", "right_as_stated") if name in STATED else row["class"] == "right", errors
    assert all(error <= judge.stated(simulation, field) for field, error in errors.items()), errors


@pytest.mark.parametrize("name", SCENES)
def test_ends_right(name: str) -> None:
    well(name, judge.run(warmslip.load(FOLDER / f"{name}.toml")))


@pytest.mark.parametrize("name", SCENES)
def test_ends_right_with_petsc(name: str) -> None:
    well(name, judge.run(warmslip.load(FOLDER / f"{name}.toml"), backend="petsc"))


@pytest.mark.parametrize("backend", ["automatic", "petsc"])
@pytest.mark.parametrize("path", sorted((FOLDER / "doubtful").glob("*.toml")), ids=lambda path: path.stem)
def test_what_doubles_may_not_hold_is_said(path: Path, backend: str) -> None:
    """Rounding decides: the run stops, or its digits say how little is known."""
    scene = warmslip.load(path)
    simulation = judge.run(scene, backend=backend)
    if simulation.outcome == "completed":
        assert judge.judge(scene, simulation)["class"] in ("right", "right_as_stated")
    else:
        assert simulation.outcome == "precision_lost"


def read(folder: Path) -> judge.Ran:
    """A run that was written."""
    summary = json.loads((folder / "summary.json").read_text())
    with Trajectory(folder / "trajectory.h5") as t:
        d, states = t.discretisation(), []
        for n in range(1, len(t.time)):
            u, w, theta = (None if one is None else np.array(one[n]) for one in (t.u, t.w, t.theta))
            force = np.array(t.contact("force", n - 1))
            states.append({"u": u, "w": w, "theta": theta, "force": force, "stress": d.stress(u, w, theta)})
    surface = d.surface
    places = np.array(surface.positions), np.array(surface.normals)
    return judge.Ran(summary["outcome"], str(summary["failure"]), states, *places, digits=summary["digits"])


@pytest.mark.mpi
@pytest.mark.parametrize("name", RANKS)
def test_ends_right_on_two_ranks(name: str, command: Command, tmp_path: Path) -> None:
    command("run", FOLDER / f"{name}.toml", "--out", "run", ranks=2)
    well(name, read(tmp_path / "run"))


def test_every_scene_says_what_is_hard_about_it() -> None:
    assert len(SCENES) >= 20 and {*STATED, *RANKS} <= set(SCENES)
    for name in SCENES:
        first = (FOLDER / f"{name}.toml").read_text().splitlines()[0]
        assert first.startswith("# ") and first.endswith("."), name
