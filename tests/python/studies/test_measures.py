"""Measuring: distances between nested runs, maxima over time, studies, stress, work and robustness, on answers known by hand."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Simulation
from warmslip.model.discretisation import discretise
from warmslip.model.stress import stress_measures
from warmslip.paper import readings
from warmslip.scene.reader import load
from warmslip.studies import refinement_study, robustness, work_precision
from warmslip.studies.error_norms import Comparison, Largest

KEYS = {"contact.heat_exchange.foundation_temperature": 10.0}


def scene(n: int, steps: int, **more: Any) -> warmslip.Scene:
    return warmslip.load("paper_mixed").override(**{"mesh.n": n, "time.steps": steps} | KEYS | more)


def write(path: Path, rows: list[dict[str, Any]]) -> Path:
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    return path


def test_comparison_of_known_states() -> None:
    """Linear fields are the same on both meshes, so their distances are integrals over the square."""
    coarse, fine = discretise(scene(2, 2)), discretise(scene(4, 2))
    a, b = coarse.stepper(), fine.stepper()

    def fields(d: Any, u: float, w: float, theta: float) -> tuple[Any, Any, Any]:
        x = np.asarray(d.mesh.nodes)
        down = (1 - x[:, 1])[:, None]  # zero on the clamped top
        return u * down * [0.0, 1.0], w * down * [1.0, 0.0], theta * x[:, 0] * (1 - x[:, 0]) * (1 - x[:, 1])

    coarse.restart(a, *fields(coarse, 3.0, 5.0, 0.0), 0.0)
    fine.restart(b, *fields(fine, 1.0, 1.0, 0.0), 0.0)
    found = Comparison(coarse, fine).difference(a, b)
    # |eps|^2 of 2 (1 - y) e_y is 4; |w|^2 of 4 (1 - y) e_x integrates to 16/3
    assert found["u_V"] == pytest.approx(2.0, rel=1e-12)
    assert found["w_L2"] == pytest.approx(4 / np.sqrt(3), rel=1e-12)
    assert found["theta_L2"] == 0


def test_largest_of_a_sum_is_not_the_sum_of_the_largest() -> None:
    largest = Largest()
    largest.add({"u_V": 3.0, "w_L2": 1.0, "theta_L2": 0.0})
    largest.add({"u_V": 0.0, "w_L2": 2.0, "theta_L2": 4.0})
    expected = {"u_V": 3.0, "w_L2": 2.0, "theta_L2": 4.0, "u_theta": 4.0, "u_w_theta": 6.0}
    assert largest.values == expected


def test_a_small_study() -> None:
    """Its members are plain runs, its errors the distances at the times that member and reference share."""
    rows = refinement_study.study(scene(8, 8), levels=[2, 4], reference=8, grid="full")
    assert [(r["n"], r["steps"]) for r in rows] == [(n, m) for n in (2, 4, 8) for m in (2, 4, 8)]
    finest = warmslip.run(scene(8, 8)).summary
    for name in ("u_V", "u_L2", "w_L2", "theta_L2"):
        assert rows[-1][f"norm_{name}"] == pytest.approx(finest["norms"][name], rel=1e-12)
    coarse, fine = Simulation(scene(4, 2)), Simulation(scene(8, 8))
    compare, largest = Comparison(coarse.discretisation, fine.discretisation), Largest()
    marching = coarse.steps()
    for n, _ in enumerate(fine.steps(), 1):
        if n % 4 == 0:
            next(marching)
            largest.add(compare.difference(coarse.stepper, fine.stepper))
    own = next(r for r in rows if (r["n"], r["steps"]) == (4, 2))
    assert {name: own[f"e_{name}"] for name in largest.values} == pytest.approx(largest.values, rel=1e-12)


def test_uniform_stress() -> None:
    """u_y = -2 (1 - y): one strain everywhere, sigma = lambda tr(e) I + 2 mu e with the plane-stress pair of E, kappa."""
    d = discretise(scene(3, 1))
    stepper, x = d.stepper(), np.asarray(d.mesh.nodes)
    u = np.stack([np.zeros(len(x)), -2 * (1 - x[:, 1])], axis=1)
    d.restart(stepper, u, np.zeros_like(u), np.zeros(len(x)), 0.0)
    young, poisson, strain = 2.0, 0.1, 2.0
    yy, xx = young / (1 - poisson**2) * strain, young * poisson / (1 - poisson**2) * strain
    mises = np.sqrt(xx**2 - xx * yy + yy**2)
    found = stress_measures(d.mises(stepper), d.volumes)
    assert found == pytest.approx({"mises_L2": mises, "mises_max": mises}, rel=1e-12)
    assert mises > 1.5  # a missing square or root would show


@pytest.mark.parametrize(
    ("assumption", "lam"),
    [
        ("plane_stress", 2.0 * 0.3 / (1 - 0.09)),
        ("plane_strain", 2.0 * 0.3 / (1.3 * 0.4)),
        ("solid", 2.0 * 0.3 / (1.3 * 0.4)),
    ],
)
def test_lame_pairs(assumption: str, lam: float) -> None:
    """E = 2, kappa = 0.3 by the textbook, for each assumption on the third axis."""
    table = scene(2, 1).elasticity.model_copy(update={"young": 2.0, "poisson": 0.3, "assumption": assumption})
    assert table.pair(3 if assumption == "solid" else 2) == pytest.approx((lam, 1 / 1.3), rel=1e-14)


def study_rows(errors: list[float], **ends: float) -> list[dict[str, Any]]:
    """A study's diagonal with these errors, and its reference with these norms."""
    norms = {"norm_u_V": 1.0, "norm_u_L2": 1.0, "mises_L2": 1.0, "norm_theta_L2": 1.0} | ends
    rows = []
    for i, e in enumerate([*errors, float("nan")]):
        n = 16 * 2**i
        rows.append({"n": n, "steps": n, "h": 1 / n, "e_u_theta": e, "e_u_w_theta": e} | norms)
    return rows


def test_curves_below_the_ticks_do_not_use_them(tmp_path: Path) -> None:
    low = write(tmp_path / "mixed_0_staggered.csv", study_rows([4e-2, 2e-2, 1e-2, 5e-3]))
    high = write(tmp_path / "mixed_10_staggered.csv", study_rows([1.2e-1, 6e-2, 3e-2, 1.5e-2], norm_u_V=0.5))
    (line,) = readings.table([low, high])
    assert (line["ticks_u_theta_0"], line["ticks_u_theta_10"]) == ("no", "yes")
    assert (line["linear_u_theta_0"], line["linear_u_theta_10"]) == ("yes", "yes")
    assert (line["deformation_larger"], line["all_larger"]) == ("no", "no")  # 0.5 < 1: not all


def test_the_front_holds_the_cheap_and_the_accurate(tmp_path: Path) -> None:
    counts = dict.fromkeys(
        ("factor_bytes", "substitutions", "factorizations", "dense_factorizations", "newton_iterations"), 0
    )
    runs = [(16, 1e-1, 1.0), (32, 1e-2, 2.0), (64, 2e-2, 3.0), (256, 1e-9, 9.0)]
    rows = [{"n": n, "steps": n, "e_u_w_theta": e, "cpu_seconds": s} | counts for n, e, s in runs]
    found = work_precision.table([write(tmp_path / "mixed_0_staggered.csv", rows)])
    assert [(r["n"], r["front"]) for r in found] == [(16, True), (32, True), (64, False)]


def test_a_study_of_any_name_has_its_method_from_its_stamp(tmp_path: Path) -> None:
    for keys, method in (({}, ("staggered", "nodal")), ({"quadrature": "gauss-2"}, ("lagged", "gauss-2"))):
        output = load("paper_mixed").override(
            **{"time.coupling": method[0]} | {f"contact.{key}": value for key, value in keys.items()}
        )
        (tmp_path / "mine.json").write_text(json.dumps({"scene": output.resolved()}))
        assert work_precision.method_of(tmp_path / "mine.csv") == method
    assert work_precision.method_of(tmp_path / "mixed_0_lagged_gauss-2.csv") == ("lagged", "gauss-2")


def test_disagreement_is_relative_and_sees_every_field() -> None:
    one, other = Simulation(scene(2, 1)), Simulation(scene(2, 1))
    for simulation in (one, other):
        list(simulation.steps())
    assert robustness.disagreement(one, other) == 0
    for field in ("u", "w", "theta"):
        vec = getattr(other.stepper, field)
        vec.scale(1 + 1e-3)
        assert robustness.disagreement(one, other) == pytest.approx(1e-3, rel=2e-3), field
        vec.scale(1 / (1 + 1e-3))


def test_a_cell_is_run_twice_by_different_linear_algebra(monkeypatch: pytest.MonkeyPatch) -> None:
    backends = []

    class Noted(Simulation):
        def __init__(self, *arguments: Any, **keys: Any) -> None:
            backends.append(keys.get("backend", "automatic"))
            super().__init__(*arguments, **keys)

    monkeypatch.setattr(robustness, "Simulation", Noted)
    assert robustness.cell(scene(2, 2), "gap g", 0.0)["verdict"] == "right"
    assert backends == ["automatic", "petsc"]
    monkeypatch.setattr(robustness, "disagreement", lambda *_: 1e-3)
    assert robustness.cell(scene(2, 2), "gap g", 0.0)["verdict"] == "WRONG"
