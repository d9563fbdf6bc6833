"""Work against precision: what an error costs, and which runs are worth their price."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from warmslip import rates


def problem_of(case: str) -> str:
    """The problem a case solves: reading and foundation temperature, `printed_0` of `printed_0_lagged`."""
    return "_".join(case.split("_")[:2])


def table(paths: list[Path]) -> list[dict[str, Any]]:
    """Error (largest |u|_V + |w|_L2 + |theta|_L2), CPU seconds and counts of every run, with the front of each problem.

    A run is on the front when no other run of the same problem is both cheaper and at least as accurate. Each coupling and
    quadrature is measured against its own finest solution, and members on the reference's mesh or clock are left out.
    """
    out: list[dict[str, Any]] = []
    for path in paths:
        parts = path.stem.split("_")
        *members, reference = rates.read(path)
        for line in members:
            if line["n"] == reference["n"] or line["steps"] == reference["steps"]:
                continue  # it shares the reference's error in space or in time, which its own measure therefore lacks
            keep = (
                "n",
                "steps",
                "cpu_seconds",
                "factor_bytes",
                "substitutions",
                "factorizations",
                "dense_factorizations",
                "newton_iterations",
            )
            out.append(
                {
                    "case": path.stem,
                    "problem": problem_of(path.stem),
                    "coupling": parts[2],
                    "quadrature": parts[3] if len(parts) > 3 else "nodal",
                }
                | {"error": line["e_u_w_theta"]}
                | {key: line[key] for key in keep}
            )
    for run in out:
        run["front"] = not any(
            other is not run
            and other["problem"] == run["problem"]
            and other["error"] <= run["error"]
            and other["cpu_seconds"] < run["cpu_seconds"]
            for other in out
        )
    return out
