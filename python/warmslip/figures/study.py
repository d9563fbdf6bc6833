"""A refinement study of any scene: errors against the mesh size, with the orders between grids."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from warmslip.figures.style import GREY, TERMS, column, grid_lines, number
from warmslip.records import tables


def study(inputs: list[Path]) -> tuple[Figure, str]:
    """The error of every field along the levels on which h and k shrink together, one study a panel."""
    figure, axes = plt.subplots(1, len(inputs), figsize=(4.6 * len(inputs), 3.9), squeeze=False)
    message = [_panel(ax, path) for ax, path in zip(axes[0], inputs, strict=True)]
    axes[0, 0].set_ylabel("largest error over time")
    return figure, " ".join(message)


def _panel(ax: Any, path: Path) -> str:
    lines = tables.texts(path)
    finest = lines[-1]
    steps_per_level = int(finest["steps"]) / int(finest["n"])
    table = sorted(
        (line for line in lines[:-1] if int(line["steps"]) == steps_per_level * int(line["n"])),
        key=lambda line: int(line["n"]),
    )
    if not table:
        raise ValueError("it has no levels on which h and k shrink together")
    h, message = column(table, "h"), []
    for name, (label, colour, marker) in TERMS.items():
        errors = column(table, f"e_{name}")
        if not (errors > 0).all():  # a field that the scene does not have
            continue
        ax.loglog(h, errors, marker=marker, color=colour, label=label, mec="white", mew=0.5)
        orders = np.log(errors[1:] / errors[:-1]) / np.log(h[1:] / h[:-1])
        output = ", ".join(number(order, 2) for order in orders) or "-"
        message.append(f"{name} {number(errors[0])} to {number(errors[-1])}, orders {output}")
    low, high = ax.get_ylim()
    ax.loglog(h, h * low * 1.2 / h.min(), ls=(0, (4, 3)), color=GREY, lw=0.8, label="$h$")
    ax.set(ylim=(low, high), xlabel="$h$", title=path.stem)
    ax.set_xticks(h, [number(one) for one in h])
    ax.minorticks_off()
    grid_lines(ax)
    ax.legend(fontsize=8)
    return f"{path.stem}, against n = {finest['n']}, steps = {finest['steps']}, whose own error is in them: {'; '.join(message)}."
