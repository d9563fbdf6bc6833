"""Figure 1: the physical setting, drawn from the scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from warmslip.figures.fields import final
from warmslip.figures.style import BLUE, GREEN, GREY, INK, PALE, VERMILLION
from warmslip.scene.full import FullScene, full_model
from warmslip.scene.reader import load

# a part of the square: its start, its direction
SIDES = {"left": ((0, 0), (0, 1)), "right": ((1, 0), (0, 1)), "bottom": ((0, 0), (1, 0)), "top": ((0, 1), (1, 0))}
OUTWARD = {"left": (-1, 0), "right": (1, 0), "bottom": (0, -1), "top": (0, 1)}
SCALE = 0.18  # length of an arrow a unit of load


def setting(inputs: list[Path]) -> tuple[Figure, str]:
    """The body of the first input's scene; the foundation temperatures of all. Inputs are scenes or trajectories."""
    scenes = [full_model(load(path)) if path.suffix == ".toml" else final(path).scene for path in inputs]
    scene = scenes[0]
    if scene.mesh.shape != "square":
        raise ValueError(f"the setting is drawn for a square; this scene has a {scene.mesh.shape}")
    temperatures = list(dict.fromkeys(s.contact.heat_exchange.foundation_temperature for s in scenes))
    foundation = r"$\theta_F = $" + " or ".join(f"{value:g}" for value in temperatures)
    figure, ax = plt.subplots(figsize=(7.8, 4.6))
    ax.set(aspect="equal", xlim=(-0.52, 2.3), ylim=(-0.3, 1.24))
    ax.axis("off")
    ax.add_patch(Rectangle((0, 0), 1, 1, fc="#f3efe6", ec=INK, lw=1.2))
    for part in scene.supports.displacement:
        strip(ax, part, 0.05)
    ax.text(0.5, 1.085, r"$\Gamma_D$: $u = 0$, $\theta = 0$", ha="center", va="bottom")
    for part, vector in scene.loads.traction.items():
        traction(ax, part, np.array(vector), "1" if part == "left" else "2")
    body_force(ax, np.array(scene.loads.body))
    ax.add_patch(Rectangle((-0.3, -0.13), 1.6, 0.115, fc=PALE, ec=GREY, hatch="////", lw=0))
    ax.plot([-0.3, 1.3], [-0.015, -0.015], color=INK, lw=1.2)
    ax.text(0.5, -0.155, f"foundation, {foundation}", ha="center", va="top", color=VERMILLION)
    ax.text(0.5, 0.03, rf"$\Gamma_C$: gap $g = {scene.contact.gap:g}$", ha="center", va="bottom", color=BLUE)
    ax.text(0.2, 0.86, r"$\Omega = (0,1)^2$", ha="center", va="center")
    ax.text(1.58, 1.04, "\n".join(data(scene)), va="top", ha="left", fontsize=8.8, linespacing=1.65)
    return figure, caption(scene, temperatures)


def strip(ax: Any, part: str, width: float) -> None:
    """The hatched wall behind a clamped part."""
    (x, y), along = SIDES[part]
    out = np.array(OUTWARD[part])
    corner = np.minimum((x, y), np.array((x, y)) + width * out)
    size = np.abs(np.array(along)) + width * np.abs(out)
    ax.add_patch(Rectangle(tuple(corner), *size, fc="white", ec=GREY, hatch="/////", lw=0))
    ax.plot([x, x + along[0]], [y, y + along[1]], color=INK, lw=2)


def traction(ax: Any, part: str, vector: Any, index: str) -> None:
    """Arrows of the prescribed traction, to scale; they end on the part when they push, start there when they pull."""
    (x, y), along = SIDES[part]
    length = SCALE * vector
    pushes = float(vector @ np.array(OUTWARD[part])) < 0
    for s in np.linspace(0.14, 0.86, 5):
        foot = np.array((x, y)) + s * np.array(along) - (length if pushes else 0)
        ax.annotate(
            "",
            foot + length,
            foot,
            arrowprops={"arrowstyle": "-|>", "color": GREEN, "lw": 1.4, "shrinkA": 0, "shrinkB": 0},
        )
    out = np.array(OUTWARD[part])
    at = np.array((x + 0.5 * along[0], y + 0.5 * along[1])) + 0.30 * out
    value = ", ".join(f"{v:g}" for v in vector)
    ax.text(
        at[0],
        1.0,
        rf"$\Gamma_N^{index}$" "\n" rf"$f_N^{index} = ({value})$",
        ha="center",
        va="center",
        color=GREEN,
        fontsize=8.8,
    )


def body_force(ax: Any, vector: Any) -> None:
    start = np.array((0.5, 0.6))
    ax.annotate(
        "", start + SCALE * vector, start, arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.6, "shrinkA": 0}
    )
    ax.text(0.53, 0.5, rf"$f_0 = ({vector[0]:g}, {vector[1]:g})$", va="center", fontsize=8.8)


def data(scene: FullScene) -> list[str]:
    """The data, a line each."""
    e, v, c, heat = scene.elasticity, scene.viscosity, scene.contact, scene.heat
    lame, viscous = e.pair(2), v.pair(2)
    elastic = (
        rf"$E = {e.young:g}$, $\kappa = {e.poisson:g}$"
        if e.young is not None
        else rf"$\lambda = {lame[0]:g}$, $\mu = {lame[1]:g}$"
    )
    return [
        elastic + r"   (elasticity $\mathcal{F}$)",
        rf"$\mu_1 = {viscous[0]:g}$, $\mu_2 = {2 * viscous[1]:g}$   (viscosity $\mathcal{{A}}$)",
        rf"$\rho = {scene.inertia.density:g}$, $T = {scene.time.end:g}$",
        rf"$K = {matrix(heat.conductivity)}$",
        rf"$M = {matrix(heat.expansion.tensor)}$,  $R = {matrix(heat.heating.tensor)}$",
        rf"$q_0 = {heat.source:g}$, $k_c = {c.heat_exchange.conductance:g}$",
        rf"$p_\nu(r) = {power(c.stiffness)}\,r_+$",
        rf"$p_\tau = {c.friction.coefficient:g}\,p_\nu$",
        r"$u_0 = 0$, $v_0 = 0$, $\theta_0 = " + f"{scene.initial.temperature:g}$",
        "$\\theta = 0$ on " + ", ".join(scene.supports.temperature),
    ]


def matrix(rows: list[list[float]]) -> str:
    return "[" + r";\ ".join(r"\ ".join(f"{x:g}" for x in row) for row in rows) + "]"


def power(value: float) -> str:
    exponent = round(np.log10(value)) if value > 0 else 0
    return f"10^{{{exponent}}}" if value == 10.0**exponent and exponent > 2 else f"{value:g}"


def caption(scene: FullScene, temperatures: list[float]) -> str:
    c = scene.contact
    loads = "; ".join(
        f"({', '.join(f'{v:g}' for v in vector)}) on the {part}" for part, vector in scene.loads.traction.items()
    )
    return (
        f"{scene.title}: the setting, drawn from the scene. The body is clamped at the "
        f"{' and '.join(scene.supports.displacement)}, loaded by the tractions {loads} (arrows to scale), and rests on "
        f"a foundation at temperature {' or '.join(f'{t:g}' for t in temperatures)} with normal compliance "
        f"c_nu = {c.stiffness:g}, friction coefficient {c.friction.coefficient:g}, gap {c.gap:g} and heat exchange "
        f"k_c = {c.heat_exchange.conductance:g}."
    )
