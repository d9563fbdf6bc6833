"""The figure of what accuracy costs: what its caption says is what the table says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from warmslip import figures
from warmslip.figures.trade import ERRORS, LOOKS, ORDINARY, OTHERS
from warmslip.records import tables
from warmslip.studies import tradeoff
from warmslip.studies.tradeoff import METHODS


def row(method: str, n: int, error: float, seconds: float) -> dict[str, Any]:
    cost = {"cpu_seconds": seconds, "factor_bytes": 8 * n**2, "work": n**3, "cells": n**2, "steps": n}
    return (
        {"method": method, "n": n, "outcome": "completed", "setting": f"run {n}"} | cost | dict.fromkeys(ERRORS, error)
    )


ROWS = [
    row("equal steps", 8, 0.2, 0.1),
    row("equal steps", 16, 0.1, 1.0),
    row("adaptive steps", 8, 0.05, 0.2),
    row(ORDINARY, 8, 0.2, 4.0),
    row(ORDINARY, 16, 0.1, 40.0),
    row("reference, half", 32, 0.01, 5.0),
]


def drawn(tmp_path: Path, rows: list[dict[str, Any]]) -> str:
    table, out = tmp_path / "trade_some_case.csv", tmp_path / "trade.png"
    tables.write(table, rows)
    figures.draw("trade", [table], out)
    assert out.stat().st_size > 10_000
    return out.with_suffix(".rst").read_text()


def test_the_caption_has_the_gains(tmp_path: Path) -> None:
    text = " ".join(drawn(tmp_path, ROWS).split())
    assert (
        "some case: the error 0.1 of equal steps with n = 16 (1 s) is had by adaptive steps with n = 8 in 0.2 s" in text
    )
    assert "5 times quicker" in text
    assert "ordinary Newton takes 40 s, 200 times as long" in text


@pytest.mark.parametrize("left_out", [ORDINARY, "reference, half"])
def test_curves_may_be_absent(tmp_path: Path, left_out: str) -> None:
    text = drawn(tmp_path, [one for one in ROWS if one["method"] != left_out])
    assert ("ordinary Newton" in text) == (left_out != ORDINARY)


def test_a_caption_claims_no_gain_where_there_is_none(tmp_path: Path) -> None:
    text = " ".join(drawn(tmp_path, [one for one in ROWS if one["method"] != "adaptive steps"]).split())
    assert "with n = 16 (1 s) is had by nothing else that is quicker" in text
    assert "ordinary Newton takes 40 s, 40 times as long" in text


def test_runs_that_stop_are_said(tmp_path: Path) -> None:
    failed = row("adaptive steps", 16, float("nan"), float("nan")) | {"outcome": "contact_not_converged in step 3"}
    assert "No answer: adaptive steps with n = 16 (contact_not_converged in step 3)." in " ".join(
        drawn(tmp_path, [*ROWS, failed]).split()
    )


def test_the_front_errs_less_than_all_that_is_cheaper() -> None:
    worse = row("graded steps", 8, 0.06, 0.3)
    found = tradeoff.front("some_case", [*ROWS, worse], "e_sum")
    assert [(one["method"], one["n"]) for one in found] == [("equal steps", 8), ("adaptive steps", 8)]
    assert found[0]["gain"] == 1.0 and found[1]["gain"] != found[1]["gain"]  # no equal steps err less than 0.05
    assert found[1]["error"] == 0.05 and found[1]["setting"] == "run 8"


def test_the_fronts_are_drawn(tmp_path: Path) -> None:
    table, fronts = tmp_path / "trade_some_case.csv", tmp_path / "front.csv"
    tables.write(table, ROWS)
    tables.write(fronts, tradeoff.front("some_case", ROWS, "e_sum"))
    figures.draw("front", [fronts, table], tmp_path / "front.png")
    assert (tmp_path / "front.png").stat().st_size > 10_000


def test_every_method_has_its_look() -> None:
    assert set(LOOKS) == {*METHODS, *OTHERS}
