"""Foundations that move along and have a shape. `python test_moving_foundations.py D` checks on the ranks it has."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.boxes import along, completed, elasticity, field, forces_of, scene
from support.ranked import Checks

from warmslip import discretise
from warmslip.model.foundation import ShapeGap
from warmslip.scene.foundation_tables import ShapeTable

check = Checks()


def block(d: int, velocity: Any, initial: Any, **contact: Any) -> Any:
    """A block with a weight on a foundation, which is the motor of the scene or the other way round."""
    return scene(
        d,
        3 if d == 2 else 2,
        time={"end": 0.4, "steps": 20},
        inertia={"density": 1.0},
        elasticity=elasticity(d, 1000.0, 0.3),
        viscosity={"lame": [1.0, 1.0]},
        heat={"conductivity": 0.1},
        loads={"body": along(d, -2.0)},
        initial={"velocity": initial},
        contact={
            "part": "bottom",
            "friction": {"coefficient": 0.4},
            "friction_heating": {"share": 0.5},
            "heat_exchange": {"conductance": 0.1, "per_pressure": 0.2, "foundation_temperature": 1.0},
            "velocity": velocity,
        }
        | contact,
    )


@check
def a_belt_and_a_thrown_block_are_one_motion(d: int) -> None:
    """In the frame of the belt the block is thrown: the same forces and temperatures, and displacements that differ by V t."""
    speed = np.array([0.3, *[0.1] * (d - 2), 0.0])
    rest = [0.0] * d
    for quadrature in ("nodal", "gauss-2")[: 4 - d]:  # in space, forces at Gauss points depend on the path
        for stiffness in ("rigid", 1000.0):
            runs = [
                completed(block(d, velocity, initial, quadrature=quadrature, stiffness=stiffness), digits=6)
                for velocity, initial in ((speed.tolist(), rest), (rest, (-speed).tolist()))
            ]
            belt, thrown = runs
            if quadrature == "nodal":  # what Gauss points creep is refined or not by rounding
                # else refinement mends what is wrong
                assert belt.stepper.cost.refinements <= thrown.stepper.cost.refinements + 2
            # forces of resting Gauss points are known to the tolerance of the law, 1e-12 of the largest terms
            within = 1e-14 if quadrature == "nodal" else 1e-10
            assert np.abs(field(belt, "u") - field(thrown, "u") - 0.4 * speed).max() <= within
            assert np.abs(field(belt, "theta") - field(thrown, "theta")).max() <= within
            assert np.abs(forces_of(belt) - forces_of(thrown)).max() <= 10 * within * np.abs(forces_of(belt)).max()


@check
def the_belt_pays_for_what_it_moves(d: int) -> None:
    """Its work is the friction's heat and the energy of the block, in the balance of every step."""
    paid: list[float] = []
    one = block(d, along(d, 0.0, "0.3 + 0.1 * t"), [0.0] * d, stiffness=1000.0)
    run = completed(one, digits=6, each=lambda _, report: paid.append(report.balances.foundation_work))
    assert sum(paid) > 0.05
    assert run.statistics.residuals["energy"] <= 1e-14


@check
def a_slow_belt_under_a_symmetry_plane(d: int) -> None:
    """Nodes that a roller holds along the belt slip at its speed, however low: their friction is at its bound."""
    for quadrature in ("nodal", "gauss-2"):
        for stiffness in ("rigid", 1000.0):
            for speed in (1e-4, 1e-7, 1e-10, 1e-13)[: 4 if quadrature == "nodal" else 2]:
                one = scene(
                    d,
                    2,
                    elasticity=elasticity(d, 1.0, 0.3),
                    loads={"body": along(d, -1e-3, -1e-3)},
                    supports={"displacement": {"left": [0.0, *["free"] * (d - 1)]}}
                    | ({} if d == 2 else {"points": [{"at": [1.0, 0.5, 0.5], "displacement": ["free", 0.0, "free"]}]}),
                    contact={
                        "part": "bottom",
                        "stiffness": stiffness,
                        "quadrature": quadrature,
                        "friction": {"coefficient": 1.0},
                        "velocity": along(d, 0.0, speed),
                    },
                )
                run = completed(one, digits=6)
                surface = run.discretisation.surface
                if quadrature == "gauss-2":
                    continue  # no point has held nodes alone
                held = np.asarray(surface.positions)[:, 0] == 0
                force, normals = forces_of(run)[held], np.asarray(surface.normals)[held]
                pressing = np.sum(force * normals, axis=1)
                rubbing = force - pressing[:, None] * normals
                assert pressing.max() > 1e-5
                assert np.abs(np.linalg.norm(rubbing, axis=1) - pressing).max() <= 1e-10 * pressing.max()
                assert (rubbing[:, 0] <= 0).all()


@check
def velocities_across_the_surface_do_nothing(d: int) -> None:
    still, rising = (completed(block(d, along(d, up, 0.2), [0.0] * d, stiffness=1000.0), digits=6) for up in (0.0, 3.0))
    assert np.abs(field(still, "u") - field(rising, "u")).max() <= 1e-14


@check
def shapes_are_the_formulas_of_their_gaps(d: int) -> None:
    """Below a flat face: parabola-free formulas of circle, plane and wedge, at a place that moves."""
    x = ["x", "y"][: d - 1]
    middle = [0.4, 0.5][: d - 1]
    square = " + ".join(f"({a} - {b})**2" for a, b in zip(x, middle, strict=True))
    center = [*middle, "-2.1 + 0.1 * t"]
    tilt = [0.1, *[0.0] * (d - 2), 1.0]
    edge = {"axis": [0.0, 1.0, 0.0]} if d == 3 else {}
    shapes = {
        f"2.1 - 0.1 * t - sqrt(4 - ({square}))": {
            "shape": "cylinder" if d == 2 else "sphere",
            "at": center,
            "radius": 2.0,
        },
        "0.01 + 0.1 * x": {"shape": "plane", "at": along(d, -0.01), "normal": tilt},
        "0.02 + abs(x - 0.4)": {"shape": "wedge", "at": along(d, -0.02, 0.4), "normal": along(d, 3.0), "angle": 90.0}
        | edge,
    }
    if d == 3:
        shapes["2.05 - sqrt(4 - (x - 0.5)**2)"] = {
            "shape": "cylinder", "at": [0.5, 7.0, -2.05], "radius": 2.0, "axis": [0.0, 2.0, 0.0],
        }  # fmt: skip
    for formula, shape in shapes.items():
        gaps = []
        for gap in (formula, shape):
            d_ = discretise(
                scene(
                    d, 4, elasticity=elasticity(d, 1.0, 0.3), contact={"part": "bottom", "stiffness": 1.0, "gap": gap}
                )
            )
            gaps.append([d_.load_vectors.on_points("gap", t) for t in (0.0, 1.0)])
        assert np.abs(np.subtract(*gaps)).max() <= 1e-14, formula


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("radius", [1.0, 1e3, 1e8])
def test_gaps_to_a_nearly_flat_crown_keep_their_digits(d: int, radius: float) -> None:
    """The sagitta s^2 / (R + sqrt(R^2 - s^2)) of points at a distance s from the crest, and a gap of a millionth there."""
    gap = {"shape": "cylinder" if d == 2 else "sphere", "at": along(d, -radius, 0.5), "radius": radius}
    there = discretise(
        scene(d, 4, elasticity=elasticity(d, 1.0, 0.3), contact={"part": "bottom", "stiffness": 1.0, "gap": gap})
    )
    x = np.asarray(there.surface.positions)
    square = ((x - along(d, 0.0, 0.5))[:, : d - 1] ** 2).sum(axis=1)
    exact = square / (radius + np.sqrt(np.maximum(radius**2 - square, 0.0)))
    found = there.load_vectors.on_points("gap", 0.0)
    inside = square < radius**2
    assert np.abs(found - exact)[inside].max() <= 1e-14 * exact[inside].max()


def test_gaps_to_any_wedge_are_where_a_ray_enters_it() -> None:
    """Random wedges, faces that turn away and steps included, against points along the ray one by one."""
    random, along_ray = np.random.default_rng(5), np.linspace(-3, 3, 60001)
    compared = 0
    for _ in range(40):
        top, at, angle = random.normal(size=2), random.uniform(-0.5, 0.5, 2), random.uniform(20, 160)
        wedge = {"shape": "wedge", "at": at.tolist(), "normal": top.tolist(), "angle": angle}
        x = np.array([[0.0, 0.0]])
        gap = float(ShapeGap(ShapeTable(**wedge), np.array([[0.0, -1.0]]))(x, 0.0)[0])
        ray = np.column_stack([0 * along_ray, -along_ray]) - at
        unit = top / np.linalg.norm(top)
        inside = ray @ -unit >= np.cos(np.deg2rad(angle / 2)) * np.linalg.norm(ray, axis=1)
        if not inside.any() or inside[0] or along_ray[inside].max() < 0:
            assert gap > 0
            continue
        compared += 1
        assert gap == pytest.approx(along_ray[inside].min(), abs=2e-4), wedge
    assert compared > 8


def test_a_point_deeper_than_the_centre_of_a_circle_is_inside() -> None:
    circle = ShapeTable(shape="cylinder", at=[0.0, 0.2], radius=1.0)
    x, down = np.array([[0.0, 0.0], [0.3, 0.2], [0.0, 1.5]]), np.tile([0.0, -1.0], (3, 1))
    gap = ShapeGap(circle, down)(x, 0.0)
    assert gap[:2] == pytest.approx([-1.2, -np.sqrt(1 - 0.09)], abs=1e-15)
    assert gap[2] == pytest.approx(0.3, abs=1e-15)


def test_what_a_shape_does_not_meet_is_away() -> None:
    """Points beside a circle, and points that face away from it, touch nothing."""
    gap = {"shape": "cylinder", "at": [0.5, -0.3], "radius": 0.2}
    for part, reach in (("bottom", 0.09), ("top", 0.3), ("left", 0.3)):
        d = discretise(
            scene(2, 8, elasticity=elasticity(2, 1.0, 0.3), contact={"part": part, "stiffness": 1.0, "gap": gap})
        )
        assert d.load_vectors.on_points("gap", 0.0).min() > reach, part


@pytest.mark.parametrize(
    ("contact", "message"),
    [
        ({"velocity": [1.0, 0.0]}, "nothing feels the motion"),
        ({"velocity": [1.0, 0.0, 0.0], "friction": {"coefficient": 0.1}}, "has 3 components"),
        ({"gap": {"shape": "sphere", "at": [0.0, 0.0]}}, "a sphere needs its radius"),
        ({"gap": {"shape": "sphere", "at": ["x", 0.0], "radius": 1.0}}, "depends on the place"),
        ({"gap": {"shape": "plane", "at": [0.0, 0.0], "normal": [0.0, 0.0]}}, "zero vector"),
        ({"gap": {"shape": "plane", "at": [0.0, 0.0], "normal": [0.0, 1.0], "radius": 1.0}}, "has no radius"),
        ({"gap": {"shape": "cylinder", "at": [0.0, 0.0], "radius": 1.0, "axis": [0.0, 1.0]}}, "axis is that of z"),
    ],
)
def test_what_makes_no_sense_is_refused(contact: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        scene(2, 2, elasticity=elasticity(2, 1.0, 0.3), contact={"part": "bottom", "stiffness": 1.0} | contact)


test_on_one_rank, test_on_two_ranks = check.tests(__file__)

if __name__ == "__main__":
    check.main()
