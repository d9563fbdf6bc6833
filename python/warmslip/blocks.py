"""What every combination of blocks costs: against the whole model, and against the least code that could do its physics."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from mpi4py import MPI

from warmslip.runner import Run
from warmslip.scene import Scene, load

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
CHUNK = 5  # steps of one run before the other one goes on, so that both see the same machine


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


class Floor:
    """The least code for a step: right-hand sides, one substitution a field. No contact, no balances, constant loads."""

    def __init__(self, job: Run) -> None:
        self._k, self._operators, self._stepper = job.scene.step, job.discretisation.operators, job.stepper
        force, heat, *_ = job.discretisation.load_vectors.at(self._k, self._k)
        kept: list[Any] = [v and v.copy() for v in (job.stepper.u, job.stepper.w, job.stepper.theta)]
        self.u, self.w, self.theta = kept
        self._force, self._heat = (v and v.copy() for v in (force, heat))
        self._right, self._product, self._warm, self._stored = (
            v and v.duplicate() for v in (self.u, self.u, self.theta, self.theta)
        )
        self._clamped, self._cooled = (
            np.array(held, int) for held in (self._operators.clamped, self._operators.cooled)
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


class March:
    """A run step by step, with what each of its steps and of its stages took. RuntimeError when a step is not right."""

    STAGES = ("momentum", "contact", "heat")

    def __init__(self, job: Run) -> None:
        self._job, self._steps = job, job.steps()
        self._stages: dict[str, list[float]] = {name: [] for name in self.STAGES}

    def step(self) -> None:
        cost = self._job.stepper.cost
        before = {name: getattr(cost, f"{name}_seconds") for name in self.STAGES}
        if next(self._steps, None) is None:
            raise RuntimeError(f"the run ended: {self._job.outcome}, {self._job.failure}")
        for name, found in self._stages.items():
            found.append(getattr(self._job.stepper.cost, f"{name}_seconds") - before[name])

    def stage(self, name: str) -> float:
        """Median seconds of a stage."""
        return float(np.median(self._stages[name]))


def interleaved(actions: list[Callable[[], None]], steps: int) -> list[float]:
    """Median seconds of every action, called `steps` times each, in turns."""
    times: list[list[float]] = [[] for _ in actions]
    for _ in range(steps // CHUNK):
        for action, found in zip(actions, times, strict=True):
            for _ in range(CHUNK):
                begin = time.perf_counter()
                action()
                found.append(time.perf_counter() - begin)
    return [float(np.median(found)) for found in times]


def measure(full: Scene, chosen: dict[str, str]) -> dict[str, Any]:
    """One line of the table, every time in seconds a step of one process.

    `floor` is the least code for what is linear plus what the contact solver took. `absent` is what the step takes beside its
    contact solver, whose iterations depend on the physics, over the same of the whole model less the solves of absent
    fields, nan where nothing moves: above 1, what is absent costs something. It bounds from above alone, as products
    and balances of absent fields stay in the whole model; that absent blocks are not solved for is counted, not timed.
    """
    job, model = Run(scene(full, chosen)), Run(full)
    one, whole_model, floor = March(job), March(model), Floor(job)
    step, whole_step, least = interleaved([one.step, whole_model.step, floor.step], full.time.steps)
    fields = {"momentum": chosen["motion"] != "none", "heat": chosen["heat"] != "none"}
    gone = sum(whole_model.stage(name) for name, there in fields.items() if not there)
    contact, cost = one.stage("contact"), job.stepper.cost
    kept = whole_step - whole_model.stage("contact") - gone
    return chosen | {
        "bricks": full.mesh.counts[0],
        "unknowns": job.discretisation.unknowns,
        "step": step,
        "whole_model": whole_step,
        "over_whole_model": step / whole_step,
        "contact_solver": contact,
        "floor": least + contact,
        "over_floor": step / (least + contact),
        "absent": (step - contact) / kept if fields["momentum"] else float("nan"),
        "substitutions": cost.substitutions / cost.steps,
        "newton_iterations": cost.newton_iterations / cost.steps,
        "factorizations": cost.factorizations,
        "refinements": cost.refinements,
    }


def table(n: int, steps: int, progress: Callable[[int, int], None] | None = None) -> list[dict[str, Any]]:
    """Every combination on a square of n x n bricks, each beside the whole model in the same run.

    Raises ValueError for a number of steps that is no multiple of 5, and on several ranks.
    """
    if steps % CHUNK or steps < 2 * CHUNK:
        raise ValueError(
            f"steps = {steps} is no multiple of {CHUNK}, or less than two of them; give {2 * CHUNK} or more"
        )
    if MPI.COMM_WORLD.size > 1:
        raise ValueError("the cost of blocks is measured on one process; start it without mpirun")
    full, chosen = whole(n, steps), list(combinations())
    rows = []
    for i, one in enumerate(chosen, start=1):
        rows.append(measure(full, one))
        if progress:
            progress(i, len(chosen))
    return rows
