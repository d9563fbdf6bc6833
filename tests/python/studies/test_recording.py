"""Runs that are measured one after the other against one that is kept."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip.scene.scene import Scene
from warmslip.studies.companions import QUANTITIES, Companion, march
from warmslip.studies.recording import REPEATS, Recording, seconds

HOT = {"contact.heat_exchange.foundation_temperature": 10.0}


def paper(n: int, steps: int, **keys: Any) -> Scene:
    more = {key.replace("__", "."): value for key, value in keys.items()}
    return warmslip.load("paper_mixed").override(**(HOT | {"mesh.n": n, "time.steps": steps} | more))


def test_distances_are_those_of_runs_that_advance_together() -> None:
    """Where all times of the coarse run are times of the kept one."""
    (known,), size = march([Companion(paper(8, 16)), Companion(paper(4, 8))], [(0, 1)])
    kept = Recording(Companion(paper(8, 16)))
    found = kept.distance(Companion(paper(4, 8)))
    assert found.times == known.times == 8
    for name in QUANTITIES:
        assert found.values[name] == pytest.approx(known.values[name], rel=1e-9), name
        assert kept.size[name] == pytest.approx(size[name], rel=1e-12), name
    again = kept.distance(Companion(paper(4, 8)))  # the same mesh, which is not located again
    assert again.values == pytest.approx(found.values, rel=1e-12)
    other = kept.distance(Companion(paper(6, 8)))  # another mesh, which is
    fresh = Recording(Companion(paper(8, 16))).distance(Companion(paper(6, 8)))
    assert other.values == pytest.approx(fresh.values, rel=1e-12)


def test_a_run_is_measured_at_all_its_steps() -> None:
    """Also at times that the kept run jumps over: there its states lie on a straight line."""
    kept = Recording(Companion(paper(4, 4)))
    run = Companion(paper(4, 16, time__tolerance=0.01))
    found = kept.distance(run)
    assert found.times == run.simulation.taken > 16
    half, values = kept.at(0.375)
    states = [kept.at(time) for time in (0.25, 0.5)]
    mean = [0.5 * (a + b) for a, b in zip(*([v[name] for name in QUANTITIES[3:]] for _, v in states), strict=True)]
    assert [values[name] for name in QUANTITIES[3:]] == pytest.approx(mean, rel=1e-14)
    assert half.theta.norm() > 0


def test_states_between_two_times_are_their_mean() -> None:
    kept = Recording(Companion(paper(4, 4)))
    arrays = [np.array(kept.at(time)[0].u.array) for time in (0.25, 0.5, 0.375)]
    assert arrays[2] == pytest.approx((arrays[0] + arrays[1]) / 2, abs=1e-15)
    assert np.array(kept.at(0.0)[0].u.array) == pytest.approx(0.0, abs=0)


def test_a_run_is_left_once_that_is_enough() -> None:
    kept = Recording(Companion(paper(4, 4)))
    run = Companion(paper(4, 8))
    found = kept.distance(run, lambda so_far: so_far.times == 3)
    assert found.times == 3 and run.time == 0.375 and not run.finished
    whole = Companion(paper(4, 8))
    assert kept.distance(whole, lambda _: False).times == 8 and whole.finished


def test_brief_runs_are_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, begun = paper(4, 4), []

    def again() -> Companion:
        begun.append(1)
        return Companion(scene)

    run = Companion(scene)
    march([run], [])
    assert seconds(run, again) <= run.seconds
    assert len(begun) == REPEATS - 1
    monkeypatch.setattr("warmslip.studies.recording.BRIEF", 0.0)
    assert seconds(run, partial(pytest.fail, "a long run is not repeated")) == run.seconds
