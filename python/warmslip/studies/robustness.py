"""Ladders of one parameter each, to its extremes, on the paper's problem: every run must say what became of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from warmslip.scene.errors import SceneError
from warmslip.scene.full import FullScene
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.statistics import BALANCES, FIELDS

Overrides = dict[str, Any]


def _key(name: str) -> Callable[[Any], Overrides]:
    return lambda value: {name: value}


def _steps(k: float) -> Overrides:
    # a few steps of the size asked for: what happens at size k, not what happens until T
    return {"time.steps": max(1, min(8, round(1 / k))), "time.end": min(1.0, 8 * k) if k < 1 else k}


def _matrix(a: float, b: float) -> list[list[float]]:
    return [[a, b], [b, a]]


LADDERS: dict[str, tuple[Callable[[Any], Overrides], list[Any]]] = {
    "stiffness c_nu": (_key("contact.stiffness"), [0.0, 1.0, 1e2, 1e4, 1e6, 1e8, 1e10, 1e12]),
    "friction mu_tau": (_key("contact.friction.coefficient"), [0.0, 0.01, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0]),
    "time step k": (_steps, [1e3, 1.0, 0.5, 0.1, 1e-2, 1e-3, 1e-4, 1e-5]),
    "viscosity": (lambda v: {"viscosity.lame": [v, v / 2]}, [10.0, 1.0, 1e-1, 1e-2, 1e-4, 1e-8, 0.0]),
    "density rho": (_key("inertia.density"), [1e6, 1e2, 1.0, 1e-2, 1e-6, 0.0]),
    "no viscosity, density rho": (
        lambda v: {"viscosity.lame": [0.0, 0.0], "inertia.density": v},
        [1e2, 1.0, 1e-2, 1e-6, 0.0],
    ),
    "conductance k_c": (_key("contact.heat_exchange.conductance"), [0.0, 1e-3, 1.0, 1e3, 1e6, 1e12]),
    "foundation theta_F": (_key("contact.heat_exchange.foundation_temperature"), [-1e3, 0.0, 10.0, 1e2, 1e4, 1e6]),
    "conductivity, off-diagonal": (lambda v: {"heat.conductivity": _matrix(1.0, v)}, [0.0, 0.9, 0.999999, 1.0]),
    "conductivity, size": (lambda v: {"heat.conductivity": _matrix(v, 0.0)}, [0.0, 1e-6, 1e-3, 1.0, 1e3, 1e6]),
    "stretched mesh, length": (lambda v: {"mesh.lengths": [v, 1.0]}, [1e-4, 1e-2, 1.0, 1e2, 1e4]),
    "coupling R = M times": (
        lambda v: {"heat.expansion.tensor": _matrix(v, 0.0), "heat.heating.tensor": _matrix(v, 0.0)},
        [0.0, 1.0, 10.0, 100.0],
    ),
    "coupling R = -M times": (
        lambda v: {"heat.expansion.tensor": _matrix(v, 0.0), "heat.heating.tensor": _matrix(-v, 0.0)},
        [1.0, 10.0, 100.0],
    ),
    "gap g": (_key("contact.gap"), [-0.1, -1e-12, 0.0, 1e-12, 1e-3, 0.1]),
}


STAGES = ("none", "newton", "restart", "tresca_fixed_point", "enumeration")
# a right answer is right for another factorization too, up to the condition of the step
AGREEMENT = 1e-6


def cell(scene: FullScene, ladder: str, value: Any) -> dict[str, Any]:
    """One run at one value: its outcome, the largest residual of each balance, and a verdict.

    `right`: the run says so and a second run, whose linear algebra is PETSc's instead of CHOLMOD's, has the same norms to
    1e-6; `stopped`: a named outcome, the last good state kept; `refused`: before it started, with a reason; `WRONG`: the
    run says right and the second one disagrees.
    """
    make, _ = LADDERS[ladder]
    line: dict[str, Any] = {"ladder": ladder, "value": value, "outcome": "", "reason": ""}
    line |= dict.fromkeys([*BALANCES, *(f"error_{field}" for field in FIELDS), "disagreement"], float("nan")) | {
        "newton_largest": 0,
        "stage": "",
        "steps": 0,
    }
    try:
        simulation = Simulation(scene.override(**make(value)))
        for _ in simulation.steps():
            pass
        other = Simulation(simulation.scene, backend="petsc")
        for _ in other.steps():
            pass
    except (SceneError, ValueError) as refusal:
        return line | {"outcome": "refused", "reason": str(refusal).replace("\n", " "), "verdict": "refused"}
    except (RuntimeError, MemoryError) as failure:
        return line | {"outcome": "solver_failed", "reason": str(failure).replace("\n", " "), "verdict": "stopped"}
    difference = disagreement(simulation, other)
    reached = simulation.failure or simulation.statistics.residuals  # of the step that was rejected, where there is one
    line |= {"outcome": simulation.outcome, "disagreement": difference} | {
        key: reached.get(key, float("nan")) for key in BALANCES
    }
    line |= {
        f"error_{field}": value for field, value in simulation.statistics.trusted(simulation.stepper.extents).items()
    }
    line |= {
        "newton_largest": simulation.statistics.newton_max,
        "stage": max(simulation.statistics.stages, key=STAGES.index),
        "steps": simulation.stepper.cost.steps,
    }
    if simulation.outcome != "completed":
        return line | {"verdict": "stopped"}
    return line | {"verdict": "right" if difference <= AGREEMENT else "WRONG"}


def disagreement(one: Simulation, other: Simulation) -> float:
    """Largest relative difference of the final norms of two runs; infinite when one went further."""
    if one.stepper.cost.steps != other.stepper.cost.steps:
        return float("inf")
    n, m = one.discretisation.norms, other.discretisation.norms
    pairs = [(n.v(one.stepper.u), m.v(other.stepper.u))]
    pairs += [(n.l2(getattr(one.stepper, f)), m.l2(getattr(other.stepper, f))) for f in ("w", "theta")]
    return max(abs(a - b) / max(abs(a), abs(b)) if a or b else 0.0 for a, b in pairs)


def table(scene: FullScene, progress: Callable[[str, Any], None] | None = None) -> list[dict[str, Any]]:
    """Every ladder on `scene`."""
    out = []
    for ladder, (_, values) in LADDERS.items():
        for value in values:
            if progress:
                progress(ladder, value)
            out.append(cell(scene, ladder, value))
    return out
