"""The curves of other codes: they have the discrete solution of the core, or there is no point."""

from __future__ import annotations

from typing import Any

import pytest
from campaign import other_codes
from reference import skfem_scheme

from warmslip.figures.trade import FACTORED, OTHERS
from warmslip.studies.tradeoff import CONTESTS


def like(n: int) -> dict[str, Any]:
    return {"method": "equal steps", "n": n, "e_sum": 0.25, "cpu_seconds": 0.1, "from_ours": 0.0}


@pytest.mark.parametrize("method", OTHERS)
@pytest.mark.parametrize("contest", ["paper_hot", "paper_cold"])
def test_its_answer_is_ours(contest: str, method: str) -> None:
    try:
        point = other_codes.point(contest, like(8), method)
    except other_codes.NotInstalledError as why:
        pytest.skip(str(why))
    assert point["from_ours"] < other_codes.SAME
    assert point["e_sum"] == 0.25 and point["cpu_seconds"] != 0.1
    steps = CONTESTS[contest].at("equal steps", 8).time.steps
    if method == FACTORED:
        assert point["factorizations"] == 2
    else:
        assert point["factorizations"] > steps  # one an iteration, and that of the heat


def test_every_code_has_its_curve() -> None:
    assert tuple(other_codes.CODES) == OTHERS


@pytest.mark.parametrize("method", [name for name in OTHERS if name not in ("GetFEM", FACTORED)])
def test_another_answer_is_refused(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    monkeypatch.setattr(skfem_scheme, "MU_TAU", 1.01 * skfem_scheme.MU_TAU)
    with pytest.raises(RuntimeError, match="the two codes differ by"):
        other_codes.point("paper_hot", like(8), method)


def test_an_absent_code_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(other_codes, "_python_of_getfem", other_codes._python_of_getfem.__wrapped__)
    monkeypatch.setattr(other_codes.shutil, "which", lambda *_, **__: None)
    monkeypatch.setattr(other_codes.sys, "executable", "/bin/false")
    with pytest.raises(other_codes.NotInstalledError, match="GetFEM is not installed"):
        other_codes.point("paper_hot", like(8), "GetFEM")
