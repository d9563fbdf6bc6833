"""Uniform strain: every field of the scheme's own space, so the discrete answer is the exact one on any mesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip.model.loads import Loads
from warmslip.records.check import Check, below
from warmslip.scene.full import FullScene
from warmslip.typing import Array
from warmslip.verification.exact import fixtures

COUNTS, LENGTHS = (5, 3), (2.0, 1.0)
WIDTH, HEIGHT = LENGTHS
FRICTION, STIFFNESS, SOURCE, THETA0 = 0.3, 50.0, 0.7, 2.0
EXPANSION = np.array([[1.1, 0.3], [0.3, 0.8]])
HEATING = np.array([[-0.6, 0.2], [0.2, 0.9]])


def material(**keys: Any) -> FullScene:
    """A floating viscoelastic body with inertia above a foundation with friction, and `keys` besides (see `fixtures.blank`)."""
    return fixtures.blank(
        **{
            "inertia__density": 1.3,
            "elasticity__lame": [3.0, 2.0],
            "viscosity__lame": [0.4, 0.7],
            "contact__stiffness": STIFFNESS,
            "contact__friction__coefficient": FRICTION,
        }
        | keys
    )


def with_shear(strain: tuple[float, float], shear: float) -> Array:
    """The plane strain (2, 2) with these diagonal entries and this shear off the diagonal."""
    return np.array([[strain[0], shear], [shear, strain[1]]])


def _sliding_shear(law: Any, strain: tuple[float, float]) -> Array:
    """The strain with these diagonal entries whose stress `law` (affine in it) slides: sigma_xy = -mu sigma_yy."""

    def excess(shear: float) -> float:
        stress = law(with_shear(strain, shear))
        return float(stress[0, 1] + FRICTION * stress[1, 1])

    at_zero = excess(0.0)
    return with_shear(strain, at_zero / (at_zero - excess(1.0)))


def gradient(strain: Array) -> Array:
    """The displacement gradient with this strain that keeps the lines y = const: u_y does not depend on x."""
    return np.array([[strain[0, 0], 2 * strain[0, 1]], [0.0, strain[1, 1]]])


def _coupled(coupling: str) -> list[Check]:
    k, steps = 0.1, 5
    scene = material(
        time__end=k * steps,
        time__steps=steps,
        time__coupling=coupling,
        heat__conductivity=[[2.0, 0.5], [0.5, 1.0]],
        heat__expansion__tensor=EXPANSION.tolist(),
        heat__heating__tensor=HEATING.tolist(),
        contact__heat_exchange__conductance=1.7,
    )
    felt = 0.0 if coupling == "monolithic" else -k  # the momentum balance feels theta at t + felt

    def elastic(e: Array) -> Array:
        return fixtures.isotropic(scene.elasticity, e)

    def warming(e1: Array) -> float:
        return SOURCE + float(np.sum(HEATING * e1))

    # strain e0 + t e1; the parts of the stress that are constant and linear in time must each slide
    e1 = _sliding_shear(lambda e: elastic(e) - warming(e) * EXPANSION, (0.02, -0.03))
    rate = warming(e1)
    fixed = fixtures.isotropic(scene.viscosity, e1) - (THETA0 + rate * felt) * EXPANSION
    e0 = _sliding_shear(lambda e: elastic(e) + fixed, (0.01, -0.15))
    stress0, stress1 = elastic(e0) + fixed, elastic(e1) - rate * EXPANSION

    def stress(t: float) -> Array:
        return np.asarray(stress0 + t * stress1)

    def theta(t: float) -> float:
        return THETA0 + rate * t

    def w(x: Array) -> Array:
        return np.asarray(np.array([0.5, -0.01]) + x @ gradient(e1).T)

    def u(x: Array, t: float) -> Array:
        return np.asarray(np.array([0.1, -0.02]) + x @ gradient(e0).T + t * w(x))

    loads = Loads(
        source=SOURCE,
        traction=fixtures.pulls(stress),
        gap=lambda x, t: 0.02 + 0.01 * t + stress(t)[1, 1] / STIFFNESS + 0 * x[:, 0],  # u_nu + sigma_yy/c_nu
        foundation_temperature=lambda x, t: theta(t) + 0 * x[:, 0],
    )
    simulation = fixtures.run(scene, loads, fixtures.distorted(COUNTS, LENGTHS))
    x = fixtures.nodes(simulation)
    fixtures.start(simulation, u=u(x, 0.0), w=w(x), theta=THETA0)
    found = dict.fromkeys(("u", "w", "theta", "the resultant"), 0.0)
    for report in fixtures.steps(simulation):
        t = simulation.stepper.time
        expected = u(x, t), w(x), np.full(len(x), theta(t)), WIDTH * stress(t) @ [0.0, -1.0]
        values = *fixtures.fields(simulation), np.ravel(report.traction)
        for name, value, exact in zip(found, values, expected, strict=True):
            found[name] = max(found[name], fixtures.worst(value, exact))
    name = f"coupled uniform strain, {coupling}"
    return [
        below(name, f"{part} is exact on a distorted mesh while it slides", "analytic", error, fixtures.ROUND_OFF)
        for part, error in found.items()
    ]


def coupled_patch() -> list[Check]:
    """u affine and linear in time, theta uniform: theta' = q0 + R : eps(w), sigma uniform, full slip by the law itself.

    The shear strain is chosen so that sigma_xy = -mu sigma_yy at all times, the gap so that c_nu (u_nu - g) = -sigma_yy;
    what the momentum balance feels of theta is one step old unless the coupling is monolithic.
    """
    return [line for coupling in ("staggered", "lagged", "monolithic") for line in _coupled(coupling)]
