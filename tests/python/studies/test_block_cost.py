"""Every combination of blocks does the solves of the blocks it has and no others; its minimal step gives the same numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from petsc4py import PETSc
from support.processes import Command

from warmslip.report import cost as estimate
from warmslip.simulation.simulation import Simulation
from warmslip.studies import block_cost

FULL = block_cost.whole(4, 10)
ALL = list(block_cost.combinations())


def test_all_that_make_sense_once() -> None:
    assert len(ALL) == len({tuple(one.values()) for one in ALL}) == 110
    assert len({block_cost.scene(FULL, one).digest() for one in ALL}) == 110
    whole = {"motion": "viscoelastic", "contact": "friction", "heat": "both", "exchange": "exchange"}
    assert block_cost.scene(FULL, whole) == FULL


OPERATORS = ("inertia", "elasticity", "viscosity", "mass", "conductivity", "expansion", "heating", "exchange")


def expected(chosen: dict[str, str]) -> list[str]:
    """The operators that a choice has, from its words."""
    motion, heat = chosen["motion"], chosen["heat"]
    return [
        *["inertia"] * (motion in ("elastic", "viscoelastic")),
        *["elasticity"] * (motion != "none"),
        *["viscosity"] * motion.startswith("viscoelastic"),
        *["mass", "conductivity"] * (heat != "none"),
        *["expansion"] * (heat in ("expands", "both")),
        *["heating"] * (heat in ("heated", "both")),
        *["exchange"] * (chosen["exchange"] == "exchange"),
    ]


@pytest.mark.parametrize("chosen", ALL, ids=["; ".join(one.values()) for one in ALL])
def test_no_solve_for_what_is_absent(chosen: dict[str, str]) -> None:
    PETSc.Log.begin()
    product, counted = PETSc.Log.Event("MatMult"), Simulation(block_cost.scene(FULL, chosen))
    before = product.getPerfInfo()["count"]
    assert sum(1 for _ in counted.steps()) == 10
    products = product.getPerfInfo()["count"] - before
    simulation = Simulation(block_cost.scene(FULL, chosen))
    there = [name for name in OPERATORS if getattr(simulation.discretisation.operators, name) is not None]
    estimates = counted.stepper.cost.estimates * sum(
        name in there for name in ("elasticity", "viscosity", "heating", "expansion")
    )
    assert products == 10 * len(there) + estimates and there == sorted(expected(chosen), key=OPERATORS.index)
    minimal = block_cost.MinimalStep(simulation)
    for _ in simulation.steps():
        minimal.step()
    assert simulation.outcome == "completed" and simulation.taken == 10
    cost, fields = simulation.stepper.cost, [chosen["motion"] != "none", chosen["heat"] != "none"]
    assert (cost.substitutions, cost.factorizations, cost.refinements) == (10 * sum(fields), sum(fields), 0)
    assert (cost.newton_iterations > 0) == (chosen["contact"] != "none")
    assert (cost.momentum_seconds > 0, cost.heat_seconds > 0) == tuple(fields)
    if chosen["contact"] == "none":
        assert cost.contact_seconds == 0 and len(simulation.discretisation.surface.weights) == 0
        k = FULL.step
        for name, factor in (("u", 1.0), ("w", k), ("theta", 1.0)):  # a velocity that dies out is the rounding of u / k
            exact, found = getattr(simulation.stepper, name), getattr(minimal, name)
            assert (exact is None) == (found is None)
            if exact is not None:
                size = np.abs(exact.array if name == "theta" else simulation.stepper.u.array).max()
                assert factor * np.abs(exact.array - found.array).max() <= 1e-13 * size > 0, name


def test_the_command_writes_both_tables(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(estimate, "library", lambda: ["heat_slab"])
    (row,) = estimate.table(repeats=1)
    assert row["scene"] == "heat_slab" and row["predicted_s"] > 0 and row["measured_s"] > 0
    monkeypatch.setattr(block_cost, "combinations", lambda: iter(ALL[-2:]))
    for row in block_cost.table(4, 20):
        assert (row["unknowns"], row["substitutions"], row["refinements"]) == (75, 2, 0)
        assert row["products"] == len(expected(row)) and {k: row[k] for k in ALL[0]} in ALL
        assert 0 < row["least"] < row["step"] < 10 * row["whole_model"]
        assert row["contact_solver"] > 0 and row["balances"] > 0
        for name in ("over_whole_model", "linear_over_minimal", "step_over_minimal"):
            assert 0 < row[f"{name}_lower"] <= row[name] <= row[f"{name}_upper"]
    wrong = command("blocks", "--out", "a.csv", "--explained", "b.csv", "--n", "4", "--steps", "7")
    assert wrong.returncode == 2 and "no multiple of 5" in wrong.stderr


def test_the_ratios_are_those_of_the_seconds_given() -> None:
    """A step of 10 with 2 in contact and 3 in its balances, least code of 4, a whole model of 20; one disturbed step in five."""
    calm = {"step": 10.0, "whole_model": 20.0, "contact_solver": 2.0, "balances": 3.0, "least": 4.0}
    seconds = {name: np.full(40, value) for name, value in calm.items()}
    seconds["step"][::5] = 1000
    seconds["step"][:5] = 7777  # the first turn
    settled = {name: block_cost.settled(list(values)) for name, values in seconds.items()}
    assert {len(values) for values in settled.values()} == {28}
    found = block_cost.ratios(**settled)
    for name, value in (("over_whole_model", 0.5), ("linear_over_minimal", 1.25), ("step_over_minimal", 10 / 6)):
        assert [found[name + end] for end in ("_lower", "", "_upper")] == pytest.approx([value] * 3)
    rising = block_cost.ratios(**settled | {"step": np.linspace(10, 14, 28)})
    assert rising["over_whole_model_lower"] == pytest.approx(0.55) and rising[
        "over_whole_model_upper"
    ] == pytest.approx(0.65)
