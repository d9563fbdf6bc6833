"""Figures of a stored run for Python and notebooks; each returns the axes, and leaves the backend of matplotlib alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from warmslip.figures import contact as contacts
from warmslip.figures import run as drawings
from warmslip.figures import style
from warmslip.io import drawn
from warmslip.io.paraview import opened
from warmslip.io.trajectory import state_number

FIELDS = {"displacement": "displacement", "mises": "von Mises stress", "temperature": "temperature"}


class Plot:
    """The figures of a run, from the files in its folder. `result.plot` is one.

    Parameters
    ----------
    folder : str or Path
        Folder of the run.

    Raises
    ------
    ValueError
        Each method, for a folder without a run, and for a field, part or time that the run does not have.
    """

    def __init__(self, folder: str | Path) -> None:
        self._folder = Path(folder)

    def __repr__(self) -> str:
        return f"<Plot of '{self._folder}': body, contact, stick_slip_map, friction, temperature, history>"

    def body(self, field: str = "displacement", time: float | None = None, *, ax: Any = None) -> Any:
        """The deformed body coloured by `displacement`, `mises` or `temperature`, at the stored state nearest to a time.

        Returns matplotlib axes; `ax` is used where it is given, of a body in the plane.
        """
        if field not in FIELDS:
            raise ValueError(f"field: {field!r} is unknown; give one of {', '.join(FIELDS)}")
        with opened(self._folder) as t, style.applied():
            d = t.discretisation()
            body, factor = drawn.body(t, d, state_number(t.time, time)), drawn.magnification(t, d)
            name = FIELDS[field]
            if name not in body.fields:
                there = ", ".join(key for key, words in FIELDS.items() if words in body.fields)
                raise ValueError(f"field: the run has no {name}; it has {there}")
            norm = drawings.norm_of([body], name)
            if ax is None:
                size = (drawings.WIDTHS[body.dim], drawings.height(body, factor))
                figure = plt.figure(figsize=size, layout="compressed")
                ax = drawings.panel(figure, figure.add_gridspec(1, 1)[0], body, name, factor=factor, norm=norm)
                if len(body.points) and body.dim == 2:
                    drawings.legend_of_status(figure)
            elif body.dim == 2:
                drawings.panel_on(ax.figure, ax, body, name, factor=factor, norm=norm)
            else:
                raise ValueError("ax: a body in space needs axes of its own; leave ax out")
            magnified = f"\ndisplacement {factor:g} times magnified" if factor != 1 else ""
            ax.set_title(f"{name} at t = {style.number(body.time)}{magnified}")
            return ax

    def contact(self, part: str | None = None, times: Any = None) -> Any:
        """Pressure along a contact part, and friction traction with its bound, at the steps nearest to times.

        Returns two axes. Without `times`, four steps in which the part touches are drawn.
        """
        return self._drawn(contacts.pressure_on, part, 2, (8.6, 3.2), times)

    def stick_slip_map(self, part: str | None = None, *, ax: Any = None) -> Any:
        """The status of every point of a contact part, arc length over time. Returns the axes."""
        return self._drawn(contacts.stick_slip_on, part, 1, (5.2, 3.6), ax=ax)

    def friction(self, part: str | None = None, *, ax: Any = None) -> Any:
        """Friction force on the body over the mean tangential displacement of a contact part. Returns the axes."""
        return self._drawn(contacts.friction_on, part, 1, (4.6, 3.4), ax=ax)

    def temperature(self, part: str | None = None, times: Any = None, *, ax: Any = None) -> Any:
        """Temperature of the body along a contact part at the stored states nearest to times. Returns the axes."""
        return self._drawn(contacts.temperature_on, part, 1, (4.6, 3.4), times, ax=ax)

    def history(self) -> Any:
        """Forces, statuses, energies, heat and residuals over time. Returns an array of axes."""
        with opened(self._folder) as t, style.applied():
            time = t.series("steps")["time"]
            if not len(time):
                raise ValueError("the run has taken no step, and has no history yet")
            figure, _ = drawings.history(time, drawn.history(t, t.discretisation()))
        return np.array(figure.axes)

    def _drawn(
        self, draw: Any, part: str | None, count: int, size: tuple[float, float], *times: Any, ax: Any = None
    ) -> Any:
        with opened(self._folder) as t, style.applied():
            line = drawn.line(t, part)
            axes = ax if ax is not None else plt.subplots(1, count, figsize=size)[1]
            draw(axes, line, *times)
        return axes
