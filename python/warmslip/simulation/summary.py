"""What is left of a run in a few numbers: summary.json."""

from __future__ import annotations

import resource
import time
from typing import Any

import numpy as np

from warmslip._core import compiler, petsc_version
from warmslip.io import part_series
from warmslip.model.state import State, largest_values, resultants
from warmslip.records import provenance
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.statistics import digits

STATUSES = ("open", "stick", "slip")


def summary(simulation: Simulation) -> dict[str, Any]:
    """Outcome, norms, contact, balances, cost and stamp of a run as it stands (collective)."""
    s, d, report = simulation.stepper, simulation.discretisation, simulation.report
    norms, cost, statistics = d.norms, s.cost, simulation.statistics
    counters = {name: getattr(cost, name) for name in type(cost).items}
    force = np.reshape(s.contact_force, (1, -1, d.dim))
    parts = {name: float(values[0]) for name, values in resultants(d, force).items()}
    # a step that was rejected was evaluated last
    evaluated = report is not None and simulation.outcome in ("completed", "interrupted")
    by_part = part_series.last(d, s) if evaluated else {"reactions": {}, "heat_flows": {}}
    return {
        "outcome": simulation.outcome,
        "failure": simulation.failure,
        "warnings": simulation.warnings(),
        "time": s.time,
        "steps": simulation.taken,
        "step_sizes": [[size, count] for size, count in simulation.pace.record.sizes.items()],
        "rejected_steps": simulation.pace.record.rejected + simulation.pace.record.failed,
        "functions": d.user_functions,
        "norms": ({"u_V": norms.v(s.u), "u_L2": norms.l2(s.u), "w_L2": norms.l2(s.w)} if s.u is not None else {})
        | ({"theta_L2": norms.l2(s.theta)} if s.theta is not None else {}),
        "largest": largest_values(d, s),
        "contact": _contact(simulation, parts),
        **by_part,
        "balances": statistics.residuals,
        "digits": digits(statistics.trusted(s.extents)),
        "newton": {
            "iterations": cost.newton_iterations,
            "largest_step": statistics.newton_max,
            "stages": statistics.stages,
        },
        "cpu_seconds": time.process_time() - simulation.began[1],
        "wall_seconds": time.perf_counter() - simulation.began[0],
        "memory_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "cost": counters,
        "stamp": provenance.stamp(
            simulation.scene,
            petsc=petsc_version,
            compiler=compiler,
            ranks=simulation.comm.size,
            solver=s.solver,
            petsc_options=petsc_options(),
        ),
    }


def _contact(simulation: Simulation, parts: dict[str, float]) -> dict[str, Any]:
    """Resultants, the largest penetration, points by status and the force on the body, of the state as it stands."""
    s, d = simulation.stepper, simulation.discretisation
    force, status = np.reshape(s.contact_force, (-1, d.dim)), np.asarray(s.status, dtype=int)
    normals = np.reshape(d.surface.normals, (-1, d.dim))
    pressing = np.sum(force * normals, axis=1)
    depth = -State(d, s, simulation.taken).contact["gap"] if simulation.taken and len(force) else np.zeros(1)
    return {
        "normal_force": sum(pressing.tolist(), 0.0),  # one by one, as in the report of a step
        "tangential_force": float(np.linalg.norm((force - pressing[:, None] * normals).sum(axis=0))),
        "max_penetration": max(0.0, float(depth.max())),
        **{name: int(np.sum(status == number)) for number, name in enumerate(STATUSES)},
        "traction": (0.0 - force.sum(axis=0)).tolist(),
        "parts": parts,
    }


def numbers(summary: dict[str, Any]) -> dict[str, str]:
    """The contents of summary.json in a few words: the largest fields of the last state, forces and shares of the contact."""
    largest, contact = summary["largest"], summary["contact"]
    points = sum(contact[name] for name in ("open", "stick", "slip"))
    found: dict[str, str] = {}
    for name, words in (("displacement", "largest displacement"), ("von_mises", "largest von Mises stress")):
        if name in largest:
            found[words] = f"{largest[name]:.3g}"
    if "temperature" in largest:
        found["temperature"] = f"{largest['lowest_temperature']:.3g} to {largest['temperature']:.3g}"
    if points:
        normal, friction = contact["normal_force"], contact["tangential_force"]
        found["normal force"] = f"{normal:.3g}"
        found["friction force"] = f"{friction if friction > 1e-12 * abs(normal) else 0.0:.3g}"
        found["largest pressure"] = f"{largest['pressure']:.3g}"
        shares = (f"{100 * contact[name] / points:.0f} % {name}" for name in ("open", "stick", "slip"))
        found["contact points"] = f"{points} ({', '.join(shares)})"
    return found


def trusted_digits(found: dict[str, float]) -> str:
    """How many digits of each field can be trusted."""
    return ", ".join(f"{name.replace('_', ' ')} {int(value)}" for name, value in found.items())


def petsc_options() -> dict[str, str]:
    """PETSc's options database, as recorded in the stamp."""
    from petsc4py import PETSc

    return {str(k): str(v) for k, v in PETSc.Options().getAll().items()}
