"""Thermal expansion as it is measured: from a reference temperature, by a linear coefficient, with the heat that goes with it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.boxes import completed, field

import warmslip
from warmslip.model.discretisation import discretise
from warmslip.scene.errors import SceneError
from warmslip.scene.full import full_model
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene
from warmslip.simulation import summary

YOUNG, POISSON, ALPHA, ROOM = 200.0, 0.3, 1e-3, 293.0
COUPLINGS = ("staggered", "lagged", "monolithic")
BODIES = {
    "plane_stress": ("square", 1.0),
    "plane_strain": ("square", 1 + POISSON),
    "solid": ("cube", 1.0),
}


def heated(assumption: str = "plane_strain", theta: float = ROOM, reference: float = ROOM, **keys: Any) -> Scene:
    """A body that may expand freely, all of it at `theta` for ever; keywords with `__` for dots override keys."""
    shape, _ = BODIES[assumption]
    d = 3 if shape == "cube" else 2
    data = {
        "mesh": {"shape": shape, "n": 3},
        "time": {"end": 10.0, "steps": 4},
        "inertia": {"density": 1e-3},
        "elasticity": {"young": YOUNG, "poisson": POISSON, "assumption": assumption},
        "viscosity": {"young": YOUNG, "poisson": POISSON, "assumption": assumption},
        "heat": {
            "conductivity": 1.0,
            "capacity": 2.0,
            "expansion": {"alpha": ALPHA, "reference_temperature": reference},
        },
        "initial": {"temperature": theta},
        "supports": {"displacement": {"left": [0.0] * d}},
    }
    return build(data).override(**{key.replace("__", "."): value for key, value in keys.items()})


@pytest.mark.parametrize("quadrature", ["gauss-2", "gauss-3"])
@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_contact_feels_differences_alone(coupling: str, quadrature: str) -> None:
    """With cohesion and Gauss points, in kelvin and from the reference: the rounding of two equal thermal forces is no load."""
    found = []
    for zero in (0.0, ROOM):
        scene = build(
            {
                "mesh": {"n": 4},
                "time": {"end": 10.0, "steps": 5, "coupling": coupling},
                "elasticity": {"young": 1.0, "poisson": POISSON, "assumption": "plane_strain"},
                "supports": {"displacement": ["top"]},
                "heat": {
                    "conductivity": 13.5,
                    "capacity": 1.0,
                    "expansion": {"alpha": 1e-5, "reference_temperature": zero},
                },
                "initial": {"temperature": zero},
                "contact": {
                    "part": "bottom",
                    "stiffness": 1e3,
                    "quadrature": quadrature,
                    "friction": {"coefficient": 0.3, "cohesion": 1e-2},
                    "heat_exchange": {"conductance": 10.0, "foundation_temperature": zero + 20.0},
                },
            }
        )
        done = warmslip.run(scene)
        assert done.completed, done.summary["failure"]
        found.append(done.u)
    assert np.abs(found[1] - found[0]).max() <= 1e-9 * np.abs(found[0]).max() > 0


@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("assumption", BODIES)
def test_nothing_moves_at_the_reference_temperature(assumption: str, coupling: str) -> None:
    scene = heated(assumption, time__coupling=coupling)
    done = warmslip.run(scene)
    assert done.completed, done.summary["failure"]
    assert np.abs(done.theta - ROOM).max() <= 1e-11 * ROOM
    scale = ALPHA * ROOM  # displacement without a reference
    assert np.abs(done.u).max() <= 1e-11 * scale
    assert np.abs(discretise(scene).stress(done.u, done.w, done.theta)).max() <= 1e-11 * YOUNG * scale
    assert np.abs(warmslip.run(heated(assumption, reference=0.0)).u).max() > 0.1 * scale


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_only_the_difference_counts(coupling: str) -> None:
    """Warmed by 10 from 293, and from 0, with a region that has its own elasticity and its own reference."""
    ends = []
    for origin in (0.0, ROOM):
        stiff = {"where": "x > 0.5", "elasticity": {"lame": [300.0, 100.0], "assumption": "plane_strain"}}
        own = {"conductivity": 3.0, "expansion": {"alpha": 2 * ALPHA, "reference_temperature": origin + 4}}
        scene = heated(theta=origin + 10, reference=origin, time__coupling=coupling)
        scene = scene.override(regions={"stiff": stiff | {"heat": own}, "cold": {"where": "y > 0.5"}})
        done, d = warmslip.run(scene), discretise(scene)
        assert done.completed
        assert [m.reference for m in d.problem.materials] == [origin, origin + 4, origin]
        ends.append((done.u, d.mises_of(done.u, done.w, done.theta)))
    (u, stress), (u_room, stress_room) = ends
    assert np.abs(u).max() > 5 * ALPHA
    assert np.abs(u - u_room).max() <= 1e-10 * np.abs(u).max()
    assert np.abs(stress - stress_room).max() <= 1e-10 * stress.max()


@pytest.mark.parametrize("assumption", BODIES)
def test_a_free_body_expands_by_alpha(assumption: str) -> None:
    """Held so that nothing hinders it: u = factor alpha warming x, and a stress along z in plane strain alone."""
    _, factor = BODIES[assumption]
    stretch = factor * ALPHA * 10
    axes = "xyz"[: 3 if assumption == "solid" else 2]
    scene = heated(
        assumption,
        theta=ROOM + 10,
        supports__displacement={"left": [f"{stretch} * {axis}" for axis in axes]},
        inertia=None,
        viscosity=None,
    )
    done = warmslip.run(scene)
    d = discretise(scene)
    assert done.completed
    assert np.abs(done.u - stretch * np.asarray(d.mesh.nodes)).max() <= 1e-12
    assert np.abs(d.stress(done.u, done.w, done.theta)).max() <= 1e-10
    along = -YOUNG * ALPHA * 10 if assumption == "plane_strain" else 0.0
    assert d.stress_zz(done.u, done.w, done.theta) == pytest.approx(along, abs=1e-10)
    assert d.mises_of(done.u, done.w, done.theta) == pytest.approx(abs(along), abs=1e-10)


@pytest.mark.parametrize("load", [1e-7, 1e-9, 1e-11])
@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize("assumption", ["plane_stress", "solid"])
def test_a_small_stress_beside_free_expansion_has_the_digits_that_are_stated(
    assumption: str, coupling: str, load: float
) -> None:
    """Elastic and thermal stress of 1e-4 cancel but for that of the load, which is the same everywhere."""
    d = 3 if assumption == "solid" else 2
    held = {"left": [0.0, *["free"] * (d - 1)], "bottom": [*["free"] * (d - 1), 0.0]}
    if d == 3:
        held["front"] = ["free", 0.0, "free"]
    scene = build(
        {
            "mesh": {"shape": "cube" if d == 3 else "square", "n": 2},
            "time": {"end": 12.0, "steps": 2, "coupling": coupling},
            "elasticity": {"young": 1.0, "poisson": POISSON, "assumption": assumption},
            "heat": {
                "conductivity": 14.0,
                "capacity": 1.0,
                "source": 1.0 if coupling == "monolithic" else 0.0,  # the others expand by the temperature before
                "expansion": {"alpha": 1e-5, "reference_temperature": 20.0},
            },
            "initial": {"temperature": 20.0 if coupling == "monolithic" else 32.0},
            "supports": {"displacement": held},
            "loads": {"traction": {"top": [*[0.0] * (d - 1), load]}},
        }
    )
    simulation = completed(scene, digits=0.0)
    exact = np.zeros((d, d))
    exact[-1, -1] = load
    stress = simulation.discretisation.stress(*(field(simulation, name) for name in ("u", "w", "theta")))
    stated = summary.digits(simulation.statistics.trusted(simulation.stepper.extents))["stress"]
    error = np.abs(stress - exact).max() / load
    assert error <= 10 * 10**-stated, (error, stated)
    assert stated >= -np.log10(1e-4 / load * 1e-15) - 4, (error, stated)  # no fewer than it has by far


def test_alpha_takes_the_elasticity_of_the_region() -> None:
    soft = {"where": "x > 0.5", "elasticity": {"lame": [30.0, 10.0], "assumption": "plane_strain"}}
    scene = heated(regions={"soft": soft})
    found = [np.asarray(m.expansion) for m in discretise(scene).problem.materials]
    assert found[0] == pytest.approx(YOUNG / (1 - 2 * POISSON) * ALPHA * np.eye(2))
    assert found[1] == pytest.approx(110.0 * ALPHA * np.eye(2))


@pytest.mark.parametrize("given", ["thermodynamic", "tensor"])
def test_a_stretched_body_cools(given: str) -> None:
    """Adiabatic, all of it stretched by 0.01: capacity times cooling = T0 M strain, which is 0.0243 K at 293 K."""
    expansion, strain = 0.01, 0.01
    capacity = ROOM * expansion * strain / 0.0243
    assert capacity == pytest.approx(1.2058, rel=1e-4)
    scene = heated(
        heat__capacity=capacity,
        heat__expansion={"tensor": expansion, "reference_temperature": ROOM},
        heat__heating={"thermodynamic": True} if given == "thermodynamic" else {"tensor": -ROOM * expansion},
        supports__displacement={part: [f"{strain} * x * t / 10", 0.0] for part in ("left", "right", "bottom", "top")},
    )
    done = warmslip.run(scene)
    assert done.completed
    assert done.theta == pytest.approx(ROOM - 0.0243, rel=1e-12)


def test_a_region_has_the_capacity_of_the_body() -> None:
    regions = {
        "inherits": {"where": "x < 0.3", "heat": {"conductivity": 5.0}},
        "own": {"where": "x > 0.7", "heat": {"conductivity": 5.0, "capacity": 7.0}},
        "says nothing": {"where": "y > 0.7", "elasticity": {"lame": [1.0, 1.0], "assumption": "plane_strain"}},
    }
    materials = discretise(heated(regions=regions)).problem.materials
    assert [m.capacity for m in materials] == [2.0, 2.0, 7.0, 2.0]


REFUSED = [
    ({"heat.expansion.tensor": 1.0}, "heat.expansion: give either tensor, which is M, or the linear expansion alpha"),
    ({"heat.expansion.alpha": None}, "heat.expansion: give either tensor"),
    ({"elasticity": {"lame": [1.0, 1.0]}}, "heat.expansion.alpha: lame says nothing about z; add assumption"),
    ({"elasticity": None}, "heat.expansion.alpha: the stress of an expansion needs an elasticity; give a table"),
    (
        {"elasticity": {"tensor": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}},
        "heat.expansion.alpha: it is for an isotropic elasticity; give tensor in its place",
    ),
    (
        {"regions": {"part": {"where": "x < 0.5", "elasticity": {"lame": [1.0, 1.0]}}}},
        "heat.expansion.alpha: lame says nothing about z",
    ),
    ({"heat.heating": {}}, "heat.heating: give either tensor, which is R, or thermodynamic = true"),
    ({"heat.heating": {"tensor": 1.0, "thermodynamic": True}}, "heat.heating: give either tensor"),
    (
        {"heat.heating": {"thermodynamic": True}, "heat.expansion.reference_temperature": 0.0},
        "heat.heating.thermodynamic: R = -T0 M needs the absolute temperature T0; give heat.expansion.reference_temperature",
    ),
    (
        {"heat.heating": {"thermodynamic": True}, "heat.expansion": None},
        "heat.heating.thermodynamic: R = -T0 M needs an M; give a table [heat.expansion]",
    ),
]


@pytest.mark.parametrize(("keys", "words"), REFUSED, ids=[words for _, words in REFUSED])
def test_refuses(keys: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError) as refusal:
        heated().override(**keys)
    assert str(refusal.value).startswith(words), str(refusal.value)


def test_the_whole_model_has_no_reference() -> None:
    """What judges the paper's model refuses one, and takes alpha as the tensor that it means."""
    scene = warmslip.load("paper_mixed")
    with pytest.raises(SceneError, match=r"heat\.expansion\.reference_temperature: only 0 can be judged here"):
        full_model(scene.override(**{"heat.expansion.reference_temperature": ROOM}))
    whole = full_model(scene.override(**{"heat.expansion": {"alpha": 0.5}}))
    assert whole.heat.expansion.tensor == [[pytest.approx(2 * 0.5 / 0.9), 0.0], [0.0, pytest.approx(2 * 0.5 / 0.9)]]
