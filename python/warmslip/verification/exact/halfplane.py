"""A large block for a half-plane: a graded mesh, and on its outer sides the tractions of a point force at the origin.

The foundation is the parabola y = -x^2/(2R), which touches the half-plane y > 0 at the origin. A block with free sides would be
wrong by O(a/L); with Flamant's tractions (K. L. Johnson, Contact Mechanics, 1985, 2.2) only the second moment of the contact
pressure is missing from them, O((a/L)^2). Lengths are in units of Hertz's half-width a.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from warmslip.model.loads import Loads
from warmslip.simulation.simulation import Simulation
from warmslip.typing import Array
from warmslip.verification.exact import fixtures

FORCE = 0.1  # P, per thickness
PEAK = 2 * FORCE / np.pi  # Hertz's p_0 for a = 1
SHEAR_MODULUS = 1.0
POINTS = 200  # of the midpoint rule on an edge: enough for a square root at its end


@dataclass(frozen=True)
class HalfPlane:
    """An elastic half-plane with Lame's (lam, SHEAR_MODULUS), cut off at `size`, cells of 1/`cells` under the contact."""

    lam: float
    size: float
    cells: int
    stiffness: float
    friction: float = 0.0

    @property
    def modulus(self) -> float:
        """E* of the plane tensor (stress): E/(1 - nu^2) of plane strain."""
        mu = SHEAR_MODULUS
        return 4 * mu * (self.lam + mu) / (self.lam + 2 * mu)

    @property
    def step(self) -> float:
        """k. The block floats: of its fall on the foundation, (rho L^2/(mu k^2)) of what was is left after a step."""
        return 2.5 * self.size

    @property
    def radius(self) -> float:
        """R for which Hertz's a^2 = 4 P R/(pi E*) is 1."""
        return float(np.pi * self.modulus / (4 * FORCE))

    def mesh(self) -> fixtures.Triangulation:
        """Uniform up to |x| = 1.25 and y = 1, from there in geometric progression; each doubling of `cells` halves all."""
        x, y = (_lines(start, self.size, self.cells) for start in (1.25, 1.0))
        return fixtures.crossed(np.concatenate([-x[:0:-1], x]), y)

    def simulation(self, steps: int, shear: Callable[[float], float]) -> Simulation:
        """A run of `steps` steps under P and, at time t, the tangential load shear(t), per thickness."""
        scene = fixtures.blank(
            time__end=self.step * steps,
            time__steps=steps,
            inertia__density=1.0,
            elasticity__lame=[self.lam, SHEAR_MODULUS],
            contact__stiffness=self.stiffness,
            contact__friction__coefficient=self.friction,
        )

        def traction(normal: Array) -> Callable[[Array, float], Array]:
            def value(x: Array, t: float) -> Array:
                # the foundation pushes with (-Q, P): sigma = -2 (F.x) x x^T/(pi r^4)
                push = x @ np.array([-shear(t), FORCE])
                return np.asarray(-2 / np.pi * (push * (x @ normal) / np.sum(x**2, axis=1) ** 2)[:, None] * x)

            return value

        loads = Loads(
            traction={part: traction(normal) for part, normal in fixtures.NORMALS.items()},
            gap=lambda x, t: x[:, 0] ** 2 / (2 * self.radius),
            points=6,
        )
        return fixtures.run(scene, loads, self.mesh())


def _lines(uniform: float, size: float, cells: int) -> Array:
    """0 .. size: quarters up to `uniform`, then growing by half each, the last one cut; every part halved up to `cells`."""
    x, step = list(np.arange(0, uniform + 0.1, 0.25)), 0.25
    while x[-1] < size:
        step *= 1.5
        x.append(x[-1] + step)
    coarse = np.array(x)
    coarse[coarse > uniform] = uniform + (coarse[coarse > uniform] - uniform) * (size - uniform) / (x[-1] - uniform)
    parts = cells // 4
    return np.interp(np.arange((len(coarse) - 1) * parts + 1) / parts, np.arange(len(coarse)), coarse)


@dataclass(frozen=True)
class Foot:
    """Contact points from left to right: x, pressure and friction traction on the foundation along x, statuses, weights."""

    x: Array
    pressure: Array
    shear: Array
    status: Array
    weight: Array

    @classmethod
    def of(cls, simulation: Simulation) -> Foot:
        surface = simulation.discretisation.surface
        x, weight = np.asarray(surface.positions)[:, 0], np.asarray(surface.weights)
        order = np.argsort(x)
        force = np.asarray(simulation.stepper.contact_force).reshape(-1, 2) / weight[:, None]
        status = np.array(simulation.stepper.status)
        return cls(x[order], -force[order, 1], force[order, 0], status[order], weight[order])

    def average(self, traction: Callable[[Array], Array]) -> Array:
        """Means of a traction (a function of x) under the hat functions of the points: what their forces stand for."""
        middle = (np.arange(POINTS) + 0.5) / POINTS
        x = self.x[:-1, None] + np.diff(self.x)[:, None] * middle
        value = traction(x) * np.diff(self.x)[:, None] / POINTS
        left, right = value @ (1 - middle), value @ middle
        total = np.zeros(len(self.x))
        total[:-1] += left
        total[1:] += right
        return np.asarray(total / self.weight)
