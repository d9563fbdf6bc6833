"""Norms and contact forces of the paper's problem from codes that share nothing with the core.

A code is a function (reading, theta_F, n, steps, coupling) -> numbers by name (see `core`), entered in CODES.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from reference import scipy_scheme, skfem_scheme

import warmslip
from warmslip.records.check import Check, near

Numbers = dict[str, float]
Code = Callable[[str, float, int, int, str], Numbers]

N = STEPS = 16
TOLERANCE = 1e-10  # relative, of a force relative to the whole of it
CASES = list(itertools.product(skfem_scheme.READINGS, (0.0, 10.0), ("staggered", "lagged", "monolithic")))


def core(reading: str, theta_F: float, n: int, steps: int, coupling: str, **more: object) -> Numbers:
    """|u|_V and the L2 norms of u, w and theta at the end, and the force on the body over Gamma_C."""
    keys = {
        "mesh.n": n,
        "time.steps": steps,
        "time.coupling": coupling,
        "contact.heat_exchange.foundation_temperature": theta_F,
    }
    result = warmslip.run(warmslip.load(f"paper_{reading}").override(**keys | more))
    assert result.completed
    traction = result.summary["contact"]["traction"]
    return result.summary["norms"] | {"traction_x": traction[0], "traction_y": traction[1]}


def scipy_code(reading: str, theta_F: float, n: int, steps: int, coupling: str) -> Numbers:
    end = scipy_scheme.simulate(reading, theta_F, n, steps, coupling, keep="final")
    weights = scipy_scheme.edge_weights(n)
    forces = {"traction_x": -weights @ end.friction[-1], "traction_y": weights @ end.pressure[-1]}
    return scipy_scheme.norms(n, end.u[-1], end.w[-1], end.theta[-1]) | forces


CODES: dict[str, Code] = {"scikit-fem": skfem_scheme.simulate, "scipy": scipy_code}
reference = cache(lambda code, *case: CODES[code](*case))
ours = cache(core)


def lines(code: str, reading: str, theta_F: float, coupling: str) -> list[Check]:
    """Every number of the core against the code's, one line each."""
    case = reading, theta_F, N, STEPS, coupling
    return compare(f"{code}/{reading}, theta_F = {theta_F:g}, {coupling}", reference(code, *case), ours(*case))


def compare(case: str, expected: Numbers, observed: Numbers) -> list[Check]:
    force = float(np.hypot(expected["traction_x"], expected["traction_y"]))
    scales = dict.fromkeys(("traction_x", "traction_y"), force)
    return [
        near(
            f"{case}/{name}",
            "the core and an independent code solve the same scheme",
            "independent code",
            value,
            observed[name],
            TOLERANCE,
            scales.get(name),
        )
        for name, value in expected.items()
    ]


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize(("reading", "theta_F", "coupling"), CASES)
def test_case(code: str, reading: str, theta_F: float, coupling: str) -> None:
    found = lines(code, reading, theta_F, coupling)
    assert len(found) == 6
    wrong = [line for line in found if not line.passed]
    assert not wrong, "\n".join(f"{x.case}: {x.observed!r}, expected {x.expected!r}" for x in wrong)


@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
@pytest.mark.parametrize(("body", "mu"), [((0.0, -20.0), 0.2), ((6.0, -20.0), 0.5), ((-20.0, -8.0), 0.0)])
def test_pressed_to_the_corners(coupling: str, body: tuple[float, float], mu: float) -> None:
    """The paper's forces leave the corners of the square open: heavier ones close them, stick and slip both ways."""
    case = "mixed", 10.0, 8, 8, coupling
    found = compare(
        f"scikit-fem/body {body}, mu = {mu:g}, {coupling}",
        skfem_scheme.simulate(*case, body=body, mu=mu),
        core(*case, **{"loads.body": list(body), "contact.friction.coefficient": mu}),
    )
    assert not [line for line in found if not line.passed]


def test_the_cases_differ() -> None:
    """Otherwise the comparison above would compare little."""
    ends = {tuple(round(x, 9) for x in reference("scikit-fem", r, f, N, STEPS, c).values()) for r, f, c in CASES}
    assert len(ends) == len(CASES)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("contact.friction.coefficient", 0.202),
        ("contact.stiffness", 1.01e4),
        ("contact.gap", 1e-6),
        ("contact.quadrature", "gauss-2"),
        ("contact.heat_exchange.conductance", 1.01),
        ("heat.source", 1.01),
        ("heat.conductivity", [[1.01, 0.0], [0.0, 1.0]]),
        ("heat.expansion.tensor", [[1.0, 0.99], [0.99, 1.0]]),
        ("heat.heating.tensor", [[1.0, 0.99], [0.99, 1.0]]),
        ("elasticity.young", 2.02),
        ("elasticity.poisson", 0.101),
        ("viscosity.lame", [10.1, 5.0]),
        ("inertia.density", 1.01),
        ("loads.body", [0.0, -1.01]),
        ("loads.traction.right", [-0.8, 0.404]),
        ("mesh.diagonal", "left"),
        ("time.end", 1.01),
    ],
)
def test_every_constant_matters(key: str, value: object) -> None:
    """One constant of the core off by one part in a hundred, and no code agrees with it."""
    case = "mixed", 10.0, 8, 8, "staggered"
    wrong = core(*case, **{key: value})
    for code in CODES:
        assert not all(line.passed for line in compare(key, reference(code, *case), wrong))
