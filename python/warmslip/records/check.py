"""One check: a number, where its expected value comes from, and whether it lies in its band."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from warmslip.records import tables

Origin = Literal["analytic", "manufactured", "independent code", "identity", "theory", "comparison", "own rule"]


@dataclass(frozen=True)
class Check:
    """`observed` passes when low <= observed <= high; a nan never does. Dimensionless unless `case` says otherwise."""

    case: str  # what was run
    proves: str  # what a pass means, in one clause
    origin: Origin
    expected: float
    observed: float
    low: float
    high: float

    @property
    def passed(self) -> bool:
        return bool(self.low <= self.observed <= self.high)


def near(
    case: str,
    proves: str,
    origin: Origin,
    expected: float,
    observed: float,
    tolerance: float,
    scale: float | None = None,
) -> Check:
    """`observed` within `tolerance`, relative to `scale` (default: the expected value), on both sides."""
    width = tolerance * abs(expected if scale is None else scale)
    return Check(case, proves, origin, expected, observed, expected - width, expected + width)


def below(case: str, proves: str, origin: Origin, observed: float, bound: float) -> Check:
    """A size that should be 0 and is at most `bound`."""
    return Check(case, proves, origin, 0.0, observed, 0.0, bound)


def order(
    case: str, proves: str, origin: Origin, expected: float, observed: float, low: float = 0.12, high: float = 0.35
) -> Check:
    """An order of convergence in [expected - low, expected + high]."""
    return Check(case, proves, origin, expected, observed, expected - low, expected + high)


def write(path: Path, checks: Iterable[Check], stamp: dict[str, Any]) -> bool:
    """Writes the checks as a table with its stamp; whether all passed. Raises ValueError for no check at all."""
    table = [asdict(one) | {"verdict": "pass" if one.passed else "FAIL"} for one in checks]
    if not table:
        raise ValueError(f"no check to write to {path}: a verification that checks nothing proves nothing")
    tables.write(path, table, stamp)
    return all(row["verdict"] == "pass" for row in table)
