"""What the audit says of the coupling, by runs on both sides of every bound it gives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import warmslip
from warmslip import Scene
from warmslip.model.coupling import adiabatic_stiffness, coupling_rate, mandel_vector, staggered_limit
from warmslip.model.discretisation import discretise
from warmslip.simulation.simulation import Simulation
from warmslip.verification.assumptions.audit import examine
from warmslip.verification.assumptions.constants import decay_rate
from warmslip.verification.assumptions.coupling import lagged_margin
from warmslip.verification.assumptions.findings import Finding, find
from warmslip.verification.assumptions.runs import energy
from warmslip.verification.exact import fixtures


def test_adiabatic_by_hand() -> None:
    ones = mandel_vector(np.ones((2, 2)))
    assert adiabatic_stiffness(3 * np.eye(3), ones, ones) == pytest.approx(3 - 4)
    assert adiabatic_stiffness(3 * np.eye(3), ones, -ones) == pytest.approx(3)
    tensor = np.array([[1.0, 6.0, 5.0], [6.0, 2.0, 4.0], [5.0, 4.0, 3.0]])
    assert mandel_vector(tensor) == pytest.approx(np.array([1, 2, 3, 4 * 2**0.5, 5 * 2**0.5, 6 * 2**0.5]))


# A column without inertia that is strained along y alone: its fields are those of one equation in y.
A, F, M = 2.0, 1.5, 3.0


def column(r: float, k: float, steps: int, *, f: float = F, n: int = 2, **keys: Any) -> Scene:
    along = {"viscosity": A, "elasticity": f}
    return fixtures.blank(
        **{f"{name}__lame": [0.0, value / 2] for name, value in along.items()},
        mesh__n=[1, n],
        time__end=k * steps,
        time__steps=steps,
        heat__expansion={"tensor": [[0.0, 0.0], [0.0, M]]},
        heat__heating={"tensor": [[0.0, 0.0], [0.0, r]]},
        supports__displacement=["top"],
        **keys,
    )


def tensors(scene: Scene) -> tuple[Any, ...]:
    material = discretise(scene).problem.material
    vectors = (mandel_vector(np.asarray(t)) for t in (material.expansion, material.heating))
    return np.asarray(material.viscosity), np.asarray(material.elasticity), *vectors


@pytest.mark.parametrize("scale", [1.0, 0.25])
def test_staggered_limit_is_sharp(scale: float) -> None:
    """R = -c M: below the limit the uniform mode decays, above it grows, at the predicted factor."""
    a, f, m, r = tensors(column(-scale * M, 1.0, 1))
    limit = staggered_limit(a, f, m, r, 0.0)
    assert limit == pytest.approx(2 * A / (scale * M**2 - F))
    for k in (0.97 * limit, 1.03 * limit):
        steps = 40
        simulation = fixtures.run(column(-scale * M, k, steps))
        fixtures.start(simulation, theta=1.0)
        velocities = [float(fixtures.fields(simulation)[1][0, 1]) for _ in fixtures.steps(simulation)]
        factor = (velocities[-1] / velocities[0]) ** 2
        expected = 1 - k * (scale * M**2 + F) / (A + k * F)
        assert velocities[1] / velocities[0] == pytest.approx(expected, rel=1e-9)
        assert (factor < 1) == (k < limit)
        message = find(examine(simulation.discretisation), "coupling, staggered step")
        assert message.holds == ("yes" if k < limit else "no")
        assert message["largest k"] == pytest.approx(limit)


def test_paper_scene_with_opposite_coupling_beyond_the_limit() -> None:
    """R = -M scaled up: bounded with contact, friction and inertia below the limit, growing well beyond it."""

    def energies(size: float) -> tuple[Finding, list[float]]:
        tensor = (size * np.eye(2)).tolist()
        values = {
            "mesh.n": 8,
            "time": {"end": 4.0, "steps": 40},
            "inertia.density": 1e-3,
            "heat.conductivity": [[1e-3, 0.0], [0.0, 1e-3]],
            "heat.source": 0.0,
            "heat.expansion.tensor": tensor,
            "heat.heating.tensor": (-size * np.eye(2)).tolist(),
            "loads": {"body": [0.0, 0.0]},
            "initial.temperature": 1.0,
        }
        scene = warmslip.load("paper_consistent").override(**values)
        simulation = Simulation(scene)
        message = find(examine(simulation.discretisation), "coupling, staggered step")
        return message, [energy(simulation, 1.0) for _ in simulation.steps()]

    message, small = energies(15.0)
    assert message.holds == "yes"
    assert (np.diff(small) <= 1e-12 * small[0]).all()
    message, big = energies(60.0)
    assert message.holds == "no"
    assert big[-1] > 1e3 * big[0]


def test_staggered_limit_by_hand() -> None:
    one = np.ones(1)
    # without viscosity: all or nothing, c M^2 = 9/4 against F
    for f, limit in ((2.0, 0.0), (2.5, np.inf)):
        assert staggered_limit(np.zeros((1, 1)), np.array([[f]]), 3 * one, -0.75 * one, 1.0) == limit
    # R = +M, F = 0: M^2 + 2 M^2 / (k lambda) = 2 A / k
    a, none = np.array([[2.0]]), np.zeros((1, 1))
    assert staggered_limit(a, none, 3 * one, 3 * one, 6.0) == pytest.approx(2 * (2 / 9 - 1 / 6))
    # a stiff body does not make up for W = 9/2 > lambda_1 in small steps
    assert staggered_limit(a, np.array([[1e3]]), 3 * one, 3 * one, 4.0) == 0
    assert staggered_limit(a, none, 3 * one, 0 * one, 0.0) == np.inf


@pytest.mark.parametrize("ratio", [0.95, 1.05])
def test_coupling_energy_is_sharp(ratio: float) -> None:
    """F = 0, R = +M: the mode cos(pi y / 2) of a column cooled at the top grows if and only if M^2/A > lambda_1."""
    conductivity = M**2 / A / (np.pi**2 / 4) / ratio
    scene = column(
        M,
        0.1,
        60,
        f=0.0,
        n=40,
        heat__conductivity=(conductivity * np.eye(2)).tolist(),
        supports__temperature=["top"],
        time__coupling="monolithic",
    )
    simulation = fixtures.run(scene)
    y = fixtures.nodes(simulation)[:, 1]
    fixtures.start(simulation, theta=np.cos(np.pi * y / 2))
    norms = [simulation.discretisation.norms.l2(simulation.stepper.theta) for _ in fixtures.steps(simulation)]
    message = find(examine(simulation.discretisation), "coupling, energy")
    assert message["W"] / message["lambda_1"] == pytest.approx(ratio, rel=2e-3)
    assert (norms[-1] > norms[0]) == (ratio > 1) == (message.holds == "no")


def test_positive_adiabatic_stiffness_is_not_enough() -> None:
    """F - M x R > 0 with R = +M, conduction and no viscosity: vibrations grow, and R = -M alone makes them decay."""

    def growth(sign: float) -> tuple[list[Finding], float]:
        half = [[0.0, 0.0], [0.0, 0.7]]
        scene = fixtures.blank(
            mesh__n=[1, 16],
            time__end=20.0,
            time__steps=2000,
            inertia__density=1.0,
            elasticity__lame=[0.0, 0.5],
            heat__conductivity=[[0.1, 0.0], [0.0, 0.1]],
            heat__expansion={"tensor": half},
            heat__heating={"tensor": (sign * np.array(half)).tolist()},
            supports__displacement=["top"],
        )
        simulation = fixtures.run(scene)
        y = fixtures.nodes(simulation)[:, 1]
        fixtures.start(simulation, u=np.stack([0 * y, 0.1 * np.cos(np.pi * y / 2)], axis=1))
        values = [energy(simulation, 1.0) for _ in fixtures.steps(simulation)]
        return examine(simulation.discretisation), values[-1] / values[0]

    found, factor = growth(1.0)
    assert find(found, "coupling, adiabatic").holds == "yes"
    assert find(found, "coupling, adiabatic")["smallest eigenvalue"] > 0
    assert find(found, "coupling, energy").holds == "no"
    assert factor > 5
    found, factor = growth(-1.0)
    assert find(found, "coupling, energy").holds == "yes"
    assert factor < 1


@pytest.mark.parametrize("seed", range(6))
def test_energy_does_not_grow_within_the_bounds(seed: int) -> None:
    """Random M and R that are no multiples, at the staggered and just inside the lagged limit, with contact and friction."""
    rng = np.random.default_rng(seed)
    m, r = (mandel_vector(t + t.T) for t in rng.standard_normal((2, 2, 2)))
    a = np.diag([2.0, 2.0, 2.0]) + np.outer([1, 1, 0], [1, 1, 0])
    f = np.diag([0.6, 0.6, 0.6])
    full = lambda v: [[v[0], v[2] / np.sqrt(2)], [v[2] / np.sqrt(2), v[1]]]  # noqa: E731

    def scene(scale: float, k: float, coupling: str) -> Scene:
        return fixtures.blank(
            mesh__n=4,
            time={"end": 30 * k, "steps": 30, "coupling": coupling},
            inertia__density=0.01,
            viscosity__lame=[1.0, 1.0],
            elasticity__lame=[0.0, 0.3],
            heat__conductivity=[[0.3, 0.0], [0.0, 0.3]],
            heat__expansion={"tensor": full(scale * m)},
            heat__heating={"tensor": full(r)},
            supports={"displacement": ["top"], "temperature": ["top"]},
            contact={"part": "bottom", "stiffness": 20.0, "friction": {"coefficient": 0.3}},
        )

    rate = decay_rate(discretise(scene(1.0, 1.0, "staggered")))
    # M as large as 0.8 of what (2) allows, then the largest staggered step
    scale = 0.8 * rate / coupling_rate(a, m, r)
    k = staggered_limit(a, f, scale * m, r, rate)
    k = min(k, 5.0)
    assert k > 0
    simulation = Simulation(scene(scale, k, "staggered"))
    assert find(examine(simulation.discretisation), "coupling, staggered step")["largest k"] >= 0.999 * k
    fixtures.start(simulation, u=0.1 * rng.standard_normal((25, 2)), theta=rng.standard_normal(25))
    g = float(np.sqrt((scale**2 * m @ np.linalg.solve(a, m)) / (r @ np.linalg.solve(a, r))))
    values = [energy(simulation, g), *(energy(simulation, g) for _ in fixtures.steps(simulation))]
    assert (np.diff(values) <= 1e-12 * values[0]).all()

    small = brentq(lambda s: lagged_margin(a, f, s * m, r, rate, 0.1), 1e-6 * scale, 4 * scale)
    simulation = Simulation(scene(0.999 * small, 0.1, "lagged"))
    assert find(examine(simulation.discretisation), "coupling, lagged step").holds == "yes"
    fixtures.start(simulation, u=0.1 * rng.standard_normal((25, 2)), theta=rng.standard_normal(25))
    g = float(np.sqrt(small**2 * (m @ np.linalg.solve(a, m)) / (r @ np.linalg.solve(a, r))))
    values = [energy(simulation, g), *(energy(simulation, g) for _ in fixtures.steps(simulation))]
    # the first step's old terms: k g lambda_1 |theta_0|^2 / 2 at most, w_0 = 0
    assert max(values) <= values[0] * (1 + 0.1 * rate)
