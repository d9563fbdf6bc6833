"""What a run ends with, in the numbers that tables of runs share."""

from __future__ import annotations

import numpy as np

from warmslip.records.tables import Row
from warmslip.simulation.simulation import Simulation


def norms(simulation: Simulation) -> Row:
    """Norms of the last state; 0 of a field there is not (collective)."""
    s, d = simulation.stepper, simulation.discretisation
    moves, conducts = d.problem.moves, d.problem.conducts
    return {
        "norm_u_V": d.norms.v(s.u) if moves else 0.0,
        "norm_u_L2": d.norms.l2(s.u) if moves else 0.0,
        "norm_w_L2": d.norms.l2(s.w) if moves else 0.0,
        "norm_theta_L2": d.norms.l2(s.theta) if conducts else 0.0,
    }


def contact(simulation: Simulation) -> Row:
    """Resultant forces, largest penetration (length) and numbers of points of the last step; 0 before the first."""
    report = simulation.report
    return {
        "normal_force": report.normal_force if report else 0.0,
        "tangential_force": float(np.linalg.norm(report.friction_traction)) if report else 0.0,
        "max_penetration": report.max_penetration if report else 0.0,
        "open": report.open if report else 0,
        "stick": report.stick if report else 0,
        "slip": report.slip if report else 0,
    }


def seconds(simulation: Simulation) -> float:
    """CPU seconds of the core: set-up and steps."""
    cost = simulation.stepper.cost
    return float(cost.setup_seconds + cost.step_seconds)
