"""The time loop: a scene in, a trajectory and a summary out."""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from warmslip._core import Outcome
from warmslip.io import vtu
from warmslip.io.trajectory import Trajectory
from warmslip.io.trajectory_writer import TrajectoryWriter
from warmslip.model.contact_laws import Law
from warmslip.model.discretisation import Discretisation, discretise, refuse_types
from warmslip.model.loads import Loads
from warmslip.model.state import State
from warmslip.records import provenance
from warmslip.scene.scene import Scene
from warmslip.simulation import checkpoint, ranks, summary
from warmslip.simulation.monitor import Watch
from warmslip.simulation.signals import Interruption

Observer = Callable[[State, Any], None]
log = logging.getLogger(__name__)

IDENTITIES = ("energy", "heat", "force", "law")
FIELDS = ("u", "theta", "stress", "contact_force")  # whose errors are estimated, `_core.Errors`


@dataclass(frozen=True)
class Result:
    """The end of a run: `summary` as in summary.json and the final fields in mesh numbering, (nodes, d) and (nodes,).

    A field that the scene does not have is None.
    """

    summary: dict[str, Any]
    u: Any
    w: Any
    theta: Any
    trajectory: Path | None

    @property
    def outcome(self) -> str:
        """`right`, or the name of what stopped the run."""
        return str(self.summary["outcome"])

    @property
    def right(self) -> bool:
        """Whether the run went to its end and every step closed its books."""
        return self.outcome == "right"


def residuals(report: Any) -> dict[str, float]:
    """The step's relative residual of each identity, dimensionless."""
    return {name: float(getattr(report.ledger, f"{name}_residual")) for name in IDENTITIES}


def estimates(report: Any) -> dict[str, float]:
    """Estimated relative errors of the fields that were measured in the step, dimensionless."""
    found = {name: float(getattr(report.errors, name)) for name in FIELDS}
    return {name: value for name, value in found.items() if value == value}


def worse(one: float, other: float) -> float:
    """The larger of two residuals; a nan is worse than anything."""
    return other if not other <= one else one


class Run:
    """A scene being stepped: iterate `steps()`, or let `warmslip.run` do it.

    `loads` and `laws` take the place of the scene's, see `discretise`. `discretisation` is the assembled problem, with matrices
    as petsc4py objects; `stepper` has the factored operators `momentum_factor` and `heat_factor`, whose `solve` takes
    petsc4py vectors.
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
        self.worst = dict.fromkeys(IDENTITIES, 0.0)
        self.errors: dict[str, float] = {}  # largest estimated relative error of each field that was measured
        contacts, materials = scene.contacts, self.discretisation.problem.materials
        warmed = any(material.heating is not None for material in materials) or any(
            contact.friction_heating is not None or (contact.heat_exchange and contact.heat_exchange.per_pressure)
            for contact in contacts
        )
        # fields that have no digits where nothing determines the place of the body
        self._by_place = FIELDS if warmed and scene.heat is not None else tuple(f for f in FIELDS if f != "theta")
        self.outcome = "right"
        self.report: Any = None
        self._resumed = 0  # steps of an earlier process
        self.newton_max = 0
        self.stages: dict[str, int] = {}
        self.failure: dict[str, Any] | None = None
        self.watch = Watch(self)
        log.info("%d unknowns on %d ranks; %s", self.discretisation.unknowns, self.comm.size, self.stepper.solver)

    @property
    def taken(self) -> int:
        """Steps so far, those of an earlier process that this one goes on from included."""
        return self._resumed + int(self.stepper.cost.steps)

    def resume(self, folder: Path) -> int:
        """Goes on from the newest checkpoint in `folder`, see `checkpoint.load`; the step it goes on from (collective)."""
        self._resumed = checkpoint.load(folder, self)
        return self._resumed

    def steps(self) -> Iterator[tuple[State, Any]]:
        """Advances to the end, yielding the state and the report of every step (`_core.StepReport`, with its `ledger`).

        Ends before a step that is not right, whose state is not kept: see `outcome` and `failure`. Collective.
        """
        moving = self.discretisation.clamped.of_time
        for n in range(self.taken + 1, self.scene.time.steps + 1):
            try:
                loads = self.discretisation.load_vectors.at(n * self.scene.step, self.scene.step)
            except ValueError as error:  # a formula that gives no finite number; on every rank
                self.outcome, self.failure = "data_not_finite", {"step": n, "reason": str(error)}
                return
            if moving and (why := self.discretisation.clamped.inside(n * self.scene.step)):
                self.outcome, self.failure = "held_inside", {"step": n, "reason": why}
                log.info("step %d was not taken: %s", n, self.outcome)
                return
            for law in self.discretisation.laws:
                for function in law.functions:
                    function.forget()
            report = self.stepper.advance(*loads, measured=n == self.scene.time.steps)
            self.newton_max = max(self.newton_max, report.newton_iterations)
            self.stages[report.stage.name] = self.stages.get(report.stage.name, 0) + 1
            if report.outcome != Outcome.right:
                wrong = self._wrong_law()
                self.outcome = "law_failed" if wrong else report.outcome.name
                known = {
                    name: value for name, value in residuals(report).items() if value == value
                }  # nan: not computed
                self.failure = {"step": n, "reason": wrong or self.watch.reason(report.reason)} | known
                if errors := estimates(report):
                    self.failure["digits"] = summary.digits(errors)
                log.info("step %d was not taken: %s", n, self.outcome)
                return
            self.report = report
            self.watch.step(report, n, loads)
            for name, value in residuals(report).items():
                self.worst[name] = worse(self.worst[name], value)
            for name, value in estimates(report).items():
                self.errors[name] = max(self.errors.get(name, 0.0), value)
            if report.undetermined:
                self.errors |= dict.fromkeys(self._by_place, 1.0)
            if log.isEnabledFor(logging.DEBUG):
                books = ", ".join(f"{name} {value:.1e}" for name, value in residuals(report).items())
                log.debug("step %d: %d Newton iterations, %s", n, report.newton_iterations, books)
            yield State(self.discretisation, self.stepper, n), report

    def _wrong_law(self) -> str | None:
        """What a law of the user's did in the step, on the first rank that says so (collective)."""
        if not self.discretisation.laws:
            return None
        said = self.comm.allgather(next((law.wrong for law in self.discretisation.laws if law.wrong), None))
        return next(filter(None, said), None)

    def trusted(self) -> dict[str, float]:
        """Estimated relative errors of the fields that were measured, dimensionless: the largest of all steps.

        Also the largest change of a field against its largest value in the run, whatever rounding of other fields makes.
        """
        extents = np.reshape(self.stepper.extents[:-1], (-1, 3))
        found = dict(self.errors)
        for name, (size, _, change) in zip(FIELDS, extents, strict=True):
            if name in found and size > 0:
                found[name] = max(found[name], float(change / size))
        return found

    def summary(self) -> dict[str, Any]:
        """What summary.json would hold now (collective)."""
        return summary.summary(self)


def run(
    scene: Scene,
    *,
    out: str | Path | None = None,
    comm: Any = None,
    loads: Loads | None = None,
    laws: dict[str, Law] | None = None,
    backend: str = "automatic",
    observers: Sequence[Observer] = (),
    progress: Callable[[int, int, Any], None] | None = None,
    resume: bool = False,
) -> Result:
    """Runs a scene. With `out`, writes trajectory.h5, summary.json and final.vtu there, and checkpoints while it runs.

    With `resume`, goes on from the newest whole checkpoint in `out`, to the same end as the run that was not stopped, on one
    process bit by bit, on several to rounding. Without one it starts from the beginning, unless this very run has ended right
    there before: that is the result then. Functions in Python must be there again; they are told apart by what they give at
    some times and places.

    Collective over `comm` (default: all ranks). After every step the `observers` are called as `observer(state, report)` on every
    rank, then `progress(step, steps, report)` on rank 0. A run that cannot go on returns normally: see `Result.outcome`, one of
    right, contact_not_converged, not_finite, data_not_finite (a load, a gap), held_inside (a support in a rigid foundation),
    law_failed (a law of one's own), identity_violated, precision_lost, unsupported, solver_failed (`failure` in the summary
    has the step that was not taken), and interrupted after
    Ctrl-C or SIGTERM, which leave a checkpoint.
    Raises TypeError for arguments of another kind, ValueError for a scene, loads or laws that make no sense, OSError when `out`
    cannot be written.
    """
    refuse_types(scene, loads, laws)  # before anything in the folder is removed
    if callable(observers):
        raise TypeError("observers: one function is given; give a list, [function]")
    for observer in observers:
        if not callable(observer):
            raise TypeError(f"observers: {observer!r} is no function; give functions of state and report")
    if resume and out is None:
        raise ValueError("resume: there is no folder to go on from; give out=")
    folder = Path(out) if out is not None else None
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        if not resume:
            _clear(folder, *checkpoint.NAMES)
    job = Run(scene, comm=comm, loads=loads, laws=laws, backend=backend)
    rank = job.comm.rank
    path = folder / "trajectory.h5" if folder is not None else None
    begin = 0
    if resume and folder is not None:
        begin = job.resume(folder)
        if not begin and (ended := _ended(job, folder)):
            return ended
        _clear(folder)
    minutes, saved = scene.output.checkpoint_minutes, time.monotonic()
    with (
        Interruption() as stop,
        TrajectoryWriter(path, job.discretisation, job.stepper, job.comm, keep=begin) as writer,
    ):
        for state, report in job.steps():
            writer.step(report, job.taken)
            asked, late = stop.agreed(job.comm, minutes is not None and time.monotonic() - saved > 60 * minutes)
            last = job.taken == scene.time.steps
            if folder is not None and not last and (asked or late or job.taken % scene.output.checkpoint == 0):
                writer.write()  # no checkpoint is ahead of its trajectory
                checkpoint.save(folder, job)
                saved = time.monotonic()
            for observer in observers:
                observer(state, report)
            if progress and rank == 0:
                progress(job.taken, scene.time.steps, report)
            if asked and not last:
                job.outcome = "interrupted"
                break
    result = finish(job, folder)
    if folder is not None and rank == 0 and job.outcome != "interrupted":
        for name in checkpoint.NAMES:  # the run is over, and all of it is on the disk
            (folder / name).unlink(missing_ok=True)
    return result


def _ended(job: Run, folder: Path) -> Result | None:
    """The result in a folder where this very run has ended right before (collective). Functions in Python are not told apart."""
    found: Result | None = None
    if job.comm.rank == 0 and not job.discretisation.own and (folder / "final.vtu").exists():  # else the disk was full
        try:
            told = json.loads((folder / "summary.json").read_text())
            stamp = told["stamp"]
            same = (stamp["scene_hash"], stamp["fingerprint"]) == (job.scene.digest(), provenance.fingerprint())
            if told["outcome"] == "right" and same and not told["functions"]:
                with Trajectory(folder / "trajectory.h5") as t:
                    u, w, theta = (None if one is None else np.asarray(one[-1]) for one in (t.u, t.w, t.theta))
                    if round(float(t.time[-1]) / job.scene.step) == job.scene.time.steps:
                        found = Result(told, u, w, theta, folder / "trajectory.h5")
        except (OSError, ValueError, LookupError, TypeError):
            pass  # then it is run
    return job.comm.bcast(found, root=0)  # type: ignore[no-any-return]


def _whole(path: Path, write: Callable[[Path], object]) -> None:
    """Writes a file beside its place and renames it, so that there is all of it or none."""
    part = path.with_name(f"{path.stem}.part{path.suffix}")
    try:
        write(part)
        os.replace(part, path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror, str(path.parent)) from None


def _clear(folder: Path, *more: str) -> None:
    """Removes what would speak of another run."""
    for name in ("summary.json", "final.vtu", *more):
        (folder / name).unlink(missing_ok=True)


def finish(job: Run, folder: Path | None) -> Result:
    """Summary and final fields of a run as it stands, into a folder when there is one (collective)."""
    told = job.summary()
    u, w, theta = (job.discretisation.field(getattr(job.stepper, name)) for name in ("u", "w", "theta"))
    if folder is not None and job.comm.rank == 0:
        _whole(folder / "summary.json", lambda path: path.write_text(json.dumps(told, indent=2) + "\n"))
        _whole(folder / "final.vtu", lambda path: vtu.write_vtu(path, job.discretisation, u, w, theta))
    return Result(told, u, w, theta, folder / "trajectory.h5" if folder is not None else None)
