"""A massless column under its clamp that creeps across a gap onto the foundation.

With lambda = 0, u_x = 0 and free sides a plane body is one-dimensional: sigma_yy = E u_y' + eta w_y', E = 2 mu of the
elasticity and eta = 2 mu of the viscosity. The column has its clamp at y = H and the foundation below y = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warmslip.model.loads import Loads
from warmslip.records.check import Check, below, near, order
from warmslip.studies.rates import least_squares
from warmslip.typing import Array
from warmslip.verification.exact import fixtures

# a column of length H is pulled down by TRACTION
H, E, ETA, STIFFNESS, TRACTION, GAP, END = 2.0, 3.0, 1.5, 7.0, 1.2, 0.3, 1.0
HEATING = 0.9  # R_yy: without conduction theta' = R_yy a'


def creep(t: Array) -> Array:
    """Elongation a(t) (dimensionless) of the massless column: eta a' = TRACTION - E a - c max(a H - g, 0), a(0) = 0.

    Two exponentials, Kelvin-Voigt's eta/E up to the touch and eta/(E + c H) after it.
    """
    free, touch = TRACTION / E, GAP / H
    slow, fast = ETA / E, ETA / (E + STIFFNESS * H)
    t_touch = -slow * np.log(1 - touch / free)
    held = (TRACTION + STIFFNESS * GAP) / (E + STIFFNESS * H)
    after = held + (touch - held) * np.exp(-np.maximum(t - t_touch, 0) / fast)
    return np.where(t < t_touch, free * (1 - np.exp(-t / slow)), after)


def euler(k: float, steps: int) -> Array:
    """Backward Euler's elongations of the same law, (steps,): each step solves a scalar piecewise linear equation."""
    a, out = 0.0, []
    for _ in range(steps):
        old, rate = a, ETA / k
        a = (TRACTION + rate * old) / (E + rate)
        if a * H > GAP:
            a = (TRACTION + STIFFNESS * GAP + rate * old) / (E + STIFFNESS * H + rate)
        out.append(a)
    return np.array(out)


@dataclass(frozen=True)
class Creep:
    """One run, an entry a step: mean elongations, contact forces; `departure` is the largest of u from an affine one."""

    departure: float
    elongation: Array
    force: Array
    theta: Array  # mean temperature


def _creep(steps: int, coupling: str = "staggered") -> Creep:
    scene = fixtures.blank(
        time__end=END,
        time__steps=steps,
        time__coupling=coupling,
        elasticity__lame=[0.0, E / 2],
        viscosity__lame=[0.0, ETA / 2],
        heat__heating__tensor=[[0.0, 0.0], [0.0, HEATING]],
        supports__displacement=["top"],
        contact__stiffness=STIFFNESS,
    )
    loads = Loads(contact_traction=np.array([0.0, -TRACTION]), gap=GAP)
    simulation = fixtures.run(scene, loads, fixtures.distorted((3, 5), (1.0, H)))
    y, bottom = fixtures.nodes(simulation)[:, 1], fixtures.on(simulation, "bottom")
    rows, departure = [], 0.0
    for report in fixtures.steps(simulation):
        u, _, theta = fixtures.fields(simulation)
        a = -u[bottom, 1].mean() / H
        departure = max(departure, fixtures.worst(u, np.stack([0 * y, a * (y - H)], axis=1)))
        rows.append((a, report.normal_force, fixtures.mean(simulation, theta)))
    return Creep(departure, *np.array(rows).T)


def _recursion() -> list[Check]:
    """The steps themselves: affine, backward Euler's, and heated by the velocity of the right step."""
    steps = 40
    staggered, lagged = _creep(steps), _creep(steps, "lagged")
    exact = euler(END / steps, steps)
    pressure = STIFFNESS * np.maximum(exact * H - GAP, 0)
    late = np.append(0.0, exact[:-1])
    errors = {
        "u is affine on a distorted mesh": staggered.departure,
        "every step is backward Euler's recursion": fixtures.worst(staggered.elongation, exact),
        "the contact force is c_nu (u_nu - g)": fixtures.worst(staggered.force, pressure),
        "staggered: it is heated by w_n": fixtures.worst(staggered.theta, HEATING * exact),
        "lagged: it is heated by w_(n-1)": fixtures.worst(lagged.theta, HEATING * late),
    }
    return [below("creeping column, 40 steps", name, "analytic", e, fixtures.ROUND_OFF) for name, e in errors.items()]


def creeping_column() -> list[Check]:
    """Massless Kelvin-Voigt column onto the normal-compliance spring: backward Euler's recursion, and its limit."""
    counts = [40, 80, 160]
    runs = [_creep(steps).elongation for steps in counts]
    errors = [fixtures.worst(a, creep(np.arange(1, n + 1) * END / n)) for a, n in zip(runs, counts, strict=True)]
    p, _ = least_squares([1 / n for n in counts], errors)
    # at rest it has forgotten how it came there: E a = TRACTION - c (a H - g)
    rest = (TRACTION + STIFFNESS * GAP) / (E + STIFFNESS * H)
    name = "creeping column, 160 steps"
    return [
        *_recursion(),
        order(name, "error over time against the two exponentials is O(k)", "analytic", 1.0, p),
        below(name, "largest error over time, relative", "analytic", errors[-1], 0.01),
        near(
            name,
            "the elongation comes to the balance of column and spring",
            "analytic",
            rest,
            float(runs[-1][-1]),
            1e-3,
        ),
    ]
