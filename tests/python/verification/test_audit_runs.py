"""Runs that could contradict the audit: they agree on small grids, and each check turns red where it should."""

from __future__ import annotations

import pytest

import warmslip
from warmslip import Scene
from warmslip.verification.assumptions import runs
from warmslip.verification.assumptions.findings import Finding


def small(reading: str = "mixed", n: int = 8, **keys: object) -> Scene:
    values = {"mesh.n": n, "time.steps": n} | {k.replace("__", "."): v for k, v in keys.items()}
    return warmslip.load(f"paper_{reading}").override(**values)


@pytest.mark.parametrize("reading", runs.READINGS)
def test_energy_decays_without_loads(reading: str) -> None:
    assert -1 < runs.growth(small(reading)) < 0


def test_energy_that_grows_is_seen() -> None:
    strong = [[30.0, 0.0], [0.0, 30.0]]
    assert runs.growth(small("isotropic", heat__expansion__tensor=strong, heat__heating__tensor=strong)) > 0.1


def test_two_methods_give_one_answer() -> None:
    hot = {"contact__heat_exchange__foundation_temperature": 10.0}
    for stiffness in (1e4, 1e9, 1e15):
        assert runs.other_answer(small(contact__stiffness=stiffness, **hot)) <= 1e-10


def test_the_audit_makes_its_claims(monkeypatch: pytest.MonkeyPatch) -> None:
    """An audit that proved nothing would leave nothing to contradict: that is refused."""
    lines = list(runs.lines("mixed", (8, 16)))
    assert len(lines) == 6
    assert [line.case for line in lines[:2] if not line.passed] == []
    monkeypatch.setattr(runs, "find", lambda found, topic: Finding(topic, "", (), "no", ""))
    with pytest.raises(ValueError, match="the audit of mixed does not claim coupling, energy and"):
        list(runs.lines("mixed", (8, 16)))


def test_successive_grids_have_no_bias() -> None:
    """A singular K leaves the temperature the order 1/2; against one fine solution it would show 0.98 here."""
    found = runs.orders(small("printed"), (16, 32))
    assert found["theta_L2"] == pytest.approx(0.49, abs=0.02)
    assert found["u_V"] == pytest.approx(0.73, abs=0.02)
