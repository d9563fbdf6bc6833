"""The work-precision diagram: what an error costs, and the runs that nothing beats."""

from __future__ import annotations

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
    Case,
    case,
    column,
    grid_lines,
    number,
)
from warmslip.records import tables

COLOURS = {"staggered": BLUE, "lagged": VERMILLION, "monolithic": GREEN}
MARKERS = {"nodal": "o"}  # any other quadrature: a diamond


def work(inputs: list[Path]) -> tuple[Figure, str]:
    """Error against CPU seconds, one panel a problem, its front joined and named by 1/h, 1/k."""
    lines = tables.texts(inputs[0])
    cases = {line["case"]: case(line["case"]) for line in lines}
    readings, temperatures = (
        list(dict.fromkeys(c.reading for c in cases.values())),
        sorted({c.theta for c in cases.values()}, key=float),
    )
    size = (2.6 * len(readings) + 0.4, 2.7 * len(temperatures) + 0.5)
    figure, axes = plt.subplots(
        len(temperatures), len(readings), figsize=size, sharex=True, sharey="row", squeeze=False
    )
    message = []
    for i, theta in enumerate(temperatures):
        for j, reading in enumerate(readings):
            own = [line for line in lines if cases[line["case"]][:2] == (reading, theta)]
            message.append(panel(axes[i, j], own, cases, f"{reading}, theta_F = {theta}"))
            axes[i, j].set_title(rf"{reading}, $\theta_F = {theta}$")
        axes[i, 0].set_ylabel("error of $u$, $w$, $\\theta$")
        axes[i, 0].yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes[i, 0].yaxis.set_major_formatter(lambda value, _: number(value))
        axes[i, 0].yaxis.set_minor_formatter(NullFormatter())
    for ax in axes[-1]:
        ax.set_xlabel("CPU seconds")
    used = list(dict.fromkeys(line["coupling"] for line in lines))
    handles = [Line2D([], [], color=COLOURS.get(name, PURPLE), marker="o", ls="", label=name) for name in used]
    for quadrature in dict.fromkeys(line["quadrature"] for line in lines if line["quadrature"] not in MARKERS):
        handles.append(Line2D([], [], color=GREY, marker="D", ls="", label=f"contact quadrature {quadrature}"))
    handles.append(Line2D([], [], color=INK, lw=1, label="front, with 1/h, 1/k"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    head = (
        f"Error (largest over time, sum of u, w and theta) against the CPU seconds of a run, set-up included: "
        f"{len(lines)} runs. The front joins the runs than which no other of the same "
        "problem is both cheaper and more accurate. Errors are distances to the finest solution of the same coupling, so "
        "that none below the error of that solution itself means more accuracy: where the start is sudden (theta_F = 10) the "
        "right ends of the fronts lie below it (results/verification, convergence)."
    )
    return figure, " ".join([head, *filter(None, message)])


def panel(ax: Any, lines: list[dict[str, str]], cases: dict[str, Case], title: str) -> str:
    """One problem; returns its sentence for the caption."""
    for line in lines:
        colour, marker = COLOURS.get(line["coupling"], PURPLE), MARKERS.get(line["quadrature"], "D")
        ax.loglog(
            float(line["cpu_seconds"]),
            float(line["error"]),
            marker=marker,
            color=colour,
            ms=4,
            alpha=0.75,
            mec="white",
            mew=0.4,
        )
    grid_lines(ax)
    ax.margins(0.1, 0.08)
    front = sorted(
        (line for line in lines if line["front"].lower() == "true"), key=lambda line: float(line["cpu_seconds"])
    )
    if not front:
        return ""
    x, y = column(front, "cpu_seconds"), column(front, "error")
    ax.plot(x, y, color=INK, lw=0.9, zorder=1)
    for index in apart(x, y):
        name = f"{front[index]['n']},{front[index]['steps']}"
        ax.annotate(name, (x[index], y[index]), (-3, -8), textcoords="offset points", fontsize=6.5, ha="right")
    last = front[-1]
    return (
        f"{title}: the front ends at error {number(y[-1])} in {number(x[-1])} s "
        f"({cases[last['case']].coupling}, h = 1/{last['n']}, k = 1/{last['steps']})."
    )


def apart(x: Any, y: Any, distance: float = 0.5) -> list[int]:
    """Points of a front far enough from each other, in decades, to be named; the last one always."""
    chosen = [len(x) - 1]
    for index in range(len(x) - 2, -1, -1):
        if np.hypot(*np.log10([x[chosen[-1]] / x[index], y[index] / y[chosen[-1]]])) > distance:
            chosen.append(index)
    return chosen
