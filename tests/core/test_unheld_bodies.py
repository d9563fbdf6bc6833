"""Bodies without supports and inertia: what nothing holds is refused on every part alike, what contact holds is found.

The foundation may be away at the start. `python test_unheld_bodies.py D` checks on the ranks it has.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.boxes import FAR, SIDES, along, axis_of, completed, elasticity, fields, scene, turned
from support.ranked import Checks

from warmslip import discretise
from warmslip.scene.reader import build
from warmslip.simulation.simulation import Simulation

check = Checks()


def inwards(d: int, part: str, along: float = 0.0) -> list[float]:
    """A unit of load that presses on a part, and some along the next axis."""
    axis = axis_of(d, part)
    load = [0.0] * d
    load[axis] = 1.0 if part in FAR else -1.0
    load[(axis + 1) % d] = along
    return load


def free(d: int, part: str, load: Any, mu: float = 0.5, n: int = 2, **contact: Any) -> Any:
    friction = {"friction": {"coefficient": mu}} if mu else {}
    return scene(
        d,
        n,
        time={"steps": 2},
        elasticity=elasticity(d, 1000.0, 0.3),
        loads={"body": load},
        contact={"part": part, "stiffness": 1e5} | friction | contact,
    )


def outcome(one: Any, mesh: Any = None) -> str:
    simulation = Simulation(one, discretisation=None if mesh is None else discretise(one, mesh=mesh))
    assert not list(simulation.steps()) or simulation.outcome == "completed"
    return simulation.outcome


def unheld(d: int, part: str) -> Iterator[Any]:
    """Scenes that have no solution, or a whole line of them."""
    for stiffness in (1e5, "rigid"):
        away = [-one for one in inwards(d, part)]
        yield free(d, part, away, stiffness=stiffness)
        yield free(d, part, away, stiffness=stiffness, gap=0.01)
        yield free(d, part, inwards(d, part, 0.6), stiffness=stiffness)  # more than mu
        yield free(d, part, inwards(d, part, -0.6), stiffness=stiffness, gap=0.01)
        yield free(d, part, inwards(d, part, 0.1), mu=0, stiffness=stiffness)
        yield free(d, part, inwards(d, part), mu=0, stiffness=stiffness)


@check
def what_nothing_holds_is_refused_on_every_part(d: int) -> None:
    for part in SIDES[d]:
        assert {outcome(one) for one in unheld(d, part)} == {"unsupported"}, part


@check
def and_whichever_way_it_is_turned(d: int) -> None:
    turn = np.linalg.qr(np.random.default_rng(d).normal(size=(d, d)))[0]
    turn[0] *= np.sign(np.linalg.det(turn))
    for part in SIDES[d]:
        assert {outcome(*turned(one, turn)) for one in unheld(d, part)} == {"unsupported"}, part


@check
def it_comes_to_its_foundation(d: int) -> None:
    """A gap that a rigid motion closes, of 1 % or of fifty bodies, leaves the forces that there are without one."""
    for part in SIDES[d]:
        axis = axis_of(d, part)
        load = inwards(d, part, 0.1)
        across = "yx"[axis] if d == 2 else "yzx"[axis]
        slope = f"0.01 + 0.02 * {across}" if part not in FAR else 0.02  # beyond the origin a turn slides, too
        for stiffness in (1e3, "rigid"):
            near = completed(free(d, part, load, stiffness=stiffness))
            force = np.reshape(near.stepper.contact_force, (-1, d))
            assert np.abs(force.sum(axis=0) - load).max() <= 1e-11
            for gap in (0.01, slope, 50.0):
                far = completed(free(d, part, load, stiffness=stiffness, gap=gap), digits=6.0)
                there = np.reshape(far.stepper.contact_force, (-1, d))
                assert np.abs(there - force).max() <= 1e-9, (part, stiffness, gap)


@check
def it_turns_until_two_rows_of_points_hold_it(d: int) -> None:
    """Statics: on a curved foundation the load's centre, 5/9, lies between the rows at 1/2 and 1, that take 4/3 and 1/6."""
    body = [0.0] * (d - 1) + ["-1 - x"]
    for gap in ("0.01 + 0.1 * (x - 0.3)**2", "0.1 * (x - 0.3)**2"):
        simulation = completed(free(d, "bottom", body, stiffness="rigid", gap=gap), digits=6.0)
        force = np.reshape(simulation.stepper.contact_force, (-1, d))[:, -1]
        place = np.asarray(simulation.discretisation.surface.positions)[:, 0]
        rows = [-force[np.abs(place - x) < 0.1].sum() for x in (0.0, 0.5, 1.0)]
        assert rows == pytest.approx([0.0, 4 / 3, 1 / 6], abs=1e-11)
    balanced = free(d, "bottom", [0.0] * (d - 1) + [-1.0], stiffness="rigid", gap="0.01 + 0.1 * (x - 0.5)**2")
    assert outcome(balanced) == "unsupported"  # on one row of points, about which it may turn


@check
def a_load_that_lifts_it_later_ends_the_run_there(d: int) -> None:
    one = free(d, "bottom", [0.0] * (d - 1) + ["4 * t - 2.6"], gap=0.01).override(**{"time.steps": 4})
    simulation = Simulation(one)
    assert (len(list(simulation.steps())), simulation.outcome) == (2, "unsupported")
    assert simulation.report.normal_force == pytest.approx(0.6, rel=1e-12)


@check
def a_push_that_friction_resists(d: int) -> None:
    """Far below the friction bound it moves nothing, whichever way it points, on a body that shrinks on its points."""
    sizes = ((1, 0.0, 20.0), (1, 1e-4, 20.0), (4, 0.0, 20.0), (8, 0.0, "1000 * y")) if d == 2 else ((2, 0.0, 20.0),)
    for n, gap, warm in sizes:
        for stiffness in (1e10, "rigid"):
            for push in (0.0, 1e-6, 1e-3, 1.0, 5e3):
                for sign in (1, -1):
                    simulation = Simulation(
                        scene(
                            d,
                            n,
                            length=0.1,
                            time={"end": 300.0, "steps": 3},
                            elasticity=elasticity(d, 2.1e11, 0.3),
                            heat={"conductivity": 50.0, "capacity": 3.6e6, "expansion": {"tensor": 6.3e6}},
                            loads={"body": along(d, -76518.0, sign * push)},
                            initial={"temperature": warm},
                            contact={
                                "part": "bottom",
                                "stiffness": stiffness,
                                "gap": gap,
                                "friction": {"coefficient": 0.3},
                                "heat_exchange": {"conductance": 1e3},
                            },
                        )
                    )
                    for _ in simulation.steps():
                        pass
                    assert simulation.outcome == "completed", (n, gap, stiffness, sign * push, simulation.failure)
                    force = np.reshape(simulation.stepper.contact_force, (-1, d)).sum(axis=0)  # of all ranks
                    wanted = np.array(along(d, -76518.0, sign * push)) * 0.1**d
                    assert np.abs(force - wanted).max() <= 1e-9 * np.abs(wanted).max()


@check
def a_stiff_body_on_a_soft_layer(d: int) -> None:
    """Two million times stiffer: what the contact bears is the load, and a support beside it changes no digits."""
    load = 1e4
    one = scene(
        d,
        [4] * d,
        length=0.1,
        time={"end": 0.1, "steps": 3},
        elasticity=elasticity(d, 2.1e11, 0.3),
        regions={"layer": {"where": f"{'y' if d == 2 else 'z'} < 0.05005", "elasticity": elasticity(d, 1e5, 0.1)}},
        loads={"traction": {"top": along(d, -load, 0.1 * load)}},
        contact={"part": "bottom", "stiffness": 1e9, "friction": {"coefficient": 0.4}},
    )
    for scale in (1.0, 1.27e3, 0.0321):
        simulation = completed(
            one.override(
                **{
                    "mesh.lengths": [0.1 * scale] * d,
                    "regions.layer.where": f"{'y' if d == 2 else 'z'} < {0.05005 * scale!r}",
                    "contact.stiffness": 1e9 / scale,
                }
            ),
            digits=6.0,
        )
        force = np.reshape(simulation.stepper.contact_force, (-1, d)).sum(axis=0)
        wanted = np.array(along(d, -load, 0.1 * load)) * (0.1 * scale) ** (d - 1)
        assert np.abs(force - wanted).max() <= 1e-11 * load * (0.1 * scale) ** (d - 1)


@check
def friction_stops_it_in_one_long_step(d: int) -> None:
    """A speed that would take it far away, against none after the step: statics with the momentum as a load."""
    for step in (10.0, 60.0, 3600.0):
        weight, speed, density = 77008.5, 1.0, 7850.0
        moving = scene(
            d,
            [4] + [2] * (d - 1),
            length=0.2,
            time={"end": step, "steps": 1},
            inertia={"density": density},
            elasticity=elasticity(d, 2.1e11, 0.3),
            loads={"body": along(d, -weight, 0.2 * weight)},
            initial={"velocity": along(d, 0.0, speed)},
            contact={"part": "bottom", "stiffness": 1e14, "friction": {"coefficient": 0.4}},
        )
        pushed = moving.override(
            **{"initial.velocity": [0.0] * d, "loads.body": along(d, -weight, 0.2 * weight + density * speed / step)}
        )
        ways = [np.reshape(completed(one).stepper.contact_force, (-1, d)) for one in (moving, pushed)]
        sums = [force.sum(axis=0) for force in ways]
        assert np.abs(sums[0] - sums[1]).max() <= 1e-11 * np.abs(sums[1]).max()
        if d == 2:  # in space several solutions are near
            assert np.abs(ways[0] - ways[1]).max() <= 1e-9 * np.abs(ways[1]).max()


@check
def a_slab_that_curls_is_held_by_a_point_that_sticks(d: int) -> None:
    """Concrete in steps of two hours: its mass has no part in it, and the answer is that without mass."""
    if d == 3:
        return
    tables = {
        "mesh": {"shape": "square", "n": [9, 3], "lengths": [0.2, 0.1]},
        "time": {"end": 36000.0, "steps": 5, "coupling": "monolithic"},
        "elasticity": elasticity(d, 3e10, 0.2),
        "heat": {"conductivity": 1.5, "capacity": 2.1e6, "expansion": {"alpha": 1e-5}},
        "supports": {"temperature": {"top": "-2 * min(1, t / 10800)"}},
        "loads": {"body": along(d, -9.81 * 2400.0)},
        "contact": {
            "part": "bottom",
            "stiffness": 1e11,
            "friction": {"coefficient": 0.6},
            "heat_exchange": {"conductance": 10.0},
        },
    }
    heavy, light = completed(build(tables | {"inertia": {"density": 2400.0}})), completed(build(tables))
    for name in ("theta", "contact force"):
        one, other = fields(heavy)[name], fields(light)[name]
        if name == "contact force":  # which of two like points sticks is a tie
            one, other = one.sum(axis=0), other.sum(axis=0)
        assert np.abs(one - other).max() <= 1e-8 * np.abs(other).max()


@check
def what_held_it_lets_it_fly(d: int) -> None:
    """A constant friction bound acts without pressure: it calms a falling body until nothing but its fall is left."""
    n, steps, end = (24, 24, 0.00424) if d == 2 else (4, 24, 0.02)
    for density, young in ((917.0, 9e9), (600.0, 1e10)):
        simulation = Simulation(
            scene(
                d,
                n,
                length=0.1,
                time={"end": end, "steps": steps},
                inertia={"density": density},
                elasticity=elasticity(d, young, 0.33),
                loads={"body": along(d, -9.81 * density)},
                initial={"velocity": along(d, -0.1, 0.1)},
                contact={"part": "bottom", "stiffness": "rigid", "gap": 0.1, "friction": {"cohesion": 3e4}},
            )
        )
        assert len(list(simulation.steps())) == steps, simulation.failure
        momentum = simulation.discretisation.field(
            simulation.discretisation.operators.inertia * simulation.stepper.w
        ).sum(axis=0)
        assert momentum[-1] == pytest.approx(density * 0.1**d * (-0.1 - 9.81 * end), rel=1e-12)


@check
def cohesion_and_a_curved_gap(d: int) -> None:
    """Bodies with a lent mass and bodies without one do not call each other's solvers for ever."""
    for quadrature in ("nodal", "gauss-2"):
        guided = scene(
            d,
            [5, 1] if d == 2 else [2, 2, 1],
            time={"steps": 1},
            elasticity=elasticity(d, 1.0, 0.3),
            loads={"body": along(d, -1e-4)},
            supports={"displacement": {"top": [*["free"] * (d - 1), "-1e-5 * t"]}},
            contact={
                "part": "bottom",
                "stiffness": "rigid",
                "quadrature": quadrature,
                "friction": {"coefficient": 0.3, "cohesion": 1e-6},
                "gap": {"shape": "sphere", "at": [*[0.3] * (d - 1), -7.47], "radius": 7.47}
                if d == 3
                else {"shape": "cylinder", "at": [0.3, -7.47], "radius": 7.47},
            },
        )
        simulation = Simulation(guided)
        for _, report in simulation.steps():
            assert report.newton_iterations < 2000
        assert simulation.outcome in ("completed", "unsupported"), simulation.failure


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
