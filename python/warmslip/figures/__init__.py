"""Figures: tables and trajectories in, a PNG and its caption out. Nothing here runs a solver.

Every drawing is a function of its input files that returns a figure and a caption quoting the numbers it shows.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Drawing = Callable[[list[Any]], "tuple[Figure, str]"]


# where each is drawn, and from what
KINDS = {
    "setting": ("setting", "trajectories of a cold and a hot foundation"),
    "deformed": ("fields", "trajectories, a panel each"),
    "temperature": ("fields", "trajectories, a panel each"),
    "mises": ("fields", "trajectories, a panel each"),
    "pressure": ("contact", "trajectories in the plane: pressure and friction traction along each contact part"),
    "stick_slip": ("contact", "trajectories in the plane: the stick-slip map of each contact part"),
    "friction": ("contact", "trajectories in the plane: friction force over displacement of each contact part"),
    "contact_temperature": ("contact", "trajectories in the plane: temperature along each contact part"),
    "errors": ("convergence", "studies named READING_THETA_COUPLING.csv, a panel each"),
    "study": ("study", "any study, a panel each"),
    "error": ("error", "error.csv of a run with --estimate"),
    "probe": ("probe", "probes/NAME.csv of a run, a row of panels each"),
    "sweep": ("sweep", "the table of a sweep"),
    "corrected": ("convergence", "the table of rates, then any studies it speaks of"),
    "grid": ("maps", "full-grid studies named READING_THETA_COUPLING.csv"),
    "table": ("maps", "the table of readings"),
    "extremes": ("maps", "the table of extremes"),
    "campaign": ("campaign", "the table of the campaign, a line a scene"),
    "envelope": ("campaign", "the table of the envelope"),
    "trade": ("trade", "tables of `warmslip trade`"),
    "front": ("trade", "the table of `warmslip front`, then those of `warmslip trade`, a panel each"),
    "work": ("tradeoff", "the table of work"),
    "blocks": ("blocks", "the table of blocks"),
    "graded": ("verification", "graded_table.csv of the verification"),
    "verdicts": ("verification", "tables of verification lines"),
}


def _words(error: Exception) -> str:
    """What is wrong with a table."""
    if isinstance(error, KeyError):
        return f"there is no column {error}"
    return "there are too few rows" if isinstance(error, IndexError) else str(error)


def draw(kind: str, inputs: list[Path], out: Path, contact: Callable[[Path], list[Any]] | None = None) -> None:
    """Draws `kind` from `inputs` into `out` (PNG), with its caption beside it as .rst.

    `contact` reads the contact parts of a trajectory, `figures.contact.ContactLine` each, for the kinds that draw them.
    Raises ValueError for an unknown kind and for inputs that it cannot be drawn from, OSError when one is missing.
    """
    from warmslip.figures import style

    if kind not in KINDS:
        raise ValueError(f"unknown figure '{kind}'; give one of {', '.join(KINDS)}")
    module, source = KINDS[kind]
    drawing: Drawing = getattr(import_module(f"warmslip.figures.{module}"), kind)
    with style.applied():
        try:
            read = contact if module == "contact" else None
            given_to = [part for path in inputs for part in read(path)] if read else list(inputs)
            figure, caption = drawing(given_to)
        except (LookupError, TypeError, ValueError) as error:
            given = ", ".join(str(path) for path in inputs)
            reason = _words(error)
            raise ValueError(f"'{kind}' is drawn from {source}; {given} will not do ({reason})") from error
        style.save(figure, caption, Path(out))
