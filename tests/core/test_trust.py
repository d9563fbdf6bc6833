"""Scenes at the extremes of double precision, in the plane and in space, on one and on two ranks, with their right answers.

Each scene was once wrong and passed, or right and stopped. `python test_trust.py` checks all of them on the ranks it has.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.boxes import along, completed, elasticity, field, scene
from support.ranked import Checks

import warmslip
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

STEEL: dict[str, Any] = {"young": 2e11, "poisson": 0.3}
check = Checks()


# ---- wrong and passed ------------------------------------------------------------------------------------------------


@check
def free_flight(d: int) -> None:
    """No force acts: w stays what it was, in steps far longer than elastic waves need."""
    for end in (4.0, 400.0, 4e6):
        simulation = completed(
            scene(
                d,
                16 if d == 2 else 4,
                length=0.1,
                time={"end": end, "steps": 4},
                inertia={"density": 7800.0},
                elasticity=elasticity(d, **STEEL),
                initial={"velocity": along(d, 0.3, 1.0)},
            )
        )
        assert np.abs(field(simulation, "w") - along(d, 0.3, 1.0)).max() <= 1e-12


@check
def spin(d: int) -> None:
    """A rigid rotation goes on, in the linear theory as a rotation for ever."""
    turning = ["-(y - 0.05)", "x - 0.05", 0.0][:d]
    simulation = completed(
        scene(
            d,
            8 if d == 2 else 3,
            length=0.1,
            time={"end": 400.0, "steps": 4},
            inertia={"density": 7800.0},
            elasticity=elasticity(d, **STEEL),
            viscosity={"lame": [1e3, 1e3]},
            initial={"velocity": turning},
        )
    )
    x = np.asarray(simulation.discretisation.mesh.nodes) - 0.05
    exact = np.column_stack([-x[:, 1], x[:, 0], 0 * x[:, 0]])[:, :d]
    assert np.abs(field(simulation, "w") - exact).max() <= 1e-13


@check
def free_fall(d: int) -> None:
    """Gravity alone: backward Euler's w = -g t, u = -g k^2 n (n + 1) / 2, whatever the stiffness."""
    simulation = completed(
        scene(
            d,
            6 if d == 2 else 3,
            time={"end": 100.0, "steps": 4},
            inertia={"density": 2.0},
            elasticity=elasticity(d, 2e11, 0.3),
            loads={"body": along(d, -2.0)},
        )
    )
    assert np.abs(field(simulation, "w") - along(d, -100.0)).max() <= 1e-11
    assert np.abs(field(simulation, "u") - along(d, -625.0 * 4 * 5 / 2)).max() <= 1e-9


@check
def warmed_free(d: int) -> None:
    """A free body is warmed on one side: its centre of mass rests, and it expands."""
    simulation = completed(
        scene(
            d,
            16 if d == 2 else 4,
            length=0.1,
            time={"end": 400.0, "steps": 4},
            inertia={"density": 7800.0},
            elasticity=elasticity(d, **STEEL),
            heat={"conductivity": 50.0, "capacity": 3.6e6, "source": "1e7 * x", "expansion": {"tensor": 6e6}},
        )
    )
    u, mass = field(simulation, "u"), simulation.discretisation.operators.inertia
    pull = simulation.discretisation.field(mass * simulation.stepper.u)
    weight = np.abs(simulation.discretisation.field(mass * simulation.stepper.u)).sum()
    assert np.abs(u).max() > 1e-5 and np.abs(pull.sum(axis=0)).max() <= 1e-11 * weight


@check
def moving_support_gauss(d: int) -> None:
    """The support's own motion reaches the Gauss points beside it: penetration 0.1 everywhere."""
    simulation = completed(
        scene(
            d,
            1,
            time={"steps": 1},
            elasticity=elasticity(d, 1.0, 0.0),
            supports={"displacement": {"left": along(d, "-0.1 * t")}},
            contact={"part": "bottom", "stiffness": 1e-6, "quadrature": "gauss-2"},
        )
    )
    assert np.abs(field(simulation, "u") - along(d, -0.1)).max() <= 1e-6
    assert simulation.report.normal_force == pytest.approx(1e-7, rel=1e-5)
    assert simulation.report.max_penetration == pytest.approx(0.1, rel=1e-5)


@check
def contact_heat(d: int) -> None:
    """A pressure of 1e-6 times per_pressure 1e6 is a conductance of 1, at supports too and for both quadratures."""
    for quadrature in ("nodal", "gauss-2"):
        one = scene(
            d,
            2,
            time={"steps": 1},
            elasticity=elasticity(d, 1e3, 0.0),
            heat={"conductivity": 1.0},
            supports={"displacement": ["left"]},
            contact={
                "part": "bottom",
                "stiffness": 1e-5,
                "gap": -0.1,
                "quadrature": quadrature,
                "heat_exchange": {"per_pressure": 1e6, "foundation_temperature": 1.0},
            },
        )
        # with the vertex rule a conductance by pressure is lumped at the nodes, a constant one is consistent
        constant = one.override(**{"contact.heat_exchange": {"conductance": 1.0, "foundation_temperature": 1.0}})
        theta, exact = (field(completed(each), "theta") for each in (one, constant))
        assert np.abs(theta - exact).max() <= (1e-7 if quadrature == "gauss-2" else 0.06)
        assert exact.max() > 0.3


# ---- right and stopped -----------------------------------------------------------------------------------------------


@check
def unloading(d: int) -> None:
    """u follows sin(2 pi t) through every zero of it."""
    one = scene(
        d,
        8 if d == 2 else 3,
        time={"steps": 10},
        elasticity=elasticity(d, 1000.0, 0.3),
        supports={"displacement": ["bottom"]},
        loads={"traction": {"top": along(d, "-sin(2*pi*t)")}},
    )
    simulation, found = Simulation(one), []
    for state, _ in simulation.steps():
        found.append(state.u)
    assert simulation.outcome == "completed"
    for n, u in enumerate(found, start=1):
        assert np.abs(u - found[0] * np.sin(np.pi * n / 5) / np.sin(np.pi / 5)).max() <= 1e-13 * np.abs(found[0]).max()


@check
def unloaded_at_once(d: int) -> None:
    simulation = completed(
        scene(
            d,
            2,
            time={"steps": 6},
            elasticity=elasticity(d, 1.0, 0.0),
            supports={"displacement": ["top"]},
            loads={"traction": {"left": ["where(t < 0.55, 0.0001, 0)", *[0.0] * (d - 1)]}},
            contact={"part": "bottom", "stiffness": 100.0, "gap": 0.01},
        )
    )
    assert np.abs(field(simulation, "u")).max() <= 1e-18


@check
def flight_without_load(d: int) -> None:
    for speed in (1e-6, 1.0, 1e6):
        simulation = completed(
            scene(
                d,
                1,
                time={"end": 0.01, "steps": 10},
                inertia={"density": 1.0},
                elasticity={"lame": [0.0, 1.0]},
                initial={"velocity": along(d, -speed)},
            )
        )
        assert np.abs(field(simulation, "u") - along(d, -0.01 * speed)).max() <= 1e-14 * speed


@check
def touches_with_zero_force(d: int) -> None:
    """A step ends just on the foundation."""
    for gap in (0.2, 1.0, 1.1):
        one = scene(
            d,
            1,
            time={"end": 1.0, "steps": 10},
            inertia={"density": 1.0},
            elasticity={"lame": [0.0, 450.0]},
            initial={"velocity": along(d, -2.0)},
            contact={"part": "bottom", "gap": gap, "stiffness": 100.0},
        )
        simulation, forces = Simulation(one), []
        for state, report in simulation.steps():
            if -state.u[0, -1] <= gap * (1 + 1e-14):
                forces.append(report.normal_force)
        assert simulation.outcome == "completed" and len(forces) >= round(gap / 0.2) - 1
        assert max(forces[: round(gap / 0.2) - 1], default=0.0) <= 1e-13


@check
def held_by_contact_alone(d: int) -> None:
    """A steel block (mm, t, s) on its foundation, in steps from a tenth of a wave's transit to a million of them: statics."""
    for end in (1e-4, 1e-2, 1.0, 1e4):
        simulation = completed(
            scene(
                d,
                4,
                length=10.0,
                time={"end": end, "steps": 50},
                inertia={"density": 7.85e-9},
                elasticity=elasticity(d, 210000.0, 0.3),
                loads={"traction": {"top": along(d, -1.0)}},
                contact={"part": "bottom", "stiffness": 1e6, "friction": {"coefficient": 0.2}},
            )
        )
        assert simulation.report.normal_force == pytest.approx(10.0 ** (d - 1), rel=1e-8)


@check
def quasistatic_on_contact(d: int) -> None:
    """No support and no inertia: the foundation holds the body, and nothing else does."""
    one = scene(
        d,
        3,
        time={"steps": 3},
        elasticity=elasticity(d, 1000.0, 0.3),
        loads={"body": along(d, -1.0, "0.1 * t")},
        contact={"part": "bottom", "stiffness": 1e5, "friction": {"coefficient": 0.5}},
    )
    simulation = completed(one)
    assert simulation.report.normal_force == pytest.approx(1.0, rel=1e-12)
    assert np.linalg.norm(simulation.report.friction_traction) == pytest.approx(0.1, rel=1e-12)
    for body in (along(d, 1.0), along(d, -1.0, 0.6)):
        lifted = Simulation(one.override(loads={"body": body}))
        assert not list(lifted.steps()) and lifted.outcome == "unsupported", lifted.outcome


@check
def a_warm_body_stays_warm(d: int) -> None:
    """Copper of 1 cm at 293.15 K in steps of an hour, insulated."""
    simulation = completed(
        scene(
            d,
            32 if d == 2 else 6,
            length=0.01,
            time={"end": 36000.0, "steps": 10},
            heat={"conductivity": 400.0, "capacity": 3.45e6},
            initial={"temperature": 293.15},
        )
    )
    assert np.abs(field(simulation, "theta") - 293.15).max() <= 1e-9


@check
def cooling(d: int) -> None:
    """Steel cools to its foundation, to 0 as to 20, until squares of temperatures underflow."""
    for ambient in (0.0, 20.0):
        simulation = completed(
            scene(
                d,
                4 if d == 2 else 2,
                length=0.1,
                time={"end": 200 * 3600.0, "steps": 200},
                heat={"conductivity": 50.0, "capacity": 3.6e6},
                initial={"temperature": 100.0},
                contact={"part": "bottom", "heat_exchange": {"conductance": 1e3, "foundation_temperature": ambient}},
            )
        )
        assert np.abs(field(simulation, "theta") - ambient).max() <= 1e-11


@check
def slender(d: int) -> None:
    """A column pushed at its side loses digits in proportion to its condition, and says how many are left."""
    n = [4, 40] if d == 2 else [2, 2, 20]
    one = scene(
        d,
        n,
        elasticity=elasticity(d, **STEEL),
        supports={"displacement": ["top"]},
        loads={"traction": {"left": along(d, 0.0, "1e3 * t")}},
        contact={"part": "bottom", "stiffness": 1e9, "gap": 1.0},
    ).override(**{"mesh.lengths": [0.02] * (d - 1) + [1.0]})
    simulation = completed(one, digits=6.0)
    other = Simulation(one, backend="petsc")
    for _ in other.steps():
        pass
    u, v = field(simulation, "u"), field(other, "u")
    assert np.abs(u - v).max() <= 10 ** (1 - summary(simulation)["digits"]["u"]) * np.abs(u).max()


@check
def stiff_and_rigid(d: int) -> None:
    """The pressures of ever stiffer foundations approach those of a rigid one in proportion to 1/c_nu."""
    base = warmslip.load("paper_mixed" if d == 2 else "block_3d").override(
        **{"mesh.n": 4 if d == 2 else 2, "time.steps": 4, "contact.gap": 0.001}
    )
    force = {}
    for stiffness in (1e5, 1e6, 1e7, 1e12, 1e16, "rigid"):
        simulation = completed(base.override(**{"contact.stiffness": stiffness}))
        assert set(simulation.statistics.stages) <= {"none", "newton"}, simulation.statistics.stages
        force[stiffness] = np.asarray(simulation.stepper.contact_force)
    size, rigid = np.abs(force["rigid"]).max(), force["rigid"]
    miss = {c: np.abs(f - rigid).max() / size for c, f in force.items()}
    assert size > 0.01 and miss[1e16] <= 1e-11 and miss[1e12] < 1e-3 * miss[1e7]
    assert miss[1e5] / miss[1e6] == pytest.approx(10, rel=0.1) and miss[1e6] / miss[1e7] == pytest.approx(10, rel=0.1)


@check
def contact_solver_does_not_give_up(d: int) -> None:
    """Flat cells under Gauss points: soft to nearly incompressible, slippery to rough, soft to stiff foundations."""
    for nu in (0.0, 0.45):
        for mu in (0.1, 0.8):
            for stiffness in (1e3, 1e6):
                for quadrature in ("nodal", "gauss-2"):
                    one = scene(
                        d,
                        [10, 2] if d == 2 else [3, 3, 1],
                        time={"steps": 3},
                        elasticity=elasticity(d, 1.0, nu),
                        supports={"displacement": {"top": along(d, "-0.02 * t", "0.05 * t")}},
                        contact={
                            "part": "bottom",
                            "stiffness": stiffness,
                            "quadrature": quadrature,
                            "friction": {"coefficient": mu},
                        },
                    ).override(**{"mesh.lengths": [5.0, 1.0] if d == 2 else [5.0, 5.0, 1.0]})
                    completed(one)


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
