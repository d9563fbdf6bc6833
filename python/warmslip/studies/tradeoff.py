"""What accuracy costs: every method on a scene, a setting a point, against one reference that no method shares.

The reference is finer than every contestant and graded where that helps; its own error is estimated from the same on half its
mesh and steps. An error is the largest over all times of a run; between two of its own, the reference lies on the straight line.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from warmslip.records.tables import Row
from warmslip.scene.errors import SceneError
from warmslip.scene.reader import load
from warmslip.scene.scene import Scene
from warmslip.studies.companions import FUNCTIONALS, QUANTITIES, Companion, Distance
from warmslip.studies.error_norms import TERMS
from warmslip.studies.recording import Recording, seconds

Keys = dict[str, Any]
COMPLETED, NAN = "completed", float("nan")  # outcome of a run; a number that it does not have
CORNERS: Keys = {"mesh.graded_to": ["corners"]}


def _equal(n: int, steps: int) -> Keys:
    return {"mesh.n": n, "time.steps": steps}


def _graded_steps(n: int, steps: int) -> Keys:
    return {"mesh.n": n, "time.steps": max(4, steps // 4), "time.graded_to": [0.0], "time.halvings": 8}


def _more_graded_steps(n: int, steps: int) -> Keys:
    return {"mesh.n": n, "time.steps": max(4, steps), "time.graded_to": [0.0], "time.halvings": 6}


def _fewer_graded_steps(n: int, steps: int) -> Keys:
    return {"mesh.n": n, "time.steps": max(4, 3 * steps // 4), "time.graded_to": [0.0], "time.halvings": 5}


def _adaptive(n: int, steps: int, factor: float = 16.0) -> Keys:
    return {"mesh.n": n, "time.steps": 8, "time.tolerance": min(0.5, factor / steps**2)}


# one name a method, from cells along a side and the number of equal steps that goes with them
METHODS: dict[str, Callable[[int, int], Keys]] = {
    "equal steps": _equal,
    "equal steps, lagged": lambda n, m: _equal(n, m) | {"time.coupling": "lagged"},
    "equal steps, monolithic": lambda n, m: _equal(n, m) | {"time.coupling": "monolithic"},
    "equal steps, gauss-2": lambda n, m: _equal(n, m) | {"contact.quadrature": "gauss-2"},
    "equal steps, soft foundation": lambda n, m: _equal(n, m) | {"contact.stiffness": 1e3},
    "equal steps, rigid foundation": lambda n, m: _equal(n, m) | {"contact.stiffness": "rigid"},
    "equal steps, regularised friction": lambda n, m: _equal(n, m) | {"contact.friction.regularisation": 1e-2},
    "graded steps": _graded_steps,
    "more graded steps": _more_graded_steps,
    "adaptive steps": _adaptive,
    "adaptive steps, smaller tolerance": lambda n, m: _adaptive(n, m, 4.0),
    "graded mesh": lambda n, m: _equal(n, m) | CORNERS,
    "graded mesh and steps": lambda n, m: _graded_steps(n, m) | CORNERS,
    "graded mesh, more graded steps": lambda n, m: _more_graded_steps(n, m) | CORNERS,
    "graded mesh, fewer graded steps": lambda n, m: _fewer_graded_steps(n, m) | CORNERS,
    "graded mesh, adaptive steps": lambda n, m: _adaptive(n, m) | CORNERS,
}


SHORT_STEPS = (
    "more graded steps",
    "adaptive steps, smaller tolerance",
    "graded mesh, more graded steps",
    "graded mesh, fewer graded steps",
)


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
    kind
        The method of the reference.
    """

    scene: str
    keys: Keys
    methods: Sequence[str]
    levels: Sequence[int]
    reference: int
    ratio: int = 1
    kind: str = "graded mesh and steps"

    def keys_of(self, method: str, n: int, finer: int = 1) -> Keys:
        """What a method and a level set in the library scene, with so many times the steps."""
        counts = load(self.scene).override(**self.keys).mesh.counts
        unit = [count // min(counts) for count in counts]
        cells = [one * n for one in unit]
        return self.keys | METHODS[method](n, finer * self.ratio * n) | {"mesh.n": cells if len(set(cells)) > 1 else n}

    def at(self, method: str, n: int, finer: int = 1) -> Scene:
        """The scene of a method and a level."""
        return load(self.scene).override(**self.keys_of(method, n, finer))

    def typed(self, method: str, n: int, finer: int = 1) -> str:
        """The same as it is typed in a shell."""
        keys = (f"--set {shlex.quote(f'{key}={value}')}" for key, value in self.keys_of(method, n, finer).items())
        return " ".join([f"warmslip run {self.scene}", *keys])


# another model in the place of the scene's: what it is off stays, however fine the mesh
KNOBS = ["equal steps, soft foundation", "equal steps, rigid foundation", "equal steps, regularised friction"]
STEPPING = ["equal steps", "graded steps", "more graded steps", "adaptive steps", "adaptive steps, smaller tolerance"]
HOT = {"contact.heat_exchange.foundation_temperature": 10.0}
LEVELS = [8, 16, 20, 24, 32, 40, 48, 64, 128]  # of the paper's problem
WORTH = 0.9  # ratio of errors from which on a dearer setting is worth a line of the front
NEAR = 3  # cells of a reference for one of a contestant with short steps
FINER = 4  # steps of a reference for one of a contestant with as many cells
CONTESTS = {
    "paper_cold": Contest("paper_mixed", {}, list(METHODS), LEVELS, 192),
    "paper_hot": Contest("paper_mixed", HOT, list(METHODS), LEVELS, 192),
    "heat": Contest("heat_slab", {}, STEPPING, [4, 8, 16, 32], 64, ratio=8, kind="graded steps"),
    "impact": Contest(
        "elastic_drop",
        {},
        ["equal steps", "adaptive steps", "adaptive steps, smaller tolerance", "equal steps, gauss-2"],
        [8, 16, 32],
        64,
        ratio=32,
        kind="equal steps",
    ),
    "stick_slip": Contest(
        "sliding_block",
        {},
        [*STEPPING, *KNOBS],
        [4, 8, 16, 32],
        64,
        ratio=16,
        kind="more graded steps",  # equal ones pass over a first impact
    ),
    "block": Contest(
        "block_3d",
        {},
        [*STEPPING, "graded mesh", "graded mesh and steps", *KNOBS],
        [4, 8, 12],
        20,
        ratio=2,
    ),
}


def run(contest: Contest, say: Callable[[str], None] = lambda _: None) -> list[Row]:
    """A row for every method and level, and two for the reference: `reference`, and `reference, half`, whose errors estimate its
    own. A run that stops has a row without numbers, whose `outcome` says why.

    Raises RuntimeError when the reference is rejected.
    """
    kind = contest.kind
    reference = Recording(Companion(contest.at(kind, contest.reference, FINER)))
    cells = len(reference.run.simulation.discretisation.mesh.cells)
    say(
        f"a reference of {cells} cells and {reference.run.simulation.taken} steps: {reference.run.seconds:.3g} s of CPU"
    )
    half = contest.reference // 2
    entries = [("reference, half", half, contest.at(kind, half, FINER), contest.typed(kind, half, FINER))]
    for method in contest.methods:
        for n in contest.levels:
            if method in SHORT_STEPS and NEAR * n > contest.reference:
                continue  # its steps come near to those of the reference
            try:
                entries.append((method, n, contest.at(method, n), contest.typed(method, n)))
            except (SceneError, ValueError) as why:
                say(f"{method}, n = {n}: {why}")
    found = {}
    for method, n, scene, _ in sorted(
        entries, key=lambda entry: entry[2].mesh.model_dump_json()
    ):  # a mesh is located once
        run, outcome = Companion(scene), COMPLETED
        try:
            distance = reference.distance(run)
            cost = seconds(run, partial(Companion, scene))
        except RuntimeError as why:
            distance, cost, outcome = Distance(dict.fromkeys(QUANTITIES, NAN)), NAN, str(why)
            say(f"{method}, n = {n}: {why}")
        found[method, n] = row(method, n, run, distance, reference.size, cost) | {"outcome": outcome}
    own = row("reference", contest.reference, reference.run, Distance(), reference.size, reference.run.seconds)
    finest = contest.typed(kind, contest.reference, FINER)
    return [
        *(found[method, n] | {"setting": typed, "from_ours": 0.0} for method, n, _, typed in entries),
        own | {"outcome": COMPLETED, "setting": finest, "from_ours": 0.0},
    ]


def front(contest: str, rows: Sequence[Row], quantity: str) -> list[Row]:
    """The settings that err less than every cheaper one by a tenth, cheapest first, with what is typed for them.

    Settings that change the model of the scene have no place in it.

    `gain` compares with the cheapest equal steps that err no more; it is nan where none do.
    """
    own = [
        row for row in rows if row["method"] in {*METHODS} - {*KNOBS} and row["cpu_seconds"] > 0 and row[quantity] > 0
    ]
    best: list[Row] = []
    least = float("inf")  # of all that are cheaper
    for row in sorted(own, key=lambda row: row["cpu_seconds"]):
        if row[quantity] < WORTH * least:
            best.append(row)
        least = min(least, row[quantity])
    equal = [row for row in own if row["method"] == "equal steps"]

    def gain(row: Row) -> float:
        as_good = [other["cpu_seconds"] for other in equal if other[quantity] <= row[quantity]]
        return min(as_good) / row["cpu_seconds"] if as_good else NAN

    return [
        {"contest": contest, "quantity": quantity}
        | {name: row[name] for name in ("method", "n", "cells", "steps")}
        | {"error": row[quantity]}
        | {name: row[name] for name in ("cpu_seconds", "factor_bytes", "work")}
        | {"gain": gain(row), "setting": row["setting"]}
        for row in best
    ]


def row(method: str, n: int, run: Companion, distance: Distance, size: dict[str, float], cost_seconds: float) -> Row:
    """What one run errs, and costs in CPU seconds.

    `work` counts numbers of the factors that were read or, in factorizations, operated on.
    """
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
            "cpu_seconds": cost_seconds,
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
