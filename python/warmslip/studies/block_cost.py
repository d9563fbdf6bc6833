"""What every combination of blocks costs: against the whole model, and against the least code that could do its physics."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from warmslip.scene.reader import load
from warmslip.scene.scene import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.typing import Array

# the tables of the whole model that each choice leaves out
MOTIONS = {
    "none": ("inertia", "elasticity", "viscosity"),
    "elastic, quasistatic": ("inertia", "viscosity"),
    "viscoelastic, quasistatic": ("inertia",),
    "elastic": ("viscosity",),
    "viscoelastic": (),
}
CONTACTS = {"none": ("contact.friction", "contact.stiffness"), "frictionless": ("contact.friction",), "friction": ()}
HEATS: dict[str, tuple[str, ...]] = {
    "none": ("heat", "supports.temperature", "contact.heat_exchange"),
    "alone": ("heat.expansion", "heat.heating"),
    "expands": ("heat.heating",),
    "heated": ("heat.expansion",),
    "both": (),
}
EXCHANGES = {"insulated": ("contact.heat_exchange",), "exchange": ()}
TURN = 5  # steps before the whole model goes on


def whole(n: int, steps: int) -> Scene:
    """The paper's problem, in which every block is there."""
    return load(
        "paper_mixed", [f"mesh.n={n}", f"time.steps={steps}", "contact.heat_exchange.foundation_temperature=10.0"]
    )


def combinations() -> Iterator[dict[str, str]]:
    """Every choice of motion, contact, heat and exchange that makes sense."""
    for motion in MOTIONS:
        for contact in CONTACTS:
            for heat in HEATS:
                for exchange in EXCHANGES:
                    still, cold = motion == "none", heat == "none"
                    if (still and (contact != "none" or heat != "alone")) or (cold and exchange == "exchange"):
                        continue
                    yield {"motion": motion, "contact": contact, "heat": heat, "exchange": exchange}


def scene(full: Scene, chosen: dict[str, str]) -> Scene:
    """The whole model without what is not chosen."""
    gone = [
        *MOTIONS[chosen["motion"]],
        *CONTACTS[chosen["contact"]],
        *HEATS[chosen["heat"]],
        *EXCHANGES[chosen["exchange"]],
    ]
    if chosen["motion"] == "none":
        gone += ["supports.displacement", "loads.body", "loads.traction"]
    if chosen["contact"] == "none" and (chosen["heat"] == "none" or chosen["exchange"] == "insulated"):
        gone = [key for key in gone if not key.startswith("contact.")] + ["contact"]
    return full.override(**dict.fromkeys(gone))


class MinimalStep:
    """The least code for a step: right-hand sides, one substitution a field. No contact, no balances, constant loads."""

    def __init__(self, simulation: Simulation) -> None:
        self._k, self._operators, self._stepper = (
            simulation.scene.step,
            simulation.discretisation.operators,
            simulation.stepper,
        )
        force, heat, *_ = simulation.discretisation.load_vectors.at(self._k, self._k)
        kept: list[Any] = [
            v and v.copy() for v in (simulation.stepper.u, simulation.stepper.w, simulation.stepper.theta)
        ]
        self.u, self.w, self.theta = kept
        self._force, self._heat = (v and v.copy() for v in (force, heat))
        self._right, self._product, self._warm, self._stored = (
            v and v.duplicate() for v in (self.u, self.u, self.theta, self.theta)
        )
        self._clamped, self._cooled = (
            np.array(held, int)
            for held in (self._operators.prescribed_displacement, self._operators.prescribed_temperature)
        )

    def step(self) -> None:
        """Backward Euler, staggered."""
        o, k = self._operators, self._k
        if self.w is not None:
            self._force.copy(self._right)
            for matrix, factor, vector in (
                (o.inertia, 1 / k, self.w),
                (o.elasticity, -1.0, self.u),
                (o.expansion, 1.0, self.theta),
            ):
                if matrix is not None and vector is not None:
                    matrix.mult(vector, self._product)
                    self._right.axpy(factor, self._product)
            self._right.array[self._clamped] = 0.0
            self._stepper.momentum_factor.solve(self._right, self.w)
            self.u.axpy(k, self.w)
        if self.theta is not None:
            self._heat.copy(self._warm)
            for matrix, factor, vector in ((o.mass, 1 / k, self.theta), (o.heating, 1.0, self.w)):
                if matrix is not None and vector is not None:
                    matrix.mult(vector, self._stored)
                    self._warm.axpy(factor, self._stored)
            self._warm.array[self._cooled] = 0.0
            self._stepper.heat_factor.solve(self._warm, self.theta)


class Member:
    """A run step by step, with the seconds of its contact solver and its balances. RuntimeError when a step is rejected."""

    def __init__(self, simulation: Simulation) -> None:
        self._job, self._steps = simulation, simulation.steps()
        self.contact: list[float] = []
        self.balances: list[float] = []

    def step(self) -> None:
        cost = self._job.stepper.cost
        contact, balances = cost.contact_seconds, cost.balance_seconds
        if next(self._steps, None) is None:
            raise RuntimeError(f"the run ended: {self._job.outcome}, {self._job.failure}")
        self.contact.append(cost.contact_seconds - contact)
        self.balances.append(cost.balance_seconds - balances)


def timed(action: Callable[[], None]) -> float:
    """CPU seconds of a call: what other processes take of the wall time does not count."""
    begin = time.process_time()
    action()
    return time.process_time() - begin


def settled(seconds: list[float]) -> Array:
    """Without the first turn, and the first step of every other one: the whole model has just been through the caches."""
    return np.reshape(seconds, (-1, TURN))[1:, 1:].ravel()


def spread(name: str, ratio: Array) -> dict[str, float]:
    """Median and quartiles of a ratio taken in every step."""
    return {
        f"{name}{end}": float(np.quantile(ratio, at)) for end, at in (("", 0.5), ("_lower", 0.25), ("_upper", 0.75))
    }


def ratios(step: Array, whole_model: Array, contact_solver: Array, balances: Array, least: Array) -> dict[str, float]:
    """What the table compares, from seconds of steps that were taken beside each other: medians and quartiles."""
    return (
        spread("over_whole_model", step / whole_model)
        | spread("linear_over_minimal", (step - contact_solver - balances) / least)
        | spread("step_over_minimal", step / (least + contact_solver))
    )


def measure(full: Scene, chosen: dict[str, str]) -> dict[str, Any]:
    """One line of the table; seconds are medians a step, CPU of one process, ratios those of calls after each other.

    `least` is the least code for what is linear, written for the blocks that are there and no others.
    `linear_over_minimal` is a step without its contact solver and its balances over it: 1 when what is absent costs nothing.
    `step_over_minimal` is the whole step, balances included, over the least code and the contact solver. `_lower` and
    `_upper` are quartiles. `substitutions`, `products` (of a matrix and a vector) and `newton_iterations` are counted, a
    step each.
    """
    product = PETSc.Log.Event("MatMult")
    simulation, model = Simulation(scene(full, chosen)), Simulation(full)
    one, whole_model, minimal = Member(simulation), Member(model), MinimalStep(simulation)
    times: dict[str, list[float]] = {"step": [], "least": [], "whole_model": []}
    products = 0
    for n in range(full.time.steps):
        before = product.getPerfInfo()["count"]
        times["step"].append(timed(one.step))
        products += product.getPerfInfo()["count"] - before
        times["least"].append(timed(minimal.step))
        if n % TURN == TURN - 1:  # both see the same machine
            times["whole_model"] += [timed(whole_model.step) for _ in range(TURN)]
    times |= {"contact_solver": one.contact, "balances": one.balances}
    seconds = {name: settled(found) for name, found in times.items()}
    cost, operators = simulation.stepper.cost, simulation.discretisation.operators
    # an estimate of the digits looks at the stress, and at what errors of the velocity and of the temperature make of the other
    products -= cost.estimates * sum(
        getattr(operators, name) is not None for name in ("elasticity", "viscosity", "heating", "expansion")
    )
    return (
        chosen
        | {"cells_per_side": full.mesh.counts[0], "unknowns": simulation.discretisation.unknowns}
        | {
            name: float(np.median(seconds[name]))
            for name in ("step", "whole_model", "contact_solver", "balances", "least")
        }
        | ratios(**seconds)
        | {
            "substitutions": cost.substitutions / cost.steps,
            "products": products / cost.steps,
            "newton_iterations": cost.newton_iterations / cost.steps,
            "factorizations": cost.factorizations,
            "refinements": cost.refinements,
        }
    )


def table(n: int, steps: int, progress: Callable[[int, int], None] | None = None) -> list[dict[str, Any]]:
    """Every combination on a square of n x n cells, each beside the whole model in the same run.

    Raises ValueError for a number of steps that is no multiple of 5, and on several ranks.
    """
    if steps % TURN or steps < 2 * TURN:
        raise ValueError(f"steps = {steps} is no multiple of {TURN}, or less than two of them; give {2 * TURN} or more")
    if MPI.COMM_WORLD.size > 1:
        raise ValueError("the cost of blocks is measured on one process; start it without mpirun")
    PETSc.Log.begin()  # counts products of matrices
    full, chosen = whole(n, steps), list(combinations())
    rows = []
    for i, one in enumerate(chosen, start=1):
        rows.append(measure(full, one))
        if progress:
            progress(i, len(chosen))
    return rows
