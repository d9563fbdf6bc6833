"""The verdict: measured tables against bands and stored values. Nothing is computed here but comparisons."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.records import tables
from warmslip.records.check import Check
from warmslip.simulation.statistics import BALANCES
from warmslip.studies import rates
from warmslip.studies.error_norms import SUMS, TERMS

# orders on smooth data: h = k gives 1 everywhere, k = h^2 gives 1 in V and 2 in L2
EXPECTED_ORDERS = {"h=k": dict.fromkeys(TERMS, 1.0), "k=h^2": {"u_V": 1.0, "w_L2": 2.0, "theta_L2": 2.0}}
BELOW, ABOVE = 0.12, 0.35
MISFIT = 0.05
STORED = 0.02
BALANCE = 1e-11
EXTREME = 1e-9
# the safeguards heal a Newton iteration that is wrong, refinement a right-hand side that is: the answer is right all the
# same, and the cost tells. Sound, the safeguards serve a tenth of the steps on the coarsest grids and 0.3 % of the paper's, and
# only meshes finer than 1/64 are refined; a wrong tangent or threshold asks for them in nearly every step.
SAFEGUARDED, PLAIN = 0.25, 64
REFERENCE_NORMS = ("norm_u_V", "norm_w_L2", "norm_theta_L2", "normal_force")


def within(name: str, value: Any, low: Any, high: Any) -> Check:
    """A measured value, or word, that must lie between two others."""
    return Check(name, "", "comparison", low, value, low, high)


def near(name: str, value: float, stored: float | None) -> Check:
    """Within 2 % of the stored value, on both sides; a value that was never stored fails."""
    if stored is None:
        return within(f"{name} (no stored value)", value, float("nan"), float("nan"))
    width = STORED * abs(stored)
    return within(name, value, stored - width, stored + width)


def manufactured(path: Path, expected: dict[str, Any]) -> list[Check]:
    """Least-squares orders, misfits and finest errors of the manufactured solution."""
    rows, checks = tables.read(path), []
    for group, coupling in dict.fromkeys((r["path"], r["coupling"]) for r in rows):
        lines = [r for r in rows if (r["path"], r["coupling"]) == (group, coupling)]
        for term in TERMS:
            name, p = f"manufactured {group} {coupling} {term}", EXPECTED_ORDERS[group][term]
            errors = [r[f"e_{term}"] for r in lines]
            order, misfit = rates.least_squares([r["h"] for r in lines], errors)
            if (group, coupling, term) == ("h=k", "monolithic", "w_L2"):
                # space and time errors are of one size on the coarse meshes and the slope bends: a fit says nothing there,
                # so the last halving is judged and the misfit is not
                checks.append(within(f"{name} last order", lines[-1][f"order_{term}"], p - BELOW, p + ABOVE))
            else:
                checks.append(within(f"{name} order", order, p - BELOW, p + ABOVE))
                checks.append(within(f"{name} misfit", misfit, 0.0, MISFIT))
            checks.append(near(f"{name} finest", errors[-1], expected.get(f"{name} finest")))
        worst = float(np.max([largest(lines, i) for i in BALANCES]))
        checks.append(within(f"manufactured {group} {coupling} balances", worst, 0.0, BALANCE))
        checks.append(
            within(f"manufactured {group} {coupling} slips everywhere", lines[-1]["open"] + lines[-1]["stick"], 0, 0)
        )
    return checks


def largest(rows: list[dict[str, Any]], balance: str) -> float:
    """The largest residual of a balance over the rows; a nan anywhere stays a nan."""
    return float(np.max([row[f"residual_{balance}"] for row in rows]))


def study(path: Path, expected: dict[str, Any]) -> list[Check]:
    """Outcomes, balances and safeguards of every member, errors at the finest diagonal member, norms of the reference."""
    rows, case = tables.read(path), path.stem
    checks = [
        within(f"{case} runs that were not completed", sum(r["outcome"] != "completed" for r in rows), 0, 0),
        *(within(f"{case} {i} balance", largest(rows, i), 0.0, BALANCE) for i in BALANCES),
        within(
            f"{case} share of safeguarded steps",
            sum(r["safeguarded_steps"] for r in rows) / sum(r["steps"] for r in rows),
            0.0,
            SAFEGUARDED,
        ),
        within(f"{case} refined steps on h >= 1/{PLAIN}", sum(r["refinements"] for r in rows if r["n"] <= PLAIN), 0, 0),
    ]
    finest = max((r for r in rows[:-1] if r["n"] == r["steps"]), key=lambda r: r["n"])
    values = {f"{case} error {term}": finest[f"e_{term}"] for term in [*TERMS, *SUMS]}
    values |= {f"{case} reference {name}": rows[-1][name] for name in REFERENCE_NORMS}
    return checks + [near(name, value, expected.get(name)) for name, value in values.items()]


def closed(cell: dict[str, Any]) -> bool:
    """Whether a cell's balances close to EXTREME."""
    return all(cell[name] <= EXTREME for name in BALANCES)


def same(name: str, value: Any, stored: Any) -> Check:
    """Equal to the stored word; one that was never stored fails."""
    if stored is None:
        return within(f"{name} (no stored value)", value, "", "")
    return within(name, value, stored, stored)


def words(path: Path, columns: tuple[str, ...], key: tuple[str, ...], expected: dict[str, Any]) -> list[Check]:
    """Columns of words equal to what is stored, a check a cell."""
    names = [
        (f"{path.stem} {' '.join(str(r[k]) for k in key)} {c}", r[c])
        for r in tables.read(path)
        for c in columns
        if c in r
    ]
    return [same(name, value, expected.get(name)) for name, value in names]


def verdict(
    *,
    studies: list[Path],
    manufactured_table: Path | None,
    readings: Path | None,
    extremes: Path | None,
    expected: dict[str, Any],
) -> dict[str, Any]:
    """All checks; `passed` is their conjunction. `expected` maps check names to stored values."""
    checks = [check for path in studies for check in study(path, expected)]
    if manufactured_table:
        checks += manufactured(manufactured_table, expected)
    if readings:
        columns = tuple(
            c for c in tables.read(readings)[0] if c.startswith(("ticks_", "linear_")) or c.endswith("_larger")
        )
        checks += words(readings, columns, ("reading",), expected)
    if extremes:
        cells = tables.read(extremes)
        checks.append(within("extremes cells silently wrong", sum(r["verdict"] == "WRONG" for r in cells), 0, 0))
        open_balances = sum(r["verdict"] == "right" and not closed(r) for r in cells)
        checks.append(within("extremes right cells with open balances", open_balances, 0, 0))
        checks += words(extremes, ("verdict",), ("ladder", "value"), expected)
    failed = [c.case for c in checks if not c.passed]
    return {
        "passed": bool(checks) and not failed,
        "checks": len(checks),
        "failed": failed,
        "details": [asdict(c) | {"passed": c.passed} for c in checks],
    }


def record(result: dict[str, Any]) -> dict[str, Any]:
    """What a verdict would have to store for its value checks to pass: the measured values by name, for review before use."""
    compared = (" finest", " error ", " reference ")
    names = ((check["case"].removesuffix(" (no stored value)"), check["observed"]) for check in result["details"])
    return {name: value for name, value in names if isinstance(value, str) or any(mark in name for mark in compared)}


def load(path: Path) -> dict[str, Any]:
    """Stored values by check name; an absent file stores nothing."""
    return dict(json.loads(path.read_text(encoding="utf-8"))) if path.exists() else {}
