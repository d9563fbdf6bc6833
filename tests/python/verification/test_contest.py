"""The contest on a smooth solution: its errors are those of the manufactured study."""

from __future__ import annotations

import pytest

from warmslip.scene.full import full_model
from warmslip.scene.reader import load
from warmslip.studies.error_norms import TERMS
from warmslip.studies.tradeoff import KNOBS, METHODS
from warmslip.verification.mms import contest
from warmslip.verification.mms.manufactured import errors, slipping


def test_errors_are_those_of_the_manufactured_study() -> None:
    rows = contest.run((8, 16))
    found = {(row["method"], row["n"]): row for row in rows}
    assert {method for method, _ in found} == set(METHODS) - set(KNOBS)
    scene = full_model(load(contest.SCENE)).override(**{"mesh.n": 16, "time.steps": 16})
    known, simulation = errors(scene, slipping(scene))
    equal = found["equal steps", 16]
    for term in TERMS:
        assert equal[f"e_{term}"] == pytest.approx(known[term], rel=1e-12)
        assert equal[f"size_{term}"] > 3 * equal[f"e_{term}"]
    assert equal["e_sum"] == pytest.approx(sum(known[term] for term in TERMS), rel=1e-12)
    assert equal["steps"] == simulation.taken == 16
    for method in ("equal steps", "equal steps, monolithic", "adaptive steps"):
        assert found[method, 16]["e_sum"] < 0.7 * found[method, 8]["e_sum"]
    assert equal["setting"] == "--set mesh.n=16 --set time.steps=16"
