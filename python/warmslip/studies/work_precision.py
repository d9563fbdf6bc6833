"""Work against precision: what an error costs, and which runs are worth their price."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from warmslip.records import tables

COUPLINGS = ("staggered", "lagged", "monolithic")
METHOD = ("mesh", "time", "title", "output")  # tables of a scene that say how a problem is solved, not which


def named_parts(case: str) -> list[str] | None:
    """The words of a name READING_THETA_COUPLING, or with a quadrature after them; None for another name."""
    parts = case.split("_")
    return parts if len(parts) in (3, 4) and parts[2] in COUPLINGS else None


def scene_of(path: Path) -> dict[str, Any]:
    """The resolved scene in the stamp of a study. Raises ValueError for a table without its stamp."""
    try:
        return dict(json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))["scene"])
    except (FileNotFoundError, ValueError, LookupError, TypeError) as error:
        raise ValueError(f"'{path}' is no table of `warmslip study` with its stamp beside it; give one") from error


def problems_of(paths: list[Path]) -> dict[Path, str]:
    """The problem that each study solves: `printed_0` of `printed_0_lagged`, else the name of the first study of that problem.

    Studies whose scenes differ in mesh, steps, coupling and quadrature alone are of one problem.
    """
    found: dict[Path, str] = {}
    first: dict[str, str] = {}
    for path in paths:
        if parts := named_parts(path.stem):
            found[path] = "_".join(parts[:2])
            continue
        scene = {name: value for name, value in scene_of(path).items() if name not in METHOD}
        contacts = scene.get("contact") or []
        scene["contact"] = [
            {key: value for key, value in one.items() if key != "quadrature"}
            for one in (contacts if isinstance(contacts, list) else [contacts])
        ]
        found[path] = first.setdefault(json.dumps(scene, sort_keys=True), path.stem)
    return found


def method_of(path: Path) -> tuple[str, str]:
    """Coupling and quadrature: of the name `reading_theta_coupling`, with a quadrature or without, else of the stamp."""
    if parts := named_parts(path.stem):
        return parts[2], parts[3] if len(parts) > 3 else "nodal"
    scene = scene_of(path)
    contacts = scene.get("contact") or []
    contacts = contacts if isinstance(contacts, list) else [contacts]
    rules = dict.fromkeys(contact.get("quadrature", "nodal") for contact in contacts)
    return scene["time"]["coupling"], ", ".join(rules) or "nodal"


def table(paths: list[Path]) -> list[dict[str, Any]]:
    """Error (largest |u|_V + |w|_L2 + |theta|_L2), CPU seconds and counts of every run, with the front of each problem.

    A run is on the front when no other run of the same problem is both cheaper and at least as accurate. Each coupling and
    quadrature is measured against its own finest solution, and members on the reference's mesh or clock are left out.
    """
    out: list[dict[str, Any]] = []
    problems = problems_of(paths)
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
                    "problem": problems[path],
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
