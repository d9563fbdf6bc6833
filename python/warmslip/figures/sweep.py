"""A sweep: what the runs end with, over the values of the first key that is varied."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from warmslip.figures.style import GREY, grid_lines, number
from warmslip.records import tables

PANELS = {
    "normal_force": "normal force",
    "tangential_force": "friction force",
    "max_penetration": "largest penetration",
    "norm_u_V": r"$|u|_V$",
    "mises_max": "largest von Mises stress",
    "theta_max": "largest temperature",
}
MOST = 8  # curves of one panel


def sweep(inputs: list[Path]) -> tuple[Figure, str]:
    """Contact forces, penetration, strain, stress and temperature of a sweep; a curve for each combination of further keys."""
    rows = tables.read(inputs[0])
    keys = list(rows[0])[1 : list(rows[0]).index("outcome")]
    first, others = keys[0], keys[1:]
    panels = [name for name in PANELS if any(row[name] for row in rows)]
    if not panels:
        raise ValueError("every number in it is 0")
    curves: dict[tuple[Any, ...], list[tables.Row]] = {}
    for row in rows:
        curves.setdefault(tuple(row[key] for key in others), []).append(row)
    columns = min(3, len(panels))
    lines = -(-len(panels) // columns)
    figure, axes = plt.subplots(lines, columns, figsize=(3.6 * columns, 2.9 * lines), squeeze=False)
    for ax in axes.ravel()[len(panels) :]:
        ax.set_visible(False)
    colours = plt.get_cmap("viridis")(np.linspace(0, 0.85, min(MOST, len(curves))))
    for ax, name in zip(axes.ravel(), panels, strict=False):
        _panel(ax, name, first, others, dict(list(curves.items())[:MOST]), colours)
    if others:
        handles = axes[0, 0].get_legend_handles_labels()
        figure.legend(*handles, ncol=MOST, fontsize=8, title=", ".join(others), loc="outside upper center")
    stopped = sum(row["outcome"] != "completed" for row in rows)
    ranges = "; ".join(
        f"{PANELS[name]} {number(min(row[name] for row in rows))} to {number(max(row[name] for row in rows))}"
        for name in panels
    )
    left = f" The first {MOST} of {len(curves)} curves are drawn." if len(curves) > MOST else ""
    failed = f" {stopped} of {len(rows)} runs stopped early (crosses)." if stopped else ""
    return figure, f"{len(rows)} runs over {', '.join(keys)}: {ranges}.{failed}{left}"


def _panel(
    ax: Any, name: str, first: str, others: list[str], curves: dict[tuple[Any, ...], list[tables.Row]], colours: Any
) -> None:
    texts = any(isinstance(row[first], str) for rows in curves.values() for row in rows)
    for (values, rows), colour in zip(curves.items(), colours, strict=True):
        x = [str(row[first]) for row in rows] if texts else [row[first] for row in rows]
        y = [row[name] for row in rows]
        label = ", ".join(number(v) if isinstance(v, float | int) else str(v) for v in values)
        ax.plot(x, y, "-" if len(rows) > 25 else "o-", color=colour, ms=3, mec="white", mew=0.4, lw=1.2, label=label)
        bad = [i for i, row in enumerate(rows) if row["outcome"] != "completed"]
        ax.plot([x[i] for i in bad], [y[i] for i in bad], "x", color=GREY, ms=6)
    ax.set(xlabel=first, ylabel=PANELS[name])
    if texts:
        ax.tick_params(axis="x", labelrotation=30, labelsize=7)
    grid_lines(ax)
