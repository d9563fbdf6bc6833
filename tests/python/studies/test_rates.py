"""Orders from errors, and what readings and verdict make of tables."""

from __future__ import annotations

import csv
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip.paper import acceptance, readings
from warmslip.records import tables
from warmslip.simulation.statistics import BALANCES
from warmslip.studies import rates, refinement_study
from warmslip.studies.error_norms import SUMS, TERMS

Row = dict[str, Any]
LEVELS, REFERENCE = (16, 32, 64, 128), 1 / 256


def write(path: Path, rows: list[Row]) -> Path:
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    return path


@pytest.mark.parametrize(("p", "display"), [(1.0, (1.10, 1.22, 1.58)), (0.75, (0.90, 1.04, 1.42))])
def test_bias_of_the_self_reference(p: float, display: tuple[float, ...]) -> None:
    """A true order measured against the finest solution shows these values, and is recovered from them."""
    errors = [n**-p - REFERENCE**p for n in LEVELS]
    for n, coarse, fine, expected in zip(LEVELS, errors, errors[1:], display, strict=False):
        assert rates.observed(coarse, fine) == pytest.approx(expected, abs=0.005)
        assert rates.corrected(coarse, fine, 1 / n, REFERENCE, quadratic=False) == pytest.approx(p, abs=1e-9)


@pytest.mark.parametrize("ratio", [2.0, 3.0, 4.0])
def test_bias_of_other_ratios(ratio: float) -> None:
    h, reference = 1 / 4, 1 / 144
    errors = [x - reference for x in (h, h / ratio)]
    assert rates.corrected(*errors, h, reference, quadratic=False, ratio=ratio) == pytest.approx(1.0, abs=1e-9)


def test_bias_in_the_energy_norm() -> None:
    errors = [math.sqrt(n**-1.38 - REFERENCE**1.38) for n in LEVELS]
    for n, coarse, fine in zip(LEVELS, errors, errors[1:], strict=False):
        r = (1 / n) / REFERENCE
        assert rates.observed(coarse, fine) == pytest.approx(
            0.5 * math.log2((r**1.38 - 1) / ((r / 2) ** 1.38 - 1)), rel=1e-12
        )
        assert rates.corrected(coarse, fine, 1 / n, REFERENCE, quadratic=True) == pytest.approx(0.69, abs=1e-9)


def test_orders_that_do_not_exist_are_nan() -> None:
    assert math.isnan(rates.observed(1.0, 0.0))
    assert math.isnan(rates.observed(math.nan, 1.0))
    assert math.isnan(rates.corrected(1.0, 2.0, 1 / 16, REFERENCE, quadratic=False))


def test_least_squares() -> None:
    h = [1 / n for n in LEVELS]
    order, misfit = rates.least_squares(h, [3 * x**1.3 for x in h])
    assert (order, misfit) == (pytest.approx(1.3, abs=1e-12), pytest.approx(0, abs=1e-12))
    _, bent = rates.least_squares(h, [x * (1 + 0.3 * (i % 2)) for i, x in enumerate(h)])
    assert bent > 0.05


def test_williams_exponents_of_the_paper() -> None:
    young, poisson = 2, 0.1
    lam, mu = young * poisson / (1 - poisson**2), young / (2 * (1 + poisson))
    assert rates.williams_exponent(10, 5) == pytest.approx(0.690, abs=1e-3)  # mu_1 tr(e) I + mu_2 e, both 10
    assert rates.williams_exponent(10, 5) == pytest.approx(rates.williams_exponent(20, 10), abs=1e-12)
    assert rates.williams_exponent(lam, mu) == pytest.approx(0.876, abs=1e-3)


def test_entitled_orders() -> None:
    free = dict(hot=False, singular_conductivity=False, viscosity=(10.0, 5.0))
    assert rates.expected_order("theta_L2", **free) == 1.0
    assert rates.expected_order("theta_L2", **free | {"hot": True}) == 0.75
    assert rates.expected_order("theta_L2", **free | {"singular_conductivity": True}) == 0.5
    both = free | {"hot": True, "singular_conductivity": True}
    assert rates.expected_order("theta_L2", **both) == rates.expected_order("u_V", **both) == 0.5
    assert rates.expected_order("w_L2", **free) == 0.75  # tractions that act from t = 0 on a body at rest
    assert (
        rates.expected_order("u_theta", **free) == rates.expected_order("u_V", **free) == rates.williams_exponent(10, 5)
    )


def study_rows(order: float = 1.0, scale: float = 1.5, larger: float = 1.0) -> list[Row]:
    rows = []
    for n in (*LEVELS, 256):
        e = dict.fromkeys([*TERMS, *SUMS], scale * n**-order)
        row = {"n": n, "steps": n, "h": 1 / n, "k": 1 / n, "outcome": "completed"} | {f"e_{t}": v for t, v in e.items()}
        row |= dict.fromkeys(
            ("norm_u_V", "norm_u_L2", "norm_w_L2", "norm_theta_L2", "normal_force", "mises_L2"), larger
        )
        row |= {"safeguarded_steps": 0, "refinements": 9 if n > 64 else 0}
        rows.append(row | {f"residual_{i}": 1e-15 for i in BALANCES})
    return rows


def test_table_of_orders(tmp_path: Path) -> None:
    """Along h = k, in order, against the last row as the reference, whose bias is taken off."""
    scene = warmslip.load("paper_mixed").resolved()
    rows = [r | {f"e_{t}": r["h"] ** 1.0 - 1 / 256 for t in [*TERMS, *SUMS]} for r in study_rows()[:-1]]
    off = rows[0] | {"steps": 32, "e_theta_L2": 99.0}  # not on the diagonal
    found = rates.table(write(tmp_path / "mixed_0_staggered.csv", [off, *reversed(rows), study_rows()[-1]]), scene)
    own = [r for r in found if r["term"] == "theta_L2"]
    assert [r["h"] for r in own] == [1 / n for n in LEVELS]
    assert math.isnan(own[0]["observed"])
    assert [r["observed"] for r in own[1:]] == pytest.approx([1.10, 1.22, 1.58], abs=0.005)
    assert [r["corrected"] for r in own[1:]] == pytest.approx([1.0] * 3, abs=1e-9)
    assert {r["expected"] for r in own} == {1.0}
    assert all(math.isnan(r["corrected"]) for r in found if r["term"] in SUMS)
    few = write(tmp_path / "few_0_staggered.csv", [*rows[:2], study_rows()[-1]])
    with pytest.raises(
        ValueError, match="needs three levels on which h and k shrink together, here are 2; give `warmslip"
    ):
        rates.table(few, scene)


def test_orders_of_a_mesh_file(tmp_path: Path) -> None:
    """Whose levels are pieces of an edge, with as many times the scene's steps."""
    scene = warmslip.load("plate_with_hole").override(**{"time.steps": 2})
    rows = refinement_study.study(scene, levels=[1, 2, 4], reference=8)
    assert [row["steps"] for row in rows] == [2, 4, 8, 16]
    tables.write(tmp_path / "plate.csv", rows, {})
    found = [row for row in rates.table(tmp_path / "plate.csv", scene.resolved()) if row["term"] == "theta_L2"]
    assert [row["h"] for row in found] == [1.0, 0.5, 0.25]
    assert [row["observed"] for row in found[1:]] == [
        rates.observed(coarse["e_theta_L2"], fine["e_theta_L2"]) for coarse, fine in pairwise(rows[:3])
    ]
    assert 0.3 < found[-1]["corrected"] < found[-1]["observed"]


@pytest.mark.parametrize(
    "keys",
    [
        {"initial.temperature": 1.0},
        {"supports.temperature": ["top"]},
        {"loads.traction": {}},
        {"viscosity.lame": [0.0, 0.0]},
        {"inertia.density": 0.0},
        {"initial.velocity": [1.0, 0.0]},
    ],
)
def test_entitled_orders_are_the_papers_alone(tmp_path: Path, keys: Row) -> None:
    """What holds other scenes back is not known here: no number rather than one of another problem."""
    scene = warmslip.load("paper_mixed")
    assert rates.is_paper_problem(scene.override(**{"contact.friction.coefficient": 0.5}))
    assert not rates.is_paper_problem(scene.override(**keys))
    assert not rates.is_paper_problem(warmslip.load("block_3d"))
    path = write(tmp_path / "other_0_staggered.csv", study_rows())
    assert all(math.isnan(r["expected"]) for r in rates.table(path, scene.override(**keys).resolved()))


@pytest.mark.parametrize(
    ("levels", "reference", "sentence"),
    [([16, 32], 32, "not finer than the level 1/32"), ([16, 16], 32, "a size twice"), ([16, 24], 32, "nested")],
)
def test_grids_that_measure_nothing_are_refused(levels: list[int], reference: int, sentence: str) -> None:
    with pytest.raises(warmslip.SceneError, match=sentence):
        refinement_study.members(levels, reference, "diagonal")


def test_readings_judge_the_claims(tmp_path: Path) -> None:
    def case(name: str, **how: float) -> Path:
        return write(tmp_path / f"{name}_staggered.csv", study_rows(**how))

    paths = [
        case("good_0"),
        case("good_10", larger=2),
        case("slow_0", order=0.5),
        case("slow_10", order=0.5, larger=0.5),
    ]
    cold, hot = study_rows(), study_rows(larger=2)
    hot[-1]["norm_theta_L2"] = 0.5 * cold[-1]["norm_theta_L2"]  # three of the four claims hold
    paths += [write(tmp_path / f"torn_{t}_staggered.csv", rows) for t, rows in ((0, cold), (10, hot))]
    paths.append(write(tmp_path / "good_10_lagged.csv", study_rows(larger=0.1)))
    good, slow, torn = readings.table(paths)
    assert (good["reading"], slow["reading"]) == ("good", "slow")
    for temperature in (0, 10):
        assert (good[f"ticks_u_theta_{temperature}"], good[f"linear_u_theta_{temperature}"]) == ("yes", "yes")
        assert (slow[f"ticks_u_theta_{temperature}"], slow[f"linear_u_theta_{temperature}"]) == ("no", "no")
    assert (good["all_larger"], good["stress_ratio"]) == ("yes", 2)
    assert (slow["all_larger"], slow["temperature_larger"]) == ("no", "no")
    assert (torn["all_larger"], torn["deformation_larger"], torn["temperature_larger"]) == ("no", "yes", "no")


def test_verdict_of_a_study(tmp_path: Path) -> None:
    def verdict(rows: list[Row], expected: Row) -> dict[str, Any]:
        path = write(tmp_path / "case.csv", rows)
        return acceptance.verdict(
            studies=[path], manufactured_table=None, readings=None, extremes=None, expected=expected
        )

    stored = acceptance.record(verdict(study_rows(), {}))
    assert stored["case error u_V"] == 1.5 / 128
    assert verdict(study_rows(), stored)["passed"]
    assert not verdict(study_rows(), {})["passed"]  # a value that was never stored fails
    for factor in (0.97, 1.03, math.nan):
        failed = verdict(study_rows(scale=1.5 * factor), stored)["failed"]
        assert {f"case error {t}" for t in [*TERMS, *SUMS]} == set(failed)
    assert verdict(study_rows(scale=1.5 * 1.01), stored)["passed"]

    def spoil(**change: Any) -> list[str]:
        rows = study_rows()
        rows[1] |= change
        return list(verdict(rows, stored)["failed"])

    assert spoil(outcome="contact_not_converged") == ["case runs that were not completed"]
    assert spoil(residual_law=1e-10) == ["case law balance"]
    assert spoil(residual_heat=math.nan) == ["case heat balance"]
    assert spoil(safeguarded_steps=124) == []  # of 496
    assert spoil(safeguarded_steps=125) == ["case share of safeguarded steps"]
    assert spoil(refinements=1) == ["case refined steps on h >= 1/64"]


def test_a_verdict_needs_something_to_judge(tmp_path: Path) -> None:
    nothing = dict(studies=[], manufactured_table=None, readings=None, extremes=None, expected={})
    assert not acceptance.verdict(**nothing)["passed"]
    residuals = dict.fromkeys(BALANCES, 1e-12)
    cells = [{"ladder": "gap g", "value": 0.0, "verdict": v} | residuals for v in ("right", "WRONG")]
    assert acceptance.closed(cells[0])
    for name, size in {"law": 2e-8, "heat": 1e-8, "energy": 1e-8, "force": math.nan}.items():
        assert not acceptance.closed(cells[0] | {name: size})
    table = write(tmp_path / "extremes.csv", cells)
    failed = acceptance.verdict(**nothing | {"extremes": table, "expected": {"extremes gap g 0.0 verdict": "right"}})[
        "failed"
    ]
    assert "extremes cells silently wrong" in failed


@pytest.mark.parametrize(("order", "falls_short"), [(1.0, False), (0.8, True), (1.4, True)])
def test_orders_have_a_band(tmp_path: Path, order: float, falls_short: bool) -> None:
    rows = []
    for n in (8, 16, 32, 64):
        row = {"path": "h=k", "coupling": "staggered", "n": n, "h": 1 / n, "open": 0, "stick": 0}
        rows.append(row | {f"e_{t}": (64 / n) ** order for t in TERMS} | {f"residual_{i}": 0.0 for i in BALANCES})
    checks = acceptance.manufactured(write(tmp_path / "m.csv", rows), {})
    short = {c.case for c in checks if c.case.endswith(" order") and not c.passed}
    assert short == ({f"manufactured h=k staggered {t} order" for t in TERMS} if falls_short else set())


def test_near_is_two_sided() -> None:
    assert acceptance.near("x", 1.019, 1.0).passed
    assert not acceptance.near("x", 1.021, 1.0).passed
    assert not acceptance.near("x", 0.979, 1.0).passed
    assert acceptance.near("x", -1.019, -1.0).passed
    assert not acceptance.near("x", math.nan, 1.0).passed
    assert not acceptance.near("x", 1.0, None).passed


def test_tables_survive_the_disk(tmp_path: Path) -> None:
    row = {"n": 8, "e": 1e-300, "x": math.pi, "bad": math.nan, "far": -math.inf, "word": "right", "front": True}
    (back,) = tables.read(write(tmp_path / "t.csv", [row]))
    assert list(back) == list(row)
    assert isinstance(back["n"], int)
    np.testing.assert_equal(back, row)


def test_a_field_that_is_not_there_has_no_order() -> None:
    assert np.isnan(rates.corrected(0.0, 0.0, 0.25, 0.0625, quadratic=False))
