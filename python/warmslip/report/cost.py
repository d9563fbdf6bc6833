"""What a scene costs on this machine, from a few trial steps."""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.io.trajectory_writer import TrajectoryWriter
from warmslip.model import several_solutions
from warmslip.model.foresight import before
from warmslip.model.materials import cell_regions
from warmslip.model.probes import refuse_outside
from warmslip.scene.plan import Plan, plan
from warmslip.scene.reader import library, load
from warmslip.scene.scene import Scene
from warmslip.simulation.run import finish, run
from warmslip.simulation.simulation import Simulation

MIN_TRIAL_STEPS, MAX_TRIAL_STEPS, TRIAL_SECONDS = (
    5,
    60,
    0.3,
)  # trial steps at least, and at most when they are quick; seconds


@dataclass
class Trial:
    """Seconds of the trial steps; of storing a step with many others at once; of a checkpoint; of what a run would not do."""

    steps: list[float] = field(default_factory=list)
    storing: float = 0.0
    checkpoint: float = 0.0
    extra: float = 0.0

    @property
    def step(self) -> float:
        """A step beyond the first ones, output included."""
        return float(np.mean(self.steps[len(self.steps) // 4 :])) + self.storing


def _timed(action: Callable[[], None]) -> float:
    begin = time.perf_counter()
    action()
    return time.perf_counter() - begin


def trial(simulation: Simulation, folder: Path) -> Trial:
    """Takes the first steps of a run with their output into a folder (collective)."""
    found, begin, few = Trial(), time.perf_counter(), 0.0
    with TrajectoryWriter(
        folder / "trajectory.h5", simulation.discretisation, simulation.stepper, simulation.comm
    ) as writer:
        before = time.perf_counter()
        for _, report in simulation.steps():
            writer.step(report, simulation.taken)
            now = time.perf_counter()
            found.steps.append(now - before)
            if simulation.taken in (
                MIN_TRIAL_STEPS,
                2 * MIN_TRIAL_STEPS,
            ):  # the first time files grow their first blocks
                few = _timed(writer.write)
                found.extra += few
            if simulation.comm.bcast(
                simulation.taken >= MAX_TRIAL_STEPS
                or (simulation.taken >= MIN_TRIAL_STEPS and now - begin > TRIAL_SECONDS),
                root=0,
            ):
                break
            before = time.perf_counter()
        flush, more = _timed(writer.write), simulation.taken - 2 * MIN_TRIAL_STEPS
        if more > MIN_TRIAL_STEPS:
            found.storing = max(0.0, (flush - few) / (more - MIN_TRIAL_STEPS))
        saving = _timed(lambda: simulation.take_checkpoint().write(folder))
        found.checkpoint = flush + saving
        found.extra += saving
    return found


def _bent(simulation: Simulation) -> list[str]:
    """Contact parts that are not flat at some nodes, as a sentence."""
    points = np.asarray(simulation.discretisation.surface.positions)
    nodal = all(contact.points == 0 for contact in simulation.scene.contacts)
    there = len(np.unique(points, axis=0))
    if not nodal or there == len(points):
        return []
    return [
        f"{len(points)} contact points at {there} nodes: around {len(points) - there} of them the facets differ in normal, and "
        "each has a point of its own; slide much less than a facet there"
    ]


def _solutions(simulation: Simulation) -> tuple[list[str], list[str]]:
    """How many solutions a step has, as a line, and as a warning where several are possible."""
    if simulation.stepper.u is None or not len(simulation.discretisation.surface.weights):
        return [], []
    line = several_solutions.line(several_solutions.of_scene(simulation.discretisation, simulation.stepper))
    return [line] if line else [], several_solutions.sentences(
        simulation.discretisation, simulation.stepper, simulation.statistics.stages
    )


def measured(scene: Scene, *, comm: Any = None) -> Plan:
    """The plan with what it costs here: set-up and ending as they are, the trial steps times the number of steps (collective).

    The trial steps are the first ones: contact that changes more, or less, later on costs accordingly. Raises ValueError as a
    run would.
    """
    begin = time.perf_counter()
    simulation = Simulation(scene, comm=comm)
    refuse_outside(scene, simulation.discretisation.mesh)
    setup = time.perf_counter() - begin
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        tried = trial(simulation, Path(folder))
        finish(simulation, Path(folder))
        output = time.perf_counter() - begin - sum(tried.steps) - tried.extra
    output += (scene.clock.steps - 1) // scene.output.checkpoint * tried.checkpoint
    taken = len(tried.steps)
    step = tried.step if taken else float("nan")
    found = plan(scene)
    mesh = simulation.discretisation.mesh
    count = np.bincount(cell_regions(scene, mesh), minlength=1 + len(scene.regions))
    regions = [
        f"region '{name}': {n} of {len(mesh.cells)} cells" for name, n in zip(scene.regions, count[1:], strict=True)
    ]
    size = f"{simulation.discretisation.unknowns} unknowns, {len(simulation.discretisation.surface.weights)} contact points"
    unique, answer = simulation.comm.bcast(_solutions(simulation) if simulation.comm.rank == 0 else None, root=0)
    return replace(
        found,
        every_step=[*found.every_step, *unique],
        suspicious=[*found.suspicious, *_bent(simulation)],
        warnings=[*before(simulation.discretisation), *answer],
        fields=[*found.fields, size, *regions],
        solver=simulation.stepper.solver,
        setup_seconds=setup,
        step_seconds=step,
        output_seconds=output,
        seconds=setup + sum(tried.steps) + (scene.clock.steps - taken) * step + output,
        memory_bytes=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0,
    )


def table(repeats: int = 3, progress: Callable[[int, int], None] | None = None) -> list[dict[str, Any]]:
    """Predicted and measured seconds of every scene of the library: medians of `repeats` of both, in turns."""
    names, rows = library(), []
    for i, name in enumerate(names, start=1):
        scene = load(name)
        message: list[float] = []
        took: list[float] = []
        for attempt in range(repeats + 1):
            predicted = measured(scene).seconds
            with tempfile.TemporaryDirectory() as folder:
                begin = time.perf_counter()
                run(scene, out=folder)
                found = time.perf_counter() - begin
            if attempt:  # the first one loads libraries
                message.append(predicted)
                took.append(found)
        middle, real = float(np.median(message)), float(np.median(took))
        rows.append(
            {
                "scene": name,
                "steps": scene.clock.steps,
                "predicted_s": middle,
                "measured_s": real,
                "ratio": middle / real,
            }
        )
        if progress:
            progress(i, len(names))
    return rows
