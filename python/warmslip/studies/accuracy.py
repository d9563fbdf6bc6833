"""A run whose error is asked for in place of its mesh and its steps."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from warmslip.model.contact_laws import Law
from warmslip.model.loads import Loads
from warmslip.scene.scene import Scene
from warmslip.simulation import run as plain
from warmslip.simulation.run import Observer, Result
from warmslip.studies import ask, pilots


def run(
    scene: Scene,
    *,
    error: float | None = None,
    of: str = "all",
    seconds: float = math.inf,
    out: str | Path | None = None,
    comm: Any = None,
    loads: Loads | None = None,
    laws: dict[str, Law] | None = None,
    backend: str = "automatic",
    observers: Sequence[Observer] = (),
    progress: Callable[[int, int, Any], None] | bool | None = None,
    resume: bool = False,
) -> Result:
    """Runs a scene to its end; with `error`, on a mesh and with steps that are chosen for it.

    With `out`, writes trajectory.h5, summary.json and final.vtu there, and checkpoints while it runs. Collective over `comm`.

    Parameters
    ----------
    scene : Scene
        What to run.
    error : float, optional
        Largest relative error, dimensionless, such as 0.01: mesh, grading and steps are chosen from pilot runs. The scene's own
        sizes do not matter then. `summary["error"]` has the estimated error, the setting and the cost. For the scene's own loads
        and laws only. With `out`, the chosen setting is run once more for its files.
    of : str
        What the error is of: `all` (the norms of the fields), u_V, w_L2, theta_L2, normal_force, tangential_force,
        largest_pressure, dissipated_energy, theta_max or theta_mean.
    seconds : float
        CPU seconds that a run with `error` may take.
    out : str or Path, optional
        Folder of the files; without it nothing is written.
    comm : mpi4py communicator, optional
        The ranks that run; all by default.
    loads : Loads, optional
        Loads in the place of the scene's.
    laws : dict of Law, optional
        Contact laws by part, in the place of the scene's.
    backend : str
        Factorization: automatic, cholmod or petsc.
    observers : sequence of callables
        Called as `observer(state, report)` after every step, on every rank.
    progress : callable or bool, optional
        Called as `progress(step, steps, report)` after every step, on rank 0; with a tolerance, `steps` is what is expected.
        True shows the bar of the command line, in a terminal and in a notebook with ipywidgets.
    resume : bool
        Continue from the newest whole checkpoint in `out`. On one process the end is bitwise that of an uninterrupted run; on
        several it agrees to round-off. Without a checkpoint the run starts from the beginning, unless the same run was
        completed in `out` before: its result is returned then. Python functions must be given again and must be the same; only
        their names are compared.

    Returns
    -------
    Result
        Also of a run that stopped early: `outcome` is then one of contact_not_converged, not_finite, data_not_finite,
        supports_contradict, support_inside_foundation, law_failed, balance_violated, precision_lost, unsupported,
        solver_failed, or interrupted (Ctrl-C, SIGTERM). `failure` in the summary describes the step that was rejected.

    Raises
    ------
    TypeError
        For arguments of another kind.
    ValueError
        For a scene, loads or laws that make no sense, and an error that cannot be had.
    RuntimeError
        When a pilot run is rejected.
    OSError
        When `out` cannot be written.
    """
    options: dict[str, Any] = {
        "out": out,
        "comm": comm,
        "loads": loads,
        "laws": laws,
        "backend": backend,
        "observers": observers,
        "progress": progress,
        "resume": resume,
        "raises": True,
    }
    if error is None:
        return _shown(scene, options)
    for name, value in (("loads", loads), ("laws", laws), ("resume", resume)):
        if value:
            raise ValueError(f"{name}: a run with error= chooses from the scene's own data; leave it out")
    answer = ask.solve(scene, error, of, seconds=seconds)
    if out is None and not observers and not progress:
        found = plain.finish(answer.simulation, None)
    else:
        found = _shown(answer.scene, options)
    return with_error(found, answer, error, Path(out) if out is not None else None)


def _shown(scene: Scene, options: dict[str, Any]) -> Result:
    """Runs with plain options, and with a bar where `progress` is True."""
    if options["progress"] is not True:
        return plain.run(scene, **options | {"progress": options["progress"] or None})
    from mpi4py import MPI

    from warmslip.simulation.progress import stepping

    rank = (options["comm"] or MPI.COMM_WORLD).rank
    with stepping(scene.clock.steps, rank) as progress:
        return plain.run(scene, **options | {"progress": progress})


def with_error(found: Result, answer: ask.Answer, asked: float, folder: Path | None) -> Result:
    """The result with what is known of its error in the summary, also in the file."""
    known = {
        "asked": asked,
        "estimated": answer.error,
        "of": answer.plan.quantities,
        "parts": answer.parts,
        "errors": answer.errors,
        "setting": pilots.keys_of(answer.scene),
        "predicted": answer.tries[-1].error,
        "tries": len(answer.tries),
        "pilot_seconds": answer.plan.pilot_seconds,
        "seconds": answer.seconds,
    }
    summary = found.summary | {"error": known}
    if folder is not None and answer.simulation.comm.rank == 0:  # one rank has written it
        (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    return replace(found, summary=summary)
