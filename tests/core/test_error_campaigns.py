"""The campaigns about errors in small: their yardsticks are what they say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from campaign import asked, effectivity

from warmslip.studies import ask
from warmslip.studies.pilots import Setting


def test_the_error_of_a_reference_is_added() -> None:
    assert asked._with("u_V", 0.3, 0.4) == pytest.approx(0.5)  # orthogonal in the energy norm
    assert asked._with("theta_L2", 0.3, 0.4) == pytest.approx(0.7)


def test_the_true_error_is_not_the_estimated_one() -> None:
    """It is found from finer runs: an answer that says too little of itself is seen."""
    answer = ask.solve(asked.scene(9, 10_000), 0.1)
    true = asked.true_error(answer)
    small = {name: dict.fromkeys(parts, 0.0) for name, parts in answer.parts.items()}
    bold = replace(answer, error=0.0, parts=small)  # its reference is taken to be exact
    assert 0.5 * true < asked.true_error(bold) < true <= 0.1


def test_the_best_of_a_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(asked, "GRID", {2: ([8, 16], [8, 16], 32)})
    one = asked.scene(9, 10_000)
    found = asked.best_of_grid(one, ["u_V", "theta_L2"], 0.3)
    assert found["best"] != "none" and 0 < found["best_seconds"] < 1
    assert found["least_error"] <= 0.3
    none = asked.best_of_grid(one, ["u_V", "theta_L2"], 0.01)
    assert none["best"] == "none" and none["best_seconds"] == np.inf and none["least_error"] == np.inf
    assert none["reference_error"] == pytest.approx(found["reference_error"], rel=1e-9)


def test_settings_of_one_kind_are_ordered() -> None:
    assert asked._within(Setting("graded", "equal", 8, 16), Setting("graded", "equal", 16, 16))
    assert not asked._within(Setting("graded", "equal", 8, 32), Setting("graded", "equal", 16, 16))
    assert not asked._within(Setting("uniform", "equal", 8, 8), Setting("graded", "equal", 16, 16))


def test_effectivities_are_estimates_over_true_errors() -> None:
    rows = {(row["quantity"], row["part"]): row for row in effectivity.lines("heat slab")}
    for row in rows.values():
        if np.isfinite(row["effectivity"]):
            assert row["effectivity"] == pytest.approx(row["estimated"] / row["true"])
    total = rows["theta_L2", "total"]
    assert 0.5 < total["effectivity"] < 3
    assert total["true"] < rows["theta_L2", "space"]["true"] + rows["theta_L2", "time"]["true"]


def test_the_summary_names_what_is_outside() -> None:
    def row(scene: str, ratio: float) -> dict[str, Any]:
        return {"scene": scene, "quantity": "u_V", "part": "total", "effectivity": ratio}

    text = effectivity.summary([row("a", 0.4), row("b", 1.0), row("c", 3.5), row("d", np.nan)])
    assert text.splitlines()[-1] == "| u_V | 3 | 0.4 | 1 | 3.5 | a 0.4; c 3.5 |"
