"""A heated column that grows from its clamp across a gap into the foundation, for c_nu from 1 to 1e16.

lambda = 0, M = diag(0, m), no inertia: sigma_yy = E e - m theta = -p and p = c_nu (e H - g) give

    p = c_nu (m theta H - E g)/(E + c_nu H)     once m theta H > E g.

One staggered step, whose momentum balance feels the temperature it starts from, while a source heats the column on.
"""

from __future__ import annotations

import sys

import numpy as np

from warmslip.loads import Loads
from warmslip.runner import Run
from warmslip.verify.closed import bench
from warmslip.verify.line import Line, below, near

E, M, THETA, HEIGHT, WIDTH, GAP = 2.0, 0.5, 3.0, 1.5, 1.0, 0.4
STIFFNESSES = [10.0**i for i in range(17)]
PULL = 0.2
DECLARED = 1e-6  # relative accuracy of a pressure below which a run must say `precision_lost` (ARCHITECTURE.md)


def pressure(stiffness: float) -> float:
    """p of the column (stress)."""
    return stiffness * (M * THETA * HEIGHT - E * GAP) / (E + stiffness * HEIGHT)


def floor(stiffness: float) -> float:
    """Digits of p that rounding leaves open, dimensionless: 4 eps c_nu (|g| + |u_nu| + |free growth|)/p.

    u_nu is what the contact force leaves of the growth without contact, and the gap is taken from it.
    """
    p = pressure(stiffness)
    return 4 * sys.float_info.epsilon * stiffness * (2 * GAP + p / stiffness + M * THETA * HEIGHT / E) / p


def _column(stiffness: float, gap: float, pull: float) -> Run:
    """The column at THETA before its step; `pull` is a traction at its foot, away from the clamp."""
    scene = bench.blank(
        time__steps=1,
        elasticity__lame=[0.0, E / 2],
        heat__expansion__tensor=[[0.0, 0.0], [0.0, M]],
        supports__displacement=["top"],
        contact__stiffness=stiffness,
    )
    loads = Loads(source=1.0, gap=gap, contact_traction=np.array([0.0, -pull]))
    job = bench.run(scene, loads, bench.distorted((4, 5), (WIDTH, HEIGHT)))
    bench.start(job, theta=THETA)
    return job


def _pressed(stiffness: float) -> list[Line]:
    job = _column(stiffness, GAP, 0.0)
    reports = [report for _, report in job.steps()]
    name, exact, stated, lines = f"heated column, c_nu = {stiffness:.0e}", pressure(stiffness), floor(stiffness), []
    if job.outcome not in ("right", "precision_lost"):
        raise RuntimeError(f"{name} ended: {job.outcome}, {job.failure}")
    for report in reports:
        moved = -np.asarray(job.stepper.contact_displacement).reshape(-1, 2)[:, 1]
        miss = bench.worst(stiffness * (moved - GAP), exact, exact)
        lines = [
            near(name, "the force is exact", "analytic", exact * WIDTH, report.normal_force, bench.ROUND_OFF),
            # once for the residual that the solver may leave, once for the rounding of the u that is read here
            below(
                name, "c_nu (u_nu - g) is p but for the floor, twice", "analytic", miss, bench.ROUND_OFF + 2 * stated
            ),
            near(name, "the floor it states is that one", "own rule", stated, report.ledger.law_floor, 1e-3),
        ]
    must, lost = float(stated > DECLARED), float(job.outcome == "precision_lost")
    return [*lines, Line(name, "precision_lost where it is, and only there", "own rule", must, lost, must, must)]


def heated_column() -> list[Line]:
    """The force of a uniform temperature against the foundation; beyond the precision floor only a refusal is honest."""
    lines = [line for stiffness in STIFFNESSES for line in _pressed(stiffness)]
    strain = (M * THETA + PULL) / E
    job = _column(1e4, strain * HEIGHT + 0.1, PULL)
    free = [report.normal_force for report in bench.steps(job)]
    growth = bench.worst(bench.fields(job)[0][:, 1], strain * (bench.nodes(job)[:, 1] - HEIGHT))
    name = "heated column, wide gap"
    return [
        *lines,
        below(name, "it does not touch", "analytic", free[0], 0.0),
        below(name, "it grows by (m theta + traction)/E", "analytic", growth, bench.ROUND_OFF),
    ]
