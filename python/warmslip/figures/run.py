"""Any run: the deformed body, the contact, the history, an animation. Arrays in, figures out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from cmcrameri import cm
from matplotlib.animation import PillowWriter
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from warmslip.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILLION, number
from warmslip.typing import Array

MAPS = {"displacement": cm.imola, "von Mises stress": cm.batlow, "temperature": cm.lipari}
STATUS = (("open", GREY), ("stick", SKY), ("slip", VERMILLION))  # the same in every figure of a run
COLOURS_OF_STATUS = "grey, blue, orange"
COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, INK)
WIDTHS = {2: 3.9, 3: 4.6}
DOT: Any = {"ms": 3.5, "mec": INK, "mew": 0.5}


@dataclass(frozen=True)
class Body:
    """One state: nodes (n, d), triangles (m, 3) of the body or of its surface, u (n, d), fields (n,) or (m,), contact points."""

    time: float
    nodes: Array
    triangles: Any
    u: Array
    fields: dict[str, Array]
    points: Array  # where the contact points are, undeformed (points, d)
    moved: Array  # their displacement, (points, d)
    status: Any  # 0 open, 1 stick, 2 slip, (points,)

    @property
    def dim(self) -> int:
        return int(self.nodes.shape[1])


def magnification(largest: float, size: float) -> float:
    """The largest of 1, 2, 5, 10, ... with which a displacement stays below a seventh of the body's size."""
    candidates = [m * 10.0**e for e in range(9) for m in (1, 2, 5)]
    return max([m for m in candidates if m * largest <= size / 7], default=1.0)


def outline(triangles: Any) -> Any:
    """Edges that belong to one triangle alone, (edges, 2)."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    found, count = np.unique(edges, axis=0, return_counts=True)
    return found[count == 1]


def creases(nodes: Array, triangles: Any, towards: Array, turn: float = 30.0) -> Any:
    """Edges of a surface at which it turns by more than `turn` degrees and that are seen from a direction, (edges, 2)."""
    corners = nodes[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    outwards = np.sum(normals * (corners.mean(axis=1) - nodes[triangles].mean(axis=(0, 1))), axis=1)
    normals *= np.where(outwards < 0, -1.0, 1.0)[:, None]
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    order = np.lexsort(edges.T)
    edges, faces = edges[order], np.tile(np.arange(len(triangles)), 3)[order]
    first = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    one, other = normals[faces[first]], normals[faces[first + 1]]
    sharp = np.sum(one * other, axis=1) < np.cos(np.radians(turn))
    seen = np.maximum(one @ towards, other @ towards) > 0
    return edges[first[sharp & seen]]


def directions(ax: Any, elevation: float, azimuth: float) -> None:
    """Three arrows along the axes, seen from a direction (radians), in the lower left corner."""
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.array([-np.sin(elevation) * np.cos(azimuth), -np.sin(elevation) * np.sin(azimuth), np.cos(elevation)])
    for axis, name in enumerate("xyz"):
        seen = 0.1 * np.array([right[axis], up[axis]])
        start = np.array([0.06, 0.1])
        arrow = {"arrowstyle": "-|>", "color": GREY, "lw": 0.9, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
        at = {"xycoords": "axes fraction", "textcoords": "axes fraction"}
        ax.annotate("", start + seen, start, arrowprops=arrow, **at)
        ax.annotate(
            name, start + 1.35 * seen, start + 1.35 * seen, color=GREY, ha="center", va="center", fontsize=9, **at
        )


def panel(figure: Figure, place: Any, body: Body, name: str, *, factor: float, norm: Normalize) -> Any:
    """The deformed body coloured by one of its fields, on new axes, which are returned."""
    ax = figure.add_subplot(place, projection="3d" if body.dim == 3 else None)
    panel_on(figure, ax, body, name, factor=factor, norm=norm)
    return ax


def panel_on(figure: Any, ax: Any, body: Body, name: str, *, factor: float, norm: Normalize) -> None:
    """As `panel`, on axes that are there."""
    values, moved = body.fields[name], body.nodes + factor * body.u
    colours = MAPS.get(name, cm.batlow)
    if body.dim == 3:
        value = values if len(values) == len(body.triangles) else values[body.triangles].mean(axis=1)
        shade = colours(norm(value))
        faces = Poly3DCollection(moved[body.triangles], facecolors=shade, edgecolors=shade, linewidths=0.3)
        ax.add_collection3d(faces)
        elevation, azimuth = np.radians(_seen_from(body))
        towards = np.array(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        )
        edges = creases(moved, body.triangles, towards)
        ax.add_collection3d(Line3DCollection(moved[edges], colors=INK, linewidths=0.8, zorder=3))
        low, high = moved.min(axis=0), moved.max(axis=0)
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]), box_aspect=high - low)
        ax.set_axis_off()
        ax.view_init(*_seen_from(body))
        directions(ax, elevation, azimuth)
    else:
        drawn: Any = {"cmap": colours, "norm": norm, "rasterized": True}
        if len(values) == len(body.triangles):
            ax.tripcolor(*moved.T, body.triangles, facecolors=values, **drawn)
        else:
            ax.tripcolor(*moved.T, body.triangles, values, shading="gouraud", **drawn)
        edges = outline(body.triangles)
        ax.add_collection(LineCollection(body.nodes[edges], colors=GREY, linewidths=0.6, linestyles=(0, (4, 3))))
        ax.add_collection(LineCollection(moved[edges], colors=INK, linewidths=0.8))
        at = body.points + factor * body.moved
        for number_, (_, colour) in enumerate(STATUS):
            on = body.status == number_
            ax.plot(*at[on].T, "o", mfc=colour, **DOT)
        ax.set_aspect("equal")
        ax.autoscale_view()
        ax.spines[:].set_visible(False)
        ax.tick_params(length=2, color=GREY, labelcolor=GREY)
    ax.set_title(name)
    extend = "max" if norm.vmax is not None and values.max() > norm.vmax else "neither"
    figure.colorbar(plt.cm.ScalarMappable(norm, colours), ax=ax, shrink=0.75, pad=0.02, extend=extend)


def _seen_from(body: Body) -> tuple[float, float]:
    """Elevation and azimuth in degrees that show the contact points, from above without any."""
    if not len(body.points):
        return 30.0, -60.0
    towards = body.points.mean(axis=0) - 0.5 * (body.nodes.min(axis=0) + body.nodes.max(axis=0))
    towards = towards / (np.ptp(body.nodes, axis=0).max() + 1e-300)
    azimuth = float(np.degrees(np.arctan2(towards[1], towards[0]))) + 25 if np.hypot(*towards[:2]) > 0.1 else -60.0
    return (-25.0 if towards[2] < -0.1 else 30.0), azimuth


def norm_of(bodies: Iterable[Body], name: str) -> Normalize:
    """One scale for several states."""
    values = [body.fields[name] for body in bodies]
    low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    if name == "von Mises stress":  # corners where a support ends are singular
        low, high = 0.0, max(float(np.percentile(v, 99)) for v in values)
    return Normalize(low, high if high > low else low + 1e-12 + abs(low))


def legend_of_status(figure: Figure) -> None:
    """What the colours of the contact points say, below the panels."""
    dots = [Line2D([], [], ls="", marker="o", mfc=colour, label=name, **DOT) for name, colour in STATUS]
    figure.legend(handles=dots, loc="outside lower center", ncols=len(dots), handletextpad=0.1, columnspacing=1.5)


def height(body: Body, factor: float) -> float:
    """Of a figure whose panels leave no empty bands above and below a flat body, inches."""
    if body.dim == 3:
        return 3.8
    seen = np.ptp(np.concatenate([body.nodes, body.nodes + factor * body.u]), axis=0)
    return float(np.clip(1.2 + 2.9 * seen[1] / seen[0], 1.9, 3.9))


def bodies(body: Body, factor: float) -> tuple[Figure, str]:
    """The body, a panel a field."""
    names = list(body.fields)
    figure = plt.figure(figsize=(WIDTHS[body.dim] * len(names), height(body, factor)), layout="compressed")
    magnified = f", displacement {factor:g} times magnified" if factor != 1 else ""
    figure.suptitle(f"t = {number(body.time)}{magnified}", fontsize=10)
    if len(body.points) and body.dim == 2:
        legend_of_status(figure)
    grid = figure.add_gridspec(1, len(names))
    for i, name in enumerate(names):
        panel(figure, grid[i], body, name, factor=factor, norm=norm_of([body], name))
    message = [f"{name} {number(float(v.min()))} to {number(float(v.max()))}" for name, v in body.fields.items()]
    points = ""
    if body.dim == 2 and "von Mises stress" in body.fields:
        points = "; the von Mises stress counts that along z, 0 in plane stress"
    if len(body.points):
        points += "; contact points: " + ", ".join(
            f"{int((body.status == i).sum())} {name}" for i, (name, _) in enumerate(STATUS)
        )
        if body.dim == 2:
            points += f" ({COLOURS_OF_STATUS})"
    dashed = ", dashed the undeformed outline" * (body.dim == 2)
    return figure, f"The body at t = {number(body.time)}{magnified}{dashed}: {'; '.join(message)}{points}."


def contact(parts: dict[str, dict[str, Array]], time: float) -> tuple[Figure, str]:
    """What the contact feels: along the part in the plane, on it in space. Each part has `position` (n,) or (n, 2) and fields."""
    rows = ("pressure", "friction traction", "gap", "slip")
    figure, axes = plt.subplots(len(parts), len(rows), figsize=(12, 2.7 * len(parts)), squeeze=False)
    for line, (part, fields) in zip(axes, parts.items(), strict=True):
        for ax, name in zip(line, rows, strict=True):
            x, values = fields["position"], fields[name]
            if x.ndim == 1:
                for i, (_, colour) in enumerate(STATUS):
                    on = fields["status"] == i
                    ax.plot(x[on], values[on], "o", mfc=colour, **DOT)
                if len(np.unique(x)) == len(x):  # else a node has a point for the normal of each of its facets
                    ax.plot(x, values, "-", color=GREY, lw=0.8, zorder=0)
                ax.axhline(0, color=GREY, lw=0.5)
                ax.set_xlabel("along the part")
            else:
                display = ax.scatter(*x.T, c=values, cmap=cm.batlow, s=14)
                figure.colorbar(display, ax=ax, shrink=0.8)
                ax.set_aspect("equal")
            ax.set_title(f"{part}: {name}")
    largest = [f"{part} {number(float(f['pressure'].max()))}" for part, f in parts.items()]
    output = f"Contact at t = {number(time)}"
    if any(fields["position"].ndim == 1 for fields in parts.values()):
        legend_of_status(figure)
        output += f"; points that are open, stick, slip are {COLOURS_OF_STATUS}"
    return figure, f"{output}. Largest pressure: {', '.join(largest)}."


def history(time: Array, panels: dict[str, dict[str, Array]]) -> tuple[Figure, str]:
    """Time series, a panel a group; the group `residuals` on a logarithmic axis."""
    columns = min(2, len(panels))
    lines = -(-len(panels) // columns)
    figure = plt.figure(figsize=(5.2 * columns, 2.6 * lines))
    grid = figure.add_gridspec(lines, columns)
    alone = len(panels) % columns == 1  # the last panel then takes its line, and its ticks are not those above
    for i, (title, series) in enumerate(panels.items()):
        line, column = divmod(i, columns)
        last = line == lines - 1
        ax = figure.add_subplot(grid[line, :] if alone and last else grid[line, column])
        for (name, values), other in zip(series.items(), COLOURS * 4, strict=False):
            colour = dict(STATUS).get(name, other) if title == "contact points" else other
            ax.plot(
                time, np.where(values > 0, values, np.nan) if title == "residuals" else values, color=colour, label=name
            )
        if title == "residuals":
            ax.set_yscale("log")
        ax.set_title(title)
        ax.legend(loc="best", fontsize=7)
        if last:
            ax.set_xlabel("t")
        elif not alone:
            ax.tick_params(labelbottom=False)
    return figure, f"{len(time)} steps to t = {number(float(time[-1]))}: {', '.join(panels)}."


def animation(
    states: list[Body], name: str, factor: float, out: Path, progress: Callable[[int, int], None] | None = None
) -> None:
    """The body coloured by one field through time, as GIF."""
    norm = norm_of(states, name)
    figure = plt.figure(figsize=(WIDTHS[states[0].dim], 3.6), layout="compressed")
    moved = np.concatenate([b.nodes + factor * b.u for b in states] + [states[0].nodes])
    low, high = moved.min(axis=0), moved.max(axis=0)
    edge = 0.03 * (high - low).max()
    writer = PillowWriter(fps=12)
    with writer.saving(figure, str(out), dpi=100):
        for i, body in enumerate(states):
            figure.clear()
            panel(figure, figure.add_gridspec(1, 1)[0], body, name, factor=factor, norm=norm)
            ax = figure.axes[0]
            ax.set(xlim=(low[0] - edge, high[0] + edge), ylim=(low[1] - edge, high[1] + edge))
            ax.set_title(f"{name}, t = {body.time:.3f}")
            writer.grab_frame()
            if progress:
                progress(i + 1, len(states))
    plt.close(figure)
