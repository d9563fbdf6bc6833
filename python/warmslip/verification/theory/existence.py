"""The existence proof of section 3 run as an algorithm: solve motion and heat apart, exchange whole trajectories, repeat.

Theorem 3.1 freezes zeta = m(theta, .) in the momentum balance and xi = -e(w, .) in the heat balance; contact and exchange stay
with their problems. (PD) then gives w from zeta, (PT) theta from xi, and Lambda maps (zeta, xi) to those of the answers. Here
both problems are the discrete ones, and Lambda acts on (w, theta) at all steps. Numbers are dimensionless.

What the proof says, and what is measured in its place:

- (3.7) bounds w by zeta at the same instant, (3.8) theta by xi likewise. The energy estimates behind them integrate over time:
  |w|_L2(0,t;V) <= c |theta|_L2(0,t;L2), without any gain, and |theta(t)|_L2^2 <= c int_0^t |w|_V^2, which is of Volterra type. So
  the factorial counts pairs of iterations (w of one pair feeds theta of the next): Lambda^2m shrinks like (cT)^m/m!.
- With steps of size k, (cT)^m/m! is (ck)^m binom(N+m-1, m), the power of a lower triangle of ones: the factor from m to m+1 is
  c(T + mk)/(m+1), which falls like 1/m down to ck and not to 0. Lambda is no contraction when ck >= 1.
- The couplings that take one term from the step before have no diagonal: Lambda is nilpotent, and 2N iterations (`lagged`: N)
  reach the fixed point whatever the strength of the coupling.
- f_zeta = f - zeta as printed has the sign wrong: its fixed point is the solution with -M in the place of M.

The first difference is an image of Lambda already, that is an integral over time: it stands for m = 1 of the factorial.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.special import gammaln

from warmslip.records import check
from warmslip.records.check import Check
from warmslip.scene.full import FullScene, full_model
from warmslip.scene.reader import load
from warmslip.studies.rates import least_squares
from warmslip.typing import Array
from warmslip.verification.theory.fixed_point import ROUND_OFF, Fields, Iteration, Lambda, iterate, solution

SAME = 1e-12  # of the solution: two orders above what is observed
READINGS = ("printed", "mixed", "isotropic", "consistent")
# R times this: at the paper's own strength rounding ends the iteration before its factors fall
STRONG, STRONGER = 100.0, 200.0


def heated(scene: FullScene, factor: float) -> FullScene:
    """The scene with R times `factor`; only the product of M and R matters to how fast Lambda contracts."""
    return scene.override(**{"heat.heating.tensor": (factor * np.array(scene.heat.heating.tensor)).tolist()})


def powers(scene: FullScene, count: int) -> tuple[Array, Array]:
    """m = 0 .. count-1 and log of prod_j=1..m (T + jk)/(j+1), the discrete T^m/(m+1)!, both (count,)."""
    m = np.arange(count, dtype=float)
    steps = scene.time.steps
    return m, m * np.log(scene.step) + gammaln(steps + m + 1) - gammaln(steps + 1) - gammaln(m + 2)


def fitted(run: Iteration) -> float:
    """The smallest c with which c^m times `powers` bounds every pair of the run."""
    m, log_power = powers(run.scene, len(run.pairs))
    return float(np.exp((np.log(run.pairs) - log_power)[1:] / m[1:]).max())


def bound(run: Iteration, c: float) -> Array:
    """c^m times `powers` at the pairs of the run."""
    m, log_power = powers(run.scene, len(run.pairs))
    return np.asarray(np.exp(m * np.log(c) + log_power))


def table(run: Iteration, c: float) -> Iterator[dict[str, Any]]:
    """A row a pair of iterations: difference and its bound over the first difference, factor to the next."""
    factors = [*run.factors, float("nan")]
    for m, (size, factor, most) in enumerate(zip(run.pairs, factors, bound(run, c), strict=True)):
        yield {"T": run.scene.time.end, "iteration": 2 * m, "difference": size, "factor": factor, "bound": most}


def setting(reading: str, *, n: int, steps: int, end: float = 1.0, hot: float = 0.0, factor: float = 1.0) -> FullScene:
    """The paper's scene, monolithic, with theta_F = `hot`, T = `end` and R times `factor`."""
    values = {
        "mesh.n": n,
        "time.steps": steps,
        "time.end": end,
        "time.coupling": "monolithic",
        "contact.heat_exchange.foundation_temperature": hot,
    }
    return heated(full_model(load(f"paper_{reading}")).override(**values), factor)


def missed(run: Iteration, solved: Fields) -> float:
    """Distance of the last iterate to a solution, over the size of the solution."""
    measure = Lambda(run.scene).distance
    return measure(run.last, solved) / measure(solved, run.zero)


def fixed_point(reading: str, hot: float, *, n: int = 8, steps: int = 16) -> Check:
    scene = setting(reading, n=n, steps=steps, hot=hot)
    return check.below(
        f"Lambda's fixed point, {reading}, theta_F = {hot:g}",
        "exchanging whole trajectories leads to the monolithic solution",
        "theory",
        missed(iterate(scene), solution(scene)),
        SAME,
    )


def decline(run: Iteration) -> float:
    """Slope of log(factor/(T + mk)) against log(m+1), -1 for `powers`, over the later half of the pairs.

    In the earlier half factor (m+1)/(T + mk) still rises to its plateau, the later the finer the mesh.
    """
    m = np.arange(1, len(run.factors) + 1)
    falling = run.factors / (run.scene.time.end + m * run.scene.step)
    half = len(m) // 2
    return least_squares(m[half:] + 1, falling[half:])[0]


def factorial(reading: str, *, n: int = 8, steps: int = 64, short: float = 0.05, long: float = 0.2) -> list[Check]:
    """How the factors fall, and whether the constant c belongs to the material alone."""
    runs = [iterate(setting(reading, n=n, steps=steps, end=end, factor=STRONG)) for end in (short, long)]
    c = [fitted(run) for run in runs]
    case = f"Lambda's contraction, {reading}, {STRONG:g} R"
    return [
        check.near(
            f"{case}, T = {long:g}",
            "the factor from pair m to m+1 falls like 1/(m+1)",
            "theory",
            -1,
            decline(runs[1]),
            0.1,
        ),
        check.near(
            f"{case}, c at T = {long:g} over c at T = {short:g}",
            "(cT)^m/m! has the T of the bound: its c does not change",
            "theory",
            1.0,
            c[1] / c[0],
            0.25,
        ),
    ]


def transient(*, n: int = 8, steps: int = 64, end: float = 0.5) -> list[Check]:
    """Strong coupling over a long time: cT passes m before m! passes (cT)^m."""
    scene = setting("consistent", n=n, steps=steps, end=end, factor=STRONGER)
    run = iterate(scene, most=400)
    case = f"Lambda at length, consistent, {STRONGER:g} R, T = {end:g}"
    growth = float(run.pairs.max())
    return [
        Check(case, "differences grow before the factorial wins", "theory", np.inf, growth, 2.0, np.inf),
        check.below(
            case,
            "and it wins: the limit is the monolithic solution",
            "theory",
            missed(run, solution(scene)),
            growth * ROUND_OFF / 10,
        ),
    ]


def nilpotent(coupling: str, *, n: int = 8, steps: int = 8) -> list[Check]:
    """One term from the step before: Lambda^2N, or Lambda^N of two such terms, is constant, and no smaller power is."""
    scene = setting("consistent", n=n, steps=steps, factor=STRONG).override(**{"time.coupling": coupling})
    run, power = iterate(scene), steps * (1 if coupling == "lagged" else 2)
    size = np.array(run.differences) / run.differences[0]
    case = f"Lambda for {steps} steps, {coupling}, {STRONG:g} R"
    return [
        check.below(f"{case}, iteration {power}", "reached to rounding", "theory", float(size[power]), SAME),
        Check(
            f"{case}, iteration {power - 1}", "and not before", "theory", np.inf, float(size[power - 1]), 1e-9, np.inf
        ),
    ]


def printed_sign(*, n: int = 8, steps: int = 8) -> list[Check]:
    """f_zeta = f - zeta, as printed, against the problem and against that with -M."""
    scene = setting("isotropic", n=n, steps=steps)
    run = iterate(scene, sign=-1.0)
    opposite = scene.override(**{"heat.expansion.tensor": (-np.array(scene.heat.expansion.tensor)).tolist()})
    case = "Lambda with f - zeta as printed, isotropic"
    away = missed(run, solution(scene))
    return [
        Check(case, "is not the problem's own map", "theory", np.inf, away, 1e-3, np.inf),
        check.below(case, "but that of -M", "theory", missed(run, solution(opposite)), SAME),
    ]


def lines() -> list[Check]:
    """All of the above; about 30 s."""
    return [
        *(fixed_point(reading, hot, n=16) for reading in READINGS for hot in (0.0, 10.0)),
        *(one for reading in READINGS for one in factorial(reading)),
        *transient(),
        *(one for coupling in ("staggered", "lagged") for one in nilpotent(coupling)),
        *printed_sign(),
    ]
