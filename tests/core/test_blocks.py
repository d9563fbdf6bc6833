"""Blocks of a scene: what is absent changes nothing but the cost."""

from __future__ import annotations

import numpy as np
import pytest
from support.bodies import SMALL, completed, paper

import warmslip
from warmslip.scene.full import full_model

ABSENT = {
    "inertia": {"inertia": None},
    "elasticity": {"elasticity": None},
    "viscosity": {"viscosity": None},
    "expansion": {"heat.expansion": None},
    "heating": {"heat.heating": None},
    "both couplings": {"heat.expansion": None, "heat.heating": None},
    "friction": {"contact.friction": None},
    "heat exchange": {"contact.heat_exchange": None},
    "body force": {"loads.body": None},
    "heat": {
        "heat": None,
        "supports.temperature": None,
        "contact.heat_exchange": None,
    },
}


@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
@pytest.mark.parametrize("block", ABSENT)
def test_an_absent_block_is_one_without_effect(block: str, coupling: str) -> None:
    if block == "heat" and coupling == "monolithic":
        pytest.skip("there is nothing to couple")
    scene = paper(coupling, **ABSENT[block])
    pruned, whole = completed(scene), completed(full_model(scene))
    for name in ("u", "w", "theta"):
        one, other = getattr(pruned, name), getattr(whole, name)
        if one is None:
            assert np.abs(other).max() <= 1e-12
        else:
            assert np.abs(one - other).max() <= 1e-12 * np.abs(other).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_without_contact_a_body_is_one_that_never_touches(dim: int) -> None:
    scene = paper() if dim == 2 else warmslip.load("block_3d", ["mesh.n=3", "time.steps=4"])
    scene = scene.override(**{"contact.heat_exchange": None})
    apart, free = completed(scene.override(**{"contact.gap": 9.0})), completed(scene.override(contact=None))
    for name in ("u", "w", "theta"):
        assert np.abs(getattr(free, name) - getattr(apart, name)).max() <= 1e-12 * np.abs(getattr(apart, name)).max()


def test_heat_alone_is_the_heat_of_a_body_whose_motion_makes_none() -> None:
    moving = paper(**{"heat.expansion": None, "heat.heating": None})
    gone = (
        "inertia",
        "elasticity",
        "viscosity",
        "loads",
        "supports.displacement",
        "contact.stiffness",
        "contact.friction",
    )
    still = moving.override(**dict.fromkeys(gone))
    result = completed(still)
    assert result.u is None
    assert np.abs(result.theta - completed(moving).theta).max() <= 1e-13


def test_less_physics_is_less_work() -> None:
    """Counted, not timed: fields, factors, substitutions a step."""
    steps = SMALL["time.steps"]
    full = completed(paper()).summary["cost"]
    assert (full["factorizations"], full["substitutions"]) == (2, 2 * steps)
    cold = completed(paper(**ABSENT["heat"])).summary["cost"]
    assert (cold["factorizations"], cold["substitutions"]) == (1, steps)
    linear = completed(paper(**ABSENT["heat"]).override(contact=None)).summary["cost"]
    assert (linear["substitutions"], linear["newton_iterations"], linear["dense_factorizations"]) == (steps, 0, 0)


@pytest.mark.parametrize("block", ["inertia", "elasticity", "viscosity", "heat", "contact", "motion"])
def test_a_cube_without_a_block(block: str) -> None:
    scene = warmslip.load("block_3d").override(**{"mesh.n": 3, "time.steps": 3})
    motion = ("inertia", "elasticity", "viscosity", "loads", "supports.displacement", "heat.expansion", "heat.heating")
    gone: dict[str, tuple[str, ...]] = {
        "heat": ("heat", "supports.temperature", "contact.heat_exchange"),
        "motion": (*motion, "contact.stiffness", "contact.friction"),
    }
    result = completed(scene.override(**dict.fromkeys(gone.get(block, (block,)))))
    assert (result.u is None, result.theta is None) == (block == "motion", block == "heat")


@pytest.mark.parametrize("gap", [1e-3, 1.0])
@pytest.mark.parametrize("viscous", [False, True])
def test_a_body_that_is_carried_without_strain_ends_right(gap: float, viscous: bool) -> None:
    """Its energies are all rounding until it touches; then they are not."""
    more = {"viscosity.lame": [0.1, 0.1]} if viscous else {}
    scene = warmslip.load("quasistatic_punch").override(**{"mesh.n": 8, "contact.gap": gap} | more)
    simulation = warmslip.Simulation(scene)
    touched = sum(report.normal_force > 0 for _, report in simulation.steps())
    assert simulation.outcome == "completed" and (touched > 0) == (gap < 0.01)
    assert max(simulation.statistics.residuals.values()) < 1e-9


@pytest.mark.parametrize("n", [8, 32])
@pytest.mark.parametrize("weight", [1e-6, 1e-4])
def test_a_carried_body_of_little_weight_ends_right(weight: float, n: int) -> None:
    """Carried sideways at last its weight does no work, and what its energy holds is little beside how far it came."""
    scene = warmslip.load("quasistatic_punch").override(
        **{"mesh.n": n, "contact.gap": 1.0, "loads.body": [0.0, -weight]}
    )
    simulation = warmslip.Simulation(scene)
    assert sum(1 for _ in simulation.steps()) == scene.time.steps and simulation.outcome == "completed"
    assert simulation.statistics.residuals["energy"] <= 1e-12 and simulation.statistics.errors["stress"] < 1e-5
