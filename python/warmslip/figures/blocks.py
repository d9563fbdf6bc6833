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

from warmslip.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, VERMILLION, column, grid_lines, number
from warmslip.records import tables

COLOURS = dict(
    zip(
        ("none", "elastic, quasistatic", "viscoelastic, quasistatic", "elastic", "viscoelastic"),
        (VERMILLION, ORANGE, GREEN, PURPLE, BLUE),
        strict=True,
    )
)
MARKERS = {"none": "o", "frictionless": "s", "friction": "^"}


def blocks(inputs: list[Path]) -> tuple[Figure, str]:
    """Left: a step over one of the whole model, by what is there. Right: a step against the least code that could do it."""
    lines = tables.texts(inputs[0])
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.5, 5.0), width_ratios=(1.5, 1))
    message = [_matrix(left, lines), _floor(right, lines)]
    return figure, (
        f"Cost of a step of {len(lines)} combinations of blocks, medians on one process, {lines[0]['cells_per_side']} cells a "
        f"side. {message[0]} {message[1]}"
    )


def _matrix(ax: Axes, lines: list[dict[str, str]]) -> str:
    across = list(dict.fromkeys((line["heat"], line["exchange"]) for line in lines))
    across.sort(key=lambda pair: (["none", "alone", "expands", "heated", "both"].index(pair[0]), pair[1] == "exchange"))
    down = list(dict.fromkeys((line["motion"], line["contact"]) for line in lines))
    values = np.full((len(down), len(across)), np.nan)
    for line in lines:
        at = down.index((line["motion"], line["contact"])), across.index((line["heat"], line["exchange"]))
        values[at] = float(line["over_whole_model"])
    ax.imshow(values, cmap=cm.oslo_r, vmin=0, vmax=1.4, aspect="auto")
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
    least = 1e3 * column(lines, "least")
    for i, line in enumerate(lines):
        for name, face in (("linear_over_minimal", "white"), ("step_over_minimal", COLOURS[line["motion"]])):
            middle, low, high = (float(line[name + end]) for end in ("", "_lower", "_upper"))
            colour = COLOURS[line["motion"]]
            ax.plot([least[i]] * 2, [low, high], "-", color=colour, lw=0.6, alpha=0.6, zorder=1)
            ax.plot(least[i], middle, MARKERS[line["contact"]], color=colour, mfc=face, ms=4.5, mew=0.8, alpha=0.85)
    ax.axhline(1, color=GREY, lw=0.8, zorder=0)
    ax.set(
        xscale="log",
        xlabel="least code, ms a step",
        ylim=(0.75, max(1.75, 1.3 * column(lines, "step_over_minimal_upper").max())),
    )
    ax.set_ylabel("time over the least code")
    ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.xaxis.set_major_formatter(lambda value, _: number(value))
    ax.xaxis.set_minor_formatter(NullFormatter())
    grid_lines(ax)
    handles = [
        Line2D([], [], marker="o", ls="", color=c, label="no motion" if m == "none" else m) for m, c in COLOURS.items()
    ]
    handles += [
        Line2D([], [], marker=m, ls="", color=GREY, label="no contact" if c == "none" else c)
        for c, m in MARKERS.items()
    ]
    handles += [
        Line2D([], [], marker="o", ls="", color=GREY, mfc=face, label=label)
        for face, label in (("white", "without contact solver, balances"), (GREY, "over least code + contact solver"))
    ]
    ax.legend(handles=handles, loc="upper right", fontsize=7, ncols=2)
    ax.set_title("step against the least code for the same physics")
    bare, over = column(lines, "linear_over_minimal"), column(lines, "step_over_minimal")
    share = column(lines, "balances") / column(lines, "step")
    return (
        f"Right, hollow: without its contact solver and its balances a step takes {number(float(bare.min()), 2)} to "
        f"{number(float(bare.max()), 3)} times the code written for the blocks that are there and no others, "
        f"{number(float(np.median(bare)), 3)} in the middle; filled: with both, against that code and the contact solver, "
        f"{number(float(np.median(over)), 3)} in the middle and {number(float(over.max()), 3)} at most. The balances are "
        f"{number(100 * float(np.median(share)), 2)} % of a step in the middle. "
        "Both use the same factors. Bars are quartiles over the steps."
    )
