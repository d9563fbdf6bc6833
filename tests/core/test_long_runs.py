"""Long runs without drift, and hard ones whose answer is known, in the plane and in space."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from support.boxes import along, completed, elasticity, field, fields, misses, scene

from warmslip import Scene, _core
from warmslip.model.foresight import gradients
from warmslip.model.meshes import make_mesh
from warmslip.simulation.simulation import Simulation

pytestmark = pytest.mark.parametrize("d", [2, 3])
long = pytest.mark.parametrize("steps", [2000, pytest.param(100_000, marks=pytest.mark.slow)])
ROUND_OFF = 1e-12
UNIT = float(np.finfo(float).eps)


class Forces:
    """Normal and tangential resultants of every step, (steps,) and (steps, d)."""

    def __init__(self) -> None:
        self.normal: list[float] = []
        self.tangential: list[Any] = []

    def __call__(self, simulation: Simulation, report: Any) -> None:
        self.normal.append(report.normal_force)
        self.tangential.append(np.array(report.friction_traction))


# ---- without drift ---------------------------------------------------------------------------------------------------


@long
def test_a_pressed_body_stays_where_it_rests(d: int, steps: int) -> None:
    """A body held by contact and friction alone settles in a few steps: it neither creeps nor sinks, and bears its loads."""
    first: dict[str, Any] = {}
    forces, worst = Forces(), [0.0]

    def each(simulation: Simulation, report: Any) -> None:
        forces(simulation, report)
        if len(forces.normal) == 200:
            first.update(u=field(simulation, "u"))
        if len(forces.normal) > 200 and len(forces.normal) % 100 == 0:
            worst.append(misses({"u": field(simulation, "u")}, first)["u"])

    completed(
        scene(
            d,
            2,
            time={"end": 5.0 * steps, "steps": steps},
            inertia={"density": 1.0},
            elasticity={"lame": [0.0, 50.0]},
            viscosity={"lame": [0.0, 5.0]},
            loads={"traction": {"top": along(d, -1.0)}, "body": along(d, 0.0, 0.1)},
            contact={"part": "bottom", "stiffness": 1e3, "friction": {"coefficient": 0.3}},
        ),
        each=each,
    )
    assert max(worst) <= UNIT * steps  # u grows by k w in every step, and each sum is rounded
    assert forces.normal[200:] == pytest.approx([1.0] * (steps - 200), rel=ROUND_OFF)
    pull = np.linalg.norm(forces.tangential[200:], axis=1)
    assert pull == pytest.approx(np.full(steps - 200, 0.1), rel=1e2 * ROUND_OFF)


@long
def test_a_free_body_keeps_its_momentum(d: int, steps: int) -> None:
    """A stiff body in flight, in steps far longer than its waves, keeps speed and momentum and has no stress at its end."""
    velocity = np.array(along(d, -2.0, 3.0))
    lost = [0.0]

    def each(simulation: Simulation, report: Any) -> None:
        if round(simulation.stepper.time / simulation.scene.step) % 100 == 0:
            momentum = simulation.discretisation.field(
                simulation.discretisation.operators.inertia * simulation.stepper.w
            ).sum(axis=0)
            lost.append(float(np.abs(momentum - 5.0 * velocity).max()))

    simulation = completed(
        scene(
            d,
            2,
            time={"end": 0.1 * steps, "steps": steps},
            inertia={"density": 5.0},
            elasticity=elasticity(d, 2e11, 0.3),
            viscosity={"lame": [1.0, 1.0]},
            initial={"velocity": velocity.tolist()},
        ),
        each=each,
    )
    assert len(lost) > 10 and max(lost) <= 1e-11
    way = velocity * 0.1 * steps
    assert np.abs(field(simulation, "w") - velocity).max() <= ROUND_OFF
    assert np.abs(field(simulation, "u") - way).max() <= UNIT * steps * np.abs(way).max()
    assert simulation.discretisation.mises(simulation.stepper).max() <= 1e-9


@long
@pytest.mark.parametrize(
    ("exchange", "k"),
    [(True, 0.1), (False, 1e-3), (False, 1e3)],
    ids=["conducted", "insulated, short steps", "insulated, long steps"],
)
def test_a_body_at_ambient_stays_there(d: int, steps: int, exchange: bool, k: float) -> None:
    """Foundation and body have one temperature, or the body is insulated: no step warms it."""
    foundation = {"conductance": 20.0, "foundation_temperature": 293.15}
    contact = {"contact": {"part": "bottom", "heat_exchange": foundation}} if exchange else {}
    simulation = completed(
        scene(
            d,
            2,
            time={"end": k * steps, "steps": steps},
            heat={"conductivity": 50.0, "capacity": 3.6},
            initial={"temperature": 293.15},
            **contact,
        )
    )
    assert np.abs(field(simulation, "theta") - 293.15).max() <= ROUND_OFF * 293.15


# ---- impact and release ----------------------------------------------------------------------------------------------


def test_a_load_that_turns_every_step(d: int) -> None:
    """A hanging body is pressed on and lifted off in turn: each step is the statics of its load, without a trace of the last."""

    def hanging(load: Any, steps: int) -> Scene:
        return scene(
            d,
            4 if d == 2 else 2,
            time={"end": float(steps), "steps": steps},
            elasticity=elasticity(d, 100.0, 0.3),
            supports={"displacement": ["top"]},
            loads={"body": along(d, load)},
            contact={"part": "bottom", "stiffness": 1e6, "gap": 1e-3},
        )

    pressed, lifted = (completed(hanging(load, 1)) for load in (-1.0, 1.0))
    assert pressed.report.normal_force > 0.1 and lifted.report.normal_force == 0.0
    turn = []

    def each(simulation: Simulation, report: Any) -> None:
        still = lifted if round(simulation.stepper.time) % 2 == 0 else pressed
        turn.append(misses({"u": field(simulation, "u")}, {"u": field(still, "u")})["u"])
        assert report.normal_force == pytest.approx(still.report.normal_force, rel=ROUND_OFF)

    completed(hanging("where(t % 2 > 0.5, -1, 1)", 1001), each=each)
    assert len(turn) == 1001 and max(turn) <= ROUND_OFF


@pytest.mark.parametrize("stiffness", ["rigid", 1e12])
def test_impact_and_release_every_few_steps(d: int, stiffness: Any) -> None:
    """A unit mass is lifted by 2 and pressed by 5 in turn, k = 1. By hand, for a rigid mass on a rigid foundation:

    it rises (speed 2, height 2), falls on (force 1, speed -2), rests (force 0, height 0), is pressed (force 5), rises ...
    An elastic mass misses this in proportion to 1/E, and each cycle by as much as the one before.
    """
    up, down, miss = 2.0, 5.0, {}
    for young in (1e4, 1e5):
        forces, heights = Forces(), []

        def each(simulation: Simulation, report: Any, forces: Forces = forces, heights: list[float] = heights) -> None:
            forces(simulation, report)
            heights.append(float(field(simulation, "u")[:, -1].mean()))

        completed(
            scene(
                d,
                2,
                time={"end": 1000.0, "steps": 1000},
                inertia={"density": 1.0},
                elasticity=elasticity(d, young, 0.3),
                loads={"body": along(d, f"where(t % 2 > 0.5, {up}, {-down})")},
                contact={"part": "bottom", "stiffness": stiffness},
            ),
            each=each,
        )
        miss[young] = [
            float(np.abs(np.array(found) - rigid * 250).max())
            for found, rigid in ((forces.normal, [0.0, down - 2 * up, 0.0, down]), (heights, [up, 0.0, 0.0, 0.0]))
        ]
    assert max(miss[1e5]) <= 250 * down / 1e5  # the compression by the press, in every cycle
    assert np.array(miss[1e4]) / miss[1e5] == pytest.approx([10.0, 10.0], rel=0.05)


# ---- friction that turns ---------------------------------------------------------------------------------------------


def test_stick_slip_stick_follows_its_hysteresis(d: int) -> None:
    """A hard block on a foundation, moved to and fro through a soft layer, is a spring with a slider (Jenkins's element):

    the friction force grows by the spring's stiffness times the plate's way until it meets mu N, and turns where the plate turns.
    """
    mu, press, way, steps = 0.1, -0.02, 0.01, 80
    plate = {
        "top": along(d, f"where(t < 1.5, {press} * t, {press})", f"where(t > 1.5, {way} * sin(pi * (t - 1) / 20), 0)")
    }
    one = scene(
        d,
        4,
        time={"end": 1.0 + steps, "steps": 1 + steps},
        elasticity={"lame": [0.0, 50.0]},
        regions={"block": {"where": "y < 0.5" if d == 2 else "z < 0.5", "elasticity": {"lame": [0.0, 5e7]}}},
        supports={"displacement": plate},
        contact={"part": "bottom", "stiffness": 1e5, "friction": {"coefficient": mu}},
    ).override(**{"mesh.lengths": [4.0] * (d - 1) + [1.0]})
    forces, slips = Forces(), []

    def each(simulation: Simulation, report: Any) -> None:
        forces(simulation, report)
        slips.append(report.stick == 0 and report.slip > 0)

    completed(one, digits=5.0, each=each)
    plate_at = way * np.sin(np.pi * np.arange(steps + 1) / 20)
    pull = np.array(forces.tangential)[:, 0]
    spring = (pull[1] - pull[0]) / (plate_at[1] - plate_at[0])
    expected = [pull[0]]
    for move, normal in zip(np.diff(plate_at), forces.normal[1:], strict=True):
        expected.append(float(np.clip(expected[-1] + spring * move, -mu * normal, mu * normal)))
    assert 10 < sum(slips) < steps - 10 and any(a and not b for a, b in pairwise(slips))
    assert pull == pytest.approx(np.array(expected), abs=1e-5 * np.abs(pull).max())


# ---- heat that jumps -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("capacity", ["consistent", "lumped"])
def test_a_foundation_that_jumps_by_a_million(d: int, capacity: str) -> None:
    """All is linear in the data of the heat: a foundation of 293 that jumps by 1e6 to and fro is 293, and 1e6 jumps of 1."""

    def slab(start: float, jump: float) -> dict[str, Any]:
        foundation = f"{start} + where(t % 0.2 > 0.05, {jump}, 0)"
        one = scene(
            d,
            4 if d == 2 else 2,
            time={"end": 2.1, "steps": 21},
            elasticity=elasticity(d, 2e11, 0.3),
            heat={
                "conductivity": 50.0,
                "capacity": 40.0,
                "capacity_matrix": capacity,
                "expansion": {"alpha": 1e-8},
            },
            initial={"temperature": start},
            supports={"displacement": ["top"], "temperature": {"top": start}},
            contact={"part": "bottom", "heat_exchange": {"conductance": 1e3, "foundation_temperature": foundation}},
        )
        return {name: value for name, value in fields(completed(one)).items() if name != "w"}

    still, jump, both = slab(293.0, 0.0), slab(0.0, 1.0), slab(293.0, 1e6)
    exact = {name: still[name] + 1e6 * jump[name] for name in both}
    assert max(misses(both, exact).values()) <= ROUND_OFF
    assert exact["theta"].max() > 1e5 and np.abs(exact["u"]).max() > 1e-4
    if capacity == "lumped":
        assert both["theta"].min() >= 293.0 - 1e-6 and both["theta"].max() <= 1e6 + 293


# ---- slivers ---------------------------------------------------------------------------------------------------------

ASPECT = 1e4
FLAT = ASPECT * UNIT  # round-off of a gradient there, relative


def graded(d: int) -> Any:
    """Cells that grow by 1e4 along the first axis and shrink by as much along the last: slivers in two corners."""
    n = 6 if d == 2 else 4
    ratio = ASPECT ** (n / (n - 1))  # of sizes at the two ends, not of cells
    one = scene(d, n, heat={"conductivity": 1.0})
    return make_mesh(one.override(**{"mesh.grading": [ratio, *[1.0] * (d - 2), 1 / ratio]}))


def flat(d: int) -> Any:
    """A box whose middle node lies 1e-4 of its height above the contact part: the cells between them are flat slivers."""
    kind = getattr(_core, f"Mesh{d}")
    box = kind.box([2] * d, [1.0] * d, _core.Diagonal.right)
    nodes = np.array(box.nodes)
    nodes[(nodes == 0.5).all(axis=1), -1] = 1 / ASPECT
    return kind.from_lists(nodes, box.cells, {name: np.array(facets) for name, facets in box.parts.items()})


def slenderest(mesh: Any) -> float:
    """The largest ratio of longest edge to least height of a cell."""
    corners = np.asarray(mesh.nodes)[np.asarray(mesh.cells)]
    longest = np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max(axis=(1, 2))
    return float((longest * np.linalg.norm(gradients(corners), axis=-1).max(axis=1)).max())


@pytest.mark.parametrize("mesh", [graded, flat])
def test_slivers_on_a_foundation(d: int, mesh: Callable[[int], Any]) -> None:
    """A column without lateral contraction is pressed on its warm foundation: both fields are affine, pressure and flux constant.

    A plate comes down by s: c r = E (s - r) gives the penetration r. Conductances of 3 in series halve the jump of 4.
    """
    young, c, press = 100.0, 400.0, 0.02
    slivers = mesh(d)
    assert slenderest(slivers) >= ASPECT
    r = young * press / (young + c)
    simulation = completed(
        scene(
            d,
            1,
            time={"end": 1e14, "steps": 1},
            elasticity={"lame": [0.0, young / 2]},
            heat={"conductivity": 3.0},
            supports={"displacement": {"top": along(d, -press)}, "temperature": {"top": 1.0}},
            initial={"temperature": 1.0},
            contact={
                "part": "bottom",
                "stiffness": c,
                "friction": {"coefficient": 0.3},
                "heat_exchange": {"conductance": 3.0, "foundation_temperature": 5.0},
            },
        ),
        mesh=slivers,
    )
    height = np.asarray(simulation.discretisation.mesh.nodes)[:, -1]
    u = np.zeros((len(height), d))
    u[:, -1] = -r - (press - r) * height
    assert np.abs(field(simulation, "u") - u).max() <= FLAT * press
    assert np.abs(field(simulation, "theta") - (3.0 - 2.0 * height)).max() <= FLAT * 3.0
    weights = np.asarray(simulation.discretisation.surface.weights)
    assert np.abs(fields(simulation)["contact force"][:, -1]) == pytest.approx(c * r * weights, rel=10 * FLAT)
    assert simulation.report.normal_force == pytest.approx(c * r, rel=ROUND_OFF)


@pytest.mark.parametrize("mesh", [graded, flat])
def test_a_patch_of_slivers(d: int, mesh: Callable[[int], Any]) -> None:
    """Affine displacements and temperatures that are given on all sides are affine inside, at any Poisson's ratio."""
    sides = ["left", "right", "bottom", "top"] + ["front", "back"] * (d == 3)
    gradient = 0.01 * (np.arange(d * d).reshape(d, d) - 1.0)
    axes = ("x", "y", "z")[:d]
    moved = [" + ".join(f"({g!r}) * {axis}" for g, axis in zip(row.tolist(), axes, strict=True)) for row in gradient]
    warmed = " - ".join(axes)
    simulation = completed(
        scene(
            d,
            1,
            time={"end": 1e14, "steps": 1},
            elasticity=elasticity(d, 100.0, 0.3),
            heat={"conductivity": 3.0},
            supports={"displacement": dict.fromkeys(sides, moved), "temperature": dict.fromkeys(sides, warmed)},
        ),
        mesh=mesh(d),
        digits=4.0,
    )
    x = np.asarray(simulation.discretisation.mesh.nodes)
    assert np.abs(field(simulation, "u") - x @ gradient.T).max() <= FLAT * np.abs(x @ gradient.T).max()
    assert np.abs(field(simulation, "theta") - (2 * x[:, 0] - x.sum(axis=1))).max() <= FLAT
    stress = simulation.discretisation.stress(field(simulation, "u"), None, None)
    strain = (gradient + gradient.T) / 2
    lam, shear = simulation.scene.elasticity.pair(d)
    exact = lam * np.trace(strain) * np.eye(d) + 2 * shear * strain
    assert np.abs(stress - exact).max() <= 10 * FLAT * np.abs(exact).max()
