"""How many solutions a step has: the bound against the exact value, and loads below and beyond it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.pieces import scaled, turned_piece

from warmslip.model import several_solutions
from warmslip.model.linear_pieces import Solution, exact, solutions
from warmslip.model.uniqueness import ContactPoints, bound
from warmslip.scene.reader import load
from warmslip.simulation.simulation import Simulation

Array = Any


MOST = 8  # points whose statuses are all looked at


def random_points(rng: Any, n: int, d: int = 2, rigid: bool = False) -> ContactPoints:
    """Points with any normals, a random definite compliance, and friction of the order of 1."""
    root, normals = rng.normal(size=(d * n, d * n + 2)), rng.normal(size=(n, d))
    return ContactPoints(
        compliance=root @ root.T / (d * n),
        normals=normals / np.linalg.norm(normals, axis=1)[:, None],
        weights=rng.uniform(0.5, 1.0, n),
        step=0.1,
        stiffness=np.full(n, np.inf) if rigid else 10 ** rng.uniform(0, 4, n),
        friction=rng.uniform(0.5, 1.0, n),
    )


def of_scene(name: str, **keys: Any) -> ContactPoints:
    """The contact points of a scene of the library, with a friction of 1."""
    simulation = Simulation(load(name).override(**{key.replace("__", "."): value for key, value in keys.items()}))
    points = several_solutions.condensed(simulation.discretisation, simulation.stepper)
    return replace(points, friction=np.ones(len(points.weights)))


def samples(rng: Any) -> Iterator[ContactPoints]:
    for n in (1, 1, 2, 2, 3, 3, 4):
        for rigid in (False, True):
            yield random_points(rng, n, rigid=rigid)
    for stiffness in (1e4, 1e2, "rigid"):
        yield of_scene("quasistatic_punch", mesh__n=4, contact__stiffness=stiffness)
    for steps in (2, 32):
        yield of_scene("paper_mixed", mesh__n=4, time__steps=steps)


def law_defect(points: ContactPoints, found: Solution, free: Array, penetration: Array) -> float:
    """How far forces and velocities are from momentum and law, over the largest of each; in the components of the plane."""
    nu = points.normals
    tau = np.column_stack([-nu[:, 1], nu[:, 0]])
    w = free - (points.compliance @ found.force.ravel()).reshape(-1, 2)
    r = penetration + points.step * np.sum(w * nu, axis=1)
    pressure, pull = np.sum(found.force * nu, axis=1), np.sum(found.force * tau, axis=1)
    slip, limit = np.sum(w * tau, axis=1), points.friction * pressure
    forces = np.abs(found.force).max(initial=1e-300)
    velocities = np.abs(free).max() + np.abs(points.compliance).sum(axis=1).max() * forces
    deep = np.isinf(points.stiffness)
    rise = np.where(deep, 0.0, points.weights * points.stiffness)
    give = np.divide(pressure, rise, out=np.zeros_like(r), where=rise > 0)
    normal = np.where(pressure > 1e-11 * forces, np.abs(r - give), np.maximum(r - give, 0.0)).max() / points.step
    cone = np.maximum(np.abs(pull) - limit, 0.0).max() + np.maximum(-pressure, 0.0).max()
    held = np.abs(limit * np.abs(slip) - pull * slip).max()
    return float(max(normal / velocities, cone / forces, held / (forces * velocities)))


def test_one_point_is_klarbrings() -> None:
    """One point: one solution for mu < C_nn / |C_nt|, with the foundation's own compliance in C_nn."""
    c = np.array([[2.0, 0.7], [0.7, 1.0]])  # tangent x, normal y
    points = ContactPoints(
        compliance=c,
        normals=np.array([[0.0, 1.0]]),
        weights=np.array([0.5]),
        step=0.1,
        stiffness=np.array([40.0]),
        friction=np.ones(1),
    )
    assert exact(points) == pytest.approx((1.0 + 1 / (0.5 * 40.0 * 0.1)) / 0.7, rel=1e-14)
    assert exact(replace(points, stiffness=np.array([np.inf]))) == pytest.approx(1 / 0.7, rel=1e-14)
    assert bound(points) == pytest.approx(exact(points), rel=2e-2)
    assert np.isinf(bound(replace(points, friction=np.zeros(1))))
    assert bound(replace(points, compliance=np.diag([2.0, 1.0]))) > 100


def test_the_bound_stays_below_the_exact_value() -> None:
    shares = []
    for points in samples(np.random.default_rng(12)):
        sure, sharp = bound(points), exact(points)
        assert 0 < sure <= (1 + 1e-9) * sharp
        shares.append(sure / sharp)
    assert min(shares) > 0.25
    assert np.median(shares) > 0.75


def test_below_it_every_load_has_one_solution() -> None:
    rng = np.random.default_rng(5)
    for points in samples(rng):
        n = len(points.weights)
        for factor, count in ((0.98 * bound(points), 100), (0.995 * exact(points), 100)):
            rough = scaled(points, factor)
            assert turned_piece(rough) is None
            for _ in range(count if n < 5 else 20):
                free, penetration = rng.normal(size=(n, 2)), rng.normal(size=n) * points.step
                found = solutions(rough, free, penetration)
                assert len(found) == 1
                assert law_defect(rough, found[0], free, penetration) < 1e-11


@pytest.mark.parametrize("axes", [(0, 1), (1, 0)])
def test_a_point_that_cannot_slip_takes_no_part(axes: tuple[int, int]) -> None:
    """A point whose tangential motion supports hold leaves the bound of the others; alone it leaves every coefficient."""
    random = np.random.default_rng(3)
    root = random.normal(size=(4, 4))
    c = root @ root.T

    def points(compliance: Any) -> ContactPoints:
        n = len(compliance) // 2
        ones = np.ones(n)
        return ContactPoints(
            compliance=compliance,
            normals=np.eye(2)[[axes[0]] * n],
            weights=ones,
            step=0.5,
            stiffness=5 * ones,
            friction=ones,
        )

    one = points(c[:2, :2])
    there = np.zeros((4, 4))
    there[:2, :2], there[2 + axes[0], 2 + axes[0]] = c[:2, :2], 2.0
    assert bound(points(there)) == pytest.approx(bound(one), rel=1e-6)
    assert bound(points(there[2:, 2:])) == np.inf


def test_beyond_it_a_load_has_several_that_satisfy_the_law() -> None:
    for points in samples(np.random.default_rng(7)):
        rough = scaled(points, 1.02 * exact(points))
        load_with_several = turned_piece(rough)
        assert load_with_several is not None
        found = solutions(rough, *load_with_several)
        assert len(found) >= 2
        assert len({tuple(np.round(one.force.ravel(), 9)) for one in found}) == len(found)
        assert max(law_defect(rough, one, *load_with_several) for one in found) < 1e-11


@pytest.mark.parametrize("d", [2, 3])
def test_the_bound_knows_no_units_and_no_axes(d: int) -> None:
    rng = np.random.default_rng(3)
    points = random_points(rng, 4, d)
    turn = np.linalg.qr(rng.normal(size=(d, d)))[0]
    everywhere = np.kron(np.eye(4), turn)
    same = replace(
        points,
        compliance=7e5 * everywhere @ points.compliance @ everywhere.T,
        normals=points.normals @ turn.T,
        stiffness=points.stiffness / 7e5,
    )
    assert bound(same) == pytest.approx(bound(points), rel=1e-2)
    fewer = points.of(np.array([True, True, False, True]))
    assert bound(fewer) >= 0.98 * bound(points)
    assert bound(replace(points, stiffness=0.1 * points.stiffness)) >= bound(points)  # a softer foundation is a cure
    assert bound(points, enough=1e-3) >= 1e-3


def test_points_that_share_their_forces_have_the_bound_of_one() -> None:
    """Every point twice, with shares of its weight: C is singular, as that of Gauss points, and the solutions are the same."""
    shares = []
    for single in samples(np.random.default_rng(21)):
        if np.isinf(single.stiffness).any():
            continue
        n = len(single.weights)
        twice = single.of(np.repeat(np.arange(n), 2))
        twice = replace(twice, weights=twice.weights * np.tile([0.2, 0.8], n))
        shares.append(bound(twice) / exact(single))
    assert min(shares) > 0.05
    assert max(shares) <= 1 + 1e-9
    assert np.median(shares) > 0.4


@pytest.mark.parametrize(("quadrature", "n"), [("gauss-2", 4), ("gauss-3", 2), ("gauss-4", 2)])
def test_gauss_points_have_a_bound_below_the_exact_value(quadrature: str, n: int) -> None:
    """A compliance of 1e-8 of its own at every point makes C definite, as the exact value asks."""
    points = of_scene("paper_mixed", mesh__n=n, contact__quadrature=quadrature)
    c = points.compliance
    assert len(points.weights) <= MOST
    assert np.linalg.matrix_rank(c) < len(c)
    sharp = exact(replace(points, compliance=c + 1e-8 * np.abs(c).sum(axis=1).max() * np.eye(len(c))))
    assert 0.5 * sharp < bound(points) < 1.001 * sharp


def test_shorter_steps_are_a_cure_where_there_is_viscosity() -> None:
    """And none in equilibrium, where the compliance of body and foundation have the same ratio in every step."""
    damped = [bound(of_scene("paper_mixed", mesh__n=8, time__steps=steps)) for steps in (4, 16, 64, 256)]
    assert all(longer < 0.9 * shorter for longer, shorter in itertools.pairwise(damped))
    still = [bound(of_scene("quasistatic_punch", mesh__n=8, time__steps=steps)) for steps in (4, 256)]
    assert still[0] == pytest.approx(still[1], rel=1e-2)


def test_in_space_a_plane_problem_has_its_own_bound() -> None:
    """Points that a third direction does not couple: the bound is that of the plane, whichever axis is the third."""
    plane = random_points(np.random.default_rng(8), 3)
    for axis in range(3):
        kept = [i for i in range(3) if i != axis]
        c, normals = np.zeros((3, 3, 3, 3)), np.zeros((3, 3))
        c[np.ix_(range(3), kept, range(3), kept)] = plane.compliance.reshape(3, 2, 3, 2)
        c[range(3), axis, range(3), axis] = 1e-4
        normals[:, kept] = plane.normals
        solid = replace(plane, compliance=c.reshape(9, 9), normals=normals)
        assert bound(solid) == pytest.approx(bound(plane), rel=5e-2)
