"""The digits that a run states of its fields, where rounding of one field spoils another and where nothing is definite.

`python test_digits.py` checks all of it on the ranks it has.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from support.boxes import along, elasticity, field, forces_of, scene, turned
from support.ranked import Checks

from warmslip import discretise
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

check = Checks()


def carried(d: int, speed: float, **keys: Any) -> Simulation:
    """A warm body under a load, on a support that moves with it: nothing but its place depends on the speed."""
    simulation = Simulation(
        scene(
            d,
            3 if d == 2 else 2,
            time={"end": 1.0, "steps": 4, **keys},
            inertia={"density": 1.0},
            elasticity=elasticity(d, 100.0, 0.3),
            heat={
                "conductivity": 1.0,
                "capacity": 1.0,
                "expansion": {"tensor": 0.1},
                "heating": {"tensor": -0.1},
            },
            supports={"displacement": {"bottom": [f"{speed}*t"] + [0.0] * (d - 1)}},
            initial={"velocity": along(d, 0.0, speed)},
            loads={"traction": {"right": ["sin(3*t)"] + [0.3] * (d - 1)}},
        )
    )
    for _ in simulation.steps():
        pass
    assert simulation.outcome == "completed", simulation.failure
    return simulation


@check
def rounding_of_a_fast_motion(d: int) -> None:
    """Temperatures and stresses lose the digits that rounding of a velocity takes, and the run says how many."""
    for coupling in ("staggered", "lagged", "monolithic"):
        still = field(carried(d, 0.0, coupling=coupling), "theta")
        for speed in (1e4, 1e6, 1e8, 1e10, 1e12):
            simulation = carried(d, speed, coupling=coupling)
            stated, message = summary(simulation)["digits"], summary(simulation)["warnings"]
            error = np.abs(field(simulation, "theta") - still).max() / np.abs(still).max()
            assert error <= 10 ** (1 - stated["theta"]), (coupling, speed, error, stated)
            assert stated["theta"] <= 1 - np.log10(speed * 1e-16 / np.abs(still).max())
            for name, words in (("theta", "the temperature keeps"), ("stress", "the stress keeps")):
                assert any(words in one for one in message) == (stated[name] < 4), (name, message)


@check
def rounding_of_a_motion_that_is_over(d: int) -> None:
    """A support leaps away and comes back in between: the temperature has kept what rounding made of the way."""

    def leaps(way: float, coupling: str) -> Simulation:
        simulation = Simulation(
            scene(
                d,
                3 if d == 2 else 2,
                time={"end": 1.0, "steps": 8, "coupling": coupling},
                elasticity=elasticity(d, 100.0, 0.3),
                heat={
                    "conductivity": 1.0,
                    "capacity": 1.0,
                    "expansion": {"tensor": 0.1},
                    "heating": {"tensor": -0.1},
                },
                supports={"displacement": {"bottom": [f"where(abs(t-0.5)<0.01,{way},0)"] + [0.0] * (d - 1)}},
                loads={"traction": {"right": ["sin(3*t)"] + [0.3] * (d - 1)}},
            )
        )
        for _ in simulation.steps():
            pass
        assert simulation.outcome == "completed", simulation.failure
        return simulation

    for coupling in ("staggered", "lagged"):
        still = field(leaps(0.0, coupling), "theta")
        for way in (1e6, 1e9, 1e12):
            simulation = leaps(way, coupling)
            error = np.abs(field(simulation, "theta") - still).max() / np.abs(still).max()
            assert error <= 10 ** (1 - summary(simulation)["digits"]["theta"]), (coupling, way, error)


@check
def rounding_of_a_slide_along_an_oblique_foundation(d: int) -> None:
    """Axes that are askew to the foundation press a sliding body into it by rounding, and the run says how much."""
    turn = np.linalg.qr(np.array([[0.8, -0.6, 0.1], [0.5, 0.7, -0.3], [0.2, 0.4, 0.9]])[:d, :d])[0]
    turn *= np.linalg.det(turn) if d == 3 else [np.linalg.det(turn), 1.0]
    for stiffness in (1e3, 1e6, "rigid"):
        found = []
        for axes in (np.eye(d), turn):
            still = scene(
                d,
                2,
                time={"end": 60.0, "steps": 30},
                elasticity=elasticity(d, 100.0, 0.3),
                inertia={"density": 1.0},
                initial={"velocity": (axes @ along(d, 0.0, 10.0)).tolist()},
                loads={"body": along(d, -1.0)},
                contact={"part": "bottom", "stiffness": stiffness, "friction": {"coefficient": 0.2}},
            )
            one, mesh = turned(still, axes)
            simulation = Simulation(one, discretisation=discretise(one, mesh=mesh))
            found.append([forces_of(simulation) @ axes for _ in simulation.steps()])
            assert simulation.outcome == "completed", simulation.failure
            stated = summary(simulation)["digits"]["contact_force"]
        straight, askew = np.array(found)
        error = np.abs(askew - straight).max() / np.abs(straight).max()
        assert error <= 10 ** (2 - stated), (stiffness, error, stated)  # errors of 30 steps add up


@check
def gauss_points_of_a_body_on_weak_springs(d: int) -> None:
    """Springs that hold a pressed body hardly at all change nothing; what the contact solver leaves of its motion is said."""

    def pressed(spring: float, stiffness: float | str) -> Simulation:
        planes = {"left": [0.0, *["free"] * (d - 1)]} | ({"front": ["free", 0.0, "free"]} if d == 3 else {})
        springs = {"springs": {"top": {"stiffness": spring}}} if spring else {}
        simulation = Simulation(
            scene(
                d,
                4 if d == 2 else 2,
                time={"steps": 1},
                elasticity=elasticity(d, 1.0, 0.3),
                loads={"body": along(d, -1e-3)},
                supports={"displacement": planes} | springs,
                contact={"part": "bottom", "stiffness": stiffness, "quadrature": "gauss-2"},
            )
        )
        for _ in simulation.steps():
            pass
        return simulation

    for stiffness in ("rigid", 100.0):
        free = field(pressed(0.0, stiffness), "u")
        for spring in (1e-6, 1e-9, 1e-10, 1e-11):
            simulation = pressed(spring, stiffness)
            if simulation.outcome == "precision_lost":
                assert stiffness == "rigid" and spring < 1e-9
                continue
            error = np.abs(field(simulation, "u") - free).max() / np.abs(free).max()
            assert error <= max(10 * spring, 10 ** (1 - summary(simulation)["digits"]["u"])), (stiffness, spring, error)


@check
def friction_heat_of_a_light_touch(d: int) -> None:
    """The temperature comes from a contact force of few digits, and has no more."""

    def pulled(load: float) -> Simulation:
        sides = {"right": along(d, 0.0, load), "left": along(d, 0.0, -load)}
        simulation = Simulation(
            scene(
                d,
                3 if d == 2 else 2,
                time={"end": 1.0, "steps": 1},
                elasticity=elasticity(d, 1.0, 0.3),
                supports={"displacement": {"top": along(d, "-0.1*t", 0.3)}},
                loads={"traction": sides},
                heat={"conductivity": 1.0, "capacity": 1.0},
                contact={
                    "part": "bottom",
                    "stiffness": "rigid",
                    "gap": gap,
                    "friction": {"coefficient": 0.5},
                    "friction_heating": {"share": 1.0},
                },
            )
        )
        for _ in simulation.steps():
            pass
        return simulation

    gap, below, above = 0.5, -1.0, 2.0
    for _ in range(40):
        gap = (below + above) / 2
        touches = pulled(1.0).stepper.status != [0] * len(pulled(1.0).stepper.status)
        below, above = (gap, above) if touches else (below, gap)
    gap = below - 1e-9
    one, other = pulled(1.0), pulled(1.0 + 2.3e-16)
    assert one.outcome == other.outcome == "completed", (one.failure, other.failure)
    size = np.abs(field(one, "theta")).max()
    change = np.abs(field(one, "theta") - field(other, "theta")).max() / size
    stated = summary(one)["digits"]
    assert 0 < change <= 10 ** (1 - stated["theta"]), (change, stated)
    assert abs(stated["theta"] - stated["contact_force"]) < 1


@check
def heat_that_an_insulated_body_keeps(d: int) -> None:
    """Conduction beside which the capacity of a long step is nothing neither makes heat nor loses any, however many steps."""
    source = 0.01
    for coupling in ("staggered", "lagged", "monolithic"):
        simulation = Simulation(
            scene(
                d,
                3 if d == 2 else 2,
                time={"end": 200.0, "steps": 200, "coupling": coupling},
                elasticity=elasticity(d, 1.0, 0.3),
                heat={"conductivity": 1e10, "capacity": 1.0, "source": source, "expansion": {"tensor": 1e-3}},
                initial={"temperature": 10.0},
                supports={"displacement": ["bottom"]},
            )
        )
        for _ in simulation.steps():
            pass
        assert simulation.outcome == "completed", simulation.failure
        digits = summary(simulation)["digits"]
        error = np.abs(field(simulation, "theta") / (10.0 + 200.0 * source) - 1).max()
        assert error <= 1e-10 and min(digits["theta"], digits["u"]) > 9, (coupling, error, digits)


def cooling(d: int, coupling: str, steps: int = 3, push: str = "0", **contact: Any) -> Simulation:
    """A steel block rests by its weight on a foundation that cools it, without inertia: it shrinks over all points."""
    simulation = Simulation(
        scene(
            d,
            1 if d == 2 else 2,
            length=0.1,
            time={"end": (100.0 if d == 2 else 0.01) * steps, "steps": steps, "coupling": coupling},
            elasticity=elasticity(d, 2.1e11, 0.3),
            heat={"conductivity": 50.0, "capacity": 3.6e6, "expansion": {"tensor": 6.3e6}},
            loads={"body": along(d, -76518.0, push)},
            initial={"temperature": 20.0},
            contact={
                "part": "bottom",
                "stiffness": 1e10,
                "friction": {"coefficient": 0.3},
                "heat_exchange": {"conductance": 1e3},
            }
            | contact,
        )
    )
    for _, report in simulation.steps():
        assert not report.undetermined or report.stick == 0
    assert simulation.outcome == "completed", simulation.failure
    np.testing.assert_allclose(simulation.report.normal_force, 76518.0 * 0.1**d, rtol=1e-10)
    return simulation


def unplaced(simulation: Simulation) -> bool:
    return any("do not determine where the body is" in words for words in summary(simulation)["warnings"])


@check
def a_place_that_no_force_determines(d: int) -> None:
    """Two points that slip towards each other hold a body wherever it lies between; many in the plane know where."""
    for coupling in ("staggered", "monolithic"):
        simulation = cooling(d, coupling)
        digits = summary(simulation)["digits"]
        assert unplaced(simulation) == (d == 2)
        assert digits["u"] == 0 if d == 2 else digits["u"] > 8
    if d == 3:
        return
    # where it is undetermined in steps alone whose digits nobody estimates
    push = "where(t<150,2e4,where(t>550,2e4,where(abs(t-300)<50,2e4,0)))"
    simulation = cooling(d, "staggered", steps=6, push=push)
    assert unplaced(simulation) and summary(simulation)["digits"]["u"] == 0
    assert summary(simulation)["digits"]["theta"] > 8
    simulation = cooling(d, "staggered", friction_heating={"share": 1.0})
    assert unplaced(simulation) and summary(simulation)["digits"]["theta"] == 0


def hats(simulation: Simulation) -> Any:
    """The hat functions of the mesh at the contact points of its bottom, (points, nodes)."""
    d = simulation.discretisation
    nodes, facets, places = np.asarray(d.mesh.nodes)[:, :-1], d.mesh.parts["bottom"], np.asarray(d.surface.positions)
    out = np.zeros((len(places), len(nodes)))
    for row, x in zip(out, places[:, :-1], strict=True):
        for facet in np.asarray(facets):
            corners = nodes[facet]
            shares = np.linalg.solve((corners[1:] - corners[0]).T, x - corners[0])
            if min(*shares, 1 - shares.sum()) > -1e-12:
                row[facet] = [1 - shares.sum(), *shares]
                break
    return out


@check
def what_a_jump_in_a_short_step_leaves(d: int) -> None:
    """Rounding of the velocity of a support that jumps stays in the body; digits know, whatever the unit of length."""
    errors, known = [], []
    for halvings in (2, 20, 40):
        ends = []
        for unit in (1.0, 0.3):
            jump = along(d, f"where(t > 0, {0.01 * unit}, 0)")
            simulation = Simulation(
                scene(
                    d,
                    2,
                    length=unit,
                    time={"end": 1.0, "steps": 4, "graded_to": [0.0], "halvings": halvings},
                    elasticity=elasticity(d, 1.0, 0.3),
                    inertia={"density": unit**-2},
                    supports={"displacement": {"bottom": jump}},
                )
            )
            assert len(list(simulation.steps())) == simulation.scene.clock.steps, simulation.failure
            ends.append(field(simulation, "u") / unit)
        errors.append(np.abs(ends[1] - ends[0]).max() / np.abs(ends[0]).max())
        known.append(summary(simulation)["digits"])
        assert errors[-1] <= 2 * 10 ** -known[-1]["u"]
    assert known[0]["u"] > 13 and known[0]["stress"] > 11
    assert 8 < known[1]["u"] < 11
    assert known[2]["u"] < 5 and known[2]["stress"] < 5
    assert errors[2] > 1e-7


@check
def pressures_of_gauss_points_on_a_stiff_foundation(d: int) -> None:
    """Nothing rubs and all is pressed: pressures are stiffness times depth, so that they are linear along every facet.

    A force that two points of a facet share moves no node, and what rounding of a depth makes of it grows with the stiffness.
    """
    for stiffness, least, most in ((1e2, 13, 16), (1e8, 7, 10), (1e14, 0, 4)):
        simulation = Simulation(
            scene(
                d,
                4 if d == 2 else 2,
                time={"end": 2.0, "steps": 2},
                inertia={"density": 1.0},
                elasticity=elasticity(d, 1.0, 0.3),
                supports={"displacement": ["top"]},
                loads={"body": along(d, "-0.1 * (1 + x**2)", "2e-3 * y")},
                contact={"part": "bottom", "stiffness": stiffness, "quadrature": "gauss-2"},
            )
        )
        for _ in simulation.steps():
            pass
        assert simulation.outcome == "completed", simulation.failure
        surface = simulation.discretisation.surface
        pressure = -forces_of(simulation)[:, -1] / np.asarray(surface.weights)
        assert pressure.min() > 0
        shape = hats(simulation)
        linear = shape @ np.linalg.lstsq(shape, pressure, rcond=None)[0]
        error, stated = np.abs(linear - pressure).max() / pressure.max(), summary(simulation)["digits"]["contact_force"]
        assert error <= 10 ** (1 - stated) and least <= stated <= most, (stiffness, error, stated)


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
