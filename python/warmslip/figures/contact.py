"""The contact of a run along its part: pressure and friction at several times, the stick-slip map, force over displacement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from cmcrameri import cm
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from warmslip.figures.style import BLUE, GREY, INK, SKY, VERMILLION, number
from warmslip.messages import quoted
from warmslip.typing import Array

STATUS = (("open", "#d9d9d9"), ("stick", SKY), ("slip", VERMILLION))
ARC_LENGTH = "arc length along {} (length)"


@dataclass(frozen=True)
class ContactLine:
    """A contact part of the plane in the steps of a run: arrays (steps,), (points,) and (steps, points).

    `weights` (points,) are lengths, `bound` is None where the law is not known, `temperature` without heat; both as in
    `ContactFields`.
    """

    part: str
    time: Array
    arc_length: Array
    weights: Array
    pressure: Array
    traction: Array
    slip: Array
    status: Any
    bound: Array | None
    temperature: Array | None
    run: str = ""  # which is told where several are drawn

    @property
    def name(self) -> str:
        """The part in quotes, of which run if it is told."""
        return f"'{self.part}'" + (f" of '{self.run}'" if self.run else "")

    @property
    def mean_slip(self) -> Array:
        """Mean tangential displacement of the part, length, (steps,)."""
        return np.asarray(self.slip @ self.weights / self.weights.sum())

    @property
    def friction_force(self) -> Array:
        """Friction force on the body along the part, (steps,)."""
        return np.asarray(self.traction @ self.weights)


def nearest(line: ContactLine, times: Any, count: int = 4) -> list[int]:
    """The steps nearest to times; for None some of those in which the part touches, evenly spread."""
    if times is not None:
        return _nearest(line.time, times)
    touching = np.flatnonzero((np.asarray(line.status) > 0).any(axis=1))
    among = touching if len(touching) else np.arange(len(line.time))
    return sorted({int(among[i]) for i in np.linspace(0, len(among) - 1, count + 1).round().astype(int)[1:]})


def _nearest(known: Array, times: Any) -> list[int]:
    """The numbers of the known times that are nearest to one or several. Raises ValueError for none, and for others."""
    try:
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
    except (TypeError, ValueError):
        raise ValueError(f"times = {quoted(times)}; give a time or a list of times") from None
    slack = 1e-9 * abs(known[-1])
    if not len(wanted) or not ((wanted >= -slack) & (wanted <= known[-1] + slack)).all():
        raise ValueError(f"times = {quoted(times)}; give times from 0 to {known[-1]:g}")
    return sorted({int(np.abs(known - time).argmin()) for time in wanted})


def _shades(count: int) -> list[Any]:
    """Colours of several times, from early to late."""
    return [cm.batlow(x) for x in np.linspace(0.0, 0.7, count)]


def _curve(ax: Any, x: Array, values: Array, **how: Any) -> None:
    """Values along the part; only points where a node has one for the normal of each of its facets."""
    line = len(np.unique(x)) == len(x)
    ax.plot(x, values, ls="-" if line else "", marker="o", ms=2.5 if len(x) < 80 else 0 if line else 1.5, **how)


def pressure_on(axes: Any, line: ContactLine, times: Any = None) -> str:
    """Pressure on the first axes, friction traction with its bound on the second; a caption."""
    upper, lower = axes
    steps = nearest(line, times)
    for step, colour in zip(steps, _shades(len(steps)), strict=True):
        label = f"t = {number(line.time[step])}"
        _curve(upper, line.arc_length, line.pressure[step], color=colour, label=label)
        if line.bound is not None:
            bound = line.bound[step]
            lower.fill_between(line.arc_length, -bound, bound, color=colour, alpha=0.06, lw=0, zorder=0)
            for limit in (-bound, bound):
                lower.plot(line.arc_length, limit, color=colour, lw=0.8, ls=(0, (4, 2)), zorder=1)
        _curve(lower, line.arc_length, line.traction[step], color=colour)
    for ax in axes:
        ax.axhline(0, color=GREY, lw=0.5, zorder=0)
        ax.set_xlabel(ARC_LENGTH.format(line.name))
    upper.set_ylabel("contact pressure (stress)")
    lower.set_ylabel("friction traction on the body (stress)")
    upper.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(len(steps), 4), columnspacing=1.2)
    if line.bound is not None:
        dashed = Line2D([], [], color=GREY, lw=0.8, ls=(0, (4, 2)), label="friction bound")
        lower.legend(handles=[dashed], loc="lower center", bbox_to_anchor=(0.5, 1.0))
    largest = ", ".join(f"{number(float(line.pressure[i].max()))} at t = {number(line.time[i])}" for i in steps)
    shaded = "; dashed: the friction bound" * (line.bound is not None)
    return f"Contact pressure and friction traction along {line.name}{shaded}. Largest pressure: {largest}."


def stick_slip_on(ax: Any, line: ContactLine) -> str:
    """The status of every point, arc length over time; a caption."""
    times = np.concatenate([[0.0], line.time])
    colours = ListedColormap([colour for _, colour in STATUS])
    ax.pcolormesh(
        times,
        borders(line.arc_length, line.weights),
        np.asarray(line.status).T,
        cmap=colours,
        norm=BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3),
        rasterized=True,
    )
    ax.set(xlabel="time", ylabel=ARC_LENGTH.format(line.name))
    patches = [Patch(fc=colour, ec=INK, lw=0.4, label=name) for name, colour in STATUS]
    ax.legend(handles=patches, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    shares = ", ".join(f"{100 * float(np.mean(line.status == i)):.0f} % {name}" for i, (name, _) in enumerate(STATUS))
    return f"Status of the points of {line.name} over {len(line.time)} steps to t = {number(line.time[-1])}: {shares}."


def borders(x: Array, weights: Array) -> Array:
    """The ends of the pieces of a part that its points stand for, (points + 1,); half way between them where it has gaps."""
    ends = np.concatenate([[0.0], np.cumsum(weights)])
    small = 1e-9 * ends[-1]
    if (ends[:-1] <= x + small).all() and (x <= ends[1:] + small).all():
        return ends
    middle = (x[1:] + x[:-1]) / 2
    return np.concatenate([[x[0] - weights[0] / 2], middle, [x[-1] + weights[-1] / 2]])


def friction_on(ax: Any, line: ContactLine) -> str:
    """Friction force on the body over the mean tangential displacement of the part; a caption."""
    moved, force = line.mean_slip, line.friction_force
    ax.plot(moved, force, color=BLUE, marker="o", ms=2 if len(moved) < 200 else 0)
    ax.plot(moved[-1], force[-1], "o", color=VERMILLION, ms=5, label=f"t = {number(line.time[-1])}")
    ax.axhline(0, color=GREY, lw=0.5, zorder=0)
    ax.set(
        xlabel=f"mean tangential displacement of {line.name} (length)",
        ylabel="friction force (force per depth)",
    )
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return (
        f"Friction force on the body over the mean tangential displacement of {line.name}, both positive along the part: "
        f"{number(float(force.min()))} to {number(float(force.max()))}."
    )


def temperature_on(ax: Any, line: ContactLine, times: Any = None) -> str:
    """Temperature of the body along the part at several stored states; a caption. Raises ValueError without heat."""
    if line.temperature is None:
        raise ValueError("the run has no temperature; add a [heat] table to the scene")
    stored = np.flatnonzero(np.isfinite(line.temperature).all(axis=1))
    if not len(stored):
        raise ValueError("no state is stored after the start; set output.every to fewer steps")
    if times is None:
        chosen = [int(i) for i in np.linspace(0, len(stored) - 1, 5).round()[1:]]
    else:
        chosen = _nearest(line.time[stored], times)
    steps = sorted({int(stored[i]) for i in chosen})
    for step, colour in zip(steps, _shades(len(steps)), strict=True):
        _curve(ax, line.arc_length, line.temperature[step], color=colour, label=f"t = {number(line.time[step])}")
    ax.set(xlabel=ARC_LENGTH.format(line.name), ylabel="temperature of the body")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(len(steps), 4), columnspacing=1.2)
    last = line.temperature[steps[-1]]
    return (
        f"Temperature of the body along {line.name}, at t = {number(line.time[steps[-1]])} "
        f"{number(float(last.min()))} to {number(float(last.max()))}."
    )


def pressure(lines: list[ContactLine]) -> tuple[Figure, str]:
    """Pressure, and friction traction with its bound, at several times; one part a row."""
    figure, axes = plt.subplots(len(lines), 2, figsize=(8.6, 3.2 * len(lines)), squeeze=False)
    return figure, " ".join(pressure_on(row, line) for row, line in zip(axes, lines, strict=True))


def stick_slip(lines: list[ContactLine]) -> tuple[Figure, str]:
    """The stick-slip map, one part a panel."""
    return _panels(lines, stick_slip_on, (5.2, 3.6))


def friction(lines: list[ContactLine]) -> tuple[Figure, str]:
    """Friction force over displacement, one part a panel."""
    return _panels(lines, friction_on, (4.6, 3.4))


def contact_temperature(lines: list[ContactLine]) -> tuple[Figure, str]:
    """Temperature along the contact at several times, one part a panel."""
    return _panels(lines, temperature_on, (4.6, 3.4))


def _panels(lines: list[ContactLine], draw: Any, size: tuple[float, float]) -> tuple[Figure, str]:
    figure, axes = plt.subplots(1, len(lines), figsize=(size[0] * len(lines), size[1]), squeeze=False)
    return figure, " ".join(draw(ax, line) for ax, line in zip(axes[0], lines, strict=True))
