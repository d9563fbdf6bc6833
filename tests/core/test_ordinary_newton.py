"""The curves of other codes: they have the discrete solution of the core, or there is no point."""

from __future__ import annotations

from typing import Any

import pytest
from campaign import ordinary_newton
from reference import skfem_scheme

from warmslip.figures.trade import FACTORED
from warmslip.studies.tradeoff import CONTESTS


def like(n: int) -> dict[str, Any]:
    return {"method": "equal steps", "n": n, "e_sum": 0.25, "cpu_seconds": 0.1, "from_ours": 0.0}


@pytest.mark.parametrize("contest", ["paper_hot", "paper_cold"])
def test_its_answer_is_ours(contest: str) -> None:
    point = ordinary_newton.point(contest, like(8))
    assert point["from_ours"] < ordinary_newton.SAME
    assert point["e_sum"] == 0.25 and point["cpu_seconds"] != 0.1
    steps = CONTESTS[contest].at("equal steps", 8).time.steps
    assert point["factorizations"] > steps  # one an iteration, and that of the heat


def test_scipy_has_the_same_answer_with_two_factors() -> None:
    point = ordinary_newton.point("paper_hot", like(8), FACTORED)
    assert point["from_ours"] < ordinary_newton.SAME and point["factorizations"] == 2
    assert point["e_sum"] == 0.25 and point["cpu_seconds"] != 0.1


def test_another_answer_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(skfem_scheme, "MU_TAU", 1.01 * skfem_scheme.MU_TAU)
    with pytest.raises(RuntimeError, match="the two codes differ by"):
        ordinary_newton.point("paper_hot", like(8))
