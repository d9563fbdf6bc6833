"""Given displacement and temperature, regions, tensors, formulas and several contact parts do what they say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bodies import column, completed, paper

import warmslip
from warmslip import Scene, _core
from warmslip.scene.reader import build


def everything(dim: int, coupling: str) -> Scene:
    """Moving and warm supports, two contact parts, two materials, heat by pressure and friction (not monolithic) at once."""
    scene = warmslip.load("paper_isotropic" if dim == 2 else "block_3d")
    wall = [0.0] * (dim - 1)
    side = {} if dim == 2 else {"front": 0.0}
    heats = coupling != "monolithic"
    exchange = {"conductance": 1.0, "foundation_temperature": "5 + 3 * x"} | ({"per_pressure": 2.0} if heats else {})
    below: dict[str, Any] = {
        "part": "bottom",
        "stiffness": 1e3,
        "friction": {"coefficient": 0.3, "kinetic": 0.2, "speed": 0.5},
        "heat_exchange": exchange,
    }
    if heats:
        below["friction_heating"] = {"share": 0.4}
    return scene.override(
        **{
            "mesh.n": 6 if dim == 2 else 3,
            "time.steps": 5,
            "time.coupling": coupling,
            "heat.source": "x * t",
            "loads.traction": {"left": ["1 + t", *wall]},
            "supports.displacement": {"top": ["0.1 * t", *wall[1:], "-0.02 * sin(t)"]},
            "supports.temperature": {"top": "t", "left": 2.0} | side,
            "initial.velocity": [0.1, *wall[1:], -0.02],
            "contact": [below, {"part": "right", "stiffness": 50.0, "exponent": 1.5, "gap": "0.01 + 0 * x"}],
            "regions": {
                "core": {
                    "where": "x > 0.5",
                    "inertia": {"density": 2.0},
                    "elasticity": {"lame": [3.0, 2.0]},
                    "heat": {"conductivity": 3.0, "capacity": 2.0},
                }
            },
        }
    )


@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
@pytest.mark.parametrize("dim", [2, 3])
def test_everything_at_once_by_two_linear_algebras(dim: int, coupling: str) -> None:
    """The balances close with all blocks present, contact nodes with held temperature among them, whoever solves."""
    scene = everything(dim, coupling)
    own = completed(scene)
    assert own.summary["cost"]["refinements"] == 0  # which would heal a wrong right-hand side
    other = warmslip.run(scene, backend="petsc")
    assert other.outcome == "completed"
    for name in ("u", "w", "theta"):
        assert np.abs(getattr(own, name) - getattr(other, name)).max() <= 1e-9 * np.abs(getattr(own, name)).max()
    run = warmslip.Simulation(scene)
    every_balance = []
    parts, x = run.discretisation.mesh.parts, np.asarray(run.discretisation.mesh.nodes)
    top, left = (np.unique(parts[part]) for part in ("top", "left"))
    for _, report in run.steps():  # what is given is what is there, at the corners of Gamma_C too
        every_balance.append(report.balances)
        t = run.stepper.time
        u, theta = run.discretisation.field(run.stepper.u), run.discretisation.field(run.stepper.theta)
        assert np.abs(u[top] - [0.1 * t, *[0.0] * (dim - 2), -0.02 * np.sin(t)]).max() <= 1e-15
        only_top = top[(x[top, 0] > 0) & (x[top, 1] > 0)] if dim == 3 else top[x[top, 0] > 0]
        assert np.abs(theta[only_top] - t).max() <= 1e-15
        only_left = np.setdiff1d(left, top if dim == 2 else np.union1d(top, np.unique(parts["front"])))
        assert np.abs(theta[only_left] - 2).max() <= 1e-15
    assert min(abs(balances.support_work) for balances in every_balance) > 0
    assert min(abs(balances.support_heat) for balances in every_balance) > 0
    assert (max(balances.friction_heating for balances in every_balance) > 0) == (coupling != "monolithic")


@pytest.mark.parametrize("dim", [2, 3])
def test_a_stepper_refuses_what_does_not_fit(dim: int) -> None:
    scene = everything(dim, "staggered")
    d = warmslip.discretise(scene)
    data, stepper = d.load_vectors.at(scene.step), d.stepper()
    u, theta, gap = d.layout.vector(dim), d.layout.vector(1), np.asarray(data.gap)
    for wrong, words in (
        (lambda: stepper.start(None, u, theta, gap, 0.0), "u is missing"),
        (lambda: stepper.start(u, u, None, gap, 0.0), "theta is missing"),
        (lambda: stepper.start(u, u, theta, gap[1:], 0.0), "one value a contact point"),
        (lambda: stepper.resume(np.zeros(1), [0], [0.0] * 18, 0), "one entry a contact point"),
        (lambda: stepper.advance(None, data.heat, gap), "a load vector is missing"),
        (lambda: stepper.advance(data.force, None, gap), "a load vector is missing"),
        (lambda: stepper.advance(data.force, data.heat, gap[1:]), "one value a contact point"),
        (lambda: stepper.advance(data.force, data.heat, gap), "the foundation's temperature"),
        (lambda: _core.stress(d.problem, np.zeros((1, dim)), np.zeros((1, dim)), np.zeros(1)), "one row for each"),
    ):
        with pytest.raises(ValueError, match=words):
            wrong()
    cold = scene.override(heat=None, contact=None, **{"supports.temperature": None, "regions.core.heat": None})
    with pytest.raises(ValueError, match="theta is no field of this problem"):
        warmslip.discretise(cold).stepper().start(u, u, theta, np.empty(0), 0.0)


@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
def test_a_body_carried_by_its_supports_is_affine(coupling: str) -> None:
    """All sides follow u = t (a + G x) and theta = b . x: the inside follows to round-off, with every operator present."""
    sides = ("left", "right", "bottom", "top")
    scene = column(
        mesh={"shape": "square", "n": 5, "diagonal": "left"},
        time={"end": 1.0, "steps": 4, "coupling": coupling},
        inertia={"density": 2.0},
        viscosity={"lame": [1.0, 3.0]},
        elasticity={"tensor": [[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 2.0]]},
        heat={"conductivity": [[2.0, 0.5], [0.5, 1.0]], "expansion": {"tensor": 0.0}, "heating": {"tensor": 0.0}},
        supports={
            "displacement": {side: ["t * (0.1 + 0.2 * x - 0.3 * y)", "t * (0.4 * x + 0.1 * y)"] for side in sides},
            "temperature": dict.fromkeys(sides, "1 + 2 * x - y"),
        },
        initial={"velocity": ["0.1 + 0.2 * x - 0.3 * y", "0.4 * x + 0.1 * y"], "temperature": "1 + 2 * x - y"},
    )
    run = warmslip.Simulation(scene)
    for _, report in run.steps():
        assert report.balances.support_work != 0
    assert run.outcome == "completed"
    d = run.discretisation
    x, y = np.asarray(d.mesh.nodes).T
    assert np.abs(d.field(run.stepper.u) - np.column_stack([0.1 + 0.2 * x - 0.3 * y, 0.4 * x + 0.1 * y])).max() <= 1e-13
    assert np.abs(d.field(run.stepper.theta) - (1 + 2 * x - y)).max() <= 1e-13


def test_couplings_agree_under_moving_warm_supports() -> None:
    """Monolithic and staggered steps differ by O(k), also in what the supports do."""

    def end(coupling: str, steps: int) -> Any:
        scene = paper(
            coupling,
            **{
                "time.steps": steps,
                "supports.displacement": {"top": ["0.05 * sin(t)", 0.0]},
                "supports.temperature": {"top": "2 * t", "left": 0.0, "right": "t * y"},
            },
        )
        result = completed(scene)
        return np.concatenate([result.u.ravel(), result.w.ravel(), result.theta])

    distances = [np.abs(end("monolithic", n) - end("staggered", n)).max() for n in (8, 16, 32)]
    assert distances[0] / distances[2] == pytest.approx(4, rel=0.3)


def test_two_materials_in_series() -> None:
    """A pulled bar whose upper half is three times as stiff and conducts five times as well."""
    scene = column(
        supports={"displacement": ["bottom"], "temperature": {"bottom": 0.0, "top": 6.0}},
        loads={"traction": {"top": [0.0, 1.0]}},
        elasticity={"lame": [0.0, 1.0]},
        heat={"conductivity": 1.0},
        regions={"upper": {"where": "y > 1", "elasticity": {"lame": [0.0, 3.0]}, "heat": {"conductivity": 5.0}}},
        time={"end": 100.0, "steps": 50},
    )
    result = completed(scene)
    top = np.isclose(np.asarray(warmslip.discretise(scene).mesh.nodes)[:, 1], 2.0)
    assert result.u[top, 1] == pytest.approx(1 / 2 + 1 / 6, rel=1e-12)
    assert result.theta.max() == pytest.approx(6.0)
    middle = np.isclose(np.asarray(warmslip.discretise(scene).mesh.nodes)[:, 1], 1.0)
    assert result.theta[middle] == pytest.approx(5.0, rel=1e-6)


def test_a_region_with_heat_can_be_read_again(tmp_path: Path) -> None:
    scene = paper(regions={"core": {"where": "x < 0.5", "heat": {"conductivity": 5.0}}})
    warmslip.run(scene, out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as t:
        assert build(t.scene) == build(scene.resolved()) == scene


def test_a_full_tensor_is_its_lame_pair() -> None:
    lame = paper(elasticity={"lame": [2.0, 3.0]})
    full = paper(elasticity={"tensor": [[8.0, 2.0, 0.0], [2.0, 8.0, 0.0], [0.0, 0.0, 3.0]]})
    assert np.abs(completed(lame).u - completed(full).u).max() <= 1e-14


def test_formulas_are_the_constants_they_equal() -> None:
    plain = completed(paper())
    written = completed(
        paper(
            **{
                "loads.body": ["0 * x", "-cos(0 * t)"],
                "loads.traction": {"left": ["1.4 + 0 * t", 0.4], "right": ["-0.8", "0.4"]},
                "contact.gap": "0 * x",
                "contact.heat_exchange.foundation_temperature": "where(t < 100, 10, 0)",
                "heat.source": "1 + 0 * x",
            }
        )
    )
    for name in ("u", "w", "theta"):
        assert np.abs(getattr(plain, name) - getattr(written, name)).max() <= 1e-12


def test_several_contact_parts_keep_their_laws() -> None:
    """A floating block between two walls: each pushes back by its own stiffness."""
    scene = column(
        mesh={"shape": "square", "n": 4},
        inertia={"density": 1.0},
        viscosity={"lame": [0.0, 20.0]},
        elasticity={"lame": [0.0, 5e4]},
        time={"end": 50.0, "steps": 50},
        loads={"body": [-1.0, 0.0]},
        contact=[
            {"part": "left", "stiffness": 300.0, "gap": 0.0},
            {"part": "right", "stiffness": 100.0, "gap": -0.01},
        ],
    )
    result = completed(scene)
    # 300 a = 1 + 100 (0.01 - a), the body being stiff
    assert -result.u[:, 0].mean() == pytest.approx((1 + 100 * 0.01) / 400, rel=1e-3)


@pytest.mark.parametrize("steps", [5, 7, 10, 30])
@pytest.mark.parametrize("inertia", [None, {"density": 1.0}])
@pytest.mark.parametrize(
    ("given", "after"), [("0.1 * (t <= 0.3)", 0.0), ("0.1 * (t > 0.3)", 0.1), ("0.1 * t * (t <= 0.6)", 0.0)]
)
def test_a_support_that_jumps_at_a_step_ends_where_it_is_given(
    given: str, after: float, inertia: dict[str, float] | None, steps: int
) -> None:
    """Steps begin at the very time at which the step before them ended: 0.3 is not 0.4 - 0.1."""
    held = {"bottom": [0.0, 0.0], "top": [0.0, given]}
    for keys in ({}, {"time.tolerance": 0.5}):
        result = completed(
            column(1.0, supports={"displacement": held}, inertia=inertia, time={"end": 1.0, "steps": steps}).override(
                **keys
            )
        )
        assert result.u[-1, 1] == pytest.approx(after, abs=1e-14)


def test_a_state_that_is_set_rests_where_supports_rest() -> None:
    """Velocities of held directions are those of the supports, whatever the state says; the others are kept."""
    held = {"bottom": [0.0, 0.0], "left": [0.0, "free"], "top": ["free", "0.1 * t"]}
    scene = column(1.0, supports={"displacement": held}, inertia={"density": 1.0})
    d = warmslip.discretise(scene)
    x = np.asarray(d.mesh.nodes)
    found = d.field(d.restart(d.stepper(), np.zeros_like(x), np.ones_like(x), None, 0.0).w)
    assert np.array_equal(found[x[:, 1] == 0], np.zeros((3, 2)))
    side = found[(x[:, 0] == 0) & (x[:, 1] > 0) & (x[:, 1] < 1)]
    assert np.array_equal(side, np.tile([0.0, 1.0], (len(side), 1)))
    assert np.array_equal(found[(x[:, 0] == 1) & (x[:, 1] == 0.5)], [[1.0, 1.0]])
