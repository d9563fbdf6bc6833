"""A scene being stepped."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from warmslip._core import Outcome
from warmslip.model.contact_laws import Law
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.model.loads import Loads
from warmslip.model.state import State
from warmslip.records import provenance
from warmslip.scene.scene import Scene
from warmslip.simulation import checkpoint, ranks
from warmslip.simulation.checkpoint import Checkpoint
from warmslip.simulation.monitor import Monitor
from warmslip.simulation.statistics import FIELDS, Statistics, digits, estimates, residuals

log = logging.getLogger(__name__)

PARTED = ("strained", "strained_w")  # u and w but for rigid motions, of a body without supports
_fingerprint = cache(provenance.fingerprint)  # it reads every source, and this process has one code


class Simulation:
    """A scene being stepped: iterate `steps()`, or let `warmslip.run` do it.

    Parameters
    ----------
    scene : Scene
        What to step.
    comm : mpi4py communicator, optional
        The ranks that step; all by default.
    loads : Loads, optional
        Loads in the place of the scene's.
    laws : dict of Law, optional
        Contact laws by part, in the place of the scene's.
    backend : str
        Factorization: automatic, cholmod or petsc.
    discretisation : Discretisation, optional
        The scene assembled before.

    Attributes
    ----------
    discretisation : Discretisation
        The assembled problem, with matrices as petsc4py objects.
    stepper : _core.Stepper
        The time stepper; `momentum_factor` and `heat_factor` are the factored operators.
    statistics : Statistics
        Largest balance residuals, estimated errors and iterations so far.
    outcome : str
        `completed`, or the name of what stopped the run.
    failure : dict or None
        Step, reason and residuals of a step that was rejected.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        comm: Any = None,
        loads: Loads | None = None,
        laws: dict[str, Law] | None = None,
        backend: str = "automatic",
        discretisation: Discretisation | None = None,
    ) -> None:
        from mpi4py import MPI

        self.began = time.perf_counter(), time.process_time()
        self.scene = scene
        self.comm = MPI.COMM_WORLD if comm is None else comm
        ranks.guard()
        self.discretisation = discretisation or discretise(scene, comm=self.comm, loads=loads, laws=laws)
        self.stepper = self.discretisation.stepper(backend=backend)
        self.statistics = Statistics()
        materials = self.discretisation.problem.materials
        warmed = any(material.heating is not None for material in materials) or any(
            contact.friction_heating is not None or (contact.heat_exchange and contact.heat_exchange.per_pressure)
            for contact in scene.contacts
        )
        # fields that have no digits where nothing determines the place of the body
        self._by_place = FIELDS if warmed and scene.heat is not None else tuple(f for f in FIELDS if f != "theta")
        self.outcome = "completed"
        self.failure: dict[str, Any] | None = None
        self.report: Any = None
        self.monitor = Monitor(scene, self.discretisation, self.stepper, self.comm)
        self._resumed = 0  # steps of an earlier process
        log.info("%d unknowns on %d ranks; %s", self.discretisation.unknowns, self.comm.size, self.stepper.solver)

    @property
    def taken(self) -> int:
        """Steps so far, those of an earlier process that this one goes on from included."""
        return self._resumed + int(self.stepper.cost.steps)

    def steps(self) -> Iterator[tuple[State, Any]]:
        """Advances to the end, yielding the state and the report of every step (`_core.StepReport`, with its `balances`).

        Ends before a step that is rejected, whose state is not kept: see `outcome` and `failure`. Collective.
        """
        moving = self.discretisation.prescribed.of_time
        for n in range(self.taken + 1, self.scene.time.steps + 1):
            try:
                loads = self.discretisation.load_vectors.at(n * self.scene.step, self.scene.step)
            except ValueError as error:  # a formula that gives no finite number; on every rank
                self._stop("data_not_finite", n, str(error))
                return
            if moving and (why := self.discretisation.prescribed.inside(n * self.scene.step)):
                self._stop("support_inside_foundation", n, why)
                return
            for law in self.discretisation.laws:
                for function in law.functions:
                    function.reset()
            report = self.stepper.advance(*loads, measured=n == self.scene.time.steps)
            self.statistics.attempted(report)
            if report.outcome != Outcome.completed:
                wrong = self._law_violation()
                known = {name: value for name, value in residuals(report).items() if value == value}  # not computed
                if errors := estimates(report):
                    known["digits"] = digits(errors)  # type: ignore[assignment]
                outcome = "law_failed" if wrong else report.outcome.name
                self._stop(outcome, n, wrong or self.monitor.reason(report.reason), **known)
                return
            self.report = report
            self.monitor.step(report, n, loads)
            self.statistics.taken(report, self._by_place)
            if log.isEnabledFor(logging.DEBUG):
                balances = ", ".join(f"{name} {value:.1e}" for name, value in residuals(report).items())
                log.debug("step %d: %d Newton iterations, %s", n, report.newton_iterations, balances)
            yield State(self.discretisation, self.stepper, n), report

    def _stop(self, outcome: str, step: int, reason: str, **numbers: Any) -> None:
        self.outcome, self.failure = outcome, {"step": step, "reason": reason} | numbers
        log.info("step %d rejected: %s", step, outcome)

    def _law_violation(self) -> str | None:
        """What a law of the user's did in the step, on the first rank that says so (collective)."""
        if not self.discretisation.laws:
            return None
        message = self.comm.allgather(next((law.violation for law in self.discretisation.laws if law.violation), None))
        return next(filter(None, message), None)

    def warnings(self) -> list[str]:
        """What solves the equations and is hardly sensible, so far (collective)."""
        return self.monitor.sentences(self.report is not None, self.statistics)

    def take_checkpoint(self) -> Checkpoint:
        """The state after the last step; the stepper forgets what a resumed one cannot know (collective)."""
        stepper, d = self.stepper, self.discretisation
        stepper.clear_cache()
        fields = {name: d.field(getattr(stepper, name)) for name in ("u", "w", "theta", *PARTED)}
        arrays = {name: values for name, values in fields.items() if values is not None}
        arrays |= {"rigid": np.asarray(stepper.rigid)} if "strained" in arrays else {}
        arrays |= {"contact_force": np.asarray(stepper.contact_force), "status": np.asarray(stepper.status, dtype=int)}
        owner = {
            "scene": self.scene.digest(),
            "code": _fingerprint(),
            "solver": stepper.solver,
            "ranks": self.comm.size,
            "set of Python functions": list(d.user_functions),
        }
        return Checkpoint(
            owner, self.taken, stepper.time, self.statistics, self.monitor.seen, list(stepper.extents), arrays
        )

    def restore(self, state: Checkpoint) -> None:
        """Brings a new simulation to a checkpoint of its own (collective)."""
        d, arrays = self.discretisation, state.arrays
        none = np.zeros((len(d.mesh.nodes), 1))
        u, w, theta = (arrays.get(name, none) for name in ("u", "w", "theta"))
        d.state(self.stepper, u, w, theta, state.time)
        if "strained" in arrays:
            parted = [d.distributed(arrays[name]) for name in PARTED]
            self.stepper.part(*parted, arrays["rigid"])
            for vector in parted:
                vector.destroy()
        self.stepper.resume(arrays["contact_force"], arrays["status"].tolist(), state.extents)
        self.statistics = state.statistics
        self.monitor.seen |= state.seen
        self._resumed = state.step

    def resume(self, folder: Path) -> int:
        """Goes on from the newest whole checkpoint in `folder`; the step it goes on from, 0 if there is none (collective).

        Raises ValueError when the only whole checkpoints belong to another scene, code or number of ranks. Python functions
        in the place of data and laws must be those of the run that was stopped: only their names are compared.
        """
        start, found, refusal = self.take_checkpoint(), None, ""
        if self.comm.rank == 0:
            try:
                found = checkpoint.read(folder, start, self.scene.time.steps)
            except ValueError as error:
                refusal = str(error)
        found, refusal = self.comm.bcast((found, refusal), root=0)
        if refusal:
            raise ValueError(refusal)
        if found is not None:
            self.restore(found)
        return self._resumed
