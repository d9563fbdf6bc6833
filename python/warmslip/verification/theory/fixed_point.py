"""Lambda, the map of the existence proof (section 3), for the discrete problem: frozen trajectories in, trajectories out.

Frozen are zeta = m(theta, .) in the momentum balance and xi = -e(w, .) in the heat balance; contact and exchange stay with their
problems. (PD) then gives w from zeta, (PT) theta from xi, at all steps. Numbers are dimensionless.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warmslip.model.discretisation import Discretisation, discretise
from warmslip.scene.full import FullScene
from warmslip.simulation.simulation import Simulation
from warmslip.typing import Array

ROUND_OFF = 1e-13  # of the first difference: what follows is rounding, no contraction


@dataclass(frozen=True)
class Fields:
    """w (steps, nodes, d) and theta (steps, nodes) at t_1 .. t_N."""

    w: Array
    theta: Array


def decoupled(scene: FullScene) -> FullScene:
    """The scene with M = R = 0."""
    zero = np.zeros((scene.mesh.dim, scene.mesh.dim)).tolist()
    return scene.override(**{"heat.expansion.tensor": zero, "heat.heating.tensor": zero})


def _right(outcome: str, scene: FullScene) -> None:
    if outcome != "completed":
        raise RuntimeError(f"'{scene.title}' ended: {outcome}")


def solution(scene: FullScene) -> Fields:
    """The scene's run with its own coupling. Raises RuntimeError when it is not completed."""
    simulation = Simulation(scene)
    d = simulation.discretisation
    found = [(d.field(simulation.stepper.w), d.field(simulation.stepper.theta)) for _ in simulation.steps()]
    _right(simulation.outcome, scene)
    return Fields(np.array([w for w, _ in found]), np.array([theta for _, theta in found]))


class Lambda:
    """The proof's map for a scene: frozen (w, theta) in, the solutions of (PD) and (PT) out.

    The scene's coupling says from which step the frozen terms are taken. `sign` is that of zeta in f_zeta = f + sign zeta.
    """

    def __init__(self, scene: FullScene, sign: float = 1.0) -> None:
        self.scene, self._sign = scene, sign
        self._apart: Discretisation = discretise(decoupled(scene))
        coupled = discretise(scene)
        self._expansion, self._heating = coupled.operators.expansion, coupled.operators.heating
        self._kept = coupled
        start = self._apart.stepper()
        self._initial = self._apart.field(start.w), self._apart.field(start.theta)

    @property
    def zero(self) -> Fields:
        steps, (w, theta) = self.scene.time.steps, self._initial
        return Fields(np.zeros((steps, *w.shape)), np.zeros((steps, *theta.shape)))

    def __call__(self, frozen: Fields) -> Fields:
        """Raises RuntimeError when a step of the decoupled problems is rejected."""
        d, coupling = self._apart, self.scene.time.coupling
        theta = frozen.theta if coupling == "monolithic" else _delayed(frozen.theta, self._initial[1])
        w = _delayed(frozen.w, self._initial[0]) if coupling == "lagged" else frozen.w
        stepper, found = d.stepper(), []
        read_w, read_theta, force, heat = (d.layout.vector(block) for block in (d.dim, 1, d.dim, 1))
        for n in range(self.scene.time.steps):
            f, q, gap, *_ = d.load_vectors.at((n + 1) * self.scene.step)
            d.layout.distribute(w[n].ravel(), read_w)
            d.layout.distribute(theta[n], read_theta)
            self._expansion.mult(read_theta, force)
            force.aypx(self._sign, f)
            self._heating.multAdd(read_w, q, heat)
            _right(stepper.advance(force, heat, gap).outcome.name, self.scene)
            found.append((d.field(stepper.w), d.field(stepper.theta)))
        for vector in (read_w, read_theta, force, heat):
            vector.destroy()  # petsc4py would only mark it for a later collection
        return Fields(np.array([one for one, _ in found]), np.array([one for _, one in found]))

    def distance(self, one: Fields, other: Fields) -> float:
        """(k sum_n |w_n|_V^2 + |theta_n|_L2^2)^1/2 of the difference; times |R| and |M| it bounds that of (zeta, xi)."""
        d = self._apart
        w, theta = d.layout.vector(d.dim), d.layout.vector(1)
        total = 0.0
        for dw, dtheta in zip(one.w - other.w, one.theta - other.theta, strict=True):
            d.layout.distribute(dw.ravel(), w)
            d.layout.distribute(dtheta, theta)
            total += d.norms.v(w) ** 2 + d.norms.l2(theta) ** 2
        w.destroy()
        theta.destroy()
        return float(np.sqrt(self.scene.step * total))


def _delayed(values: Array, initial: Array) -> Array:
    """The values one step before, (steps, ...)."""
    return np.concatenate([initial[None], values[:-1]])


@dataclass(frozen=True)
class Iteration:
    """Differences |Lambda^(n+1) 0 - Lambda^n 0|, n = 0, 1, ..., and the last iterate."""

    scene: FullScene
    differences: list[float]
    last: Fields
    zero: Fields

    @property
    def pairs(self) -> Array:
        """The differences at n = 0, 2, 4, ... over the first, as long as they are not rounding."""
        size = np.array(self.differences[::2]) / self.differences[0]
        return size[: int(np.argmax(size < ROUND_OFF))] if (size < ROUND_OFF).any() else size

    @property
    def factors(self) -> Array:
        """pairs[m+1]/pairs[m], m = 0, 1, ..."""
        return self.pairs[1:] / self.pairs[:-1]


def iterate(scene: FullScene, most: int = 200, sign: float = 1.0) -> Iteration:
    """Lambda from 0 until two differences in a row are rounding, or `most` times."""
    mapping = Lambda(scene, sign)
    now = zero = mapping.zero
    differences: list[float] = []
    while len(differences) < most and not (len(differences) > 1 and _settled(differences)):
        before, now = now, mapping(now)
        differences.append(mapping.distance(now, before))
    return Iteration(scene, differences, now, zero)


def _settled(differences: list[float]) -> bool:
    return max(differences[-2:]) < ROUND_OFF * max(differences[:2])
