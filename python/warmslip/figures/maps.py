"""Maps and tables: the error over the h,k grid, the outcomes at the extremes, the readings and their claims."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from cmcrameri import cm
from matplotlib.colors import LogNorm, to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from warmslip.figures.style import GREY, INK, ORANGE, PALE, PURPLE, SKY, TERMS, VERMILLION, case, column, number
from warmslip.records import tables

OUTCOMES = {
    "completed": SKY,
    "refused": PALE,
    "contact_not_converged": ORANGE,
    "not_finite": PURPLE,
    "balance_violated": VERMILLION,
}
CLAIMS = {"yes": SKY, "no": ORANGE}
BALANCES = ("energy", "heat", "force", "law")


def grid(inputs: list[Path]) -> tuple[Figure, str]:
    """Errors of every term over h and k refined separately; one study a row."""
    size = (3.0 * len(TERMS) + 0.6, 2.75 * len(inputs) + 0.4)
    figure, axes = plt.subplots(len(inputs), len(TERMS), figsize=size, squeeze=False)
    message = []
    for line, path in zip(axes, inputs, strict=True):
        table = tables.texts(path)
        n, steps = column(table, "n").astype(int), column(table, "steps").astype(int)
        meshes, clocks = np.unique(n), np.unique(steps)
        for ax, (name, (label, _, _)) in zip(line, TERMS.items(), strict=True):
            values = np.full((len(meshes), len(clocks)), np.nan)
            values[np.searchsorted(meshes, n), np.searchsorted(clocks, steps)] = column(table, f"e_{name}")
            heat_map(ax, values)
            ax.set_xticks(range(len(clocks)), [f"1/{m}" for m in clocks])
            ax.set_yticks(range(len(meshes)), [f"1/{m}" for m in meshes])
            ax.set_title(f"{label},  {case(path).panel}")
            ax.set(xlabel="$k$", ylabel="$h$")
            message.append(
                f"{name}, theta_F = {case(path).theta}: {number(values[0, -1])} at the coarsest h and finest k, "
                f"{number(values[-1, 0])} at the finest h and coarsest k."
            )
    head = (
        f"Reading '{case(inputs[0]).reading}', {case(inputs[0]).coupling} coupling: largest error over time against "
        "the reference (the empty cell) with h and k refined separately. Colours are logarithmic, one scale a panel."
    )
    return figure, " ".join([head, *message])


def heat_map(ax: Any, values: Any) -> None:
    """Coloured cells with their numbers, the reference cell left empty."""
    good = values[np.isfinite(values)]
    norm = LogNorm(good.min(), good.max())
    ax.imshow(values, cmap=cm.lapaz, norm=norm, origin="upper", aspect="auto")
    ax.spines[:].set_visible(False)
    ax.tick_params(length=0)
    for (i, j), value in np.ndenumerate(values):
        if np.isfinite(value):
            ink = "white" if norm(value) < 0.55 else INK
            ax.text(j, i, f"{value:.1e}".replace("e-0", "e-"), ha="center", va="center", color=ink, fontsize=7)


def table(inputs: list[Path]) -> tuple[Figure, str]:
    """A table as it stands, turned over when it is wide; 'yes' and 'no' are coloured, numbers shortened."""
    lines = tables.texts(inputs[0])
    names = [name.replace("_", " ") for name in lines[0]]
    body = [[shortened(value) for value in line.values()] for line in lines]
    turned = len(names) > 12
    heads, *cells = (list(row) for row in zip(*[names, *body], strict=True)) if turned else [names, *body]
    heads = heads if turned else [fill(head, 11) for head in heads]
    columns = zip(heads, *cells, strict=True)
    left = np.cumsum(
        [0.0, *(1.5 + max(len(part) for cell in column for part in cell.split("\n")) for column in columns)]
    )
    tall = max(head.count("\n") + 1 for head in heads)
    height = 1.4 * (1.0 + max(cell.count("\n") for row in cells for cell in row) * 0.8)
    figure, ax = plt.subplots(figsize=(left[-1] * 0.085 + 0.2, 0.18 * (tall + height * len(cells) + 0.8)))
    ax.set(xlim=(0, left[-1]), ylim=(height * len(cells), -tall - 0.6))
    ax.axis("off")
    ax.axhline(-0.1, color=INK, lw=0.8)
    for i, head in enumerate(heads):
        ax.text((left[i] + left[i + 1]) / 2, -0.4, head, ha="center", va="bottom", fontsize=8.5, weight="bold")
        for j, row in enumerate(cells):
            colour = CLAIMS.get(row[i].split("\n")[0])
            if colour:
                box = Rectangle(
                    (left[i], height * j), left[i + 1] - left[i], height, fc=to_rgba(colour, 0.45), ec="white"
                )
                ax.add_patch(box)
            ax.text((left[i] + left[i + 1]) / 2, height * (j + 0.5), row[i], ha="center", va="center", fontsize=8.5)
    message = [
        f"{line[0]} satisfies {line.count('yes')} of {line.count('yes') + line.count('no')} claims, not: "
        f"{', '.join(name for name, cell in zip(names, line, strict=True) if cell.startswith('no')) or 'none'}."
        for line in body
    ]
    return (
        figure,
        f"Which reading of the paper satisfies which of its claims, computed from the studies: {' '.join(message)}",
    )


def shortened(text: str) -> str:
    """A cell's text: numbers to three digits, a number behind 'yes' or 'no' on a line of its own."""
    try:
        return number(float(text))
    except ValueError:
        word, _, rest = text.partition(" ")
        return f"{word}\n{rest}" if word in ("yes", "no") and rest else fill(text, 26)


def extremes(inputs: list[Path]) -> tuple[Figure, str]:
    """Ladders down, their values along; colour says the outcome, the number below is the largest residual of a balance."""
    lines = tables.texts(inputs[0])
    ladders: dict[str, list[dict[str, str]]] = {}
    for line in lines:
        ladders.setdefault(line["ladder"], []).append(line)
    longest = max(map(len, ladders.values()))
    figure, ax = plt.subplots(figsize=(0.72 * longest + 2.2, 0.46 * len(ladders) + 0.9))
    for y, steps in enumerate(ladders.values()):
        for x, line in enumerate(steps):
            ax.add_patch(
                Rectangle((x, y), 1, 1, fc=to_rgba(OUTCOMES.get(line["outcome"], GREY), 0.75), ec="white", lw=2)
            )
            if line["verdict"] == "WRONG":
                ax.add_patch(Rectangle((x + 0.04, y + 0.06), 0.92, 0.88, fill=False, ec=INK, lw=2, zorder=3))
            ax.text(x + 0.5, y + 0.34, brief(line["value"]), ha="center", va="center", fontsize=8)
            ax.text(x + 0.5, y + 0.72, worst_text(line), ha="center", va="center", fontsize=6.5, color="#333333")
    ax.set(xlim=(0, longest), ylim=(len(ladders), 0), xticks=[])
    ax.set_yticks(np.arange(len(ladders)) + 0.5, [name.replace("_", " ") for name in ladders])
    ax.spines[:].set_visible(False)
    ax.tick_params(length=0)
    counts = {
        name: sum(line["outcome"] == name for line in lines)
        for name in dict.fromkeys(line["outcome"] for line in lines)
    }
    handles = [
        Patch(fc=to_rgba(OUTCOMES.get(name, GREY), 0.75), label=f"{name.replace('_', ' ')} ({count})")
        for name, count in counts.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
    right = [line for line in lines if line["outcome"] == "completed"]
    top = max(right, key=worst, default=None)
    message = (
        f" Largest residual of a balance among the completed ones: {number(worst(top))} at {top['ladder']} = {top['value']}."
        if top
        else ""
    )
    wrong = sum(line["verdict"] == "WRONG" for line in lines)
    message += (
        f" {wrong or 'None'} of the runs {'are' if wrong > 1 else 'is'} silently wrong{' (framed)' if wrong else ''}."
    )
    total = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in counts.items())
    return figure, (
        f"The paper's problem pushed to extremes, one datum at a time: {len(lines)} runs, {total}. In each cell the "
        "value and, below it, the worst relative residual of the energy, heat, force and friction-law "
        f"balances.{message}"
    )


def brief(text: str) -> str:
    try:
        return number(float(text), 6)
    except ValueError:
        return fill(text, 10)


def worst(line: dict[str, str]) -> float:
    """The largest residual of a balance of a run, nan when it has none."""
    found = [float(line[name]) for name in BALANCES if line.get(name)]
    return max((value for value in found if np.isfinite(value)), default=float("nan"))


def worst_text(line: dict[str, str]) -> str:
    """The largest residual of a balance."""
    value = worst(line)
    if not np.isfinite(value):
        return ""
    return f"{value:.0e}".replace("e-0", "e-")
