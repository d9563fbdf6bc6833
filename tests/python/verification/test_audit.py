"""The audit's numbers against closed forms, an independent assembly, and first steps of sudden starts."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reference import scipy_scheme
from scipy.linalg import eigh
from scipy.optimize import brentq

import warmslip
from warmslip import Loads, Scene
from warmslip.model.discretisation import discretise
from warmslip.simulation.simulation import Simulation
from warmslip.studies.rates import least_squares, williams_exponent
from warmslip.verification.assumptions.audit import audit, examine
from warmslip.verification.assumptions.constants import decay_rate, trace_constants
from warmslip.verification.assumptions.findings import find, in_words, table, write
from warmslip.verification.assumptions.initial_data import start
from warmslip.verification.exact import fixtures

READINGS = tuple(scipy_scheme.READINGS)


def paper(reading: str, n: int = 16, **keys: Any) -> Scene:
    values = {"mesh.n": n, "time.steps": n} | {k.replace("__", "."): v for k, v in keys.items()}
    return warmslip.load(f"paper_{reading}").override(**values)


@pytest.mark.parametrize("reading", READINGS)
def test_what_is_known_of_the_paper(reading: str) -> None:
    found = audit(paper(reading))
    assert find(found, "(H3)").holds == ("no" if reading == "printed" else "yes")
    assert find(found, "(H3)")["m_q"] == pytest.approx(0 if reading == "printed" else 1, abs=1e-14)
    contact = find(found, "(H8) contact")
    assert contact.holds == "no"
    assert contact["right side"] > 1e3 * contact["m_b"]
    assert contact["right side"] == pytest.approx(1.2e4 * contact["c_1"] ** 2)
    assert (find(found, "(H7)")["L_nu"], find(found, "(H7)")["L_tau"]) == (1e4, 2e3)
    assert find(found, "friction, one answer a step").holds == "yes"
    assert (find(found, "(H1)")["m_b"], find(found, "(H1)")["M_b"]) == pytest.approx((10, 30))
    assert (find(found, "(H2)")["m_a"], find(found, "(H2)")["M_a"]) == pytest.approx((2 / 1.1, 2 / 1.1 + 0.4 / 0.99**1))
    # F has E/(1-kappa) on I and E/(1+kappa) on shears; all-ones M x R takes ((2, 2), (2, 2)) from the two
    both = float(np.linalg.eigvalsh(np.diag([2 / 0.9, 2 / 1.1]) - 2)[0])
    kept = {"printed": both, "mixed": both, "isotropic": 2 / 0.9 - 2, "consistent": 2 / 1.1}[reading]
    adiabatic = find(found, "coupling, adiabatic")
    assert adiabatic["smallest eigenvalue"] == pytest.approx(kept, rel=1e-12)
    assert adiabatic.holds == ("no" if kept < 0 else "yes")
    assert find(found, "coupling, sign").holds == ("yes" if reading == "consistent" else "no")
    assert find(found, "coupling, sign")["c"] == pytest.approx(1 if reading == "consistent" else -1)  # R = -c M
    assert find(found, "coupling, energy").holds == "yes"
    for x in (0.0, 1.0):
        top, bottom = find(found, f"corner ({x:g}, 1)"), find(found, f"corner ({x:g}, 0)")
        assert top.holds == "no"
        assert top["exponent of u"] == pytest.approx(williams_exponent(10.0, 5.0), abs=1e-9)
        assert top["exponent of u"] == pytest.approx(0.690, abs=5e-4)
        assert bottom["exponent of u"] > 1
        assert bottom.holds == ("no" if reading == "printed" else "yes")  # theta has no exponent for a singular K


def test_trace_constants_and_decay() -> None:
    """theta = sin(pi x) sinh(pi (1-y)) attains c_3; cooled on three sides heat decays by pi^2 + b^2, b cot(b) = -k_c."""
    sizes = (16, 32, 64)
    exact_3 = np.tanh(np.pi) / np.pi
    exact_rate = np.pi**2 + brentq(lambda b: b / np.tan(b) + 1, 2, 3) ** 2
    found = [discretise(paper("isotropic", n)) for n in sizes]
    c_1, c_3 = (np.array(c) ** 2 for c in zip(*(trace_constants(d) for d in found), strict=True))
    rates = np.array([decay_rate(d) for d in found])
    h = [1 / n for n in sizes]
    assert least_squares(h, exact_3 - c_3)[0] == pytest.approx(2, abs=0.1)
    assert least_squares(h, rates - exact_rate)[0] == pytest.approx(2, abs=0.1)
    assert abs(c_3[-1] / exact_3 - 1) < 3e-3
    assert abs(rates[-1] / exact_rate - 1) < 3e-3
    # for the Lame pair (0, 1/2) of the strain norm the clamped corners leave r^1, so that squares converge like h^2, almost
    steps = np.diff(c_1)
    assert (steps > 0).all()
    assert np.log2(steps[0] / steps[1]) == pytest.approx(2 * williams_exponent(0.0, 0.5), abs=0.2)


def test_trace_constant_by_an_independent_assembly() -> None:
    for n in (6, 10):  # by LAPACK, and by Lanczos
        strain = scipy_scheme._stiffness(n, 0.0, 1.0).toarray()
        boundary = np.kron(scipy_scheme.operators(n, "isotropic")["J"].toarray(), np.eye(2))
        free = slice(0, 2 * n * (n + 1))  # all rows but the top one
        expected = eigh(boundary[free, free], strain[free, free], eigvals_only=True)[-1]
        assert trace_constants(discretise(paper("printed", n)))[0] ** 2 == pytest.approx(expected, rel=1e-10)


def test_dense_and_iterative_eigenvalues_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    d = discretise(paper("printed", 10))
    iterative = *trace_constants(d), decay_rate(d)
    monkeypatch.setattr("warmslip.verification.assumptions.constants.DENSE", 10**4)
    assert (*trace_constants(d), decay_rate(d)) == pytest.approx(iterative, rel=1e-7)


def test_nothing_held() -> None:
    found = examine(discretise(fixtures.blank(mesh__n=3, inertia__density=1.0, contact__stiffness=1.0)))
    assert find(found, "(H8) contact")["c_1"] == np.inf
    assert find(found, "(H8) heat")["c_3"] == np.inf
    assert find(found, "(H3)").holds == "no"
    assert find(found, "(H1)").holds == "no"


THIN = {"mesh__n": [1, 400], "mesh__lengths": [0.0025, 1.0], "inertia__density": 1.0, "viscosity__lame": [0.0, 0.5]}


@pytest.mark.parametrize(
    ("what", "order", "keys"),
    [
        ("theta flux", 0.75, {"contact__heat_exchange": {"conductance": 1.0, "foundation_temperature": 1.0}}),
        ("theta value", 0.25, {"initial__temperature": 1.0, "supports__temperature": ["top"]}),
        ("w flux", 0.75, {"loads__traction": {"top": [0.0, 1.0]}}),
        ("w value", 0.25, {"initial__velocity": [0.0, 1.0], "supports__displacement": ["top"]}),
        ("theta fits", 1.0, {"heat__source": 1.0}),
    ],
)
def test_order_of_a_sudden_start(what: str, order: float, keys: dict[str, Any]) -> None:
    """One step of k against 64 of k/64 leaves the order the audit entitles the field to."""
    field = what.split()[0]

    def state(k: float, steps: int) -> Simulation:
        scene = fixtures.blank(
            **THIN, **keys, time__end=k, time__steps=steps, heat__conductivity=[[1.0, 0.0], [0.0, 1.0]]
        )
        simulation = fixtures.run(scene)
        for _ in fixtures.steps(simulation):
            pass
        return simulation

    sizes, errors = (8e-3, 4e-3, 2e-3, 1e-3), []
    for k in sizes:
        one, many = state(k, 1), state(k, 64)
        difference = getattr(one.stepper, field).copy()
        difference.axpy(-1.0, getattr(many.stepper, field))
        errors.append(one.discretisation.norms.l2(difference))
    expected = min(f["order in k"] for f in start(one.discretisation) if f.topic == f"start of {field}")
    assert expected == order
    if order < 1:
        assert least_squares(sizes, errors)[0] == pytest.approx(order, abs=0.03)
    else:
        assert max(errors) < 1e-12


def test_start_that_does_not_fit() -> None:
    found = list(start(discretise(paper("isotropic", 4, initial__displacement=[0.0, -1e-3]))))
    assert find(found, "start of u").holds == "no"
    assert find(found, "start of w", "tractions")["mismatch"] == pytest.approx(1e4 * 1e-3)
    hot = list(start(discretise(paper("isotropic", 4, initial__temperature=2.0))))
    # the stress is -2 I: nothing carries it on the bottom until the foundation does, and the right load misses it by (1.2, 0.4)
    assert find(hot, "start of w", "tractions")["mismatch"] == pytest.approx(2)
    pressed = paper("isotropic", 4, initial__temperature=2.0, contact__gap=-2e-4)
    assert find(list(start(discretise(pressed))), "start of w", "tractions")["mismatch"] == pytest.approx(
        np.hypot(1.2, 0.4)
    )
    assert find(hot, "start of theta", "cooled")["mismatch"] == 2.0


@pytest.mark.parametrize(("shear", "velocity"), [(0.1, 0.0), (-0.2, 1.0)])
def test_start_that_fits(shear: float, velocity: float) -> None:
    """theta(0) = 1 and theta_F = 1; loads, pressure and friction (in stick, or at its bound against the slip) carry -M."""
    scene = paper(
        "isotropic",
        4,
        initial__temperature=1.0,
        initial__velocity=[velocity, 0.0],
        loads={"body": [0.0, 0.0], "traction": {"left": [1.0, shear], "right": [-1.0, -shear]}},
        heat__expansion__tensor=[[1.0, shear], [shear, 1.0]],
        contact__gap=-1e-4,
        contact__heat_exchange__foundation_temperature=1.0,
    )
    found = list(start(discretise(scene)))
    assert find(found, "start of w", "tractions")["mismatch"] < 1e-12
    assert find(found, "start of theta", "flux").holds == "yes"
    assert find(found, "start of theta", "cooled").holds == "no"


def test_data_in_time_are_looked_at() -> None:
    scene = paper("isotropic", 4)
    loads = Loads(gap=lambda x, t: 0.1 - 0.2 * t + 0 * x[:, 0], foundation_temperature=lambda x, t: x[:, 0] * (1 + t))
    found = examine(discretise(scene, loads=loads))
    assert find(found, "(H6)").holds == "no"
    assert find(found, "(H6)")["smallest g"] == pytest.approx(-0.1)
    assert find(found, "start of theta", "flux")["mismatch"] == pytest.approx(1.0)


def test_in_space_and_on_file(tmp_path: Path) -> None:
    found = audit(warmslip.load("block_3d").override(**{"mesh.n": 3, "contact.quadrature": "gauss-2"}))
    assert find(found, "corners").holds == "not needed"
    assert find(found, "friction, one answer a step")["largest mu"] > 0
    for name in ("audit.csv", "audit.json"):
        write(tmp_path / name, found, {"scene": "block_3d"})
        if name == "audit.csv":
            with (tmp_path / name).open() as file:
                rows = list(csv.DictReader(file))
            assert [row["topic"] for row in rows] == [f.topic for f in found]
        else:
            kept = json.loads((tmp_path / name).read_text())
            assert len(kept["findings"]) == len(found)
            assert kept["stamp"] == {"scene": "block_3d"}
    assert table(found).row_count == len(found)
    assert "m_b = 10" in in_words(found[0])
    with pytest.raises(ValueError, match=r"\.csv or \.json"):
        write(tmp_path / "audit.txt", found, {})
