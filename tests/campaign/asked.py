"""Errors that are asked for, on random scenes: whether the answers have them, and whether the choices are cheap.

Each scene is solved for a target. The true error of the answer is its distance to a run with twice the cells and four times the
steps. A grid of settings of every kind is run against one reference; the cheapest of those that meet the target is what the
choice is compared with. `python tests/campaign/asked.py --count 40` takes a quarter of an hour on one core.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.records import tables
from warmslip.scene.errors import SceneError
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene
from warmslip.studies import ask
from warmslip.studies.companions import Companion, march
from warmslip.studies.pilots import MESHES, STEPS, Pilots, Setting
from warmslip.studies.refinement_study import stamp

TARGETS = {2: 0.1, 3: 0.25}
GRID = {2: ([8, 16, 32], [8, 32, 64], 48), 3: ([4, 8, 12], [4, 16], 16)}  # cells, counts, cells of the reference


def scene(number: int) -> Scene:
    """A random scene: in the plane or in space, with or without heat, friction, viscosity and inertia."""
    random = np.random.default_rng(10_000 + number)
    d = 3 if random.random() < 0.2 else 2
    sides = ["left", "right", "top"] + ["front", "back"] * (d == 3)
    has = {
        name: bool(random.random() < share)
        for name, share in (("heat", 0.6), ("friction", 0.7), ("viscosity", 0.7), ("inertia", 0.7))
    }

    def size(low: float, high: float) -> float:
        return float(10 ** random.uniform(low, high))

    stiff = size(0.5, 1.5)
    data: dict[str, Any] = {
        "mesh": {"shape": "cube" if d == 3 else "square", "n": 8},
        "time": {"end": 1.0, "steps": 8},
        "elasticity": {"lame": [stiff, stiff * float(random.uniform(0.3, 1.0))]},
        "supports": {"displacement": ["top"]},
        "loads": {
            "body": [*(float(random.uniform(-0.5, 0.5)) for _ in range(d - 1)), -float(random.uniform(0.2, 1.0))],
            "traction": {str(random.choice(["left", "right"])): [float(random.uniform(-0.5, 0.5)) for _ in range(d)]},
        },
        "contact": {"part": "bottom", "stiffness": size(1.0, 3.0)},
    }
    if random.random() < 0.4:  # a load that grows
        data["loads"]["body"] = [f"{value} * t" for value in data["loads"]["body"]]
    if has["friction"]:
        data["contact"]["friction"] = {"coefficient": float(random.uniform(0.1, 0.8))}
    if has["viscosity"]:
        data["viscosity"] = {"lame": [stiff * size(-1.5, 0), stiff * size(-1.5, 0)]}
    if has["inertia"]:
        data["inertia"] = {"density": size(-1.0, 0.5)}
    if has["heat"]:
        data["heat"] = {"conductivity": size(-1.0, 0.5), "source": float(random.uniform(0, 2))}
        if random.random() < 0.6:
            m = float(random.uniform(0.1, 0.5))
            data["heat"] |= {"expansion": {"tensor": m}, "heating": {"tensor": -m}}
        data["supports"]["temperature"] = [str(random.choice(sides))]
        data["contact"]["heat_exchange"] = {
            "conductance": size(-0.5, 1.0),
            "foundation_temperature": float(random.uniform(0, 10)),
        }
    return build(data)


def true_error(answer: ask.Answer) -> float:
    """The relative error of an answer, against twice its cells and four times its steps."""
    one = answer.scene
    finer: dict[str, Any] = {"mesh.n": [2 * n for n in one.mesh.counts]}
    if one.time.tolerance is None:
        finer["time.steps"] = 4 * one.time.steps
    else:
        finer["time.tolerance"] = one.time.tolerance / 16
    (distance,), size = march([Companion(one.override(**finer)), Companion(one)], [(0, 1)])
    return max(distance.values[name] / size[name] for name in answer.plan.quantities)


def best_of_grid(one: Scene, quantities: list[str], target: float) -> tuple[float, str]:
    """CPU seconds and name of the cheapest setting of a grid that meets the target; infinite for none."""
    d = one.mesh.dim
    pilots = Pilots(one, quantities, lambda _: None)
    cells, counts, finest = GRID[d]
    reference = pilots.companion(Setting("graded", "graded", finest, 4 * max(counts)))
    entries: list[tuple[Setting, Companion]] = []
    for mesh in MESHES:
        for steps in STEPS:
            for n in cells:
                for count in counts:
                    setting = Setting(mesh, steps, n, count)
                    try:
                        entries.append((setting, pilots.companion(setting)))
                    except (SceneError, ValueError):  # a mesh that is too coarse to be graded
                        continue
    runs = [reference, *(run for _, run in entries)]
    found, size = march(runs, [(0, i) for i in range(1, len(runs))], nested=False)
    cost, name = np.inf, "none"
    for (setting, run), distance in zip(entries, found, strict=True):
        error = max(distance.values[q] / size[q] for q in quantities)
        if error <= target and run.seconds < cost:
            cost, name = run.seconds, f"{setting.mesh} {setting.cells}, {setting.steps} {setting.count}"
    return cost, name


def row(number: int) -> dict[str, Any]:
    """One scene: what was asked for, estimated and true, and what it cost against the best of the grid."""
    one = scene(number)
    target = TARGETS[one.mesh.dim]
    there = "+".join(name for name in ("heat", "viscosity", "inertia") if getattr(one, name) is not None)
    line: dict[str, Any] = {"scene": number, "dim": one.mesh.dim, "tables": there or "elasticity", "asked": target}
    blank = {
        "estimated": np.nan,
        "true": np.nan,
        "seconds": np.nan,
        "all_seconds": np.nan,
        "choice": "",
        "best_seconds": np.nan,
        "best": "",
    }
    try:
        answer = ask.solve(one, target, seconds=30.0)
    except (SceneError, RuntimeError) as why:
        return line | blank | {"outcome": str(why).replace("\n", " ")}
    again = Companion(answer.scene)
    march([again], [])
    cost, name = best_of_grid(one, answer.plan.quantities, target)
    setting = answer.tries[-1].setting
    return line | {
        "estimated": answer.error,
        "true": true_error(answer),
        "seconds": again.seconds,
        "all_seconds": answer.seconds,
        "choice": f"{setting.mesh} {setting.cells}, {setting.steps} {setting.count}",
        "best_seconds": cost,
        "best": name,
        "outcome": "solved",
    }


def main() -> None:
    """Runs the scenes and writes the table after each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--out", type=Path, default=Path("results/tradeoff/asked.csv"))
    given = parser.parse_args()
    rows = []
    for number in range(given.first, given.first + given.count):
        rows.append(row(number))
        print(rows[-1], flush=True)
        tables.write(given.out, rows, stamp(None, targets=list(TARGETS.values())))
    solved = [one for one in rows if one["outcome"] == "solved"]
    met = sum(one["true"] <= one["asked"] for one in solved)
    cheap = sum(one["seconds"] <= 2 * one["best_seconds"] for one in solved)
    print(
        f"{len(solved)} of {len(rows)} solved, {met} true errors below the target, {cheap} within twice the best of the grid"
    )


if __name__ == "__main__":
    main()
