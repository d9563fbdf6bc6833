"""The work-precision diagram: what an error costs, and the runs that nothing beats."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from warmslip.figures.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    PURPLE,
    VERMILLION,
    column,
    grid_lines,
    named,
    number,
)
from warmslip.records import tables

COLOURS = {"staggered": BLUE, "lagged": VERMILLION, "monolithic": GREEN}
Line = dict[str, str]
MARKERS = {"nodal": "o"}  # any other quadrature: a diamond


@dataclass(frozen=True)
class Panel:
    """One problem: its title, how the caption calls it, its lines of the table."""

    title: str
    words: str
    lines: list[Line]


def work(inputs: list[Path]) -> tuple[Figure, str]:
    """Error against CPU seconds, one panel a problem, its front joined and named by cells per side and steps."""
    lines = tables.texts(inputs[0])
    grid = papers(lines) or others(lines)
    size = (2.6 * len(grid[0]) + 0.4, 2.7 * len(grid) + 0.5)
    figure, axes = plt.subplots(len(grid), len(grid[0]), figsize=size, sharex=True, sharey="row", squeeze=False)
    message = []
    for row, panels in zip(axes, grid, strict=True):
        row[0].set_ylabel("error of $u$, $w$, $\\theta$")
        for ax, panel in zip(row, panels, strict=False):
            message.append(draw_panel(ax, panel))
            ax.set_title(panel.title)
        row[0].yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        row[0].yaxis.set_major_formatter(lambda value, _: number(value))
        row[0].yaxis.set_minor_formatter(NullFormatter())
        for ax in row[len(panels) :]:
            ax.set_axis_off()
    for ax in axes[-1]:
        ax.set_xlabel("CPU seconds")
    handles = legend(lines)
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 2 * len(grid[0])))
    head = (
        f"Error (largest over time, sum of u, w and theta) against the CPU seconds of a run, set-up included: "
        f"{len(lines)} runs. The front joins the runs than which no other of the same "
        "problem is both cheaper and more accurate. Errors are distances to the finest solution of the same coupling, so "
        "that none below the error of that solution itself means more accuracy"
    )
    if papers(lines):
        head += (
            ": where the start is sudden (theta_F = 10) the "
            "right ends of the fronts lie below it (results/verification, convergence)"
        )
    return figure, " ".join([f"{head}.", *filter(None, message)])


def papers(lines: list[Line]) -> list[list[Panel]] | None:
    """Readings by columns and foundation temperatures by rows, of studies named so; None when one is not."""
    cases = {line["case"]: named(line["case"]) for line in lines}
    known = [one for one in cases.values() if one is not None]
    if len(known) < len(cases):
        return None
    readings = list(dict.fromkeys(one.reading for one in known))
    temperatures = sorted({one.theta for one in known}, key=float)

    def panel(reading: str, theta: str) -> Panel:
        own = [line for line in lines if (cases[line["case"]] or ())[:2] == (reading, theta)]
        return Panel(rf"{reading}, $\theta_F = {theta}$", f"{reading}, theta_F = {theta}", own)

    return [[panel(reading, theta) for reading in readings] for theta in temperatures]


def others(lines: list[Line]) -> list[list[Panel]]:
    """A panel a problem, three in a row."""
    problems = list(dict.fromkeys(line["problem"] for line in lines))
    panels = [Panel(name, name, [line for line in lines if line["problem"] == name]) for name in problems]
    return [panels[i : i + 3] for i in range(0, len(panels), 3)]


def legend(lines: list[Line]) -> list[Line2D]:
    """What colours and markers say."""
    used = list(dict.fromkeys(line["coupling"] for line in lines))
    handles = [Line2D([], [], color=COLOURS.get(name, PURPLE), marker="o", ls="", label=name) for name in used]
    for quadrature in dict.fromkeys(line["quadrature"] for line in lines if line["quadrature"] not in MARKERS):
        handles.append(Line2D([], [], color=GREY, marker="D", ls="", label=f"contact quadrature {quadrature}"))
    handles.append(
        Line2D([], [], color=INK, lw=1, label="front, with 1/h, 1/k" if papers(lines) else "front, with n, steps")
    )
    return handles


def draw_panel(ax: Any, panel: Panel) -> str:
    """One problem; returns its sentence for the caption."""
    for line in panel.lines:
        colour, marker = COLOURS.get(line["coupling"], PURPLE), MARKERS.get(line["quadrature"], "D")
        seconds, error = float(line["cpu_seconds"]), float(line["error"])
        ax.loglog(seconds, error, marker=marker, color=colour, ms=4, alpha=0.75, mec="white", mew=0.4)
    grid_lines(ax)
    ax.margins(0.1, 0.08)
    front = sorted(
        (line for line in panel.lines if line["front"].lower() == "true"), key=lambda line: float(line["cpu_seconds"])
    )
    if not front:
        return ""
    x, y = column(front, "cpu_seconds"), column(front, "error")
    ax.plot(x, y, color=INK, lw=0.9, zorder=1)
    for index in apart(x, y):
        name = f"{front[index]['n']},{front[index]['steps']}"
        ax.annotate(name, (x[index], y[index]), (-3, -8), textcoords="offset points", fontsize=6.5, ha="right")
    last = front[-1]
    size = f"n = {last['n']}, {last['steps']} steps"
    if named(last["case"]):
        size = f"h = 1/{last['n']}, k = 1/{last['steps']}"
    return f"{panel.words}: the front ends at error {number(y[-1])} in {number(x[-1])} s ({last['coupling']}, {size})."


def apart(x: Any, y: Any, distance: float = 0.5) -> list[int]:
    """Points of a front far enough from each other, in decades, to be named; the last one always."""
    chosen = [len(x) - 1]
    for index in range(len(x) - 2, -1, -1):
        if np.hypot(*np.log10([x[chosen[-1]] / x[index], y[index] / y[chosen[-1]]])) > distance:
            chosen.append(index)
    return chosen
