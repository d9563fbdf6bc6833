"""Motions and temperatures that have ended: what is left of them is zero, and a run goes on. What drifts is in the digits.

In the plane and in space, on one and on two ranks: `python test_ends.py` checks all on the ranks it has.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from support.boxes import along, completed, elasticity, field, scene
from support.ranked import Checks

from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

check = Checks()
CONTACTS: dict[str, dict[str, Any]] = {
    "no friction": {"stiffness": 100.0},
    "friction": {"stiffness": 100.0, "friction": {"coefficient": 0.3}},
    "rigid": {"stiffness": "rigid", "friction": {"coefficient": 0.3}},
}


def pressed(d: int, course: str, steps: int, contact: dict[str, Any], **tables: Any) -> Any:
    """A body that hangs from its top and is pressed on a foundation by a load with a course in time."""
    load = along(d, f"-1e-2 * ({course})", f"3e-3 * ({course})")
    return scene(
        d,
        4 if d == 2 else 2,
        time={"end": 1.0, "steps": steps},
        elasticity=elasticity(d, 1.0, 0.3),
        supports={"displacement": ["top"]},
        loads={"body": load},
        contact={"part": "bottom"} | contact,
        **tables,
    )


@check
def unloaded_and_at_rest(d: int) -> None:
    """Half of the steps are after the load: their rounding would shrink to numbers that have no squares."""
    for contact in CONTACTS.values():
        for steps in (25, 64):
            simulation = completed(pressed(d, "max(0, 1 - 2*t)", steps, contact))
            assert not np.any(field(simulation, "u")) and not np.any(simulation.stepper.contact_force)


@check
def a_pulse_that_has_passed(d: int) -> None:
    """The stress at its end is nothing beside that of its peak, which lies in a step that nobody measured."""
    for steps in (20, 40):
        simulation = completed(pressed(d, "exp(-1000 * (t - 0.7)**2)", steps, CONTACTS["friction"]))
        assert min(summary(simulation)["digits"].values()) > 12


@check
def cooled_down_while_it_touches(d: int) -> None:
    """Thermal stresses fall with the temperature by 1e-160 and more."""
    for coupling in ("staggered", "monolithic"):
        simulation = completed(
            scene(
                d,
                3 if d == 2 else 2,
                time={"end": 400.0, "steps": 400, "coupling": coupling},
                elasticity=elasticity(d, 1.0, 0.3),
                supports={"displacement": ["top"]},
                heat={"conductivity": 1.0, "capacity": 1.0, "expansion": {"tensor": 1e-3}},
                initial={"temperature": 1.0},
                contact={"part": "bottom", "heat_exchange": {"conductance": 10.0}} | CONTACTS["friction"],
            )
        )
        assert not np.any(field(simulation, "theta")) and not np.any(field(simulation, "u"))


def block(d: int, time: dict[str, Any], weight: str, contact: dict[str, Any]) -> Simulation:
    """A steel block that is squeezed from both sides alike."""
    squeeze = f"1e5 * ({'xyz'[d - 1]} + 0.03)"
    return Simulation(
        scene(
            d,
            4 if d == 2 else 2,
            length=0.1,
            time=time,
            inertia={"density": 7800.0},
            elasticity=elasticity(d, 2.1e11, 0.3),
            loads={
                "body": along(d, weight),
                "traction": {"left": along(d, 0.0, squeeze), "right": along(d, 0.0, f"-{squeeze}")},
            },
            contact={"part": "bottom", "stiffness": 1e13} | contact,
        )
    )


def aside(simulation: Simulation, d: int) -> float:
    """How far the centre of mass of a block is sideways, where it never goes, against its largest displacement."""
    discretisation = simulation.discretisation
    momentum = discretisation.layout.gather(discretisation.operators.inertia * simulation.stepper.u)
    return float(abs(momentum.reshape(-1, d)[:, 0].sum()) / (7800.0 * 0.1**d) / np.abs(field(simulation, "u")).max())


def drift(simulation: Simulation, d: int) -> tuple[float, float]:
    """Sideways motion before a block touches, or at the end of one that slides freely, and the digits of u."""
    error, smooth = 0.0, all(contact.friction is None for contact in simulation.scene.contacts)
    for _, report in simulation.steps():
        if smooth or report.stick + report.slip == 0:
            error = aside(simulation, d)
    assert simulation.outcome == "completed", simulation.failure
    return error, summary(simulation)["digits"]["u"]


@check
def drift_of_a_free_body(d: int) -> None:
    """Loads that balance do not do so to the last bit. In an hour a block on a smooth table drifts further than it deforms."""
    for steps, end in ((3, 1e-2), (1000 if d == 2 else 300, 3600.0)):
        error, stated = drift(block(d, {"end": end, "steps": steps}, "-76518.0", {}), d)
        assert error <= 10 ** (1 - stated), (error, stated)
        assert stated > 6 if end < 1 else stated < 4


@check
def drift_until_a_body_lands(d: int) -> None:
    """Friction holds it in the end, wherever it has drifted to."""
    fall = {"gap": 1e-9, "friction": {"coefficient": 0.3}}
    error, stated = drift(block(d, {"end": 36.0, "steps": 1000}, "where(t > 35.64, -76518, 0)", fall), d)
    assert error <= 10 ** (1 - stated) and stated < 6, (error, stated)


@check
def a_body_at_rest_does_not_drift(d: int) -> None:
    """Friction resists a part of its motions in each step of a wave, and all of them in the end."""
    for time in ({"end": 1.0, "steps": 40, "graded_to": [1.0], "halvings": 20}, {"end": 1.0, "steps": 300}):
        _, stated = drift(block(d, time, "-76518.0", {"friction": {"coefficient": 0.3}}), d)
        assert stated > 8, stated


@check
def nothing_to_lend(d: int) -> None:
    """A body of hardly any stiffness, mass or load, which nothing holds."""
    simulation = Simulation(
        scene(
            d,
            2,
            time={"end": 1.0, "steps": 2},
            elasticity=elasticity(d, 1e-300, 0.3),
            loads={"body": along(d, -1e-300)},
            contact={"part": "bottom", "stiffness": 1.0},
        )
    )
    for _ in simulation.steps():
        pass
    assert simulation.outcome in ("unsupported", "not_finite", "contact_not_converged"), simulation.failure


@check
def drift_of_an_insulated_body(d: int) -> None:
    """A source without a sum heats it to the last bit alone, in every step alike."""
    simulation = Simulation(
        scene(
            d,
            6 if d == 2 else 4,
            time={"end": 1e12, "steps": 1000},
            heat={"conductivity": 1.0, "capacity": 1.0, "source": "x - 0.5"},
        )
    )
    for _ in simulation.steps():
        pass
    assert simulation.outcome == "completed", simulation.failure
    discretisation = simulation.discretisation
    heat = discretisation.layout.gather(discretisation.operators.mass * simulation.stepper.theta).sum()
    error, stated = abs(heat) / np.abs(field(simulation, "theta")).max(), summary(simulation)["digits"]["theta"]
    assert error <= 10 ** (1 - stated), (error, stated)


@check
def friction_whose_squares_vanish(d: int) -> None:
    """Loads of 1e-162 and stiffnesses of 1e158 are refused where there is friction; without it they are solved."""
    for factor, young in ((1e-160, 1.0), (1e158, 1e158)):
        for contact, outcome in (("friction", "not_finite"), ("no friction", "completed")):
            one = pressed(d, str(factor), 3, CONTACTS[contact] | {"stiffness": 100.0 * young})
            simulation = Simulation(one.override(**{"elasticity.young": young}))
            for _ in simulation.steps():
                pass
            assert simulation.outcome == outcome, (factor, contact, simulation.failure)
            if outcome == "not_finite":
                assert simulation.failure is not None and "squares of them" in simulation.failure["reason"]


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
