"""Parts of different quadrature and law that meet: one bound for all their points, against all solutions of random loads."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.statuses import Step, random_step, velocities

from warmslip import Scene
from warmslip.model import several_solutions
from warmslip.model.linear_pieces import exact, solutions
from warmslip.model.uniqueness import ContactPoints, bound, shares_friction
from warmslip.scene.reader import build
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary


def part(name: str, quadrature: str = "nodal", stiffness: Any = 1e3, mu: float = 0.5) -> dict[str, Any]:
    table: dict[str, Any] = {"part": name, "quadrature": quadrature, "stiffness": stiffness}
    return table | ({"friction": {"coefficient": mu}} if mu else {})


def square(n: Any, *parts: dict[str, Any], held: str = "top", **tables: Any) -> Scene:
    return build(
        {
            "mesh": {"shape": "square", "n": n},
            "time": {"steps": 2},
            "elasticity": {"young": 10.0, "poisson": 0.3, "assumption": "plane_strain"},
            "supports": {"displacement": [held]},
            "contact": list(parts),
        }
        | tables
    )


GAUSS, SMOOTH = part("bottom", "gauss-2"), part("left", stiffness="rigid", mu=0)
MEETING = {  # the forces of a corner, or of Gauss points, are shared; the normal ones with friction are not
    "gauss and rigid": square(1, GAUSS, SMOOTH),
    "gauss and rigid, right held": square(1, GAUSS, SMOOTH, held="right"),
    "gauss and gauss": square(1, GAUSS, part("left", "gauss-2", 1e2, 0.2)),
    "three points a facet": square(1, part("bottom", "gauss-3", 1e2)),
    "rigid and rigid": square(1, part("bottom", stiffness="rigid"), SMOOTH),
    "soft nodal and rigid": square([1, 2], part("bottom", "nodal", 1e2), SMOOTH),
}
ROUGH = {  # a normal force with friction is shared
    "gauss and rough rigid": square(1, GAUSS, part("left", stiffness="rigid", mu=0.3)),
    "rigid and soft": square([1, 2], part("bottom", stiffness="rigid"), part("right", "nodal", 1e2, 0.3)),
}


def known(scene: Scene) -> tuple[ContactPoints, several_solutions.Finding]:
    simulation = Simulation(scene)
    return several_solutions.condensed(
        simulation.discretisation, simulation.stepper
    ).rubbing, several_solutions.of_scene(simulation.discretisation, simulation.stepper)


def counts(points: ContactPoints, rng: Any, tries: int) -> list[int]:
    """How many velocities solve each of random loads; that from which the load was made is always among them."""
    out = []
    for _ in range(tries):
        step = random_step(points, rng)
        found = velocities(points, step)
        away = min(np.abs(w - step.known).max() for w in found)
        assert away < 1e-4 * np.abs(step.free).max() or len(found) > 1
        out.append(len(found))
    return out


@pytest.mark.parametrize("name", MEETING)
def test_parts_that_meet_have_one_bound(name: str) -> None:
    points, found = known(MEETING[name])
    assert found.sharp and not found.reason
    assert np.linalg.matrix_rank(points.compliance) < len(points.compliance)
    assert found.factor == pytest.approx(exact(points), rel=1e-12)
    assert 0.2 * found.factor < bound(points) <= found.factor * (1 + 1e-9)
    rng = np.random.default_rng(4)
    below, beyond = (replace(points, friction=f * found.factor * points.friction) for f in (0.98, 1.2))
    assert counts(below, rng, 60) == [1] * 60
    assert any(max(counts(beyond, rng, 20)) > 1 for _ in range(30))


@pytest.mark.parametrize("name", ROUGH)
def test_shares_of_a_normal_force_with_friction_have_none(name: str) -> None:
    points, found = known(ROUGH[name])
    assert found.shares and shares_friction(points) and bound(points) == 0
    rng = np.random.default_rng(4)
    assert any(max(counts(points, rng, 20)) > 1 for _ in range(10))
    with pytest.raises(ValueError, match="share their normal forces"):
        exact(points)
    with pytest.raises(ValueError, match="share their forces"):
        solutions(points, np.zeros_like(points.normals), np.zeros(len(points.weights)))


def test_points_of_their_own_have_the_bound_they_had() -> None:
    """Without shares the enumeration knows what `solutions` knows."""
    points, found = known(square(1, part("bottom", mu=3.0)))
    assert not found.shares and np.linalg.matrix_rank(points.compliance) == len(points.compliance)
    for factor in (0.9, 1.1):
        rough = replace(points, friction=factor * found.factor * points.friction)
        rng = np.random.default_rng(9)
        for _ in range(50):
            step = random_step(rough, rng)
            assert len(velocities(rough, step)) == len(solutions(rough, step.free, step.penetration))


@pytest.mark.parametrize("name", ["gauss and rigid", "rigid and rigid"])
def test_in_space_parts_that_meet_have_the_bound_of_the_plane(name: str) -> None:
    """Points that a third direction does not couple."""
    plane, found = known(MEETING[name])
    n = len(plane.weights)
    for axis in range(3):
        kept = [i for i in range(3) if i != axis]
        c, normals = np.zeros((n, 3, n, 3)), np.zeros((n, 3))
        c[np.ix_(range(n), kept, range(n), kept)] = plane.compliance.reshape(n, 2, n, 2)
        c[range(n), axis, range(n), axis] = 1e-4
        normals[:, kept] = plane.normals
        solid = replace(plane, compliance=c.reshape(3 * n, 3 * n), normals=normals)
        assert 0.9 * bound(plane) < bound(solid) <= found.factor * (1 + 1e-9)


def test_a_cube_whose_parts_meet_has_one_bound() -> None:
    """The bound of a cube on Gauss points beside a smooth rigid wall; a rough wall shares."""
    for mu, shares in ((0.0, False), (0.3, True)):
        scene = build(
            {
                "mesh": {"shape": "cube", "n": 1},
                "time": {"steps": 2},
                "elasticity": {"young": 10.0, "poisson": 0.3, "assumption": "solid"},
                "supports": {"displacement": ["top"]},
                "contact": [part("bottom", "gauss-2"), part("left", stiffness="rigid", mu=mu)],
            }
        )
        points, found = known(scene)
        assert found.shares == shares
        assert (found.factor > 0.1) != shares
        rng = np.random.default_rng(2)
        if shares:
            continue
        for _ in range(2000):  # what two solutions differ by has at some point a work that the law forbids
            assert _least_work(replace(points, friction=0.98 * found.factor * points.friction), rng) > 0


def _least_work(points: ContactPoints, rng: Any) -> float:
    """The largest of a point's work that the law forbids, over the size of the works, for a random difference of forces."""
    n, nu = len(points.weights), points.normals
    delta = rng.normal(size=(n, 3)) * 10 ** rng.uniform(-1, 1, (n, 1))
    rough = points.friction > 0
    across = np.sum(delta * nu, axis=1)
    delta = across[:, None] * nu + rough[:, None] * (delta - across[:, None] * nu)
    moved = (points.compliance @ delta.ravel()).reshape(n, 3)
    pressing = across * (np.sum(moved * nu, axis=1) + across / (points.weights * points.stiffness * points.step))
    along, slip = delta - across[:, None] * nu, moved - np.sum(moved * nu, axis=1)[:, None] * nu
    rubbing = np.sum(along * slip, axis=1) - points.friction * np.abs(across) * np.linalg.norm(slip, axis=1)
    size = np.abs(pressing).max() + np.abs(rubbing).max()
    return float(max(pressing.max(), rubbing.max()) / size)


LOADED = {
    "gauss and rough rigid": (2.0, [-1.29, -0.88], [0.009, -0.059], [-0.008, 0.0], "share their normal forces"),
    "gauss and gauss": (2.0, [-0.41, 0.87], [-0.148, -0.071], [0.016, -0.032], "one solution up to"),
}


@pytest.mark.parametrize("name", LOADED)
def test_a_run_that_has_another_solution_says_so(name: str) -> None:
    """The core ends right with one of several velocities, and does not keep silent."""
    mu, body, moved, gaps, words = LOADED[name]
    scene = (MEETING | ROUGH)[name].override(
        **{
            "contact.0.friction.coefficient": mu,
            "contact.0.gap": gaps[0],
            "contact.1.gap": gaps[1],
            "loads.body": body,
            "time.steps": 1,
            "supports.displacement": {"top": [f"{one} * t" for one in moved]},
        }
    )
    simulation = Simulation(scene)
    assert list(simulation.steps()) and simulation.outcome == "completed"
    points, free, penetration = several_solutions.posed(simulation.discretisation, simulation.stepper)
    moves = np.diag(points.compliance).reshape(-1, 2).sum(axis=1) > 0
    found = velocities(points.of(moves), Step(free[moves], penetration[moves], free[moves]))
    assert len(found) > 1
    (output,) = [one for one in summary(simulation)["warnings"] if "several" in one]
    assert words in output
