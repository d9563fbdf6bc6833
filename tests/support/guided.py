"""Bodies between rollers or smooth guides, and pressed from the side that is left."""

from __future__ import annotations

from typing import Any

from support.boxes import elasticity, scene

SIDES = {2: ["left"], 3: ["left", "front"]}  # one for each axis but the last


def planes(d: int, value: Any = 0.0) -> dict[str, Any]:
    """Symmetry planes across every axis but the last."""
    return {side: [value if i == axis else "free" for i in range(d)] for axis, side in enumerate(SIDES[d])}


def guides(d: int) -> dict[str, Any]:
    return {side: {"normal": 0.0} for side in SIDES[d]}


def pressed(d: int, displacement: Any, n: int = 4, **tables: Any) -> Any:
    return scene(
        d,
        n,
        **{"elasticity": elasticity(d, 10.0, 0.3), "supports": {"displacement": displacement}} | tables,
    )
