"""Limits of the data against the limiting models, with their rates, in the plane and in space.

Every check compares fields by the largest difference over the largest value. A datum moves by a factor of ten; the miss of a
limit of first order then falls by ten, of second order by a hundred.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from support.boxes import along, completed, elasticity, field, fields, misses, scene

import warmslip
from warmslip import Scene
from warmslip.model.foresight import before, gradients
from warmslip.simulation.simulation import Simulation

pytestmark = pytest.mark.parametrize("d", [2, 3])
ROUND_OFF = 1e-12
STIFF = {"elasticity.young": 20.0}


def pushed(d: int, **keys: Any) -> Scene:
    """The paper's whole problem on few cells: pressed, pushed sideways, with inertia, viscosity, friction and heat."""
    small = {"mesh.n": 4 if d == 2 else 2, "time.steps": 4}
    return warmslip.load("paper_mixed" if d == 2 else "block_3d").override(**small | keys)


def approaches(
    limit: Scene, near: Callable[[float], Scene], *, order: float, first: float = 1e-3, last: float | None = 1e-13
) -> None:
    """Every field of `near(e)` misses the limiting model in proportion to e^order, at e = `first` and a tenth of it.

    At e = `last` no difference is left but round-off.
    """
    exact = fields(completed(limit))
    falls(exact, near, order=order, first=first)
    if last is not None:
        assert max(misses(fields(completed(near(last))), exact).values()) <= 10 * ROUND_OFF


def falls(exact: dict[str, Any], near: Callable[[float], Scene], *, order: float, first: float) -> None:
    """As `approaches`, of a limit whose fields are known."""
    assert all(np.abs(value).max() > 0 for value in exact.values())
    large, small = (misses(fields(completed(near(e))), exact) for e in (first, first / 10))
    assert max(large.values()) <= 0.1, large
    assert min(small.values()) >= 100 * ROUND_OFF, small
    rates = {name: float(np.log10(large[name] / small[name])) for name in exact}
    assert rates == pytest.approx(dict.fromkeys(exact, order), abs=0.04), (rates, large, small)


# ---- friction --------------------------------------------------------------------------------------------------------


def test_friction_to_none(d: int) -> None:
    """All points slide, and the friction force is mu times a pressure: the miss is of first order in mu."""
    approaches(
        pushed(d, **{"contact.friction": None}), lambda mu: pushed(d, **{"contact.friction.coefficient": mu}), order=1
    )


def squeezed(d: int, **tables: Any) -> Scene:
    """A block under its push, hung on a plate that comes down and moves sideways; `tables` say what is below it."""
    plate = {"top": along(d, "-0.01 * t", "0.002 * t")}
    return scene(
        d,
        4 if d == 2 else 3,
        elasticity=elasticity(d, 100.0, 0.3),
        loads={"body": along(d, 0.0, 0.2)},
        supports={"displacement": plate},
        **tables,
    )


def stuck(d: int, coefficient: float) -> Scene:
    friction = {"coefficient": coefficient}
    return squeezed(d, contact={"part": "bottom", "stiffness": "rigid", "friction": friction})


def test_friction_to_full_stick(d: int) -> None:
    """A rigid foundation with friction beyond a bound is a clamp: the two are equal, and just below the bound they are not.

    The bound is the largest ratio of tangential to normal force of the block that sticks.
    """
    clamped = squeezed(d)
    plates = {"bottom": [0.0] * d, **clamped.supports.moved}
    exact = fields(completed(clamped.override(**{"supports.displacement": plates})))
    simulation, ratios = Simulation(stuck(d, 1e3)), []
    for _, report in simulation.steps():
        assert report.stick == len(simulation.discretisation.surface.weights)
        force = fields(simulation)["contact force"]
        ratios += [np.linalg.norm(force[:, :-1], axis=1) / np.abs(force[:, -1])]
    assert simulation.outcome == "completed"
    bound = float(np.max(ratios))
    assert 0.1 < bound < 10
    for coefficient in (1.001 * bound, 1e6):
        assert max(misses(fields(completed(stuck(d, coefficient))), exact).values()) <= ROUND_OFF
    assert misses(fields(completed(stuck(d, 0.99 * bound))), exact)["u"] > 1e-6


def test_regularised_friction_where_all_slips(d: int) -> None:
    """A sliding point feels mu p w / sqrt(w^2 + e^2): the miss is of second order in e."""
    slipping = {"contact.friction.coefficient": 0.01}
    approaches(
        pushed(d, **slipping),
        lambda e: pushed(d, **slipping, **{"contact.friction.regularisation": e}),
        order=2,
        first=1e-2,
    )


def test_regularised_friction_where_points_stick(d: int) -> None:
    """A sticking point creeps at a speed in proportion to e: the miss is of first order in e."""
    sticking = {"contact.friction.coefficient": 2.0}
    approaches(
        pushed(d, **sticking),
        lambda e: pushed(d, **sticking, **{"contact.friction.regularisation": e}),
        order=1,
        first=1e-4,
        last=None,
    )


# ---- motion ----------------------------------------------------------------------------------------------------------


def test_viscosity_to_none(d: int) -> None:
    """Viscous forces are in proportion to the viscosity while the step stays: first order."""
    approaches(pushed(d, viscosity=None, **STIFF), lambda e: pushed(d, **STIFF, **{"viscosity.lame": [e, e]}), order=1)


def test_density_to_none(d: int) -> None:
    """Inertial forces are in proportion to the density while the step stays: first order, against the quasistatic scene."""
    approaches(pushed(d, inertia=None), lambda e: pushed(d, **{"inertia.density": e}), order=1)


# ---- heat ------------------------------------------------------------------------------------------------------------


def test_conductance_to_none(d: int) -> None:
    """The foundation's heat is in proportion to k_c: first order, against the insulated part."""
    hot = {"contact.heat_exchange.foundation_temperature": 10.0}
    approaches(
        pushed(d, **{"contact.heat_exchange": None}),
        lambda e: pushed(d, **hot, **{"contact.heat_exchange.conductance": e}),
        order=1,
    )


def test_conductance_to_a_given_temperature(d: int) -> None:
    """The jump of temperature is a flux over k_c: first order in 1/k_c, against a temperature that is given.

    The body starts at the foundation's temperature, as a given temperature holds from the start.
    """
    warm: dict[str, Any] = {
        "elasticity": elasticity(d, 2.0, 0.3),
        "heat": {"conductivity": 1.0, "capacity": 2.0, "source": "1 + x", "expansion": {"tensor": 0.1}},
        "initial": {"temperature": 10.0},
    }
    cold = {"displacement": ["top"], "temperature": {"top": 0.0}}
    foundation = {"conductance": 1.0, "foundation_temperature": 10.0}
    conducted = scene(d, 4, **warm, supports=cold, contact={"part": "bottom", "heat_exchange": foundation})
    approaches(
        scene(d, 4, **warm, supports=cold | {"temperature": {"top": 0.0, "bottom": 10.0}}),
        lambda e: conducted.override(**{"contact.heat_exchange.conductance": 1 / e}),
        order=1,
    )


@pytest.mark.parametrize("capacity", ["consistent", "lumped"])
def test_conductivity_to_singular(d: int, capacity: str) -> None:
    """Across the direction v that alone conducts, e conducts a heat in proportion to e: first order, along axes and askew."""
    straight, askew = np.eye(d)[-1], np.ones(d) / np.sqrt(d)
    for v in (straight, askew):

        def with_conductivity(e: float, v: Any = v) -> Scene:
            tensor = np.outer(v, v) + e * (np.eye(d) - np.outer(v, v))
            return pushed(d, **{"heat.conductivity": tensor, "heat.capacity_matrix": capacity, "heat.source": "x + y"})

        approaches(with_conductivity(0.0), with_conductivity, order=1)


# ---- steps -----------------------------------------------------------------------------------------------------------


def linear(d: int, **time: Any) -> Scene:
    """A block without friction that stays closed: a linear system of ordinary differential equations in time."""
    return scene(
        d,
        2,
        time=time,
        inertia={"density": 1.0},
        elasticity=elasticity(d, 2.0, 0.3),
        viscosity={"lame": [0.5, 0.5]},
        heat={"conductivity": 1.0, "capacity": 2.0, "expansion": {"tensor": 0.3}, "heating": {"tensor": -0.3}},
        loads={"body": along(d, -1.0, 0.5)},
        supports={"displacement": ["top"], "temperature": ["top"]},
        initial={"velocity": along(d, "y - 1", "1 - y"), "temperature": "1 - y"},
        contact={
            "part": "bottom",
            "stiffness": 5.0,
            "gap": -1.0,
            "heat_exchange": {"conductance": 2.0, "foundation_temperature": 3.0},
        },
    )


def semi_discrete(d: int, end: float) -> dict[str, Any]:
    """u, w and theta of `linear`, exact in time: the exponential of the assembled operators and of the foundation's springs."""
    built = Simulation(linear(d, end=end, steps=1)).discretisation
    o, stepper = built.operators, built.stepper()
    start = {name: getattr(stepper, name).array.copy() for name in ("u", "w", "theta")}
    rows = {name: order_of(built, getattr(stepper, name)) for name in ("u", "theta")}
    loads = built.load_vectors.at(0.0, end)
    stiffness, push = dense(o.elasticity), loads.force.array.copy()
    contact = built.scene.contacts[0]
    for place, weight in zip(np.asarray(built.surface.positions), built.surface.weights, strict=True):
        node = int(np.argmin(np.linalg.norm(np.asarray(built.mesh.nodes) - place, axis=1)))
        row = rows["u"][node, -1]  # the outward normal is -e_d
        stiffness[row, row] += weight * contact.compliance
        push[row] -= weight * contact.compliance * float(contact.gap)
    moves = np.setdiff1d(np.arange(len(push)), o.prescribed_displacement)
    warms = np.setdiff1d(np.arange(len(start["theta"])), o.prescribed_temperature)
    free = {"u": moves, "w": moves, "theta": warms}
    forces = {"u": -stiffness, "w": -dense(o.viscosity), "theta": dense(o.expansion), "1": push[:, None]}
    heats = {
        "u": np.zeros_like(dense(o.heating)),
        "w": dense(o.heating),
        "theta": -dense(o.conductivity) - dense(o.exchange),
        "1": loads.heat.array[:, None],
    }
    columns = {**free, "1": np.zeros(1, dtype=int)}
    acceleration = np.hstack([forces[name][np.ix_(moves, columns[name])] for name in columns])
    warming = np.hstack([heats[name][np.ix_(warms, columns[name])] for name in columns])
    n, size = len(moves), acceleration.shape[1]
    flow = np.zeros((size, size))
    flow[:n, n : 2 * n] = np.eye(n)
    flow[n : 2 * n] = np.linalg.solve(dense(o.inertia)[np.ix_(moves, moves)], acceleration)
    flow[2 * n : -1] = np.linalg.solve(dense(o.mass)[np.ix_(warms, warms)], warming)
    began = np.concatenate([*(start[name][free[name]] for name in free), [1.0]])
    ended = np.split((expm(end * flow) @ began)[:-1], [n, 2 * n])
    out = {}
    for name, values in zip(free, ended, strict=True):
        whole = start[name]  # on the supports the start is kept: they are at rest, at zero
        whole[free[name]] = values
        out[name] = whole[rows["theta" if name == "theta" else "u"]]
    return out


def dense(matrix: Any) -> Any:
    return matrix.convert("dense").getDenseArray().copy()


def order_of(built: Any, vector: Any) -> Any:
    """The row of every node (nodes, d) or (nodes,) in the core's vectors."""
    numbers = vector.duplicate()
    numbers.setArray(np.arange(vector.getSize(), dtype=float))
    return built.field(numbers).round().astype(int)


def test_step_to_none(d: int) -> None:
    """Backward Euler with a staggered coupling approaches the equations in time with first order in k."""
    end = 0.25
    falls(semi_discrete(d, end), lambda k: linear(d, end=end, steps=round(end / k)), order=1, first=1e-2)


def test_one_short_step(d: int) -> None:
    """One step from the initial data changes them in proportion to k."""
    simulation = Simulation(linear(d, end=1.0, steps=1))
    start = {name: field(simulation, name) for name in ("w", "theta")}
    falls(start, lambda k: linear(d, end=k, steps=1), order=1, first=1e-4)


def test_one_huge_step_is_elastic_statics(d: int) -> None:
    """Of inertia and viscosity in one step k, rho/k^2 and 1/k are left: first order in 1/k, against the scene without both.

    The speed falls like 1/k by itself, and friction sees its direction alone.
    """
    cold = {"heat": None, "supports.temperature": [], "contact.heat_exchange": None, "time.steps": 1}
    statics = pushed(d, inertia=None, viscosity=None, **cold)
    exact = {name: value for name, value in fields(completed(statics)).items() if name in ("u", "contact force")}
    falls(exact, lambda e: pushed(d, **cold, **{"time.end": 1 / e}), order=1, first=1e-3)


def test_one_huge_step_is_a_steady_temperature(d: int) -> None:
    """A slab between a foundation of 10 and a top of 0: heat stored in one step k is of first order in 1/k."""
    k_c, conductivity = 2.0, 1.0
    slab = scene(
        d,
        4,
        time={"end": 1.0, "steps": 1},
        heat={"conductivity": conductivity, "capacity": 3.0},
        supports={"temperature": ["top"]},
        contact={"part": "bottom", "heat_exchange": {"conductance": k_c, "foundation_temperature": 10.0}},
    )
    height = np.asarray(warmslip.discretise(slab).mesh.nodes)[:, -1]
    exact = {"theta": 10.0 / (1 + conductivity / k_c) * (1 - height)}
    falls(exact, lambda e: slab.override(**{"time.end": 1 / e}), order=1, first=1e-4)


# ---- incompressibility -----------------------------------------------------------------------------------------------


def pressure(simulation: Any) -> Any:
    """-lambda div u of every cell, (cells,)."""
    built = simulation.discretisation
    cells = np.asarray(built.mesh.cells)
    slopes = gradients(np.asarray(built.mesh.nodes)[cells])
    return -built.scene.elasticity.pair(built.dim)[0] * np.einsum("cad,cad->c", slopes, field(simulation, "u")[cells])


def test_poisson_to_a_half(d: int) -> None:
    """Displacement, contact force and pressure approach something finite in proportion to 1 - 2 nu; locking is warned of.

    The change from one ratio to the next then falls by ten whenever 1 - 2 nu does.
    """
    found = []
    for e in (1e-4, 1e-5, 1e-6, 1e-7):
        one = squeezed(
            d,
            **{"mesh": {"shape": "square", "n": 4, "diagonal": "crisscross"}} if d == 2 else {},
            contact={"part": "bottom", "stiffness": 1e4, "friction": {"coefficient": 0.3}},
        ).override(elasticity=elasticity(d, 100.0, 0.5 - e / 2))
        simulation = completed(one, digits=6)
        found.append(
            {
                "u": field(simulation, "u"),
                "pressure": pressure(simulation),
                "force": fields(simulation)["contact force"],
            }
        )
        assert any("linear elements lock" in message for message in before(simulation.discretisation)) == (d == 3)
    changes = [misses(one, other) for one, other in pairwise(found)]
    for large, small in pairwise(changes):
        rates = {name: np.log10(large[name] / small[name]) for name in small}
        assert rates == pytest.approx(dict.fromkeys(rates, 1.0), abs=0.1), changes
    assert 1e-8 < max(changes[-1].values()) < 1e-3
