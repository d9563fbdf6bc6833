"""Bodies without supports: coupled with heat at the new time level, and free to slide on their foundation.

`python test_free_bodies.py` checks all of it on the ranks it has.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from support.boxes import along, completed, elasticity, field, scene
from support.ranked import Checks

from warmslip import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

check = Checks()
EXPANSION = 2.0
MASS = {d: 7.85e-9 * 10.0**d for d in (2, 3)}


def turned(d: int) -> list[list[float]]:
    """A heating tensor that is no multiple of the expansion's: the coupled operator is not symmetric."""
    tensor = -np.diag([1.0, 2.0, 1.0][:d])
    tensor[0, 1] = tensor[1, 0] = 0.3
    return tensor.tolist()


def heated(d: int, heating: Any, **more: Any) -> dict[str, Any]:
    return {
        "conductivity": 50.0,
        "capacity": 3.6,
        "expansion": {"tensor": EXPANSION},
        "heating": {"tensor": heating},
    } | more


def couplings(d: int) -> tuple[Any, ...]:
    """R = -M, no heating, and no multiple of M: a symmetric and two unsymmetric operators."""
    return -EXPANSION, 0.0, turned(d)


def steel(d: int, n: int, end: float, **tables: Any) -> Scene:
    """A block of 10 mm in mm, t and s; its waves cross it in 2e-6 s."""
    return scene(
        d,
        n,
        length=10.0,
        time={"end": end, "steps": 4, "coupling": "monolithic"},
        inertia={"density": 7.85e-9},
        elasticity=elasticity(d, 210000.0, 0.3),
        **tables,
    )


def momentum(simulation: Simulation) -> Any:
    return simulation.discretisation.field(simulation.discretisation.operators.inertia * simulation.stepper.w).sum(
        axis=0
    )


@check
def warm_flight(d: int) -> None:
    """Uniform heat in free flight: the body expands about its centre as E^-1 M theta I, and the centre flies on."""
    stiffness = 210000.0 / (1 - 2 * 0.3) / (1.3 if d == 2 else 1.0)
    for heating in couplings(d):
        for end in (1e-3, 1e4):
            flight = np.asarray(along(d, 10.0, -3.0))
            simulation = completed(
                steel(
                    d,
                    4 if d == 2 else 2,
                    end,
                    heat=heated(d, heating, source=f"{36.0 / end}"),
                    initial={"velocity": list(flight / end)},
                )
            )
            exact = MASS[d] * flight / end
            assert np.abs(momentum(simulation) - exact).max() <= 1e-13 * np.abs(exact).max()
            if end < 1:
                continue  # elastic waves have not died away
            strain = EXPANSION / stiffness
            theta = 36.0 / (3.6 - strain * (np.trace(heating) if isinstance(heating, list) else d * heating))
            x = np.asarray(simulation.discretisation.mesh.nodes) - 5.0
            assert np.abs(field(simulation, "theta") - theta).max() <= 1e-11 * theta
            assert np.abs(field(simulation, "u") - flight - strain * theta * x).max() <= 1e-12 * np.abs(flight).max()


@check
def warm_and_held_by_contact(d: int) -> None:
    """Statics whatever the coupling, from steps of the waves' transit to some that are a billion times as long."""
    for heating in couplings(d):
        for end in (1e-2, 1.0, 1e4):
            simulation = completed(
                steel(
                    d,
                    3,
                    end,
                    heat=heated(d, heating, source=f"{1.0 / end} * x"),
                    loads={"traction": {"top": along(d, -1.0)}},
                    contact={"part": "bottom", "stiffness": 1e6, "friction": {"coefficient": 0.2}},
                )
            )
            assert simulation.report.normal_force == pytest.approx(10.0 ** (d - 1), rel=1e-8)


@check
def strongly_coupled_and_unsymmetric(d: int) -> None:
    """Steps about as long as the waves' transit, in which mass and springs hold the motions alike: momentum stays."""
    strong = (1e3 * np.array(turned(d))).tolist()
    for end in (1e-6, 1e-5, 1e-4):
        simulation = completed(
            steel(
                d,
                3,
                end,
                heat=heated(d, strong, source=f"{1e-4 / end} * x * y", expansion={"tensor": 2e3}),
                loads={"body": along(d, -1.0)},
                contact={"part": "bottom", "stiffness": 1e6, "gap": 1.0, "friction": {"coefficient": 0.2}},
            )
        )
        pushed = 10.0**d * end
        assert momentum(simulation)[-1] == pytest.approx(-pushed, rel=1e-10)
        assert np.abs(momentum(simulation)[:-1]).max() <= 1e-10 * pushed
        assert simulation.stepper.cost.refinements == 0  # which would mend motions of the wrong operator


@check
def slides_without_friction(d: int) -> None:
    """Nothing resists a motion along the foundation: the speed stays, however long the steps and heavy the load."""
    for n in (3, 6) if d == 2 else (2, 3):
        for end in (1.0, 1e3, 1e5):
            for coupling in ("staggered", "monolithic"):
                one = steel(
                    d,
                    n,
                    end,
                    heat=heated(d, -EXPANSION),
                    loads={"traction": {"top": along(d, -1.0)}},
                    initial={"velocity": along(d, 0.0, 1e-5 / end)},
                    contact={"part": "bottom", "stiffness": 1e6, "friction": {"coefficient": 0.0}},
                )
                simulation = completed(one.override(**{"time.coupling": coupling}))
                assert momentum(simulation)[0] == pytest.approx(MASS[d] * 1e-5 / end, rel=1e-5)


@check
def flight_makes_no_heat(d: int) -> None:
    """Rigid motions strain nothing: what rounding of them heats is no temperature, in whatever steps and materials."""
    flights = along(d, -1.0), ["-y", "x", 0.0][:d]
    for coupling in ("staggered", "lagged", "monolithic"):
        for end in (0.01, 1.0, 1e3):
            for capacity, conductivity in ((1.0, 1.0), (1e6, 50.0), (1e-3, 1e3)):
                for velocity in flights:
                    one = scene(
                        d,
                        3 if d == 2 else 2,
                        time={"end": end, "steps": 5, "coupling": coupling},
                        inertia={"density": 1.0},
                        elasticity=elasticity(d, 1e3, 0.3),
                        heat=heated(d, -1e3, capacity=capacity, conductivity=conductivity),
                        initial={"velocity": velocity},
                    )
                    simulation = completed(one, digits=4.0)
                    output = summary(simulation)
                    assert output["digits"]["u"] >= 8
                    message = any("the temperature keeps" in words for words in output["warnings"])
                    assert message == (output["digits"]["theta"] < 4)
                    theta = np.abs(field(simulation, "theta")).max()
                    # 1e-10 of what a strain rate of 1 would heat: below, the core takes a temperature for rounding
                    assert theta <= 1e-10 * 1e3 * end / capacity, (coupling, end, capacity, theta)


def dense(operator: Any) -> Any:
    """A matrix of PETSc from its products with unit vectors."""
    x, y = operator.createVecs()
    columns = []
    for column in range(operator.getSize()[1]):
        x.set(0.0)
        x[column] = 1.0
        x.assemble()
        operator.mult(x, y)
        columns.append(y.array.copy())
    return np.column_stack(columns)


@check
def a_body_glides_along_a_foundation(d: int) -> None:
    """Without a weight it presses on nothing: what rounding makes it press needs no digits."""
    for speed, stiffness in ((0.7, 10.0), (0.7, "rigid"), (1.0, 10.0)):
        one = scene(
            d,
            3,
            time={"end": 3.0, "steps": 3},
            inertia={"density": 1.0},
            elasticity=elasticity(d, 1.0, 0.2),
            initial={"velocity": along(d, 0.0, speed)},
            contact={"part": "bottom", "stiffness": stiffness, "friction": {"coefficient": 0.3}},
        )
        u = field(completed(one, digits=0.0), "u")
        assert np.abs(u - along(d, 0.0, 3 * speed)).max() <= 1e-13


@check
def a_body_falls_along_a_wall(d: int) -> None:
    """Nothing moves across the rough wall: what a penetration of rounding presses is no force."""
    nearly_incompressible = {"lame": [447682.68965037086, 17.09268943094196]}, 11, 3.2842745942576834
    other = {"lame": [14.530264185686034, 122.00407268713775]}, 18, 1.2116123276488389
    cases = [(6 if d == 2 else 2, nearly_incompressible), (3, other)]
    several = MPI.COMM_WORLD.size > 1  # where the rounding of the factors is larger, see the limitations
    for n, (lame, steps, end) in cases[: 1 if several else 2]:
        for stiffness in ("rigid", 62436.0):
            one = scene(
                d,
                n,
                time={"end": end, "steps": steps},
                inertia={"density": 0.54},
                elasticity=lame,
                viscosity={"lame": [1.0, 1.0]},
                initial={"velocity": along(d, -1.0)},
                loads={"body": along(d, -0.54 * 9.0)},
                contact={"part": "left", "stiffness": stiffness, "friction": {"coefficient": 2.7}},
            )
            u, k = field(completed(one, digits=0.0), "u"), end / steps
            fallen = end + 9.0 * k * k * steps * (steps + 1) / 2
            assert np.abs(u - along(d, -fallen)).max() <= 1e-13 * fallen


@check
def a_viscous_body_falls(d: int) -> None:
    """Without an elasticity: its strain rate is rounding of the fall."""
    for viscosity, end in ((1.0, 2.0), (1e3, 2e-6), (1e-6, 2.0)):
        one = scene(
            d,
            2,
            time={"end": end, "steps": 2},
            inertia={"density": 1.0},
            viscosity={"lame": [0.0, viscosity]},
            loads={"body": along(d, -1e-3, 1e-3)},
            contact={"part": "bottom", "stiffness": 1.0, "gap": 1.0, "friction": {"coefficient": 0.3}},
        )
        u = field(completed(one, digits=0.0), "u")
        assert np.abs(u - 3 * (end / 2) ** 2 * np.asarray(along(d, -1e-3, 1e-3))).max() <= 1e-14 * np.abs(u).max()


@pytest.mark.parametrize("backend", ["automatic", "petsc"])
@pytest.mark.parametrize("density", [1e-3, 1.0, 100.0])
def test_an_indefinite_coupling_is_refused_and_no_other(density: float, backend: str) -> None:
    """R = +M of a free body, to six digits of the size at which the coupled operator ceases to be positive definite."""
    k, unit = 0.1, 1e-3

    def coupled(size: float) -> Scene:
        return scene(
            2,
            1,
            time={"end": k, "steps": 1, "coupling": "monolithic"},
            inertia={"density": density},
            elasticity=elasticity(2, 1.0, 0.3),
            heat={
                "conductivity": 1.0,
                "capacity": 1.0,
                "expansion": {"tensor": size},
                "heating": {"tensor": size},
            },
        )

    operators = Simulation(coupled(unit)).discretisation.operators
    heat = dense(operators.mass) / k + dense(operators.conductivity)
    motion = dense(operators.inertia) / k + k * dense(operators.elasticity)
    expansion = dense(operators.expansion) / unit
    fed = np.linalg.solve(motion, expansion @ np.linalg.solve(heat, expansion.T))
    limit = 1 / np.sqrt(np.abs(np.linalg.eigvals(fed)).max())
    Simulation(coupled(limit * (1 - 1e-6)), backend=backend)
    with pytest.raises(ValueError, match="indefinite"):
        Simulation(coupled(limit * (1 + 1e-6)), backend=backend)


@pytest.mark.parametrize("backend", ["automatic", "petsc"])
@pytest.mark.parametrize("d", [2, 3])
def test_an_indefinite_coupling_of_a_held_body_is_refused(d: int, backend: str) -> None:
    """R = +M: definite while M^2 is small beside stiffness and capacity, and indefinite far beyond."""

    def coupled(size: float) -> Scene:
        return scene(
            d,
            2,
            time={"end": 0.1, "steps": 1, "coupling": "monolithic"},
            elasticity=elasticity(d, 1.0, 0.3),
            supports={"displacement": ["top"]},
            heat={
                "conductivity": 1e-3,
                "capacity": 1.0,
                "expansion": {"tensor": size},
                "heating": {"tensor": size},
            },
        )

    Simulation(coupled(0.1), backend=backend)
    with pytest.raises(ValueError, match="indefinite"):
        Simulation(coupled(10.0), backend=backend)


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
