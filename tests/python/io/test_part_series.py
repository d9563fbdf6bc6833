"""Reactions and heat flows of a stored run: what the file, the summary and the table say is what the steps had."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import warmslip
from warmslip import Trajectory
from warmslip.io.paraview import export
from warmslip.model.heat_flows import HeatFlows
from warmslip.model.reactions import Reactions
from warmslip.records import tables
from warmslip.simulation.simulation import Simulation

KEYS = ["mesh.n=4", "time.steps=4", "contact.heat_exchange.foundation_temperature=t", "output.every=3"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("stored")
    warmslip.run(warmslip.load("paper_mixed", KEYS), out=path)
    return path


def test_the_file_the_table_and_the_summary_agree(folder: Path, tmp_path: Path) -> None:
    simulation = Simulation(warmslip.load("paper_mixed", KEYS))
    reactions, flows = Reactions(simulation.discretisation), HeatFlows(simulation.discretisation)
    found: list[Any] = []
    for _ in simulation.steps():
        found.append((*reactions.of(simulation.stepper), flows.of(simulation.stepper)))
    export(folder, tmp_path)
    rows = tables.read(tmp_path / "reactions.csv")
    summary = json.loads((folder / "summary.json").read_text())
    with Trajectory(folder / "trajectory.h5") as t:
        assert list(t.reactions) == ["top"] and list(t.heat_flows) == flows.names
        normal = t.series("steps")["normal_force"]
        for i, (force, moment, flow) in enumerate(found):
            assert np.array_equal(t.reactions["top"]["force"][i], force[0])
            assert np.array_equal(t.reactions["top"]["moment"][i], moment[0])
            assert [rows[i]["force_x top"], rows[i]["force_y top"], rows[i]["moment_z top"]] == [*force[0], *moment[0]]
            for name, value in zip(flows.names, flow, strict=True):
                assert t.heat_flows[name][i] == value == rows[i][f"heat {name}"]
            assert rows[i]["normal_force bottom"] == pytest.approx(normal[i], rel=1e-14)
        assert [row["time"] for row in rows] == t.series("steps")["time"].tolist()
    force, moment, flow = found[-1]
    assert summary["reactions"] == {"top": {"force": force[0].tolist(), "moment": moment[0].tolist()}}
    assert summary["heat_flows"] == dict(zip(flows.names, flow.tolist(), strict=True))
    assert np.abs(force).max() > 0.1 and np.abs(flow).max() > 0.1


def test_files_of_earlier_versions_have_none(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "trajectory.h5").write_bytes((folder / "trajectory.h5").read_bytes())
    with h5py.File(tmp_path / "trajectory.h5", "r+") as file:
        del file["reactions"], file["heat_flows"]
    with Trajectory(tmp_path / "trajectory.h5") as t:
        assert t.reactions == {} and t.heat_flows == {}
    export(tmp_path, tmp_path / "series")
    assert "normal_force bottom" in tables.read(tmp_path / "series/reactions.csv")[0]


@pytest.mark.parametrize("spoilt", ["names", "other names", "shape", "missing"])
def test_a_damaged_group_is_refused(folder: Path, tmp_path: Path, spoilt: str) -> None:
    path = tmp_path / "trajectory.h5"
    path.write_bytes((folder / "trajectory.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        if spoilt == "names":
            file["reactions"].attrs["names"] = "[1]"
        elif spoilt == "other names":
            file["heat_flows"].attrs["names"] = '["one"]'
        elif spoilt == "shape":
            moment = np.asarray(file["reactions/moment"])
            del file["reactions/moment"]
            file["reactions/moment"] = np.repeat(moment, 3, axis=2)
        else:
            del file["heat_flows/flow"]
    with pytest.raises(ValueError, match="is damaged or no trajectory"):
        Trajectory(path)


def test_a_run_that_was_rejected_has_no_last_reactions(tmp_path: Path) -> None:
    done = warmslip.run(warmslip.load("paper_mixed", [*KEYS, "loads.body=[0, '1 / (t < 0.6)']"]), out=tmp_path)
    assert done.outcome == "data_not_finite"
    assert done.summary["reactions"] == {} == done.summary["heat_flows"]
    with Trajectory(tmp_path / "trajectory.h5") as t:
        assert len(t.reactions["top"]["force"]) == 2


def test_a_body_that_nothing_holds_has_no_group(tmp_path: Path) -> None:
    scene = warmslip.load("heat_slab", ["time.steps=2"])
    warmslip.run(scene, out=tmp_path)
    with h5py.File(tmp_path / "trajectory.h5") as file:
        assert "reactions" not in file
