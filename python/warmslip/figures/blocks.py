"""What blocks cost: a step of every combination against the whole model, and against the least code."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from cmcrameri import cm
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from warmslip.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, VERMILLION, column, grid_lines, number, rows

COLOURS = dict(
    zip(
        ("none", "elastic, quasistatic", "viscoelastic, quasistatic", "elastic", "viscoelastic"),
        (VERMILLION, ORANGE, GREEN, PURPLE, BLUE),
        strict=True,
    )
)
MARKERS = {"none": "o", "frictionless": "s", "friction": "^"}
FLOORS = (1.0, 1.25)


def blocks(inputs: list[Path]) -> tuple[Figure, str]:
    """Left: a step over one of the whole model, by what is there. Right: a step against the least code that could do it."""
    lines = rows(inputs[0])
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.5, 5.0), width_ratios=(1.5, 1))
    said = [_matrix(left, lines), _floor(right, lines)]
    absent = float(np.nanmax(column(lines, "absent")))
    return figure, (
        f"Cost of a step of {len(lines)} combinations of blocks, medians on one process, {lines[0]['bricks']} bricks a "
        f"side. {said[0]} {said[1]} Beside the contact solver no combination takes more than {number(absent)} times what the "
        "whole model takes without the solves of its absent fields."
    )


def _matrix(ax: Axes, lines: list[dict[str, str]]) -> str:
    across = list(dict.fromkeys((line["heat"], line["exchange"]) for line in lines))
    across.sort(key=lambda pair: (["none", "alone", "expands", "heated", "both"].index(pair[0]), pair[1] == "exchange"))
    down = list(dict.fromkeys((line["motion"], line["contact"]) for line in lines))
    values = np.full((len(down), len(across)), np.nan)
    for line in lines:
        at = down.index((line["motion"], line["contact"])), across.index((line["heat"], line["exchange"]))
        values[at] = float(line["over_whole_model"])
    ax.imshow(values, cmap=cm.batlow_r, vmin=0, vmax=1.1, aspect="auto")
    for (i, j), value in np.ndenumerate(values):
        if value == value:
            ax.text(
                j, i, f"{value:.2f}", ha="center", va="center", fontsize=7.5, color="white" if value > 0.55 else INK
            )
    heats = {"none": "no heat", "alone": "heat", "expands": "heat, M", "heated": "heat, R", "both": "heat,\nM, R"}
    ax.set_xticks(
        range(len(across)),
        [heats[heat] + ("\nexchange" if exchange == "exchange" else "") for heat, exchange in across],
        fontsize=7.5,
    )
    motions = [("no motion" if motion == "none" else motion, contact) for motion, contact in down]
    ax.set_yticks(range(len(down)), [f"{m}; {c if c != 'none' else 'no contact'}" for m, c in motions], fontsize=7.5)
    ax.tick_params(length=0)
    ax.spines[:].set_visible(False)
    ax.set_title("step over a step of the whole model")
    return f"Left, from {number(float(np.nanmin(values)), 2)} of a step of the whole model."


def _floor(ax: Axes, lines: list[dict[str, str]]) -> str:
    for line in lines:
        floor, step = 1e3 * float(line["floor"]), 1e3 * float(line["step"])
        ax.plot(
            floor, step, MARKERS[line["contact"]], color=COLOURS[line["motion"]], ms=5, alpha=0.8, mec="white", mew=0.4
        )
    floors = 1e3 * column(lines, "floor")
    ends = np.array([floors.min() * 0.9, floors.max() * 1.1])
    for factor, style in zip(FLOORS, ("-", (0, (4, 3))), strict=True):
        ax.plot(ends, factor * ends, ls=style, color=GREY, lw=0.8, zorder=0)
        ax.text(ends[1], factor * ends[1], f" {factor:g}", fontsize=7.5, color=GREY, va="center")
    ax.set(xscale="log", yscale="log", xlabel="right-hand sides, substitutions, contact solver, ms a step")
    ax.set_ylabel("warmslip with its balances, ms a step")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(lambda value, _: number(value))
        axis.set_minor_formatter(NullFormatter())
    grid_lines(ax)
    handles = [
        Line2D([], [], marker="o", ls="", color=c, label="no motion" if m == "none" else m) for m, c in COLOURS.items()
    ]
    handles += [
        Line2D([], [], marker=m, ls="", color=GREY, label="no contact" if c == "none" else c)
        for c, m in MARKERS.items()
    ]
    ax.legend(handles=handles, loc="upper left", fontsize=7.5)
    ax.set_title("step against the least code for the same physics")
    over = column(lines, "over_floor")
    linear = np.array([line["contact"] == "none" for line in lines])
    return (
        f"Right, {number(float(np.median(over[linear])))} times the least code in the middle of the linear ones (one "
        f"substitution a field; the step closes its balances, the least code does not), "
        f"{number(float(over[linear].max()))} at most; with contact "
        f"{number(float(np.median(over[~linear])))} and {number(float(over[~linear].max()))}."
    )
