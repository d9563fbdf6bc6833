"""Figure 5, done right: errors on graded meshes and times, against a reference whose own error is known and taken off."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from warmslip.model.discretisation import Discretisation, discretise
from warmslip.model.materials import make_mesh
from warmslip.records.check import Check, below, order
from warmslip.scene.full import FullScene
from warmslip.simulation.statistics import BALANCES, residuals, worse
from warmslip.studies import rates
from warmslip.studies.error_norms import TERMS, Comparison, Largest
from warmslip.verification.assumptions.corners import corner_exponents
from warmslip.verification.grading.meshes import TimeBlock, Triangulation, family, time_blocks

COARSEST = 4  # cells per side of the mesh that is refined; two graded corners must not share an edge


@dataclass(frozen=True)
class Grids:
    """How the members of a study are graded: corners with their exponents, how often the first time block is halved, and
    the largest k over h. Large steps let the errors in time be seen beside those in space."""

    exponents: dict[tuple[float, float], float]
    halvings: int
    ratio: int

    def blocks(self, end: float, n: int) -> list[TimeBlock]:
        """The time steps that go with h = 1/n; the last block is half of the time when there are several."""
        return time_blocks(end, n // (self.ratio * (2 if self.halvings else 1)), self.halvings)


UNIFORM = Grids({}, 0, 1)


class Member:
    """A scene on one mesh, stepped through blocks of constant step size; operators are assembled once."""

    def __init__(self, scene: FullScene, mesh: Any, blocks: list[TimeBlock]) -> None:
        self.discretisation: Discretisation = discretise(scene, mesh=mesh)
        self.blocks, self.stepper, self.steps = blocks, None, 0
        self.worst = dict.fromkeys(BALANCES, 0.0)

    def advance(self) -> Iterator[Any]:
        """A report a step. Raises RuntimeError, with the outcome, when a step is rejected."""
        d, loads = self.discretisation, self.discretisation.load_vectors
        for block in self.blocks:
            one = d.full.override(**{"time.end": block.k, "time.steps": 1})
            stepper = replace(d, scene=one).stepper()
            if self.stepper is not None:
                state = self.stepper
                stepper.start(state.u, state.w, state.theta, loads.on_points("gap", block.begin), block.begin)
            self.stepper = stepper
            for n in range(1, block.steps + 1):
                report = stepper.advance(*loads.at(block.begin + n * block.k))
                if report.outcome.name != "completed":
                    raise RuntimeError(
                        f"a step of size {block.k:g} at t = {stepper.time:g} ended: {report.outcome.name}"
                    )
                for name, value in residuals(report).items():
                    self.worst[name] = worse(self.worst[name], value)
                self.steps += 1
                yield report


def study(
    scene: FullScene,
    grids: Grids,
    levels: list[int],
    reference: int,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict[str, Any]]:
    """Largest errors over the common times of members h = 1/n, k = ratio/n at most, against 1/reference; n = 8, 16, ...

    `e_TERM` is the distance to the reference, `gap_TERM` that to the next finer member, which has no bias: C h^p (1 - 2^-p).
    Raises ValueError for fewer than three levels, a reference that is not finer than all of them, or a size that is not
    COARSEST times a power of two; RuntimeError when a run is not completed.
    """
    sizes = [*sorted(levels), reference]
    if len(levels) < 3:
        raise ValueError(f"a study of {len(levels)} levels says nothing about an order; give at least three")
    if reference <= max(levels):
        raise ValueError(f"the reference 1/{reference} is not finer than the run 1/{max(levels)}; refine it")
    doublings = [round(np.log2(n / COARSEST)) for n in sizes]
    if min(sizes) < 2 * grids.ratio or any(COARSEST * 2**j != n for j, n in zip(doublings, sizes, strict=True)):
        raise ValueError(f"sizes must be 8, 16, 32, ...; got {sizes}")
    coarsest = Triangulation.of(make_mesh(scene.override(**{"mesh.n": COARSEST})))
    meshes = family(coarsest, grids.exponents, doublings[-1] + 1)

    def member(n: int, doubling: int) -> Member:
        return Member(scene, meshes[doubling].mesh(), grids.blocks(scene.time.end, n))

    *runs, finest = [member(n, j) for n, j in zip(sizes, doublings, strict=True)]
    finer = [*runs[1:], finest]
    compare = [Comparison(run.discretisation, finest.discretisation) for run in runs]
    chain = [Comparison(run.discretisation, other.discretisation) for run, other in zip(runs, finer, strict=True)]
    largest, gaps = ([Largest() for _ in runs] for _ in range(2))
    advancing = [run.advance() for run in runs]
    total = sum(block.steps for block in finest.blocks)
    for step, _ in enumerate(finest.advance(), 1):
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
            "steps": run.steps,
            "cells": len(run.discretisation.mesh.cells),
            **{f"e_{term}": found.values[term] for term in TERMS},
            **{f"gap_{term}": gap.values[term] for term in TERMS},
            **{f"residual_{name}": run.worst[name] for name in BALANCES},
        }
        for n, run, found, gap in zip(sizes[:-1], runs, largest, gaps, strict=True)
    ]


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


def grids(scene: FullScene, halvings: int = 8) -> Grids:
    """The grids that the singular corners and the start of a scene ask for, k = 4h."""
    corners = corner_exponents(discretise(scene.override(**{"mesh.n": COARSEST})))
    return Grids({corner.point: corner.exponent_u for corner in corners if corner.exponent_u < 1}, halvings, 4)


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
