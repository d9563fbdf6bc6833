"""Probes of a run: fields of a point over time, and along a line or a part at several times."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from cmcrameri import cm
from matplotlib.figure import Figure

from warmslip.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, VERMILLION, column, number
from warmslip.records import tables
from warmslip.typing import Array

PLACE = ("step", "time", "length", "x", "y", "z")
COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, INK)
TIMES = 5  # profiles of a line


def probe(inputs: list[Path]) -> tuple[Figure, str]:
    """A row of panels for each table, a panel for each field."""
    found = [_read(path) for path in inputs]
    most = max(len(_fields(table)) for table in found)
    figure, axes = plt.subplots(len(found), most, figsize=(3.1 * most, 2.7 * len(found)), squeeze=False)
    captions = []
    for path, table, line in zip(inputs, found, axes, strict=True):
        draw = _profiles if "length" in table else _histories
        fields = _fields(table)
        for ax, (name, columns) in zip(line, fields.items(), strict=False):
            draw(ax, table, columns)
            ax.set_title(f"{path.stem}: {name}")
            ax.axhline(0, color=GREY, lw=0.5)
            if len(columns) > 1:
                ax.legend(fontsize=7)
        for ax in line[len(fields) :]:
            ax.set_axis_off()
        ranges = [f"{n} {_range(table[n])}" for c in fields.values() for n in c]
        captions.append(f"{path.stem}, {len(np.unique(table['step']))} times: {', '.join(ranges)}.")
    return figure, " ".join(captions)


def _range(values: Array) -> str:
    """The smallest and the largest value; the state that a run begins with has no contact forces, nan."""
    known = values[np.isfinite(values)]
    return f"{number(known.min())} to {number(known.max())}" if len(known) else "unknown"


def _read(path: Path) -> dict[str, Array]:
    rows = tables.texts(path)
    if not rows or not {"step", "time", "x", "y"} <= rows[0].keys():
        raise ValueError(f"{path} is no table of a probe with rows")
    return {name: column(rows, name) for name in rows[0]}


def _fields(table: dict[str, Array]) -> dict[str, list[str]]:
    """Columns by field: components of a vector or a tensor together."""
    out: dict[str, list[str]] = {}
    for name in table:
        if name not in PLACE:
            stem, _, axes = name.rpartition("_")
            out.setdefault(stem if stem and set(axes) <= set("xyz") else name, []).append(name)
    return {name.replace("_", " "): columns for name, columns in out.items()}


def _histories(ax: Any, table: dict[str, Array], columns: list[str]) -> None:
    """Over time: a point, or the range over the points of a part in space."""
    time, first = np.unique(table["time"], return_index=True)
    ends = [*first[1:], len(table["time"])]
    for name, colour in zip(columns, COLOURS, strict=False):
        rows = [table[name][begin:end] for begin, end in zip(first, ends, strict=True)]
        ax.plot(time, [row.mean() for row in rows], color=colour, label=name)
        ax.fill_between(time, [row.min() for row in rows], [row.max() for row in rows], color=colour, alpha=0.2, lw=0)
    ax.set_xlabel("t")


def _profiles(ax: Any, table: dict[str, Array], columns: list[str]) -> None:
    """Along the line, dark at the first of several times and light at the last; a line style for each component."""
    times = np.unique(table["time"][np.isfinite(table[columns[0]])])  # the start has no contact forces
    chosen = times[np.unique(np.linspace(0, len(times) - 1, min(TIMES, len(times))).round().astype(int))]
    for name, style in zip(columns, ("-", "--", ":", "-."), strict=False):
        for i, t in enumerate(chosen):
            on = table["time"] == t
            label = name if i == len(chosen) - 1 else None
            colour = cm.batlow(0.85 * i / max(1, len(chosen) - 1))
            ax.plot(table["length"][on], table[name][on], style, color=colour, label=label)
    ax.set_xlabel(f"length, t = {', '.join(number(float(t)) for t in chosen)}", fontsize=8)
