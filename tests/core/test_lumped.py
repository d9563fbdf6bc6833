"""Lumped capacity and exchange: diagonal, with the row sums of the consistent ones, and no temperature beyond its data."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.processes import Command

import warmslip
from warmslip import Loads, Scene, Trajectory
from warmslip.model.discretisation import discretise
from warmslip.scene.reader import build

HOT = 100.0
ROUND = 1e-12 * HOT
FLAT = {  # bodies without obtuse angles: right triangles, and Kuhn's tetrahedra
    "square": {"shape": "square", "n": 8},
    "other diagonal": {"shape": "square", "n": [4, 6], "diagonal": "left", "lengths": [2.0, 1.0]},
    "crisscross": {"shape": "square", "n": 6, "diagonal": "crisscross"},
    "graded": {"shape": "square", "n": 8, "grading": [1.0, 20.0]},
    "cube": {"shape": "cube", "n": 4},
}


def body(mesh: str = "square", matrix: str = "lumped", step: float = 1e-5, **tables: Any) -> Scene:
    """A body at 0 on a foundation at 100, a few steps of `step`."""
    data: dict[str, Any] = {
        "mesh": FLAT[mesh],
        "time": {"end": 8 * step, "steps": 8},
        "heat": {"conductivity": 1.0, "capacity": 2.0, "capacity_matrix": matrix},
        "contact": {"part": "bottom", "heat_exchange": {"conductance": 1e6, "foundation_temperature": HOT}},
    }
    heat = tables.pop("heat", {})
    return build(data | tables | {"heat": data["heat"] | heat})


def extremes(scene: Scene, **given: Any) -> tuple[float, float]:
    states: list[Any] = []
    done = warmslip.run(scene, observers=[lambda state, _: states.append(state.theta)], **given)
    assert done.completed, done.summary["failure"]
    return float(np.min(states)), float(np.max(states))


@pytest.mark.parametrize("step", [1e-9, 1e-5, 1e-2, 10.0])
@pytest.mark.parametrize("mesh", FLAT)
def test_no_temperature_beyond_its_data(mesh: str, step: float) -> None:
    least, most = extremes(body(mesh, step=step))
    assert least >= -ROUND and most <= HOT + ROUND
    assert most > 1


@pytest.mark.parametrize("mesh", FLAT)
def test_the_consistent_matrix_undershoots(mesh: str) -> None:
    """So the test above is one of the lumping."""
    least, _ = extremes(body(mesh, "consistent"))
    assert least < -0.1 * HOT
    if mesh == "square":
        assert extremes(body(mesh, "consistent", step=1e-7))[0] < -0.3 * HOT


def test_nor_with_materials_supports_and_fluxes() -> None:
    """Conductivities and capacities that jump, cold and hot supports that move, an initial jump, heat that enters nowhere."""
    poor = {"where": "x + y > 1.1", "heat": {"conductivity": 1e-3, "capacity": 50.0}}
    least, most = extremes(
        body(
            step=1e-4,
            regions={"poor": poor},
            supports={"temperature": {"top": "100 * (t > 3e-4)", "left": "100 * x"}},
            initial={"temperature": "where(x > 0.5, 100, 0)"},
        )
    )
    assert least >= -ROUND and most <= HOT + ROUND


@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
def test_in_every_coupling(coupling: str) -> None:
    """Bodies that move: expansion alone leaves the heat its maximum principle, and with heating all balances close."""
    moving = {
        "elasticity": {"young": 100.0, "poisson": 0.3, "assumption": "plane_strain"},
        "inertia": {"density": 1.0},
        "supports": {"displacement": ["top"]},
    }
    scene = body(**moving, time={"end": 1e-4, "steps": 8, "coupling": coupling}, heat={"expansion": {"tensor": 0.1}})
    least, most = extremes(scene)
    assert least >= -ROUND and most <= HOT + ROUND
    heated = scene.override(**{"heat.heating.tensor": [[0.3, 0.1], [0.1, -0.2]]})
    done = warmslip.run(heated)
    assert done.completed and max(done.summary["balances"][i] for i in ("energy", "heat", "force")) <= 1e-11


def test_where_pressure_leads_the_heat() -> None:
    pressed = {
        "part": "bottom",
        "stiffness": 1e3,
        "heat_exchange": {"conductance": 1e3, "per_pressure": 1e6, "foundation_temperature": HOT},
    }
    scene = body(contact=pressed, elasticity={"lame": [10.0, 10.0]}, supports={"displacement": {"top": [0.0, -0.01]}})
    least, most = extremes(scene)
    assert least >= -ROUND and most <= HOT + ROUND


@pytest.mark.parametrize("mesh", FLAT)
def test_matrices_are_the_row_sums(mesh: str) -> None:
    other = {"where": "x > 0.5", "heat": {"conductivity": 1.0, "capacity": 5.0}}
    for name in ("mass", "exchange"):
        dense = []
        for kind in ("consistent", "lumped"):
            d = discretise(body(mesh, kind, regions={"other": other}))
            rows, columns, values = getattr(d.operators, name).getValuesCSR()
            assert len(columns) == rows[-1]
            full = np.zeros((len(d.mesh.nodes),) * 2)
            for row in range(len(full)):
                full[row, columns[rows[row] : rows[row + 1]]] = values[rows[row] : rows[row + 1]]
            dense.append(full)
        consistent, lumped = dense
        assert np.abs(lumped - np.diag(consistent.sum(axis=1))).max() <= 1e-14 * np.abs(consistent).max()
        assert np.count_nonzero(consistent - np.diag(np.diag(consistent)))


def test_a_body_as_warm_as_its_foundation_stays_so() -> None:
    """Steady to round-off, whatever theta_F along the part: nothing is conducted, and the exchange must vanish node by node."""
    warm = "20 + sin(7 * x)"
    contact = {"part": "bottom", "heat_exchange": {"conductance": 3.0, "foundation_temperature": warm}}
    drift = {}
    for matrix in ("lumped", "consistent"):
        scene = body(
            matrix=matrix, contact=contact, heat={"conductivity": 0.0}, initial={"temperature": warm}, step=0.1
        )
        theta = warmslip.run(scene).theta
        x = np.asarray(discretise(scene).mesh.nodes)[:, 0]
        drift[matrix] = float(np.abs(theta - 20 - np.sin(7 * x)).max())
        moved = {"foundation_temperature": lambda x, t: 20 + np.sin(7 * x[:, 0])}
        by_hand = warmslip.run(scene, loads=Loads(**moved)).theta
        assert np.abs(by_hand - theta).max() <= 1e-12 * 20
    assert drift["lumped"] <= 1e-13 * 20
    assert drift["consistent"] > 1e-4


def test_the_two_differ_by_the_square_of_the_mesh() -> None:
    """On smooth data both converge to one answer."""
    smooth = {"temperature": "cos(pi * x) * cos(pi * y)"}
    gaps = []
    for n in (8, 16, 32):
        ends = [
            warmslip.run(
                body(matrix=matrix, mesh="square", step=0.01, contact=None, initial=smooth).override(**{"mesh.n": n})
            )
            for matrix in ("lumped", "consistent")
        ]
        gaps.append(float(np.abs(ends[0].theta - ends[1].theta).max()))
    orders = np.log2(np.divide(gaps[:-1], gaps[1:]))
    assert gaps[0] > 1e-4 and np.all(np.abs(orders - 2) < 0.3), (gaps, orders)


@pytest.mark.mpi
def test_two_ranks(command: Command, tmp_path: Path) -> None:
    """Lumped exchange with a formula at the vertices, and a reference temperature: their loads are summed over the ranks."""
    ends, keys = (
        [],
        (
            "heat.capacity_matrix=lumped",
            "heat.expansion.reference_temperature=3.0",
            "contact.heat_exchange.foundation_temperature=10 * x",
            "mesh.n=8",
            "time.steps=4",
        ),
    )
    for ranks in (1, 2):
        options = [word for key in keys for word in ("--set", key)]
        message = command("run", "paper_mixed", *options, "--out", f"run{ranks}", ranks=ranks)
        assert message.returncode == 0, message.stderr
        assert json.loads((tmp_path / f"run{ranks}/summary.json").read_text())["stamp"]["ranks"] == ranks
        with Trajectory(tmp_path / f"run{ranks}/trajectory.h5") as t:
            ends.append([t.u[-1], t.theta[-1]])
    for a, b in zip(*ends, strict=True):
        assert abs(a - b).max() <= 1e-10 * abs(a).max()
