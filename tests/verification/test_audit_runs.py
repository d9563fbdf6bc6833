"""Runs that could contradict the audit: they agree on small grids, and each check turns red where it should."""

from __future__ import annotations

import pytest

import warmslip
from warmslip import Scene
from warmslip.verify import audit_runs


def small(reading: str = "mixed", n: int = 8, **keys: object) -> Scene:
    values = {"mesh.n": n, "time.steps": n} | {k.replace("__", "."): v for k, v in keys.items()}
    return warmslip.load(f"paper_{reading}").override(**values)


@pytest.mark.parametrize("reading", audit_runs.READINGS)
def test_energy_decays_without_loads(reading: str) -> None:
    assert -1 < audit_runs.growth(small(reading)) < 0


def test_energy_that_grows_is_seen() -> None:
    strong = [[30.0, 0.0], [0.0, 30.0]]
    assert audit_runs.growth(small("isotropic", heat__expansion__tensor=strong, heat__heating__tensor=strong)) > 0.1


def test_two_methods_give_one_answer() -> None:
    hot = {"contact__heat_exchange__foundation_temperature": 10.0}
    assert audit_runs.other_answer(small(**hot)) <= 1e-10
    with pytest.raises(RuntimeError, match="without Newton ended"):
        audit_runs.other_answer(small(contact__stiffness=1e9, **hot))


def test_the_audit_makes_its_claims() -> None:
    """An audit that proved nothing would leave nothing to contradict: what it must claim of the paper's data is a line too."""
    lines = list(audit_runs.lines("mixed", (8, 16)))
    assert [line.case for line in lines if "audit of" in line.case] == [
        "mixed, audit of coupling, energy",
        "mixed, audit of coupling, staggered step",
        "mixed, audit of friction, one answer a step",
    ]
    assert len(lines) == 9
    assert [line.case for line in lines[:5] if not line.passed] == []


def test_successive_grids_have_no_bias() -> None:
    """A singular K leaves the temperature the order 1/2; against one fine solution it would show 0.98 here."""
    found = audit_runs.orders(small("printed"), (16, 32))
    assert found["theta_L2"] == pytest.approx(0.49, abs=0.02)
    assert found["u_V"] == pytest.approx(0.73, abs=0.02)
