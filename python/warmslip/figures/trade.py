"""What accuracy costs: errors of every method over CPU seconds, memory and work, one curve a method; and the fronts."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from warmslip.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILLION, grid_lines, number
from warmslip.records import tables

EQUAL = 1.1  # ratio up to which two CPU times are one
APART = 1.6  # ratio of CPU times from which on two labels have room
# equal steps by other codes
ORDINARY, FACTORED, SNES, GETFEM = OTHERS = ("ordinary Newton", "SciPy, factored once", "PETSc SNES", "GetFEM")


class Look(NamedTuple):
    """How a curve is drawn, and what is typed to have it, with N cells along a side and the M equal steps that go with them."""

    typed: str
    colour: str
    marker: str
    line: Any = "-"
    width: float = 1.3


THIN, DOTTED, DASHED = 0.7, (0, (1, 1)), (0, (4, 2))
CORNERS = "mesh.graded_to=['corners']"
GRADED = "time.graded_to=[0.0] time.halvings=8 time.steps=M/4"
MORE = "time.graded_to=[0.0] time.halvings=6 time.steps=M"
FEWER = "time.graded_to=[0.0] time.halvings=5 time.steps=3M/4"
LOOKS = {
    "equal steps": Look("mesh.n=N time.steps=M", INK, "o"),
    "equal steps, lagged": Look("time.coupling=lagged", GREY, "h", width=THIN),
    "equal steps, monolithic": Look("time.coupling=monolithic", PURPLE, "s", width=THIN),
    "equal steps, gauss-2": Look("contact.quadrature=gauss-2", SKY, "D", width=THIN),
    "equal steps, soft foundation": Look("contact.stiffness=1e3", SKY, "X", DASHED, THIN),
    "equal steps, rigid foundation": Look("contact.stiffness=rigid", PURPLE, "X", DASHED, THIN),
    "equal steps, regularised friction": Look("contact.friction.regularisation=1e-2", GREY, "X", DASHED, THIN),
    "graded steps": Look(GRADED, ORANGE, "^"),
    "more graded steps": Look(MORE, ORANGE, "<", width=2),
    "adaptive steps": Look("time.tolerance=16/M^2 time.steps=8", GREEN, "v"),
    "adaptive steps, smaller tolerance": Look("time.tolerance=4/M^2 time.steps=8", GREEN, "<"),
    "graded mesh": Look(CORNERS, GREY, "d"),
    "graded mesh and steps": Look(f"{CORNERS} {GRADED}", VERMILLION, "^"),
    "graded mesh, more graded steps": Look(f"{CORNERS} {MORE}", VERMILLION, "<", width=2),
    "graded mesh, fewer graded steps": Look(f"{CORNERS} {FEWER}", VERMILLION, ">", DASHED),
    "graded mesh, adaptive steps": Look(f"{CORNERS} time.tolerance=16/M^2 time.steps=8", BLUE, "v"),
    ORDINARY: Look("other_codes.py --code ordinary-Newton", INK, "P", DOTTED),
    FACTORED: Look("other_codes.py --code SciPy,-factored-once", INK, "*", DOTTED),
    SNES: Look("other_codes.py --code PETSc-SNES", BLUE, "P", DOTTED),
    GETFEM: Look("other_codes.py --code GetFEM", VERMILLION, "P", DOTTED),
}
ERRORS = {
    "e_sum": "sum of the norms",
    "e_u_V": r"$|u|_V$",
    "e_theta_L2": r"$|\theta|_{L^2}$",
    "e_normal_force": "normal force",
    "e_largest_pressure": "largest pressure",
    "e_dissipated_energy": "dissipated energy",
}
COSTS = {"cpu_seconds": "CPU seconds", "factor_bytes": "bytes of factors", "work": "numbers read or operated on"}
COLUMNS = 4


def trade(inputs: list[Path]) -> tuple[Figure, str]:
    """Errors over CPU seconds, a panel a quantity, and over memory and work; dashed: the estimated error of the reference."""
    found = {path.stem: tables.read(path) for path in inputs}
    shown = {
        name: [("cpu_seconds", key) for key in ERRORS if any(row[key] > 0 for row in rows)]
        + [(cost, "e_sum") for cost in list(COSTS)[1:]]
        for name, rows in found.items()
    }
    lines = {name: -(-len(panels) // COLUMNS) for name, panels in shown.items()}
    figure, axes = plt.subplots(
        sum(lines.values()), COLUMNS, figsize=(3.5 * COLUMNS, 2.7 * sum(lines.values()) + 1.6), squeeze=False
    )
    places = iter(axes)
    captions: list[str] = []
    handles: dict[str, Any] = {}
    for name, rows in found.items():
        own = [ax for _ in range(lines[name]) for ax in next(places)]
        for ax in own[len(shown[name]) :]:
            ax.set_visible(False)
        for ax, (cost, key) in zip(own, shown[name], strict=False):
            handles |= _panel(ax, rows, cost, key)
            ax.set_title(f"{_title(name)}: {ERRORS[key]}", fontsize=9)
            ax.set_xlabel(COSTS[cost])
        for ax in own[::COLUMNS]:
            ax.set_ylabel("largest error over time")
        captions.append(_best(name, rows))
    figure.legend(list(handles.values()), list(handles), ncol=2, fontsize=7.5, loc="outside upper center")
    captions.append("N cells along a side, M equal steps that go with them: the column `setting` has both.")
    return figure, " ".join(captions)


def _panel(ax: Any, rows: list[tables.Row], cost: str, key: str) -> dict[str, Any]:
    handles = {}
    for method, look in LOOKS.items():
        own = [row for row in rows if row["method"] == method and row[key] > 0 and row[cost] > 0]
        if own:
            x, y = [row[cost] for row in own], [row[key] for row in own]
            (handles[f"{method}: {look.typed}"],) = ax.loglog(
                x, y, color=look.colour, marker=look.marker, mec="white", mew=0.4, lw=look.width, ls=look.line
            )
    half = next((row for row in rows if row["method"] == "reference, half"), None)  # none where the solution is exact
    if half is not None and half[key] > 0:  # of order one: what the reference errs is about its distance to its half
        ax.axhline(half[key], color=GREY, lw=0.8, ls=(0, (4, 3)))
    if ax.get_ylim()[1] > 10 * ax.get_ylim()[0]:
        ax.yaxis.set_minor_formatter(NullFormatter())
    grid_lines(ax)
    return handles


def front(inputs: list[Path]) -> tuple[Figure, str]:
    """This much accuracy for this much time: equal steps, the front of all methods and other codes, a panel a scene.

    The table of the fronts comes first, then those of the contests.
    """
    fronts, *contests = inputs
    best = [row for row in tables.read(fronts) if row["quantity"] == "e_sum"]
    figure, axes = plt.subplots(2, -(-(len(contests) + 1) // 2), figsize=(13, 6.2), squeeze=False)
    handles: dict[str, Any] = {}
    for ax, path in zip(axes.flat, contests, strict=False):
        rows, name = tables.read(path), _title(path.stem)
        for method in ("equal steps", *OTHERS):
            own = [row for row in rows if row["method"] == method and row["e_sum"] > 0]
            if own:
                (handles[method],) = _drawn(ax, own, LOOKS[method], ls=LOOKS[method].line, lw=1)
        own = [row | {"e_sum": row["error"]} for row in best if row["contest"] == path.stem.removeprefix("trade_")]
        (handles["front of warmslip's settings"],) = _drawn(ax, own, Look("", GREEN, ""), lw=5, alpha=0.25)
        for method in dict.fromkeys(row["method"] for row in own):
            points = [row for row in own if row["method"] == method]
            look = LOOKS[method]
            (handles[method],) = _drawn(ax, points, look, ls="none" if method != "equal steps" else "-", ms=7)
        labelled = 0.0
        for row in own:
            if row["cpu_seconds"] < APART * labelled:
                continue
            labelled = row["cpu_seconds"]
            at = (row["cpu_seconds"], row["e_sum"])
            where = {"xytext": (-3, -4), "textcoords": "offset points", "ha": "right", "va": "top"}
            ax.annotate(f"n = {row['n']}", at, fontsize=7, **where)
        ax.set_title(name, fontsize=10)
        ax.set_xlabel("CPU seconds")
        ax.margins(x=0.12, y=0.1)
        ax.yaxis.set_minor_formatter(NullFormatter())
        grid_lines(ax)
    for ax in axes[:, 0]:
        ax.set_ylabel("sum of the norms of the errors")
    spare = list(axes.flat)[len(contests) :]
    for ax in spare:
        ax.set_axis_off()
    order = sorted(handles, key=["front of warmslip's settings", *LOOKS].index)
    spare[0].legend([handles[name] for name in order], order, loc="center", fontsize=8.5)
    text = (
        "What accuracy costs: largest error over time against CPU seconds of factorizations and steps. "
        "A point of the front has a smaller error than every cheaper setting; `front.csv` has the commands."
    )
    return figure, text


def _drawn(ax: Any, rows: list[tables.Row], look: Look, **more: Any) -> Any:
    x, y = [row["cpu_seconds"] for row in rows], [row["e_sum"] for row in rows]
    return ax.loglog(x, y, color=look.colour, marker=look.marker, mec="white", mew=0.4, **more)


def _title(name: str) -> str:
    """The contest of a table trade_NAME."""
    return name.removeprefix("trade_").replace("_", " ")


def _best(name: str, rows: list[tables.Row]) -> str:
    """How much cheaper than the finest run with equal steps, and than other codes, the error of that run can be had."""
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
    for row in rows:
        if row["method"] in OTHERS and row["n"] == finest["n"] and row["cpu_seconds"] > 0:
            ratio = row["cpu_seconds"] / best["cpu_seconds"]
            text += f"; {row['method']} takes {number(row['cpu_seconds'])} s, {number(ratio)} times as long"
    failed = [
        f"{row['method']} with n = {row['n']} ({row['outcome']})" for row in rows if row["outcome"] != "completed"
    ]
    return f"{text}." + (f" No answer: {'; '.join(failed)}." if failed else "")
