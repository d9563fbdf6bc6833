"""A floating block under a uniform pressure and a shear at and about Coulomb's bound mu p: it sticks, or moves off."""

from __future__ import annotations

import numpy as np

from warmslip.model.loads import Loads
from warmslip.records.check import Check, below, near
from warmslip.simulation.simulation import Simulation
from warmslip.typing import Array
from warmslip.verification.exact import fixtures
from warmslip.verification.exact.patch import (
    COUNTS,
    FRICTION,
    HEIGHT,
    LENGTHS,
    STIFFNESS,
    WIDTH,
    gradient,
    material,
    with_shear,
)

PRESSURE = 0.4


def _pressed(
    steps: int, k: float, shear_rate: float, shear: float, body: float, top: float
) -> tuple[Simulation, Array, Array]:
    """A floating block under PRESSURE and a shear stress that is uniform at first, with the gradients of u(0) and w(0).

    sigma_xy = 2 mu (shear + t shear_rate) + 2 mu_A shear_rate, sigma_yy = -PRESSURE, sigma_xx = 0; `body` is a body force along
    x and `top` an additional traction along x there, force per area.
    """
    scene = material(time__end=k * steps, time__steps=steps)
    lam, mu = scene.elasticity.pair(2)
    squeeze = -PRESSURE / (4 * mu * (lam + mu))
    g0 = gradient(with_shear((-lam * squeeze, (lam + 2 * mu) * squeeze), shear))
    g1 = gradient(with_shear((0.0, 0.0), shear_rate))
    viscous = fixtures.isotropic(scene.viscosity, (g1 + g1.T) / 2)

    def stress(t: float) -> Array:
        g = g0 + t * g1
        return np.asarray(fixtures.isotropic(scene.elasticity, (g + g.T) / 2) + viscous)

    pulls = fixtures.pulls(stress)

    def above(x: Array, t: float) -> Array:
        return np.asarray(pulls["top"](x, t) + np.array([top, 0.0]))

    loads = Loads(
        body=np.array([body, 0.0]),
        traction=pulls | {"top": above},
    )
    simulation = fixtures.run(scene, loads, fixtures.distorted(COUNTS, LENGTHS))
    x = fixtures.nodes(simulation)
    fixtures.start(simulation, u=np.array([0.0, -PRESSURE / STIFFNESS]) + x @ g0.T, w=x @ g1.T)
    return simulation, g0, g1


def sticking_patch() -> list[Check]:
    """A shear that grows to 99.9 % of mu p: the block shears uniformly and its foot stands still."""
    scene = material()
    mu, damping = scene.elasticity.pair(2)[1], scene.viscosity.pair(2)[1]
    k, steps, limit = 0.1, 8, FRICTION * PRESSURE
    shear_rate = 0.999 * limit / (2 * mu * k * steps + 2 * damping)
    simulation, g0, g1 = _pressed(steps, k, shear_rate, 0.0, 0.0, 0.0)
    x, foot = fixtures.nodes(simulation), fixtures.on(simulation, "bottom")
    creep, wrong, lost, loose = 0.0, 0.0, 0.0, 0
    for report in fixtures.steps(simulation):
        t = simulation.stepper.time
        u, w, _ = fixtures.fields(simulation)
        creep = max(creep, float(np.abs(w[foot, 0]).max()))
        wrong = max(wrong, fixtures.worst(u, np.array([0.0, -PRESSURE / STIFFNESS]) + x @ (g0 + t * g1).T))
        force = WIDTH * 2 * (mu * t + damping) * shear_rate
        lost = max(lost, abs(abs(report.friction_traction[0]) - force) / force)
        loose += report.slip + report.open
    name = "floating patch, shear up to 0.999 mu p"
    speed = shear_rate * HEIGHT
    return [
        below(
            name, "the slip velocity is zero, of the speed of the top", "analytic", creep / speed, fixtures.ROUND_OFF
        ),
        below(name, "u is the uniform shear", "analytic", wrong, fixtures.ROUND_OFF),
        below(name, "friction is the applied shear", "analytic", lost, fixtures.ROUND_OFF),
        below(name, "no point slips or opens", "analytic", loose, 0.0),
    ]


def slipping_patch() -> list[Check]:
    """A uniform shear of mu p and a body force b: slip with w_x = t b/rho, exactly backward Euler's straight line."""
    b, k, steps = 0.35, 0.1, 8
    scene = material()
    shear = FRICTION * PRESSURE / (2 * scene.elasticity.pair(2)[1])
    simulation, g0, _ = _pressed(steps, k, 0.0, shear, b, 0.0)
    x = fixtures.nodes(simulation)
    acceleration = b / scene.inertia.density
    errors = {"w is t (shear resultant - mu p W)/mass": 0.0, "u is the sum of k w": 0.0, "friction is mu p": 0.0}
    held = 0
    for n, report in enumerate(fixtures.steps(simulation), 1):
        u, w, _ = fixtures.fields(simulation)
        speed, way = n * k * acceleration, k * k * n * (n + 1) / 2 * acceleration
        friction = float(np.ravel(report.friction_traction)[0])
        found = (
            fixtures.worst(w, np.array([speed, 0.0]) + 0 * x),
            fixtures.worst(u, np.array([way, -PRESSURE / STIFFNESS]) + x @ g0.T),
            abs(abs(friction) / (FRICTION * PRESSURE * WIDTH) - 1),
        )
        errors = {key: max(old, new) for (key, old), new in zip(errors.items(), found, strict=True)}
        held += report.stick + report.open
    name = "floating patch, shear above mu p"
    lines = [below(name, proves, "analytic", error, fixtures.ROUND_OFF) for proves, error in errors.items()]
    return [*lines, below(name, "every point slips", "analytic", held, 0.0)]


def threshold_patch() -> list[Check]:
    """A shear of mu p and 0.1 % more on the top alone: stress is not uniform, but momentum is gained exactly.

    m (V_n - V_(n-1)) = k (W top traction - friction); a few points stick at first, then all slip and friction is mu times the
    resultant of p. Those that stick and the tilt of the block cost less than 1 % of the excess.
    """
    excess, k, steps = 1e-3, 0.1, 8
    scene = material()
    limit = FRICTION * PRESSURE
    simulation, *_ = _pressed(steps, k, 0.0, limit / (2 * scene.elasticity.pair(2)[1]), 0.0, excess * limit)
    mass = scene.inertia.density * WIDTH * HEIGHT
    before, lost, law, sliding = 0.0, 0.0, 0.0, 0
    for report in fixtures.steps(simulation):
        speed = float(fixtures.mean(simulation, fixtures.fields(simulation)[1])[0])
        friction = -float(np.ravel(report.friction_traction)[0])
        gain = k * ((1 + excess) * limit * WIDTH - friction)
        lost = max(lost, abs(mass * (speed - before) - gain) / (k * limit * WIDTH))
        if report.slip == len(simulation.discretisation.surface.weights):
            sliding += 1
            law = max(law, abs(friction / (FRICTION * report.normal_force) - 1))
        before = speed
    name = "floating patch, shear 1.001 mu p"
    expected = excess * limit * k * steps / (scene.inertia.density * HEIGHT)
    return [
        below(name, "momentum gained is traction less friction, of mu p", "analytic", lost, fixtures.ROUND_OFF),
        below(name, "friction is mu p when all points slip", "analytic", law, fixtures.ROUND_OFF),
        Check(name, "steps in which all points slip", "analytic", steps, sliding, 1, steps),
        near(name, "it moves off with the excess alone", "analytic", expected, before, 0.01),
    ]
