"""A scene being stepped."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from warmslip._core import Outcome
from warmslip.io.trajectory import Trajectory
from warmslip.messages import Shown, quoted
from warmslip.model.contact_laws import Law
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.model.loads import Loads
from warmslip.model.state import State
from warmslip.model.supports import SupportsContradictError
from warmslip.records import provenance
from warmslip.scene.overrides import differing
from warmslip.scene.scene import Scene
from warmslip.simulation import checkpoint, pace, ranks
from warmslip.simulation.checkpoint import Checkpoint
from warmslip.simulation.local_error import LocalError
from warmslip.simulation.monitor import Monitor
from warmslip.simulation.pace import AdaptivePace, Step
from warmslip.simulation.statistics import FIELDS, Statistics, digits, estimates, residuals

log = logging.getLogger(__name__)

PARTED = ("strained", "strained_w")  # u and w but for rigid motions, of a body without supports
_fingerprint = cache(provenance.fingerprint)  # it reads every source, and this process has one code


class Simulation(Shown):
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
        self.pace = pace.pace(scene)
        adaptive = isinstance(self.pace, AdaptivePace)
        self.local_error = LocalError(self.discretisation, self.stepper, scene.step) if adaptive else None
        log.info("%d unknowns on %d ranks; %s", self.discretisation.unknowns, self.comm.size, self.stepper.solver)

    def _facts(self) -> dict[str, str]:
        state = "under way" if self.outcome == "completed" and not self.finished else self.outcome
        return {
            "": quoted(self.scene.title),
            "unknowns": str(self.discretisation.unknowns),
            "steps": f"{self.taken} of {self.pace.expected}",
            "t =": f"{self.stepper.time:g} of {self.scene.time.end:g}",
            "state": state,
        }

    @property
    def taken(self) -> int:
        """Steps so far, those of an earlier process that this one goes on from included."""
        return self.pace.taken

    @property
    def finished(self) -> bool:
        """Whether the last step was taken."""
        return self.pace.finished

    @cached_property
    def _price(self) -> float:
        """About how many steps a factorization costs."""
        return float(self.stepper.refactoring_price)

    def steps(self) -> Iterator[tuple[State, Any]]:
        """Advances to the end, yielding the state and the report of every step (`_core.StepReport`, with its `balances`).

        Ends before a step that is rejected, whose state is not kept: see `outcome` and `failure`. After
        `discretisation.restart`, steps begin at the time of that state. Collective.

        Raises
        ------
        ValueError
            When no step of the scene begins at the time of a state that was set.
        """
        if not self.pace.reached(self.stepper.time):  # the state was set by hand
            self.pace.start_at(self.stepper.time)
            if self.local_error is not None:
                self.local_error = LocalError(self.discretisation, self.stepper, self.scene.step)
        while (step := self.pace.next()) is not None:
            if (loads := self._data(step)) is None:
                return
            if self.local_error is not None:
                self.local_error.remember(self.stepper)
            report = self.stepper.advance(*loads, measured=step.last, time=step.time)
            self.statistics.attempted(report)
            if report.outcome != Outcome.completed:
                wrong = self._law_violation()
                if not wrong and isinstance(self.pace, AdaptivePace) and self.pace.fail():
                    continue
                self._reject(step, report, wrong)
                return
            if not self._good_enough(step):
                continue
            self.report = report
            self.monitor.step(report, step, loads)
            self.statistics.taken(report, self._by_place)
            if log.isEnabledFor(logging.DEBUG):
                balances = ", ".join(f"{name} {value:.1e}" for name, value in residuals(report).items())
                log.debug("step %d: %d Newton iterations, %s", step.number, report.newton_iterations, balances)
            yield State(self.discretisation, self.stepper, step.number), report

    def _data(self, step: Step) -> Any:
        """The data of a step, for whose size the stepper is made ready; None where the run stops instead (collective)."""
        prescribed = self.discretisation.prescribed
        try:
            loads = self.discretisation.load_vectors.at(step.time, step.size, step.begin)
        except SupportsContradictError as error:  # on every rank
            return self._stop("supports_contradict", step.number, str(error))
        except ValueError as error:  # a formula that gives no finite number; on every rank
            return self._stop("data_not_finite", step.number, str(error))
        if prescribed.of_time and (why := prescribed.inside(step.time)):
            return self._stop("support_inside_foundation", step.number, why)
        try:
            self.stepper.set_step(step.size)
        except ValueError as error:
            return self._stop("solver_failed", step.number, str(error))
        for law in self.discretisation.laws:
            for function in law.functions:
                function.reset()
        return loads

    def _good_enough(self, step: Step) -> bool:
        """Counts a step that was solved; one whose estimated error is too large is taken back instead (collective)."""
        if not isinstance(self.pace, AdaptivePace):
            self.pace.accept(step.size)
            return True
        assert self.local_error is not None
        estimate = self.local_error.of(self.stepper, step.size)
        if not self.pace.judge(estimate):
            self.stepper.revert()
            return False
        self.local_error.take(step.size)
        self.pace.accept(estimate, self._price)
        return True

    def _reject(self, step: Step, report: Any, wrong: str | None) -> None:
        """Stops at a step that was not solved, or in which a law of the user's did `wrong`."""
        known = {name: value for name, value in residuals(report).items() if value == value}  # not computed
        if errors := estimates(report):
            known["digits"] = digits(errors)  # type: ignore[assignment]
        outcome = "law_failed" if wrong else report.outcome.name
        self._stop(outcome, step.number, wrong or self.monitor.reason(report.reason), **known)

    def _stop(self, outcome: str, step: int, reason: str, **numbers: Any) -> None:
        """Ends the run before a step."""
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
        return self.monitor.sentences(self.taken > 0, self.statistics)

    def take_checkpoint(self) -> Checkpoint:
        """The state after the last step; the stepper forgets what a resumed one cannot know (collective)."""
        stepper, d = self.stepper, self.discretisation
        stepper.clear_cache()
        fields = {name: d.field(getattr(stepper, name)) for name in ("u", "w", "theta", *PARTED)}
        arrays = {name: values for name, values in fields.items() if values is not None}
        arrays |= {"rigid": np.asarray(stepper.rigid)} if "strained" in arrays else {}
        arrays |= {"contact_force": np.asarray(stepper.contact_force), "status": np.asarray(stepper.status, dtype=int)}
        progress = self.pace.state()
        if self.local_error is not None:
            numbers, changes = self.local_error.state()
            progress |= numbers
            arrays |= changes
        owner = {
            "scene": self.scene.digest_of_steps(),
            "code": _fingerprint(),
            "solver": stepper.solver,
            "ranks": self.comm.size,
            "set of Python functions": list(d.user_functions),
        }
        return Checkpoint(
            owner, self.taken, stepper.time, progress, self.statistics, self.monitor.seen, list(stepper.extents), arrays
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
        self.stepper.resume(arrays["contact_force"], arrays["status"].tolist(), state.extents, state.step)
        self.statistics = state.statistics
        self.monitor.seen |= state.seen
        self.pace.restore(state.pace)
        if self.local_error is not None:
            self.local_error.restore(state.pace, arrays)

    def _changed(self, folder: Path) -> str:
        """The keys that differ from the scene of the run in a folder, as the end of a sentence."""
        try:
            with Trajectory(folder / "trajectory.h5") as stored:
                before, now = stored.scene, self.scene.resolved()
        except (OSError, ValueError):
            return ""
        keys = [key for key in differing(before, now) if not key.startswith(("output", "title"))]
        return f"; {', '.join(keys[:4])} differ{'s' * (len(keys) == 1)}" if keys else ""

    def resume(self, folder: Path) -> int:
        """Goes on from the newest whole checkpoint in `folder`; the step it goes on from, 0 if there is none (collective).

        The end of the run and its output may differ from those of the run before. Raises ValueError when the only whole
        checkpoints belong to another scene, code or number of ranks. Python functions in the place of data and laws must be those
        of the run that was stopped: only their names are compared.
        """
        start, found, refusal = self.take_checkpoint(), None, ""
        if self.comm.rank == 0:
            try:
                found = checkpoint.read(folder, start, self.scene.digest())
            except ValueError as error:
                refusal = str(error) + self._changed(folder)
        found, refusal = self.comm.bcast((found, refusal), root=0)
        if refusal:
            raise ValueError(refusal)
        if found is not None:
            self.restore(found)
            if not self.pace.reached(self.stepper.time):
                raise ValueError(
                    f"the run in {folder} is at t = {found.time:.6g} after {found.step} steps, where this scene has no such "
                    "step; keep end/steps, an end that is no earlier, and equal steps (graded ones change with the end)"
                )
        return self.taken
