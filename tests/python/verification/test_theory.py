"""The paper's two theorems at work, on small grids: fixed point (section 3), error bound (section 4), and mutants."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import gammaln

from warmslip.records.check import Check
from warmslip.verification.theory import error_bound, existence, fixed_point

LEVELS = (8, 16, 32)
COARSE = (8, 12, 16)  # for mutants: enough, see `sound`
N, STEPS = 6, 8


def red(lines: list[Check]) -> list[str]:
    return [f"{x.case}: {x.observed} not in [{x.low}, {x.high}]" for x in lines if not x.passed]


def red_names(lines: list[Check]) -> set[str]:
    return {x.case.split(", ")[-1] for x in lines if not x.passed}


@pytest.mark.parametrize("hot", [0.0, 10.0])
@pytest.mark.parametrize("reading", existence.READINGS)
def test_fixed_point_is_the_monolithic_solution(reading: str, hot: float) -> None:
    assert red([existence.fixed_point(reading, hot, n=N, steps=STEPS)]) == []


@pytest.mark.parametrize("reading", ["printed", "isotropic"])
def test_factors_fall_like_the_factorial(reading: str) -> None:
    assert red(existence.factorial(reading, n=N)) == []


def test_long_times_grow_first() -> None:
    assert red(existence.transient(n=4, steps=32)) == []


@pytest.mark.parametrize("coupling", ["staggered", "lagged"])
def test_a_term_from_the_step_before_makes_lambda_nilpotent(coupling: str) -> None:
    assert red(existence.nilpotent(coupling, n=N)) == []


def test_printed_sign_is_that_of_another_problem() -> None:
    assert red(existence.printed_sign(n=N)) == []


def test_table_is_bounded_and_the_bound_is_touched() -> None:
    run = fixed_point.iterate(existence.setting("mixed", n=4, steps=32, end=0.05, factor=existence.STRONG))
    rows = list(existence.table(run, existence.fitted(run)))
    ratios = [row["difference"] / row["bound"] for row in rows[1:]]
    assert len(rows) > 8
    assert max(ratios) == pytest.approx(1, rel=1e-12)


@pytest.mark.parametrize(
    "mutant",
    [
        {"heat.expansion.tensor": [[1.01, 0.0], [0.0, 1.0]]},
        {"heat.heating.tensor": [[1.0, 0.01], [0.01, 1.0]]},
        {"contact.friction.coefficient": 0.202},
        {"contact.heat_exchange.conductance": 1.01},
        {"time.coupling": "staggered"},
        {"time.coupling": "lagged"},
    ],
    ids=str,
)
def test_wrong_fixed_points_are_told_apart(mutant: dict[str, Any]) -> None:
    scene = existence.setting("isotropic", n=N, steps=STEPS, hot=10.0)
    run = fixed_point.iterate(scene.override(**mutant))
    assert existence.missed(run, fixed_point.solution(scene)) > 1e3 * existence.SAME


@pytest.mark.parametrize("power", [0.0, 0.5, 2.0])
def test_other_declines_turn_it_red(power: float) -> None:
    """(cT)^m/m!^power instead of the factorial: a geometric one, the root that squares would give, a faster one."""
    scene = existence.setting("isotropic", n=1, steps=10**6)
    m = np.arange(14)
    pairs = np.exp(m * np.log(0.2) - power * gammaln(m + 2))
    fields = fixed_point.Fields(np.zeros((1, 1, 2)), np.zeros((1, 1)))
    run = fixed_point.Iteration(scene, np.repeat(pairs, 2).tolist(), fields, fields)
    assert existence.decline(run) == pytest.approx(-power, abs=0.01)


def test_error_stays_below_the_bound_of_the_paper() -> None:
    lines = error_bound.lines("lagged", LEVELS)
    assert len(lines) == len(error_bound.ORDERS) + 8
    assert red(lines) == []


@pytest.mark.parametrize("coupling", ["staggered", "monolithic"])
def test_other_couplings_keep_it(coupling: str) -> None:
    names = {"share", "order of share", "motion_share", "order of motion_share"}
    assert names.isdisjoint(red_names(error_bound.lines(coupling, COARSE)))


def test_heat_in_space_and_lag_in_time_rule_the_bound() -> None:
    (row,) = error_bound.measure("lagged", [16])
    assert row["dominant"] == "theta_lag"
    assert row["theta_space"] == max(row[name] for name in error_bound.ORDERS if name not in ("theta_lag", "heat_rate"))
    # most of the error is one that no scheme on this mesh avoids: the interpolation of theta
    assert 0.9 < row["theta_space"] / row["error"] < 1


def test_two_grids_are_refused() -> None:
    with pytest.raises(ValueError, match="at least three"):
        error_bound.lines(levels=(8, 16))


@pytest.fixture(name="sound", scope="module")
def _sound() -> None:
    """On the grids of the mutants all is green without one, but for the sum that leaves out the first, long, step."""
    assert red_names(error_bound.lines("lagged", COARSE)) == {"order of theta_change"}


@pytest.mark.usefixtures("sound")
@pytest.mark.parametrize(
    ("key", "value", "caught"),
    [
        ("contact.friction.coefficient", 0.22, "order of motion_share"),
        ("elasticity.young", 2.5, "order of motion_share"),
        ("viscosity.lame", [10.0, 5.5], "order of motion_share"),
        ("heat.expansion.tensor", [[-1.0, 0.0], [0.0, -1.0]], "order of motion_share"),
        ("heat.conductivity", [[1.0, 0.3], [0.3, 1.0]], "order of share"),
        ("contact.heat_exchange.conductance", 2.0, "order of share"),
    ],
)
def test_a_run_with_wrong_data_leaves_the_bound(key: str, value: Any, caught: str) -> None:
    scene = error_bound.known()[0].override(**{key: value})
    assert caught in red_names(error_bound.lines("lagged", COARSE, scene))


@pytest.mark.usefixtures("sound")
@pytest.mark.parametrize(
    ("name", "factor", "caught"),
    [
        ("stress", 1.0001, "residual_gap"),
        ("w", 1.0001, "quadrature"),
        ("theta", 1.0001, "quadrature"),
        ("w_rate", 1.1, "order of inertia"),
        ("theta_rate", 1.3, "order of heat_rate"),
        ("w_x", 1.1, "order of w_space"),
        ("theta_x", 1.1, "order of theta_space"),
        ("u_x", 1.1, "order of start_u"),
    ],
)
def test_a_wrong_field_turns_it_red(monkeypatch: pytest.MonkeyPatch, name: str, factor: float, caught: str) -> None:
    scene, solution, exact = error_bound.known()
    wrong = replace(exact, **{name: lambda x, t: factor * getattr(exact, name)(x, t)})
    monkeypatch.setattr(error_bound, "known", lambda: (scene, solution, wrong))
    assert caught in red_names(error_bound.lines("lagged", COARSE))


@pytest.mark.usefixtures("sound")
@pytest.mark.parametrize("name", ["pressure", "bound"])
def test_a_wrong_contact_term_turns_the_residual_red(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    scene, solution, exact = error_bound.known()
    touch = replace(solution.touch, **{name: lambda x, t: 1.01 * getattr(solution.touch, name)(x, t)})
    monkeypatch.setattr(error_bound, "known", lambda: (scene, replace(solution, touch=touch), exact))
    assert "residual_gap" in red_names(error_bound.lines("lagged", COARSE))
