"""Sweeps: runs that share operators and factors are those of separate runs, bit by bit; tables go on where they stopped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from support.processes import Command

import warmslip
from warmslip import SceneError
from warmslip.cli.sweep import values_of
from warmslip.records import tables
from warmslip.scene.scene import Scene
from warmslip.scene.structure import structure
from warmslip.studies.sweep import Runner, sweep

THETA, MU, GAP = "contact.heat_exchange.foundation_temperature", "contact.friction.coefficient", "contact.gap"
CASES: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "temperature": ("paper_mixed", {}, {THETA: 7.0}),
    "friction, formula": ("paper_mixed", {}, {MU: 0.7, GAP: "0.001 * x"}),
    "stiffness to rigid": ("paper_mixed", {}, {"contact.stiffness": "rigid"}),
    "steps": ("paper_mixed", {}, {"time.steps": 5, "time.graded_to": [0.0], "time.halvings": 2}),
    "a load, monolithic": ("paper_isotropic", {"time.coupling": "monolithic"}, {"loads.body": [0.1, "-t"]}),
    "initial data": ("paper_mixed", {}, {"initial.velocity": [0.1, 0.0], "initial.temperature": "x"}),
    "a moving support": ("quasistatic_punch", {}, {"supports.displacement.top": ["0.01 * t", "-0.02 * t"]}),
    "space": ("block_3d", {"mesh.n": 3}, {THETA: -2.0, MU: 0.0}),
    "free flight": ("elastic_drop", {}, {"initial.velocity": [0.0, -2.0]}),
}


def small(name: str, keys: dict[str, Any]) -> Scene:
    return warmslip.load(name).override(**({"mesh.n": 6, "time.steps": 6} | keys))


@pytest.mark.parametrize("case", CASES)
def test_shared_factors_give_the_same_bits(case: str) -> None:
    name, keys, change = CASES[case]
    one = small(name, keys)
    other = one.override(**change)
    assert structure(one) == structure(other)
    runner = Runner()
    for _ in runner.simulation(one).steps():
        pass
    shared, alone = runner.simulation(other), warmslip.Simulation(other)
    factorizations = shared.stepper.cost.factorizations
    for (a, first), (b, second) in zip(shared.steps(), alone.steps(), strict=True):
        assert first.newton_iterations == second.newton_iterations
        for field in ("u", "w", "theta"):
            assert np.array_equal(getattr(a, field), getattr(b, field)), field
    assert shared.outcome == alone.outcome
    assert shared.warnings() == alone.warnings()
    if "time.steps" not in change:
        assert factorizations == 0


@pytest.mark.parametrize(
    "change",
    [
        {"mesh.n": 7},
        {"viscosity.lame": [1.0, 1.0]},
        {"contact.heat_exchange.conductance": 2.0},
        {"contact.heat_exchange.per_pressure": 1.0},
        {"contact.friction_heating": {"share": 0.5}},
        {"contact.quadrature": "gauss-2"},
        {"supports.displacement": ["top", "left"], "loads.traction": {}},
        {"time.coupling": "lagged"},
        {"inertia.density": 2.0},
    ],
    ids=str,
)
def test_other_operators_are_assembled(change: dict[str, Any]) -> None:
    one = small("paper_mixed", {})
    other = one.override(**change)
    assert structure(one) != structure(other)
    runner = Runner()
    first = runner.simulation(one)
    with pytest.raises(ValueError, match="differ in data alone"):
        first.discretisation.with_data(other, first.stepper, MPI.COMM_WORLD)
    found = runner.simulation(other)
    for _ in found.steps():
        pass
    expected = warmslip.run(other)
    assert found.discretisation.norms.v(found.stepper.u) == expected.summary["norms"]["u_V"]


def test_a_table_of_all_combinations_goes_on_where_it_stopped(tmp_path: Path) -> None:
    scene, vary = small("paper_mixed", {}), {MU: [0.0, 0.5], THETA: [0.0, 5.0, 10.0]}
    first = sweep(scene, {MU: [0.0], THETA: [5.0, 10.0]}, out=tmp_path)
    assert [row["run"] for row in first] == [1, 2]
    ran: list[int] = []
    rows = sweep(scene, vary, out=tmp_path, progress=lambda done, runs, row: ran.append(row["run"]))
    assert ran == [1, 4, 5, 6]  # the others are there
    assert [(row[MU], row[THETA]) for row in rows] == [(mu, theta) for mu in vary[MU] for theta in vary[THETA]]
    stored = tables.read(tmp_path / "sweep.csv")
    assert stored == rows
    for row in rows:
        expected = warmslip.run(scene.override(**{MU: row[MU], THETA: row[THETA]})).summary
        assert row["norm_u_V"] == expected["norms"]["u_V"]
        assert row["normal_force"] == expected["contact"]["normal_force"]
        assert row["warnings"] == len(expected["warnings"])
        assert row["digits"] == min(expected["digits"].values())
        assert row["outcome"] == "completed"
    narrower = sweep(scene, {MU: [0.5], THETA: [10.0]}, out=tmp_path)  # what is there stays
    assert len(narrower) == 1
    assert {(row[MU], row[THETA]) for row in tables.read(tmp_path / "sweep.csv")} == {(r[MU], r[THETA]) for r in rows}
    for other, keys, message in (
        (scene.override(**{"mesh.n": 5}), vary, "sweep of another scene"),
        (scene, {MU: [0.0]}, "sweep over other keys"),
    ):
        with pytest.raises(SceneError, match=message):
            sweep(other, keys, out=tmp_path)


def test_parts_and_processes_give_the_same_table(tmp_path: Path) -> None:
    scene, vary = small("paper_mixed", {}), {MU: [0.0, 0.2, 0.4, 0.6, 0.8]}
    plain = sweep(scene, vary)
    several = sweep(scene, vary, jobs=2)
    for i in (1, 2, 3):
        sweep(scene, vary, out=tmp_path, part=(i, 3))
    joined = sweep(scene, vary, out=tmp_path, progress=lambda *_: pytest.fail("a run was repeated"))
    for rows in (several, joined):
        assert [row | {"cpu_seconds": 0} for row in rows] == [row | {"cpu_seconds": 0} for row in plain]


def test_a_run_that_stops_is_a_line(command: Command, tmp_path: Path) -> None:
    result = command(
        "sweep",
        "paper_mixed",
        "--set",
        "mesh.n=4",
        "--set",
        "time.steps=4",
        "--vary",
        "loads.body=[[0, 0], [0, '1/(t-0.5)']]",
    )
    assert result.returncode == 1
    assert "1 completed, 1 data_not_finite" in result.stdout
    assert [row["outcome"] for row in tables.read(tmp_path / "sweep/sweep.csv")] == ["completed", "data_not_finite"]
    assert "1 of 2 runs stopped early" in (tmp_path / "sweep/sweep.rst").read_text()


@pytest.mark.mpi
def test_two_ranks_fill_the_table(command: Command, tmp_path: Path) -> None:
    options = ["--set", "mesh.n=6", "--set", "time.steps=4", "--vary", f"{THETA}=0:10:3"]
    for ranks in (1, 2):
        result = command("sweep", "paper_mixed", *options, "--out", str(ranks), ranks=ranks)
        assert result.returncode == 0, result.stderr
    one, two = (tables.read(tmp_path / f"{ranks}/sweep.csv") for ranks in (1, 2))
    for a, b in zip(one, two, strict=True):
        assert b["norm_theta_L2"] == pytest.approx(a["norm_theta_L2"], rel=1e-10)
        assert b["normal_force"] == pytest.approx(a["normal_force"], rel=1e-9)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("contact.gap=0,0.1", [0, 0.1]),
        ("contact.gap=0:1:3", [0.0, 0.5, 1.0]),
        ("contact.stiffness=10,rigid", [10, "rigid"]),
        ("loads.body=[[0, 1], [1, 0]]", [[0, 1], [1, 0]]),
        ("loads.body=[0, 1],[1, 0]", [[0, 1], [1, 0]]),
        ("contact.gap=min(1, t),5", ["min(1, t)", 5]),
        ("mesh.n=4:16:4", [4, 8, 12, 16]),
        ("contact.gap=0.1 * x", ["0.1 * x"]),
    ],
)
def test_values_on_the_command_line(text: str, values: list[Any]) -> None:
    assert values_of(text) == (text.partition("=")[0], values)


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ({}, "needs a key and its values"),
        ({MU: []}, "needs a key and its values"),
        ({MU: 0.1}, "give lists of values"),
        ([1], "give lists of values"),
        ({MU: [0.1, -1.0]}, "with contact.friction.coefficient = -1.0"),
        ({"contact.frction.coefficient": [0.1]}, "did you mean 'friction'"),
        ({MU: range(2000), GAP: range(2000)}, "1000000 are the most"),
    ],
)
def test_refusals(vary: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        sweep(small("paper_mixed", {}), vary)
    for text in ("contact.gap", "contact.gap=", "contact.gap=0:1:x", "contact.gap=0:inf:3", "contact.gap=0:1"):
        with pytest.raises(SceneError, match="--vary"):
            values_of(text)
    with pytest.raises(SceneError, match="part 3/2"):
        sweep(small("paper_mixed", {}), {MU: [0.1]}, part=(3, 2))
