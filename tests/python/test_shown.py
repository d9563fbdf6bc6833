"""Objects in a prompt and in a notebook: a line or a small table of what matters; the public names are listed."""

from __future__ import annotations

from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Scene
from warmslip.scene.plan import plan
from warmslip.simulation.summary import numbers

Small = Callable[..., Scene]


def test_every_public_name_is_listed() -> None:
    assert set(warmslip.__all__) <= set(dir(warmslip)) and "annotations" not in dir(warmslip)


def test_an_object_shows_a_line_and_a_table(small: Small, tmp_path: Path) -> None:
    scene = small(title="A <b>warm</b> block")
    simulation = warmslip.Simulation(scene)
    state, _ = next(simulation.steps())
    result = warmslip.run(scene, out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        open_file = repr(stored)
        contact = stored.contact_on()
    largest, normal = result.summary["largest"], result.summary["contact"]["normal_force"]
    shown: list[tuple[Any, tuple[str, ...]]] = [
        (scene, ("'A <b>warm</b> block'", "4 x 4 cells", "4 steps to t = 1", "on 'bottom'")),
        (simulation, ("steps 1 of 4", "t = 0.25 of 1", "under way")),
        (simulation.discretisation, ("nodes 25", "cells 32", "unknowns 75", "contact points 5")),
        (state, ("step 1", "t = 0.25", "displacement, velocity, temperature")),
        (result, ("completed, 4 steps", f"{largest['pressure']:.3g}", f"normal force {normal:.3g}", str(tmp_path))),
        (stored, ("closed",)),
        (contact, ("part 'bottom'", "t = 1", "points 5")),
        (plan(scene), ("displacement u and velocity w",)),
    ]
    for thing, words in shown:
        line = repr(thing)
        assert len(line) < 500 and "\n" not in line and line.startswith(f"<{type(thing).__name__}: "), line
        for word in words:
            assert word in line, f"{word} is not in {line}"
        table = thing._repr_html_()
        assert "<b>" not in table and table.count("<tr>") == table.count("</tr>") >= 3
        HTMLParser().feed(table)
    assert "steps 4" in open_file and "states 5 to t = 1" in open_file


def test_a_run_that_stopped_says_so(small: Small) -> None:
    simulation = warmslip.Simulation(small(loads__body=["1 / (t - 0.5)", 0.0]))
    assert len(list(simulation.steps())) == 1 and "state data_not_finite" in repr(simulation)


def test_numbers_are_those_of_the_last_state(small: Small) -> None:
    seen: list[tuple[float, ...]] = []

    def look(state: warmslip.State, _: object) -> None:
        size, contact = np.linalg.norm(state.u, axis=1), state.contact_on()
        seen.append((size.max(), state.mises.max(), state.theta.max(), state.theta.min(), contact.pressure.max()))

    found = warmslip.run(small(), observers=[look]).summary
    keys = ("displacement", "von_mises", "temperature", "lowest_temperature", "pressure")
    assert [found["largest"][key] for key in keys] == pytest.approx(seen[-1], rel=1e-12)
    words = numbers(found)
    counts = found["contact"]
    assert words["contact points"] == (
        f"5 ({20 * counts['open']} % open, {20 * counts['stick']} % stick, {20 * counts['slip']} % slip)"
    )
    assert words["temperature"] == f"{seen[-1][3]:.3g} to {seen[-1][2]:.3g}"
    assert "largest pressure" not in numbers(warmslip.run(warmslip.load("heat_slab", ["time.steps=2"])).summary)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({}, "mesh: missing; add it\ntime: missing; add it"),
        ({"mesh": {"n": -1}, "time": {}}, "mesh.n = -1: "),
        ({"mesh": {}, "time": {}, "elastcity": {}}, "elastcity: unknown key; did you mean 'elasticity'?"),
        ({"mesh": {}, "time": {}}, "there is neither motion nor heat"),
    ],
)
def test_a_scene_that_cannot_be_is_refused_in_the_same_words(tables: dict[str, object], words: str) -> None:
    with pytest.raises(warmslip.SceneError) as refused:
        Scene(**tables)
    from warmslip.scene.reader import build

    with pytest.raises(warmslip.SceneError) as read:
        build(dict(tables))
    assert str(refused.value) == str(read.value)
    assert words in str(refused.value)
