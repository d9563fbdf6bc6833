"""Figure 5, done right: errors on graded meshes and times, against a reference whose own error is known and taken off."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from warmslip.records.check import Check, below, order
from warmslip.scene.full import FullScene
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.statistics import BALANCES
from warmslip.studies import rates
from warmslip.studies.error_norms import TERMS, Comparison, Largest


@dataclass(frozen=True)
class Grids:
    """How the members of a study are graded: keys of the scene, and k over h of the longest step."""

    keys: dict[str, Any]
    ratio: int

    def member(self, scene: FullScene, n: int) -> FullScene:
        """The scene with h = 1/n."""
        return scene.override(**self.keys, **{"mesh.n": n, "time.steps": n // self.ratio})


# large steps let the errors in time be seen beside those in space
GRADED = Grids({"mesh.graded_to": ["corners"], "time.graded_to": [0.0], "time.halvings": 8}, 4)
UNIFORM = Grids({}, 1)


def study(
    scene: FullScene,
    grids: Grids,
    levels: list[int],
    reference: int,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict[str, Any]]:
    """Largest errors over the common times of members h = 1/n, k = ratio/n at most, against 1/reference; n = 8, 16, ...

    `e_TERM` is the distance to the reference, `gap_TERM` that to the next finer member, which has no bias: C h^p (1 - 2^-p).
    Raises ValueError for fewer than three levels, a reference that is not finer than all of them, or a size that is no power
    of two from 8 on; RuntimeError when a run is not completed.
    """
    sizes = [*sorted(levels), reference]
    if len(levels) < 3:
        raise ValueError(f"a study of {len(levels)} levels says nothing about an order; give at least three")
    if reference <= max(levels):
        raise ValueError(f"the reference 1/{reference} is not finer than the run 1/{max(levels)}; refine it")
    if min(sizes) < 8 or any(n & (n - 1) for n in sizes):
        raise ValueError(f"sizes must be 8, 16, 32, ...; got {sizes}")
    *runs, finest = [Simulation(grids.member(scene, n)) for n in sizes]
    finer = [*runs[1:], finest]
    compare = [Comparison(run.discretisation, finest.discretisation) for run in runs]
    chain = [Comparison(run.discretisation, other.discretisation) for run, other in zip(runs, finer, strict=True)]
    largest, gaps = ([Largest() for _ in runs] for _ in range(2))
    advancing = [_advance(run) for run in runs]
    total = finest.pace.expected
    for step, _ in enumerate(_advance(finest), 1):
        for i in reversed(range(len(runs))):  # the finer ones first: each is compared with the next
            if step % (reference // sizes[i]) == 0:
                next(advancing[i])
                largest[i].add(compare[i].difference(runs[i].stepper, finest.stepper))
                gaps[i].add(chain[i].difference(runs[i].stepper, finer[i].stepper))
        if progress:
            progress(step, total)
    return [
        {
            "n": n,
            "h": 1 / n,
            "steps": run.taken,
            "cells": len(run.discretisation.mesh.cells),
            **{f"e_{term}": found.values[term] for term in TERMS},
            **{f"gap_{term}": gap.values[term] for term in TERMS},
            **{f"residual_{name}": run.statistics.residuals[name] for name in BALANCES},
        }
        for n, run, found, gap in zip(sizes[:-1], runs, largest, gaps, strict=True)
    ]


def _advance(run: Simulation) -> Iterator[Any]:
    """The steps of a run. Raises RuntimeError, with the outcome, when one is rejected."""
    yield from run.steps()
    if run.outcome != "completed":
        raise RuntimeError(f"a run ended at t = {run.stepper.time:g}: {run.outcome}")


def unbiased(rows: list[dict[str, Any]], reference: int) -> list[dict[str, Any]]:
    """The rows with the reference's own error taken off: `true_TERM`, `reference_TERM` and the order `order_TERM`.

    The distance d to a reference of size h_r is C (h^p - h_r^p), or the root of C^2 (h^2p - h_r^2p) in the energy norm,
    where errors are orthogonal; C and p are fitted to all rows, and C h_r^p, the reference's own error, is added back.
    """
    h, finest = np.array([row["h"] for row in rows]), 1 / reference
    out = [dict(row) for row in rows]
    for term in TERMS:
        d = np.array([row[f"e_{term}"] for row in rows])
        q = 2 if term in rates.QUADRATIC else 1

        def misfit(c_p: Any, d: Any = d, q: int = q) -> Any:
            log_c, p = c_p
            return log_c + np.log(np.maximum(h ** (q * p) - finest ** (q * p), 1e-300)) / q - np.log(d)

        fit = least_squares(misfit, (np.log(d[-1] / h[-1]), 1.0), bounds=([-np.inf, 0.05], [np.inf, 4.0]))
        log_c, p = fit.x
        own = float(np.exp(log_c) * finest**p)
        true = (d**q + own**q) ** (1 / q)
        for i, row in enumerate(out):
            row[f"true_{term}"], row[f"reference_{term}"] = float(true[i]), own
            row[f"misfit_{term}"] = float(np.sqrt(np.mean(fit.fun**2)))
            row[f"order_{term}"] = rates.observed(true[i - 1], true[i]) if i else float("nan")
    return out


def lines(name: str, scene: FullScene, graded: list[dict[str, Any]], uniform: list[dict[str, Any]]) -> list[Check]:
    """Order 1 +- 0.1 at every halving of the graded study, by the unbiased errors and between successive grids; less between the
    uniform grids in every term; balances that close.

    The fitted order of the uniform |w|_L2 is not judged: its errors do not follow one power yet.
    """
    out = []
    for term in TERMS:
        for before, row in pairwise(graded):
            halving = f"{term} from h = 1/{before['n']} to 1/{row['n']} on graded grids is that of smooth data"
            between = rates.observed(before[f"gap_{term}"], row[f"gap_{term}"])
            out.append(order(name, f"order of {halving}", "theory", 1.0, row[f"order_{term}"], 0.1, 0.1))
            out.append(order(name, f"order between grids of {halving}", "theory", 1.0, between, 0.1, 0.1))
        between_graded = [rates.observed(a[f"gap_{term}"], b[f"gap_{term}"]) for a, b in pairwise(graded)]
        for before, row in pairwise(uniform):
            what = f"order of {term} between uniform grids 1/{before['n']} and 1/{row['n']} is less than between any graded ones"
            between = rates.observed(before[f"gap_{term}"], row[f"gap_{term}"])
            out.append(Check(name, what, "theory", min(between_graded), between, 0.4, min(between_graded)))
        if term == "w_L2":
            continue
        owed = rates.expected_order(term, hot=True, singular_conductivity=False, viscosity=scene.viscosity.pair(2))
        what = f"order of {term} at the last halving of uniform grids is less: the data are not smooth"
        out.append(Check(name, what, "theory", owed, uniform[-1][f"order_{term}"], owed - 0.12, 0.9))
    for kind, table in (("graded", graded), ("uniform", uniform)):
        for term in TERMS if kind == "graded" else ("u_V", "theta_L2"):
            what = f"{term} of the {kind} grids follows one power: misfit of the fitted reference"
            out.append(below(name, what, "theory", table[-1][f"misfit_{term}"], 0.02))
    worst = max(row[f"residual_{balance}"] for row in [*graded, *uniform] for balance in BALANCES)
    return [*out, below(name, "the balances of every step close", "identity", worst, 1e-11)]
