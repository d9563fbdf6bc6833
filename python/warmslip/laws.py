"""Contact laws of one's own: Python functions in the place of the scene's compliance or friction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip.loads import Array

AGREEING = 0.9  # share of the samples whose derivative must be the difference quotient: a law may have kinks
NEAR = 1e-3  # how close the two must be, relative


@dataclass(frozen=True, kw_only=True)
class Law:
    """Functions in the place of a contact part's own law, None for the one the scene states.

    `compliance(r)`, for a penetration r > 0 (length), gives the pressure p_nu, its derivative and the energy per area, the
    integral of p_nu from 0 to r; where r <= 0 nothing presses. `friction(pressure, speed)` gives the friction bound (stress) and
    its derivatives by the pressure and by the slip speed. Both are called with floats at every contact point in every iteration,
    which is slower than the laws of the scene. They generalise (2.8) and (2.9) of the paper: neither pressure nor bound may be
    negative, and the pressure must not fall as r grows. They are tried on samples before the run, and beyond the samples they are
    believed: a derivative that is wrong there costs iterations, an energy that is wrong misstates the contact energy and the
    damping of the ledger, and what they raise ends the run as it is.
    """

    compliance: Callable[[float], Sequence[float]] | None = None
    friction: Callable[[float, float], Sequence[float]] | None = None

    def names(self, part: str) -> list[str]:
        """Which functions there are."""
        return [f"laws.{part}.{name}" for name in ("compliance", "friction") if getattr(self, name) is not None]

    def check(self, part: str, length: float) -> None:
        """Tries the functions on penetrations up to a hundredth of `length`, the pressures these give, and slip speeds.

        Raises ValueError with the place where a function is not what it should be.
        """
        pressures = np.geomspace(1e-6, 1e2, 9)
        if self.compliance is not None:
            name, r = f"laws.{part}.compliance", np.geomspace(1e-8, 1e-2, 61) * length
            p, _, energy = _sampled(name, self.compliance, r[:, None])
            _integrates(name, r, p, energy)
            _derives(name, self.compliance, r[:, None], axis=0)
            pressures = p[::8]
        if self.friction is not None:
            name = f"laws.{part}.friction"
            places = np.array([(p, speed) for p in pressures if p > 0 for speed in np.geomspace(1e-3, 10, 9)])
            rest = np.column_stack([pressures, 0 * pressures])
            _sampled(name, self.friction, np.vstack([[[0.0, 0.0]], rest]))
            for axis in (0, 1) if len(places) else ():
                _derives(name, self.friction, places, axis=axis)


def _sampled(name: str, law: Callable[..., Any], places: Array) -> Array:
    """The three values at the places (n, arguments), as (3, n)."""
    rows = []
    for place in places:
        at = ", ".join(f"{x:.3g}" for x in place)
        try:
            row = np.array([float(value) for value in law(*map(float, place))])
        except Exception as error:
            raise ValueError(f"{name}({at}) raised {error!r}; it must give three numbers") from error
        if row.shape != (3,) or not np.isfinite(row).all():
            raise ValueError(f"{name}({at}) gave {row.tolist()}; it must give three finite numbers")
        if row[0] < 0:
            raise ValueError(f"{name}({at}) gave {row[0]:.3g}, which is negative; a pressure or a bound is not")
        rows.append(row)
    return np.array(rows).T


def _integrates(name: str, r: Array, pressure: Array, energy: Array) -> None:
    """The energy of a pressure that does not fall grows by something between the lower and the upper rectangle."""
    low, high, grown = pressure[:-1] * np.diff(r), pressure[1:] * np.diff(r), np.diff(energy)
    rounding = 1e-12 * np.abs(energy[1:])
    for i in np.flatnonzero(low > high):
        raise ValueError(f"{name}: the pressure falls from r = {r[i]:.3g} to {r[i + 1]:.3g}; it must not")
    for i in np.flatnonzero((energy < 0) | (energy > r * pressure * (1 + 1e-9))):
        raise ValueError(
            f"{name}({r[i]:.3g}): the energy is {energy[i]:.6g}, and the integral of the pressure from 0 lies between 0 and "
            f"{r[i] * pressure[i]:.6g}; it starts at 0"
        )
    for i in np.flatnonzero((grown < low - rounding) | (grown > high + rounding)):
        raise ValueError(
            f"{name}: from r = {r[i]:.3g} to {r[i + 1]:.3g} the energy grows by {grown[i]:.6g} and the pressure gives "
            f"{low[i]:.6g} to {high[i]:.6g}; the third value is the integral of the first"
        )


def _derives(name: str, law: Callable[..., Any], places: Array, *, axis: int) -> None:
    """The derivative by an argument is the difference quotient, but at kinks."""
    step = np.zeros_like(places)
    step[:, axis] = 1e-5 * places[:, axis]
    over, under, here = (_sampled(name, law, places + sign * step) for sign in (1, -1, 0))
    quotient, stated = (over[0] - under[0]) / (2 * step[:, axis]), here[1 + axis]
    size = np.maximum(np.abs(quotient), np.abs(stated))
    wrong = np.abs(quotient - stated) > NEAR * size + 1e-9 * np.abs(here[0]) / places[:, axis]
    if wrong.mean() > 1 - AGREEING:
        i = int(np.flatnonzero(wrong)[0])
        at = ", ".join(f"{x:.3g}" for x in places[i])
        raise ValueError(
            f"{name}({at}): the derivative by argument {axis + 1} is given as {stated[i]:.6g}, a difference quotient says "
            f"{quotient[i]:.6g}; correct the {('second', 'third')[axis]} value"
        )
