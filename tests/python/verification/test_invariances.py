"""The same problem in a mirror, in other units, with other numbers, restarted or carried along has the same answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

import warmslip
from warmslip import Scene
from warmslip.verification import invariances
from warmslip.verification.invariances import UNITS, Units

HOT = {"contact.heat_exchange.foundation_temperature": 10.0}
CHECKS: dict[str, Callable[[Scene], float]] = {
    "mirror": invariances.mirror_apart,
    "renumbering": invariances.renumbering_apart,
    "restart": invariances.restart_apart,
    "rigid velocity": invariances.rigid_velocity_apart,
}


def scene(name: str = "paper_mixed", **keys: Any) -> Scene:
    small = {"mesh.n": 3, "time.steps": 3} if name == "block_3d" else {"mesh.n": 6, "time.steps": 5}
    return warmslip.load(name).override(**small | HOT | {k.replace("__", "."): v for k, v in keys.items()})


def test_mirror_image() -> None:
    """The isotropic problem seen in a mirror, without the mesh's help: left diagonal, tractions exchanged and reversed."""
    one = warmslip.load("paper_isotropic").override(**{"mesh.n": 8, "time.steps": 8} | HOT)
    image = one.override(**{"mesh.diagonal": "left", "loads.traction": {"left": [0.8, 0.4], "right": [-1.4, 0.4]}})
    a, b = warmslip.run(one).summary, warmslip.run(image).summary
    assert a["norms"] == pytest.approx(b["norms"], rel=1e-12)
    assert [a["contact"][s] for s in ("open", "stick", "slip")] == [b["contact"][s] for s in ("open", "stick", "slip")]
    assert a["contact"]["traction"] == pytest.approx(
        [-b["contact"]["traction"][0], b["contact"]["traction"][1]], rel=1e-11
    )


@pytest.mark.parametrize("coupling", ["staggered", "lagged", "monolithic"])
@pytest.mark.parametrize("units", UNITS.values(), ids=UNITS)
def test_units(units: Units, coupling: str) -> None:
    """Units of powers of two change nothing but the exponents: no tolerance is hidden in an absolute number."""
    assert invariances.units_apart(scene(time__coupling=coupling), units) <= 1e-13


@pytest.mark.parametrize("name", ["paper_printed", "block_3d"])
@pytest.mark.parametrize("check", CHECKS.values(), ids=CHECKS)
def test_unchanged(name: str, check: Callable[[Scene], float]) -> None:
    assert check(scene(name, time__coupling="monolithic", initial__temperature=0.5)) <= invariances.ROUND_OFF


def test_what_should_change_the_answer_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scaling that forgets the gap, and a restart that comes a step late, are seen."""
    one, original = scene(contact__gap=1e-3), invariances.in_units
    monkeypatch.setattr(invariances, "in_units", lambda s, u: original(s, u).override(**{"contact.gap": 1e-3}))
    assert invariances.units_apart(one, Units(length=4)) > 1e-6
    monkeypatch.setattr(invariances, "in_units", lambda s, u: original(s, replace(u, temperature=1.0)))
    assert invariances.units_apart(one, Units(temperature=4)) > 1e-3
    monkeypatch.undo()
    monkeypatch.setattr(invariances, "finish", lambda s, *a, **k: _one_step_less(s))
    assert invariances.restart_apart(one) > 1e-3


def _one_step_less(one: Scene) -> dict[str, Any]:
    shorter = one.override(**{"time.end": one.time.end - one.step, "time.steps": one.time.steps - 1})
    result = warmslip.run(shorter)
    return {"u": result.u, "w": result.w, "theta": result.theta}


def test_every_invariance_has_a_line() -> None:
    lines = invariances.lines("paper_mixed", scene())
    assert len(lines) == 4 + len(UNITS) + len(CHECKS)
    assert all(line.passed for line in lines), [line for line in lines if not line.passed]


def test_a_run_that_is_not_right_is_said_so() -> None:
    with pytest.raises(RuntimeError, match="precision_lost"):
        invariances.restart_apart(scene(mesh__lengths=[1e-7, 1.0]))
