"""Work against precision: what an error costs, and which runs are worth their price."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from warmslip.records import tables


def problem_of(case: str) -> str:
    """The problem a case solves: reading and foundation temperature, `printed_0` of `printed_0_lagged`."""
    return "_".join(case.split("_")[:2])


def method_of(path: Path) -> tuple[str, str]:
    """Coupling and quadrature: of the name `reading_theta_coupling`, with a quadrature or without, else of the stamp."""
    parts = path.stem.split("_")
    if len(parts) > 2:
        return parts[2], parts[3] if len(parts) > 3 else "nodal"
    scene = json.loads(path.with_suffix(".json").read_text())["scene"]
    contact = scene.get("contact")
    return scene["time"]["coupling"], contact["quadrature"] if isinstance(contact, dict) else "nodal"


def table(paths: list[Path]) -> list[dict[str, Any]]:
    """Error (largest |u|_V + |w|_L2 + |theta|_L2), CPU seconds and counts of every run, with the front of each problem.

    A run is on the front when no other run of the same problem is both cheaper and at least as accurate. Each coupling and
    quadrature is measured against its own finest solution, and members on the reference's mesh or clock are left out.
    """
    out: list[dict[str, Any]] = []
    for path in paths:
        coupling, quadrature = method_of(path)
        *members, reference = tables.read(path)
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
                    "coupling": coupling,
                    "quadrature": quadrature,
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
