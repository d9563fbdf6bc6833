"""Contact of bodies that supports hold in part. `python test_contact_beside_supports.py D` checks on its ranks."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from support.boxes import along, body, completed, elasticity, field, turned
from support.guided import SIDES, guides, planes, pressed
from support.ranked import Checks

from warmslip import discretise
from warmslip.simulation import summary
from warmslip.simulation.simulation import Simulation

check = Checks()


@check
def weak_and_stiff_springs(d: int) -> None:
    """Springs that only keep a pressed body from sliding away leave its weight to the contact; stiff ones guide it.

    The axes may lie askew to the body: rounding of a force along one side is then part of that along the other.
    """
    turn = np.linalg.qr(np.array([[0.8, -0.6, 0.1], [0.5, 0.7, -0.3], [0.2, 0.4, 0.9]])[:d, :d])[0]
    turn *= np.linalg.det(turn) if d == 3 else [np.linalg.det(turn), 1.0]
    sides = [*SIDES[d], *(["right"] if d == 2 else ["right", "back"])]
    contact = {"part": "bottom", "stiffness": 1e3, "friction": {"coefficient": 0.3}}
    cases: list[tuple[dict[str, float], float]] = [
        ({"stiffness": 10.0**-n}, 1e-3) for n in ((4, 6, 9, 12) if d == 2 else (4, 8, 12))
    ]
    for spring, share in [*cases, ({"normal_stiffness": 1e6}, 1e-9)]:
        ends = []
        for axes in (np.eye(d), turn):
            one = pressed(
                d,
                {},
                n=4 if d == 2 else 3,
                elasticity=elasticity(d, 1.0, 0.3),
                supports={"springs": dict.fromkeys(sides, spring)},
                loads={"body": along(d, -0.01, 0.003)},
                contact=contact,
            )
            there, mesh = turned(one, axes)
            simulation = completed(there, digits=7.0, mesh=mesh)
            stated = summary.digits(simulation.statistics.trusted(simulation.stepper.extents))
            assert min(stated["stress"], stated["contact_force"]) >= 9, (spring, stated)
            assert simulation.report.normal_force == pytest.approx(0.01, rel=share)
            ends.append(field(simulation, "u") @ axes)
        assert np.abs(ends[1] - ends[0]).max() <= 1e-7 * np.abs(ends[0]).max(), spring
    penalty = pressed(
        d,
        {},
        n=4 if d == 2 else 3,
        elasticity=elasticity(d, 1.0, 0.3),
        supports={"springs": {side: {"normal_stiffness": 1e7} for side in sides}},
        loads={"body": along(d, -0.01, 0.003)},
        contact=contact,
    )
    one, mesh = turned(penalty, turn)
    simulation = Simulation(one, discretisation=discretise(one, mesh=mesh))
    assert len(list(simulation.steps())) == 4, simulation.failure


@check
def a_weak_spring_along_the_floor(d: int) -> None:
    """A block without inertia rests on a rough floor, which leaves it no place along it; a weak spring hardly holds it."""
    for spring, friction, gap in itertools.product((1e-6, 1e-9, 1e-12, 1e-15), (0.0, 0.01, 0.2, 1.0), (0.0, 0.01)):
        if friction == 0 and spring < 1e-12:
            continue  # where it stands hangs on rounding
        one = pressed(
            d,
            {},
            n=2,
            time={"steps": 1},
            elasticity=elasticity(d, 1.0, 0.3),
            supports={"springs": {"top": {"stiffness": [*[spring] * (d - 1), 0.0]}}},
            loads={"body": along(d, -1e-3)},
            contact={"part": "bottom", "stiffness": 5.0, "gap": gap, "friction": {"coefficient": friction}},
        )
        simulation = completed(one, digits=0.0)
        assert simulation.report.normal_force == pytest.approx(1e-3, rel=1e-9), (spring, friction, gap)
        stated = summary.digits(simulation.statistics.trusted(simulation.stepper.extents))
        assert min(stated["stress"], stated["contact_force"]) >= 10, (spring, friction, gap, stated)


@check
def a_weak_spring_stops_a_slide_and_no_flight(d: int) -> None:
    """It bears what friction leaves of a push, however far the body goes, and nothing across its axis."""
    for spring in (1e-6, 1e-16):
        keys = {
            "n": 1,
            "time": {"steps": 1},
            "elasticity": elasticity(d, 1.0, 0.3),
            "supports": {"springs": {"top": {"stiffness": [*[spring] * (d - 1), 0.0]}}},
            "contact": {"part": "bottom", "stiffness": 5.0, "friction": {"coefficient": 0.2}},
        }
        pushed = completed(pressed(d, {}, loads={"body": along(d, -1e-3, 3e-4)}, **keys), digits=4.0)
        assert field(pushed, "u")[:, 0].mean() == pytest.approx(1e-4 / spring, rel=1e-2)
        simulation = Simulation(pressed(d, {}, loads={"body": along(d, 1e-3)}, **keys))
        assert not list(simulation.steps())
        assert simulation.outcome == "unsupported"


@check
def a_spring_along_a_roller(d: int) -> None:
    """Rollers bear a load that is large beside the spring; what they leave free has no part against them."""
    spring, warm = 5e-10, {"conductivity": 1.0, "expansion": {"tensor": 1e-4, "reference_temperature": 1.0}}
    for load in (0.0, 1e-8):
        one = pressed(
            d,
            {"top": [*["free"] * (d - 1), 0.0]},
            n=1,
            time={"steps": 1},
            elasticity=elasticity(d, 1.0, 0.3),
            heat=warm,
            initial={"temperature": 1.02},
            loads={"body": along(d, -4e-8, load)},
            contact={"part": "bottom", "stiffness": 0.5},
        )
        one = one.override(**{"supports.springs": {"top": {"stiffness": [*[spring] * (d - 1), 0.0]}}})
        u = field(completed(one, digits=12.0), "u")
        top = np.asarray(discretise(one).mesh.parts["top"])
        mean = u[top].mean(axis=(0, 1))  # facets have one size: the mean over the part
        assert abs(mean[0] - load / spring) <= 1e-13 * max(np.abs(u).max(), load / spring)


@check
def a_hard_block_on_weak_springs_between_two_foundations(d: int) -> None:
    """Half of the body is a thousand or a hundred million times as stiff as the other, which springs hold."""
    for contrast, spring, friction in ((1e3, 1e-2, 0.3), (1e8, 1e-2, 0.0), (1e8, 1e-10, 0.3)):
        for quadrature in ("nodal", "gauss-2"):
            one = pressed(
                d,
                {},
                elasticity=elasticity(d, 1.0, 0.3),
                regions={"hard": {"where": "x > 0.5", "elasticity": elasticity(d, contrast, 0.3)}},
                supports={"springs": {"left": {"stiffness": spring}}},
                contact=[
                    {"part": "top", "stiffness": "rigid", "quadrature": quadrature},
                    {
                        "part": "bottom",
                        "stiffness": 1e3,
                        "gap": -1e-3,
                        "quadrature": quadrature,
                        "friction": {"coefficient": friction},
                    },
                ],
            )
            force = np.asarray(completed(one, digits=6.0).stepper.contact_force).reshape(-1, d)[:, d - 1]
            assert -force[force < 0].sum() == pytest.approx(force[force > 0].sum(), rel=1e-3)


@check
def a_strip_pinched_between_two_foundations(d: int) -> None:
    """Forces from both sides each move a strip far that a weak spring holds, and together press it evenly."""
    sides = [[4.0, 0.1], [4.0, 1.0, 0.1]][d - 2]
    modulus = 1 / (1 - 0.3**2) if d == 2 else 1.0  # across the strip, which is free to widen
    for stiffness in (1e2, 1e4, 1e7):
        for spring in (1e-3, 1.0):
            one = pressed(
                d,
                {},
                mesh=body(d, 2) | {"lengths": sides},
                time={"steps": 1},
                elasticity=elasticity(d, 1.0, 0.3),
                supports={"springs": {"left": {"stiffness": spring}}},
                contact=[
                    {"part": "top", "stiffness": "rigid"},
                    {"part": "bottom", "stiffness": stiffness, "gap": -2.8e-7},
                ],
            )
            simulation = completed(one, digits=6.0)
            force = np.asarray(simulation.stepper.contact_force).reshape(-1, d)[:, d - 1]
            area = np.prod(sides[:-1])
            even = 2.8e-7 * area / (0.1 / modulus + 1 / stiffness)
            assert [-force[force < 0].sum(), force[force > 0].sum()] == pytest.approx([even] * 2, rel=0.02)


@check
def points_whose_nodes_are_held_in_different_ways(d: int) -> None:
    """A direction in which a roller holds one node and a clamp the other is held at the points between, whatever the law."""
    held: dict[str, Any] = {"left": [0.0, *["free"] * (d - 1)]}
    if d == 3:
        held |= {"front": ["free", 0.0, "free"], "back": ["free", 0.0, "free"]}
    smooth = {"coefficient": 0.0}
    for quadrature in ("gauss-1", "gauss-2"):
        ends = []
        rough = [{"coefficient": 0.3, "regularisation": 1e-3}] if d == 2 else []  # in space some points slip
        for friction in (smooth, smooth | {"regularisation": 1e-3}, *rough):
            one = pressed(
                d,
                {},
                n=1,
                elasticity=elasticity(d, 1.0, 0.3),
                supports={"displacement": held, "points": [{"at": [1.0] * d}]},
                loads={"body": along(d, 0.002)},
                contact={"part": "top", "stiffness": "rigid", "quadrature": quadrature, "friction": friction},
            )
            ends.append(field(completed(one), "u"))
        assert ends[0].any()
        for u in ends[1:]:
            assert np.abs(u - ends[0]).max() <= 1e-9 * np.abs(ends[0]).max()


@check
def a_hard_inset_of_a_body_on_rollers(d: int) -> None:
    """A contact bears a body that rollers guide, whatever the stiffness of a part of it: it ends as that of a rigid one."""
    ends = []
    for young in (1e6, 1e8, 1e10):
        hard = {"where": "abs(x - 0.5) < 0.3", "elasticity": elasticity(d, young, 0.0)}
        one = pressed(
            d,
            planes(d),
            n=[6, *[2] * (d - 1)],
            mesh=body(d, [6, *[2] * (d - 1)]) | {"lengths": [1.0, *[0.1] * (d - 1)]},
            elasticity=elasticity(d, 1.0, 0.0),
            regions={"hard": hard},
            loads={"body": along(d, -0.0075)},
            contact={"part": "bottom", "stiffness": 2.0},
        )
        simulation = completed(one, digits=4.0)
        assert simulation.report.normal_force == pytest.approx(0.0075 * 0.1 ** (d - 1), rel=1e-9)
        ends.append(field(simulation, "u"))
    for u in ends[1:]:
        assert np.abs(u - ends[0]).max() <= 1e-5 * np.abs(ends[0]).max()


@check
def points_beside_a_roller_share_the_least_friction(d: int) -> None:
    """Points at rest have the friction of least size that puts what it does on what the roller leaves free."""
    for n, quadrature, inclined in ((1, "gauss-2", False), (2, "gauss-3" if d == 2 else "gauss-2", True)):
        contact = {"part": "bottom", "quadrature": quadrature, "stiffness": 1.0, "friction": {"coefficient": 4.0}}
        top = ["free"] * (d - 1) + ["-0.05 * t"]
        held = planes(d) if not inclined else guides(d)
        simulation = completed(
            pressed(d, held | {"top": top}, n=n, contact=contact, loads={"body": along(d, 0.0, -0.05)})
        )
        surface, stepper = simulation.discretisation.surface, simulation.stepper
        x = np.asarray(simulation.discretisation.mesh.nodes)
        force = np.asarray(stepper.contact_force).reshape(-1, d)
        assert set(stepper.status) == {1}  # all stick
        facets = np.asarray(simulation.discretisation.mesh.parts["bottom"])
        nodes = np.unique(facets)
        positions, weights = np.asarray(surface.positions), np.asarray(surface.weights)
        shape = shapes(x, facets, nodes, positions)
        for axis in range(d - 1):
            free = shape * (x[nodes, axis] > 1e-12)
            least = (
                weights[:, None] * free @ np.linalg.pinv(free.T @ (weights[:, None] * free)) @ free.T @ force[:, axis]
            )
            assert np.abs(force[:, axis] - least).max() <= 1e-9 * np.abs(force).max()
            assert np.abs(least).max() > 1e-3 * np.abs(force).max()


@check
def weak_beside_strong(d: int) -> None:
    """A spring or a dashpot of 1e-12 of another one of the same part holds what that one leaves free."""
    density, force, k = 7800.0, 100.0, 50.0
    for stiffness, damping in ((100.0, 0.0), (1e-2, 0.0), (0.0, 100.0)):
        springs = {"stiffness": along(d, 1e14, stiffness), "damping": along(d, 0.0, damping)}
        one = pressed(
            d,
            {},
            n=2,
            time={"end": 2 * k, "steps": 2},
            elasticity=elasticity(d, 2.1e11, 0.3),
            inertia={"density": density},
            supports={"springs": {"top": {name: value for name, value in springs.items() if any(value)}}},
            loads={"body": along(d, -2e5, force)},
        )
        w = u = 0.0
        for _ in range(2):
            w = (force + density * w / k - stiffness * u) / (density / k + k * stiffness + damping)
            u += k * w
        found = field(completed(one, digits=6.0), "u")[:, 0]
        assert np.abs(found - u).max() <= 1e-6 * u, (stiffness, damping)  # it strains by less
    held = pressed(  # without inertia too
        d,
        {},
        n=2,
        elasticity=elasticity(d, 2.1e11, 0.3),
        supports={"springs": {"top": {"stiffness": [100.0] * (d - 1) + [1e14]}}},
        loads={"body": along(d, -2e5, force)},
    )
    assert np.abs(field(completed(held, digits=6.0), "u")[:, 0] - force / 100.0).max() <= 1e-6


@check
def springs_in_steps_of_several_sizes(d: int) -> None:
    """Which motions springs and mass hold is the same in all of them."""
    one = pressed(
        d,
        {},
        n=2,
        time={"end": 0.2, "steps": 2, "graded_to": [0.2], "halvings": 3},
        elasticity=elasticity(d, 1.0, 0.3),
        inertia={"density": 1.0},
        supports={"springs": {"right": {"normal_stiffness": 2.0}}},
        initial={"velocity": along(d, -3e-4, 2e-4)},
        contact={"part": "bottom", "stiffness": "rigid"},
    )
    completed(one)


@check
def a_moving_foundation_rubs_a_node_in_a_guide(d: int) -> None:
    """Its friction is what the law says, also where regularisation calls it sticking and the guide bears it."""
    speed, scale = 1e-4, 2.0
    one = pressed(
        d,
        guides(d) | {"top": {"normal": 0.0}},
        n=2,
        elasticity=elasticity(d, 1.0, 0.3),
        contact={
            "part": "bottom",
            "stiffness": 1.5,
            "gap": -1e-3,
            "velocity": along(d, 0.0, speed),
            "friction": {"coefficient": 0.5, "regularisation": scale},
        },
    )
    simulation = completed(one)
    positions = np.asarray(simulation.discretisation.surface.positions)
    at = np.flatnonzero(positions[:, 0] == 0)
    force = simulation.stepper.contact_force.reshape(-1, d)[at]
    assert (force[:, -1] != 0).all()
    assert force[:, 0] == pytest.approx(-0.5 * np.abs(force[:, -1]) * speed / scale, rel=1e-6)


@check
def a_load_on_the_contact_part_goes_into_the_foundation(d: int) -> None:
    """On a rigid one nothing moves: the point of each node bears what is applied there."""
    for n, more in ((1, {}), (4, {}), (2, {"inertia": {"density": 1.0}})):
        one = pressed(
            d,
            {"top": [0.0] * d},
            n=n,
            elasticity=elasticity(d, 1.0, 0.3),
            loads={"traction": {"bottom": along(d, -1e-3, 1e-4)}},
            contact={"part": "bottom", "stiffness": "rigid", "friction": {"coefficient": 0.5}},
            **more,
        )
        simulation = completed(one)
        assert np.abs(field(simulation, "u")).max() <= 1e-18
        total = simulation.stepper.contact_force.reshape(-1, d).sum(axis=0)
        assert np.abs(total - along(d, -1e-3, 1e-4)).max() <= 1e-17


def shapes(x: Any, facets: Any, nodes: Any, positions: Any) -> Any:
    """Shape functions of the nodes of a flat part at the points on it, (points, nodes); points come facet by facet."""
    out, each = np.zeros((len(positions), len(nodes))), len(positions) // len(facets)
    for q, place in enumerate(positions):
        corners = facets[q // each]
        system = np.vstack([x[corners].T, np.ones(len(corners))])
        out[q, np.searchsorted(nodes, corners)] = np.linalg.lstsq(system, np.append(place, 1.0), rcond=None)[0]
    return out


test_on_one_rank, test_on_two_ranks = check.tests(__file__)

if __name__ == "__main__":
    check.main()
