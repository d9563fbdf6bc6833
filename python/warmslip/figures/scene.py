"""A scene before it runs: mesh, parts and what happens on them, loads, foundation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from warmslip.figures.run import creases, directions, outline
from warmslip.figures.style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, SKY, VERMILLION
from warmslip.typing import Array

COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, INK)
ARROW = 0.15  # length of the largest traction, over the size of the body
VIEWS = (-20.0, -60.0), (25.0, 130.0)  # elevation and azimuth, degrees: all sides of a box are seen


@dataclass(frozen=True)
class SceneSketch:
    """What is drawn of a scene: nodes (n, d), triangles (m, 3) of the body or of its surface, facets (f, d) and roles of parts.

    `tractions` are places and vectors (k, d) at the end of the run, `foundations` lines (k, 2) in the plane at t = 0, `points`
    the places of held nodes (k, d).
    """

    nodes: Array
    triangles: Any
    parts: dict[str, Any]
    roles: dict[str, list[str]]
    tractions: list[tuple[Array, Array]]
    foundations: list[Array]
    points: Array

    @property
    def dim(self) -> int:
        return int(self.nodes.shape[1])


def scene(given: SceneSketch, title: str) -> tuple[Figure, str]:
    """The figure and its caption."""
    figure = plt.figure(figsize=(7.5, 4.6), layout="constrained")
    colours = {part: COLOURS[i % len(COLOURS)] for i, part in enumerate(given.roles)}
    if given.dim == 2:
        _in_plane(figure.add_subplot(), given, colours)
    else:
        for i, view in enumerate(VIEWS, start=1):
            _in_space(figure.add_subplot(1, 2, i, projection="3d"), given, colours, view)
    handles = [
        Line2D([], [], color=colours[part], lw=3, label=f"{part}: {'; '.join(words)}")
        for part, words in given.roles.items()
    ]
    if given.foundations:
        handles.append(Line2D([], [], color=GREY, lw=2, label="foundation at t = 0"))
    if any(np.any(vectors) for _, vectors in given.tractions):
        handles.append(Line2D([], [], color=INK, marker=">", lw=1, label="traction at the end"))
    if len(given.points):
        handles.append(Line2D([], [], color=INK, marker="^", ls="", label="held point"))
    figure.legend(handles=handles, loc="outside lower center", ncols=1)
    figure.suptitle(title, fontsize=10)
    words = "; ".join(f"{part}: {', '.join(role)}" for part, role in given.roles.items())
    return figure, f"{title}, before the run. {words}."


def _in_plane(ax: Any, given: SceneSketch, colours: dict[str, str]) -> None:
    ax.triplot(*given.nodes.T, given.triangles, color=GREY, lw=0.3)
    ax.add_collection(LineCollection(given.nodes[outline(given.triangles)], colors=INK, linewidths=0.8))
    for part, colour in colours.items():
        ax.add_collection(LineCollection(given.nodes[given.parts[part]], colors=colour, linewidths=3, zorder=3))
    low, high = given.nodes.min(axis=0), given.nodes.max(axis=0)
    room = 0.25 * (high - low).max()
    for line in given.foundations:
        near = np.where(np.all((line > low - room) & (line < high + room), axis=1)[:, None], line, np.nan)
        ax.plot(*near.T, color=GREY, lw=2, zorder=2)
    _arrows(ax, given, float((high - low).max()))
    if len(given.points):
        ax.plot(*given.points.T, "^", color=INK, zorder=4)
    ax.set_aspect("equal")
    ax.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room), xlabel="x", ylabel="y")


def _arrows(ax: Any, given: SceneSketch, size: float) -> None:
    largest = max((float(np.linalg.norm(vectors, axis=1).max()) for _, vectors in given.tractions), default=0.0)
    for places, vectors in given.tractions if largest > 0 else []:
        some = np.unique(np.linspace(0, len(places) - 1, 7).astype(int))
        for place, vector in zip(places[some], ARROW * size / largest * vectors[some], strict=True):
            arrow = {"arrowstyle": "-|>", "color": INK, "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
            ax.annotate("", place, place - vector, arrowprops=arrow, zorder=5)


def _in_space(ax: Any, given: SceneSketch, colours: dict[str, str], view: tuple[float, float]) -> None:
    elevation, azimuth = np.radians(view)
    ax.add_collection3d(
        Poly3DCollection(given.nodes[given.triangles], facecolors=PALE, edgecolors=GREY, linewidths=0.2)
    )
    for part, colour in colours.items():
        faces = given.nodes[given.parts[part]]
        ax.add_collection3d(Poly3DCollection(faces, facecolors=colour, edgecolors=colour, linewidths=0.2, alpha=0.7))
    towards = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    edges = creases(given.nodes, given.triangles, towards)
    ax.add_collection3d(Line3DCollection(given.nodes[edges], colors=INK, linewidths=0.8, zorder=3))
    low, high = given.nodes.min(axis=0), given.nodes.max(axis=0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]), box_aspect=high - low)
    ax.set_axis_off()
    ax.view_init(*view)
    if len(given.points):
        ax.plot(*given.points.T, "^", color=INK, zorder=4)
    directions(ax, elevation, azimuth)
