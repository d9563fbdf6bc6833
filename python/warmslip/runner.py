"""The time loop: a scene in, a trajectory and a summary out."""

from __future__ import annotations

import json
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from warmslip import _core, checkpoint, mesh_io, provenance
from warmslip.loads import Loads
from warmslip.problem import Discretisation, discretise
from warmslip.scene import Scene
from warmslip.trajectory import TrajectoryWriter

IDENTITIES = ("energy", "heat", "force", "law")
FLOORS = ("law_floor", "energy_floor", "force_floor")


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
        return str(self.summary["outcome"])

    @property
    def right(self) -> bool:
        return self.outcome == "right"


def residuals(report: Any) -> dict[str, float]:
    """The step's relative residual of each identity, dimensionless."""
    return {name: float(getattr(report.ledger, f"{name}_residual")) for name in IDENTITIES}


def worse(one: float, other: float) -> float:
    """The larger of two residuals; a nan is worse than anything."""
    return other if not other <= one else one


class Run:
    """A scene being stepped: iterate `steps()`, or let `warmslip.run` do it."""

    def __init__(
        self,
        scene: Scene,
        *,
        comm: Any = None,
        loads: Loads | None = None,
        backend: str = "automatic",
        discretisation: Discretisation | None = None,
    ) -> None:
        from mpi4py import MPI

        self._wall, self._cpu = time.perf_counter(), time.process_time()
        self.scene = scene
        self.comm = MPI.COMM_WORLD if comm is None else comm
        self.discretisation = discretisation or discretise(scene, comm=self.comm, loads=loads)
        self.stepper = self.discretisation.stepper(backend=backend)
        self.worst = dict.fromkeys(IDENTITIES, 0.0)
        self.floors = dict.fromkeys(FLOORS, 0.0)
        self.outcome = "right"
        self.report: Any = None
        self._resumed = 0  # steps of an earlier process
        self.newton_max = 0
        self.stages: dict[str, int] = {}
        self.failure: dict[str, Any] | None = None

    @property
    def taken(self) -> int:
        """Steps so far, those of an earlier process that this one goes on from included."""
        return self._resumed + int(self.stepper.cost.steps)

    def resume(self, folder: Path) -> int:
        """Goes on from the newest checkpoint in `folder`, see `checkpoint.load`; the step it goes on from (collective)."""
        self._resumed = checkpoint.load(folder, self)
        return self._resumed

    def steps(self) -> Iterator[Any]:
        """Advances to the end, yielding a report a step; stops before a step that is not right, whose state is not kept."""
        for n in range(self.taken + 1, self.scene.time.steps + 1):
            report = self.stepper.advance(*self.discretisation.load_vectors.at(n * self.scene.step, self.scene.step))
            self.newton_max = max(self.newton_max, report.newton_iterations)
            self.stages[report.stage.name] = self.stages.get(report.stage.name, 0) + 1
            if report.outcome != _core.Outcome.right:
                self.outcome = report.outcome.name
                numbers = residuals(report) | {name: float(getattr(report.ledger, name)) for name in FLOORS}
                known = {name: value for name, value in numbers.items() if value == value}  # nan: not computed
                self.failure = {"step": n, "reason": report.reason} | known
                return
            self.report = report
            for name, value in residuals(report).items():
                self.worst[name] = worse(self.worst[name], value)
            for name in FLOORS:
                self.floors[name] = worse(self.floors[name], getattr(report.ledger, name))
            yield report

    def summary(self) -> dict[str, Any]:
        """What summary.json holds (collective)."""
        s, norms, report, cost = self.stepper, self.discretisation.norms, self.report, self.stepper.cost
        contact = dict.fromkeys(("normal_force", "tangential_force", "max_penetration"), 0.0)
        counts = {"open": len(self.discretisation.surface.weights), "stick": 0, "slip": 0}
        traction = [0.0] * self.discretisation.dim
        if report is not None:
            contact = {
                "normal_force": report.normal_force,
                "tangential_force": float(np.linalg.norm(report.friction_traction)),
                "max_penetration": report.max_penetration,
            }
            counts = {name: getattr(report, name) for name in counts}
            traction = list(report.traction)
        counters = {name: getattr(cost, name) for name in type(cost).items}
        cpu = time.process_time() - self._cpu
        return {
            "outcome": self.outcome,
            "failure": self.failure,
            "time": s.time,
            "steps": self.taken,
            "norms": ({"u_V": norms.v(s.u), "u_L2": norms.l2(s.u), "w_L2": norms.l2(s.w)} if s.u is not None else {})
            | ({"theta_L2": norms.l2(s.theta)} if s.theta is not None else {}),
            "contact": contact | counts | {"traction": traction},
            "identities": self.worst | self.floors,
            "newton": {
                "iterations": cost.newton_iterations,
                "largest_step": self.newton_max,
                "stages": self.stages,
            },
            "cpu_seconds": cpu,
            "wall_seconds": time.perf_counter() - self._wall,
            "memory_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
            "cost": counters,
            "stamp": provenance.stamp(
                self.scene,
                petsc=_core.petsc_version,
                compiler=_core.compiler,
                ranks=self.comm.size,
                solver=s.solver,
                petsc_options=petsc_options(),
            ),
        }


def petsc_options() -> dict[str, str]:
    """PETSc's options database, as recorded in the stamp."""
    from petsc4py import PETSc

    return {str(k): str(v) for k, v in PETSc.Options().getAll().items()}


def run(
    scene: Scene,
    *,
    out: str | Path | None = None,
    comm: Any = None,
    loads: Loads | None = None,
    backend: str = "automatic",
    progress: Callable[[int, int, Any], None] | None = None,
    resume: bool = False,
) -> Result:
    """Runs a scene. With `out`, writes trajectory.h5, summary.json and final.vtu there, and checkpoints while it runs.

    With `resume`, goes on from the newest whole checkpoint in `out`, to the same end bit by bit as the run that was not
    stopped; without one it starts from the beginning. Custom `loads` must be the same, which nobody checks.

    Collective over `comm` (default: all ranks). `progress(step, steps, report)` is called after every step on rank 0.
    A run that cannot go on returns normally: see `Result.outcome`, one of right, contact_not_converged, not_finite,
    identity_violated, precision_lost and solver_failed; `failure` in the summary has the step that was not taken. Raises
    ValueError for a scene or loads that make no sense, OSError when `out` cannot be written.
    """
    folder = Path(out) if out is not None else None
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        stale = () if resume else checkpoint.NAMES
        for name in ("summary.json", "final.vtu", *stale):  # they would speak of another run
            (folder / name).unlink(missing_ok=True)
    job = Run(scene, comm=comm, loads=loads, backend=backend)
    rank = job.comm.rank
    path = folder / "trajectory.h5" if folder is not None else None
    begin = job.resume(folder) if resume and folder is not None else 0
    with TrajectoryWriter(path, job.discretisation, job.stepper, job.comm, keep=begin) as writer:
        for report in job.steps():
            writer.step(report, job.taken)
            if folder is not None and job.taken % scene.output.checkpoint == 0 and job.taken < scene.time.steps:
                writer.write()  # no checkpoint is ahead of its trajectory
                checkpoint.save(folder, job)
            if progress and rank == 0:
                progress(job.taken, scene.time.steps, report)
    if folder is not None and rank == 0:
        for name in checkpoint.NAMES:  # the run is over
            (folder / name).unlink(missing_ok=True)
    summary = job.summary()
    u, w, theta = (job.discretisation.field(getattr(job.stepper, name)) for name in ("u", "w", "theta"))
    if folder is not None and rank == 0:
        (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
        mesh_io.write_vtu(folder / "final.vtu", job.discretisation, u, w, theta)
    return Result(summary, u, w, theta, path)
