"""The robustness campaign: what became of its scenes, by family and by where they lie; and the envelope of what runs right."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from warmslip.figures.style import (
    GREEN,
    GREY,
    INK,
    ORANGE,
    PALE,
    PURPLE,
    SKY,
    VERMILLION,
    column,
    grid_lines,
    number,
)
from warmslip.records import tables

CLASSES = {
    "right": (SKY, "right"),
    "right_as_stated": (GREEN, "right to the digits it states"),
    "stopped_though_solvable": (ORANGE, "stopped, though solvable"),
    "silently_wrong": (VERMILLION, "silently wrong"),
    "crash": (INK, "crashed"),
    "hang": (PURPLE, "did not end"),
    "ill_posed_and_said": (GREY, "data decide nothing, and it says so"),
    "ill_posed_unsaid": (PALE, "data decide nothing, unsaid"),
    "refused": ("#bbbbbb", "refused with a reason"),
    "unjudged": ("#eeeeee", "the reference found nothing"),
}
POSED = ("right", "right_as_stated", "stopped_though_solvable", "silently_wrong", "crash", "hang")
# rows of the lower panel: axis of the table and its words; numbers are cut into bins of decades
AXES = {
    "tau": "step / transit of a wave",
    "stiffness": r"$c_\nu h / E$",
    "aspect": "aspect ratio",
    "strain": "strain of the load",
    "viscosity": "relaxation / transit",
    "diffusion": "diffusion number",
    "conductance": r"$k_c h / K$",
    "foundation": r"$\theta_F$",
    "friction": r"$\mu$",
    "poisson": "Poisson's ratio",
    "support": "support",
    "load": "load",
    "gap": "gap",
    "velocity": "start",
    "quadrature": "quadrature",
    "law": "friction law",
    "compliance": "compliance",
    "heat": "heat",
    "coupling": "coupling",
    "units": "units",
}
LINEAR = ("friction", "poisson")
BINS = 6


def campaign(inputs: list[Path]) -> tuple[Figure, str]:
    """Shares of the classes by family, the failures over step and stiffness, and the share that is not right along every axis."""
    lines = tables.texts(inputs[0])
    figure = plt.figure(figsize=(10.5, 10.2))
    halves: Any = figure.subfigures(2, 1, height_ratios=[0.42, 0.58])
    top, bottom = halves
    left, right = top.subplots(1, 2, width_ratios=[1.0, 1.25])
    used = shares(left, lines)
    where(right, lines)
    cells(bottom.subplots(), lines)
    handles: list[Any] = [Patch(fc=CLASSES[name][0], label=CLASSES[name][1]) for name in used]
    figure.legend(handles=handles, loc="outside upper center", ncols=min(4, len(handles)))
    count = Counter(line["class"] for line in lines)
    posed = sum(count[name] for name in POSED)
    message = "; ".join(f"{n} {CLASSES[name][1]}" for name, n in count.most_common())
    return figure, (
        f"The campaign: {len(lines)} scenes that fill the space of data evenly, each judged by a solver in 80 digits. Above "
        "left, what became of them, by family; above right, the well-posed ones over step and contact stiffness, those that "
        "did not end right in colour; below, how many per cent of the well-posed ones did not end right, along every axis. "
        f"All: {message}. Of {posed} well-posed scenes {number(100 * count['right'] / max(1, posed))} % ended right."
    )


def shares(ax: Any, lines: list[dict[str, str]]) -> list[str]:
    """A bar a family, cut by class; the classes that occur."""
    families = list(dict.fromkeys(line["family"] for line in lines))
    used = [name for name in CLASSES if any(line["class"] == name for line in lines)]
    for y, family in enumerate(families):
        count = Counter(line["class"] for line in lines if line["family"] == family)
        total, x = sum(count.values()), 0.0
        for name in used:
            share = 100 * count[name] / total
            ax.barh(y, share, left=x, color=CLASSES[name][0], height=0.66, ec="white", lw=0.5)
            if share > 5:
                ax.text(x + share / 2, y, f"{count[name]}", ha="center", va="center", fontsize=8)
            x += share
    ax.set_yticks(range(len(families)), [f"{f}\n{sum(line['family'] == f for line in lines)}" for f in families])
    ax.set(xlim=(0, 100), ylim=(len(families) - 0.5, -0.5), xlabel="per cent of the scenes")
    ax.spines["left"].set_visible(False)
    ax.tick_params(axis="y", length=0)
    return used


def where(ax: Any, lines: list[dict[str, str]]) -> None:
    """Well-posed scenes over step and stiffness."""
    for name in POSED:
        own = [line for line in lines if line["class"] == name]
        if own:
            colour, size = CLASSES[name][0], 5 if name == "right" else 16
            alpha = 0.35 if name == "right" else 0.9
            ax.scatter(column(own, "tau"), column(own, "stiffness"), s=size, color=colour, alpha=alpha, lw=0)
    ax.set(xscale="log", yscale="log", xlabel="step / transit of a wave", ylabel=r"contact stiffness $c_\nu h / E$")
    grid_lines(ax)


def cells(ax: Any, lines: list[dict[str, str]]) -> None:
    """One row an axis: per cent of the well-posed scenes in each cell that did not end right."""
    posed = [line for line in lines if line["class"] in POSED]
    axes = [name for name in AXES if len({line.get(name, "") for line in posed}) > 1]
    longest = 0
    for y, name in enumerate(axes):
        for x, (label, own) in enumerate(_binned(name, posed)):
            share = 100 * sum(line["class"] != "right" for line in own) / len(own)
            ax.add_patch(Rectangle((x, y), 1, 1, fc=to_rgba(ORANGE, min(1.0, share / 50)), ec="white", lw=2))
            ax.text(x + 0.5, y + 0.36, f"{share:.0f} %", ha="center", va="center", fontsize=8)
            ax.text(x + 0.5, y + 0.76, label, ha="center", va="center", fontsize=6, color="#444444")
            longest = max(longest, x + 1)
    ax.set(xlim=(0, longest), ylim=(len(axes), 0), xticks=[])
    ax.set_yticks(np.arange(len(axes)) + 0.5, [AXES[name] for name in axes])
    ax.spines[:].set_visible(False)
    ax.tick_params(length=0)


def _binned(name: str, lines: list[dict[str, str]]) -> list[tuple[str, list[dict[str, str]]]]:
    """Cells of an axis that hold a scene, with their words: 0 and a few bins of numbers, or its names."""
    try:
        values = [float(line[name]) for line in lines]
    except ValueError:
        found: dict[str, list[dict[str, str]]] = {}
        for line in sorted(lines, key=lambda line: line[name]):
            found.setdefault(line[name], []).append(line)
        return list(found.items())
    positive = [v for v in values if v > 0]
    scale: Callable[[Any], Any] = (lambda v: v) if name in LINEAR else np.log10
    edges = np.linspace(scale(min(positive)), scale(max(positive)), BINS + 1)
    none = [line for line, v in zip(lines, values, strict=True) if v <= 0]
    out = [("0", none)] if none else []
    for low, high in itertools.pairwise(edges):
        last = high == edges[-1]
        own = [
            ln for ln, v in zip(lines, values, strict=True) if v > 0 and low <= scale(v) and (scale(v) < high or last)
        ]
        if own:
            ends = [number(float(v if name in LINEAR else 10**v), 2) for v in (low, high)]
            out.append((" to ".join(ends), own))
    return out


def envelope(inputs: list[Path]) -> tuple[Figure, str]:
    """A bar from the smallest to the largest value that runs right, for every axis and scene."""
    lines = tables.texts(inputs[0])
    scenes = list(dict.fromkeys(line["scene"] for line in lines))
    figure, panels = plt.subplots(1, len(scenes), figsize=(2.9 * len(scenes) + 1.2, 4.6), sharey=True, squeeze=False)
    names = list(dict.fromkeys(line["axis"] for line in lines))
    for ax, scene in zip(panels[0], scenes, strict=True):
        for line in (one for one in lines if one["scene"] == scene):
            y = names.index(line["axis"])
            low, high, first, last = (
                float(np.log10(float(line[key]))) for key in ("smallest", "largest", "from", "to")
            )
            ax.plot([first, last], [y, y], color=PALE, lw=7, solid_capstyle="butt", zorder=1)
            ax.plot([low, high], [y, y], color=SKY, lw=7, solid_capstyle="butt", zorder=2)
            for end, at in ((low, line["below"]), (high, line["above"])):
                if at:
                    color = {"silently_wrong": VERMILLION, "right_as_stated": GREEN}.get(at, ORANGE)
                    ax.plot(end, y, "|", color=color, ms=11, mew=2, zorder=3)
        ax.set(title=scene, xlabel=r"$\log_{10}$ of the value over the scene's own")
        grid_lines(ax)
    panels[0][0].set_yticks(range(len(names)), names)
    panels[0][0].invert_yaxis()
    handles = [
        Line2D([], [], color=SKY, lw=7, label="runs right"),
        Line2D([], [], color=PALE, lw=7, label="tried"),
        Line2D([], [], color=GREEN, marker="|", ms=11, mew=2, ls="", label="loses digits and states how many"),
        Line2D([], [], color=ORANGE, marker="|", ms=11, mew=2, ls="", label="stops with a named outcome"),
        Line2D([], [], color=VERMILLION, marker="|", ms=11, mew=2, ls="", label="silently wrong"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5)
    whole = sum(not line["below"] and not line["above"] for line in lines)
    wrong = sum("silently_wrong" in (line["below"], line["above"]) for line in lines)
    return figure, (
        f"How far each datum of {len(scenes)} scenes can be moved: blue from the smallest to the largest value for which the "
        f"run is right, judged in 80 digits; pale the range that was tried. {whole} of {len(lines)} run right over all of it; "
        f"{wrong or 'none'} end in a silently wrong answer."
    )
