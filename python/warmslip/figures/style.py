"""One look for every figure: type, colours safe for colour-blind readers, numbers, files."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

INK, GREY, PALE = "#222222", "#8a8a8a", "#eeeeee"
BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY = "#0072b2", "#d55e00", "#009e73", "#e69f00", "#a0528d", "#56b4e9"

COUPLINGS = ("staggered", "lagged", "monolithic")

# the terms of the theorem, their symbols and colours
TERMS = {
    "u_V": (r"$|u-u^{hk}|_V$", BLUE, "o"),
    "w_L2": (r"$|w-w^{hk}|_{L^2}$", GREEN, "s"),
    "theta_L2": (r"$|\theta-\theta^{hk}|_{L^2}$", VERMILLION, "^"),
}
SUMS = {
    "u_theta": (r"$u$ and $\theta$", GREY, "v"),
    "u_w_theta": (r"$u$, $w$ and $\theta$", INK, "D"),
}

_RC: Any = {
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titleweight": "normal",
    "axes.edgecolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": False,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "lines.markersize": 5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "mathtext.fontset": "dejavusans",
    "figure.constrained_layout.use": True,
    "savefig.dpi": 150,
}


class Case(NamedTuple):
    """What a study's file name says: reading_theta_coupling, or reading_theta_coupling_quadrature."""

    reading: str
    theta: str
    coupling: str
    quadrature: str = "nodal"

    @property
    def panel(self) -> str:
        return rf"$\theta_F = {self.theta}$"


def named(name: str | Path) -> Case | None:
    """What a file name READING_THETA_COUPLING says, None for another name."""
    words = Path(name).stem.split("_")
    return Case(*words) if len(words) in (3, 4) and words[2] in COUPLINGS else None


def case(name: str | Path) -> Case:
    """As `named`. Raises ValueError for another name."""
    found = named(name)
    if found is None:
        raise ValueError(
            f"'{Path(name).stem}' is not called READING_THETA_COUPLING; `warmslip draw study` draws any study"
        )
    return found


def applied() -> AbstractContextManager[None]:
    """The style, for a `with`."""
    return mpl.rc_context(_RC)


def column(table: list[dict[str, str]], name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """A column as numbers, blanks as nan."""
    return np.array([float(line[name] or "nan") for line in table])


def number(value: float, digits: int = 3) -> str:
    """A number as people write it: 0.0123, 1.23e-5, 1e12."""
    if not np.isfinite(value):
        return "-"
    mantissa, e, exponent = f"{value + 0.0:.{digits}g}".partition("e")  # no -0
    return mantissa + (f"e{int(exponent)}" if e else "")


def grid_lines(axes: Any) -> None:
    axes.grid(True, which="major")
    axes.set_axisbelow(True)


def save(figure: Figure, caption: str, out: Path) -> None:
    """Writes the PNG and its caption. Raises ValueError for a name of another kind of file, OSError."""
    if out.suffix != ".png":
        raise ValueError(f"figures are PNG files; give a name that ends in .png in place of '{out.name}'")
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, metadata={"Software": None})
    plt.close(figure)
    out.with_suffix(".rst").write_text(caption.strip() + "\n", encoding="utf-8")
