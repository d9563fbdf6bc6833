"""A scene in, a trajectory and a summary out."""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from warmslip.io import vtu
from warmslip.io.probe_writer import ProbeWriter
from warmslip.io.trajectory import Trajectory
from warmslip.io.trajectory_writer import TrajectoryWriter
from warmslip.messages import Shown
from warmslip.model.contact_laws import Law
from warmslip.model.discretisation import refuse_types
from warmslip.model.loads import Loads
from warmslip.model.probes import probes
from warmslip.model.state import State
from warmslip.records import provenance
from warmslip.scene.overrides import differing
from warmslip.scene.scene import Scene
from warmslip.simulation import checkpoint, folder_lock
from warmslip.simulation.signals import Interruption
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import numbers, summary, trusted_digits

if TYPE_CHECKING:
    from warmslip.io.plot import Plot

log = logging.getLogger(__name__)

Observer = Callable[[State, Any], None]


@dataclass(frozen=True, repr=False)
class Result(Shown):
    """The end of a run.

    Attributes
    ----------
    summary : dict
        The contents of summary.json.
    u, w : array (nodes, d) or None
        Displacement (length) and velocity at the end, in mesh numbering; None when nothing moves.
    theta : array (nodes,) or None
        Temperature at the end; None without heat.
    trajectory : Path or None
        The file trajectory.h5, when there is one.
    """

    summary: dict[str, Any]
    u: Any
    w: Any
    theta: Any
    trajectory: Path | None

    def _facts(self) -> dict[str, str]:
        found = self.summary
        files = {"files": str(self.trajectory.parent)} if self.trajectory is not None else {}
        return {
            "": f"{self.outcome}, {found['steps']} steps to t = {found['time']:g}",
            **numbers(found),
            "trusted digits": trusted_digits(found["digits"]),
            **files,
        }

    @classmethod
    def read(cls, folder: str | Path) -> Result:
        """The result of a run that ended before, from its folder. Raises ValueError for a folder without one, OSError."""
        place = Path(folder)
        try:
            found = json.loads((place / "summary.json").read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise ValueError(f"'{folder}' holds no summary.json; give the folder of a run that ended") from None
        except ValueError as error:
            raise ValueError(f"{place / 'summary.json'} is damaged ({error}); run the scene again") from None
        with Trajectory(place / "trajectory.h5") as t:
            u, w, theta = (None if one is None else np.asarray(one[-1]) for one in (t.u, t.w, t.theta))
        return cls(found, u, w, theta, place / "trajectory.h5")

    @property
    def plot(self) -> Plot:
        """Figures of the run as matplotlib axes, see `Plot`. Raises ValueError for a run that was not stored."""
        from warmslip.io.plot import Plot

        if self.trajectory is None:
            raise ValueError("the run was not stored, and figures are drawn from its files; run it with out=")
        return Plot(self.trajectory.parent)

    @property
    def outcome(self) -> str:
        """`completed`, or the name of what stopped the run."""
        return str(self.summary["outcome"])

    @property
    def completed(self) -> bool:
        """Whether the run went to its end, and the balances of every step close."""
        return self.outcome == "completed"


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
    raises: bool = False,
) -> Result:
    """Runs a scene to its end, with its own mesh and steps; parameters, result and errors are those of the public `warmslip.run`.

    With `raises`, Ctrl-C raises KeyboardInterrupt once the files are written. Collective over `comm`.
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
        if scene.initial.run is not None and Path(scene.initial.run).resolve() == (folder / "trajectory.h5").resolve():
            raise ValueError(f"initial.from: the run would overwrite '{scene.initial.run}'; choose another folder")
    with folder_lock.held(folder, comm):
        if folder is not None and not resume:
            _clear(folder, *checkpoint.NAMES, checkpoint.END)
        simulation = Simulation(scene, comm=comm, loads=loads, laws=laws, backend=backend)
        result, pressed = _carried_out(simulation, folder, observers, progress, resume)
    if raises and pressed:
        raise KeyboardInterrupt
    return result


def _carried_out(
    simulation: Simulation,
    folder: Path | None,
    observers: Sequence[Observer],
    progress: Callable[[int, int, Any], None] | None,
    resume: bool,
) -> tuple[Result, bool]:
    """Takes all steps and writes the files; the result of the run, and whether Ctrl-C ended it (collective)."""
    rank, probing, output = simulation.comm.rank, probes(simulation.discretisation), simulation.scene.output
    path = folder / "trajectory.h5" if folder is not None else None
    begin = 0
    if resume and folder is not None:
        if ended := _ended(simulation, folder):
            return ended, False
        begin = simulation.resume(folder)
    minutes, saved = output.checkpoint_minutes, time.monotonic()
    with (
        Interruption() as stop,
        TrajectoryWriter(path, simulation.discretisation, simulation.stepper, simulation.comm, keep=begin) as writer,
        ProbeWriter(folder, probing, simulation.comm, keep=begin) as probe_writer,
    ):
        if resume and folder is not None:
            _clear(folder)  # all that goes on is there
        if not begin:
            probe_writer.step(State(simulation.discretisation, simulation.stepper, 0))
        for state, report in simulation.steps():
            writer.step(report, simulation.taken)
            probe_writer.step(state)
            asked, late = stop.agreed(simulation.comm, minutes is not None and time.monotonic() - saved > 60 * minutes)
            last = simulation.finished
            due = asked or late or simulation.taken % output.checkpoint == 0
            if folder is not None and (due or last):
                writer.write()  # no checkpoint is ahead of its trajectory
                probe_writer.write()
                saving = simulation.take_checkpoint()
                if rank == 0:
                    saving.write(folder, end=last)
                saved = time.monotonic()
            for observer in observers:
                observer(state, report)
            if progress and rank == 0:
                progress(simulation.taken, simulation.pace.expected, report)
            if asked and not last:
                simulation.outcome = "interrupted"
                break
    result = finish(simulation, folder)
    if folder is not None and rank == 0 and simulation.outcome != "interrupted":
        for name in checkpoint.NAMES:  # the run is over; its last state lets it go on to a later end
            (folder / name).unlink(missing_ok=True)
    return result, stop.keyboard(simulation.comm)


def _ended(simulation: Simulation, folder: Path) -> Result | None:
    """The result in a folder where this very run was completed before (collective). Python functions are compared by name."""
    found: Result | None = None
    if (
        simulation.comm.rank == 0 and not simulation.discretisation.user_functions and (folder / "final.vtu").exists()
    ):  # else the disk was full
        try:
            scene, answer = simulation.scene, json.loads((folder / "summary.json").read_text(encoding="utf-8"))
            with Trajectory(folder / "trajectory.h5") as t:
                end, stored = float(t.time[-1]), t.scene
            told = {name: stored.get(name) for name in ("output", "title")}  # they change no step
            stamp, digest = answer["stamp"], scene.override(**told).digest()
            same = (stamp["scene_hash"], stamp["fingerprint"]) == (digest, provenance.fingerprint())
            if answer["outcome"] == "completed" and same and not answer["functions"] and end == scene.time.end:
                found = Result.read(folder)
                if keys := [key for key in differing(stored, scene.resolved()) if key.startswith("output.")]:
                    log.warning(
                        "the run in '%s' is complete and stays as it is; %s holds for new steps alone: give a later time.end, or "
                        "run it without --resume",
                        folder,
                        ", ".join(keys),
                    )
        except (OSError, ValueError, LookupError, TypeError):
            pass  # then it is run
    return simulation.comm.bcast(found, root=0)  # type: ignore[no-any-return]


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


def finish(simulation: Simulation, folder: Path | None) -> Result:
    """Summary and final fields of a run as it stands, into a folder when there is one (collective)."""
    answer = summary(simulation)
    u, w, theta = (simulation.discretisation.field(getattr(simulation.stepper, name)) for name in ("u", "w", "theta"))
    if folder is not None and simulation.comm.rank == 0:
        _whole(
            folder / "summary.json", lambda path: path.write_text(json.dumps(answer, indent=2) + "\n", encoding="utf-8")
        )
        _whole(folder / "final.vtu", lambda path: vtu.write_vtu(path, simulation.discretisation, u, w, theta))
    return Result(answer, u, w, theta, folder / "trajectory.h5" if folder is not None else None)
