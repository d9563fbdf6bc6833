"""The criterion of growth: what climbs along a straight line of its logarithm, and the course of a run that remembers it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.sensible import COUPLED, body, warnings

import warmslip
from warmslip.simulation import growth, signals
from warmslip.simulation.pace import Step


@pytest.mark.parametrize(
    ("square", "climbs"),
    [
        (lambda n: 1.05**n, True),
        (lambda n: 1e-30 * 1.5**n, True),
        (lambda n: 1 + 1e-3 * 1.2**n, True),
        (lambda n: 1.05**n * (2 + np.sin(n)), True),
        (lambda n: n**5, False),
        (lambda n: 1 + 1e-3 * n**4, False),
        (lambda n: 1e10 if n > 150 else 1e-10, False),
        (lambda n: 1e10 if n % 40 == 0 else 1.0, False),
        (lambda n: 1e-300 if n < 150 else np.exp(-1e3 / (n - 149)), False),
        (lambda n: 0.0, False),
    ],
)
def test_a_climb_is_straight(square: Any, climbs: bool) -> None:
    course, found = growth.start(), []
    for n in range(1, 301):
        if growth.add(course, [growth.log(square(n))]) and (climb := growth.climb(course)):
            found.append(climb)
    assert bool(found) == climbs and len(course["rows"]) <= growth.ROOM and growth.fits(course)


def test_a_full_course_keeps_the_largest_of_two() -> None:
    course = growth.start()
    for n in range(growth.ROOM + 1):
        growth.add(course, [float(n), -float(n)])
    assert course["stride"] == 2 and course["count"] == 1 and len(course["rows"]) == growth.ROOM / 2 + 1
    assert course["rows"][:2] == [[1.0, 0.0], [3.0, -2.0]] and course["rows"][-1] == [growth.ROOM, -growth.ROOM]


def test_a_climb_of_the_data_is_no_growth() -> None:
    for steps_per_level, grows in ((0.0, True), (0.001, True), (0.05, False)):
        course, found = growth.start(), []
        for n in range(300):
            growth.add(course, [0.05 * n, steps_per_level * n, 3.0])
            found.append(growth.climb(course))
        assert any(found) == grows


@pytest.mark.parametrize(
    "broken",
    [
        None,
        {},
        {"rows": 1},
        {"rows": [1]},
        {"rows": [["a"]]},
        {"rows": [[1.0], [1.0, 2.0]]},
        {"rows": [[1.0]] * 49},
        {"count": None},
        {"stride": "1"},
    ],
)
def test_a_torn_course_fits_nothing(broken: Any) -> None:
    assert not growth.fits(growth.start() | broken if broken else broken)


def test_growth_goes_on_after_a_stop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What each step has changed is in the checkpoint too."""
    scene = body(COUPLED, output__checkpoint=20, time={"end": 108.0, "steps": 200})
    whole = warnings(scene)
    assert any(one.startswith("the coupling feeds the run") for one in whole)
    asked: list[int] = []
    with monkeypatch.context() as patched:
        patched.setattr(signals.Interruption, "agreed", lambda *_: (asked.append(1) or len(asked) == 175, False))
        assert warmslip.run(scene, out=tmp_path).outcome == "interrupted"
    again = warmslip.run(scene, out=tmp_path, resume=True)
    assert again.completed and again.summary["warnings"] == whole


@pytest.mark.parametrize(("mechanical", "warned"), [(0.0, True), (1.0, True), (1e3, False)])
def test_a_growth_without_heat_is_not_the_coupling_s(mechanical: float, warned: bool) -> None:
    """What climbs has its part of heat, g theta^2 with g = |M|/|R| = 2."""
    simulation = warmslip.Simulation(body(COUPLED, heat__heating={"tensor": [[0.0, 0.0], [0.0, -1.5]]}))
    for n in range(60):
        heat = 1.2**n
        balances = SimpleNamespace(heat_damping=heat / 2, inertia_damping=mechanical * heat, elastic_damping=0.0)
        simulation.monitor._growth(balances, Step(n + 1, 0.1 * (n + 1), 0.1, last=False, begin=0.1 * n), [])
    assert bool(simulation.monitor.fed()) == warned
    share = simulation.monitor.seen["course"]["rows"][-1][0] - growth.log(1.2**59 * (1 + mechanical))
    assert share == pytest.approx(0.0, abs=1e-12)
