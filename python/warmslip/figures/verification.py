"""Figures of the verification report: figure 5 done right, orders on exact solutions, the theory at work."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator

from warmslip.figures.convergence import triangle
from warmslip.figures.style import GREY, TERMS, column, grid_lines, number
from warmslip.records import tables


def graded(inputs: list[Path]) -> tuple[Figure, str]:
    """Errors on uniform and on graded grids with the reference's own error added back; one table a panel of each kind."""
    table = tables.texts(inputs[0])
    kinds = {"uniform": "uniform mesh, $k = h$", "graded": "graded mesh and steps, largest $k = 4h$"}
    figure, axes = plt.subplots(1, 2, figsize=(7.8, 4.2), sharex=True, sharey=True)
    message = []
    for ax, (kind, title) in zip(axes, kinds.items(), strict=True):
        lines = [line for line in table if line["grids"] == kind]
        h = column(lines, "h")
        parts = []
        for term, (_, colour, marker) in TERMS.items():
            true, own = column(lines, f"true_{term}"), column(lines, f"reference_{term}")
            ax.loglog(h, true, color=colour, marker=marker, mec="white", mew=0.5)
            ax.loglog(h, column(lines, f"e_{term}"), color=colour, ls=":", lw=1)
            ax.axhline(own[0], color=colour, lw=0.6, ls=(0, (1, 3)))
            orders = ", ".join(f"{p:.2f}" for p in column(lines, f"order_{term}")[1:])
            gaps = column(lines, f"gap_{term}")
            between = ", ".join(f"{p:.2f}" for p in np.log2(gaps[:-1] / gaps[1:]))
            ends = f"{number(float(true[0]))} to {number(float(true[-1]))}"
            parts.append(f"{term} {ends} (orders {orders}; between successive grids {between})")
        ax.set(xlabel="$h$", title=title)
        ax.xaxis.set_major_locator(FixedLocator(sorted(set(column(table, "h").tolist()))))  # both panels share it
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter(lambda value, _: f"1/{1 / value:.0f}")
        grid_lines(ax)
        message.append(f"{kind.capitalize()}: {'; '.join(parts)}.")
    low, high = axes[0].get_ylim()
    for ax in axes:
        triangle(ax, h[0] / 2.4, h[0] / 1.2, low * 2)
    axes[0].set(ylim=(low, high), ylabel="error, largest over time")
    names = [Line2D([], [], color=colour, marker=marker, label=label) for label, colour, marker in TERMS.values()]
    extra = [
        Line2D([], [], color=GREY, ls=":", lw=1, label="distance to the reference"),
        Line2D([], [], color=GREY, lw=0.6, ls=(0, (1, 3)), label="the reference's own error"),
    ]
    figure.legend(handles=[*names, *extra], loc="outside lower center", ncols=5, columnspacing=1.1, handlelength=2)
    head = (
        "The paper's problem with the error of the reference taken into account. Left: uniform grids, as in the paper; right: "
        "meshes graded towards the clamped-free corners with as many cells, and steps of at most 4h graded towards t = 0 in "
        "blocks, the first one 256 times shorter. On these grids the orders are those of smooth data; the first block itself "
        "remains O(k^(3/4)) and would show on much finer ones. Uniform |w| follows no power yet: its fit is not judged."
    )
    return figure, " ".join([head, *message])


def verdicts(inputs: list[Path]) -> tuple[Figure, str]:
    """How far every line of the report is from its band: 0 in the middle of the band, 1 at its edge, by origin."""
    lines = [line | {"topic": path.stem} for path in inputs for line in tables.texts(path)]
    topics = list(dict.fromkeys(line["topic"] for line in lines))
    figure, ax = plt.subplots(figsize=(7.8, 0.42 * len(topics) + 1.4))
    for y, topic in enumerate(topics):
        own = [line for line in lines if line["topic"] == topic]
        low, high, seen = (column(own, name) for name in ("low", "high", "observed"))
        middle, half = (low + high) / 2, (high - low) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(half > 0, np.abs(seen - middle) / half, np.where(seen == middle, 0.0, np.inf))
        # a band that is open above: how near its lower edge, as a share
        share = np.where(np.isposinf(high), np.where(seen > 0, low / np.where(seen > 0, seen, 1.0), np.inf), share)
        # sizes that should vanish have 0 at the edge of their band: how much of the bound they use says more
        share = np.where(low == 0, seen / np.where(high > 0, high, 1.0), share)
        good = np.array([line["verdict"] == "pass" for line in own])
        x = np.clip(share, 1e-6, 10)
        jitter = np.linspace(-0.22, 0.22, len(own)) if len(own) > 1 else np.zeros(1)
        ax.semilogx(x[good], y + jitter[good], "o", ms=3, color="#0072b2", alpha=0.6, mew=0)
        ax.semilogx(x[~good], y + jitter[~good], "X", ms=7, color="#d55e00")
    ax.axvline(1, color=GREY, lw=1)
    ax.set(
        xlabel="distance from the middle of the band, in half-widths (1: its edge); of a bound, the share used",
        xlim=(5e-7, 20),
    )
    ax.set_yticks(range(len(topics)), topics)
    ax.invert_yaxis()
    failed = sum(line["verdict"] != "pass" for line in lines)
    return figure, f"Every line of the verification report: {len(lines)} lines, {failed} failed (crosses)."
