"""The times of a run: they fill the time, nest, and end exactly at the end."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from warmslip import SceneError, load
from warmslip.scene.clock import Clock, graded, uniform

CASES: list[list[float]] = [[0.0], [2.0], [0.0, 2.0], [0.3], [0.0, 0.3, 1.1], [0.7, 2.0]]


def check(clock: Clock, end: float, steps: int) -> None:
    times = clock.times
    assert len(times) == clock.steps
    assert times[-1] == end == clock.end
    assert (np.diff([0.0, *times]) > 0).all()
    for n in (1, (clock.steps + 1) // 2, clock.steps):
        time, size = clock.step(n)
        assert time == times[n - 1]
        assert size == pytest.approx(times[n - 1] - (times[n - 2] if n > 1 else 0.0), rel=1e-9)
    for one, other in pairwise(clock.blocks):
        assert one.end == other.begin
    assert clock.longest <= end / steps * (1 + 1e-12)
    assert len(clock.sizes) == len({float(f"{size:.9g}") for size in clock.sizes})  # no size twice


@pytest.mark.parametrize("steps", [1, 3, 10, 7])
def test_equal_steps(steps: int) -> None:
    clock = uniform(0.3, steps)
    check(clock, 0.3, steps)
    assert clock.sizes == [0.3 / steps]
    assert clock.times.tolist() == [float(Fraction(3 * n, 10 * steps)) for n in range(1, steps + 1)]


@pytest.mark.parametrize("tenths", range(1, 41))
def test_times_are_the_numbers_next_to_the_exact_ones(tenths: int) -> None:
    """0.3 is the end of step 3 to 0.4 as to 1: a formula with `t <= 0.3` is true there, and 0.3 is found in a trajectory."""
    clock = uniform(tenths / 10, tenths)
    assert clock.times.tolist() == [n / 10 for n in range(1, tenths + 1)]
    halves = graded(tenths / 10, 2 * tenths, [tenths / 20], 0)
    assert halves.end == tenths / 10 and tenths / 20 in halves.times.tolist()


@pytest.mark.parametrize("to", CASES)
@pytest.mark.parametrize(("steps", "halvings"), [(1, 1), (8, 3), (12, 8)])
def test_graded_steps(to: list[float], steps: int, halvings: int) -> None:
    clock = graded(2.0, steps, to, halvings)
    check(clock, 2.0, steps)
    for time in to:  # the step at such a time is the shortest around it
        ends = np.array([0.0, *clock.times])
        at = int(np.abs(ends - time).argmin())
        assert ends[at] == pytest.approx(time, abs=1e-15)
        for n in {at, at + 1} & set(range(1, clock.steps + 1)):
            assert clock.step(n)[1] <= clock.longest * 2.0 ** (1 - halvings) * (1 + 1e-9)


def test_blocks_double_away_from_zero() -> None:
    clock = graded(1.0, 8, [0.0], 8)
    assert clock.steps == 36
    assert [block.steps for block in clock.blocks] == [4] * 9
    lengths = [block.end - block.begin for block in clock.blocks]
    assert lengths == pytest.approx([2.0**-8, *(2.0**-i for i in range(8, 0, -1))])


@pytest.mark.parametrize("to", CASES)
def test_more_steps_contain_the_times_of_fewer(to: list[float]) -> None:
    coarse, fine = (graded(2.0, steps, to, 4).times for steps in (16, 32))
    if len(fine) == 2 * len(coarse):
        assert fine[1::2] == pytest.approx(coarse, rel=1e-13)
    else:  # an interval that no whole number of steps fills
        assert 0.3 in to or 1.1 in to or 0.7 in to


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"time.graded_to": [2.0]}, "later than the end, 1"),
        ({"time.graded_to": [0.0, 0.0]}, "named twice"),
        ({"time.graded_to": [0.0], "time.tolerance": 0.01}, "give one of graded_to and tolerance"),
        ({"time.halvings": 3}, "halvings of what"),
        ({"time.tolerance": 0.0}, "greater than 0"),
        ({"time.tolerance": 2.0}, "less than or equal to 1"),
        ({"time.end": 1e-140, "time.graded_to": [0.0], "time.halvings": 40}, "too short to divide by"),
        ({"time.steps": 2**30, "time.graded_to": [0.0]}, "counted in 32 bits"),
    ],
)
def test_refusals(keys: dict[str, object], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        load("paper_mixed").override(**keys)
