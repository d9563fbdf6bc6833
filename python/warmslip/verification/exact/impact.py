"""An elastic bar that flies into the foundation: the wave solution (K. F. Graff, Wave Motion in Elastic Solids, 1975, 2.4).

lambda = 0, so the bar is one-dimensional: wave speed c = sqrt(E/rho), impedance Z = sqrt(E rho), transit 2 L/c. On the end
that touches, the incoming waves are its own pressure, reflected by the free end:

    u_nu' = V - (p(t) + 2 p(t - 2L/c))/Z       for t < 4 L/c,     p = c_nu u_nu.

With s = c_nu t/Z and S = 2 c_nu L/(c Z), P = p/(Z V) is 1 - e^-s up to S and (2 - e^-S + 2 (s - S)) e^-(s-S) - 1 after it, until
it vanishes; for c_nu -> infinity a pressure Z V = rho c V for the time 2 L/c.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from warmslip.records.check import Check, below, near, order
from warmslip.studies.rates import least_squares
from warmslip.typing import Array
from warmslip.verification.exact import fixtures

LENGTH, WIDTH, E, DENSITY, SPEED = 1.0, 0.125, 4.0, 1.0, 0.3
WAVE, IMPEDANCE = float(np.sqrt(E / DENSITY)), float(np.sqrt(E * DENSITY))
TRANSIT = 2 * LENGTH / WAVE


@dataclass(frozen=True)
class Impact:
    """The wave solution: `touch` its duration (time), `impulse` its momentum per width, both of the exact bar."""

    stiffness: float

    @property
    def _late(self) -> float:
        return self.stiffness * TRANSIT / IMPEDANCE

    @property
    def _left(self) -> float:
        """s - S at which the pressure vanishes."""
        start = 2 - np.exp(-self._late)
        return float(brentq(lambda r: (start + 2 * r) * np.exp(-r) - 1, 0.0, 10.0))

    @property
    def touch(self) -> float:
        return float((self._late + self._left) * IMPEDANCE / self.stiffness)

    @property
    def impulse(self) -> float:
        s, r = self._late, self._left
        first = s - 1 + np.exp(-s)
        second = (2 - np.exp(-s)) * (1 - np.exp(-r)) + 2 * (1 - (1 + r) * np.exp(-r)) - r
        return float(IMPEDANCE * SPEED * (first + second) * IMPEDANCE / self.stiffness)

    def pressure(self, t: Array) -> Array:
        """p at times `t` >= 0 (times,)."""
        s = self.stiffness * t / IMPEDANCE
        r = np.maximum(s - self._late, 0)
        late = (2 - np.exp(-self._late) + 2 * r) * np.exp(-r) - 1
        share = np.where(s < self._late, 1 - np.exp(-s), np.where(r < self._left, late, 0.0))
        return np.asarray(IMPEDANCE * SPEED * share)


def _fly(n: int, steps: int, stiffness: float, end: float) -> tuple[Array, Array]:
    """Normal forces per width and mean velocities along y, (steps,) each; n cells along the bar."""
    scene = fixtures.blank(
        time__end=end,
        time__steps=steps,
        inertia__density=DENSITY,
        elasticity__lame=[0.0, E / 2],
        contact__stiffness=stiffness,
    )
    simulation = fixtures.run(scene, mesh=fixtures.crossed(np.array([0.0, WIDTH]), np.linspace(0, LENGTH, n + 1)))
    fixtures.start(simulation, w=np.array([0.0, -SPEED]))
    rows = [
        (report.normal_force / WIDTH, fixtures.mean(simulation, fixtures.fields(simulation)[1])[1])
        for report in fixtures.steps(simulation)
    ]
    force, velocity = np.array(rows).T
    return force, velocity


END = 1.25 * TRANSIT  # beyond `touch` for both stiffnesses; the bar does not come back


def soft_impact() -> list[Check]:
    """A foundation soft enough (c_nu L/E = 5) for the pressure to have no jump: everything is O(k)."""
    exact, counts = Impact(20.0), [200, 400, 800]
    runs = [_fly(64, steps, exact.stiffness, END) for steps in counts]
    impulses = [END / len(force) * float(force.sum()) for force, _ in runs]
    p, _ = least_squares([1 / n for n in counts], [abs(exact.impulse - impulse) for impulse in impulses])
    force, velocity = runs[-1]
    k = END / counts[-1]
    t = k * np.arange(1, counts[-1] + 1)
    name = f"bar on a soft foundation, {counts[-1]} steps"
    momentum = DENSITY * LENGTH * (velocity + SPEED) - k * np.cumsum(force)
    halfway = t <= TRANSIT / 2
    return [
        below(
            name,
            "momentum gained is the impulse so far",
            "analytic",
            fixtures.worst(momentum, 0, exact.impulse),
            fixtures.ROUND_OFF,
        ),
        order(name, "backward Euler loses O(k) of the impulse", "analytic", 1.0, p),
        near(name, "impulse", "analytic", exact.impulse, impulses[-1], 0.01),
        near(name, "time of contact", "analytic", exact.touch, k * float((force > 0).sum()), 2 * k, scale=1.0),
        below(
            name,
            "pressure while it builds up, of rho c V",
            "analytic",
            fixtures.worst(force[halfway], exact.pressure(t[halfway]), IMPEDANCE * SPEED),
            0.01,
        ),
    ]


def stiff_impact() -> list[Check]:
    """A foundation that acts as rigid: rho c V for the time 2 L/c; backward Euler blurs the front over sqrt(k).

    With D = (1 - 1/z)/k for d/dt, a delay T turns into exp(-D T): a front arrives after k N, N of Poisson's law with mean T/k.
    The pressure is Z V (1 - 2 P(k N <= t)) until it vanishes, its integral Z V (T - E|k N - T|), E|k N - T| = sqrt(2 k T/pi).
    """
    exact, counts = Impact(1e6), [200, 400, 800]
    runs = [_fly(128, steps, exact.stiffness, END)[0] for steps in counts]
    impulses = [END / len(force) * float(force.sum()) for force in runs]
    p, _ = least_squares([1 / n for n in counts], [abs(exact.impulse - impulse) for impulse in impulses])
    k, force = END / counts[-1], runs[-1]
    name = f"bar on a stiff foundation, {counts[-1]} steps"
    blur = float(np.sqrt(2 * k / (np.pi * TRANSIT)))
    half = force[round(TRANSIT / 2 / k) - 1]
    return [
        near(name, "pressure halfway is rho c V", "analytic", IMPEDANCE * SPEED, float(half), 1e-5),
        near(name, "time of contact is 2 L/c", "analytic", TRANSIT, k * float((force > 0).sum()), 0.02),
        order(name, "backward Euler loses O(sqrt(k)) of the impulse", "analytic", 0.5, p, 0.02, 0.02),
        near(
            name, "namely sqrt(2 k/(pi T)) of it, T = 2 L/c", "analytic", blur, 1 - impulses[-1] / exact.impulse, 2e-3
        ),
    ]
