"""What accuracy costs: every method on a scene, a setting a point, against one reference that no method shares.

The reference is finer than every contestant and graded in space and time; its own error is estimated from the same on half its
mesh and steps. An error is the largest over the times that a run and the reference both reach.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from warmslip.records.tables import Row
from warmslip.scene.errors import SceneError
from warmslip.scene.reader import load
from warmslip.scene.scene import Scene
from warmslip.studies.companions import FUNCTIONALS, QUANTITIES, Companion, Distance, march
from warmslip.studies.error_norms import TERMS

Keys = dict[str, Any]
CORNERS: Keys = {"mesh.graded_to": ["corners"]}


def _equal(n: int, steps: int) -> Keys:
    return {"mesh.n": n, "time.steps": steps}


def _graded_steps(n: int, steps: int) -> Keys:
    return {"mesh.n": n, "time.steps": max(4, steps // 4), "time.graded_to": [0.0], "time.halvings": 8}


def _adaptive(n: int, steps: int) -> Keys:
    return {"mesh.n": n, "time.steps": 8, "time.tolerance": min(0.5, 16.0 / steps**2)}


# one name a method, from cells along a side and the number of equal steps that goes with them
METHODS: dict[str, Callable[[int, int], Keys]] = {
    "equal steps": _equal,
    "equal steps, lagged": lambda n, m: _equal(n, m) | {"time.coupling": "lagged"},
    "equal steps, monolithic": lambda n, m: _equal(n, m) | {"time.coupling": "monolithic"},
    "equal steps, gauss-2": lambda n, m: _equal(n, m) | {"contact.quadrature": "gauss-2"},
    "graded steps": _graded_steps,
    "adaptive steps": _adaptive,
    "graded mesh": lambda n, m: _equal(n, m) | CORNERS,
    "graded mesh and steps": lambda n, m: _graded_steps(n, m) | CORNERS,
    "graded mesh, adaptive steps": lambda n, m: _adaptive(n, m) | CORNERS,
}


@dataclass(frozen=True)
class Contest:
    """A scene with the methods that make sense for it, their levels, and the level of the reference.

    Attributes
    ----------
    scene
        Library scene and its overrides.
    levels
        Cells along the shortest side.
    ratio
        Equal steps for each of these cells.
    graded
        Whether mesh and steps of the reference are graded. Else it has equal steps.
    """

    scene: str
    keys: Keys
    methods: Sequence[str]
    levels: Sequence[int]
    reference: int
    ratio: int = 1
    graded: bool = True

    def at(self, method: str, n: int, finer: int = 1) -> Scene:
        """The scene of a method and a level, with so many times the steps."""
        scene = load(self.scene).override(**self.keys)
        unit = [count // min(scene.mesh.counts) for count in scene.mesh.counts]
        keys = METHODS[method](n, finer * self.ratio * n)
        return scene.override(**(keys | {"mesh.n": [one * n for one in unit]}))


HOT = {"contact.heat_exchange.foundation_temperature": 10.0}
FINER = 4  # steps of a reference for one of a contestant with as many cells
CONTESTS = {
    "paper_cold": Contest("paper_mixed", {}, list(METHODS), [8, 16, 24, 32, 64, 128], 256),
    "paper_hot": Contest("paper_mixed", HOT, list(METHODS), [8, 16, 24, 32, 64, 128], 256),
    "heat": Contest("heat_slab", {}, ["equal steps", "graded steps", "adaptive steps"], [4, 8, 16, 32], 64, ratio=8),
    "impact": Contest(
        "elastic_drop",
        {},
        ["equal steps", "adaptive steps", "equal steps, gauss-2"],
        [8, 16, 32],
        64,
        ratio=32,
        graded=False,
    ),
    "stick_slip": Contest(
        "sliding_block",
        {},
        ["equal steps", "graded steps", "adaptive steps"],
        [4, 8, 16, 32],
        64,
        ratio=16,
        graded=False,
    ),
    "block": Contest(
        "block_3d",
        {},
        ["equal steps", "graded steps", "adaptive steps", "graded mesh", "graded mesh and steps"],
        [4, 8, 12],
        20,
        ratio=2,
    ),
}


def run(contest: Contest, say: Callable[[str], None] = lambda _: None) -> list[Row]:
    """A row for every method and level, and two for the reference: `reference`, and `reference, half`, whose errors estimate its
    own. Raises RuntimeError when a run is rejected."""
    kind = "graded mesh and steps" if contest.graded else "equal steps"
    if contest.graded and "graded mesh and steps" not in contest.methods:
        kind = "graded steps"
    references = [contest.at(kind, n, FINER) for n in (contest.reference, contest.reference // 2)]
    finest = Companion(references[0])
    rows: list[Row] = []
    entries: list[tuple[str, int, Companion]] = [("reference, half", contest.reference // 2, Companion(references[1]))]
    for method in contest.methods:
        for n in contest.levels:
            try:
                entries.append((method, n, Companion(contest.at(method, n))))
            except (SceneError, ValueError) as why:
                say(f"{method}, n = {n}: {why}")
    say(f"{len(entries)} runs beside a reference of {len(finest.simulation.discretisation.mesh.cells)} cells")
    runs = [finest, *(entry[2] for entry in entries)]
    found, size = march(runs, [(0, i) for i in range(1, len(runs))], nested=False)
    for (method, n, companion), distance in zip(entries, found, strict=True):
        rows.append(row(method, n, companion, distance, size))
    rows.append(row("reference", contest.reference, finest, Distance(), size))
    return rows


def row(method: str, n: int, run: Companion, distance: Distance, size: dict[str, float]) -> Row:
    """What one run errs and costs. `work` counts numbers of the factors that were read or, in factorizations, operated on."""
    s = run.simulation.stepper
    cost, sizes = s.cost, max(1, len(run.simulation.pace.record.sizes))
    kept = max(1, sum(s.has_factored(k) for k in run.simulation.pace.record.sizes))
    entries = cost.factor_bytes / 8 / kept
    return (
        {"method": method, "n": n, "cells": len(run.simulation.discretisation.mesh.cells), "steps": cost.steps}
        | {f"e_{name}": distance.values[name] for name in QUANTITIES}
        | {"e_sum": sum(distance.values[name] for name in TERMS)}
        | {f"size_{name}": size[name] for name in (*TERMS, *FUNCTIONALS)}
        | {
            "times": distance.times,
            "cpu_seconds": run.seconds,
            "step_seconds": cost.step_seconds,
            "factor_bytes": cost.factor_bytes,
            "step_sizes": sizes,
            "rejected": run.simulation.pace.record.rejected,
            "substitutions": cost.substitutions,
            "factorizations": cost.factorizations,
            "newton_iterations": cost.newton_iterations,
            "work": 2 * cost.substitutions * entries + sizes * s.refactoring_price * 8 * entries,
        }
    )
