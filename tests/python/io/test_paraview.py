"""A stored run for other programs, read back by meshio."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import h5py
import meshio
import numpy as np
import pytest
from support.processes import Command

import warmslip
from warmslip import Trajectory
from warmslip.io.paraview import export
from warmslip.mesh.files import find


@pytest.mark.parametrize("name", ["plate_with_hole", "block_with_hole", "heat_slab"])
def test_the_series_is_the_trajectory(name: str, tmp_path: Path) -> None:
    scene = warmslip.load(name).override(**{"output.every": 4})
    result = warmslip.run(scene, out=tmp_path / "run")
    states = export(tmp_path / "run", tmp_path / "series")
    sets = [one.attrib for one in ElementTree.parse(tmp_path / "series/body.pvd").iter("DataSet")]
    assert [float(one["timestep"]) for one in sets] == pytest.approx(np.linspace(0, scene.time.end, states))
    last = meshio.read(tmp_path / "series" / sets[-1]["file"])
    if result.u is not None:
        d = result.u.shape[1]
        assert np.array_equal(last.point_data["displacement"][:, :d], result.u)
        assert "von Mises" in last.cell_data
    assert np.array_equal(last.point_data["temperature"], result.theta)
    rows = list(csv.DictReader((tmp_path / "series/series.csv").read_text().splitlines()))
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


def test_chosen_fields_and_times(tmp_path: Path) -> None:
    warmslip.run(warmslip.load("paper_mixed", ["mesh.n=4", "time.steps=4"]), out=tmp_path / "run")
    assert export(tmp_path / "run", tmp_path / "some", fields=["stress", "gap"], times=[0.5, 0.49, 1.0]) == 2
    names = sorted(path.name for path in (tmp_path / "some").glob("*.vtu"))
    assert names == ["body_0002.vtu", "body_0004.vtu", "contact_0002.vtu", "contact_0004.vtu"]
    body, contact = (meshio.read(tmp_path / "some" / f"{name}_0004.vtu") for name in ("body", "contact"))
    assert (set(body.point_data), set(body.cell_data), set(contact.point_data)) == (set(), {"stress"}, {"gap"})
    export(tmp_path / "run", tmp_path / "body", fields=["temperature"])
    assert not (tmp_path / "body/contact.pvd").exists()
    with pytest.raises(ValueError, match="did you mean 'von Mises'"):
        export(tmp_path / "run", tmp_path / "none", fields=["von mises"])


def test_the_gap_is_the_one_that_was_used(tmp_path: Path) -> None:
    """Also where Python's loads took the place of the scene's."""
    scene = warmslip.load("paper_mixed", ["mesh.n=4", "time.steps=2"])
    loads = replace(warmslip.Loads.of(scene), gap=lambda x, t: 0.1 * t + 0 * x[:, 0])
    seen = []
    warmslip.run(
        scene, out=tmp_path / "run", loads=loads, observers=[lambda state, _: seen.append(state.contact["gap"])]
    )
    export(tmp_path / "run", tmp_path / "series")
    for i, gap in enumerate(seen, start=1):
        written = meshio.read(tmp_path / f"series/contact_{i:04d}.vtu").point_data["gap"]
        assert np.allclose(written, gap, rtol=1e-14) and abs(gap.mean()) > 0.01


def test_the_mesh_file_of_the_run_is_used_although_it_has_changed(tmp_path: Path) -> None:
    """A trajectory holds the mesh file; one of an earlier version, which does not, notices the change."""
    for name in ("heat.toml", "plate.msh"):
        (tmp_path / name).write_bytes(
            find("plate_with_hole.msh").read_bytes()
            if name == "plate.msh"
            else b"mesh.file = 'plate.msh'\ntime.steps = 1\nheat.conductivity = 1.0\n"
        )
    warmslip.run(warmslip.load(tmp_path / "heat.toml"), out=tmp_path / "run")
    assert export(tmp_path / "run", tmp_path / "series") == 2
    plate = meshio.gmsh.read(tmp_path / "plate.msh")
    plate.points *= 1.5
    meshio.write(tmp_path / "plate.msh", plate, file_format="gmsh22")
    assert export(tmp_path / "run", tmp_path / "series") == 2
    with h5py.File(tmp_path / "run" / "trajectory.h5", "r+") as file:
        del file["mesh/file"]
    with pytest.raises(ValueError, match="run on another mesh than its scene gives"):
        export(tmp_path / "run", tmp_path / "series")


def test_a_series_holds_nothing_of_an_earlier_one(tmp_path: Path) -> None:
    warmslip.run(warmslip.load("paper_mixed", ["mesh.n=4", "time.steps=4"]), out=tmp_path / "long")
    warmslip.run(warmslip.load("heat_slab", ["time.steps=2"]), out=tmp_path / "short")
    mine = ["body_final.vtu", "contact.csv", "my_body_0001.vtu"]
    (tmp_path / "series").mkdir()
    for name in mine:
        (tmp_path / "series" / name).write_text("mine")
    export(tmp_path / "long", tmp_path / "series")
    with pytest.raises(ValueError, match="no field"):
        export(tmp_path / "short", tmp_path / "series", fields=["heat"])
    assert (tmp_path / "series/contact_0004.vtu").exists()  # a refusal takes nothing away
    export(tmp_path / "short", tmp_path / "series")
    names = {path.name for path in (tmp_path / "series").iterdir()}
    assert names == {*mine, "body.pvd", "series.csv", "reactions.csv", *(f"body_{i:04d}.vtu" for i in range(3))}


def test_what_the_run_does_not_have_is_said(tmp_path: Path) -> None:
    warmslip.run(warmslip.load("quasistatic_punch", ["mesh.n=4", "time.steps=4"]), out=tmp_path / "run")
    message: list[str] = []
    export(tmp_path / "run", tmp_path / "series", warn=message.append)
    export(tmp_path / "run", tmp_path / "series", fields=["gap"], times=[0.5], warn=message.append)
    assert message == []
    chosen = ["temperature", "displacement", "pressure"]
    assert export(tmp_path / "run", tmp_path / "series", fields=chosen, times=[0.5, 0.6], warn=message.append) == 1
    assert message[0].startswith(
        "the run has no temperature, which is left out; it has displacement, velocity, stress, "
    )
    assert message[1:] == ["no state is stored at t = 0.6; the nearest, at t = 0.5, is taken"]
    with pytest.raises(ValueError, match="the run has no temperature; choose from displacement"):
        export(tmp_path / "run", tmp_path / "series", fields=["temperature"])


def test_the_command_says_what_it_took(command: Command, tmp_path: Path) -> None:
    command("run", "quasistatic_punch", "--set", "mesh.n=4", "--set", "time.steps=4", "--out", "run")
    output = command("export", "run", "--out", "series", "--fields", "temperature,pressure", "--times", "0.3")
    assert output.returncode == 0 and output.stdout.startswith(
        "1 states in series/contact.pvd, time series in series.csv"
    )
    notes = output.stderr.splitlines()
    assert len(notes) == 2 and all(note.startswith("note: ") for note in notes)
    assert "no temperature" in notes[0] and "at t = 0.25, is taken" in notes[1]
