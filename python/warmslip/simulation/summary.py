"""What is left of a run in a few numbers: summary.json."""

from __future__ import annotations

import math
import resource
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from warmslip._core import compiler, petsc_version
from warmslip.model.state import resultants
from warmslip.records import provenance

if TYPE_CHECKING:
    from warmslip.simulation.run import Run


def digits(errors: dict[str, float]) -> dict[str, float]:
    """Decimal digits that estimated relative errors leave to be trusted, 16 at most, by field."""
    return {
        name: round(min(16.0, max(0.0, -math.log10(value))), 1) if value > 0 else 16.0 for name, value in errors.items()
    }


def summary(job: Run) -> dict[str, Any]:
    """Outcome, norms, contact, identities, cost and stamp of a run as it stands (collective)."""
    s, norms, report, cost = job.stepper, job.discretisation.norms, job.report, job.stepper.cost
    contact = dict.fromkeys(("normal_force", "tangential_force", "max_penetration"), 0.0)
    counts = {"open": len(job.discretisation.surface.weights), "stick": 0, "slip": 0}
    traction = [0.0] * job.discretisation.dim
    if report is not None:
        contact = {
            "normal_force": report.normal_force,
            "tangential_force": float(np.linalg.norm(report.friction_traction)),
            "max_penetration": report.max_penetration,
        }
        counts = {name: getattr(report, name) for name in counts}
        traction = list(report.traction)
    counters = {name: getattr(cost, name) for name in type(cost).items}
    force = np.reshape(s.contact_force, (1, -1, job.discretisation.dim))
    parts = {name: float(values[0]) for name, values in resultants(job.discretisation, force).items()}
    return {
        "outcome": job.outcome,
        "failure": job.failure,
        "warnings": job.watch.sentences(),
        "time": s.time,
        "steps": job.taken,
        "functions": job.discretisation.own,
        "norms": ({"u_V": norms.v(s.u), "u_L2": norms.l2(s.u), "w_L2": norms.l2(s.w)} if s.u is not None else {})
        | ({"theta_L2": norms.l2(s.theta)} if s.theta is not None else {}),
        "contact": contact | counts | {"traction": traction, "parts": parts},
        "identities": job.worst,
        "digits": digits(job.trusted()),
        "newton": {
            "iterations": cost.newton_iterations,
            "largest_step": job.newton_max,
            "stages": job.stages,
        },
        "cpu_seconds": time.process_time() - job.began[1],
        "wall_seconds": time.perf_counter() - job.began[0],
        "memory_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        "cost": counters,
        "stamp": provenance.stamp(
            job.scene,
            petsc=petsc_version,
            compiler=compiler,
            ranks=job.comm.size,
            solver=s.solver,
            petsc_options=petsc_options(),
        ),
    }


def petsc_options() -> dict[str, str]:
    """PETSc's options database, as recorded in the stamp."""
    from petsc4py import PETSc

    return {str(k): str(v) for k, v in PETSc.Options().getAll().items()}
