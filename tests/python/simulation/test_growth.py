"""The criterion of growth: what climbs along a straight line of its logarithm, and the course that remembers it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from warmslip.simulation import growth


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
