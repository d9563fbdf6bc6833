"""Figures 2-4: the body at the final time for two foundations, side by side."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import matplotlib.pyplot as plt
import numpy as np
from cmcrameri import cm
from matplotlib.colors import Colormap, Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from warmslip.figures.style import GREY, INK, PALE, SKY, VERMILLION, number
from warmslip.scene.full import FullScene, build_full
from warmslip.typing import Array

STATUS = (("open", "white"), ("stick", SKY), ("slip", VERMILLION))


@dataclass(frozen=True)
class Final:
    """The last state of a run: nodes (n, 2), cells (m, 3), u (n, 2), theta (n,), contact points and their status."""

    scene: FullScene
    time: float
    nodes: Array
    cells: Any
    u: Array
    theta: Array
    mises: Array | None
    points: Array
    displacement: Array
    status: Any

    @property
    def theta_f(self) -> str:
        return f"{self.scene.contact.heat_exchange.foundation_temperature:g}"

    @property
    def foundation(self) -> str:
        return rf"$\theta_F = {self.theta_f}$"


def final(path: Path) -> Final:
    """The last state. Raises ValueError for a body in space, OSError for what is no trajectory."""
    with h5py.File(path, "r") as file:
        if file["mesh/nodes"].shape[1] != 2:
            raise ValueError("a body in space cannot be drawn here: open its final.vtu in ParaView")
        return Final(
            scene=build_full({k: v for k, v in json.loads(file.attrs["scene"]).items() if v is not None}),
            time=float(file["states/time"][-1]),
            nodes=file["mesh/nodes"][:],
            cells=file["mesh/cells"][:],
            u=file["states/u"][-1],
            theta=file["states/theta"][-1],
            mises=file["fields/mises"][:] if "fields/mises" in file else None,
            points=file["contact/positions"][:],
            displacement=file["contact/displacement"][-1],
            status=file["contact/status"][-1],
        )


def magnification(largest: float) -> float:
    """The largest of 1, 2, 5, 10, ... with which the displacement stays below 0.15."""
    candidates = [m * 10.0**e for e in range(9) for m in (1, 2, 5)]
    return max([m for m in candidates if m * largest <= 0.15], default=1.0)


def panels(runs: list[Final], factor: float, height: float = 3.6) -> tuple[Figure, Any]:
    """One panel a run on common axes, with the undeformed outline and the foundation."""
    figure, axes = plt.subplots(
        1, len(runs), figsize=(3.9 * len(runs), height), sharex=True, sharey=True, squeeze=False
    )
    moved = np.vstack([r.nodes + factor * r.u for r in runs])
    low, high = np.minimum(moved.min(axis=0), 0) - 0.04, np.maximum(moved.max(axis=0), 1) + 0.04
    low[1] = min(low[1], -0.12)
    for ax, run in zip(axes[0], runs, strict=True):
        ax.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[0, 0.5, 1], yticks=[0, 0.5, 1])
        ax.add_patch(Rectangle((-9, -9), 20, 9 - run.scene.contact.gap * factor, fc=PALE, ec=GREY, hatch="////", lw=0))
        ax.axhline(-run.scene.contact.gap * factor, color=INK, lw=1)
        ax.add_patch(Rectangle((0, 0), 1, 1, fill=False, ec=GREY, ls=(0, (4, 3)), lw=0.8, zorder=3))
        ax.set_title(run.foundation)
        ax.spines[:].set_visible(False)
        ax.tick_params(length=2, color=GREY, labelcolor=GREY)
    return figure, axes[0]


def lattice(nodes: Array, lines: int = 16) -> list[Any]:
    """Node numbers along about `lines` material lines in each direction of a structured mesh."""
    found = []
    for axis in (0, 1):
        values = np.unique(nodes[:, axis].round(9))
        for value in values[:: max(1, (len(values) - 1) // lines)]:
            on = np.flatnonzero(abs(nodes[:, axis] - value) < 1e-8)
            found.append(on[np.argsort(nodes[on, 1 - axis])])
    return found


def deformed(inputs: list[Path]) -> tuple[Figure, str]:
    """Figure 2: deformed configurations, the contact points coloured by their status."""
    runs = [final(path) for path in inputs]
    factor = magnification(max(float(abs(r.u).max()) for r in runs))
    figure, axes = panels(runs, factor)
    for ax, run in zip(axes, runs, strict=True):
        moved = run.nodes + factor * run.u
        for line in lattice(run.nodes):
            ax.plot(*moved[line].T, color=INK, lw=0.5, alpha=0.8, zorder=2)
        at = run.points + factor * run.displacement
        for code, (name, colour) in enumerate(STATUS):
            here = run.status == code
            ax.scatter(
                *at[here].T, s=14, c=colour, ec=INK, lw=0.5, zorder=4, label=f"{name} ({here.sum()})", clip_on=False
            )
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=3, handletextpad=0.1, columnspacing=1)
    scale = "true scale" if factor == 1 else f"displacement magnified {factor:g} times"
    figure.suptitle(scale, fontsize=9, color=GREY)
    lines = [
        f"For theta_F = {r.theta_f}: largest displacement "
        f"{number(float(np.linalg.norm(r.u, axis=1).max()))}, contact points open/stick/slip "
        f"{'/'.join(str((r.status == code).sum()) for code in range(3))}, deepest penetration "
        f"{number(float(max(0.0, (-r.displacement[:, 1]).max() - r.scene.contact.gap)))}."
        for r in runs
    ]
    return figure, caption(runs, f"deformed configuration, {scale}, dashed: undeformed", lines)


def temperature(inputs: list[Path]) -> tuple[Figure, str]:
    """Figure 3: temperature on the deformed body, one colour scale."""
    runs = [final(path) for path in inputs]
    figure, axes = panels(runs, 1.0)
    norm = PowerNorm(0.5, min(r.theta.min() for r in runs), max(r.theta.max() for r in runs))
    for ax, run in zip(axes, runs, strict=True):
        image = ax.tripcolor(*(run.nodes + run.u).T, run.cells, run.theta, cmap=cm.lipari, norm=norm, shading="gouraud")
        ax.set_title(f"{run.foundation}:  {number(run.theta.min())} to {number(run.theta.max())}")
    figure.colorbar(
        image, ax=list(axes), label=r"temperature $\theta$, colours by its square root", shrink=0.8, aspect=25
    )
    lines = [
        f"For theta_F = {r.theta_f} the temperature ranges from "
        f"{number(float(r.theta.min()))} to {number(float(r.theta.max()))}."
        for r in runs
    ]
    return figure, caption(
        runs, "temperature on the deformed body (true scale), one colour scale by the square root", lines
    )


def mises(inputs: list[Path]) -> tuple[Figure, str]:
    """Figure 4: von Mises stress a cell, the colours clipped at the 99th percentile."""
    runs = [final(path) for path in inputs]
    values = [missing(path) if r.mises is None else r.mises for path, r in zip(inputs, runs, strict=True)]
    figure, axes = panels(runs, 1.0)
    norm = Normalize(0, float(np.percentile(np.concatenate(values), 99)))
    palette: Colormap = cm.batlow
    for ax, run, stress in zip(axes, runs, values, strict=True):
        image = ax.tripcolor(*(run.nodes + run.u).T, run.cells, facecolors=stress, cmap=palette, norm=norm)
        ax.set_title(f"{run.foundation}:  median {number(float(np.median(stress)))}, largest {number(stress.max())}")
    figure.colorbar(image, ax=list(axes), label="von Mises stress", extend="max", shrink=0.8, aspect=25)
    lines = [
        "The norm of a cell is sqrt(s11^2 + s22^2 - s11 s22 + 3 s12^2) = sqrt(3/2 s:s), s the deviator of the stress "
        "(2.1) with its out-of-plane entries zero. Its maximum grows without bound as the mesh is refined, at the two "
        "clamped corners, where the stress is singular: the colours end at the 99th percentile of both fields, "
        f"{number(float(norm.vmax or 0))}.",
        *(
            f"For theta_F = {r.theta_f}: median {number(float(np.median(v)))}, "
            f"largest {number(float(v.max()))} on this mesh."
            for r, v in zip(runs, values, strict=True)
        ),
    ]
    return figure, caption(runs, "von Mises stress on the deformed body (true scale)", lines)


def missing(path: Path) -> Array:
    raise KeyError(f"{path} has no dataset fields/mises; write it again with `warmslip run`")


def caption(runs: list[Final], what: str, lines: list[str]) -> str:
    scene = runs[0].scene
    head = f"{scene.title}: {what}, at t = {runs[0].time:g} (h = 1/{scene.mesh.counts[0]}, k = 1/{1 / scene.step:g})."
    return " ".join([head, *lines])
