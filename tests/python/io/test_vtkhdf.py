"""One VTKHDF file holds what the series of VTU files does, where the format says that a reader finds it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import pytest
from support.processes import Command

import warmslip
from warmslip.io.paraview import export

KEYS = ["mesh.n=4", "time.steps=4"]


def state(path: Path, step: int) -> tuple[Any, dict[str, Any], dict[str, Any]]:
    """Positions, fields of points and fields of cells of a step, as the format has a reader find them."""
    with h5py.File(path) as file:
        group, steps = file["VTKHDF"], file["VTKHDF/Steps"]
        assert group.attrs["Type"] == b"UnstructuredGrid" and list(group.attrs["Version"]) == [2, 0]
        assert steps["NumberOfParts"][step] == 1
        part = int(steps["PartOffsets"][step])
        counts = {"Point": int(group["NumberOfPoints"][part]), "Cell": int(group["NumberOfCells"][part])}
        begin = int(steps["PointOffsets"][step])
        points = group["Points"][begin : begin + counts["Point"]]
        assert len(group["Offsets"]) == counts["Cell"] + 1 and group["Offsets"][-1] == len(group["Connectivity"])
        found = []
        for place, count in counts.items():
            fields = {}
            for name, data in group.get(f"{place}Data", {}).items():
                at = int(steps[f"{place}DataOffsets/{name}"][step])
                fields[name] = data[at : at + count]
            found.append(fields)
        return points, found[0], found[1]


@pytest.mark.parametrize("name", ["paper_mixed", "block_with_hole", "heat_slab"])
def test_the_file_holds_the_series(name: str, tmp_path: Path) -> None:
    keys = KEYS if name == "paper_mixed" else ["time.steps=3"]
    warmslip.run(warmslip.load(name, keys), out=tmp_path / "run")
    states = export(tmp_path / "run", tmp_path / "vtu")
    assert export(tmp_path / "run", tmp_path / "hdf", form="vtkhdf") == states
    for what, first in (("body", 0), ("contact", 1)):
        files = sorted((tmp_path / "vtu").glob(f"{what}_*.vtu"))
        path = tmp_path / f"hdf/{what}.vtkhdf"
        assert path.exists() == bool(files)
        if not files:
            continue
        with h5py.File(path) as file:
            assert file["VTKHDF/Steps"].attrs["NSteps"] == len(files) == states - first
            times = file["VTKHDF/Steps/Values"][:]
            connectivity, kind = file["VTKHDF/Connectivity"][:], file["VTKHDF/Types"][0]
        assert times[-1] == warmslip.load(name, keys).time.end
        for step, one in enumerate(files):
            mesh = meshio.read(one)
            points, nodal, cells = state(path, step)
            assert np.array_equal(points, mesh.points)
            assert np.array_equal(connectivity, mesh.cells[0].data.ravel())
            assert kind == {"line": 3, "triangle": 5, "tetra": 10}[mesh.cells[0].type]
            assert nodal.keys() == mesh.point_data.keys() and cells.keys() == mesh.cell_data.keys()
            for field, values in mesh.point_data.items():
                assert np.array_equal(nodal[field], values), field
            for field, blocks in mesh.cell_data.items():
                assert np.array_equal(cells[field].ravel(), blocks[0].ravel()), field


def test_the_command(command: Command, tmp_path: Path) -> None:
    assert command("run", "paper_mixed", "--set", "mesh.n=4", "--set", "time.steps=2", "--out", "run").returncode == 0
    written = command("export", "run", "--out", "series", "--form", "vtkhdf").stdout
    assert written.startswith(
        "3 states in series/body.vtkhdf, contact points in contact.vtkhdf, time series in series.csv"
    )
    refused = command("export", "run", "--out", "series", "--form", "vtk")
    assert refused.returncode == 2 and "there is no form 'vtk'; give vtu or vtkhdf" in refused.stderr
    assert (tmp_path / "series/body.vtkhdf").exists()
    command("export", "run", "--out", "series")
    assert not (tmp_path / "series/body.vtkhdf").exists()
