"""Rollers, symmetry planes, smooth guides, held points and springs. `python test_component_supports.py D` checks on its ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree
from support.boxes import along, body, completed, elasticity, field, fields, misses, turned
from support.guided import SIDES, guides, planes, pressed
from support.ranked import Checks

from warmslip import _core, discretise
from warmslip.scene.reader import build
from warmslip.simulation.simulation import Simulation

check = Checks()


@check
def a_block_between_rollers_strains_evenly(d: int) -> None:
    ends = {"bottom": along(d, 0.0, "free"), "top": along(d, "-0.01 * t", "free")}
    if d == 3:
        ends = {"bottom": ["free", "free", 0.0], "top": ["free", "free", "-0.01 * t"]}
    simulation = completed(pressed(d, planes(d) | ends))
    x = np.asarray(simulation.discretisation.mesh.nodes)
    sideways = 0.01 * (0.3 / 0.7 if d == 2 else 0.3)  # plane strain, and uniaxial stress in space
    exact = x * np.array([sideways] * (d - 1) + [-0.01])
    assert np.abs(field(simulation, "u") - exact).max() <= 1e-15


@check
def guides_may_be_inclined(d: int) -> None:
    """The body, its supports and its loads turned: the turned answer, with inertia, viscosity and heat that strains."""
    for coupling in ("staggered", "monolithic"):
        ends = {"bottom": {"normal": 0.0}, "top": {"normal": "0.01 * sin(3 * t)"}}
        one = pressed(
            d,
            guides(d) | ends,
            n=3,
            time={"steps": 4, "coupling": coupling},
            inertia={"density": 1.0},
            viscosity={"lame": [0.2, 0.3]},
            heat={"conductivity": 1.0, "source": 2.0, "expansion": {"tensor": 0.3}, "heating": {"tensor": -0.2}},
            supports={"displacement": guides(d) | ends, "temperature": ["top"]},
            loads={"body": along(d, -0.5, 0.3)},
        )
        angle = 0.6
        turn = np.eye(d)
        turn[np.ix_([0, d - 1], [0, d - 1])] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        if d == 3:
            turn = turn @ np.array([[np.cos(0.4), -np.sin(0.4), 0], [np.sin(0.4), np.cos(0.4), 0], [0, 0, 1]])
        upright = completed(one)
        other, mesh = turned(one, turn)
        inclined = completed(other, mesh=mesh)
        expected = fields(upright)
        for name in ("u", "w"):
            expected[name] = expected[name] @ turn.T
        assert max(misses(fields(inclined), expected).values()) <= 1e-13
        for run in (upright, inclined):
            assert abs(run.statistics.residuals["energy"]) <= 1e-14
        reactions = [run.discretisation.field(run.stepper.reactions) for run in (upright, inclined)]
        assert np.abs(reactions[1] - reactions[0] @ turn.T).max() <= 1e-12 * np.abs(reactions[0]).max()


def mirrored(d: int, mesh: Any, axes: Any = None) -> Any:
    """The mesh with its mirror images across some axes, all but the last for None; of the parts those that stay outside."""
    keep = ("bottom", "top") if axes is None else ("hole", "right")
    nodes, cells, parts = (
        np.asarray(mesh.nodes),
        np.asarray(mesh.cells),
        {k: np.asarray(v) for k, v in mesh.parts.items()},
    )
    for axis in range(d - 1) if axes is None else axes:
        image = nodes * np.where(np.arange(d) == axis, -1.0, 1.0)
        distance, same = cKDTree(nodes).query(image)
        new = np.flatnonzero(distance > 1e-9)
        number = np.where(distance > 1e-9, 0, same)
        number[new] = len(nodes) + np.arange(len(new))
        nodes = np.vstack([nodes, image[new]])
        turned_over = number[cells]
        turned_over[:, :2] = turned_over[:, 1::-1].copy()
        cells = np.vstack([cells, turned_over])
        parts = {name: np.vstack([facets, number[facets]]) for name, facets in parts.items() if name in keep}
    return getattr(_core, f"Mesh{d}").from_lists(nodes, cells, parts)


@check
def the_operator_with_inclined_supports_is_symmetric(d: int) -> None:
    """Rows and columns of the held directions are those of a multiple of the projector."""
    skew = np.ones(d) / np.sqrt(d)
    turn = np.eye(d) - 2 * np.outer(skew, skew)  # a reflection
    turn[:, 0] *= -1
    one = pressed(d, guides(d), n=2, loads={"body": along(d, -1.0)}, viscosity={"lame": [0.2, 0.3]})
    other, mesh = turned(one, turn)
    d_ = discretise(other, mesh=mesh)
    matrix = _core.momentum_matrix(d_.layout, d_.problem, d_.operators, 0.1)
    supports = d_.load_vectors.supports
    held = np.zeros((len(d_.mesh.nodes), d))
    held[supports.nodes] = supports.projectors @ np.arange(1.0, d + 1)
    given, out, back = (d_.distributed(held), d_.distributed(held), d_.distributed(held))
    matrix.mult(given, out)
    matrix.multTranspose(given, back)
    size = matrix.norm()
    assert (out - back).norm() <= 1e-15 * size
    rows = d_.field(out)
    assert np.abs(np.delete(rows, supports.nodes, axis=0)).max() <= 1e-15 * size
    left = rows[supports.nodes] - np.einsum("nab,nb->na", supports.projectors, rows[supports.nodes])
    assert np.abs(left).max() <= 1e-15 * size
    assert np.abs(rows[supports.nodes]).sum(axis=1).min() > 1e-3 * size / len(rows)


@check
def a_part_of_a_body_on_symmetry_planes_is_the_whole_body(d: int) -> None:
    """Half a block in the plane and a quarter in space on a rounded foundation, with friction."""
    top = {"top": ["free"] * (d - 1) + ["-0.05 * t"]}
    pins = [{"at": [0.0] * (d - 1) + [1.0], "displacement": [0.0] * (d - 1) + ["free"]}]
    if d == 3:  # and against a turn about the last axis
        pins.append({"at": [1.0, 0.0, 1.0], "displacement": ["free", 0.0, "free"]})
    for quadrature in ("nodal", "gauss-2"):
        for stiffness in ("rigid", 100.0):
            if (d, quadrature) == (3, "gauss-2"):
                continue  # Gauss points of a triangle do not mirror
            contact = {
                "part": "bottom",
                "stiffness": stiffness,
                "quadrature": quadrature,
                "friction": {"coefficient": 0.3},
                "gap": " + ".join(f"0.1 * {x}**2" for x in "xy"[: d - 1]),
            }
            one = pressed(d, planes(d) | top, n={2: 6, 3: 2}[d], contact=contact)
            part = completed(one)
            other = one.override(supports={"displacement": top, "points": pins})
            whole = completed(other, mesh=mirrored(d, part.discretisation.mesh))
            nodes = [np.asarray(run.discretisation.mesh.nodes) for run in (part, whole)]
            distance, nearest = cKDTree(nodes[1]).query(nodes[0])
            assert distance.max() <= 1e-12
            difference = np.abs(field(whole, "u")[nearest] - field(part, "u")).max()
            assert difference <= 1e-12 * np.abs(field(part, "u")).max(), (quadrature, stiffness, difference)


def plate(radius: float, side: float, n: int) -> Any:
    """A quarter of a square plate with a round hole about the origin; parts hole, left, bottom, and right outside."""
    angles, shares = np.linspace(0, np.pi / 2, 2 * n + 1), np.linspace(0, 1, n + 1) ** 1.5
    inner = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    outer = side * inner / np.abs(inner).max(axis=1, keepdims=True)
    nodes = (inner[:, None] + shares[None, :, None] * (outer - inner)[:, None]).reshape(-1, 2)
    nodes[np.abs(nodes) < 1e-15] = 0.0
    number = np.arange(len(nodes)).reshape(2 * n + 1, n + 1)
    a, b, c, e = (block.ravel() for block in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    cells = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, e])])

    def line(along: Any) -> Any:
        return np.column_stack([along[:-1], along[1:]])

    parts = {
        "hole": line(number[:, 0]),
        "right": line(number[:, -1]),
        "bottom": line(number[0]),
        "left": line(number[-1]),
    }
    return _core.Mesh2.from_lists(nodes, cells, parts)


def test_a_quarter_of_a_plate_with_a_hole_is_the_whole_plate() -> None:
    """A hole that presses on a soft pin, and a pull outside."""
    quarter = plate(0.3, 1.0, 6)
    base = {
        "mesh": {"file": "plate_with_hole.msh"},
        "time": {"steps": 3},
        "elasticity": elasticity(2, 10.0, 0.3),
        "loads": {"traction": {"right": ["0.2 * x", "0.1 * y"]}},
        "contact": {"part": "hole", "stiffness": 50.0, "gap": -0.01},
    }
    pins = [{"at": [0.3, 0.0], "displacement": ["free", 0.0]}, {"at": [0.0, 0.3], "displacement": [0.0, "free"]}]
    part = completed(
        build(base | {"supports": {"displacement": {"left": [0.0, "free"], "bottom": ["free", 0.0]}}}), mesh=quarter
    )
    whole = completed(build(base | {"supports": {"points": pins}}), mesh=mirrored(2, quarter, (0, 1)))
    nodes = [np.asarray(run.discretisation.mesh.nodes) for run in (part, whole)]
    _, nearest = cKDTree(nodes[1]).query(nodes[0])
    difference = np.abs(field(whole, "u")[nearest] - field(part, "u")).max()
    assert difference <= 1e-12 * np.abs(field(part, "u")).max()


@check
def springs_and_dashpots_are_what_they_say(d: int) -> None:
    """A block between a spring and a load: the spring's shortening, and the creep of a dashpot."""
    load = -2.0
    held = {
        "displacement": planes(d),
        "springs": {"bottom": {"normal_stiffness": 40.0, "normal_damping": 8.0}},
    }
    one = pressed(d, {}, supports=held, loads={"traction": {"top": along(d, load)}}, time={"end": 2.0, "steps": 50})
    simulation = completed(one)
    k, displacement = 2.0 / 50, 0.0
    for _ in range(50):  # (40 + 8/k) u_n = load + 8/k u_{n-1}, the body follows at once
        displacement = (load + 8.0 / k * displacement) / (40.0 + 8.0 / k)
    x = np.asarray(simulation.discretisation.mesh.nodes)
    u = field(simulation, "u")[:, -1]
    modulus = 10.0 / (1 - 0.3**2) if d == 2 else 10.0
    assert np.abs(u - (displacement + load / modulus * x[:, -1])).max() <= 1e-12
    tensor = {"stiffness": along(d, 40.0), "damping": along(d, 8.0)}
    other = completed(pressed(d, {}, supports=held | {"springs": {"bottom": tensor}}, loads=one.loads, time=one.time))
    assert np.abs(field(other, "u")[:, -1] - u).max() <= 1e-12


@check
def a_body_with_inertia_turns_about_the_points_that_hold_it(d: int) -> None:
    """A held corner, a hinge, a corner that moves: as with a spring too weak to matter, which leaves no rigid motion."""
    corner, other = [0.0] * (d - 1) + [1.0], [0.0] * (d - 2) + [1.0, 1.0]
    moving = ["0.01 * sin(3 * t)", *["0.002 * t"] * (d - 1)]
    held: list[list[dict[str, Any]]] = [
        [{"at": corner}],
        [{"at": corner, "displacement": moving}],
        [{"at": corner, "displacement": ["free", *[0.0] * (d - 1)]}],
    ]
    if d == 3:
        held.append([{"at": corner}, {"at": other}])
    warm = {"conductivity": 1.0, "capacity": 1.0, "expansion": {"tensor": 0.1}, "heating": {"tensor": -0.1}}
    for points in held:
        for density, coupling in [(1e-3, "staggered"), (1.0, "monolithic"), (1e3, "staggered"), (1e6, "lagged")]:
            one = pressed(
                d,
                {},
                n=3 if d == 2 else 2,
                supports={"points": points},
                time={"steps": 3, "coupling": coupling},
                inertia={"density": density},
                loads={"body": along(d, -2e-3, -1e-3)},
                heat=warm,
            )
            simulation = completed(one)
            assert simulation.stepper.cost.refinements == 0
            u = field(simulation, "u")
            x = np.asarray(simulation.discretisation.mesh.nodes)
            end = [0.01 * np.sin(3.0), *[0.002] * (d - 1)]
            for point in points:
                here = np.argmin(np.abs(x - point["at"]).max(axis=1))
                for value, given, exact in zip(u[here], point.get("displacement", [0.0] * d), end, strict=True):
                    if given != "free":
                        assert abs(value - (exact if given else 0.0)) <= 1e-15 * max(1.0, np.abs(u).max())
            springs = {"springs": {"top": {"stiffness": 1e-11}}}
            near = field(completed(one.override(supports={"points": points} | springs), digits=0.0), "u")
            assert np.abs(near - u).max() <= 1e-6 * np.abs(u).max(), (points, density)


@check
def a_body_one_cell_thick_falls_between_guides(d: int) -> None:
    """Every node is held across the fall, in steps far longer than waves need: backward Euler's fall, without a strain."""
    turn = np.linalg.qr(np.array([[0.8, -0.6, 0.1], [0.5, 0.7, -0.3], [0.2, 0.4, 0.9]])[:d, :d])[0]
    turn *= np.linalg.det(turn) if d == 3 else [np.linalg.det(turn), 1.0]
    sides = ("left", "right")
    for supports, axes in (
        ({"displacement": {side: [0.0, *["free"] * (d - 1)] for side in sides}}, np.eye(d)),
        ({"displacement": {side: {"normal": 0.0} for side in sides}}, turn),
        ({"springs": {side: {"normal_stiffness": 1e3} for side in sides}}, turn),
    ):
        one = pressed(
            d,
            {},
            mesh=body(d, [1, *[3] * (d - 1)]) | {"lengths": [0.2, *[1.0] * (d - 1)]},
            elasticity=elasticity(d, 1e6, 0.3),
            inertia={"density": 1e-3},
            supports=supports,
            loads={"body": along(d, -1e-3)},
        )
        there, mesh = turned(one, axes)
        simulation = completed(there, mesh=mesh)
        k, n = 0.25, 4
        fall = np.asarray(along(d, -k * k * n * (n + 1) / 2))
        assert np.abs(field(simulation, "u") @ axes - fall).max() <= 1e-12


@check
def a_component_at_rest_has_no_velocity_at_the_start(d: int) -> None:
    """Whether another component of its support is a formula or a number."""
    ends = []
    for last in (0.0, "0 * t"):
        one = pressed(
            d,
            {"top": along(d, last, 0.0)},
            inertia={"density": 1.0},
            initial={"velocity": along(d, 0.0, 1e-3)},
        )
        ends.append(field(completed(one), "u"))
    assert np.abs(ends[1] - ends[0]).max() <= 1e-13 * np.abs(ends[0]).max()


@check
def what_supports_leave_free_is_seen(d: int) -> None:
    """A body without inertia that its rollers let slide is refused; with inertia it slides."""
    sliding = pressed(d, {"bottom": along(d, 0.0, "free") if d == 2 else ["free", "free", 0.0]})
    with pytest.raises(ValueError, match="nothing holds the body"):
        Simulation(sliding)
    for steps in (4, 1):  # short steps and long ones
        free = sliding.override(
            **{"inertia.density": 1e-3, "loads.body": along(d, 0.0, 0.5), "time.steps": steps, "time.end": 1e4}
        )
        simulation = completed(free)
        u = field(simulation, "u")
        n, k = steps, 1e4 / steps
        exact = 500.0 * k * k * n * (n + 1) / 2
        assert np.abs(u[:, 0] - exact).max() <= 1e-13 * exact
        assert np.abs(u[:, 1:]).max() <= 1e-14 * exact
        assert simulation.discretisation.field(simulation.stepper.strained) is not None


@check
def supports_that_part_in_a_run_end_it_by_their_name(d: int) -> None:
    """They agree at t = 0, 1/2 and 1, where they are compared beforehand, and not at t = 3/4; states before are kept."""
    apart = {"left": along(d, "free", "t * (1 - t) * (t - 0.5) * (t > 0.6)"), "top": along(d, "-0.01 * t")}
    simulation = Simulation(pressed(d, apart, n=2))
    taken = len(list(simulation.steps()))
    assert (simulation.outcome, taken, simulation.failure["step"]) == ("supports_contradict", 2, 3)  # type: ignore[index]
    assert "contradict each other at t = 0.75" in simulation.failure["reason"]  # type: ignore[index]
    top = np.asarray(simulation.discretisation.mesh.nodes)[:, -1] == 1
    assert field(simulation, "u")[top, -1] == pytest.approx(-0.005, rel=1e-12)
    undefined = Simulation(pressed(d, {"top": along(d, "1 / (0.75 - t) * 0")}, n=2))
    assert len(list(undefined.steps())) == 2 and undefined.outcome == "data_not_finite"


def test_supports_that_meet() -> None:
    """They are joined where they agree, in any order, and refused with the place where they do not."""
    agree = {"left": ["0.1 * t", "free"], "top": ["0.1 * t", "-0.02 * t"], "bottom": [0.0, "free"]}
    with pytest.raises(
        ValueError, match=r"'left' and 'bottom' hold their common node at \(0, 0\).*'bottom' 0 along \(1, 0\)"
    ):
        discretise(pressed(2, agree))
    agree["bottom"] = ["free", 0.0]
    results = [field(completed(pressed(2, dict(order))), "u") for order in (agree.items(), reversed(agree.items()))]
    assert np.abs(results[0] - results[1]).max() <= 1e-16
    assert results[0][0] == pytest.approx([0.1, 0.0], abs=1e-15)


def test_dashpots_alone_hold_a_body_without_inertia() -> None:
    simulation = completed(
        pressed(2, {}, supports={"springs": {"top": {"damping": 1.0}}}, loads={"body": [0.3, -1.0]}, time={"steps": 4})
    )
    top = np.asarray(simulation.discretisation.mesh.nodes)[:, 1] == 1
    moved = field(simulation, "w")[top]
    assert moved[:, 1].mean() == pytest.approx(-1.0, rel=1e-3)


@pytest.mark.parametrize("d", [2, 3])
def test_a_plane_in_two_parts_guides_as_in_one(d: int) -> None:
    """An inclined bottom with coordinates of seven digits, cut into two parts of the mesh."""
    one = pressed(d, {"bottom": {"normal": 0.0}}, n=4, loads={"body": along(d, -1.0, 0.2)}, inertia={"density": 1.0})
    turn = np.eye(d)
    turn[np.ix_([0, d - 1], [0, d - 1])] = [[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]]
    _, mesh = turned(one, turn)
    nodes, bottom = np.round(np.asarray(mesh.nodes), 7), np.asarray(mesh.parts["bottom"])
    first = (nodes[bottom] @ turn)[:, :, 0].mean(axis=1) < 0.5
    parts = {"bottom": bottom} | {"left": bottom[first], "right": bottom[~first]}
    ends = []
    for names in (["bottom"], ["left", "right"]):
        there = getattr(_core, f"Mesh{d}").from_lists(nodes, mesh.cells, {name: parts[name] for name in names})
        guided = one.override(supports={"displacement": {name: {"normal": 0.0} for name in names}})
        ends.append(field(completed(guided, mesh=there), "u"))
    assert np.abs(ends[0] - ends[1]).max() <= 1e-9 * np.abs(ends[0]).max()


def tilt(d: int, angle: float) -> Any:
    """A rotation in the plane of the first and the last axis."""
    turn = np.eye(d)
    turn[np.ix_([0, d - 1], [0, d - 1])] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return turn


def turns_alike(one: Any, turn: Any, apart: float = 1e-13, digits: float = 8.0) -> None:
    """The body with its supports and loads turned completes with the turned answer."""
    upright = field(completed(one, digits), "u") @ turn.T
    other, mesh = turned(one, turn)
    inclined = field(completed(other, digits, mesh=mesh), "u")
    assert np.abs(inclined - upright).max() <= apart * np.abs(upright).max()


@check
def a_body_rests_between_inclined_guides(d: int) -> None:
    """Where nothing moves any more a velocity is rounding, and what a guide prescribes of it holds all the same."""
    still = guides(d) | {"top": {"normal": 0.0}}
    for more in (
        {},
        {"viscosity": {"lame": [0.2, 0.3]}},
        {"inertia": {"density": 1.0}, "time": {"end": 1e4, "steps": 10}},
    ):
        one = pressed(d, still, n=2, **{"time": {"steps": 10}, "loads": {"body": along(d, -2e-3, 1e-3)}} | more)
        turns_alike(one, tilt(d, 0.3))
    springs = {"displacement": guides(d), "springs": {"top": {"stiffness": 1.0}}}
    turns_alike(
        pressed(d, {}, n=2, supports=springs, time={"steps": 10}, loads={"body": along(d, -2e-3, 1e-3)}), tilt(d, 0.3)
    )


@check
def a_guide_drives_a_body_that_is_free_along_it(d: int) -> None:
    """In steps far longer than its waves need."""
    speed, end = 1e-5, 1e3
    sides = guides(d) | {SIDES[d][0]: {"normal": f"{speed} * t"}}
    one = pressed(
        d,
        sides,
        n=2,
        elasticity=elasticity(d, 1.0, 0.3),
        inertia={"density": 1.0},
        time={"end": end, "steps": 2},
        loads={"body": along(d, 0.0)},
    )
    turn = tilt(d, 0.3)
    other, mesh = turned(one, turn)
    u = field(completed(other, mesh=mesh), "u") @ turn
    way = along(d, 0.0, -speed * end)  # the normal points outwards
    assert np.abs(u - way).max() <= 1e-4 * speed * end  # it strains by rho / k^2
    turns_alike(one, turn)


@check
def a_guide_may_lie_askew_by_a_hair(d: int) -> None:
    """As that of a mesh whose file has eight digits does."""
    one = pressed(
        d,
        guides(d) | {"top": {"normal": 0.0}},
        n=2,
        inertia={"density": 1.0},
        loads={"body": along(d, -1e-3, 1e-3)},
        contact={"part": "bottom", "stiffness": 1.0, "friction": {"coefficient": 0.3}},
    )
    for angle in (1e-14, 1e-10, 1e-9, 1e-8, 1e-7, 1e-5):
        turns_alike(one, tilt(d, angle))


@check
def cohesion_beside_an_inclined_guide(d: int) -> None:
    """The guide stands on the contact part: along it rounding is no slip."""
    for n, stiffness in ((1, 1.0), (3, 1.0), (2, "rigid")):
        for friction in ({"cohesion": 1e-4}, {"coefficient": 0.3, "cohesion": 1e-4}):
            one = pressed(
                d,
                guides(d),
                n=n,
                elasticity=elasticity(d, 1.0, 0.3),
                time={"steps": 2},
                loads={"body": along(d, -1e-2, 1e-3)},
                contact={"part": "bottom", "stiffness": stiffness, "friction": friction},
            )
            turns_alike(one, tilt(d, 0.3), apart=1e-10)


def test_every_component_free_is_no_support() -> None:
    with pytest.raises(ValueError, match="every component is free"):
        pressed(2, {"left": ["free", "free"]})


test_on_one_rank, test_on_two_ranks = check.tests(__file__)

if __name__ == "__main__":
    check.main()
