"""Probes of a run: fields of a point over time, and along a line or a part at several times."""

from __future__ import annotations

import itertools
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
ACROSS = 3  # panels in a row
STYLES = ("-", "--", ":", "-.", (0, (5, 1)), (0, (1, 1)))  # of components


def probe(inputs: list[Path]) -> tuple[Figure, str]:
    """Rows of panels for each table, a panel for each field."""
    found = [_read(path) for path in inputs]
    rows = [_rows(list(_fields(table).items())) for table in found]
    many, most = sum(map(len, rows)), max(len(row) for some in rows for row in some)
    figure, axes = plt.subplots(many, most, figsize=(3.3 * most, 2.8 * many), squeeze=False)
    lines = iter(axes)
    captions = []
    for path, table, some in zip(inputs, found, rows, strict=True):
        draw = _profiles if "length" in table else _histories
        for row, line in zip(some, lines, strict=False):
            for ax, (name, columns) in zip(line, row, strict=False):
                draw(ax, table, columns)
                ax.set_title(f"{path.stem}: {name}", fontsize=9)
                ax.axhline(0, color=GREY, lw=0.5)
            for ax in line[len(row) :]:
                ax.set_axis_off()
        ranges = [f"{n} {_range(table[n])}" for n in (name for _, names in itertools.chain(*some) for name in names)]
        captions.append(f"{path.stem}, {len(np.unique(table['step']))} times: {', '.join(ranges)}.")
    if any("length" not in table and len(np.unique(table["x"])) > 1 for table in found):
        captions.append("Shades are the ranges over the points of a part.")
    return figure, " ".join(captions)


def _rows(fields: list[Any]) -> list[list[Any]]:
    return [fields[i : i + ACROSS] for i in range(0, len(fields), ACROSS)]


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
    return {name.replace("_", " ").replace("von mises", "von Mises"): columns for name, columns in out.items()}


def _component(column: str) -> str:
    """The axes of a component: x, or xy."""
    return column.rpartition("_")[2]


def _histories(ax: Any, table: dict[str, Array], columns: list[str]) -> None:
    """Over time: a point, or the range over the points of a part in space."""
    time, first = np.unique(table["time"], return_index=True)
    ends = [*first[1:], len(table["time"])]
    for name, colour in zip(columns, COLOURS, strict=False):
        rows = [table[name][begin:end] for begin, end in zip(first, ends, strict=True)]
        ax.plot(time, [row.mean() for row in rows], color=colour, label=_component(name))
        ax.fill_between(time, [row.min() for row in rows], [row.max() for row in rows], color=colour, alpha=0.2, lw=0)
    ax.set_xlabel("t")
    if len(columns) > 1:
        _room_for_legend(ax, len(columns))


def _profiles(ax: Any, table: dict[str, Array], columns: list[str]) -> None:
    """Along the line, dark at the first of several times and light at the last; a line style for each component."""
    times = np.unique(table["time"][np.isfinite(table[columns[0]])])  # the start has no contact forces
    chosen = times[np.unique(np.linspace(0, len(times) - 1, min(TIMES, len(times))).round().astype(int))]
    for name, style in zip(columns, STYLES, strict=False):
        for i, t in enumerate(chosen):
            on = table["time"] == t
            colour = cm.batlow(0.85 * i / max(1, len(chosen) - 1))
            ax.plot(table["length"][on], table[name][on], style, color=colour)
    for i, t in enumerate(chosen):
        ax.plot([], [], color=cm.batlow(0.85 * i / max(1, len(chosen) - 1)), label=f"t = {number(float(t))}")
    if len(columns) > 1:
        for name, style in zip(columns, STYLES, strict=False):
            ax.plot([], [], style, color=INK, label=_component(name))
    ax.set_xlabel("length")
    _room_for_legend(ax, len(chosen) + (len(columns) if len(columns) > 1 else 0))


def _room_for_legend(ax: Any, entries: int) -> None:
    """A legend above the curves."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + (0.12 + 0.1 * -(-entries // 3)) * (high - low))
    ax.legend(fontsize=6, ncols=3, loc="upper center", framealpha=0.0, columnspacing=1.0, handlelength=1.4)
