"""Blocks of a scene: what is absent changes nothing but the cost, and what is there does what its formula says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Scene, _core
from warmslip.scene import build

SMALL = {"mesh.n": 6, "time.steps": 5}
IDENTITY = [[1.0, 0.0], [0.0, 1.0]]


def paper(coupling: str = "staggered", **without: Any) -> Scene:
    values = {"contact.heat_exchange.foundation_temperature": 10.0, "time.coupling": coupling}
    return warmslip.load("paper_isotropic").override(**SMALL | values | without)


def column(height: float = 2.0, **tables: Any) -> Scene:
    """A quasistatic elastic column of width 1 without lateral contraction, free to move; `tables` replace or add."""
    data: dict[str, Any] = {
        "mesh": {"shape": "square", "n": [2, 8], "lengths": [1.0, height]},
        "time": {"end": 1.0, "steps": 4},
        "elasticity": {"lame": [0.0, 50.0]},
    }
    return build({key: value for key, value in (data | tables).items() if value is not None})


def right(scene: Scene) -> Any:
    """The end of a run whose balances close."""
    result = warmslip.run(scene)
    assert result.outcome == "right", result.summary["failure"]
    assert max(result.summary["identities"][name] for name in ("energy", "heat", "force", "law")) <= 1e-11
    return result


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
    pruned, full = right(scene), right(scene.full())
    for name in ("u", "w", "theta"):
        one, other = getattr(pruned, name), getattr(full, name)
        if one is None:
            assert np.abs(other).max() <= 1e-12
        else:
            assert np.abs(one - other).max() <= 1e-12 * np.abs(other).max()


@pytest.mark.parametrize("dim", [2, 3])
def test_without_contact_a_body_is_one_that_never_touches(dim: int) -> None:
    scene = paper() if dim == 2 else warmslip.load("block_3d", ["mesh.n=3", "time.steps=4"])
    scene = scene.override(**{"contact.heat_exchange": None})
    apart, free = right(scene.override(**{"contact.gap": 9.0})), right(scene.override(contact=None))
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
    result = right(still)
    assert result.u is None
    assert np.abs(result.theta - right(moving).theta).max() <= 1e-13


def test_less_physics_is_less_work() -> None:
    """Counted, not timed: fields, factors, substitutions a step."""
    steps = SMALL["time.steps"]
    full = right(paper()).summary["cost"]
    assert (full["factorizations"], full["substitutions"]) == (2, 2 * steps)
    cold = right(paper(**ABSENT["heat"])).summary["cost"]
    assert (cold["factorizations"], cold["substitutions"]) == (1, steps)
    linear = right(paper(**ABSENT["heat"]).override(contact=None)).summary["cost"]
    assert (linear["substitutions"], linear["newton_iterations"], linear["dense_factorizations"]) == (steps, 0, 0)


# ---- laws of contact: a column pressed by `load`, at rest or with its heat ------------------------------------------------


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
    result = right(scene)
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
    result = right(scene)
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
    return right(scene)


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
        assert right(scene).w[:, 0].mean() == pytest.approx(0.25 * (1.0 - 0.4) / 0.5, rel=1e-3)
        held = scene.override(**{"contact.friction.cohesion": 1.1})
        below = np.isclose(np.asarray(warmslip.discretise(held).mesh.nodes)[:, 1], 0)
        assert np.abs(right(held).w[below, 0]).max() <= 1e-15  # it tilts, and does not slide


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
    table = warmslip.tables.FrictionTable(coefficient=0.3, regularisation=1e-3)
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
    run = warmslip.Run(scene)
    lost = sum(report.ledger.friction for _, report in run.steps())
    d = run.discretisation
    theta = run.stepper.theta
    content = d.operators.mass.createVecLeft()
    d.operators.mass.mult(theta, content)
    assert run.outcome == "right"
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
        right(column(**common, contact={"part": "bottom", "stiffness": 1e4, "heat_exchange": exchange})).theta
        for exchange in (
            {"conductance": 0.0, "per_pressure": 3.0, "foundation_temperature": 5.0},
            {"conductance": 3.0, "foundation_temperature": 5.0},
        )
    ]
    flux = 5.0 / (1 / 3 + 2.0 / 2.0)  # conductances in series: the contact's and K over the height
    for theta in ends:
        assert theta.max() == pytest.approx(5.0 - flux / 3, rel=1e-6)
    assert np.abs(ends[0] - ends[1]).max() <= 1e-6


# ---- given displacement and temperature, regions, tensors, formulas --------------------------------------------------------


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
    """The books close with all blocks present, contact nodes with held temperature among them, whoever solves."""
    scene = everything(dim, coupling)
    own = right(scene)
    assert own.summary["cost"]["refinements"] == 0  # which would heal a wrong right-hand side
    other = warmslip.run(scene, backend="petsc")
    assert other.outcome == "right"
    for name in ("u", "w", "theta"):
        assert np.abs(getattr(own, name) - getattr(other, name)).max() <= 1e-9 * np.abs(getattr(own, name)).max()
    run = warmslip.Run(scene)
    ledgers = []
    parts, x = run.discretisation.mesh.parts, np.asarray(run.discretisation.mesh.nodes)
    top, left = (np.unique(parts[part]) for part in ("top", "left"))
    for _, report in run.steps():  # what is given is what is there, at the corners of Gamma_C too
        ledgers.append(report.ledger)
        t = run.stepper.time
        u, theta = run.discretisation.field(run.stepper.u), run.discretisation.field(run.stepper.theta)
        assert np.abs(u[top] - [0.1 * t, *[0.0] * (dim - 2), -0.02 * np.sin(t)]).max() <= 1e-15
        only_top = top[(x[top, 0] > 0) & (x[top, 1] > 0)] if dim == 3 else top[x[top, 0] > 0]
        assert np.abs(theta[only_top] - t).max() <= 1e-15
        only_left = np.setdiff1d(left, top if dim == 2 else np.union1d(top, np.unique(parts["front"])))
        assert np.abs(theta[only_left] - 2).max() <= 1e-15
    assert min(abs(ledger.support_work) for ledger in ledgers) > 0
    assert min(abs(ledger.held) for ledger in ledgers) > 0
    assert (max(ledger.friction_heating for ledger in ledgers) > 0) == (coupling != "monolithic")


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
        (lambda: stepper.resume(np.zeros(1), [0]), "one entry a contact point"),
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


@pytest.mark.parametrize("block", ["inertia", "elasticity", "viscosity", "heat", "contact", "motion"])
def test_a_cube_without_a_block(block: str) -> None:
    scene = warmslip.load("block_3d").override(**{"mesh.n": 3, "time.steps": 3})
    motion = ("inertia", "elasticity", "viscosity", "loads", "supports.displacement", "heat.expansion", "heat.heating")
    gone: dict[str, tuple[str, ...]] = {
        "heat": ("heat", "supports.temperature", "contact.heat_exchange"),
        "motion": (*motion, "contact.stiffness", "contact.friction"),
    }
    result = right(scene.override(**dict.fromkeys(gone.get(block, (block,)))))
    assert (result.u is None, result.theta is None) == (block == "motion", block == "heat")


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
    run = warmslip.Run(scene)
    for _, report in run.steps():
        assert report.ledger.support_work != 0
    assert run.outcome == "right"
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
        result = right(scene)
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
    result = right(scene)
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
    assert np.abs(right(lame).u - right(full).u).max() <= 1e-14


def test_formulas_are_the_constants_they_equal() -> None:
    plain = right(paper())
    written = right(
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
    result = right(scene)
    # 300 a = 1 + 100 (0.01 - a), the body being stiff
    assert -result.u[:, 0].mean() == pytest.approx((1 + 100 * 0.01) / 400, rel=1e-3)
