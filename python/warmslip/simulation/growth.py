"""Growth from step to step, read off what each step changes: its logarithm climbs along a straight line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

ROOM = 48  # blocks of steps that are remembered
NOTHING = -700.0  # logarithm of what does not change
CLIMBS = (
    (48, 5.5),
    (40, 5.5),
    (32, 5.5),
    (24, 5.5),
    (16, 5.5),
    (12, 5.5),
    (8, 9.2),
    (5, 23.0),
)  # blocks, logarithm of the growth
STRAIGHT = 0.035  # of the climb; 1 + t^5 is never that straight, and constant data give t^4 at most
DRIVEN = 0.2  # of the climb, beyond which that of the data drives it
HOT = 0.01  # share of heat below which the coupling has no part in a growth


def log(square: float) -> float:
    """The logarithm of a square, dimensionless; NOTHING for none."""
    return max(NOTHING, math.log(square)) if square > 0 else NOTHING


def start() -> dict[str, Any]:
    """A course without steps: `rows` of logarithms, each the largest of `stride` steps, the last one of `count`."""
    return {"stride": 1, "count": 0, "rows": []}


def fits(course: Any) -> bool:
    """Whether this is a course: plain numbers, rows of one length."""
    if not isinstance(course, dict) or course.keys() != {"stride", "count", "rows"}:
        return False
    rows = course["rows"]
    if not isinstance(rows, list) or not all(isinstance(row, list) for row in rows) or len(rows) > ROOM:
        return False
    numbers = [course["stride"], course["count"], *(value for row in rows for value in row)]
    return len({len(row) for row in rows}) <= 1 and all(type(value) in (int, float) for value in numbers)


def add(course: dict[str, Any], row: list[float]) -> bool:
    """Takes in a step; whether it ends a block. A full course halves itself."""
    rows = course["rows"]
    if course["count"] == 0:
        if len(rows) == ROOM:
            course["rows"] = rows = [
                [max(pair) for pair in zip(*two, strict=True)] for two in zip(rows[::2], rows[1::2], strict=True)
            ]
            course["stride"] *= 2
        rows.append(row)
    else:
        rows[-1] = [max(pair) for pair in zip(rows[-1], row, strict=True)]
    course["count"] = (course["count"] + 1) % course["stride"]
    return bool(course["count"] == 0)


def climb(course: dict[str, Any]) -> dict[str, float] | None:
    """The longest climb at the end of a course of whole blocks, None for none.

    The first entry of a row is the square of what a step changes, the others are those of the data: where one climbs with
    it, the data drive. A polynomial in time, a burst and a wave are not straight. `factor` a step, `total`, `begin` and `end`
    in steps.
    """
    rows, stride = course["rows"], course["stride"]
    for count, least in CLIMBS:
        if len(rows) < count or rows[-1][0] - rows[-count][0] < least:
            continue
        last = np.array(rows[-count:])
        line, at = last[:, 0], np.arange(count)
        rise = line[-1] - line[0]
        slope, height = np.polyfit(at, line, 1)
        straight = np.abs(line - height - slope * at).max() <= STRAIGHT * rise
        if straight and line.min() > NOTHING and (last[-1, 1:] - last[0, 1:]).max(initial=0.0) < DRIVEN * rise:
            return {
                "factor": math.exp(slope / 2 / stride),
                "total": math.exp(rise / 2),
                "begin": (len(rows) - count) * stride,
                "end": len(rows) * stride,
            }
    return None
