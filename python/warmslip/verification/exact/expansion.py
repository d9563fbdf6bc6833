"""A heated column that grows from its clamp across a gap into the foundation, for c_nu from 1 to 1e16.

lambda = 0, M = diag(0, m), no inertia: sigma_yy = E e - m theta = -p and p = c_nu (e H - g) give

    p = c_nu (m theta H - E g)/(E + c_nu H)     once m theta H > E g.

One staggered step, whose momentum balance feels the temperature it starts from, while a source heats the column on.
"""

from __future__ import annotations

import numpy as np

from warmslip.model.loads import Loads
from warmslip.records.check import Check, below, near
from warmslip.simulation.simulation import Simulation
from warmslip.verification.exact import fixtures

E, M, THETA, HEIGHT, WIDTH, GAP = 2.0, 0.5, 3.0, 1.5, 1.0, 0.4
STIFFNESSES = [10.0**i for i in range(17)]
PULL = 0.2


def pressure(stiffness: float) -> float:
    """p of the column (stress)."""
    return stiffness * (M * THETA * HEIGHT - E * GAP) / (E + stiffness * HEIGHT)


def _column(stiffness: float, gap: float, pull: float) -> Simulation:
    """The column at THETA before its step; `pull` is a traction at its foot, away from the clamp."""
    scene = fixtures.blank(
        time__steps=1,
        elasticity__lame=[0.0, E / 2],
        heat__expansion__tensor=[[0.0, 0.0], [0.0, M]],
        supports__displacement=["top"],
        contact__stiffness=stiffness,
    )
    loads = Loads(source=1.0, gap=gap, contact_traction=np.array([0.0, -pull]))
    simulation = fixtures.run(scene, loads, fixtures.distorted((4, 5), (WIDTH, HEIGHT)))
    fixtures.start(simulation, theta=THETA)
    return simulation


def _pressed(stiffness: float) -> list[Check]:
    simulation = _column(stiffness, GAP, 0.0)
    name, exact, p = f"heated column, c_nu = {stiffness:.0e}", pressure(stiffness) * WIDTH, pressure(stiffness)
    forces = [report.normal_force for report in fixtures.steps(simulation)]
    moved = -np.asarray(simulation.stepper.contact_displacement).reshape(-1, 2)[:, 1]
    return [
        near(name, "the force is exact", "analytic", exact, forces[0], fixtures.ROUND_OFF),
        below(
            name,
            "u_nu is g + p/c_nu",
            "analytic",
            fixtures.worst(moved, GAP + p / stiffness, HEIGHT),
            fixtures.ROUND_OFF,
        ),
    ]


def heated_column() -> list[Check]:
    """The force of a uniform temperature against the foundation, soft and stiff: the pressure is an unknown."""
    lines = [line for stiffness in STIFFNESSES for line in _pressed(stiffness)]
    strain = (M * THETA + PULL) / E
    simulation = _column(1e4, strain * HEIGHT + 0.1, PULL)
    free = [report.normal_force for report in fixtures.steps(simulation)]
    growth = fixtures.worst(fixtures.fields(simulation)[0][:, 1], strain * (fixtures.nodes(simulation)[:, 1] - HEIGHT))
    name = "heated column, wide gap"
    return [
        *lines,
        below(name, "it does not touch", "analytic", free[0], 0.0),
        below(name, "it grows by (m theta + traction)/E", "analytic", growth, fixtures.ROUND_OFF),
    ]
