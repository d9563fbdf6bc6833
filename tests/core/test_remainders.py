"""What is left of far larger numbers keeps its digits: depths in a hard foundation, forces of a light touch, heat of rest.

In the plane and in space, on one and on two ranks: `python test_remainders.py` checks all on the ranks it has.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.boxes import along, completed, elasticity, field, forces_of, scene, turned
from support.ranked import Checks

from warmslip import discretise
from warmslip.simulation.simulation import Simulation

check = Checks()
STEEL: dict[str, Any] = {"young": 2.1e11, "poisson": 0.3}


def bottom(simulation: Simulation) -> Any:
    """Which nodes lie at the bottom, (nodes)."""
    return np.asarray(simulation.discretisation.mesh.nodes)[:, -1] == 0


# ---- depths ----------------------------------------------------------------------------------------------------------


@check
def depths_far_below_the_free_motion(d: int) -> None:
    """Every node of one grid cell is held or presses on a foundation 1e12 times as stiff: u is the depth p / c, and no more."""
    for coupling in ("staggered", "monolithic"):
        simulation = completed(
            scene(
                d,
                1,
                length=0.1,
                time={"steps": 4, "coupling": coupling},
                inertia={"density": 7800.0},
                elasticity=elasticity(d, **STEEL),
                loads={"traction": {"right": along(d, -2e3, 1e4)}, "body": along(d, -1e6)},
                supports={"displacement": ["top"], "temperature": ["top"]},
                heat={
                    "conductivity": 50.0,
                    "capacity": 3.6e6,
                    "expansion": {"tensor": 1e6},
                    "heating": {"tensor": -1e6},
                },
                contact={"part": "bottom", "stiffness": 1e24, "friction": {"coefficient": 0.5}},
            ),
            digits=12.0,
        )
        depth = -field(simulation, "u")[bottom(simulation), -1]
        pressure = -forces_of(simulation)[:, -1] / np.asarray(simulation.discretisation.surface.weights)
        assert pressure.min() > 1e3 and depth == pytest.approx(pressure / 1e24, rel=1e-12)


@check
def energy_of_a_stiff_foundation(d: int) -> None:
    """Of depths that are rounding of the displacement, the energy is that of the forces."""
    stiffness = 1e15
    simulation = completed(
        scene(
            d,
            2,
            time={"steps": 2},
            elasticity=elasticity(d, 1.0, 0.3),
            supports={"displacement": {"top": along(d, "-0.5 * t")}},
            contact={"part": "bottom", "stiffness": stiffness, "gap": 0.3},
        ),
        digits=6.0,
    )
    pressing = -forces_of(simulation)[:, -1]
    stored = (pressing**2 / np.asarray(simulation.discretisation.surface.weights)).sum() / (2 * stiffness)
    assert pressing.sum() > 0.1 and simulation.report.balances.contact == pytest.approx(stored, rel=1e-10, abs=0)


@check
def a_body_comes_to_rest(d: int) -> None:
    """A block thrown on to a rough foundation stops: what is left of its speed is 1e-11 of it, and has all its digits."""
    for stiffness in (3e9, "rigid"):
        simulation = completed(
            scene(
                d,
                1,
                length=100.0,
                time={"end": 2.0, "steps": 2},
                inertia={"density": 7.8e-9},
                elasticity=elasticity(d, 2.1e8, 0.1),
                initial={"velocity": along(d, -4e4, 1e4)},
                contact={"part": "bottom", "stiffness": stiffness, "gap": 1e-8, "friction": {"coefficient": 1.7}},
            ),
            digits=11.0,
        )
        u = field(simulation, "u")
        assert np.asarray(simulation.stepper.status).min() > 0 and np.abs(u).max() < 1e-5
        assert np.abs(u[bottom(simulation), -1] + 1e-8).max() <= 1e-9


# ---- light touches ---------------------------------------------------------------------------------------------------


@check
def loaded_by_supports_alone(d: int) -> None:
    """A bar sheared by its ends, from square to a hundred times as long, has digits of its stress in step with its condition."""
    for length in (1.0, 10.0, 100.0):
        one = scene(
            d,
            [2, 8] if d == 2 else [2, 2, 8],
            time={"steps": 1},
            elasticity=elasticity(d, 100.0, 0.3),
            supports={"displacement": {"top": along(d, "-0.01 * t"), "bottom": along(d, 0.0)}},
        ).override(**{"mesh.lengths": [1.0] * (d - 1) + [length]})
        completed(one, digits=13.0 - 1.5 * np.log10(length))


@check
def a_warmed_rod(d: int) -> None:
    """A rod at 293.15 is heated at its foot; in the first step nothing expands yet, and u of zero is no u without digits."""
    one = scene(
        d,
        [2, 8] if d == 2 else [2, 2, 20],
        time={"end": 30.0, "steps": 3},
        elasticity=elasticity(d, **STEEL),
        supports={"displacement": ["top"]},
        heat={"conductivity": 50.0, "capacity": 3.6e6, "expansion": {"alpha": 1.2e-5, "reference_temperature": 293.15}},
        initial={"temperature": 293.15},
        contact={"part": "bottom", "heat_exchange": {"conductance": 1e3, "foundation_temperature": 393.15}},
    ).override(**{"mesh.lengths": [0.1] * (d - 1) + [1.0]})
    completed(one, digits=5.0)


# ---- heat at rest, and of a contact that leads it well ---------------------------------------------------------------


@check
def rest_makes_no_heat(d: int) -> None:
    """Points that stick make no heat at all, nodal or Gauss's, however hard they are pushed."""
    for quadrature in ("nodal", "gauss-2"):
        simulation = completed(
            scene(
                d,
                2,
                time={"steps": 3},
                elasticity=elasticity(d, **STEEL),
                loads={"traction": {"top": along(d, -1e6, 1e3)}},
                supports={"displacement": ["left"]},
                heat={"conductivity": 50.0, "capacity": 3.6e6},
                contact={
                    "part": "bottom",
                    "stiffness": "rigid",
                    "quadrature": quadrature,
                    "friction": {"coefficient": 50.0},
                    "friction_heating": {"share": 0.5},
                },
            )
        )
        assert np.asarray(simulation.stepper.status).max() == 1 and np.abs(field(simulation, "theta")).max() == 0


@check
def a_contact_that_leads_all_heat(d: int) -> None:
    """A contact of ever better conductance takes the temperature of the foundation, to the digits that doubles leave it."""
    miss = {}
    for per_pressure in (1e4, 1e5, 1e15, 1e18):
        simulation = completed(
            scene(
                d,
                4 if d == 2 else 2,
                time={"steps": 3},
                elasticity=elasticity(d, 1.0, 0.3),
                loads={"body": along(d, -1.0)},
                supports={"displacement": ["top"]},
                heat={"conductivity": 1.0, "capacity": 1.0},
                contact={
                    "part": "bottom",
                    "stiffness": 10.0,
                    "heat_exchange": {
                        "conductance": 0.0,
                        "per_pressure": per_pressure,
                        "foundation_temperature": 400.0,
                    },
                },
            )
        )
        miss[per_pressure] = np.abs(field(simulation, "theta")[bottom(simulation)] / 400.0 - 1).max()
    assert miss[1e4] / miss[1e5] == pytest.approx(10, rel=0.02) and max(miss[1e15], 1e-3 * miss[1e18]) <= 1e-14


# ---- friction and its sharpness --------------------------------------------------------------------------------------


@check
def regularised_friction_of_any_sharpness(d: int) -> None:
    """Newton's method needs no more steps for a sharper law, and the answers approach that of the exact one."""
    answers = {}
    for sharpness in (0.0, 1e-4, 1e-5, 1e-6, 1e-12):
        friction = {"coefficient": 2.0} | ({"regularisation": sharpness} if sharpness else {})
        simulation = completed(
            scene(
                d,
                1,
                time={"steps": 1},
                elasticity=elasticity(d, 100.0, 0.3),
                supports={"displacement": {"top": along(d, "-0.01 * t", "0.002 * t")}},
                contact={"part": "bottom", "stiffness": 1e4, "friction": friction},
            )
        )
        assert set(simulation.statistics.stages) == {"newton"} and simulation.statistics.newton_max <= 6
        answers[sharpness] = forces_of(simulation)
    exact = answers.pop(0.0)
    miss = {e: np.abs(found - exact).max() / np.abs(exact).max() for e, found in answers.items()}
    assert miss[1e-5] / miss[1e-6] == pytest.approx(10, rel=0.1) and miss[1e-12] <= 1e-9


@check
def gauss_points_on_a_rigid_foundation(d: int) -> None:
    """Points outnumber the nodes that move them; the force of each is a share, and their resultant the weight of the body."""
    for friction in ({}, {"friction": {"coefficient": 0.3}}):
        for supports in ({"displacement": ["top"]}, None):
            tables = {} if supports is None else {"supports": supports}
            simulation = completed(
                scene(
                    d,
                    3,
                    time={"end": 0.4, "steps": 4},
                    inertia={"density": 1.0},
                    elasticity=elasticity(d, 100.0, 0.3),
                    loads={"body": along(d, -1.0, 0.1)},
                    contact={"part": "bottom", "stiffness": "rigid", "quadrature": "gauss-2"} | friction,
                    **tables,
                )
            )
            if supports is None and friction:  # it rests
                assert -forces_of(simulation).sum(axis=0)[-1] == pytest.approx(1.0, rel=0.05)


@check
def shares_beside_a_clamped_edge(d: int) -> None:
    """Gauss points whose force a support takes in part have the least share too, whichever way the solver came."""
    one = scene(
        d,
        [2, 1] if d == 2 else [2, 1, 1],
        time={"steps": 1},
        elasticity=elasticity(d, 1.0, 0.25),
        supports={"displacement": ["top", "left"]},
        loads={"body": along(d, -0.02), "traction": {"right": along(d, -0.01, 0.02)}},
        contact={"part": "bottom", "stiffness": 90.0, "quadrature": "gauss-3", "friction": {"cohesion": 0.005}},
    ).override(**{"mesh.lengths": [1.0] * (d - 1) + [0.1]})
    other = Simulation(one, backend="petsc")
    for _ in other.steps():
        pass
    found, again = forces_of(completed(one)), forces_of(other)
    assert np.abs(found[:, 0]).max() > 1e-4 and np.abs(found - again).max() <= 1e-12 * np.abs(found).max()


@check
def shares_of_as_many_points_as_nodes(d: int) -> None:
    """A cell beside its support: the node that moves has more points than it needs; their least share is N f / sum N^2."""
    one = scene(
        d,
        1,
        time={"steps": 1},
        elasticity=elasticity(d, 1.0, 0.3),
        supports={"displacement": ["right"]},
        loads={"body": along(d, -1e-3)},
        contact={"part": "bottom", "stiffness": "rigid", "quadrature": "gauss-2"},
    )
    simulation = completed(one)
    surface = simulation.discretisation.surface
    found = -forces_of(simulation)[:, -1]
    nodes, places = np.asarray(simulation.discretisation.mesh.nodes), np.asarray(surface.positions)
    shape = np.zeros((len(places), len(nodes)))
    for facet in np.asarray(
        simulation.discretisation.mesh.parts["bottom"]
    ):  # barycentric coordinates where they are positive
        corners = np.vstack([nodes[facet, :-1].T, np.ones(d)])
        inside = np.linalg.solve(corners, np.vstack([places[:, :-1].T, np.ones(len(places))])).T
        own = inside.min(axis=1) > 0
        shape[np.ix_(own, facet)] = inside[own]
    shape = shape[:, (nodes[:, 0] == 0) & (shape.sum(axis=0) > 0)]  # of the nodes that move
    weights = np.asarray(surface.weights)
    nodal = shape.T @ found
    least = weights * (shape @ np.linalg.solve(shape.T @ (weights[:, None] * shape), nodal))
    assert least.min() > 0 and np.abs(found - least).max() <= 1e-13 * least.max()


@check
def pressures_on_a_rigid_foundation(d: int) -> None:
    """Resting points have the least share of their pressure: one only, and linear in every facet but for those that bear none."""
    for friction in ({}, {"friction": {"coefficient": 0.3, "cohesion": 0.001}}):
        one = scene(
            d,
            3,
            time={"steps": 1},
            elasticity=elasticity(d, 1.0, 0.25),
            supports={"displacement": {"top": along(d, "-0.001 * t", "0.0008 * t")}},
            contact={"part": "bottom", "stiffness": "rigid", "quadrature": "gauss-3"} | friction,
        )
        simulation, other = completed(one), Simulation(one, backend="petsc")
        for _ in other.steps():
            pass
        found, again = forces_of(simulation), forces_of(other)
        assert np.abs(found - again).max() <= 1e-11 * np.abs(found).max()
        traction = found / np.asarray(simulation.discretisation.surface.weights)[:, None]
        pressing = -traction[:, -1]
        assert pressing.min() >= 0
        if friction:
            continue  # at its bound the friction holds the pressure back
        compliance = np.array(simulation.stepper.contact_compliance)[d - 1 :: d, d - 1 :: d]
        values, modes = np.linalg.eigh(compliance)  # whose range are the fields that are linear in every facet
        linear = modes[:, values > 1e-9 * values[-1]]
        bears = pressing > 0
        nodal = np.linalg.lstsq(linear[bears], pressing[bears], rcond=None)[0]
        assert bears.sum() > linear.shape[1]
        assert np.abs(linear[bears] @ nodal - pressing[bears]).max() <= 1e-9 * pressing.max()


@check
def forces_beside_a_wall_that_is_never_touched(d: int) -> None:
    """A block that flies along its foundation towards a wall 15 km away presses as it does without the wall."""
    turn = np.linalg.qr(np.array([[0.8, -0.6, 0.1], [0.5, 0.7, -0.3], [0.2, 0.4, 0.9]])[:d, :d])[0]
    turn *= np.linalg.det(turn) if d == 3 else [np.linalg.det(turn), 1.0]
    laws: list[dict[str, Any]] = [{"stiffness": 1e9}, {"stiffness": 1e12, "exponent": 1.5}, {"stiffness": "rigid"}]
    # axes that are askew mix the flight into the depths, whose rounding is 1e-13 of it
    for law, axes, share in [*((law, np.eye(d), 1e-7) for law in laws), (laws[1], turn, 1e-5)]:
        floor = {"part": "bottom", "friction": {"coefficient": 0.3}} | law
        found = []
        for walls in ([], [{"part": "left", "stiffness": 1e9, "gap": 15000.0}]):
            falls = scene(
                d,
                2,
                time={"end": 10.0, "steps": 5},
                elasticity=elasticity(d, **STEEL),
                inertia={"density": 7800.0},
                initial={"velocity": (axes @ along(d, 0.0, -140.0)).tolist()},
                loads={"body": along(d, 0.0)},
                contact=[floor, *walls],
            )
            one, mesh = turned(falls, axes)
            place = " + ".join(f"({a!r}) * {x}" for a, x in zip(axes[:, 0].tolist(), "xyz", strict=False))
            pull = (axes @ along(d, -1.0)).tolist()
            one = one.override(**{"loads.traction.top": [f"({a!r}) * (1 + sin(3 * t) + {place})" for a in pull]})
            simulation = Simulation(one, discretisation=discretise(one, mesh=mesh))
            forces = []
            for _ in simulation.steps():
                bears = np.asarray(simulation.discretisation.surface.contacts) == 0
                forces.append(forces_of(simulation)[bears])
            assert simulation.outcome == "completed", simulation.failure
            found.append(np.array(forces))
        error, size = np.abs(found[1] - found[0]).max(), np.abs(found[0]).max()
        assert error <= share * size, (law, error / size)


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
