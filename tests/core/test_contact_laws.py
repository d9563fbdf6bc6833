"""Laws of contact do what their formula says: a column pressed by a load, at rest or sliding or with its heat."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.bodies import column, completed

import warmslip
from warmslip.scene.contact_tables import FrictionTable
from warmslip.scene.reader import build, load
from warmslip.scene.scene import Scene
from warmslip.simulation.simulation import Simulation


@pytest.mark.parametrize(
    ("law", "penetration"),
    [
        ({"stiffness": 80.0}, 2.0 / 80),
        ({"stiffness": 80.0, "exponent": 2.0}, (2.0 / 80) ** 0.5),
        ({"stiffness": 80.0, "exponent": 1.5}, (2.0 / 80) ** (1 / 1.5)),
        ({"stiffness": 80.0, "pressure_limit": 2.5}, 2.0 / 80),
    ],
    ids=["linear", "quadratic", "power 3/2", "bounded"],
)
@pytest.mark.parametrize("quadrature", ["nodal", "gauss-3"])
def test_pressure_of_a_pressed_column(law: dict[str, float], penetration: float, quadrature: str) -> None:
    """Inertia holds the free body; after long steps it rests where the law bears its load."""
    scene = column(
        inertia={"density": 1.0},
        viscosity={"lame": [0.0, 5.0]},
        time={"end": 200.0, "steps": 100},
        loads={"traction": {"top": [0.0, -2.0]}},
        contact={"part": "bottom", "quadrature": quadrature, **law},
    )
    result = completed(scene)
    assert result.summary["contact"]["normal_force"] == pytest.approx(2.0, rel=1e-9)
    assert result.summary["contact"]["max_penetration"] == pytest.approx(penetration, rel=1e-9)


def test_a_pressure_limit_lets_the_body_through() -> None:
    """More load than the foundation bears: what is left accelerates the body."""
    k, steps, density, height = 0.01, 10, 2.0, 2.0
    scene = column(
        time={"end": k * steps, "steps": steps},
        elasticity={"lame": [0.0, 5e5]},
        inertia={"density": density},
        loads={"body": [0.0, -1.0 * density]},
        contact={"part": "bottom", "stiffness": 1e4, "pressure_limit": 1.0, "gap": -0.5},
    )
    result = completed(scene)
    fall = (1.0 * density * height - 1.0) / (density * height)
    assert result.w[:, 1].mean() == pytest.approx(-fall * k * steps, rel=1e-3)


def sliding(friction: dict[str, float], *, push: float, steps: int = 20, **more: Any) -> Any:
    """A stiff block of mass 2 under the pressure 1, pushed by `push`; its mean speed after every step."""
    scene = column(
        elasticity={"lame": [0.0, 5e3]},
        viscosity={"lame": [0.0, 5e2]},
        inertia={"density": 1.0},
        time={"end": 1.0, "steps": steps},
        loads={"body": [push / 2, 0.0], "traction": {"top": [0.0, -1.0]}},
        initial={"displacement": [0.0, -1e-4]},
        contact={"part": "bottom", "stiffness": 1e4, "friction": friction},
        **more,
    )
    return completed(scene)


def test_tresca_does_not_ask_for_pressure() -> None:
    """The block is low, so that it slides before it tilts."""
    for gap in (0.0, 1.0):
        scene = column(
            0.5,
            time={"end": 0.25, "steps": 4},
            elasticity={"lame": [0.0, 5e3]},
            viscosity={"lame": [0.0, 5e2]},
            inertia={"density": 1.0},
            loads={"body": [2.0, 0.0]},
            contact={"part": "bottom", "stiffness": 1e4, "gap": gap, "friction": {"cohesion": 0.4}},
        )
        assert completed(scene).w[:, 0].mean() == pytest.approx(0.25 * (1.0 - 0.4) / 0.5, rel=1e-3)
        held = scene.override(**{"contact.friction.cohesion": 1.1})
        below = np.isclose(np.asarray(warmslip.discretise(held).mesh.nodes)[:, 1], 0)
        assert np.abs(completed(held).w[below, 0]).max() <= 1e-15  # it tilts, and does not slide


@pytest.mark.parametrize(
    ("friction", "traction"),
    [
        ({"coefficient": 0.3}, 0.3),
        ({"coefficient": 0.3, "cohesion": 0.1}, 0.4),
        ({"coefficient": 0.3, "cohesion": 0.1, "limit": 0.08}, 0.08),
        ({"coefficient": 0.6, "kinetic": 0.2, "speed": 1e-4}, 0.2),
        ({"coefficient": 0.3, "regularisation": 1e-5}, 0.3),
    ],
    ids=["Coulomb", "cohesion", "cut off", "falling with speed", "regularised"],
)
def test_friction_of_a_sliding_block(friction: dict[str, float], traction: float) -> None:
    result = sliding(friction, push=1.0)
    assert result.summary["contact"]["tangential_force"] == pytest.approx(traction, rel=2e-3)
    assert result.w[:, 0].mean() == pytest.approx((1.0 - traction) / 2, rel=2e-2)


def test_regularised_friction_creeps_as_predicted() -> None:
    table = FrictionTable(coefficient=0.3, regularisation=1e-3)
    result = sliding({"coefficient": 0.3, "regularisation": 1e-3}, push=0.15, steps=200)
    assert result.w[:, 0].mean() == pytest.approx(table.creep(0.5), rel=3e-2)  # the pressure is not quite even
    assert np.abs(sliding({"coefficient": 0.3}, push=0.15).w[:, 0]).max() <= 1e-5  # the law itself does not creep


def test_frictional_heat_goes_into_the_body() -> None:
    """An adiabatic block keeps its share of what friction takes: the mean of theta is that energy over area and capacity."""
    result = sliding(
        {"coefficient": 0.3},
        push=1.0,
        heat={"conductivity": 1.0, "capacity": 3.0},
    )
    assert np.abs(result.theta).max() == 0
    scene = column(
        elasticity={"lame": [0.0, 5e3]},
        viscosity={"lame": [0.0, 5e2]},
        inertia={"density": 1.0},
        time={"end": 1.0, "steps": 20},
        loads={"body": [0.5, 0.0], "traction": {"top": [0.0, -1.0]}},
        heat={"conductivity": 1.0, "capacity": 3.0},
        contact={
            "part": "bottom",
            "stiffness": 1e4,
            "friction": {"coefficient": 0.3},
            "friction_heating": {"share": 0.5},
        },
    )
    run = warmslip.Simulation(scene)
    lost = sum(report.balances.friction for _, report in run.steps())
    d = run.discretisation
    theta = run.stepper.theta
    content = d.operators.mass.createVecLeft()
    d.operators.mass.mult(theta, content)
    assert run.outcome == "completed"
    assert lost > 0.05
    assert content.sum() == pytest.approx(0.5 * lost, rel=1e-10)


def test_conductance_by_pressure_is_a_robin_side() -> None:
    """Pressed by 1, a law of 3 a unit of pressure is a constant conductance of 3; the top is held at 0, the foundation is hot."""
    common: dict[str, Any] = {
        "elasticity": {"lame": [0.0, 500.0]},
        "inertia": {"density": 1.0},
        "viscosity": {"lame": [0.0, 50.0]},
        "loads": {"traction": {"top": [0.0, -1.0]}},
        "heat": {"conductivity": 2.0},
        "supports": {"temperature": ["top"]},
        "time": {"end": 40.0, "steps": 40},
    }
    ends = [
        completed(column(**common, contact={"part": "bottom", "stiffness": 1e4, "heat_exchange": exchange})).theta
        for exchange in (
            {"conductance": 0.0, "per_pressure": 3.0, "foundation_temperature": 5.0},
            {"conductance": 3.0, "foundation_temperature": 5.0},
        )
    ]
    flux = 5.0 / (1 / 3 + 2.0 / 2.0)  # conductances in series: the contact's and K over the height
    for theta in ends:
        assert theta.max() == pytest.approx(5.0 - flux / 3, rel=1e-6)
    assert np.abs(ends[0] - ends[1]).max() <= 1e-6


def on_a_hole(d: int, friction: dict[str, float], **more: Any) -> Scene:
    """A body that rubs on the wall of its hole, which no axis is normal to; it leaves the wall and comes back."""
    body = load("plate_with_hole" if d == 2 else "block_with_hole").mesh.file
    data: dict[str, Any] = {
        "mesh": {"file": body},
        "time": {"end": 4.0, "steps": 4},
        "elasticity": {"young": 20.0, "poisson": 0.3, "assumption": "plane_stress" if d == 2 else "solid"},
        "supports": {"displacement": {"top": ["0.01 * sin(1.5 * t)", *["0.0"] * (d - 1)]}},
        "contact": {"part": "hole", "stiffness": 100.0, "friction": friction},
    }
    return build(data).override(**more)


@pytest.mark.parametrize("stiffness", [100.0, "rigid"])
@pytest.mark.parametrize("mu", [1e-4, 1e-6, 1e-9, 1e-14])
@pytest.mark.parametrize("d", [2, 3])
def test_hardly_any_friction_on_an_oblique_part(d: int, mu: float, stiffness: float | str) -> None:
    """A friction bound far below the normal force is known to the rounding of that force."""
    scene = on_a_hole(d, {"coefficient": mu}, **{"contact.stiffness": stiffness})
    found = completed(scene)
    simulation = Simulation(scene)
    for state, _ in simulation.steps():
        slips, normals = state.contact["status"] == 2, np.asarray(simulation.discretisation.surface.normals)
        force = np.reshape(simulation.stepper.contact_force, (-1, d))
        pressing = np.sum(force * normals, axis=1)
        rubbing = np.linalg.norm(force - pressing[:, None] * normals, axis=1)
        assert slips.any()
        assert np.abs(rubbing - mu * pressing)[slips].max() <= 1e-14 * np.abs(force).max()
    smooth = completed(on_a_hole(d, {"coefficient": 0.0}, **{"contact.stiffness": stiffness}))
    scale = np.abs(smooth.u).max()
    assert np.abs(found.u - smooth.u).max() <= (10 * mu + 1e-12) * scale


@pytest.mark.parametrize("stiffness", [100.0, "rigid"])
@pytest.mark.parametrize("friction", [{"cohesion": 0.01}, {"cohesion": 0.01, "coefficient": 0.3}, {"cohesion": 1e-6}])
@pytest.mark.parametrize("d", [2, 3])
def test_cohesion_on_an_oblique_part_that_opens(d: int, friction: dict[str, float], stiffness: float | str) -> None:
    """Open points that cohesion holds have a normal force of rounding, which stores no energy."""
    completed(on_a_hole(d, friction, **{"contact.stiffness": stiffness}))
