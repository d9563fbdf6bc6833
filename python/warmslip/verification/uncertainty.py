"""A value and its numerical uncertainty from a sequence of grids, where no exact answer is known.

The least-squares procedure of Eca & Hoekstra, J. Comput. Phys. 262, 2014, 104-130: phi_i = phi_0 + alpha h_i^p is fitted
with and without weights 1/h; where p comes out beyond what can be trusted, fixed exponents take its place; the standard
deviation of the fit decides between fits and, with the order, the safety factor.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from warmslip.records import tables
from warmslip.records.check import Check
from warmslip.typing import Array


@dataclass(frozen=True)
class Extrapolated:
    """`value` +- `uncertainty` (95 per cent, in the unit of the data) on the finest grid, and how it was found."""

    value: float
    uncertainty: float
    limit: float  # at h = 0
    order: float  # observed; nan when exponents were imposed
    fit: str
    deviation: float

    def __str__(self) -> str:
        return f"{self.value:.6g} +- {self.uncertainty:.2g}"


@dataclass(frozen=True)
class _Fit:
    name: str
    order: float
    coefficients: Array  # phi_0 and one for each exponent
    exponents: tuple[float, ...]
    deviation: float

    def at(self, h: Array) -> Array:
        return np.asarray(
            self.coefficients[0] + sum(a * h**p for a, p in zip(self.coefficients[1:], self.exponents, strict=True))
        )


def _linear(
    name: str, h: Array, phi: Array, weights: Array, exponents: tuple[float, ...], free: int, order: float
) -> _Fit:
    basis = np.stack([np.ones_like(h), *(h**p for p in exponents)], axis=1)
    root = np.sqrt(weights)
    coefficients = np.linalg.lstsq(basis * root[:, None], phi * root, rcond=None)[0]
    rest = float(np.sum(len(h) * weights * (phi - basis @ coefficients) ** 2))
    return _Fit(name, order, coefficients, exponents, float(np.sqrt(rest / (len(h) - free))))


def _power(name: str, h: Array, phi: Array, weights: Array) -> _Fit:
    """The exponent that fits best, by a search over p; phi_0 and alpha follow linearly."""

    def misfit(p: float) -> float:
        return _linear(name, h, phi, weights, (p,), 3, p).deviation

    grid = np.linspace(0.05, 8.0, 160)
    start = int(np.argmin([misfit(p) for p in grid]))
    low, high = grid[max(start - 1, 0)], grid[min(start + 1, len(grid) - 1)]
    p = float(minimize_scalar(misfit, bounds=(low, high), method="bounded", options={"xatol": 1e-10}).x)
    return _linear(name, h, phi, weights, (p,), 3, p)


def extrapolate(sizes: Any, values: Any) -> Extrapolated:
    """The finest value with its uncertainty; `sizes` h (length) and `values` (any unit) of at least four grids.

    Raises ValueError for fewer than four grids, sizes that repeat or are not positive, and values that are not finite.
    """
    h, phi = np.array(sizes, dtype=float), np.array(values, dtype=float)
    if h.shape != phi.shape or len(h) < 4:
        raise ValueError(f"the uncertainty needs a value on each of at least four grids, got {len(h)} and {len(phi)}")
    if not (np.isfinite(phi).all() and (h > 0).all() and len(set(h)) == len(h)):
        raise ValueError("grid sizes must be positive and differ, and values must be finite")
    finest = np.argsort(h)
    h, phi = h[finest] / h.min(), phi[finest]
    spread = float((phi.max() - phi.min()) / (len(h) - 1))
    if spread == 0:
        return Extrapolated(float(phi[0]), 0.0, float(phi[0]), float("nan"), "constant", 0.0)
    plain, weighted = np.full_like(h, 1 / len(h)), (1 / h) / np.sum(1 / h)
    best = min((_power("a power", h, phi, w) for w in (plain, weighted)), key=lambda f: f.deviation)
    if not 0.5 <= best.order <= 2.0:
        choices: list[tuple[str, tuple[float, ...], int]] = [("first order", (1.0,), 2), ("second order", (2.0,), 2)]
        if best.order < 0.5:
            choices.append(("first and second order", (1.0, 2.0), 3))
        fits = [_linear(n, h, phi, w, e, free, best.order) for n, e, free in choices for w in (plain, weighted)]
        chosen = min(fits, key=lambda f: f.deviation)
    else:
        chosen = best
    error = abs(float(phi[0] - chosen.coefficients[0]))
    misfit = abs(float(phi[0] - chosen.at(h)[0]))
    good = chosen.deviation < spread
    safety = 1.25 if 0.5 <= best.order < 2.1 and good else 3.0
    if good:
        uncertainty = safety * error + chosen.deviation + misfit
    else:
        uncertainty = 3 * chosen.deviation / spread * (error + chosen.deviation + misfit)
    return Extrapolated(
        float(phi[0]), uncertainty, float(chosen.coefficients[0]), best.order, chosen.name, chosen.deviation
    )


FUNCTIONALS = ("norm_u_V", "norm_u_L2", "norm_w_L2", "norm_theta_L2", "mises_L2", "normal_force", "tangential_force")


def table(study: Path) -> list[dict[str, Any]]:
    """Value +- uncertainty at the final time of every functional along h = k of a study, its reference included."""
    rows = sorted((r for r in tables.read(study) if r["n"] == r["steps"]), key=lambda r: r["n"])
    out = []
    for name in FUNCTIONALS:
        found = extrapolate([r["h"] for r in rows], [r[name] for r in rows])
        out.append({"case": study.stem, "functional": name, "n": rows[-1]["n"], **asdict(found)})
    return out


def lines(study: Path) -> list[Check]:
    """The uncertainty put to the test: the interval from all grids but the finest must hold the value on the finest."""
    rows = sorted((r for r in tables.read(study) if r["n"] == r["steps"]), key=lambda r: r["n"])
    out = []
    for name in FUNCTIONALS:
        found = extrapolate([r["h"] for r in rows[:-1]], [r[name] for r in rows[:-1]])
        low, high = found.value - found.uncertainty, found.value + found.uncertainty
        what = f"the interval of h = 1/{rows[-2]['n']} holds the value of h = 1/{rows[-1]['n']}"
        out.append(Check(f"{study.stem} {name}", what, "comparison", found.value, rows[-1][name], low, high))
    return out
