"""What accuracy costs: errors of every method over CPU seconds, memory and work, one curve a method."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from warmslip.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILLION, grid_lines, number
from warmslip.records import tables

EQUAL = 1.1  # ratio up to which two CPU times are one
ORDINARY, FACTORED = OTHERS = ("ordinary Newton", "SciPy, factored once")  # equal steps by other codes
LOOKS = {  # name, the keys that make it, colour and marker
    "equal steps": ("time.steps", INK, "o"),
    "equal steps, lagged": ("time.coupling=lagged", GREY, "h"),
    "equal steps, monolithic": ("time.coupling=monolithic", PURPLE, "s"),
    "equal steps, gauss-2": ("contact.quadrature=gauss-2", SKY, "D"),
    "equal steps, soft foundation": ("contact.stiffness=1e3", SKY, "X"),
    "equal steps, rigid foundation": ("contact.stiffness=rigid", PURPLE, "X"),
    "equal steps, regularised friction": ("contact.friction.regularisation=1e-2", GREY, "X"),
    "graded steps": ("time.graded_to=[0.0]", ORANGE, "^"),
    "more graded steps": ("time.graded_to, 4 x time.steps", ORANGE, "<"),
    "adaptive steps": ("time.tolerance", GREEN, "v"),
    "adaptive steps, smaller tolerance": ("time.tolerance / 4", GREEN, "<"),
    "graded mesh": ("mesh.graded_to=['corners']", GREY, "d"),
    "graded mesh and steps": ("both graded_to", VERMILLION, "^"),
    "graded mesh, more graded steps": ("both graded_to, 4 x time.steps", VERMILLION, "<"),
    "graded mesh, adaptive steps": ("mesh.graded_to, time.tolerance", BLUE, "v"),
    ORDINARY: ("scikit-fem", INK, "P"),
    FACTORED: ("another code", INK, "*"),
}
ERRORS = {
    "e_sum": "sum of the norms",
    "e_u_V": r"$|u|_V$",
    "e_theta_L2": r"$|\theta|_{L^2}$",
    "e_normal_force": "normal force",
}


def trade(inputs: list[Path]) -> tuple[Figure, str]:
    """Errors over CPU seconds, a panel a quantity; dashed: the estimated error of the reference."""
    found = {path.stem: tables.read(path) for path in inputs}
    shown = {name: [key for key in ERRORS if any(row[key] > 0 for row in rows)] for name, rows in found.items()}
    columns = max(len(keys) for keys in shown.values())
    figure, axes = plt.subplots(len(found), columns, figsize=(3.3 * columns, 2.9 * len(found)), squeeze=False)
    captions: list[str] = []
    handles: dict[str, Any] = {}
    for line, (name, rows) in zip(axes, found.items(), strict=True):
        for ax in line[len(shown[name]) :]:
            ax.set_visible(False)
        for ax, key in zip(line, shown[name], strict=False):
            handles |= _panel(ax, rows, key)
            ax.set_title(f"{_title(name)}: {ERRORS[key]}", fontsize=9)
        line[0].set_ylabel("largest error over time")
        captions.append(_best(name, rows))
    for ax in axes[-1]:
        ax.set_xlabel("CPU seconds")
    figure.legend(
        list(handles.values()), list(handles), ncol=max(1, columns - 1), fontsize=8, loc="outside upper center"
    )
    return figure, " ".join(captions)


def _panel(ax: Any, rows: list[tables.Row], key: str) -> dict[str, Any]:
    handles = {}
    for method, (keys, colour, marker) in LOOKS.items():
        own = [row for row in rows if row["method"] == method and row[key] > 0]
        if own:
            x, y = [row["cpu_seconds"] for row in own], [row[key] for row in own]
            dashes = (0, (1, 1)) if method in OTHERS else "-"
            (handles[f"{method} ({keys})"],) = ax.loglog(
                x, y, color=colour, marker=marker, mec="white", mew=0.4, lw=1.2, ls=dashes
            )
    half = next((row for row in rows if row["method"] == "reference, half"), None)  # none where the solution is exact
    if half is not None and half[key] > 0:  # of order one: what the reference errs is about its distance to its half
        ax.axhline(half[key], color=GREY, lw=0.8, ls=(0, (4, 3)))
    if ax.get_ylim()[1] > 10 * ax.get_ylim()[0]:
        ax.yaxis.set_minor_formatter(NullFormatter())
    grid_lines(ax)
    return handles


def _title(name: str) -> str:
    """The contest of a table trade_NAME."""
    return name.removeprefix("trade_").replace("_", " ")


def _best(name: str, rows: list[tables.Row]) -> str:
    """How much cheaper than the finest run with equal steps, and than an ordinary Newton, the error of that run can be had."""
    equal = [row for row in rows if row["method"] == "equal steps"]
    finest = max(equal, key=lambda row: row["n"])
    ours = [row for row in rows if row["method"] in LOOKS and row["method"] not in OTHERS]
    best = min((row for row in ours if row["e_sum"] <= finest["e_sum"]), key=lambda row: row["cpu_seconds"])
    gain = finest["cpu_seconds"] / best["cpu_seconds"]
    text = (
        f"{_title(name)}: the error {number(finest['e_sum'])} of equal steps with n = {finest['n']} "
        f"({number(finest['cpu_seconds'])} s) is had "
    )
    if gain > EQUAL:
        text += (
            f"by {best['method']} with n = {best['n']} in {number(best['cpu_seconds'])} s, {number(gain)} times quicker"
        )
    else:
        best, text = finest, f"{text}by nothing else that is quicker"
    other = next((row for row in rows if (row["method"], row["n"]) == (ORDINARY, finest["n"])), None)
    if other is None:
        return f"{text}."
    ratio = other["cpu_seconds"] / best["cpu_seconds"]
    return f"{text}; an ordinary Newton takes {number(other['cpu_seconds'])} s, {number(ratio)} times as long."
