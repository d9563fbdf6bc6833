"""How many solutions a step has: the bound against the exact value, loads below and beyond it, and what the core finds.

`python test_uniqueness.py` checks on the ranks it has that a run says how much friction leaves one solution.
"""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.processes import child_environment

import warmslip
from warmslip import Scene
from warmslip.model import several_solutions
from warmslip.model.discretisation import discretise
from warmslip.model.linear_pieces import Solution, exact, solutions
from warmslip.model.uniqueness import ContactPoints, bound
from warmslip.report import cost
from warmslip.scene import plausibility
from warmslip.scene.reader import build, load
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

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


def scaled(points: ContactPoints, factor: float) -> ContactPoints:
    return replace(points, friction=factor * points.friction)


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


def turned_piece(points: ContactPoints) -> tuple[Array, Array] | None:
    """Free velocity and penetration of a step inside a piece whose determinant is negative; None where there is none.

    Every point is open, sticks, or slips one way; the piece's matrix takes normal and tangential forces to what its status fixes.
    """
    n, nu = len(points.weights), points.normals
    tau = np.column_stack([-nu[:, 1], nu[:, 0]])
    give = 1 / (points.weights * points.stiffness * points.step)
    for status in itertools.product((0, 1, 2, 3), repeat=n):
        basis, rows = [], []  # directions of the forces that the status leaves free, and what is then prescribed
        for i, one in enumerate(status):
            across, along = np.zeros((n, 2)), np.zeros((n, 2))
            across[i], along[i] = nu[i], tau[i]
            if one == 1:
                basis += [across.ravel(), along.ravel()]
                rows += [across.ravel(), along.ravel()]
            elif one > 1:
                basis.append((across + (1 if one == 2 else -1) * points.friction[i] * along).ravel())
                rows.append(across.ravel())
        if not rows:
            continue
        total = points.compliance + sum(np.outer(v, v) * g for v, g in zip(_normal(nu), give, strict=True))
        if np.linalg.det(np.array(rows) @ total @ np.array(basis).T) >= 0:
            continue
        force, slip = np.zeros((n, 2)), np.zeros(n)
        apart = np.zeros(n)
        for i, one in enumerate(status):
            sign = {2: 1.0, 3: -1.0}.get(one, 0.0)
            force[i] = (one > 0) * (nu[i] + sign * points.friction[i] * tau[i])
            slip[i], apart[i] = sign, one == 0
        pressure = np.sum(force * nu, axis=1)
        moved = (points.compliance @ force.ravel()).reshape(n, 2)
        scale = np.abs(moved).max()
        w = scale * slip[:, None] * tau
        r = np.where(apart, -scale * points.step, pressure / (points.weights * points.stiffness))
        return w + moved, r  # w has no normal part
    return None


def _normal(normals: Array) -> Iterator[Array]:
    for i, nu in enumerate(normals):
        out = np.zeros_like(normals)
        out[i] = nu
        yield out.ravel()


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


def test_a_run_ends_where_parts_meet_at_a_held_corner() -> None:
    contact = [{"part": "bottom", "stiffness": 1.0}, {"part": "left", "stiffness": 1.0, "quadrature": "gauss-2"}]
    contact[1]["friction"] = {"coefficient": 1.0}
    scene = build(
        {
            "mesh": {"n": [3, 1]},
            "time": {},
            "elasticity": {"lame": [1.0, 1.0]},
            "supports": {"points": [{"at": [0.0, 0.0]}], "displacement": {"top": ["free", 0.0]}},
            "contact": contact,
        }
    )
    simulation = Simulation(scene)
    assert list(simulation.steps()) and all(np.isfinite(one) for one in simulation.statistics.residuals.values())
    assert not [one for one in summary(simulation)["warnings"] if "nan" in one]


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


def step_from(scene: Scene, starts: list[Array], force: Array | None, penetration: Array | None) -> list[Array]:
    """Contact forces (points, d) of one step of the core from other forces of the step before, (points, d).

    The foundation is rigid: it stores no energy, and the balances close from any forces.
    """
    d = discretise(scene)
    out = []
    for start in starts:
        stepper = d.stepper()
        stepper.resume(start.ravel(), [1] * len(start), [0.0] * 18, 0)
        loads = list(d.load_vectors.at(scene.step, scene.step))
        if force is not None:
            vector = d.layout.vector(d.dim)
            d.layout.distribute(force.ravel(), vector)
            loads[0], loads[2] = vector, -penetration
        report = stepper.advance(*loads)
        assert report.outcome.name == "completed", report.reason
        out.append(np.reshape(stepper.contact_force, (-1, d.dim)))
    return out


@pytest.mark.parametrize("d", [2, 3])
def test_the_core_finds_the_one_solution_from_any_forces(d: int) -> None:
    scene = load("quasistatic_punch" if d == 2 else "block_3d").override(
        **{"mesh.n": 4, "time.steps": 4, "contact.stiffness": "rigid"}
    )
    simulation = Simulation(scene)
    factor = several_solutions.of_scene(simulation.discretisation, simulation.stepper).factor
    assert factor > 1
    scene = scene.override(**{"contact.friction.coefficient": 0.98 * factor * scene.contacts[0].friction.coefficient})
    rng, n = np.random.default_rng(d), len(simulation.discretisation.surface.weights)
    starts = [10 ** rng.uniform(-3, 2) * rng.normal(size=(n, d)) for _ in range(12)]
    forces = step_from(scene, starts, None, None)
    largest = np.abs(forces[0]).max()
    assert largest > 0
    assert max(np.abs(one - forces[0]).max() for one in forces) < 1e-9 * largest


PUNCH: dict[str, Any] = {"mesh.n": 4, "supports.displacement": ["top"], "contact.stiffness": "rigid"}


def test_the_core_finds_two_solutions_beyond_it() -> None:
    """A load on the contact nodes of a small body that is made to have several solutions: the core finds those it starts near."""
    scene = load("quasistatic_punch").override(**PUNCH)
    simulation = Simulation(scene)
    rough = scaled(several_solutions.condensed(simulation.discretisation, simulation.stepper), 1 / 0.3)
    factor = 1.2 * exact(rough)
    rough, scene = scaled(rough, factor), scene.override(**{"contact.friction.coefficient": factor})
    asked = turned_piece(rough)
    assert asked is not None
    free, penetration = asked
    known = solutions(rough, free, penetration)
    assert len(known) >= 2
    d = discretise(scene)
    nodes, places = np.asarray(d.mesh.nodes), np.asarray(d.surface.positions)
    force = np.zeros_like(nodes)
    at = [int(np.argmin(np.linalg.norm(nodes - one, axis=1))) for one in places]
    force[at] = np.linalg.solve(rough.compliance, free.ravel()).reshape(-1, 2)
    forces = step_from(scene, [one.force for one in known], force, penetration)
    size = max(np.abs(one.force).max() for one in known)
    reached = {min(range(len(known)), key=lambda i, f=f: np.abs(known[i].force - f).max()) for f in forces}
    assert all(min(np.abs(one.force - f).max() for one in known) < 1e-9 * size for f in forces)
    assert len(reached) >= 2


def test_the_points_of_a_step_are_those_the_core_had() -> None:
    """`several_solutions.posed` and `solutions` give the forces of the run, of a body with a support and of one that flies."""
    drop = build(
        {
            "mesh": {"shape": "square", "n": 3},
            "time": {"end": 0.3, "steps": 30},
            "inertia": {"density": 1.0},
            "elasticity": {"lame": [10.0, 50.0]},
            "initial": {"velocity": [0.4, -1.0]},
            "contact": {"part": "bottom", "stiffness": 2e3, "gap": 0.02, "friction": {"coefficient": 0.3}},
        }
    )
    for scene in (drop, load("quasistatic_punch").override(**{"mesh.n": 5, "time.steps": 8})):
        simulation, touched = Simulation(scene), 0
        for _, report in simulation.steps():
            touched += report.stick + report.slip
            points, free, penetration = several_solutions.posed(simulation.discretisation, simulation.stepper)
            (one,) = solutions(points, free, penetration)
            force = np.reshape(simulation.stepper.contact_force, (-1, 2))
            assert np.abs(one.force - force).max() <= 1e-8 * np.abs(force).max()
            if np.abs(force).max() > 1e-6:
                assert [status > 0 for status in one.status] == [status > 0 for status in simulation.stepper.status]
        assert touched > 10


def rough_and_smooth() -> tuple[list[str], list[str]]:
    """Warnings of a scene whose friction is far beyond the bound and of one below it (collective)."""
    out = []
    for mu in (1.5, 0.2):
        scene = load("quasistatic_punch").override(**{"mesh.n": 6, "time.steps": 8, "contact.friction.coefficient": mu})
        out.append([one for one in warmslip.run(scene).summary["warnings"] if "one solution" in one])
    return out[0], out[1]


def test_a_run_says_that_a_step_may_have_several() -> None:
    (output,), none = rough_and_smooth()
    assert not none
    assert output.startswith("the friction coefficient is 1.5, and every step has one solution up to 0.")
    assert "Newton's method takes the one it reaches from the forces of the step before" in output
    assert "another start" not in output
    told_of_starts = plausibility.several(2.0, 1.09, sharp=False, timed=True, now=(3, "1.4"), other=2, steps=9)[0]
    assert "surely has one solution up to 1 only (1.4 if the 3 points" in told_of_starts
    assert "(from another start in 2 of 9 steps); take shorter steps," in told_of_starts
    assert output.endswith(
        "take a softer foundation or a smaller coefficient"
    )  # no inertia: shorter steps would not help


def test_explain_says_how_much_friction_leaves_one() -> None:
    scene = load("paper_mixed").override(**{"mesh.n": 8, "time.steps": 8})
    (message,) = [one for one in cost.measured(scene).every_step if "one solution" in one]
    simulation = Simulation(scene)
    most = bound(
        replace(several_solutions.condensed(simulation.discretisation, simulation.stepper), friction=np.ones(9))
    )
    assert message.startswith("friction: one solution in every step for mu up to ")
    stated = float(message.removeprefix("friction: one solution in every step for mu up to ").split(";")[0])
    assert 0.9 * most <= stated <= most
    assert message.endswith("this scene has 0.2")
    for keys, words in (
        ({"contact.friction": {"cohesion": 1.0}}, []),
        ({"contact.friction": {"coefficient": 0.5, "kinetic": 0.2, "speed": 1.0}}, ["depends on the slip speed"]),
        ({"contact.stiffness": "rigid", "contact.quadrature": "gauss-2"}, ["share their forces in many ways"]),
    ):
        output = [one for one in cost.measured(scene.override(**keys)).every_step if "one solution" in one]
        assert len(output) == len(words)
        assert all(word in one for word, one in zip(words, output, strict=True))


@pytest.mark.mpi
def test_two_ranks_say_the_same() -> None:
    command = ["mpirun", "-n", "2", sys.executable, str(Path(__file__).resolve())]
    result = subprocess.run(
        command, env=child_environment(), text=True, capture_output=True, timeout=300, check=False, cwd=Path.cwd()
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.count(str(rough_and_smooth())) == 2, result.stdout


if __name__ == "__main__":
    print(rough_and_smooth(), flush=True)
