"""A column with inertia that rings down on the foundation, one-dimensional as in `creep`: an exact overdamped mode."""

from __future__ import annotations

import numpy as np

from warmslip.records.check import Check, near, order
from warmslip.studies.error_norms import ExactErrors
from warmslip.studies.rates import least_squares
from warmslip.typing import Array
from warmslip.verification.exact import fixtures

# overdamped, so that the exact mode is real; s is a root of rho s^2 + (E + eta s) KAPPA^2 = 0
RHO, MODULUS, DAMPING, KAPPA, DECAY = 1.0, 1.5, 3.5, 1.0, -3.0
OVERLAP, AMPLITUDE = 0.5, 0.1
SPRING = RHO * DECAY**2 / (KAPPA * np.tan(KAPPA))  # the boundary condition -(E + eta s) KAPPA cot(KAPPA) = c_nu
REST = SPRING * OVERLAP / (MODULUS + SPRING)  # compression of the column that the overlap alone causes


def _inertial_errors(n: int, steps: int) -> dict[str, float]:
    """Errors at the end on cells of size 1/n, of u in |eps|_L2 and of w in L2."""
    scene = fixtures.blank(
        mesh__n=[n // 4, n],
        mesh__lengths=[0.25, 1.0],
        time__end=0.25,
        time__steps=steps,
        inertia__density=RHO,
        elasticity__lame=[0.0, MODULUS / 2],
        viscosity__lame=[0.0, DAMPING / 2],
        supports__displacement=["top"],
        contact__stiffness=SPRING,
        contact__gap=-OVERLAP,
    )

    def up(values: Array) -> Array:
        return np.stack([0 * values, values], axis=1)

    def mode(x: Array, t: float) -> Array:
        return np.asarray(AMPLITUDE * np.exp(DECAY * t) * np.sin(KAPPA * (1 - x[:, 1])))

    def gradient(x: Array, t: float) -> Array:
        out = np.zeros((len(x), 2, 2))
        out[:, 1, 1] = -REST - AMPLITUDE * KAPPA * np.exp(DECAY * t) * np.cos(KAPPA * (1 - x[:, 1]))
        return out

    simulation = fixtures.run(scene)
    x = fixtures.nodes(simulation)
    fixtures.start(simulation, u=up(REST * (1 - x[:, 1]) + mode(x, 0.0)), w=up(DECAY * mode(x, 0.0)))
    for _ in fixtures.steps(simulation):
        pass
    measure = ExactErrors(
        simulation.discretisation,
        w=lambda x, t: up(DECAY * mode(x, t)),
        theta=lambda x, t: np.zeros(len(x)),
        gradient=gradient,
    )
    return measure.of(simulation.stepper)


def inertial_column() -> list[Check]:
    """A Kelvin-Voigt column with inertia that rings down on the spring: u_y = REST (1 - y) + A e^(st) sin(KAPPA (1 - y)).

    It solves rho u'' = E u_yy + eta w_yy with u(1) = 0 and sigma(0) = c_nu (u(0) - OVERLAP) for every t.
    """
    name, lines = "inertial column", []
    levels = [8, 16, 32]
    both = [_inertial_errors(n, n) for n in levels]
    for term in ("u_V", "w_L2"):
        p, _ = least_squares([1 / n for n in levels], [e[term] for e in both])
        lines.append(order(f"{name}, h = k", f"{term} at the end is O(h + k)", "analytic", 1.0, p))
    fine = [_inertial_errors(n, n * n // 4) for n in levels]
    p, _ = least_squares([1 / n for n in levels], [e["w_L2"] for e in fine])
    lines.append(order(f"{name}, k = h^2", "w_L2 at the end is O(h^2 + k)", "analytic", 2.0, p))
    # |(u - I u)'| = h/sqrt(12) |u''| is what P1 can do at best; width 1/4
    curvature = AMPLITUDE * KAPPA**2 * np.exp(DECAY * 0.25) * np.sqrt(0.25 * (0.5 - np.sin(2 * KAPPA) / (4 * KAPPA)))
    n = levels[-1]
    best, found = float(curvature / np.sqrt(12) / n), _inertial_errors(n, n * n)["u_V"]
    return [
        *lines,
        near(
            f"{name}, n = {n}", "u_V with small steps is P1's best approximation error", "analytic", best, found, 0.02
        ),
    ]
