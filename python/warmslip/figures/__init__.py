"""Figures: tables and trajectories in, a PNG and its caption out. Nothing here runs a solver.

Every drawing is a function of its input files that returns a figure and a caption quoting the numbers it shows.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Drawing = Callable[[list[Path]], "tuple[Figure, str]"]


def drawings() -> dict[str, Drawing]:
    """Every kind of figure by name."""
    from warmslip.figures import convergence, fields, maps, setting, tradeoff, verification

    return {
        "setting": setting.setting,
        "deformed": fields.deformed,
        "temperature": fields.temperature,
        "mises": fields.mises,
        "errors": convergence.errors,
        "corrected": convergence.corrected,
        "grid": maps.grid,
        "table": maps.table,
        "extremes": maps.extremes,
        "work": tradeoff.work,
        "graded": verification.graded,
        "verdicts": verification.verdicts,
    }


def draw(kind: str, inputs: list[Path], out: Path) -> None:
    """Draws `kind` from `inputs` into `out` (PNG), with its caption beside it as .rst.

    Raises ValueError for an unknown kind, OSError or KeyError when an input is missing or lacks what the figure shows.
    """
    from warmslip.figures import style

    known = drawings()
    if kind not in known:
        raise ValueError(f"unknown figure '{kind}'; give one of {', '.join(known)}")
    with style.applied():
        figure, caption = known[kind](list(inputs))
        style.save(figure, caption, Path(out))
