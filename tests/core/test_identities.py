"""Balances and contact law at every step, for every reading, coupling and quadrature, and at the edges of the data."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from petsc4py import PETSc
from reference import scipy_scheme

import warmslip
from warmslip import Loads, Scene, Trajectory

BALANCES = ("energy", "heat", "force", "law")
COUPLINGS = scipy_scheme.COUPLINGS
CASES = list(itertools.product(scipy_scheme.READINGS, COUPLINGS, ("nodal", "gauss-2")))
DISSIPATIONS = (
    "inertia_damping",
    "elastic_damping",
    "contact_damping",
    "viscous",
    "friction",
    "heat_damping",
    "conducted",
)


def scene(reading: str = "mixed", **keys: Any) -> Scene:
    values = {"mesh.n": 8, "time.steps": 8, "contact.heat_exchange.foundation_temperature": 10.0}
    return warmslip.load(f"paper_{reading}").override(**values | {k.replace("__", "."): v for k, v in keys.items()})


def check(one: Scene, **how: Any) -> warmslip.Result:
    result = warmslip.run(one, **how)
    assert result.outcome == "completed"
    worst = {name: result.summary["balances"][name] for name in BALANCES}
    assert worst["law"] <= 1e-11, worst
    assert max(v for k, v in worst.items() if k != "law") <= 1e-11, worst
    return result


@pytest.mark.parametrize(("reading", "coupling", "quadrature"), CASES)
def test_balances(tmp_path: Path, reading: str, coupling: str, quadrature: str) -> None:
    result = check(scene(reading, time__coupling=coupling, contact__quadrature=quadrature), out=tmp_path)
    # refinement is for round-off on fine meshes; here it could only mend a wrong right-hand side
    assert result.summary["cost"]["refinements"] == 0
    with Trajectory(tmp_path / "trajectory.h5") as t:
        balances = t.series("balances")
    for name in DISSIPATIONS:
        assert (balances[name] >= -1e-15 * np.abs(balances["load_work"]).max()).all(), name
    for name in ("energy", "heat", "force", "law"):
        assert (balances[f"{name}_residual"] <= 1e-11).all()
    # the energy balance once more, from the terms in the file
    out = (
        "kinetic_change",
        "elastic_change",
        "contact_change",
        "inertia_damping",
        "elastic_damping",
        "contact_damping",
        "viscous",
        "friction",
    )
    left = sum(balances[n] for n in out) - sum(balances[n] for n in ("load_work", "expansion_work", "gap_work"))
    assert np.abs(left).max() <= 1e-12 * max(np.abs(balances[n]).max() for n in out)
    left = (
        sum(balances[n] for n in ("heat_change", "heat_damping", "conducted", "exchanged"))
        - balances["supplied"]
        - balances["heating"]
    )
    assert np.abs(left).max() <= 1e-12 * np.abs(balances["supplied"]).max()


def test_opposite_coupling_cancels() -> None:
    """R = -M, monolithic: what expansion takes from the motion, heating gives to the heat, term by term."""
    simulation = warmslip.Simulation(scene("consistent", time__coupling="monolithic"))
    for _, report in simulation.steps():
        assert report.balances.heating == pytest.approx(-report.balances.expansion_work, rel=1e-11)


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_balances_in_space(coupling: str) -> None:
    values = {"mesh.n": 3, "time.steps": 4, "time.coupling": coupling}
    result = check(warmslip.load("block_3d").override(**values))
    assert result.summary["contact"]["slip"] > 0


@pytest.mark.parametrize("diagonal", ["left", "crisscross"])
def test_balances_on_other_meshes(diagonal: str) -> None:
    check(scene("printed", mesh__diagonal=diagonal, mesh__n=[9, 5], mesh__lengths=[2.0, 1.0]))


@pytest.mark.parametrize("quadrature", ["nodal", "gauss-2"])
def test_without_friction(tmp_path: Path, quadrature: str) -> None:
    result = check(scene(contact__friction__coefficient=0.0, contact__quadrature=quadrature), out=tmp_path)
    assert result.summary["contact"]["tangential_force"] == 0
    assert result.summary["contact"]["normal_force"] > 0
    with Trajectory(tmp_path / "trajectory.h5") as t:
        assert (t.series("contact")["force"][..., 0] == 0).all()
        assert (t.series("balances")["friction"] == 0).all()


def test_without_exchange_the_foundation_is_not_felt() -> None:
    cold, hot = (
        check(scene(contact__heat_exchange__conductance=0.0, contact__heat_exchange__foundation_temperature=f))
        for f in (0.0, 10.0)
    )
    np.testing.assert_array_equal(cold.theta, hot.theta)
    np.testing.assert_array_equal(cold.u, hot.u)


def test_perfect_exchange_holds_the_foundation_temperature() -> None:
    """With the sides free: where a cold side meets it, the consistent exchange matrix projects, and overshoots."""
    result = check(scene(contact__heat_exchange__conductance=1e9, supports__temperature=["top"]))
    assert result.theta[:9] == pytest.approx(10, rel=1e-5)


def test_moving_gap() -> None:
    """A foundation that comes and goes: the work of the gap closes the balances."""
    one = scene("isotropic", time__steps=16)
    loads = replace(Loads.of(one), gap=lambda x, t: 1e-3 * np.sin(9 * t) + 1e-3 * x[:, 0])
    check(one, loads=loads)


@pytest.mark.parametrize(("theta", "k"), [(1.0, 1e-5), (300.0, 1e-5), (300.0, 1e-7)])
@pytest.mark.parametrize("tolerance", [None, 1e-8])
def test_small_changes_of_large_contents(tolerance: float | None, theta: float, k: float) -> None:
    """A warm body in short steps: rounding of its content is no defect, a heat system solved to 1e-8 only is refined."""
    steps = 20
    one = scene(
        **{"time__steps": steps, "time__end": k * steps, "initial__temperature": theta, "supports__temperature": []},
        heat__expansion__tensor=[[0.0, 0.0], [0.0, 0.0]],
        heat__heating__tensor=[[0.0, 0.0], [0.0, 0.0]],
    )
    options = PETSc.Options()
    loose = {"heat_ksp_type": "cg", "heat_pc_type": "jacobi", "heat_ksp_rtol": tolerance} if tolerance else {}
    try:
        for key, value in loose.items():
            options[key] = value
        result = warmslip.run(one, backend="petsc")
    finally:
        for key in loose:
            options.delValue(key)
    assert result.completed and (result.summary["cost"]["refinements"] > 0 or not loose)
    assert np.abs(result.theta - warmslip.run(one).theta).max() <= 2e-12 * theta


@pytest.mark.parametrize("n", [5, 16, 32])
def test_a_uniform_temperature_stays(n: int) -> None:
    """Nothing flows, so nothing but rounding is left to be compared with."""
    keys = {
        "supports__temperature": [],
        "heat__source": 0.0,
        "heat__heating__tensor": [[0.0, 0.0], [0.0, 0.0]],
        "contact__heat_exchange__conductance": 0.0,
        "initial__temperature": 3.0,
    }
    result = check(scene("isotropic", mesh__n=n, time__steps=3, **keys))
    assert result.theta == pytest.approx(3.0, rel=1e-12)


@pytest.mark.parametrize(
    "edge",
    [
        {"inertia__density": 0.0},
        {"viscosity__lame": [0.0, 0.0]},
        {"heat__expansion__tensor": [[0.0, 0.0], [0.0, 0.0]]},
        {"contact__stiffness": 0.0},
        {"contact__gap": 1.0},
        {"contact__gap": -0.01},
        {"time__steps": 1},
        {"time__end": 1e-6},
        {"time__end": 1e3},
        {"mesh__n": 1, "mesh__lengths": [1.0, 1.0]},
        {"contact__friction__coefficient": 3.0},
        {"supports__displacement": []},
        {  # a uniform temperature, and no heat that flows
            "supports__temperature": [],
            "heat__source": 0.0,
            "heat__heating__tensor": [[0.0, 0.0], [0.0, 0.0]],
            "contact__heat_exchange__conductance": 0.0,
            "initial__temperature": 3.0,
        },
        {  # free thermal growth: every resultant vanishes
            "inertia__density": 0.0,
            "loads__body": [0.0, 0.0],
            "loads__traction": {},
            "contact__gap": 1.0,
        },
        {
            "loads__body": [0.0, 0.0],
            "loads__traction": {},
            "heat__source": 0.0,
            "contact__heat_exchange__foundation_temperature": 0.0,
        },
    ],
    ids=lambda e: " ".join(f"{k}={v}" for k, v in e.items()),
)
@pytest.mark.parametrize("coupling", ["staggered", "monolithic"])
def test_edges_of_the_data(edge: dict[str, Any], coupling: str) -> None:
    check(scene(time__coupling=coupling, **edge))
