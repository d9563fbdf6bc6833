"""Probes: values at points, on lines and parts; places outside; tables that a resumed run goes on with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.processes import Command
from support.stopped import KilledError, stop_after

import warmslip
from warmslip import SceneError, _core
from warmslip.figures import draw
from warmslip.figures.probe import probe as probe_figure
from warmslip.model.meshes import make_mesh
from warmslip.model.point_location import interpolated
from warmslip.model.probes import probes
from warmslip.records import tables
from warmslip.scene.reader import build
from warmslip.simulation.simulation import Simulation

SQUARE: dict[str, Any] = {
    "mesh": {"shape": "square", "n": 4},
    "time": {"steps": 6},
    "elasticity": {"young": 10.0, "poisson": 0.3, "assumption": "plane_strain"},
    "heat": {"conductivity": 1.0, "capacity": 1.0},
    "supports": {
        "displacement": {side: ["0.01 * t * x", "0.02 * t * y"] for side in ("left", "right", "top")},
        "temperature": dict.fromkeys(("left", "right", "top"), "x + 2 * y + 1"),
    },
    "initial": {"temperature": "x + 2 * y + 1"},
    "contact": {"part": "bottom", "stiffness": 100.0, "gap": "-0.01 * t", "friction": {"coefficient": 0.2}},
}
POINT = {"at": [0.4, 0.3]}
LINE = {"line": [[0.1, 0.9], [0.7, 0.1]], "count": 7}


def square(named: dict[str, Any], **keys: Any) -> Any:
    return build(SQUARE).override(**{"output.probes": named}, **{k.replace("__", "."): v for k, v in keys.items()})


def table(folder: Path, name: str) -> list[dict[str, Any]]:
    return tables.read(folder / "probes" / f"{name}.csv")


def test_points_of_slender_cells_are_found() -> None:
    """Cells 12,500 times as long as high, whose centroids are far from most of their points."""
    long = build(
        {"mesh": {"n": [4, 500], "lengths": [100.0, 1.0]}, "time": {"steps": 1}, "heat": {"conductivity": 1.0}}
    )
    mesh = warmslip.discretise(long).mesh
    nodes, cells = np.asarray(mesh.nodes), np.asarray(mesh.cells)
    points = np.random.default_rng(1).uniform([0.0, 0.0], [100.0, 1.0], (300, 2))
    for outside in (0.0, 0.2):
        found = interpolated(nodes[:, 0] + 3 * nodes[:, 1], nodes, cells, points, outside)
        np.testing.assert_allclose(found, points @ [1.0, 3.0])


def test_values_at_points_and_on_lines(tmp_path: Path) -> None:
    """A body without contact strains evenly, so that P1 is exact."""
    all_sides = {side: ["0.01 * t * x", "0.02 * t * y"] for side in ("left", "right", "top", "bottom")}
    warm = dict.fromkeys(all_sides, "x + 2 * y + 1")
    probing = {"point": POINT, "line": LINE | {"every": 4}}
    one = square(probing, contact=None, supports__displacement=all_sides, supports__temperature=warm)
    warmslip.run(one, out=tmp_path)
    rows = table(tmp_path, "point")
    assert [row["step"] for row in rows] == [0, 1, 2, 3, 4, 5, 6]
    lam, mu = 10 * 0.3 / (1.3 * 0.4), 10 / 2.6
    for row in rows:
        x, y, t = row["x"], row["y"], row["time"]
        assert (x, y) == (0.4, 0.3)
        exact = {
            "displacement_x": 0.01 * t * x,
            "displacement_y": 0.02 * t * y,
            "velocity_x": 0.01 * x * (t > 0),
            "velocity_y": 0.02 * y * (t > 0),
            "temperature": x + 2 * y + 1,
            "stress_xx": (0.03 * lam + 0.02 * mu) * t,
            "stress_xy": 0.0,
            "stress_yy": (0.03 * lam + 0.04 * mu) * t,
            "stress_zz": 0.03 * lam * t,
        }
        assert set(row) == {"step", "time", "x", "y", "von_mises", *exact}
        for name, value in exact.items():
            assert row[name] == pytest.approx(value, rel=1e-12, abs=1e-14), name
        s = np.diag([float(row[f"stress_{a}"]) for a in ("xx", "yy", "zz")])
        s -= np.trace(s) / 3 * np.eye(3)
        assert row["von_mises"] == pytest.approx(np.sqrt(1.5 * (s * s).sum()), rel=1e-12)
    rows = table(tmp_path, "line")
    assert [row["step"] for row in rows] == [0] * 7 + [4] * 7
    assert np.allclose([row["length"] for row in rows], 2 * [*np.linspace(0, 1, 7)], rtol=0, atol=1e-15)
    assert np.allclose([row["y"] for row in rows], 2 * [*np.linspace(0.9, 0.1, 7)])
    for row in rows:
        assert row["temperature"] == pytest.approx(row["x"] + 2 * row["y"] + 1, rel=1e-13)


@pytest.mark.parametrize("name", ["paper_mixed", "block_with_hole"])
def test_stress_at_nodes_and_on_edges_is_the_mean_of_the_cells_there(name: str) -> None:
    one = warmslip.load(name, ["mesh.n=4", "time.steps=1"] if name == "paper_mixed" else ["time.steps=1"])
    mesh = make_mesh(one)
    x, cells = np.asarray(mesh.nodes), np.asarray(mesh.cells)
    inner = cells[7]
    places = {"node": inner[:1], "edge": inner[:2], "cell": inner}
    at = {key: {"at": x[nodes].mean(axis=0).tolist()} for key, nodes in places.items()}
    simulation = Simulation(one.override(**{"output.probes": at}))
    for state, _ in simulation.steps():
        for probe, nodes in zip(probes(simulation.discretisation), places.values(), strict=True):
            around = np.flatnonzero(np.isin(cells, nodes).sum(axis=1) == len(nodes))
            edges = x[cells[around, 1:]] - x[cells[around, :1]]
            volume = np.abs(np.linalg.det(edges))
            found = probe.columns(state)
            for column, values in (("stress_xy", state.stress[:, 0, 1]), ("von_mises", state.mises)):
                exact = volume @ values[around] / volume.sum()
                assert found[column][0] == pytest.approx(exact, rel=1e-12, abs=1e-14), (probe.name, column)
            assert (len(around) == 1) == (probe.name == "cell")


def test_a_contact_part_has_its_points_in_order(tmp_path: Path) -> None:
    one = square(
        {"edge": {"part": "bottom"}, "side": {"part": "right", "fields": ["temperature"]}},
        supports__temperature=["top"],
    )
    one = one.override(**{"contact.quadrature": "gauss-2"})
    seen: list[Any] = []
    warmslip.run(one, out=tmp_path, observers=[lambda state, _: seen.append((state.contact, state.theta))])
    d = warmslip.discretise(one)
    (probe, _) = probes(d)
    x = np.asarray(d.surface.positions)[:, 0]
    assert np.array_equal(np.sort(x), probe.positions[:, 0]) and np.array_equal(np.sort(x), probe.length)
    assert not np.array_equal(np.sort(x), x) or len(x) == 8
    rows = table(tmp_path, "edge")
    assert len(rows) == 7 * 8
    begin, rows = rows[:8], rows[8:]
    assert all(np.isnan(row[name]) for row in begin for name in ("pressure", "friction_traction_x", "status"))
    assert all(row["time"] == row["gap"] == row["slip_x"] == 0 for row in begin)
    for i, (contact, _) in enumerate(seen):
        here = rows[8 * i : 8 * i + 8]
        order = np.argsort(x)
        assert [row["pressure"] for row in here] == contact["pressure"][order].tolist()
        assert [row["friction_traction_x"] for row in here] == contact["friction traction"][order, 0].tolist()
        assert [row["status"] for row in here] == contact["status"][order].tolist()
    assert max(row["pressure"] for row in rows) > 0.1
    rows = table(tmp_path, "side")
    nodes = np.unique(d.mesh.parts["right"])
    order = nodes[np.argsort(np.asarray(d.mesh.nodes)[nodes, 1])]
    assert [row["temperature"] for row in rows[-5:]] == pytest.approx(seen[-1][1][order].tolist(), rel=1e-14)
    assert [row["length"] for row in rows[-5:]] == [0.0, 0.25, 0.5, 0.75, 1.0]


def test_points_are_in_order_on_a_mesh_that_is_not() -> None:
    one = square({"edge": {"part": "bottom"}}, contact__gap="-0.05 * t * (1 + x)")
    mesh = make_mesh(one)
    new = np.random.default_rng(2).permutation(len(mesh.nodes))  # the new number of every node
    nodes = np.empty_like(mesh.nodes)
    nodes[new] = mesh.nodes
    order = [2, 0, 3, 1]
    parts = {name: new[np.asarray(facets)[order]] for name, facets in mesh.parts.items()}
    other = _core.Mesh2.from_lists(nodes, new[np.asarray(mesh.cells)], parts)
    found = []
    for d in (warmslip.discretise(one), warmslip.discretise(one, mesh=other)):
        state, _ = next(Simulation(one, discretisation=d).steps())
        found.append(probes(d)[0].columns(state))
    for name in ("x", "length", "pressure", "gap", "slip_x", "displacement_y", "temperature"):
        assert np.allclose(found[0][name], found[1][name], rtol=1e-9, atol=1e-14), name
    assert np.ptp(found[0]["pressure"]) > 0.01


def test_a_part_in_space(tmp_path: Path) -> None:
    one = warmslip.load("block_with_hole", ["time.steps=1"]).override(
        **{"output.probes": {"all": {"part": warmslip.load("block_with_hole").contacts[0].part}}}
    )
    seen: list[Any] = []
    warmslip.run(one, out=tmp_path, observers=[lambda state, _: seen.append(state.contact)])
    rows = table(tmp_path, "all")
    assert [row["slip_z"] for row in rows] == [0.0] * len(seen[0]["slip"]) + seen[0]["slip"][:, 2].tolist()
    assert "length" not in rows[0] and {"x", "y", "z", "stress_yz"} <= rows[0].keys()


def test_a_place_outside_is_refused_with_its_distance(command: Command, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"output.probes.far: the point \(1.3, 1.4\) lies outside .* distance of 0.5;"):
        warmslip.run(square({"far": {"at": [1.3, 1.4]}}), out=tmp_path / "run")
    assert not (tmp_path / "run/trajectory.h5").exists()
    with pytest.raises(ValueError, match=r"\(1.2, 0.5\) and 1 more lie outside the body, at a distance of 0.2"):
        warmslip.run(square({"far": {"line": [[0.0, 0.5], [1.4, 0.5]], "count": 8}}), out=tmp_path / "run")
    cube = {"mesh": {"shape": "cube", "n": 2}, "time": {}, "heat": {"conductivity": 1.0}}
    for place, distance in (([0.37, 0.21, -0.25], "0.25"), ([1.3, 1.4, 0.2], "0.5"), ([-0.2, -0.1, -0.2], "0.3")):
        far = build(cube).override(**{"output.probes": {"far": {"at": place}}})
        with pytest.raises(ValueError, match=f"at a distance of {distance};"):
            warmslip.run(far, out=tmp_path / "run")
    (tmp_path / "far.toml").write_text(
        "mesh.n = 2\ntime.steps = 1\nheat.conductivity = 1.0\noutput.probes.far.at = [0.5, 1.5]\n"
    )
    for options in (["--no-trial"], []):
        refused = command("explain", "far.toml", *options)
        assert refused.returncode == 2 and "at a distance of 0.5; correct the place" in refused.stderr


@pytest.mark.parametrize(
    ("probe", "message"),
    [
        ({"at": [0.5, 0.5, 0.5]}, "output.probes.one.at has 3 components; a square needs 2"),
        ({"line": [[0.0, 0.0], [1.0, 1.0, 1.0]]}, "output.probes.one.line.1 has 3 components"),
        ({"line": [[0.0, 0.0], [0.0, 0.0]]}, "both ends of the line are the same"),
        ({"part": "lid"}, "output.probes.one.part: unknown boundary part 'lid'; a square has"),
        ({"part": "top", "fields": ["pressure"]}, "'pressure' is known at contact points; give a part that touches"),
        ({"at": [0.5, 0.5], "part": "top"}, "at and part given; give one of at, line and part"),
        ({"fields": ["stress"]}, "no place given; give one of"),
        ({"part": "top", "count": 3}, "count is the number of points of a line"),
        ({"at": [0.5, 0.5], "fields": ["stress", "stress"]}, "a field is named twice"),
    ],
)
def test_what_is_no_probe_is_refused(probe: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=r"output\.probes\.one") as refused:
        square({"one": probe})
    assert message in str(refused.value)


def test_names_and_fields_that_are_not_there_are_refused() -> None:
    with pytest.raises(SceneError, match=r"'\.\./up' names no file"):
        square({"../up": POINT})
    cold = {key: value for key, value in SQUARE.items() if key not in ("heat", "initial")}
    cold["supports"] = {"displacement": SQUARE["supports"]["displacement"]}
    with pytest.raises(SceneError, match=r"output\.probes\.one\.fields: the scene has no temperature"):
        build(cold | {"output": {"probes": {"one": POINT | {"fields": ["temperature"]}}}})


def test_a_resumed_run_leaves_no_gap_and_no_double_row(tmp_path: Path) -> None:
    named = {"point": POINT, "line": LINE | {"every": 2}, "edge": {"part": "bottom"}, "rare": POINT | {"every": 7}}
    one = square(named, output__checkpoint=2).override(**{"time.steps": 9})
    warmslip.run(one, out=tmp_path / "whole")
    for stop in (1, 3, 5, 8):
        torn = tmp_path / f"torn{stop}"
        with pytest.raises(KilledError):
            warmslip.run(one, out=torn, progress=stop_after(stop))
        with (torn / "probes/point.csv").open("a") as file:
            file.write(f"{stop + 1},0.5,0.1")  # a row that was being written
        warmslip.run(one, out=torn, resume=True)
        for name in named:
            assert (torn / f"probes/{name}.csv").read_text() == (tmp_path / f"whole/probes/{name}.csv").read_text()


def test_a_table_that_lacks_rows_is_not_gone_on_with(tmp_path: Path) -> None:
    one = square({"point": POINT}, output__checkpoint=2)
    with pytest.raises(KilledError):
        warmslip.run(one, out=tmp_path, progress=stop_after(5))
    path = tmp_path / "probes/point.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:3]))
    with pytest.raises(ValueError, match="ends before the checkpoint, or is not of this run"):
        warmslip.run(one, out=tmp_path, resume=True)


def test_a_run_that_goes_on_may_change_its_probes(tmp_path: Path) -> None:
    """To a later end with another cadence and one more probe, and on from there once more."""
    one = square({"point": POINT | {"every": 5}}, time__steps=12, time__end=1.2)
    warmslip.run(one, out=tmp_path)
    for steps, end in ((20, 2.0), (23, 2.3)):
        probes = {"point": POINT | {"every": 2}, "new": POINT}
        longer = one.override(**{"time.steps": steps, "time.end": end, "output.probes": probes})
        assert warmslip.run(longer, out=tmp_path, resume=True).completed
    assert [int(row["step"]) for row in table(tmp_path, "point")] == [0, 5, 10, 14, 16, 18, 20, 22]
    assert [int(row["step"]) for row in table(tmp_path, "new")] == list(range(13, 24))


def test_what_cannot_go_on_keeps_its_summary(tmp_path: Path) -> None:
    one = square({"point": POINT}, time__steps=4, time__end=0.4)
    warmslip.run(one, out=tmp_path)
    path = tmp_path / "probes/point.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:3]))
    with pytest.raises(ValueError, match="ends before the checkpoint"):
        warmslip.run(one.override(**{"time.steps": 8, "time.end": 0.8}), out=tmp_path, resume=True)
    assert (tmp_path / "summary.json").exists()
    assert (tmp_path / "final.vtu").exists()


def test_a_new_run_has_no_table_of_an_earlier_one(tmp_path: Path) -> None:
    warmslip.run(square({"point": POINT, "other": POINT}), out=tmp_path)
    warmslip.run(square({"point": POINT}, time__steps=2), out=tmp_path)
    assert [path.name for path in (tmp_path / "probes").iterdir()] == ["point.csv"]
    assert len(table(tmp_path, "point")) == 3


def test_drawings(tmp_path: Path) -> None:
    one = square({"point": POINT, "line": LINE | {"fields": ["displacement"]}, "edge": {"part": "bottom"}})
    warmslip.run(one, out=tmp_path)
    files = [tmp_path / f"probes/{name}.csv" for name in ("point", "line")]
    draw("probe", files, tmp_path / "probe.png")
    caption = (tmp_path / "probe.rst").read_text()
    values = [row["temperature"] for row in table(tmp_path, "point")]
    assert f"temperature {min(values):.3g} to {max(values):.3g}" in caption
    assert "line, 7 times: displacement_x" in caption
    draw("probe", [tmp_path / "probes/edge.csv"], tmp_path / "edge.png")
    figure, _ = probe_figure([tmp_path / "probes/edge.csv"])
    assert max(figure.get_size_inches()) < 20 and len({ax.get_position().y0 for ax in figure.axes}) > 1  # several rows
    panels = {ax.get_title(): ax for ax in figure.axes if ax.get_legend()}
    first = {name: ax.get_legend().get_texts()[0].get_text() for name, ax in panels.items()}
    assert first["edge: gap"] == "t = 0" and first["edge: pressure"] == "t = 0.167"
    pressure = [row["pressure"] for row in table(tmp_path, "edge") if row["step"]]
    assert f"pressure {min(pressure):.3g} to {max(pressure):.3g}" in (tmp_path / "edge.rst").read_text()
    with pytest.raises(ValueError, match="'probe' is drawn from"):
        draw("probe", [tmp_path / "probe.rst"], tmp_path / "none.png")


@pytest.mark.mpi
def test_two_ranks_write_the_tables_of_one(command: Command, tmp_path: Path) -> None:
    keys = [
        "mesh.n=6",
        "time.steps=3",
        "contact.heat_exchange.foundation_temperature=10",
        "output.probes={inner={at=[0.4,0.3]}, line={line=[[0.1,0.9],[0.7,0.1]],count=5}, edge={part='bottom'}}",
    ]
    options = [word for key in keys for word in ("--set", key)]
    for ranks in (1, 2):
        assert command("run", "paper_mixed", *options, "--out", f"run{ranks}", ranks=ranks).returncode == 0
    for name, rows in (("inner", 4), ("line", 20), ("edge", 28)):
        one, two = (table(tmp_path / f"run{ranks}", name) for ranks in (1, 2))
        assert len(one) == len(two) == rows and one[0].keys() == two[0].keys()
        for column in one[0]:
            a, b = (np.nan_to_num([row[column] for row in found]) for found in (one, two))
            assert [np.isnan(row[column]) for row in one] == [np.isnan(row[column]) for row in two]
            assert np.abs(a - b).max() <= 1e-11 * max(np.abs(a).max(), 1e-3), column
    with (
        warmslip.Trajectory(tmp_path / "run1/trajectory.h5") as first,
        warmslip.Trajectory(tmp_path / "run2/trajectory.h5") as second,
    ):
        for what in ("force", "moment"):
            a, b = (t.reactions["top"][what] for t in (first, second))
            assert np.abs(a - b).max() <= 1e-11 * np.abs(a).max()
        for name, a in first.heat_flows.items():
            assert np.abs(a - second.heat_flows[name]).max() <= 1e-11 * max(np.abs(a).max(), 1e-3), name
    refused = command("run", "paper_mixed", "--set", "output.probes.far.at=[0.5,1.5]", ranks=2)
    assert refused.returncode != 0 and "at a distance of 0.5; correct the place" in refused.stderr


def test_the_first_row_is_the_state_that_the_run_begins_with(tmp_path: Path) -> None:
    """Of a scene, and of another run: as the first state of the trajectory."""
    warm = {
        "initial": {"temperature": "x + 2 * y + 1", "displacement": ["0.01 * x", "0"], "velocity": ["0.1", "0.2 * y"]}
    }
    sides = {
        side: [f"0.01 * x + {speed} * t", "0.2 * y * t"]
        for side, speed in (("left", 0.1), ("right", 0.1), ("top", 0.1))
    }
    named = {"point": POINT, "rare": POINT | {"every": 4}}
    one = build(SQUARE | warm | {"inertia": {"density": 1.0}, "output": {"probes": named}})
    one = one.override(**{"supports.displacement": sides})
    warmslip.run(one, out=tmp_path / "first")
    more = one.override(**{"initial": {"from": str(tmp_path / "first/trajectory.h5")}, "supports.displacement": None})
    warmslip.run(more, out=tmp_path / "more")
    for folder in ("first", "more"):
        with warmslip.Trajectory(tmp_path / folder / "trajectory.h5") as t:
            state = t.state(time=0.0)
            (probe, _) = probes(state.discretisation)
            begin = {"u": t.u[0], "w": t.w[0], "theta": t.theta[0]}
        row = table(tmp_path / folder, "point")[0]
        assert (row["step"], row["time"]) == (0, 0)
        for name, key in (("displacement_x", "u"), ("velocity_y", "w"), ("temperature", "theta")):
            values = np.asarray(begin[key])[probe.nodes]
            values = values if key == "theta" else values[..., 0 if key == "u" else 1]
            assert row[name] == pytest.approx(float((probe.weights * values).sum()), rel=1e-13), (folder, name)
            assert abs(row[name]) > 1e-4
        assert row["stress_xx"] == pytest.approx((probe.average @ state.stress.reshape(-1, 4))[0, 0], rel=1e-12)
        assert [row["step"] for row in table(tmp_path / folder, "rare")] == [0, 4]
