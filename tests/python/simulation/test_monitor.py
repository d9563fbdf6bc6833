"""What solves its equations and is hardly sensible is said: with its number and its cure, and not of its sensible neighbour."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.processes import Command
from support.sensible import COUPLED, FALLING, KELVIN, PRESSED, WARM, body, warnings

import warmslip
from warmslip import Loads, Scene
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.report import cost
from warmslip.scene import plan
from warmslip.scene.reader import build
from warmslip.simulation.summary import summary

TURNED = {  # a corner that moves and turns the body
    **{key: value for key, value in FALLING.items() if key not in ("initial", "contact")},
    "supports": {"points": [{"at": [0.0, 1.0], "displacement": ["0.001 * t", 0.0]}]},
}
BEFORE = [  # scene, what is said before and after the run; None: nothing
    (body(PRESSED), None),
    (body(WARM), None),
    (body(PRESSED, supports__displacement=["top"]), "nothing acts: there is no load"),
    (
        body(PRESSED, supports__displacement={"top": ["free", 0.0], "left": {"normal": 0.0}}),
        "nothing acts: there is no",
    ),
    (body(PRESSED, supports__displacement={"top": ["free", "-0.005 * t"], "left": [0.0, "free"]}), None),
    (
        body(WARM, supports={"temperature": {"left": 20.0, "top": "20 + 5 * t"}}),
        "'left' and 'top' prescribe the temperatures 20 and 20.5 at their common node at (0, 1), t = 0.1: that of 'top'",
    ),
    (body(WARM, supports={"temperature": {"left": 20.0, "right": "20 + 5 * t"}}), None),
    (body(TURNED), None),
    (body(WARM, contact__heat_exchange__foundation_temperature=20.0), "nothing acts: there is no load"),
    (body(WARM, contact__heat_exchange__foundation_temperature=21.0), None),
    (body(PRESSED, contact__friction__coefficient=2.5), "the friction coefficient of 'bottom' is 2.5: dry solids have"),
    (
        body(FALLING, contact__friction={"coefficient": 0.5, "kinetic": 0.1, "speed": 0.2}),
        "the friction coefficient of 'bottom' falls from 0.5 to 0.1 over a slip speed of 0.2, which may feed",
    ),
    (body(PRESSED, contact__gap="0.001 * (x - 0.5)"), "the gap of 'bottom' is -0.0005 at its nearest point at t = 0"),
    (body(PRESSED, contact__gap="0.001 * abs(x - 0.5)"), None),
    (body(PRESSED, contact__gap="-0.001 * t"), None),
    (
        body(PRESSED, elasticity__young=1.0, contact__stiffness=1.0, contact__gap="0.001 - 0.2 * t"),
        "the gap of 'bottom' falls to -0.199, 20 % of the body's size",
    ),
    (body(WARM, heat={"conductivity": 1.0}), "the capacity is 1 because [heat] gives none; write heat.capacity"),
    (body(PRESSED, inertia={}), "the density is 1 because [inertia] gives none; write inertia.density"),
    (
        body(PRESSED, inertia={"density": 0.1}, regions={"part": {"where": "x < 0.5", "inertia": {}}}),
        "the density is 1 because [regions.part.inertia] gives none",
    ),
    (
        body(PRESSED | KELVIN),
        "all temperatures lie between 293 and 300, which looks absolute, and the body is free of stress",
    ),
    (body(PRESSED | KELVIN, heat__expansion__reference_temperature=293.0), None),
    (body(PRESSED | KELVIN, initial__temperature=20.0, supports__temperature={"top": 30.0}), None),
    (
        body(PRESSED | KELVIN, heat__expansion__reference_temperature=293.0, heat__heating={"tensor": 1e-3}),
        "and R is 1 M, which warms a stretched body: thermodynamics has R = -293 M",
    ),
    (
        body(PRESSED | KELVIN, heat__expansion__reference_temperature=293.0, heat__heating={"tensor": -1e-3}),
        "and R is -1 M, which is that of a heat equation divided by the temperature",
    ),
    (body(PRESSED | KELVIN, heat__expansion__reference_temperature=293.0, heat__heating={"tensor": -0.3}), None),
    (
        body(PRESSED, elasticity__poisson=0.49),
        "elasticity has a Poisson's ratio of 0.49, at which linear elements lock: a",
    ),
    (body(PRESSED, elasticity__poisson=0.44), None),
    (body(PRESSED, elasticity__poisson=0.49, mesh__diagonal="crisscross"), None),
    (body(PRESSED, elasticity={"young": 100.0, "poisson": 0.6, "assumption": "plane_stress"}), None),
    (
        body(
            WARM,
            initial__temperature=0.0,
            contact__heat_exchange={"conductance": 1e4, "foundation_temperature": 100.0},
            time__end=1e-4,
        ),
        "temperatures start with a jump of 100 on 'bottom', and a step of 1e-05 is shorter than the mesh resolves there",
    ),
    (
        body(
            WARM,
            initial__temperature=0.0,
            contact__heat_exchange={"conductance": 1e4, "foundation_temperature": 100.0},
            time__end=1e-4,
            heat__capacity_matrix="lumped",
        ),
        None,
    ),
    (
        body(WARM, supports__temperature={"top": 0.0}, time__end=10.0),
        "temperatures start with a jump of 20 on 'top', and a step of 1 is 64 times the 0.016 in which it leaves the first cell",
    ),
    (body(WARM, supports__temperature={"top": 20.0}, time__end=10.0), None),
    (body(COUPLED), "a step of 0.54 is longer than staggered steps stand with this coupling"),
    (body(COUPLED, time__end=159.0), None),
    (body(COUPLED, time__coupling="monolithic"), None),
    (body(COUPLED, inertia={"density": 1e3}), None),  # too heavy to follow
    (body(COUPLED, heat__conductivity=1.0, inertia={"density": 1.0}), None),  # and heat too quick
    (
        body(COUPLED, heat__heating={"tensor": [[0.0, 0.0], [0.0, 0.51]]}),
        "heat.heating warms what heat.expansion stretches",
    ),
    (body(COUPLED, heat__heating={"tensor": [[0.0, 0.0], [0.0, 0.49]]}), None),
]


@pytest.mark.parametrize(("scene", "words"), BEFORE, ids=[f"{i}" for i in range(len(BEFORE))])
def test_before_a_run_and_after_it(scene: Scene, words: str | None) -> None:
    planned, message = cost.measured(scene).warnings, warnings(scene)
    for found in (planned, message):
        if words is None:
            assert not found, found
        else:
            assert any(words in one for one in found), found
    if words is not None:
        assert any(words in line for line in plan.text(cost.measured(scene)).splitlines())


AFTER = [
    (
        body(PRESSED, contact=None, supports__displacement={"top": [0.0, "0.3 * t"], "bottom": [0.0, 0.0]}),
        "the largest strain is",
    ),
    (
        body(PRESSED, contact__stiffness=100.0, supports__displacement={"top": [0.0, "-0.05 * t"]}),
        "the body sinks into the foundation by 0.02",
    ),
    (body(PRESSED, contact__gap=0.1), "nothing ever touches: the nearest point ends 0.095 away"),
    (
        body(
            PRESSED,
            contact=None,
            supports__displacement={"left": [0.0, "free"]},
            supports__springs={"top": {"stiffness": 1e-3}},
            loads={"body": [0.0, -1.0]},
        ),
        "the body moves by 1e+03, 1e+03 times its size: hardly anything holds it",
    ),
    (
        body(PRESSED, contact__gap={"shape": "cylinder", "at": [5.0, -0.5], "radius": 0.2}),
        "nothing ever touches: no normal of the part meets the foundation",
    ),
    (
        body(PRESSED, contact__gap={"shape": "cylinder", "at": [0.5, -1.5], "radius": 1.4}),
        "nothing ever touches: the nearest point ends 0.095 away",
    ),
    (body(PRESSED, contact__gap="10 * abs(x - 0.5)"), "at most 1 of 9 contact points ever touch"),
    (
        body(
            PRESSED, contact__gap="1e-6 * (1 + sin(30 * x))", supports__displacement={"top": ["0.2 * t", "-0.005 * t"]}
        ),
        "points of 'bottom' slip by 0.",
    ),
    (body(FALLING, time__steps=40), "an impact lasts"),
]


@pytest.mark.parametrize(("scene", "words"), AFTER, ids=[words for _, words in AFTER])
def test_after_a_run(scene: Scene, words: str) -> None:
    message = warnings(scene)
    assert any(one.startswith(words) for one in message), message
    assert not any(words in one for one in cost.measured(scene).warnings)


@pytest.mark.parametrize(
    "scene",
    [
        body(FALLING),
        body(PRESSED, supports__displacement={"top": ["0.05 * t", "-0.005 * t"]}),  # slips under a gap that is flat
        body(PRESSED, contact__gap="1e-6 * (1 + sin(30 * x))"),
    ],
    ids=["impact in many steps", "flat gap", "short slip"],
)
def test_nothing_is_said_of_what_is_sensible(scene: Scene) -> None:
    assert warnings(scene) == []


def test_a_body_that_sinks_without_deforming() -> None:
    soft = body(
        PRESSED,
        inertia={"density": 1.0},
        viscosity={"lame": [10.0, 10.0]},
        supports__displacement=[],
        loads={"body": [0.0, -1.0]},
        contact={"part": "bottom", "stiffness": 200.0, "friction": {"coefficient": 0.5}},
        elasticity__young=1e5,
    )
    assert [one for one in warnings(soft) if "and deforms by" in one and "raise contact.stiffness" in one]
    assert not [one for one in warnings(soft.override(**{"contact.stiffness": 1e5})) if "sinks" in one]


def test_the_largest_strain_is_that_of_all_times_and_exact() -> None:
    """Stretched by 30 % in the middle of the run and back, and sheared: the principal strain, not its components."""
    keys = {"contact": None, "time.steps": 16}
    there = build(PRESSED).override(
        **keys, **{"supports.displacement": {"top": [0.0, "0.3 * sin(3 * t)"], "bottom": [0.0, 0.0]}}
    )
    assert any(one.startswith("the largest strain is") for one in warnings(there))
    for scene in (
        there,
        build(
            PRESSED
            | {
                "mesh": {"shape": "cube", "n": 2},
                "contact": None,
                "elasticity": {"lame": [1.0, 1.0]},
                "supports": {"displacement": {"top": [0.0, 0.0, "t"]}},
            }
        ),
    ):
        d = discretise(scene)
        x = np.asarray(d.mesh.nodes)
        for gradient in (np.random.default_rng(1).normal(size=(d.dim, d.dim)), 0.2 * np.eye(d.dim)):
            exact = np.abs(np.linalg.eigvalsh((gradient + gradient.T) / 2)).max()
            assert d.largest_strain(x @ gradient.T) == pytest.approx(exact, rel=1e-12)
    with pytest.raises(ValueError, match="one row for each"):
        d.largest_strain(np.zeros((3, 3)))


HOT = body(
    WARM,
    initial__temperature=0.0,
    contact__heat_exchange={"conductance": 1e6, "foundation_temperature": 100.0},
    time__end=1e-4,
)


def test_undershoots_are_counted() -> None:
    states: list[Any] = []
    done = warmslip.run(HOT, observers=[lambda state, _: states.append(state.theta)])
    [found] = [one for one in done.summary["warnings"] if "that the data allow" in one]
    looked = [states[n - 1] for n in (1, 2, 4, 8, 10)]
    worst = min(looked, key=np.min)
    assert found.startswith(
        f"{np.sum(worst < -0.1)} of 81 temperatures lie below 0, the least that the data allow: {worst.min():.4g}"
    )
    assert worst.min() < -30
    assert not [one for one in warnings(HOT.override(**{"heat.capacity_matrix": "lumped"})) if "allow" in one]


@pytest.mark.parametrize(
    ("keys", "allowed"),
    [
        ({}, (0.0, 100.0)),
        ({"heat.source": 1.0}, (0.0, np.inf)),
        ({"heat.source": -1.0}, (-np.inf, 100.0)),
        ({"heat.source": "x - 0.5"}, (-np.inf, np.inf)),
        ({"loads.heat_flux": {"left": 2.0}}, (0.0, np.inf)),
        ({"supports.temperature": {"top": "-7 * t"}}, (-7e-4, 100.0)),
        ({"initial.temperature": "300 * x"}, (0.0, 300.0)),
        ({"contact.heat_exchange.foundation_temperature": "1e6 * t"}, (0.0, 100.0)),
    ],
)
def test_what_temperatures_the_data_allow(keys: dict[str, Any], allowed: tuple[float, float]) -> None:
    simulation = warmslip.Simulation(HOT.override(**keys))
    assert simulation.monitor._allowed == pytest.approx(allowed)


def test_heating_and_friction_leave_no_bound() -> None:
    warm = body(PRESSED, heat={"conductivity": 1.0, "capacity": 1.0}, initial={"temperature": 1.0})
    assert warmslip.Simulation(warm).monitor._allowed == (1.0, 1.0)
    rubbed = warm.override(**{"contact.friction_heating": {"share": 0.5}})
    assert warmslip.Simulation(rubbed).monitor._allowed == (1.0, np.inf)
    coupled = warm.override(**{"heat.heating": {"tensor": 0.1}})
    assert warmslip.Simulation(coupled).monitor._allowed == (-np.inf, np.inf)


def test_loads_in_python_are_not_called_idle_nor_asked_again() -> None:
    calls: list[float] = []

    def pull(x: Any, t: float) -> Any:
        calls.append(t)
        return np.tile([0.01 * t, -0.5 * t], (len(x), 1))

    scene = body(PRESSED, supports__displacement=["top"], contact=None)
    assert warnings(scene, loads=Loads(body=pull)) == []
    assert len(calls) == 1 + scene.time.steps  # tried once, then once a step


def test_a_step_looks_at_no_field(monkeypatch: pytest.MonkeyPatch) -> None:
    """Strains at most five times, however many the steps, and a field is gathered for nothing else before the end."""
    ordinary, gathered = Discretisation.field, []
    monkeypatch.setattr(Discretisation, "field", lambda self, vec: gathered.append(1) or ordinary(self, vec))
    simulation = warmslip.Simulation(body(PRESSED, time__steps=200))
    for _ in simulation.steps():
        pass
    assert 1 <= len(gathered) <= 5


def test_a_resumed_run_says_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a run has seen before it was interrupted is in the checkpoint: the impact, and the temperatures of the start."""
    from warmslip.simulation import signals

    scene = body(
        FALLING,
        time__steps=32,
        heat={"conductivity": 3e-2, "capacity": 1.0},
        initial__temperature="where(y > 0.5, 100, 0)",
        output__checkpoint=20,
    )
    whole = warnings(scene)
    assert any("an impact lasts" in one for one in whole) and any("the data allow" in one for one in whole)
    asked: list[int] = []
    with monkeypatch.context() as patched:
        patched.setattr(signals.Interruption, "agreed", lambda *_: (asked.append(1) or len(asked) == 27, False))
        assert warmslip.run(scene, out=tmp_path).outcome == "interrupted"
    again = warmslip.run(scene, out=tmp_path, resume=True)
    assert again.completed and again.summary["warnings"] == whole


@pytest.mark.mpi
def test_two_ranks_say_it_once_and_the_same(command: Command, tmp_path: Path) -> None:
    message = []
    for ranks in (1, 2):
        done = command("run", "sliding_block", "--set", "time.steps=100", "--out", f"run{ranks}", ranks=ranks)
        assert done.returncode == 0, done.stderr
        found = json.loads((tmp_path / f"run{ranks}/summary.json").read_text())["warnings"]
        assert done.stderr.count("warning: ") == len(found) > 0
        assert all(f"warning: {one}" in done.stderr for one in found)
        message.append(found)
    assert message[0] == message[1]


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("capacity", ["lumped", "consistent"])
@pytest.mark.parametrize("level", [1.0, 293.15])
def test_a_body_at_one_temperature_is_not_said_to_leave_it(d: int, capacity: str, level: float) -> None:
    simulation = warmslip.Simulation(
        build(
            {
                "mesh": {"shape": "square" if d == 2 else "cube", "n": [2, 3, 2][:d]},
                "time": {"steps": 6, "end": 10.0},
                "heat": {"conductivity": 0.7, "capacity": 1.0, "capacity_matrix": capacity},
                "initial": {"temperature": level},
            }
        )
    )
    for _ in simulation.steps():
        pass
    assert not [message for message in summary(simulation)["warnings"] if "the data allow" in message]


@pytest.mark.parametrize(
    "tables",
    [
        {"contact__heat_exchange__foundation_temperature": "1 / (t - 0.5)"},
        {"supports": {"temperature": {"left": "1 / (t - 0.5)", "top": "1 / (t - 0.25)"}}},
    ],
)
def test_a_pole_between_two_steps_is_never_met(tables: dict[str, Any]) -> None:
    """Warnings look at data between the steps; what the scheme needs is finite."""
    done = warmslip.run(build(body(WARM, time={"end": 1.0, "steps": 3}, **tables)))
    assert done.summary["outcome"] == "completed"
