"""A sweep: one scene with some of its keys varied, every combination run, results in one table.

Scenes that differ in data only share mesh, operators, factors and compliance: after the first of them a run costs its steps.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.model.discretisation import Discretisation, discretise
from warmslip.records import tables
from warmslip.scene.errors import SceneError
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene
from warmslip.scene.structure import structure
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.statistics import digits
from warmslip.studies import run_numbers
from warmslip.studies.refinement_study import stamp

NAME = "sweep"  # of its files
MOST = 10**6  # runs


@dataclass(frozen=True)
class Variation:
    """One run of a sweep: its number, the values of the varied keys and the scene."""

    number: int
    values: dict[str, Any]
    scene: Scene


def variations(scene: Scene, vary: Mapping[str, Sequence[Any]]) -> list[Variation]:
    """Every combination of the values, the last key varying fastest.

    Raises
    ------
    SceneError
        For nothing to vary, too many runs, or values that the scene cannot have, which are named.
    """
    if not isinstance(vary, Mapping) or not all(
        isinstance(values, Sequence | np.ndarray) and not isinstance(values, str) for values in vary.values()
    ):
        raise SceneError("vary: give lists of values by key, {'contact.friction.coefficient': [0.0, 0.1]}")
    vary = {key: values.tolist() if isinstance(values, np.ndarray) else list(values) for key, values in vary.items()}
    if not vary or not all(vary.values()):
        raise SceneError("a sweep needs a key and its values; write --vary contact.friction.coefficient=0,0.1,0.2")
    count = math.prod(len(values) for values in vary.values())
    if count > MOST:
        raise SceneError(f"the sweep has {count} runs, and {MOST} are the most; give fewer values")
    out = []
    for number, combination in enumerate(product(*vary.values()), start=1):
        values = dict(zip(vary, combination, strict=True))
        try:
            out.append(Variation(number, values, scene.override(**values)))
        except SceneError as error:
            named = ", ".join(f"{key} = {_cell(value)}" for key, value in values.items())
            raise SceneError("\n".join(f"with {named}: {line}" for line in str(error).splitlines())) from None
    return out


def _cell(value: Any) -> Any:
    """A value as it stands in the table."""
    value = value.item() if isinstance(value, np.generic) else value
    return value if isinstance(value, str | float | int) else json.dumps(value)


class Runner:
    """Runs variations one after the other; those of one structure share what does not depend on their data."""

    def __init__(self, comm: Any = None) -> None:
        from mpi4py import MPI

        self._comm = MPI.COMM_WORLD if comm is None else comm
        self._kept: tuple[str, Discretisation, Any] | None = None

    def simulation(self, scene: Scene) -> Simulation:
        """A simulation at its start (collective)."""
        kind = structure(scene)
        if self._kept is not None and self._kept[0] == kind:
            _, discretisation, stepper = self._kept
            found = discretisation.with_data(scene, stepper, self._comm)
            return Simulation(scene, comm=self._comm, discretisation=found)
        self._kept = None  # its factors go before others come
        simulation = Simulation(scene, comm=self._comm, discretisation=discretise(scene, comm=self._comm))
        self._kept = kind, simulation.discretisation, simulation.stepper
        return simulation

    def row(self, one: Variation) -> tables.Row:
        """The line of a run in the table (collective)."""
        simulation = self.simulation(one.scene)
        for _ in simulation.steps():
            pass
        return (
            {"run": one.number} | {key: _cell(value) for key, value in one.values.items()} | line(simulation, one.scene)
        )


def line(simulation: Simulation, scene: Scene) -> tables.Row:
    """What a run leaves, in numbers; those of an absent field are 0 (collective)."""
    s, d = simulation.stepper, simulation.discretisation
    moves, conducts = d.problem.moves, d.problem.conducts
    trusted = digits(simulation.statistics.trusted(s.extents))
    return (
        {
            "outcome": simulation.outcome,
            "warnings": len(simulation.warnings()),
            "time": s.time,
            "steps": simulation.taken,
        }
        | run_numbers.norms(simulation)
        | {
            "theta_min": s.theta.min()[1] if conducts else 0.0,
            "theta_max": s.theta.max()[1] if conducts else 0.0,
            "mises_max": float(d.mises(s).max()) if moves else 0.0,
        }
        | run_numbers.contact(simulation)
        | {
            "residual": max(simulation.statistics.residuals.values()),
            "digits": min(trusted.values(), default=16.0),
            "cpu_seconds": run_numbers.seconds(simulation),
            "scene": scene.digest(),
        }
    )


def sweep(
    scene: Scene,
    vary: Mapping[str, Sequence[Any]],
    *,
    out: str | Path | None = None,
    jobs: int = 1,
    part: tuple[int, int] = (1, 1),
    progress: Callable[[int, int, tables.Row], None] | bool | None = None,
) -> list[tables.Row]:
    """Runs a scene with every combination of some values of its keys.

    Scenes that differ in loads, gaps, contact laws, given temperatures and displacements, or initial data share mesh, operators
    and factors.

    Parameters
    ----------
    scene : Scene
        What is varied.
    vary : mapping of str to sequence
        Values by key, such as ``{"contact.friction.coefficient": [0.0, 0.1]}``.
    out : str or Path, optional
        A folder for sweep.csv and sweep.json, written as runs end. Runs whose line is there are not run again.
    jobs : int
        Processes at once.
    part : tuple of int
        (i, n): only the i-th of n equal parts, into a table of its own, for a cluster. A sweep without parts in the same folder
        takes their lines over.
    progress : callable or bool, optional
        Called as ``progress(done, runs, row)``; True shows the bar of the command line.

    Returns
    -------
    list of dict
        A row a run, in order: the varied values, the outcome, norms, contact resultants, digits and cost.

    Raises
    ------
    SceneError
        For keys and values that make no sense.
    OSError
        When `out` cannot be written.
    """
    from mpi4py import MPI

    i, of = part
    if not 1 <= i <= of:
        raise SceneError(f"part {i}/{of} is none; give i/n with 1 <= i <= n")
    if jobs < 1 or (jobs > 1 and MPI.COMM_WORLD.size > 1):
        raise SceneError(f"jobs {jobs}: give 1 or more, and 1 where each run has several processes")
    every = variations(scene, vary)
    mine = every[len(every) * (i - 1) // of : len(every) * i // of]
    folder = Path(out) if out is not None else None
    found, others = _stored(folder, scene, list(vary), mine) if folder is not None else ({}, [])
    todo = [one for one in mine if one.number not in found]
    writes = folder is not None and MPI.COMM_WORLD.rank == 0
    name = NAME if of == 1 else f"{NAME}.{i}of{of}"
    with _shown(progress) as tell:
        for row in _rows(todo, jobs):
            found[row["run"]] = row
            if writes:
                assert folder is not None
                _write(folder / f"{name}.csv", found, others)
            tell(len(found), len(mine), row)
    rows = [found[number] for number in sorted(found)]
    if writes and rows:
        assert folder is not None
        keys = {key: [_cell(value) for value in values] for key, values in vary.items()}
        tables.write(folder / f"{name}.csv", _joined(found, others), stamp(scene, vary=keys))
    return rows


@contextmanager
def _shown(progress: Callable[[int, int, tables.Row], None] | bool | None) -> Iterator[Callable[..., object]]:
    """What is told of every run that ends: a function, or a bar."""
    if callable(progress) or not progress:
        yield progress or (lambda *_: None)
        return
    from mpi4py import MPI

    from warmslip.simulation.progress import progress_bar

    with progress_bar(MPI.COMM_WORLD.rank) as bar:
        task = bar.add_task("running", total=None, note="")
        yield lambda done, runs, row: bar.update(task, completed=done, total=runs, note=row["outcome"])


def _joined(found: Mapping[int, tables.Row], others: Sequence[tables.Row]) -> list[tables.Row]:
    """The rows of this sweep in order, and behind them those of earlier ones of the same scene and keys."""
    rows = [found[number] for number in sorted(found)]
    return rows + [row | {"run": len(rows) + i} for i, row in enumerate(others, start=1)]


def _write(path: Path, found: Mapping[int, tables.Row], others: Sequence[tables.Row]) -> None:
    """The table so far, beside its place first, so that there is always a whole one."""
    part = path.with_suffix(".part")
    tables.write(part, _joined(found, others))
    part.replace(path)


def _stored(
    folder: Path, scene: Scene, keys: Sequence[str], wanted: Sequence[Variation]
) -> tuple[dict[int, tables.Row], list[tables.Row]]:
    """Rows of the tables in a folder: those of wanted runs, by number, and the others of the whole table.

    Raises SceneError for a table of another scene or other keys, which would be lost.
    """
    folder.mkdir(parents=True, exist_ok=True)
    digests = {one.scene.digest(): one for one in wanted}
    out: dict[int, tables.Row] = {}
    others: list[tables.Row] = []
    for path in sorted(folder.glob(f"{NAME}*.csv")):
        rows = tables.read(path)
        if list(rows[0])[1 : list(rows[0]).index("outcome")] != list(keys):
            raise SceneError(f"{path} is a sweep over other keys; give another folder")
        stamped = path.with_suffix(".json")
        if stamped.exists() and json.loads(stamped.read_text(encoding="utf-8")).get("scene_hash") != scene.digest():
            raise SceneError(f"{path} is a sweep of another scene; give another folder")
        for row in rows:
            one = digests.get(str(row["scene"]))
            if one is not None:
                out[one.number] = row | {"run": one.number}
            elif path.stem == NAME:
                others.append(row)
    return out, others


def _rows(todo: Sequence[Variation], jobs: int) -> Any:
    """The lines of runs as they end."""
    if jobs == 1 or len(todo) < 2:
        runner = Runner()
        for one in todo:
            yield runner.row(one)
        return
    size = max(1, math.ceil(len(todo) / (4 * jobs)))  # a few chunks a process: each sets up once
    chunks = [todo[at : at + size] for at in range(0, len(todo), size)]
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        waiting = [
            pool.submit(_chunk, [(one.number, one.values, one.scene.resolved()) for one in chunk]) for chunk in chunks
        ]
        for done in as_completed(waiting):
            yield from done.result()


def _chunk(given: Sequence[tuple[int, dict[str, Any], dict[str, Any]]]) -> list[tables.Row]:
    """The lines of some runs, in a process of its own."""
    runner = Runner()
    return [runner.row(Variation(number, values, build(scene))) for number, values, scene in given]
