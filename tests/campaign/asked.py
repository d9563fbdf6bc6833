"""Errors that are asked for, on random scenes: whether the answers have them, and whether the choices are cheap.

Each scene is solved for a target. The true error of the answer is its distance to a finer run, and what that run errs itself. A
grid of settings of every kind is run against one reference; the cheapest of those that meet the target is what the choice is
compared with. The 31 scenes in the plane (`--dim 2`) take a quarter of an hour, those in space as long and three gigabytes.
"""

from __future__ import annotations

import argparse
import itertools
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.records import tables
from warmslip.scene.errors import SceneError
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene
from warmslip.studies import ask, rates
from warmslip.studies.companions import Companion, Distance, march
from warmslip.studies.error_estimate import JUMPS, orders, richardson
from warmslip.studies.pilots import MESHES, STEPS, Pilots, Setting
from warmslip.studies.recording import Recording, seconds
from warmslip.studies.refinement_study import stamp

SEED = 20_000  # scenes of 10_000 had a part in the choice of a factor (error_estimate.py)
TARGETS = {2: 0.1, 3: 0.25}
SECONDS = {2: 5.0, 3: 30.0}  # CPU seconds that are allowed
# cells, counts, cells of the reference
GRID = {2: ([16, 24, 40], [8, 32, 64], 48), 3: ([4, 8, 12], [4, 16], 16)}
CELLS = {2: 2.0, 3: 1.5}  # of the reference of an answer for one of its own, along a side
NESTED = 12  # cells up to which it has twice as many
SHORTER = {2: 4, 3: 2}  # steps of a reference for one of an answer, or of the largest count of the grid
LONGEST = {2: 1.0, 3: 5.0}  # CPU seconds of a setting of the grid
UNSURE = 1.5  # factor between the seconds of two runs that may be one
FAR = 2.0  # targets from which on an error does not matter


def scene(number: int, seed: int = SEED) -> Scene:
    """A random scene: in the plane or in space, with or without heat, friction, viscosity and inertia."""
    random = np.random.default_rng(seed + number)
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
    """The relative error of an answer over all its steps, against `CELLS` times its cells and `SHORTER` times its steps.

    What that run errs itself is added: the estimated parts of the answer, reduced by the orders that its pilots showed.
    """
    one, setting, orders = answer.scene, answer.tries[-1].setting, answer.plan.orders
    (n, *_), many = one.mesh.counts, SHORTER[one.mesh.dim]
    # a graded mesh is made from half of its cells; distances of meshes that are not nested are too large
    cells = 2 * n if n <= NESTED else 2 * round(CELLS[one.mesh.dim] * n / 2)
    ratio = cells / n
    finer: dict[str, Any] = {"mesh.n": cells}
    if one.time.tolerance is not None:
        reference = Recording(Companion(one.override(**(finer | {"time.tolerance": one.time.tolerance / many**2}))))
        found, size = reference.distance(Companion(one)), reference.size
    else:  # the times of the finer run contain those of the answer
        fine = one.override(**(finer | {"time.steps": many * one.time.steps}))
        (found,), size = march([Companion(fine), Companion(one)], [(0, 1)], nested=ratio == 2)
    worst = 0.0
    for name, parts in answer.parts.items():
        p, q = orders[f"{setting.mesh} mesh"][name], orders[f"{setting.steps} steps"][name]
        own = parts["space"] * ratio**-p + parts["time"] * many**-q
        worst = max(worst, _with(name, found.values[name] / (size[name] or 1.0), own))
    return worst


def _with(name: str, distance: float, own: float) -> float:
    """An error from the distance to a reference that errs by `own`; in the energy norm the two are orthogonal."""
    return float(np.hypot(distance, own)) if name in rates.QUADRATIC else distance + own


def _relative(found: Distance, reference: Recording, own: dict[str, float]) -> float:
    """The largest relative error, for a reference whose relative errors are `own`."""
    size = reference.size
    return max(_with(name, found.values[name] / (size[name] or 1.0), error) for name, error in own.items())


def best_of_grid(one: Scene, quantities: list[str], target: float) -> dict[str, Any]:
    """The cheapest setting of a grid that meets the target, the smallest error there is, and that of the reference.

    The error of the reference follows from its distance to half of it, as of order one, or of that in time of waves that jump. It
    is a part of every error.
    Settings are run from small to large, each until its error is far from the target, or it has taken much longer than the
    cheapest that met it. Those that would for sure are left out: a run of their kind with no more cells and steps did. Those that
    met the target in about the least time are run again, alone. `least_error` is infinite where all errors are far.
    """
    cells, counts, finest = GRID[one.mesh.dim]
    pilots = Pilots(one, quantities, lambda _: None)
    many = SHORTER[one.mesh.dim] * max(counts)
    reference = Recording(pilots.companion(Setting("graded", "graded", finest, many)))
    half = reference.distance(pilots.companion(Setting("graded", "graded", finest // 2, many // 2)))
    order_in_time, _ = orders(one, "time")
    part, order = ("time", JUMPS) if order_in_time == JUMPS else ("space", 1.0)
    own = {
        name: richardson(name, part, half.values[name], order) / (reference.size[name] or 1.0) for name in quantities
    }
    todo = [Setting(*kind) for kind in itertools.product(MESHES, STEPS, cells, counts)]
    known: list[tuple[float, Setting]] = []
    limit, least, met = LONGEST[one.mesh.dim], np.inf, []
    for setting in sorted(todo, key=lambda one: (one.steps == "adaptive", one.cells, one.mesh, one.count)):
        if any(spent > limit and _within(smaller, setting) for spent, smaller in known):
            continue
        try:
            run = pilots.companion(setting)
            error = _relative(
                reference.distance(run, partial(_far, run, limit, reference, own, target)), reference, own
            )
        except (SceneError, ValueError, RuntimeError):  # a mesh too coarse to be graded, or a run that is rejected
            continue
        if run.finished or run.seconds > limit:
            known.append((run.seconds, setting))
        least = min(least, error) if run.finished else least
        if run.finished and error <= target:
            met.append((run.seconds, setting))
            limit = min(limit, UNSURE * run.seconds)
    timed = [(cost_of(pilots.make(one)), name_of(one)) for spent, one in met if spent <= limit]
    cost, best = min(timed, default=(np.inf, "none"))
    return {"best_seconds": cost, "best": best, "least_error": least, "reference_error": max(own.values())}


def _far(
    run: Companion, limit: float, reference: Recording, own: dict[str, float], target: float, found: Distance
) -> bool:
    """Whether a run is of no interest any more: too long, or far from the target."""
    return run.seconds > limit or _relative(found, reference, own) > FAR * target


def _within(smaller: Setting, other: Setting) -> bool:
    same = smaller.mesh == other.mesh and smaller.steps == other.steps
    return same and smaller.cells <= other.cells and smaller.count <= other.count


def cost_of(one: Scene) -> float:
    """CPU seconds of a setting that is run alone, the least of several runs if they are brief."""
    run = Companion(one)
    march([run], [])
    return seconds(run, lambda: Companion(one))


def name_of(setting: Setting) -> str:
    """A setting in a cell of a table."""
    return f"{setting.mesh} {setting.cells}, {setting.steps} {setting.count}"


def row(number: int, seed: int = SEED, grid: bool = True) -> dict[str, Any]:
    """One scene: what was asked for, estimated and true, and what it cost against the best of the grid."""
    one = scene(number, seed)
    target = TARGETS[one.mesh.dim]
    there = "+".join(name for name in ("heat", "viscosity", "inertia") if getattr(one, name) is not None)
    line: dict[str, Any] = {"scene": number, "dim": one.mesh.dim, "tables": there or "elasticity", "asked": target}
    line |= dict.fromkeys(("estimated", "true", "seconds", "all_seconds"), np.nan) | {"choice": ""}
    line |= {"best_seconds": np.nan, "best": "", "least_error": np.nan, "reference_error": np.nan}
    if grid:
        line |= best_of_grid(one, ask.wanted(one, "all"), target)
    try:
        answer = ask.solve(one, target, seconds=SECONDS[one.mesh.dim])
    except (SceneError, RuntimeError) as why:
        return line | {"outcome": str(why).replace("\n", " ")}
    return line | {
        "estimated": answer.error,
        "true": true_error(answer),
        "seconds": cost_of(answer.scene),
        "all_seconds": answer.seconds,
        "choice": name_of(answer.tries[-1].setting),
        "outcome": "solved",
    }


def main() -> None:
    """Runs the scenes and writes the table after each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=SEED, help="of the random scenes")
    parser.add_argument(
        "--grid", type=int, default=40, help="scenes whose choices are compared with a grid of settings"
    )
    parser.add_argument("--out", type=Path, default=Path("results/tradeoff/asked.csv"))
    parser.add_argument(
        "--dim", type=int, nargs="+", default=[2, 3], help="scenes in the plane (2), in space (3) or both"
    )
    given = parser.parse_args()
    rows = []
    for number in range(given.first, given.first + given.count):
        if scene(number, given.seed).mesh.dim not in given.dim:
            continue
        rows.append(row(number, given.seed, len(rows) < given.grid))
        print(rows[-1], flush=True)
        tables.write(given.out, rows, stamp(None, targets=list(TARGETS.values())))
    solved = [one for one in rows if one["outcome"] == "solved"]
    met = sum(one["true"] <= one["asked"] for one in solved)
    compared = [one for one in solved if one["best"] not in ("", "none")]
    cheap = sum(one["seconds"] <= 2 * one["best_seconds"] for one in compared)
    print(
        f"{len(solved)} of {len(rows)} solved, {met} true errors below the target; {cheap} of {len(compared)} within twice the "
        "best of the grid"
    )


if __name__ == "__main__":
    main()
