"""Lines and their report: bands, nan, failures, refusals, and the command that writes them."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from warmslip.records import check
from warmslip.records.check import Check
from warmslip.verification import report, suite

COLUMNS = "fault,file,what,outcome,by,commit,key"
CONTROL = "control,a.cpp,a comment,survived,nothing may notice"


def one(observed: float = 1.0) -> Check:
    return check.near("a | case", "the answer is one", "analytic", 1.0, observed, 1e-3)


@pytest.mark.parametrize(("observed", "passed"), [(1.0, True), (1.0009, True), (1.0011, False), (float("nan"), False)])
def test_bands_have_two_sides(observed: float, passed: bool) -> None:
    assert one(observed).passed is passed
    assert one(2 - observed).passed is passed


def test_below_and_order() -> None:
    assert check.below("c", "p", "identity", 0.0, 1e-11).passed
    assert not check.below("c", "p", "identity", -1e-3, 1e-11).passed
    assert check.near("c", "p", "analytic", 0.0, 0.9, 0.1, scale=10.0).passed
    assert not check.near("c", "p", "analytic", 0.0, 1.1, 0.1, scale=10.0).passed
    assert not check.below("c", "p", "identity", 1e-10, 1e-11).passed
    assert check.order("c", "p", "theory", 1.0, 0.89).passed
    assert not check.order("c", "p", "theory", 1.0, 0.87).passed
    assert not check.order("c", "p", "theory", 1.0, float("nan")).passed


def test_the_report_counts_and_shows_failures(tmp_path: Path) -> None:
    assert check.write(tmp_path / "good.csv", [one()], {"title": "What is good"})
    assert not check.write(tmp_path / "bad.csv", [one(), one(2.0)], {"title": "What is not"})
    text, passed = report.markdown([tmp_path / "good.csv", tmp_path / "bad.csv"], [])
    assert not passed
    assert "**2 of 3 lines pass.**" in text
    assert text.count("**FAIL**") == 1
    assert "a \\| case" in text
    assert "What is good" in text
    with (tmp_path / "bad.csv").open() as file:
        assert [row["verdict"] for row in csv.DictReader(file)] == ["pass", "FAIL"]


def test_a_topic_without_lines_proves_nothing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="proves nothing"):
        check.write(tmp_path / "none.csv", [], {})
    (tmp_path / "none.json").write_text('{"title": "Nothing"}')
    (tmp_path / "none.csv").write_text("case,proves,origin,expected,observed,low,high,verdict\n")
    with pytest.raises(ValueError, match="proves nothing"):
        report.markdown([tmp_path / "none.csv"], [])


def test_every_topic_says_what_it_is() -> None:
    assert all(run.__doc__ for run in suite.TOPICS.values())


def test_audits_and_faults_are_told(tmp_path: Path) -> None:
    check.write(tmp_path / "good.csv", [one()], {"title": "What is good"})
    for name, holds, value in (("soft", "no", "0"), ("stiff", "yes", "12.345678")):
        (tmp_path / f"audit_{name}.csv").write_text(
            f"topic,statement,values,holds,meaning\n(H1),m > 0,m_b = {value}; M_b = inf,{holds},so it is\n"
        )
    (tmp_path / "mutants.csv").write_text(
        f"{COLUMNS}\n"
        "sign,a.cpp,wrong sign,killed,unit/test_run.py::test_signs[x],abc,1\n"
        "slow,a.cpp,a slower path,survived,the same answer,abc,2\n"
        "new,a.cpp,nobody knows,survived,,abc,3\n"
    )
    audits = [tmp_path / "audit_soft.csv", tmp_path / "audit_stiff.csv"]
    text, passed = report.markdown([tmp_path / "good.csv"], [], audits, tmp_path / "mutants.csv")
    assert not passed  # a fault survives and nobody knows why
    assert "| (H1) | m > 0 | **no** m_b = 0, M_b = inf | **yes** m_b = 12.35, M_b = inf |" in text
    assert "**1 of 3 killed (33.3 %)**" in text
    assert "| unit/test_run.py | 1 |" in text
    assert "| slow | a slower path | the same answer |" in text
    assert "| new | nobody knows | **unexplained** |" in text


def killed(names: list[str], more: list[str]) -> str:
    lines = [f"{name},a.cpp,wrong,killed,unit/test_run.py::test_signs,abc,1" for name in names]
    return "\n".join([COLUMNS, *lines, *(f"{line},abc,1" for line in more)]) + "\n"


@pytest.mark.parametrize(
    ("count", "more", "good", "words"),
    [
        (80, [CONTROL, "slow,a.cpp,slower,survived,the same answer"], True, "**80 of 81 killed (98.8 %)**"),
        (80, [CONTROL], True, "**80 of 80 killed (100.0 %)**"),
        (79, [CONTROL], False, "**79 of 79 killed (100.0 %)**"),
        (80, [], False, "the score means nothing"),
        (80, ["control,a.cpp,a comment,killed,unit/test_a.py::test_b"], False, "the score means nothing"),
        (80, [CONTROL, "broken,a.cpp,no syntax,invalid,error: expected"], False, "**invalid**: error: expected"),
        (80, [CONTROL, "later,a.cpp,a sign,untried,"], False, "1 not tried yet"),
    ],
)
def test_the_score_of_the_faults(tmp_path: Path, count: int, more: list[str], good: bool, words: str) -> None:
    (tmp_path / "mutants.csv").write_text(killed([f"f{i}" for i in range(count)], more))
    text, explained = report.faults(tmp_path / "mutants.csv")
    assert explained is good
    assert words in "".join(text)
    assert "none tried" in "".join(report.faults(_nothing(tmp_path))[0])


def _nothing(folder: Path) -> Path:
    (folder / "none.csv").write_text(f"{COLUMNS}\n")
    return folder / "none.csv"
