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


@check
def drift_of_a_free_body(d: int) -> None:
    """Loads that balance do not do so to the last bit. In an hour a block on a smooth table drifts further than it deforms."""
    for steps, known in ((3, True), (1000 if d == 2 else 300, False)):
        simulation = Simulation(
            scene(
                d,
                4 if d == 2 else 2,
                length=0.1,
                time={"end": 1e-2 if known else 3600.0, "steps": steps},
                inertia={"density": 7800.0},
                elasticity=elasticity(d, 2.1e11, 0.3),
                loads={
                    "body": along(d, -76518.0),
                    "traction": {
                        "left": along(d, 0.0, f"1e5 * {'xyz'[d - 1]}"),
                        "right": along(d, 0.0, f"-1e5 * {'xyz'[d - 1]}"),
                    },
                },
                contact={"part": "bottom", "stiffness": 1e13},
            )
        )
        for _ in simulation.steps():
            pass
        assert simulation.outcome == "completed", simulation.failure
        discretisation = simulation.discretisation
        momentum = discretisation.layout.gather(discretisation.operators.inertia * simulation.stepper.u)
        mass = 7800.0 * 0.1**d  # its centre stays where it is
        error = abs(momentum.reshape(-1, d)[:, 0].sum()) / mass / np.abs(field(simulation, "u")).max()
        stated = summary(simulation)["digits"]["u"]
        assert error <= 10 ** (1 - stated), (error, stated)
        assert stated > 6 if known else stated < 4


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
