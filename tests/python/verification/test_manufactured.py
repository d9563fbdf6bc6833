"""Orders on the manufactured solution with contact and slip, judged as the workflow judges them, and what must turn it red."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Scene
from warmslip.model.discretisation import discretise
from warmslip.paper import acceptance
from warmslip.studies.error_norms import TERMS, Comparison, Largest
from warmslip.verification.mms import manufactured

LEVELS, FINE = [8, 16, 32], [16, 32, 64]
STORED = {
    "manufactured h=k staggered u_V finest": 0.010124481127522754,
    "manufactured h=k staggered w_L2 finest": 0.0014219851491541855,
    "manufactured h=k staggered theta_L2 finest": 0.018017915079702733,
    "manufactured k=h^2 staggered u_V finest": 0.006347619513735007,
    "manufactured k=h^2 staggered w_L2 finest": 0.00024881128658463773,
    "manufactured k=h^2 staggered theta_L2 finest": 0.003520378363800709,
}
PAPER = warmslip.load("paper_isotropic")


@pytest.fixture(name="one_derivation", autouse=True)
def _one_derivation(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """The loads do not depend on the grid: they are derived once a test, from the data `mutant` leaves alone."""
    derive, known = manufactured.slipping, {}
    data = getattr(request, "param", None)

    def slipping(scene: Scene) -> manufactured.Manufactured:
        one = (data or scene).override(**{"mesh.n": 1, "time.steps": 1, "time.coupling": "staggered"})
        if one.digest() not in known:
            known[one.digest()] = derive(one)
        return known[one.digest()]

    monkeypatch.setattr(manufactured, "slipping", slipping)


def checks(rows: list[dict[str, Any]], folder: Path, expected: dict[str, float]) -> dict[str, acceptance.Check]:
    path = folder / "manufactured.csv"
    with path.open("w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    return {check.case: check for check in acceptance.manufactured(path, expected)}


def failed(found: dict[str, acceptance.Check]) -> list[str]:
    return [f"{c.case} = {c.observed} not in [{c.low}, {c.high}]" for c in found.values() if not c.passed]


@pytest.mark.parametrize("path", ["h=k", "k=h^2"])
def test_orders(tmp_path: Path, path: str) -> None:
    rows = manufactured.table(PAPER, ["staggered"], LEVELS if path == "h=k" else FINE, path)
    found = checks(rows, tmp_path, STORED)
    assert len(found) == 3 * len(TERMS) + 2
    assert failed(found) == []
    for name, value in STORED.items():
        if name in found:
            assert found[name].observed == pytest.approx(value, rel=1e-8)
    assert {"contact_open": rows[-1]["open"], "stick": rows[-1]["stick"]} == {"contact_open": 0, "stick": 0}


@pytest.mark.parametrize("path", ["h=k", "k=h^2"])
def test_algebraic_errors_are_invisible(path: str) -> None:
    """Two linear solvers and a contact tolerance two digits apart give answers whose distance is no part of the error."""
    n, steps = manufactured.grid(path, LEVELS if path == "h=k" else FINE)[-1]
    scene = PAPER.override(**{"mesh.n": n, "time.steps": steps})
    solution = manufactured.slipping(scene)
    d = discretise(scene, loads=solution.loads)
    nodes = np.asarray(d.mesh.nodes)
    steppers = [d.stepper(), d.stepper(backend="petsc", tolerance=1e-10)]
    distance = Largest()
    for one in steppers:
        d.restart(one, solution.u(nodes, 0.0), solution.w(nodes, 0.0), solution.theta(nodes, 0.0), 0.0)
    for step in range(1, steps + 1):
        loads = d.load_vectors.at(step * scene.step)
        assert all(one.advance(*loads).outcome.name == "completed" for one in steppers)
        distance.add(Comparison(d, d).difference(*steppers))
    for term in TERMS:
        assert distance.values[term] <= 1e-6 * STORED[f"manufactured {path} staggered {term} finest"], term


@pytest.mark.parametrize("coupling", ["lagged", "monolithic"])
def test_orders_of_the_other_couplings(tmp_path: Path, coupling: str) -> None:
    found = checks(manufactured.table(PAPER, [coupling], LEVELS, "h=k"), tmp_path, {})
    red = [line for line in failed(found) if "no stored value" not in line]
    assert red == []


def test_gauss_points_and_printed_tensors_keep_the_orders(tmp_path: Path) -> None:
    ones = [[1.0, 1.0], [1.0, 1.0]]
    scene = PAPER.override(
        **{"contact.quadrature": "gauss-2", "heat.expansion.tensor": ones, "heat.heating.tensor": ones}
    )
    found = checks(manufactured.table(scene, ["staggered"], FINE, "h=k"), tmp_path, {})
    assert [line for line in failed(found) if "no stored value" not in line] == []


@pytest.mark.parametrize("one_derivation", [PAPER], indirect=True)
@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("contact.friction.coefficient", 0.202),
        ("contact.heat_exchange.conductance", 1.03),
        ("contact.stiffness", 1.2e4),
        ("inertia.density", 1.1),
        ("viscosity.lame", [10.0, 5.1]),
        ("elasticity.young", 2.5),
        ("heat.expansion.tensor", [[-1.0, 0.0], [0.0, -1.0]]),
    ],
)
def test_wrong_data_turn_it_red(tmp_path: Path, key: str, value: Any) -> None:
    """The run has one constant wrong, the loads and stored values the right ones."""
    rows = manufactured.table(PAPER.override(**{key: value}), ["staggered"], LEVELS, "h=k")
    assert failed(checks(rows, tmp_path, STORED)) != []


def test_wrong_sign_of_the_gap_turns_it_red(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, right = PAPER.override(**{"contact.gap": -5e-4}), manufactured.slipping
    rows = manufactured.table(scene, ["staggered"], LEVELS, "h=k")
    stored = {f"manufactured h=k staggered {t} finest": rows[-1][f"e_{t}"] for t in TERMS}
    assert failed(checks(rows, tmp_path, stored)) == []

    def wrong(one: Scene) -> manufactured.Manufactured:
        solution = right(one)
        return replace(solution, loads=replace(solution.loads, gap=5e-4))

    monkeypatch.setattr(manufactured, "slipping", wrong)
    assert failed(checks(manufactured.table(scene, ["staggered"], LEVELS, "h=k"), tmp_path, stored)) != []


def test_wrong_coupling_turns_it_red(tmp_path: Path) -> None:
    rows = [row | {"coupling": "staggered"} for row in manufactured.table(PAPER, ["monolithic"], LEVELS, "h=k")]
    assert failed(checks(rows, tmp_path, STORED)) != []
    # lagged differs by less than the verdict's 2 %: the test above, at 1e-8, and SciPy tell them apart
    rows = manufactured.table(PAPER, ["lagged"], LEVELS, "h=k")
    stored = STORED["manufactured h=k staggered theta_L2 finest"]
    assert rows[-1]["e_theta_L2"] != pytest.approx(stored, rel=1e-5)
    assert acceptance.near("x", rows[-1]["e_theta_L2"], stored).passed


def test_supports_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="clamped at the top"):
        manufactured.slipping(PAPER.override(**{"supports.temperature": ["top"]}))
    with pytest.raises(ValueError, match="leave contact"):
        manufactured.slipping(PAPER.override(**{"contact.gap": 0.01}))
