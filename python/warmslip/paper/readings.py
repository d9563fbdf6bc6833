"""Which reading of the paper's data satisfies which of the paper's claims: computed from the studies, not assumed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from warmslip.records import tables
from warmslip.studies import rates

# the legible ticks of figure 5: the curve they label must lie among them and use them
TICKS = (5.0e-3, 1.5e-1)
UPPER_TICK = 5.0e-2
# "linear convergence is almost observed": the plain order of the whole curve
ALMOST_LINEAR = (0.85, 1.25)
# the paper's words: deformation, stress norm and temperature are larger on the hotter foundation
LARGER = {"deformation": "norm_u_V", "displacement": "norm_u_L2", "stress": "mises_L2", "temperature": "norm_theta_L2"}


def _yes(condition: bool) -> str:
    return "yes" if condition else "no"


def curve(path: Path, term: str) -> tuple[list[float], list[float]]:
    """h and the error of `term` along the diagonal h = k, coarsest first."""
    rows = sorted((r for r in tables.read(path)[:-1] if r["n"] == r["steps"]), key=lambda r: -r["h"])
    return [r["h"] for r in rows], [r[f"e_{term}"] for r in rows]


def figure_five(path: Path, term: str) -> dict[str, Any]:
    """Whether the error curve of one study could be the one of figure 5: among the ticks, and almost linear."""
    h, errors = curve(path, term)
    order, _ = rates.least_squares(h, errors)
    among = all(TICKS[0] <= e <= TICKS[1] for e in errors) and max(errors) > UPPER_TICK
    return {
        "coarsest": errors[0],
        "finest": errors[-1],
        "order": order,
        "ticks": _yes(among),
        "linear": _yes(ALMOST_LINEAR[0] <= order <= ALMOST_LINEAR[1]),
    }


def table(paths: list[Path], coupling: str = "staggered") -> list[dict[str, Any]]:
    """One row a reading, from the studies `{reading}_{theta_F}_{coupling}.csv` at the coldest and the hottest foundation."""
    cases: dict[str, dict[float, Path]] = {}
    for path in paths:
        parts = path.stem.split("_")
        if parts[2:] == [coupling]:
            cases.setdefault(parts[0], {})[float(parts[1])] = path
    out = []
    for reading, by_temperature in cases.items():
        cold, hot = min(by_temperature), max(by_temperature)
        line: dict[str, Any] = {"reading": reading}
        for temperature in (cold, hot):
            for term in ("u_theta", "u_w_theta"):
                found = figure_five(by_temperature[temperature], term)
                line |= {f"{key}_{term}_{temperature:g}": value for key, value in found.items()}
        ends = {t: tables.read(p)[-1] for t, p in by_temperature.items()}
        for claim, column in LARGER.items():
            ratio = ends[hot][column] / ends[cold][column]
            line |= {f"{claim}_ratio": ratio, f"{claim}_larger": _yes(ratio > 1)}
        line["all_larger"] = _yes(all(line[f"{claim}_larger"] == "yes" for claim in LARGER))
        out.append(line)
    return out
