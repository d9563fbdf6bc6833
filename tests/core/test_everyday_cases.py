"""Small cases that users of contact codes report, each with a value that is known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import _core
from warmslip.scene.reader import build

STEEL = {"young": 1000.0, "poisson": 0.3, "assumption": "plane_strain"}


def body(**tables: Any) -> Any:
    return build({"mesh": {"n": 8}, "time": {"steps": 10}, "elasticity": STEEL} | tables)


def test_a_preload_holds_when_the_next_run_begins_with_it(tmp_path: Path) -> None:
    """Sticking friction is in the state: under the same loads nothing moves."""
    contact = {"part": "bottom", "stiffness": 1e5, "friction": {"coefficient": 0.3}}
    loaded = warmslip.run(
        body(supports={"displacement": {"top": ["0.02 * t", "-0.01"]}}, contact=contact), out=tmp_path / "load"
    )
    begin = {"from": str(loaded.trajectory)}
    held = warmslip.run(body(supports={"displacement": {"top": [0.02, -0.01]}}, contact=contact, initial=begin))
    assert held.completed
    assert np.abs(held.u - loaded.u).max() <= 1e-14


def test_the_work_of_a_cycle_is_what_friction_takes() -> None:
    shear = {"top": ["0.01 * sin(2 * pi * t)", "-0.005 * min(1, 10 * t)"]}
    simulation = warmslip.Simulation(
        body(
            time={"end": 2.0, "steps": 80},
            supports={"displacement": shear},
            contact={"part": "bottom", "stiffness": "rigid", "friction": {"coefficient": 0.2}},
        )
    )
    work = lost = stored = 0.0
    for _, report in simulation.steps():
        b = report.balances
        work, stored = work + b.support_work, b.elastic
        lost += b.friction + b.elastic_damping + b.contact_damping
    assert lost > 3 * stored
    assert work == pytest.approx(lost + stored, rel=1e-12)


def test_a_body_between_smooth_walls_is_pressed_evenly_when_it_warms_up() -> None:
    sides = {side: {"normal": 0.0} for side in ("left", "right", "bottom", "top")}
    heat = {"conductivity": 1.0, "capacity": 1.0, "source": 1.0}
    expansion = {"alpha": 1e-3, "reference_temperature": 0.0}
    simulation = warmslip.Simulation(body(heat=heat | {"expansion": expansion}, supports={"displacement": sides}))
    for state, _ in simulation.steps():  # staggered: of the temperature of the step before, 0.9
        stress = state.stress
    lam, mu = 1000 * 0.3 / (1.3 * 0.4), 1000 / 2.6
    assert np.abs(np.asarray(state.theta) - 1.0).max() <= 1e-12
    expected = -(3 * lam + 2 * mu) * 1e-3
    assert np.abs(stress - expected * np.eye(2)).max() <= 1e-12 * abs(expected)


def test_a_viscous_body_sinks_on_its_dashpots() -> None:
    scene = build(
        {
            "mesh": {"n": 4},
            "time": {"steps": 10},
            "viscosity": {"lame": [1.0, 1.0]},
            "supports": {"displacement": {"left": [0.0, "free"]}, "springs": {"bottom": {"normal_damping": 2.0}}},
            "loads": {"traction": {"top": [0.0, -1.0]}},
        }
    )
    result = warmslip.run(scene)
    assert result.completed
    assert result.u[0, 1] == pytest.approx(-0.5, abs=1e-12)


@pytest.mark.parametrize("stiffness", ["rigid", 1e4])
def test_a_cylinder_that_comes_down_presses_with_the_reaction_of_the_support(stiffness: Any) -> None:
    gap = {"shape": "cylinder", "at": [1.0, "2.02 - 0.04 * t"], "radius": 1.0}
    scene = body(
        mesh={"n": [16, 8], "lengths": [2.0, 1.0], "diagonal": "crisscross"},
        supports={"displacement": ["bottom"]},
        contact={"part": "top", "stiffness": stiffness, "gap": gap},
    )
    result = warmslip.run(scene)
    depth = -result.u[:, 1].min()
    assert depth == pytest.approx(0.02, abs=1e-12) if stiffness == "rigid" else 0.01 < depth < 0.02
    (reaction,) = result.summary["reactions"].values()
    force = result.summary["contact"]["normal_force"]
    assert reaction["force"] == pytest.approx([0.0, force], abs=1e-11 * force)
    assert reaction["moment"] == pytest.approx([force], rel=1e-3)  # about the origin, and the mesh is symmetric


@pytest.mark.parametrize(("degrees", "missing"), [(15.0, 0.026), (30.0, 0.0855)])
def test_a_ring_on_a_flat_road(degrees: float, missing: float) -> None:
    """A stiff ring sinks into a soft road. Along its own normals it bears less than along that of the road."""
    radii, angles = np.linspace(0.5, 1.0, 3), np.radians(np.linspace(-45.0, 45.0, 721))
    nodes = np.array([[r * np.sin(a), -r * np.cos(a)] for r in radii for a in angles])
    many = len(angles)
    cells = []
    for first in (0, many):
        for i in range(first, first + many - 1):
            cells += [[i, i + many, i + 1], [i + 1, i + many, i + many + 1]]
    arcs = {"top": 0, "bottom": 2 * many}
    parts = {name: [[k, k + 1] for k in range(first, first + many - 1)] for name, first in arcs.items()}
    mesh = _core.Mesh2.from_lists(nodes, cells, parts)
    wide = np.radians(degrees)
    depth = 1 - np.cos(wide)
    scene = body(
        time={"steps": 1},
        elasticity=STEEL | {"young": 1e8},
        supports={"displacement": {"top": [0.0, f"-{depth} * t"]}},
        contact={
            "part": "bottom",
            "stiffness": 1.0,
            "gap": {"shape": "plane", "at": [0.0, -1.0], "normal": [0.0, 1.0]},
        },
    )
    simulation = warmslip.Simulation(scene, discretisation=warmslip.discretise(scene, mesh=mesh))
    ((_, report),) = list(simulation.steps())
    edge = np.arccos((np.sqrt(1 + 4 * depth) - 1) / (2 * depth))  # where depth cos(a) = 1 / cos(a) - 1
    along_ring = 2 * (depth * (edge / 2 + np.sin(2 * edge) / 4) - edge + np.sin(edge))
    along_road = wide - np.sin(wide) * np.cos(wide)
    assert report.traction[1] == pytest.approx(along_ring, rel=1e-3)
    assert 1 - along_ring / along_road == pytest.approx(missing, abs=5e-4)
    assert 1 - along_ring / along_road == pytest.approx(0.4 * wide**2, rel=0.25)
