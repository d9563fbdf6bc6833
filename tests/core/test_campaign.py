"""The campaign in small: its reference against exact answers and an independent code, its judge against faults, some scenes."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from campaign import envelope, judge, sample
from campaign.run import judged, main, one, summary
from campaign.workers import rehearse, served
from reference import exact_cases, exact_numbers, scipy_scheme
from reference.extended_contact import LAW
from reference.extended_numbers import floats
from reference.extended_path import path, tangents
from reference.extended_scheme import Scheme

import warmslip
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene

EXACT = [
    *("square, staggered, gauss-2", "squares, monolithic, gauss-2", "squares, lagged, nodal"),
    *("printed, monolithic, 10.0", "consistent, lagged, 10.0", "cube, frictionless"),
]
HARD = exact_cases.CYCLES | {name: case for name, (_, case) in exact_cases.SEVERAL.items()}

BASE: dict[str, Any] = {
    "mesh": {"n": 3},
    "time": {"end": 0.5, "steps": 3},
    "inertia": {"density": 1.5},
    "elasticity": {"lame": [3.0, 1.25]},
    "viscosity": {"lame": [0.5, 0.75]},
    "loads": {"body": [1.5, -3.0], "traction": {"left": [1.25, "0.5 * y * t"]}},
    "supports": {"displacement": ["top"]},
    "contact": {"part": "bottom", "stiffness": 200.0, "gap": "0.01 + 0.02 * x * t", "friction": {"coefficient": 0.3}},
    "initial": {"displacement": [0.05, "-0.02 * (1 - y)"], "velocity": [-0.25, -0.5]},
}
HEAT: dict[str, Any] = {
    "heat": {
        "conductivity": [[1.5, 0.25], [0.25, 0.75]],
        "capacity": 1.25,
        "source": "2 * x * t",
        "expansion": {"tensor": [[0.5, 0.25], [0.25, 1.0]]},
        "heating": {"tensor": [[1.0, -0.5], [-0.5, 0.25]]},
    },
    "loads.heat_flux": {"right": "0.5 * y"},
    "initial.temperature": "1.5 * x",
    "contact.heat_exchange": {"conductance": 0.75, "foundation_temperature": "-4 * x"},
}
SOLID: dict[str, Any] = {
    "mesh": {"shape": "cube", "n": 2, "lengths": [1.0, 1.5, 0.75]},
    "loads": {"body": [1.5, -0.75, -3.0], "traction": {"left": [1.25, 0.5, "0.25 * y * z"]}},
    "initial": {"velocity": [-0.25, 0.5, -0.5]},
}
BLOCKS: dict[str, dict[str, Any]] = {
    "plain": {},
    "left diagonals": {"mesh.diagonal": "left", "mesh.lengths": [2.0, 0.5]},
    "criss-cross": {"mesh.diagonal": "crisscross"},
    "no inertia": {"inertia": None, "initial.velocity": None},
    "no viscosity": {"viscosity": None},
    "no elasticity": {"elasticity": None},
    "plane stress": {"elasticity": {"young": 2.0, "poisson": 0.3, "assumption": "plane_stress"}},
    "full tensor": {"elasticity": {"tensor": [[4.0, 1.0, 0.5], [1.0, 3.0, 0.25], [0.5, 0.25, 1.5]]}},
    "free": {"supports": {}},
    "moving": {"supports": {"displacement": {"top": ["0.1 * t", "-0.2 * t * t"]}}},
    "gauss-2": {"contact.quadrature": "gauss-2"},
    "gauss-3": {"contact.quadrature": "gauss-3"},
    "exponent": {"contact.exponent": 1.5},
    "pressure limit": {"contact.pressure_limit": 1.0},
    "Tresca": {"contact.friction": {"cohesion": 0.25}},
    "friction limit": {"contact.friction": {"coefficient": 0.5, "limit": 0.3}},
    "kinetic": {"contact.friction": {"coefficient": 0.5, "kinetic": 0.2, "speed": 0.3}},
    "regularised": {"contact.friction": {"coefficient": 0.5, "regularisation": 0.1}},
    **{f"heat, {coupling}": HEAT | {"time.coupling": coupling} for coupling in exact_cases.COUPLINGS},
    "warm support": HEAT | {"supports.temperature": {"top": "20 * t"}},
    "contact heat": HEAT | {"contact.heat_exchange.per_pressure": 0.5, "contact.friction_heating": {"share": 0.5}},
    "contact heat, gauss": HEAT
    | {"contact.heat_exchange.per_pressure": 0.5, "time.coupling": "lagged", "contact.quadrature": "gauss-2"},
    "solid": SOLID,
    "solid, left": SOLID | {"mesh.diagonal": "left"},
    "solid, gauss-2": SOLID | {"contact.quadrature": "gauss-2"},
}
FAULTS: dict[str, dict[str, Any]] = {
    "friction": {"contact.friction.coefficient": 0.303},
    "stiffness": {"contact.stiffness": 200.1},
    "gap": {"contact.gap": "-0.01 - 0.02 * x * t"},
    "density": {"inertia.density": 1.50001},
    "order of the coupling": {"time.coupling": "lagged"},
    "sign of the heating": {"heat.heating.tensor": [[-1.0, 0.5], [0.5, -0.25]]},
    "foundation": {"contact.heat_exchange.foundation_temperature": "-4.0001 * x"},
    "quadrature": {"contact.quadrature": "gauss-2"},
}

SMALL = {"supported": 16, "solid": 8, "free": 12, "laws": 24}
NEVER = ("silently_wrong", "crash", "hang", "unjudged")
JOBS = ["fine", "die", "again", "sleep", "half", "last"]


def scene(overrides: dict[str, Any]) -> Scene:
    return build(BASE).override(**overrides)


def verdict(right: Scene, ran: judge.Ran) -> dict[str, Any]:
    return judge.judge(right, ran)


@pytest.mark.parametrize("name", EXACT)
def test_reference_is_exact(name: str) -> None:
    case = exact_cases.CASES[name]
    for state, expected in zip(Scheme(case.scene()).advance(), case.states[1:], strict=True):
        for field in ("u", "w", "theta"):
            right = exact_numbers.floats(getattr(expected, field))
            assert np.abs(floats(getattr(state, field)) - right).max() <= 1e-15 * np.abs(right).max(), field


@pytest.mark.parametrize("name", [name for name, case in HARD.items() if isinstance(case.mesh, int)])
def test_the_path_leads_to_a_solution_where_newton_cycles(name: str) -> None:
    scheme = Scheme(HARD[name].scene())
    contact, *_ = scheme.reduced(scheme.start(), 1)
    lam = path(contact)
    assert lam is not None and contact.defect(lam, contact.velocity(lam)) < LAW
    for state in scheme.advance():  # raises where a step is not solved
        assert state.way in ("newton", "path")


@pytest.mark.parametrize("coupling", exact_cases.COUPLINGS)
def test_reference_against_scipy(coupling: str) -> None:
    theirs = scipy_scheme.simulate("printed", 10.0, 4, 4, coupling)
    keys = {"mesh.n": 4, "time.steps": 4, "time.coupling": coupling}
    own = warmslip.load("paper_printed").override(**keys, **{"contact.heat_exchange.foundation_temperature": 10.0})
    for n, state in enumerate(Scheme(own).advance(), start=1):
        for field in ("u", "w", "theta"):
            right = getattr(theirs, field)
            assert np.abs(floats(getattr(state, field)) - right[n]).max() <= 1e-12 * np.abs(right).max(), field


@pytest.mark.parametrize("name", BLOCKS)
def test_warmslip_is_the_reference(name: str) -> None:
    there = scene(BLOCKS[name])
    ran = judge.run(there)
    row = verdict(there, ran)
    assert (row["class"], row["outcome"]) == ("right", "completed"), row
    assert max(float(row[f"error_{field}"]) for field in judge.FIELDS) <= 1e-9, row
    assert max(float(row[f"left_{name}"]) for name in judge.LEFT) <= 1e-11, row
    it = judge.Judge(there)
    own, shared = it.own(ran)
    assert len(shared) == len(ran.positions)
    if there.supports.displacement:
        assert len(it.scheme.points) == len(shared)
    touched = {state.way for state in it.advance()[1:]}
    assert touched <= {"newton", "path", "tangents"} and len(own) == there.time.steps + 1


@pytest.mark.parametrize("name", FAULTS)
def test_judge_sees_a_fault(name: str) -> None:
    right = scene(HEAT)
    assert verdict(right, judge.run(right))["class"] == "right"
    row = verdict(right, judge.run(right.override(**FAULTS[name])))
    assert row["class"] == "silently_wrong", row


def test_judge_sees_a_fault_in_the_heat_of_friction() -> None:
    """What the judge allows for rounding of the slip is far below any heat that slip makes, and above what sticking makes."""
    rubbed = scene(
        HEAT
        | {
            "heat.source": 0.0,
            "heat.heating": None,
            "loads.heat_flux": {},
            "initial.temperature": 0.0,
            "contact.heat_exchange": None,
            "contact.friction_heating": {"share": 0.5},
        }
    )
    assert verdict(rubbed, judge.run(rubbed))["class"] == "right"
    row = verdict(rubbed, judge.run(rubbed.override(**{"contact.friction_heating.share": 0.50001})))
    assert row["class"] == "silently_wrong" and row["error_theta"] == pytest.approx(2e-5, rel=0.01)
    held = rubbed.override(
        **{"contact.friction.coefficient": 1e3, "initial.velocity": None, "initial.displacement": None}
    )
    ran = judge.run(held)
    assert max(np.abs(one["theta"]).max() for one in ran.states) <= 1e-9
    assert verdict(held, ran)["class"] == "right"


@pytest.mark.parametrize("field", judge.FIELDS)
def test_judge_sees_a_wrong_field(field: str) -> None:
    right = scene(HEAT)
    ran = judge.run(right)
    last = ran.states[-1]
    wrong = dataclasses.replace(ran, states=[*ran.states[:-1], last | {field: last[field] * (1 + 1e-5)}])
    assert verdict(right, wrong)["class"] == "silently_wrong"


def test_another_solution_is_right_too() -> None:
    count, case = exact_cases.SEVERAL["mu = 5, k = 1"]
    own = case.scene(**{"time.steps": 1, "time.end": 1.0})
    solutions = case.scheme.step(case.states[0])
    assert len(solutions) == count
    classes = []
    for solution in solutions:
        u, w, theta = (exact_numbers.floats(getattr(solution, name)) for name in ("u", "w", "theta"))
        ran = judge.run(own)
        force = np.zeros_like(ran.states[0]["force"])
        places = [exact_numbers.floats(case.exact_mesh().nodes)[i] for i in _nodes(case)]
        for x, one_force in zip(places, exact_numbers.floats(solution.force), strict=True):
            force[int(np.argmin(np.abs(ran.positions - x).sum(axis=1)))] = one_force
        stress = warmslip.discretise(own).stress(u, w, theta)
        state = ran.states[0] | {"u": u, "w": w, "theta": theta, "force": force, "stress": stress}
        classes.append(verdict(own, dataclasses.replace(ran, states=[state]))["class"])
    assert classes == ["right"] * count


def _nodes(case: exact_cases.Case) -> list[int]:
    return [int(np.argmax(exact_numbers.floats(point.shape))) for point in case.scheme.points]


def test_laws_that_bend_are_reached_by_tangents() -> None:
    for name in ("exponent", "kinetic"):
        scheme = Scheme(scene(BLOCKS[name]))
        contact, *_ = scheme.reduced(scheme.start(), 1)
        lam = tangents(contact)
        assert lam is not None and contact.defect(lam, contact.velocity(lam)) < LAW


def test_a_process_that_dies_or_hangs_is_named() -> None:
    found = {one: (how, result) for one, how, result in served(rehearse, JOBS, processes=1, limit=1.0)}
    assert found == {
        "fine": ("done", "fine"),
        "die": ("crash", None),
        "again": ("done", "again"),
        "sleep": ("hang", None),
        "half": ("hang", "half"),
        "last": ("done", "last"),
    }


def test_scenes_are_scene_files_and_the_same_again() -> None:
    few, many = sample.sample("laws", 5), sample.sample("laws", 40)
    assert [s.tables for s in few] == [s.tables for s in many[:5]]
    assert len({str(s.tables) for s in [*many, *sample.sample("laws", 40, seed=1)]}) == 80


def test_nothing_is_silently_wrong() -> None:
    scenes = [s for family, count in SMALL.items() for s in sample.sample(family, count)]
    assert len(scenes) >= 40
    lines = list(judged(scenes))
    row = summary(lines)[-1]
    assert row["scenes"] == len(scenes)
    wrong = [f"{line['family']}:{line['number']} {line['class']}" for line in lines if line["class"] in NEVER]
    assert not wrong
    assert row["completed_right"] >= 60


def test_command(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "results"
    assert main(["--families", "free", "--count", "3", "--jobs", "1", "--out", str(out), "--keep", str(out)]) == 0
    assert (out / "campaign.csv").read_text().count("\n") == 4
    assert {"campaign.csv", "campaign_summary.csv", "campaign.json"} <= {p.name for p in out.iterdir()}
    assert one("supported:1") == 0
    assert "[elasticity]" in capsys.readouterr().out


def test_envelope_finds_where_a_run_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def verdict(name: str, axis: str, exponent: float) -> str:
        asked.append(exponent)
        return "right" if -1.3 < exponent < 9 else "stopped_though_solvable"

    monkeypatch.setattr(envelope, "verdict", verdict)
    assert envelope.edge("paper", "step", -8) == (-1.25, "stopped_though_solvable")
    assert envelope.edge("paper", "step", 8) == (8.0, "")
    assert min(asked) == -2.0


def test_envelope_has_an_axis_where_the_scene_has_a_datum() -> None:
    lines = envelope.table(["free"], ["stiffness", "load", "expansion"])
    assert [line["axis"] for line in lines] == ["expansion"]
    assert lines[0]["smallest"] <= 1 <= lines[0]["largest"]
