"""A floating block thrown along the foundation: Coulomb's constant deceleration mu p/(rho h), a stop, and rest.

Momentum m (V_n - V_(n-1)) = -k mu N_n is exact in every step for any material. V_n = max(V_0 - n k mu p/(rho h), 0) is exact
for a rigid block, where N_n = p W: friction acts at the foot and tilts the block, but a tilt leaves the resultant alone.
Viscosity eta makes the block rigid up to O(1/eta), which is measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warmslip.model.loads import Loads
from warmslip.records.check import Check, below, order
from warmslip.studies.rates import least_squares, observed
from warmslip.typing import Array
from warmslip.verification.exact import fixtures

WIDTH, HEIGHT, DENSITY = 4.0, 1.0, 1.0
PRESSURE, FRICTION, STIFFNESS, SPEED = 1.0, 0.3, 1e4, 1.0
DECELERATION = FRICTION * PRESSURE / (DENSITY * HEIGHT)
END = 4.0  # the block stops at SPEED/DECELERATION = 10/3


@dataclass(frozen=True)
class Slide:
    """Histories of one run, an entry a step: mean velocity along x and y, normal force, friction, sliding points, foot speed."""

    k: float
    points: int
    speed: Array
    rise: Array
    normal: Array
    friction: Array
    slipping: Array
    foot: Array


def _slide(steps: int, young: float, viscosity: float) -> Slide:
    """The block on a symmetric mesh, in equilibrium under PRESSURE at t = 0 and moving at SPEED."""
    scene = fixtures.blank(
        time__end=END,
        time__steps=steps,
        inertia__density=DENSITY,
        elasticity__lame=[0.0, young / 2],
        viscosity__lame=[0.0, viscosity / 2],
        contact__stiffness=STIFFNESS,
        contact__friction__coefficient=FRICTION,
    )
    mesh = fixtures.crossed(np.linspace(0, WIDTH, 9), np.linspace(0, HEIGHT, 3))
    simulation = fixtures.run(scene, Loads(traction={"top": np.array([0.0, -PRESSURE])}), mesh)
    y = fixtures.nodes(simulation)[:, 1]
    squeeze = PRESSURE / young * y if young else 0 * y
    fixtures.start(simulation, u=np.stack([0 * y, -PRESSURE / STIFFNESS - squeeze], axis=1), w=np.array([SPEED, 0.0]))
    foot, rows = fixtures.on(simulation, "bottom"), []
    for report in fixtures.steps(simulation):
        w = fixtures.fields(simulation)[1]
        friction = float(np.ravel(report.friction_traction)[0])
        rows.append(
            (
                *fixtures.mean(simulation, w),
                report.normal_force,
                -friction,
                report.slip,
                float(np.abs(w[foot, 0]).max()),
            )
        )
    return Slide(scene.step, len(simulation.discretisation.surface.weights), *np.array(rows).T)


def _rigid(k: float, steps: int) -> Array:
    """Velocities (steps,) of a rigid block by backward Euler: Coulomb's law takes k mu p/(rho h) a step, or what is left."""
    return np.maximum(SPEED - DECELERATION * k * np.arange(1, steps + 1), 0)


def elastic_block() -> list[Check]:
    """A soft block, which shakes and tilts: both momenta and the friction law, by their resultants, step by step."""
    s = _slide(80, young=200.0, viscosity=1.0)
    mass, weight = DENSITY * WIDTH * HEIGHT, PRESSURE * WIDTH
    along = mass * np.diff(s.speed, prepend=SPEED) + s.k * s.friction
    across = mass * np.diff(s.rise, prepend=0.0) - s.k * (s.normal - weight)
    sliding = s.slipping == s.points
    law = s.friction[sliding] - FRICTION * s.normal[sliding]
    name = "sliding elastic block, 80 steps"
    scale = FRICTION * weight
    return [
        below(
            name,
            "m dV = -k friction, of k mu p W",
            "analytic",
            fixtures.worst(along, 0, s.k * scale),
            fixtures.ROUND_OFF,
        ),
        below(
            name,
            "vertically m dV = k (N - p W)",
            "analytic",
            fixtures.worst(across, 0, s.k * weight),
            fixtures.ROUND_OFF,
        ),
        below(
            name, "friction is mu N when all points slip", "analytic", fixtures.worst(law, 0, scale), fixtures.ROUND_OFF
        ),
        Check(name, "steps in which all points slip", "analytic", 66.0, float(sliding.sum()), 50.0, 67.0),
    ]


def rigid_block() -> list[Check]:
    """A block made rigid by viscosity: velocities of a rigid one up to O(1/eta), the stop in the right step, then rest."""
    steps, viscosities = 40, [1e4, 1e5, 1e6]
    runs = [_slide(steps, young=0.0, viscosity=v) for v in viscosities]
    exact = _rigid(END / steps, steps)
    moving = exact > 0
    errors = [fixtures.worst(s.speed[moving], exact[moving], SPEED) for s in runs]
    p, _ = least_squares([1 / v for v in viscosities], errors)
    s = runs[-1]
    name = "sliding rigid block, 40 steps"
    lines = [
        order(name, "velocity before the stop is rigid Coulomb's up to O(1/eta)", "analytic", 1.0, p),
        below(name, "velocity before the stop, eta = 1e6, of the initial", "analytic", errors[-1], 1e-6),
        below(
            name,
            "sliding stops in the step of rigid Coulomb's law",
            "analytic",
            abs(int((s.foot > 1e-3 * SPEED).sum()) - int(moving.sum())),
            0.0,
        ),
        below(name, "afterwards the foot is at rest", "analytic", fixtures.worst(s.foot[~moving], 0, SPEED), 1e-10),
    ]
    # the way to the stop: k sum V_n against SPEED^2/(2 DECELERATION)
    way = SPEED**2 / (2 * DECELERATION)
    both = [runs[0], _slide(2 * steps, young=0.0, viscosity=viscosities[0])]
    short = [1 - r.k * float(r.speed.sum()) / way for r in both]
    return [
        *lines,
        order(name, "the way to the stop is V^2/(2 mu p/(rho h)) - O(k)", "analytic", 1.0, observed(*short)),
    ]
