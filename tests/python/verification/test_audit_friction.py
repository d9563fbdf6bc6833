"""The bound on friction: an eigenvalue of the body, sharp at one point, and respected by the map it is about."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import cholesky, eigh, solve_triangular
from scipy.optimize import lsq_linear

import warmslip
from warmslip import Scene, _core
from warmslip.model.discretisation import discretise
from warmslip.verification.assumptions.audit import audit
from warmslip.verification.assumptions.constants import sparse
from warmslip.verification.assumptions.findings import find
from warmslip.verification.assumptions.friction import step_compliance, uniqueness


def paper(n: int, **keys: Any) -> Scene:
    values = {"mesh.n": n, "time.steps": n} | {k.replace("__", "."): v for k, v in keys.items()}
    return warmslip.load("paper_mixed").override(**values)


def test_one_point_is_sharp() -> None:
    """C with 1/(omega c_nu k) + C_nn = 2 C_nt^2 / C_tt: beyond the bound sliding has no unique pressure."""
    normal, tangential, both, weight = 2.0, 3.0, -2.2, 0.4
    rest = 2 * both**2 / tangential - normal
    k = 0.1
    stiffness = 1 / (rest * weight * k)
    c = np.array([[tangential, both], [both, normal]])
    found = uniqueness(c, np.array([[0.0, -1.0]]), np.array([weight]), stiffness, k)
    assert found.largest == pytest.approx((normal + rest) / abs(both), rel=1e-12)
    assert found.correlation == pytest.approx(abs(both) / np.sqrt(normal * tangential))


@pytest.mark.parametrize("name", ["paper_isotropic", "block_3d"])
def test_mobility_is_an_eigenvalue_of_the_body(name: str) -> None:
    """Gauss's points integrate P1 squares exactly: L is the largest int |v_tau|^2 / K(v, v), with no contact point at all."""
    d = discretise(warmslip.load(name).override(**{"mesh.n": 3, "contact.quadrature": "gauss-2"}))
    k = d.scene.step
    found = uniqueness(step_compliance(d, k), np.asarray(d.surface.normals), np.asarray(d.surface.weights), 1.0, k)
    boundary = np.kron(sparse(d.operators.exchange).toarray(), np.diag([1.0] * (d.dim - 1) + [0.0]))  # k_c = 1
    body = sparse(_core.momentum_matrix(d.layout, d.problem, d.operators, k)).toarray()
    assert found.mobility == pytest.approx(eigh(boundary, body, eigvals_only=True)[-1], rel=1e-10)


@pytest.mark.parametrize("quadrature", ["nodal", "gauss-2"])
def test_frozen_thresholds_contract(quadrature: str) -> None:
    """The map T -> mu z, solved as a quadratic program, never expands faster than the bound says, and nearly so at times."""
    d = discretise(paper(8, contact__quadrature=quadrature, contact__stiffness=1e3))
    k, stiffness = d.scene.step, 1e3
    c = step_compliance(d, k)
    normals, weights = np.asarray(d.surface.normals), np.asarray(d.surface.weights)
    found = uniqueness(c, normals, weights, stiffness, k)
    mu = 0.9 * found.largest
    points = len(weights)
    order = np.concatenate([np.arange(points) * 2 + 1, np.arange(points) * 2])  # normal first; nu = (0, -1)
    sign = np.concatenate([-np.ones(points), np.ones(points)])
    full = sign[:, None] * c[np.ix_(order, order)] * sign
    full += np.diag(np.concatenate([1 / (weights * stiffness * k), np.full(points, 1e-13)]))
    root = cholesky(full, lower=True)

    def pressure(free: Any, bound: Any) -> Any:
        low, high = np.concatenate([0 * bound, -bound]), np.concatenate([np.full(points, np.inf), bound])
        right = solve_triangular(root, free, lower=True)
        return lsq_linear(root.T, right, (low, high), method="bvls", tol=1e-15).x[:points]

    rng, worst = np.random.default_rng(0), 0.0
    for _ in range(40):
        free = np.concatenate([rng.uniform(-0.3, 1, points), rng.uniform(-1, 1) * np.ones(points)])
        bound = rng.uniform(0.1, 1, points) * weights
        change = 0.05 * bound * rng.choice([1.0, rng.uniform(-1, 1)], points)
        difference = mu * (pressure(free, bound + change) - pressure(free, bound))
        worst = max(
            worst, float(np.linalg.norm(difference / np.sqrt(weights)) / np.linalg.norm(change / np.sqrt(weights)))
        )
    assert worst <= 0.9
    assert worst >= 0.05, worst


def test_what_is_said() -> None:
    def message(**keys: Any) -> tuple[str, str]:
        found = find(audit(paper(4, **keys)), "friction, one answer a step")
        return found.holds, found.meaning

    holds, meaning = message()
    assert holds == "yes"
    assert "exactly one answer" in meaning
    assert message(contact__friction__coefficient=0.0)[0] == "not needed"
    assert message(contact__stiffness=0.0)[0] == "not needed"
    holds, meaning = message(contact__friction__coefficient=50.0)
    assert holds == "no"
    assert "More than one answer" in meaning
    opposite = {"heat__heating__tensor": [[-1.0, -1.0], [-1.0, -1.0]]}
    assert message(time__coupling="monolithic", time__steps=32)[0] == "no"
    assert message(time__coupling="monolithic", time__steps=32, **opposite)[0] == "yes"
