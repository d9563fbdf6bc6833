"""Reactions of supports and heat flows of parts close the balances. `python test_reactions.py D` checks on its ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
from support.boxes import along, completed, elasticity, field, scene
from support.ranked import Checks

from warmslip.model.heat_flows import HeatFlows
from warmslip.model.reactions import Reactions, moments
from warmslip.model.state import resultants
from warmslip.simulation.simulation import Simulation

check = Checks()
SIDES = {2: ("left", "right"), 3: ("left", "right", "front", "back")}


def rollers(d: int) -> dict[str, Any]:
    """Planes across every axis but the last on both sides."""
    axis = {"left": 0, "right": 0, "front": 1, "back": 1}
    return {side: [0.0 if i == axis[side] else "free" for i in range(d)] for side in SIDES[d]}


@check
def a_block_in_a_box_presses_on_its_walls(d: int) -> None:
    """Under a pressure p between rollers: p on the bottom and p nu / (1 - nu) on the sides; a corner belongs to both."""
    p, nu = 2.0, 0.3
    held = {"displacement": rollers(d) | {"bottom": {"normal": 0.0}}}
    one = scene(
        d, 3, elasticity=elasticity(d, 10.0, nu), supports=held, loads={"traction": {"top": along(d, -p)}}, length=2.0
    )
    simulation = completed(one)
    reactions = Reactions(simulation.discretisation)
    force, moment = reactions.of(simulation.stepper)
    assert reactions.names == [*SIDES[d], "bottom"]
    area = 2.0 ** (d - 1)
    for name, f, m in zip(reactions.names, force, moment, strict=True):
        axis = {"left": 0, "right": 0, "front": 1, "back": 1}.get(name, d - 1)
        size = p * area * (1.0 if name == "bottom" else nu / (1 - nu)) * (-1 if name in ("right", "back") else 1)
        exact = size * np.eye(d)[axis]
        place = np.array([1.0] * d)
        place[axis] = 2.0 if name in ("right", "back") else 0.0
        assert np.abs(f - exact).max() <= 1e-13 * p * area
        assert np.abs(m - moments(place, exact)).max() <= 1e-13 * p * area


def loaded(d: int) -> Any:
    """A heavy, warm block on rollers, springs, a pin and a foundation with friction, which accelerates."""
    quadrature = {2: "gauss-2", 3: "nodal"}[d]
    return scene(
        d,
        {2: 5, 3: 3}[d],
        time={"steps": 3, "end": 0.3},
        inertia={"density": 2.0},
        elasticity=elasticity(d, 10.0, 0.3),
        viscosity={"lame": [0.2, 0.3]},
        heat={
            "conductivity": 1.0,
            "capacity": 2.0,
            "source": "1 + t",
            "expansion": {"tensor": 0.3, "reference_temperature": 0.1},
        },
        loads={"body": along(d, "-3 * t", "2 * x"), "traction": {"top": along(d, "-1 - t", 0.5)}},
        initial={"velocity": along(d, -0.2, 0.1)},
        supports={
            "displacement": {"left": along(d, "free", "0.01 * t") if d == 2 else ["0.01 * t", "free", "free"]},
            "points": [{"at": [1.0] * d, "displacement": [0.0] * d}],
            "springs": {
                "right": {"stiffness": 3.0, "normal_stiffness": 4.0, "damping": 1.0, "normal_damping": 2.0},
            },
            "temperature": {"left": "0.5 * t", "top": 0.2},
        },
        contact={
            "part": "bottom",
            "stiffness": 50.0,
            "friction": {"coefficient": 0.2},
            "quadrature": quadrature,
            "velocity": along(d, 0.0, 0.7),
            "heat_exchange": {"conductance": 2.0, "per_pressure": 3.0, "foundation_temperature": "1 + x**2 + t"},
            "friction_heating": {"share": 0.6},
        },
    )


@check
def forces_and_moments_are_the_rate_of_momentum(d: int) -> None:
    simulation = Simulation(loaded(d))
    assert Reactions(simulation.discretisation).names == ["left", "points.0", "springs.right"]
    assert closes(simulation) > 1e-3
    if d == 2:  # after steps that were taken back
        chosen = Simulation(loaded(d).override(**{"time.tolerance": 1e-2, "time.steps": 2}))
        closes(chosen)
        assert chosen.pace.record.rejected > 0


@check
def springs_on_a_body_that_moves_are_its_reactions(d: int) -> None:
    """Where they leave rigid motions free, the core keeps those apart from the strain."""
    kinds = [{"damping": 1.0, "normal_damping": 2.0}, {"stiffness": along(d, 2.0)}, {"normal_stiffness": 3.0}]
    for springs in kinds:
        one = scene(
            d,
            3,
            inertia={"density": 1.0},
            elasticity=elasticity(d, 10.0, 0.3),
            supports={"springs": {"right": springs}},
            loads={"body": along(d, -1.0, 0.4)},
            initial={"velocity": along(d, 0.3, 5.0)},
        )
        closes(Simulation(one))


def closes(simulation: Simulation) -> float:
    """Checks force and moment in every step, and gives the largest contact force."""
    discretisation, stepper, d = simulation.discretisation, simulation.stepper, simulation.discretisation.dim
    reactions, x = Reactions(discretisation), np.asarray(discretisation.mesh.nodes)
    points, before, pressed, t = (
        np.asarray(discretisation.surface.positions).reshape(-1, d),
        momentum(simulation),
        0.0,
        0.0,
    )
    for state, _ in simulation.steps():
        after, step = momentum(simulation), state.time - t
        rate, before, t = (after - before) / step, after, state.time
        acting = discretisation.field(discretisation.load_vectors.at(t, step).force) - rate
        pressing = np.reshape(stepper.contact_force, (-1, d))
        force, moment = reactions.of(stepper)
        scale = np.abs(force).max()
        assert scale > 0.01
        assert np.abs(force.sum(axis=0) - pressing.sum(axis=0) + acting.sum(axis=0)).max() <= 1e-12 * scale
        turning = moment.sum(axis=0) - moments(points, pressing).sum(axis=0) + moments(x, acting).sum(axis=0)
        assert np.abs(turning).max() <= 1e-12 * scale
        if len(points):
            pressed = max(pressed, float(np.abs(pressing).max()))
            on_body = resultants(discretisation, pressing[None])
            assert np.isclose(on_body["normal_force bottom"][0], -pressing[:, -1].sum(), rtol=1e-13)
    assert simulation.outcome == "completed"
    return pressed


def momentum(simulation: Simulation) -> Any:
    """What the nodes have of it, (nodes, d)."""
    discretisation = simulation.discretisation
    out = discretisation.layout.vector(discretisation.dim)
    discretisation.operators.inertia.mult(simulation.stepper.w, out)
    return discretisation.field(out)


@check
def heat_flows_are_the_rate_of_the_heat(d: int) -> None:
    for capacity in ("consistent", "lumped"):
        simulation = Simulation(loaded(d).override(**{"heat.capacity_matrix": capacity}))
        stepper, flows = simulation.stepper, HeatFlows(simulation.discretisation)
        assert flows.names == ["exchange bottom", "friction bottom", "support left", "support top"]
        before = content(simulation)
        for state, _ in simulation.steps():
            rate, before = (content(simulation) - before) / 0.1, content(simulation)
            found = dict(zip(flows.names, flows.of(stepper), strict=True))
            scale = max(map(abs, found.values()))
            assert min(map(abs, found.values())) > 1e-3 * scale
            assert abs(sum(found.values()) + 1 + state.time - rate) <= 1e-12 * scale
            assert found["friction bottom"] > 0


def content(simulation: Simulation) -> float:
    """The heat in the body."""
    discretisation = simulation.discretisation
    out = discretisation.layout.vector(1)
    discretisation.operators.mass.mult(simulation.stepper.theta, out)
    return float(out.sum())


@check
def a_direction_that_two_supports_hold_counts_for_the_first(d: int) -> None:
    """And a node between two inclined guides has its reaction along the normals of both."""
    held = {"bottom": [0.0] * d, "left": [0.0] * d}
    one = scene(d, 2, elasticity=elasticity(d, 10.0, 0.3), supports={"displacement": held})
    one = one.override(**{"loads.body": along(d, -1.0, 0.5)})
    totals = []
    for order in (held, dict(reversed(held.items()))):
        simulation = completed(one.override(**{"supports.displacement": order}))
        nodal = field(simulation, "reactions")
        parts = simulation.discretisation.mesh.parts
        first, second = (np.unique(parts[name]) for name in order)
        force, _ = Reactions(simulation.discretisation).of(simulation.stepper)
        assert np.abs(force[0] - nodal[first].sum(axis=0)).max() <= 1e-14
        assert np.abs(force[1] - nodal[np.setdiff1d(second, first)].sum(axis=0)).max() <= 1e-14
        totals.append(force.sum(axis=0))
    assert np.abs(totals[0] - totals[1]).max() <= 1e-14


test_on_one_rank, test_on_two_ranks = check.tests(__file__)

if __name__ == "__main__":
    check.main()
