"""Where the error of a run comes from: bars of its estimated parts."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from warmslip.figures.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, grid_lines, number
from warmslip.records import tables

COLOURS = {
    "space": BLUE,
    "time": VERMILLION,
    "coupling": ORANGE,
    "stiffness": GREEN,
    "regularisation": PURPLE,
    "round-off": GREY,
}
LABELS = {
    "space": "mesh",
    "time": "steps",
    "coupling": "of these by the coupling",
    "stiffness": "finite stiffness against rigid",
    "regularisation": "regularised against exact friction",
    "round-off": "rounding",
}
NAMES = {"u_V": r"$|u|_V$", "w_L2": r"$|w|_{L^2}$", "theta_L2": r"$|\theta|_{L^2}$"}
LEAST = 1e-16  # of what is drawn


def error(inputs: list[Path]) -> tuple[Figure, str]:
    """Estimated relative errors of a run by quantity and part, on a logarithmic axis."""
    rows = tables.read(inputs[0])
    quantities = list(dict.fromkeys(row["quantity"] for row in rows))
    parts = [part for part in COLOURS if any(row["part"] == part for row in rows)]
    relative = {(row["quantity"], row["part"]): max(float(row["relative"]), LEAST) for row in rows}
    figure, ax = plt.subplots(figsize=(7.2, 0.9 + 0.62 * len(quantities)))
    height = 0.8 / len(parts)
    for i, part in enumerate(parts):
        at = np.arange(len(quantities)) + (i - (len(parts) - 1) / 2) * height
        values = [relative.get((quantity, part), LEAST) for quantity in quantities]
        ax.barh(at, values, height=0.9 * height, color=COLOURS.get(part, SKY), label=LABELS[part], left=0)
    ax.set(xscale="log", xlabel="estimated error over the largest value of the quantity", xlim=(1e-6, None))
    ax.set_yticks(range(len(quantities)), [NAMES.get(name, name.replace("_", " ")) for name in quantities])
    ax.invert_yaxis()
    grid_lines(ax)
    figure.legend(*ax.get_legend_handles_labels(), ncol=3, fontsize=8, loc="outside upper center")
    totals = "; ".join(
        f"{name.replace('_', ' ')} {number(100 * sum(relative.get((name, part), 0) for part in ('space', 'time')))} %"
        for name in quantities
    )
    return figure, f"Estimated relative errors from mesh and steps together: {totals}. Bars below 1e-6 are not seen."
