"""Figure 5 as the paper drew it, and beside it the orders with the bias of the self-reference removed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator

from warmslip.figures.style import GREY, INK, PALE, SUMS, TERMS, case, column, grid_lines, named, number
from warmslip.records import tables

# the legible ticks of the paper's figure 5
TICKS_X, TICKS_Y = (0.025, 0.05, 0.1), (5e-3, 1e-2, 5e-2, 1e-1, 1.5e-1)
MIN_TICK_RATIO = 1.4  # of two sizes next to each other on an axis
MORE_X, MORE_Y = (0.2, 0.5), (1e-5, 5e-5, 1e-4, 5e-4, 1e-3, 0.5, 1.0, 5.0)


def diagonal(path: Path) -> list[dict[str, str]]:
    """The lines of a study with h = k that have an error, coarse to fine."""
    case(path)  # raises for a study that is not one of the workflow
    lines = [line for line in tables.texts(path) if line["n"] == line["steps"] and np.isfinite(float(line["e_u_V"]))]
    return sorted(lines, key=lambda line: int(line["n"]))


def ticks(axis: Any, paper: tuple[float, ...], more: tuple[float, ...], low: float, high: float) -> None:
    """The paper's ticks, and further ones only where the data leave them."""
    display = [
        t for t in sorted({*paper, *more}) if low <= t <= high and (t in paper or not min(paper) < t < max(paper))
    ]
    axis.set_major_locator(FixedLocator(display))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(lambda value, _: number(value))


def triangle(ax: Any, low: float, high: float, level: float) -> None:
    """A triangle of slope 1 in log-log axes between `low` and `high`, its lower corner at `level`."""
    ax.fill([low, high, high], [level, level, level * high / low], fc="none", ec=INK, lw=0.9)
    ax.annotate("1", (np.sqrt(low * high), level), (0, -9), textcoords="offset points", ha="center", fontsize=8)
    ax.annotate("1", (high, level * np.sqrt(high / low)), (4, -3), textcoords="offset points", fontsize=8)


def errors(inputs: list[Path]) -> tuple[Figure, str]:
    """Figure 5: the estimated errors against h+k, each term and both sums; one study a panel."""
    loaded = [diagonal(path) for path in inputs]
    figure, axes = plt.subplots(
        1, len(loaded), figsize=(3.9 * len(loaded), 4.4), sharex=True, sharey=True, squeeze=False
    )
    every = np.concatenate([column(t, f"e_{name}") for t in loaded for name in {**TERMS, **SUMS}])
    steps = np.concatenate([column(t, "h") + column(t, "k") for t in loaded])
    x = steps.min() / 1.25, steps.max() * 1.25
    y = min(every.min() / 3.2, 4.5e-3), max(every.max() * 1.4, 1.7e-1)
    for ax, table, path in zip(axes[0], loaded, inputs, strict=True):
        size = column(table, "h") + column(table, "k")
        ax.axhspan(TICKS_Y[0], TICKS_Y[-1], fc=PALE, zorder=0)
        for name, (label, colour, marker) in {**TERMS, **SUMS}.items():
            style = "-" if name in TERMS else (0, (4, 2))
            text = label if name in TERMS else f"$E^{{hk}}$: {label}"
            ax.loglog(
                size,
                column(table, f"e_{name}"),
                marker=marker,
                color=colour,
                ls=style,
                label=text,
                mec="white",
                mew=0.5,
            )
        triangle(ax, x[1] / 2.6, x[1] / 1.5, y[0] * 1.5)
        ax.set(xlim=x, ylim=y, xlabel="$h + k$", title=case(path).panel)
        ticks(ax.xaxis, TICKS_X, MORE_X, *x)
        ticks(ax.yaxis, TICKS_Y, MORE_Y, *y)
        grid_lines(ax)
    axes[0, 0].set_ylabel("estimated error, largest over time")
    figure.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5, columnspacing=1.1, handlelength=2
    )
    message = [spoken(table, case(path).theta) for table, path in zip(loaded, inputs, strict=True)]
    reference = max(int(line["n"]) for line in tables.texts(inputs[0]))
    head = (
        f"Reading '{case(inputs[0]).reading}', {case(inputs[0]).coupling} coupling: estimated errors against h + k as "
        f"in the paper's figure 5, h = k from 1/{loaded[0][0]['n']} to 1/{loaded[0][-1]['n']}, the solution at "
        f"1/{reference} standing in for the exact one. Ticks are the paper's where it has them, the grey band is the "
        "range of its ticks."
    )
    return figure, " ".join([head, *message])


def spoken(table: list[dict[str, str]], theta: str) -> str:
    """The errors of both sums, coarsest to finest, and their mean orders, as a sentence."""
    sums = [
        f"{number(e[0])} to {number(e[-1])} {words} the velocity term (mean order {mean_order(table, name):.2f})"
        for name, words in (("u_w_theta", "with"), ("u_theta", "without"))
        for e in [column(table, f"e_{name}")]
    ]
    return f"For theta_F = {theta}: E from {sums[0]}, from {sums[1]}."


def mean_order(table: list[dict[str, str]], name: str) -> float:
    """Slope of the whole curve, by least squares, as in the table of readings."""
    e, h = column(table, f"e_{name}"), column(table, "h")
    return float(np.polyfit(np.log(h), np.log(e), 1)[0]) if len(e) > 1 else float("nan")


def corrected(inputs: list[Path]) -> tuple[Figure, str]:
    """Observed and bias-corrected orders against the expected ones. Inputs: the rates, then the studies to show."""
    rates, studies = tables.texts(inputs[0]), inputs[1:]
    if not studies:
        raise ValueError("no study is named; give the table of rates and then the studies that it speaks of")
    figure, axes = plt.subplots(
        1, len(studies), figsize=(max(3.9 * len(studies), 5.6), 4.2), sharex=True, sharey=True, squeeze=False
    )
    message, shown = [], []
    for ax, path in zip(axes[0], studies, strict=True):
        own = [line for line in rates if line["case"] == path.stem]
        if not own:
            cases = ", ".join(dict.fromkeys(line["case"] for line in rates))
            raise ValueError(f"the rates speak of {cases}, and not of {path.stem}")
        name = named(path)
        message.append(orders(ax, own, f"theta_F = {name.theta}" if name else path.stem))
        shown += own
        ax.set(xlabel="$h = k$" if name else "$h$, halved with $k$", title=name.panel if name else path.stem)
        grid_lines(ax)
    bottom, top = axes[0, 0].get_ylim()
    axes[0, 0].set(ylim=(min(bottom, 0), max(top, 1.5)), ylabel="order")
    sizes = sorted({float(line["h"]) for line in shown if np.isfinite(float(line["observed"] or "nan"))})
    axes[0, 0].set_xscale("log", base=2)
    axes[0, 0].set_xlim(sizes[0] / 1.3, sizes[-1] * 1.3)
    axes[0, 0].xaxis.set_major_locator(FixedLocator(spread(sizes)))
    axes[0, 0].xaxis.set_minor_locator(NullLocator())
    axes[0, 0].xaxis.set_major_formatter(lambda value, _: f"1/{1 / value:.0f}" if value < 0.6 else number(value))
    there = {line["term"] for line in shown if np.isfinite(float(line["observed"] or "nan"))}
    names = [
        Line2D([], [], color=colour, marker=marker, label=label)
        for name, (label, colour, marker) in TERMS.items()
        if name in there
    ]
    kinds = [
        Line2D([], [], color=GREY, ls=":", marker="o", mfc="white", label="observed"),
        Line2D([], [], color=GREY, marker="o", label="bias removed"),
    ]
    expected = any(np.isfinite(float(line["expected"] or "nan")) for line in shown)
    if expected:
        kinds.append(Line2D([], [], color=GREY, lw=4, alpha=0.35, label="expected"))
    handles = [*names, *kinds]
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=6 if len(studies) > 1 else 3,
        columnspacing=1.1,
        handlelength=2,
    )
    name = named(studies[0])
    reading = (
        f"Reading '{name.reading}': orders between successive h = k" if name else "Orders between successive levels"
    )
    head = (
        f"{reading}. Dotted: as observed against the "
        "finest solution, which flatters the last ones; solid: with that bias removed"
    )
    head += "; wide pale lines: the order that the problem is expected to." if expected else "."
    return figure, " ".join([head, *message])


def spread(sizes: list[float]) -> list[float]:
    """Those of ascending sizes that are far enough apart for a tick each."""
    chosen: list[float] = []
    for size in reversed(sizes):
        if not chosen or chosen[-1] / size > MIN_TICK_RATIO:
            chosen.append(size)
    return chosen


def orders(ax: Any, lines: list[dict[str, str]], what: str) -> str:
    """Draws the orders of one study; returns its sentence for the caption."""
    parts = []
    for name, (_, colour, marker) in TERMS.items():
        own = sorted((line for line in lines if line["term"] == name), key=lambda line: -float(line["h"]))
        if not np.isfinite(column(own, "observed")).any():  # a field that the scene does not have
            continue
        h, expected = column(own, "h"), column(own, "expected")
        ax.plot(h, expected, color=colour, lw=5, alpha=0.25, solid_capstyle="butt")
        ax.plot(h, column(own, "observed"), color=colour, ls=":", marker=marker, mfc="white")
        ax.plot(h, column(own, "corrected"), color=colour, marker=marker, mec="white", mew=0.5)
        last = [column(own, key)[-1] for key in ("observed", "corrected", "expected")]
        known = last if np.isfinite(last[-1]) else last[:-1]
        parts.append(f"{name} {' / '.join(f'{value:.2f}' for value in known)}")
    words = (
        "observed / corrected / expected" if np.isfinite(column(lines, "expected")).any() else "observed / corrected"
    )
    return f"For {what}, finest pair, {words}: {', '.join(parts)}."
