"""One line of the verification report: a number, where its expected value comes from, and whether it is in its band."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

Origin = Literal["analytic", "manufactured", "independent code", "identity", "theory", "comparison", "own rule"]


@dataclass(frozen=True)
class Line:
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
) -> Line:
    """`observed` within `tolerance`, relative to `scale` (default: the expected value), on both sides."""
    width = tolerance * abs(expected if scale is None else scale)
    return Line(case, proves, origin, expected, observed, expected - width, expected + width)


def below(case: str, proves: str, origin: Origin, observed: float, bound: float) -> Line:
    """A size that should be 0 and is at most `bound`."""
    return Line(case, proves, origin, 0.0, observed, 0.0, bound)


def order(
    case: str, proves: str, origin: Origin, expected: float, observed: float, low: float = 0.12, high: float = 0.35
) -> Line:
    """An order of convergence in [expected - low, expected + high]."""
    return Line(case, proves, origin, expected, observed, expected - low, expected + high)


def write(path: Path, lines: Iterable[Line], stamp: dict[str, Any]) -> bool:
    """The lines as CSV with 17 digits, the stamp beside them as .json; whether all passed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    table = [asdict(line) | {"verdict": "pass" if line.passed else "FAIL"} for line in lines]
    if not table:
        raise ValueError(f"no line to write to {path}: a verification that checks nothing proves nothing")
    with path.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(table[0])
        out.writerows([f"{v:.17g}" if isinstance(v, float) else v for v in row.values()] for row in table)
    path.with_suffix(".json").write_text(json.dumps(stamp, indent=2) + "\n")
    return all(row["verdict"] == "pass" for row in table)
