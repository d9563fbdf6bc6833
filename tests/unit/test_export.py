"""A stored run for other programs, read back by meshio."""

from __future__ import annotations

import csv
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from conftest import Command

import warmslip
from warmslip import Trajectory
from warmslip.export import export


@pytest.mark.parametrize("name", ["plate_with_hole", "block_with_hole", "heat_slab"])
def test_the_series_is_the_trajectory(name: str, tmp_path: Path) -> None:
    scene = warmslip.load(name).override(**{"output.every": 4})
    result = warmslip.run(scene, out=tmp_path / "run")
    states, _ = export(tmp_path / "run", tmp_path / "series")
    sets = [one.attrib for one in ElementTree.parse(tmp_path / "series/body.pvd").iter("DataSet")]
    assert [float(one["timestep"]) for one in sets] == pytest.approx(np.linspace(0, scene.time.end, states))
    last = meshio.read(tmp_path / "series" / sets[-1]["file"])
    if result.u is not None:
        d = result.u.shape[1]
        assert np.array_equal(last.point_data["displacement"][:, :d], result.u)
        assert "von Mises" in last.cell_data
    assert np.array_equal(last.point_data["temperature"], result.theta)
    rows = list(csv.DictReader((tmp_path / "series/series.csv").open()))
    assert len(rows) == scene.time.steps
    if not scene.moves:
        assert not (tmp_path / "series/contact.pvd").exists()
        return
    assert float(rows[-1]["normal_force"]) == result.summary["contact"]["normal_force"]
    points = meshio.read(sorted((tmp_path / "series").glob("contact_*.vtu"))[-1])
    pressure, gap, status = (points.point_data[key] for key in ("pressure", "gap", "status"))
    stiffness = scene.contacts[0].stiffness
    assert pressure == pytest.approx(stiffness * np.maximum(-gap, 0), rel=1e-9, abs=1e-9 * pressure.max())
    bound = 0.3 * pressure
    vectors = points.point_data["friction traction"]
    weights = np.asarray(warmslip.discretise(scene).surface.weights)
    on_body = [float(rows[-1][f"friction_{axis}"]) for axis in "xyz"[: result.u.shape[1]]]
    assert (weights @ vectors)[: len(on_body)] == pytest.approx(on_body, rel=1e-9, abs=1e-12)
    traction = np.linalg.norm(vectors, axis=1)
    assert (traction <= bound * (1 + 1e-9)).all()
    assert traction[status == 2] == pytest.approx(bound[status == 2], rel=1e-8)


def test_the_command(command: Command, tmp_path: Path) -> None:
    command("run", "heat_slab", "--set", "time.steps=3", "--out", "run")
    assert "4 states in series/body.pvd" in command("export", "run", "--out", "series").stdout
    missing = command("export", "nowhere", "--out", "series")
    assert missing.returncode == 2
    assert "'nowhere' holds no trajectory.h5; give the folder" in missing.stderr
    with Trajectory(tmp_path / "run/trajectory.h5") as t:
        assert t.u is None
        assert t.theta.shape[0] == 4
