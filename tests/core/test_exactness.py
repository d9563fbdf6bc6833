"""Affine solutions to round-off: no rates, so a wrong factor cannot hide."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Loads, Scene, Simulation
from warmslip.model.materials import mandel

NORMALS = {
    2: {"left": [-1, 0], "right": [1, 0], "top": [0, 1]},
    3: {"left": [-1, 0, 0], "right": [1, 0, 0], "front": [0, -1, 0], "back": [0, 1, 0], "top": [0, 0, 1]},
}


def floating(dim: int, **keys: Any) -> Scene:
    """No supports at all: inertia and exchange alone hold the body."""
    tensor = (np.eye(dim) + 0.3 * np.ones((dim, dim))).tolist()
    values = {
        "supports.displacement": [],
        "supports.temperature": [],
        "heat.conductivity": tensor,
        "heat.expansion.tensor": tensor,
        "heat.heating.tensor": (-2 * np.array(tensor)).tolist(),
        "contact.stiffness": 1e4,
        "contact.heat_exchange.foundation_temperature": 10.0,
        "mesh.n": 5 if dim == 2 else 2,
        "time.steps": 4,
    }
    return warmslip.load("paper_isotropic" if dim == 2 else "block_3d").override(
        **values | {k.replace("__", "."): v for k, v in keys.items()}
    )


def contraction(scene: Scene, table: Any, gradient: Any) -> Any:
    lam, mu = table.pair(scene.mesh.dim)
    eps = (gradient + gradient.T) / 2
    return lam * np.trace(eps) * np.eye(len(eps)) + 2 * mu * eps


def affine_case(scene: Scene, warming: float) -> tuple[Loads, Any, Any, Any]:
    """u = u0 + t w with u0, w affine and u_nu constant below; theta = a + b.x + t warming; the loads that make them so."""
    dim, heat = scene.mesh.dim, scene.heat
    g0, g1 = 0.01 * np.arange(1.0, dim**2 + 1).reshape(dim, dim), 0.02 * np.arange(dim**2, 0.0, -1).reshape(dim, dim)
    for g in (g0, g1):
        g[-1, :-1] = 0  # the pressure is the same everywhere
    g1[1:-1, :-1] = 0  # and so is the direction of slip: friction is constant, every rule integrates it exactly
    s0, s1 = np.full(dim, 0.1), 0.5 * np.eye(dim)[0]
    s0[-1] = -1e-3
    slope = np.linspace(1.0, 2.0, dim)

    def u(x: Any, t: float) -> Any:
        return s0 + x @ g0.T + t * w(x, t)

    def w(x: Any, t: float) -> Any:
        return s1 + x @ g1.T

    def theta(x: Any, t: float) -> Any:
        return 3 + x @ slope + warming * t

    K, M, R = (np.array(m) for m in (heat.conductivity, heat.expansion.tensor, heat.heating.tensor))

    def traction(normal: Any) -> Any:
        def value(x: Any, t: float) -> Any:
            sigma = contraction(scene, scene.elasticity, g0 + t * g1) + contraction(scene, scene.viscosity, g1)
            return np.asarray((sigma - theta(x, t)[:, None, None] * M) @ np.array(normal, float))

        return value

    down = -np.eye(dim)[-1]
    pressure = scene.contact.stiffness * (-s0[-1] - scene.contact.gap)
    exchange = scene.contact.heat_exchange

    def contact_traction(x: Any, t: float) -> Any:
        slip = w(x, t)
        slip[:, -1] = 0
        direction = slip / np.linalg.norm(slip, axis=1)[:, None]
        return traction(down)(x, t) + pressure * down + scene.contact.friction.coefficient * pressure * direction

    loads = Loads(
        body=M @ slope,
        source=warming - np.sum(R * (g1 + g1.T) / 2),
        traction={part: traction(normal) for part, normal in NORMALS[dim].items()},
        heat_flux={part: slope @ K @ np.array(normal, float) for part, normal in NORMALS[dim].items()},
        contact_traction=contact_traction,
        contact_flux=lambda x, t: (
            slope @ K @ down + exchange.conductance * (theta(x, t) - exchange.foundation_temperature)
        ),
        gap=scene.contact.gap,
        foundation_temperature=exchange.foundation_temperature,
        points=3,
    )
    return loads, u, w, theta


def worst_error(scene: Scene, data: Scene, warming: float = 0.0) -> tuple[float, Simulation]:
    """Largest relative error of u, w and theta at the end of a run of `scene` with the loads made for `data`."""
    loads, *exact = affine_case(data, warming)
    simulation = Simulation(scene, loads=loads)
    d, s = simulation.discretisation, simulation.stepper
    nodes = np.asarray(d.mesh.nodes)
    d.restart(s, *(f(nodes, 0.0) for f in exact), 0.0)
    assert all(report.slip == len(d.surface.weights) for _, report in simulation.steps())
    assert simulation.outcome == "completed"
    errors = [
        np.abs(d.field(v) - f(nodes, s.time)).max() / np.abs(f(nodes, s.time)).max()
        for v, f in zip((s.u, s.w, s.theta), exact, strict=True)
    ]
    return max(errors), simulation


@pytest.mark.parametrize("diagonal", ["right", "left", "crisscross"])
@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
def test_affine_in_the_plane(diagonal: str, coupling: str) -> None:
    scene = floating(2, mesh__diagonal=diagonal, time__coupling=coupling)
    error, simulation = worst_error(scene, scene, warming=2.0 if coupling == "monolithic" else 0.0)
    assert error <= 1e-11
    assert max(simulation.statistics.residuals.values()) <= 1e-11


@pytest.mark.parametrize("quadrature", ["nodal", "gauss-1", "gauss-3"])
def test_affine_with_every_quadrature(quadrature: str) -> None:
    scene = floating(2, contact__quadrature=quadrature, contact__gap=-0.002, mesh__lengths=[2.0, 0.5])
    assert worst_error(scene, scene)[0] <= 1e-11


def test_affine_on_a_mesh_of_no_symmetry() -> None:
    scene = floating(2, mesh__n=[7, 3], mesh__lengths=[0.7, 1.9], elasticity__assumption="plane_strain")
    assert worst_error(scene, scene)[0] <= 1e-11


@pytest.mark.parametrize(
    "mutant",
    [
        {"contact__friction__coefficient": 0.202},
        {"contact__stiffness": 1.01e4},
        {"contact__heat_exchange__conductance": 1.01},
        {"elasticity__young": 2.02},
        {"viscosity__lame": [10.1, 5.0]},
        {"heat__conductivity": [[1.0, 0.3], [0.3, 1.3]]},
        {"heat__expansion__tensor": [[1.3, 0.31], [0.31, 1.3]]},
        {"heat__heating__tensor": [[2.6, 0.6], [0.6, 2.6]]},
    ],
    ids=lambda m: next(iter(m)),
)
def test_every_constant_matters(mutant: dict[str, Any]) -> None:
    """One wrong constant and the affine solution is lost: the tests above can fail."""
    assert worst_error(floating(2, **mutant), floating(2))[0] > 1e-6


@pytest.mark.parametrize("diagonal", ["right", "left"])
@pytest.mark.parametrize("coupling", ["staggered", "monolithic"])
def test_affine_in_space(diagonal: str, coupling: str) -> None:
    scene = floating(3, mesh__diagonal=diagonal, time__coupling=coupling)
    assert worst_error(scene, scene, warming=2.0 if coupling == "monolithic" else 0.0)[0] <= 1e-11


def test_mandel_of_the_tables() -> None:
    scene = floating(2)
    assert mandel(scene.viscosity, 2).tolist() == [[20, 10, 0], [10, 20, 0], [0, 0, 10]]
