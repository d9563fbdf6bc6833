"""The core against the exact solution of its own scheme on meshes of one to eight cells, every field of every step."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from reference.exact_cases import CASES, COUPLINGS, CYCLES, SEVERAL, SOLID, Case
from reference.exact_numbers import floats, zeros
from reference.exact_scheme import DIGITS, OPEN, SLIP, STICK, Scheme, State

from warmslip.records.check import Check, below
from warmslip.simulation.simulation import Simulation

ROUND_OFF = 1e-12  # relative to the largest entry of each field


def relative(observed: Any, expected: Any) -> float:
    """The largest difference over the largest entry expected."""
    observed, expected = np.asarray(observed), floats(expected)
    return float(np.abs(observed - expected).max() / (np.abs(expected).max() or 1.0))


def order(simulation: Simulation, scheme: Scheme) -> list[int]:
    """The core's number of each contact point of the scheme."""
    surface = simulation.discretisation.surface
    ours = np.hstack([surface.positions, surface.normals])
    theirs = floats([[*p.position, *p.normal] for p in scheme.points])
    return [int(np.abs(ours - x).sum(axis=1).argmin()) for x in theirs]


def lines(case: str, scheme: Scheme, simulation: Simulation, state: State) -> list[Check]:
    """The core's state against the exact one. Forces by node: Gauss points in stick may share one in many ways."""
    at, d = order(simulation, scheme), simulation.discretisation
    force = np.asarray(simulation.stepper.contact_force).reshape(-1, scheme.d)[at]
    normals, shapes = floats([p.normal for p in scheme.points]), floats([p.shape for p in scheme.points])
    normal = np.array([x @ p.normal for x, p in zip(state.force, scheme.points, strict=True)])
    nodal = np.array([p.shape for p in scheme.points]).T @ state.force
    observed = {
        name: relative(d.field(getattr(simulation.stepper, name)), getattr(state, name)) for name in ("u", "w", "theta")
    }
    observed["nodal contact force"] = relative(shapes.T @ force, nodal)
    observed["pressure"] = relative((force * normals).sum(axis=1), normal)
    return [
        below(f"exact/{case}/{name}", "the core solves its own scheme", "independent code", size, ROUND_OFF)
        for name, size in observed.items()
    ]


def advance(name: str, case: Case) -> tuple[list[Check], list[str]]:
    """Both codes side by side: the lines of all steps and the stages of the core's contact solver."""
    scheme, simulation, found, stages = case.scheme, case.run(), [], []
    reports = (report for _, report in simulation.steps())
    for n, state in enumerate(case.states[1:], 1):
        assert state.solutions == 1, f"{name}: {state.solutions} solutions in step {n}"
        report = next(reports, None)
        assert report is not None, (
            f"{name}: the core ended {simulation.outcome} in step {n}, the answer is {state.status}"
        )
        found += lines(f"{name}/step {n}", scheme, simulation, state)
        if case.scene().contact.quadrature == "nodal":
            assert [simulation.stepper.status[i] for i in order(simulation, scheme)] == list(state.status), name
        stages.append(report.stage.name)
    return found, stages


def check(found: list[Check]) -> None:
    wrong = [line for line in found if not line.passed]
    assert not wrong, "\n".join(f"{line.case}: {line.observed:.2g}" for line in wrong)


@pytest.mark.parametrize("name", CASES)
def test_core_returns_the_exact_answer(name: str) -> None:
    found, _ = advance(name, CASES[name])
    check(found)


def test_the_cases_meet_every_status() -> None:
    """Otherwise the comparison above would compare little: all statuses, both directions of slip, and changes of status."""
    statuses, slips, changes = set(), set(), 0
    for name, case in CASES.items():
        if case.scheme.d == 3 or "gauss" in name:
            continue
        states = case.states[1:]
        changes += sum(a.status != b.status for a, b in itertools.pairwise(states))
        for state in states:
            statuses |= set(state.status)
            for point, frame, status in zip(case.scheme.points, case.scheme.frames, state.status, strict=True):
                slips |= {frame[1] @ (point.shape @ state.w) > 0} if status == SLIP else set()
    assert statuses == {OPEN, STICK, SLIP}
    assert slips == {True, False}
    assert changes >= 5


def directions(scheme: Scheme) -> Iterator[Any]:
    """Unit velocities of either sign of all unknowns that are not held."""
    for a, c, sign in itertools.product(range(scheme.N), range(scheme.d), (1, -1)):
        if a not in scheme.prescribed_displacement:
            v = zeros(scheme.N, scheme.d)
            v[a, c] = Fraction(sign)
            yield v


@pytest.mark.parametrize(
    "name", ["squares, lagged, nodal", "square, monolithic, gauss-2", "wedge, staggered, nodal", "tetrahedron, stuck"]
)
def test_the_exact_answer_obeys_the_inequality(name: str) -> None:
    """The inequality of (PF) itself, without multipliers or statuses, near w_n and far away; another w_n violates it."""
    scheme, states = CASES[name].scheme, CASES[name].states
    ways = list(directions(scheme))
    for old, new in itertools.pairwise(states):
        assert min(scheme.inequality(old, new, [new.w + v / n for v in ways for n in (1, 10**9)] + ways)) >= 0
        for v in ways[:4]:
            w = new.w + v / 10**6
            wrong = replace(new, w=w, u=old.u + scheme.k * w)
            assert min(scheme.inequality(old, wrong, [w + d / 10**9 for d in ways])) < 0


@pytest.mark.parametrize("name", CYCLES)
def test_where_newton_once_cycled_it_finds_the_only_answer(name: str) -> None:
    """With the threshold of the pressure in place of that of the unknown force, Newton's method cycled here."""
    found, stages = advance(name, CYCLES[name])
    check(found)
    assert set(stages) <= {"none", "newton"}


@pytest.mark.parametrize("name", SEVERAL)
def test_of_several_solutions_the_core_returns_one(name: str) -> None:
    """Coulomb friction with a large coefficient is not unique; then the core's answer is one of the exact ones."""
    count, case = SEVERAL[name]
    scheme, simulation = case.scheme, case.run()
    states = scheme.step(scheme.start())
    next(simulation.steps())
    assert len(states) == count
    hits = [state for state in states if all(line.passed for line in lines(name, scheme, simulation, state))]
    assert len(hits) == 1


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_slip_in_any_direction(coupling: str) -> None:
    """Six tetrahedra; the core's statuses, verified: the law and the inequality hold for the answer in 60 digits."""
    case = Case(1, SOLID | {"time.coupling": coupling, "time.steps": 3}, "block_3d")
    scheme, simulation = case.scheme, case.run()
    old, statuses = scheme.start(), set()
    for _ in simulation.steps():
        at = order(simulation, scheme)
        status = [simulation.stepper.status[i] for i in at]
        guess = np.asarray(simulation.stepper.contact_force).reshape(-1, 3)[at]
        new = scheme.polish(old, status, guess)
        check(lines(f"cube, {coupling}", scheme, simulation, new))
        assert min(scheme.inequality(old, new, [new.w + v for v in directions(scheme)])) >= -(10.0 ** (20 - DIGITS))
        slips = [x for x, s in zip(floats(new.force), status, strict=True) if s == SLIP]
        assert all(abs(x[0] * x[1]) > 1e-4 * x[2] ** 2 for x in slips)  # along no axis
        statuses |= set(status)
        old = new
    assert simulation.outcome == "completed"
    assert statuses >= {STICK, SLIP}


@pytest.mark.parametrize("stiffness", [1e3, 1e4, 1e5, 1e6, 1e8, 1e12])
def test_stiffer_than_doubles_resolve(stiffness: float) -> None:
    """Stick under a large step: digits are lost as w = z - W lam cancels. The core's answer is right to what is left; the
    scheme's own answer exists and is unique for every stiffness."""
    keys = {
        "time.end": 32.0,
        "time.steps": 2,
        "supports.temperature": ["top"],
        "contact.stiffness": stiffness,
        "contact.friction.coefficient": 2.0,
        "contact.heat_exchange.foundation_temperature": 10.0,
        "loads.body": [0.0, -4.0],
    }
    case = Case(1, keys, "paper_mixed")
    scheme, simulation = case.scheme, case.run()
    (state,) = scheme.step(scheme.start())
    lost = 1 + max(
        float(p.weight * scheme.c_nu * scheme.k * scheme.W[2 * q, 2 * q]) for q, p in enumerate(scheme.points)
    )
    assert next(simulation.steps(), None)
    assert all(
        line.observed <= ROUND_OFF + 8 * np.finfo(float).eps * lost for line in lines("", scheme, simulation, state)
    )


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("time.end", 0.505),
        ("time.coupling", "lagged"),
        ("time.coupling", "monolithic"),
        ("inertia.density", 1.515),
        ("elasticity.lame", [3.03, 1.25]),
        ("elasticity.lame", [3.0, 1.2625]),
        ("viscosity.lame", [0.505, 0.75]),
        ("viscosity.lame", [0.5, 0.7575]),
        ("heat.conductivity", [[1.5, 0.2525], [0.2525, 0.75]]),
        ("heat.expansion.tensor", [[0.5, 0.2525], [0.2525, 1.0]]),
        ("heat.heating.tensor", [[1.01, -0.5], [-0.5, 0.25]]),
        ("heat.source", 2.02),
        ("loads.body", [1.515, -3.0]),
        ("loads.traction.left", [1.25, 0.505]),
        ("contact.stiffness", 202.0),
        ("contact.gap", 0.0101),
        ("contact.friction.coefficient", 0.303),
        ("contact.heat_exchange.conductance", 0.7575),
        ("contact.heat_exchange.foundation_temperature", -4.04),
        ("initial.displacement", [0.0505, -0.02]),
        ("initial.velocity", [-0.25, -0.505]),
        ("initial.temperature", 1.515),
    ],
)
def test_every_constant_matters(key: str, value: Any) -> None:
    """One constant of the core off by one part in a hundred, or another scheme, and it is told from the exact answer."""
    case = CASES["squares, staggered, nodal"]
    simulation = case.run(**{key: value})
    found = [
        lines(key, case.scheme, simulation, state) for _, state in zip(simulation.steps(), case.states[1:], strict=True)
    ]
    assert max(line.observed for step in found for line in step) > 1e-6
