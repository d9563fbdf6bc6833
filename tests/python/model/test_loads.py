"""Loads as functions in Python: what they may give, and the sentence for what they may not."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Scene

Small = Callable[..., Scene]


def wrong(x: np.ndarray, t: float) -> Any:
    raise KeyError("force")


def late(x: np.ndarray, t: float) -> Any:
    return 1 / (t - 0.5) if t < 0.6 else {}["force"]


FUNCTIONS = {
    "loads.body": {"body": wrong},
    "heat.source": {"source": wrong},
    "loads.traction.left": {"traction": {"left": wrong}},
    "loads.heat_flux.bottom": {"heat_flux": {"bottom": wrong}},
    "supports.displacement.top": {"displacement": {"top": wrong}},
    "supports.temperature.top": {"temperature": {"top": wrong}},
    "contact_traction": {"contact_traction": wrong},
    "contact_flux": {"contact_flux": wrong},
    "contact.gap": {"gap": wrong},
    "contact.heat_exchange.foundation_temperature": {"foundation_temperature": wrong},
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_load_that_raises_is_named_with_its_time(small: Small, name: str) -> None:
    scene = small()
    with pytest.raises(ValueError, match=r"the function raised KeyError\('force'\); correct it") as refused:
        warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), **FUNCTIONS[name]))
    assert str(refused.value).startswith(f"{name} at t = ") and "\n" not in str(refused.value)
    assert isinstance(refused.value.__cause__, KeyError)


@pytest.mark.parametrize("per_pressure", [0.0, 1.0])
def test_a_foundation_temperature_is_named_however_it_acts(small: Small, per_pressure: float) -> None:
    scene = small(contact__heat_exchange__conductance=1.0 - per_pressure)
    scene = scene.override(**{"contact.heat_exchange.per_pressure": per_pressure})
    with pytest.raises(ValueError, match=r"foundation_temperature at t = 0.25: the function raised KeyError"):
        warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), foundation_temperature=wrong))


@pytest.mark.parametrize(
    ("load", "words"),
    [
        (lambda x, t: None, "loads.body at t = 0.25: the function gave None"),
        (lambda x, t: ["much", "more"], "loads.body at t = 0.25: ['much', 'more'] is no array of numbers"),
        (lambda x, t: np.zeros(3), "loads.body must give shape"),
    ],
)
def test_a_load_that_gives_no_numbers_is_named(small: Small, load: Any, words: str) -> None:
    scene = small()
    with pytest.raises(ValueError, match=re.escape(words)):
        warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), body=load))


def test_a_load_that_raises_later_ends_the_run_with_its_name(small: Small) -> None:
    scene = small(time__steps=5)
    done = warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), source=late))
    assert (done.outcome, done.summary["steps"]) == ("data_not_finite", 2)
    assert done.summary["failure"]["reason"].startswith("heat.source at t = 0.6: the function raised KeyError('force')")


def test_loads_of_another_kind_are_refused(small: Small) -> None:
    scene = small()
    loads = warmslip.Loads.of(scene)
    with pytest.raises(
        TypeError, match=re.escape("loads.traction: the function wrong is no dictionary; give it by part")
    ):
        replace(loads, traction=wrong)
    with pytest.raises(ValueError, match=r"loads.displacement: 'left' is not held \(top\); name it in the scene's"):
        warmslip.run(scene, loads=replace(loads, displacement={"left": [0.0, 1.0]}))  # which would do nothing
    with pytest.raises(ValueError, match=r"loads\.gap: a list of 2; give one for each of 1 contact parts"):
        warmslip.run(scene, loads=replace(loads, gap=[0.0, 1.0]))
    with pytest.raises(ValueError, match="backend 'fast' is unknown; use automatic, cholmod, petsc"):
        warmslip.run(scene, backend="fast")


def test_what_a_load_may_not_be(small: Small) -> None:
    loads = warmslip.Loads.of(small())
    with pytest.raises(TypeError, match=r"loads.body: '-1' is a text; formulas stand in the scene"):
        replace(loads, body="-1")
    with pytest.raises(TypeError, match=r"loads.traction: 't' is a text"):
        replace(loads, traction={"left": "t"})
    for body in (-1.0, lambda x, t: -1.0):
        with pytest.raises(ValueError, match=r"loads\.body is one number, -1, where 2 are due; give one for each axis"):
            warmslip.run(small(), loads=replace(loads, body=body))
    with pytest.raises(ValueError, match=r"(?s)loads.body at t = .* is complex; give real numbers"):
        warmslip.run(small(), loads=replace(loads, body=lambda x, t: x * 1j))
    with pytest.raises(TypeError, match="observers: 3 is no function"):
        warmslip.run(small(), observers=[3])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="resume: there is no folder to go on from; give out="):
        warmslip.run(small(), resume=True)


@pytest.mark.parametrize(
    ("without", "given"),
    [
        ("heat", {"source": 1e9}),
        ("heat", {"heat_flux": {"top": lambda x, t: x[:, 0]}}),
        ("motion", {"body": [0.0, -1.0]}),
        ("contact", {"gap": lambda x, t: x[:, 0]}),
    ],
)
def test_loads_that_no_field_takes_are_refused(without: str, given: dict[str, Any]) -> None:
    scene = {
        "heat": warmslip.load("quasistatic_punch"),
        "motion": warmslip.load("heat_slab"),
        "contact": warmslip.load("quasistatic_punch").override(contact=None),
    }[without]
    with pytest.raises(ValueError, match=rf"loads\.{next(iter(given))}: the scene has no \[.* nothing would take it"):
        warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), **given))


@pytest.mark.parametrize("points", [0, -1, 2.5, True, "3"])
def test_points_are_a_whole_number(points: Any) -> None:
    with pytest.raises(TypeError, match=r"loads.points: .*; give a whole number, at least 1"):
        warmslip.Loads(points=points)
