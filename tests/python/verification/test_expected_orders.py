"""Corners, graded grids, unbiased orders and uncertainty, against what is known of each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip.model.corners import corners, elastic_exponent, thermal_exponent
from warmslip.model.meshes import coarsest
from warmslip.studies import rates
from warmslip.verification import graded_study, uncertainty

HOT = {"contact.heat_exchange.foundation_temperature": 10.0}
CORNERS = [(0.0, 1.0), (1.0, 1.0)]


@pytest.mark.parametrize(
    ("angle", "clamped", "expected"),
    [
        (1.5 * np.pi, (False, False), 0.544483736782464),  # the L-shaped domain
        (2 * np.pi, (False, False), 0.5),  # a crack
        (2 * np.pi, (True, True), 0.5),
        (1.5 * np.pi, (True, True), 0.6018077748921468),  # c = 2: sin^2(1.5 pi L) = L^2 / 4, by bisection
        (np.pi, (True, False), 0.5),  # a clamp that ends on a straight side
        (np.pi / 2, (False, False), 2.0),
    ],
)
def test_elastic_exponents(angle: float, clamped: tuple[bool, bool], expected: float) -> None:
    assert elastic_exponent(1.0, 1.0, angle, clamped) == pytest.approx(expected, abs=1e-9)


def test_the_papers_corners() -> None:
    scene = warmslip.load("paper_mixed").override(**{"mesh.n": 4})
    found = {c.point: c for c in corners(scene, coarsest(scene.mesh))}
    assert set(found) == {(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)}
    for point in CORNERS:
        assert found[point].exponent_u == pytest.approx(rates.williams_exponent(10.0, 5.0), abs=1e-10)
        assert set(found[point].conditions) == {"clamped", "traction"}
        assert found[point].exponent_theta == 2.0
    assert found[0.0, 0.0].exponent_u == 2.0
    assert found[0.0, 0.0].exponent_theta == 1.0  # a cooled side meets one that exchanges
    assert all(c.angle == pytest.approx(np.pi / 2) for c in found.values())


def test_thermal_exponents() -> None:
    sides = np.array([[1.0, 0.0], [0.0, 1.0]])
    assert thermal_exponent(np.eye(2), sides, np.pi / 2, (True, True)) == pytest.approx(2.0)
    # K stretches: the quarter plane opens to pi - atan2(...) under K^(-1/2)
    k = np.array([[1.0, 0.5], [0.5, 1.0]])
    values, vectors = np.linalg.eigh(k)
    a, b = sides @ vectors @ np.diag(values**-0.5) @ vectors.T
    opening = np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
    assert thermal_exponent(k, sides, np.pi / 2, (True, False)) == pytest.approx(np.pi / 2 / opening)
    assert thermal_exponent(k, sides[::-1], np.pi / 2, (True, False)) == pytest.approx(np.pi / 2 / opening)
    assert np.isnan(thermal_exponent(np.ones((2, 2)), sides, np.pi / 2, (True, False)))


@pytest.mark.slow
def test_grading_restores_the_order() -> None:
    """A small version of the report's study: more than uniform grids in every term."""
    scene = warmslip.load("paper_mixed").override(**HOT)
    levels, reference = [8, 16, 32], 64
    fine = graded_study.unbiased(graded_study.study(scene, graded_study.GRADED, levels, reference), reference)
    plain = graded_study.unbiased(graded_study.study(scene, graded_study.UNIFORM, levels, reference), reference)
    for term in ("u_V", "w_L2", "theta_L2"):
        assert fine[-1][f"order_{term}"] > 0.85, term
        assert fine[-1][f"order_{term}"] > plain[-1][f"order_{term}"], term


@pytest.mark.parametrize(("p", "q"), [(1.0, "w_L2"), (0.75, "theta_L2"), (0.69, "u_V")])
def test_bias_is_removed(p: float, q: str) -> None:
    """Errors C h^p seen against a solution that errs by C h_ref^p: the fit finds p, C and the reference's own error."""
    h, reference = np.array([1 / 8, 1 / 16, 1 / 32, 1 / 64]), 128
    own = 3 * (1 / reference) ** p
    true = 3 * h**p
    seen = np.sqrt(true**2 - own**2) if q == "u_V" else true - own
    rows: list[dict[str, Any]] = [
        {"n": round(1 / x), "h": x} | {f"e_{t}": e for t in rates.TERMS} for x, e in zip(h, seen, strict=True)
    ]
    found = graded_study.unbiased(rows, reference)
    assert found[-1][f"order_{q}"] == pytest.approx(p, abs=1e-6)
    assert found[0][f"reference_{q}"] == pytest.approx(own, rel=1e-5)


@pytest.mark.parametrize(
    ("levels", "reference", "word"),
    [([8, 16], 32, "at least three"), ([8, 16, 32], 32, "not finer"), ([8, 16, 24], 64, "sizes must be")],
)
def test_studies_that_say_nothing_are_refused(levels: list[int], reference: int, word: str) -> None:
    with pytest.raises(ValueError, match=word):
        graded_study.study(warmslip.load("paper_mixed"), graded_study.UNIFORM, levels, reference)


@pytest.mark.parametrize("p", [0.7, 1.0, 1.6, 2.0])
def test_uncertainty_covers_the_limit(p: float) -> None:
    h = np.array([1, 2, 4, 8]) / 64
    found = uncertainty.extrapolate(h, 5 + 0.3 * h**p)
    assert found.order == pytest.approx(p, abs=1e-5)
    assert found.limit == pytest.approx(5.0, abs=1e-7)
    assert found.uncertainty == pytest.approx(1.25 * 0.3 * h[0] ** p, rel=1e-4)
    assert abs(found.value - 5) <= found.uncertainty


def test_uncertainty_of_scattered_data_by_hand() -> None:
    """Two fits by hand: the deviation of a power needs three freedoms, and weights go to the finest grids."""
    h = np.array([1.0, 2.0, 4.0, 8.0])
    phi = 1 + 0.1 * h + np.array([0.01, -0.01, 0.01, -0.01])
    found = uncertainty.extrapolate(h, phi)
    for weights in (np.full(4, 0.25), (1 / h) / np.sum(1 / h)):
        basis = np.stack([np.ones(4), h**found.order], axis=1) * np.sqrt(weights)[:, None]
        a = np.linalg.lstsq(basis, phi * np.sqrt(weights), rcond=None)[0]
        deviation = np.sqrt(np.sum(4 * weights * (phi - a[0] - a[1] * h**found.order) ** 2) / (4 - 3))
        if deviation == pytest.approx(found.deviation, rel=1e-6):
            assert found.limit == pytest.approx(a[0], rel=1e-6)
            break
    else:
        pytest.fail(f"neither fit has the deviation {found.deviation}")


def test_held_out_values_can_fail(tmp_path: Path) -> None:
    """The finest value must not have been seen by the interval it is tried on."""
    lines = ["n,steps,h," + ",".join(uncertainty.FUNCTIONALS)]
    for n in (16, 32, 64, 128, 256):
        value = 1 + 1 / n + (0.5 if n == 256 else 0.0)
        lines.append(f"{n},{n},{1 / n}," + ",".join([str(value)] * len(uncertainty.FUNCTIONALS)))
    path = tmp_path / "mixed_0_staggered.csv"
    path.write_text("\n".join(lines) + "\n")
    assert not any(line.passed for line in uncertainty.lines(path))


def test_uncertainty_grows_with_scatter() -> None:
    h = np.array([1, 2, 4, 8, 16]) / 128
    smooth = uncertainty.extrapolate(h, 1 + h)
    rough = uncertainty.extrapolate(h, 1 + h + 0.05 * np.array([1, -1, 1, -1, 1]))
    assert rough.uncertainty > 10 * smooth.uncertainty


def test_a_constant_has_no_order() -> None:
    found = uncertainty.extrapolate([1.0, 0.5, 0.25, 0.125], [2.0, 2.0, 2.0, 2.0])
    assert found.uncertainty == 0
    assert np.isnan(found.order)


@pytest.mark.parametrize(
    ("h", "phi", "word"),
    [
        ([1, 2, 4], [1, 2, 3], "four grids"),
        ([1, 1, 2, 4], [1, 2, 3, 4], "differ"),
        ([1, 2, 4, 8], [1, np.nan, 3, 4], "finite"),
        ([-1, 2, 4, 8], [1, 2, 3, 4], "positive"),
    ],
)
def test_uncertainty_refuses(h: list[float], phi: list[float], word: str) -> None:
    with pytest.raises(ValueError, match=word):
        uncertainty.extrapolate(h, phi)
