"""Figures and tables of studies with any name: panels by problem, ticks apart, only the fields that there are."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

import warmslip
from warmslip.figures import convergence, draw, style, tradeoff
from warmslip.records import tables
from warmslip.studies import work_precision

COUNTS = ("factor_bytes", "substitutions", "factorizations", "dense_factorizations", "newton_iterations")


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    plt.close("all")


def stored(path: Path, scene: str = "paper_mixed", seconds: float = 1.0, **keys: Any) -> Path:
    """The table of a study of a scene, with its stamp."""
    built = warmslip.load(scene).override(**{key.replace("__", "."): value for key, value in keys.items()})
    rows = [
        {"n": n, "steps": n, "e_u_w_theta": 1 / n, "cpu_seconds": seconds * n} | dict.fromkeys(COUNTS, 0)
        for n in (8, 16, 32, 64)
    ]
    tables.write(path, rows, {"scene": built.resolved()})
    return path


def test_problems_are_those_of_the_stamps_and_methods_share_a_panel(tmp_path: Path) -> None:
    paths = [
        stored(tmp_path / "my_fine_study.csv"),
        stored(tmp_path / "my_fine_study_lagged.csv", seconds=2.0, time__coupling="lagged", mesh__n=8, time__steps=3),
        stored(tmp_path / "my_fine_other.csv", seconds=3.0, contact__friction__coefficient=0.1),
        stored(tmp_path / "my_fine_gauss.csv", seconds=4.0, contact__quadrature="gauss-2"),
        stored(tmp_path / "push.csv", "quasistatic_punch"),
    ]
    rows = work_precision.table(paths)
    problems = {row["case"]: row["problem"] for row in rows}
    assert list(problems.values()) == ["my_fine_study", "my_fine_study", "my_fine_other", "my_fine_study", "push"]
    methods = {row["case"]: (row["coupling"], row["quadrature"]) for row in rows}
    assert methods["my_fine_study_lagged"] == ("lagged", "nodal")
    assert methods["my_fine_gauss"] == ("staggered", "gauss-2")
    fronts = {row["case"] for row in rows if row["front"]}
    assert fronts == {"my_fine_study", "my_fine_other", "push"}  # each problem has its own
    tables.write(tmp_path / "work.csv", rows)
    figure, caption = tradeoff.work([tmp_path / "work.csv"])
    shown = [ax.get_title() for ax in figure.axes if ax.axison]
    assert shown == ["my_fine_study", "my_fine_other", "push"]
    assert "theta_F" not in caption and "push: the front ends at error 0.0312 in 32 s (staggered, n = 32" in caption


def test_a_table_without_its_stamp_is_refused(tmp_path: Path) -> None:
    stored(tmp_path / "mine.csv").with_suffix(".json").unlink()
    with pytest.raises(ValueError, match=r"mine\.csv' is no table of `warmslip study` with its stamp beside it"):
        work_precision.table([tmp_path / "mine.csv"])


def orders(path: Path, cases: dict[str, list[int]], *, theta: bool = True, expected: float = math.nan) -> Path:
    """A table of rates with levels by case."""
    rows = [
        {"case": case, "term": term, "h": 1 / n, "error": 1.0, "observed": p, "corrected": p, "expected": expected}
        for case, levels in cases.items()
        for term in ("u_V", "w_L2", "theta_L2")
        for i, n in enumerate(levels)
        for p in [math.nan if i == 0 or (term == "theta_L2" and not theta) else 0.9]
    ]
    tables.write(path, rows)
    return path


def test_orders_of_any_study_with_ticks_apart(tmp_path: Path) -> None:
    """Of studies with many levels the ticks are thinned; those of a study that is not drawn do not count."""
    rates = orders(tmp_path / "rates.csv", {"push": [16, 18, 20, 22, 32], "other": [3, 5, 7]}, theta=False)
    figure, caption = convergence.corrected([rates, tmp_path / "push.csv"])
    (ax,) = figure.axes
    places = list(ax.xaxis.get_major_locator()())
    assert places == pytest.approx([1 / 18, 1 / 32]) and ax.xaxis.get_minor_locator()() == []
    assert ax.get_title() == "push" and "theta" not in caption and "nan" not in caption
    (legend,) = figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert style.TERMS["theta_L2"][0] not in names and "expected" not in names


def test_orders_of_the_papers_studies_keep_their_words(tmp_path: Path) -> None:
    rates = orders(tmp_path / "rates.csv", {"mixed_0_staggered": [16, 32, 64]}, expected=0.69)
    figure, caption = convergence.corrected([rates, tmp_path / "mixed_0_staggered.csv"])
    assert caption.startswith("Reading 'mixed': orders between successive h = k")
    assert "observed / corrected / expected: u_V 0.90 / 0.90 / 0.69" in caption
    assert figure.axes[0].get_title() == r"$\theta_F = 0$"


def test_a_study_that_the_rates_do_not_know_is_named(tmp_path: Path) -> None:
    rates = orders(tmp_path / "rates.csv", {"push": [16, 32, 64]})
    for inputs, words in (
        ([rates, tmp_path / "pull.csv"], "the rates speak of push, and not of pull"),
        ([rates], "no study is named"),
    ):
        with pytest.raises(ValueError, match=words):
            draw("corrected", inputs, tmp_path / "figure.png")


def test_a_table_in_a_terminal() -> None:
    rows = [
        {"n": 16, "error": 0.0123456, "e_theta": math.nan, "front": True, "left": "out"},
        {"n": 128, "error": math.nan, "e_theta": math.nan, "front": False, "left": "out"},
    ]
    assert tables.aligned(rows, ("n", "error", "e_theta", "front")).splitlines() == [
        "  n    error  front",
        " 16  0.01235    yes",
        "128        -     no",
    ]
