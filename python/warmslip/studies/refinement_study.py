"""The refinement study of a scene: every member of an h,k grid advances beside the reference and is measured as it goes.

All members share the clock of the reference, so nothing is stored: at each time that a member reaches, its distance to
the reference is measured and its maximum kept. Members on one mesh share their operators; each step size has its factors.
"""

from __future__ import annotations

import math
import resource
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from mpi4py import MPI

from warmslip._core import compiler, petsc_version
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.model.stress import stress_measures
from warmslip.records import provenance
from warmslip.scene.errors import SceneError
from warmslip.scene.scene import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.statistics import BALANCES
from warmslip.simulation.summary import petsc_options
from warmslip.studies import run_numbers
from warmslip.studies.error_norms import Comparison, Largest


def members(levels: list[int], reference: int, grid: str) -> list[tuple[int, int]]:
    """(1/h, steps) of the grid: `diagonal` has h = k, `full` every pair; the reference itself is not a member.

    Raises SceneError for a reference that is not finer than every level, levels that repeat, or sizes that are not nested.
    """
    if max(levels) >= reference:
        raise SceneError(
            f"the reference 1/{reference} is not finer than the level 1/{max(levels)}; give a larger --reference"
        )
    if len(set(levels)) < len(levels):
        raise SceneError(f"levels {levels} name a size twice; name each once")
    if any(reference % level for level in levels):
        raise SceneError(
            f"levels {levels} do not divide the reference {reference}; meshes and times would not be nested"
        )
    if grid == "diagonal":
        return [(n, n) for n in levels]
    sizes = [*levels, reference]
    return [(n, m) for n in sizes for m in sizes if (n, m) != (reference, reference)]


def row(simulation: Simulation, errors: dict[str, float] | None) -> dict[str, Any]:
    """One line of the table: errors (blank for the reference), what the run cost, and whether it was right."""
    s, d = simulation.stepper, simulation.discretisation
    cost = {name: getattr(s.cost, name) for name in type(s.cost).items}
    return (
        {
            "n": simulation.scene.mesh.level,
            "steps": simulation.scene.time.steps,
            "h": 1 / simulation.scene.mesh.level,
            "k": simulation.scene.step,
        }
        | {f"e_{name}": value for name, value in (errors or dict.fromkeys(Largest().values, float("nan"))).items()}
        | {"outcome": simulation.outcome}
        | {f"residual_{name}": simulation.statistics.residuals[name] for name in BALANCES}
        | run_numbers.norms(simulation)
        | stress_measures(d.mises(s), d.volumes)
        | run_numbers.contact(simulation)
        | {
            "newton_largest": simulation.statistics.newton_max,
            "safeguarded_steps": sum(
                count for stage, count in simulation.statistics.stages.items() if stage != "newton"
            ),
            "unknowns": d.unknowns,
            "cpu_seconds": run_numbers.seconds(simulation),
        }
        | cost
    )


def study(
    scene: Scene,
    *,
    levels: list[int],
    reference: int,
    grid: str = "diagonal",
    steps_per_level: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict[str, Any]]:
    """The table of a refinement study, finest last; `progress(step, steps)` follows the reference.

    A level is the number of cells along the first axis; the other axes keep their ratio to it. For a mesh from a file it is
    1, 2, 4, ..: into how many pieces an edge is cut. A level has `steps_per_level` times as many steps: 1 unless it is given,
    for a file the scene's steps. h is relative to the first side, or to the file's. Numbers of an absent field are 0.

    Errors are maxima over the common times of |u|_V, |w|_L2, |theta|_L2, |u|_L2 and of the sums of the theorem.
    Raises RuntimeError naming the member when a run is not completed.
    """
    if scene.mesh.refine:
        raise SceneError("mesh.refine: the levels of a study refine the file themselves; leave it out")
    if any(ratio != 1 for ratio in scene.mesh.grading or []):
        raise SceneError("mesh.grading: graded cells are not nested in each other; leave it out for a study")
    if scene.time.tolerance is not None:
        raise SceneError("time.tolerance: a study compares runs with steps that are given; leave it out")
    if steps_per_level is None:
        steps_per_level = scene.time.steps if scene.mesh.file is not None else 1
    if steps_per_level < 1:
        raise SceneError(f"--steps-per-level {steps_per_level} is no number of steps; give 1 or more")
    meshes: dict[int, Discretisation] = {}

    def simulation(n: int, steps: int) -> Simulation:
        one = scene.override(**_mesh(scene, n), **{"time.steps": steps_per_level * steps})
        if n not in meshes:
            meshes[n] = discretise(one)
        return Simulation(one, discretisation=replace(meshes[n], scene=one))

    finest = simulation(reference, reference)
    runs = [(simulation(n, m), Largest()) for n, m in members(levels, reference, grid)]
    compare = {n: Comparison(d, meshes[reference]) for n, d in meshes.items()}
    steps = {id(run): run.steps() for run, _ in runs}
    reference_steps = finest.steps()
    total = finest.scene.clock.steps
    for run, _ in runs:
        clock = run.scene.clock
        every = total // clock.steps
        if total % clock.steps or not np.allclose(finest.scene.clock.times[every - 1 :: every], clock.times, rtol=1e-9):
            raise SceneError(
                f"time.graded_to: the times of {run.scene.time.steps} steps are not among those of "
                f"{finest.scene.time.steps}; give --steps-per-level 4 or more"
            )
    for n in range(1, total + 1):
        _next(reference_steps, finest)
        for run, largest in runs:
            if n % (total // run.scene.clock.steps) == 0:
                _next(steps[id(run)], run)
                largest.add(compare[run.scene.mesh.level].difference(run.stepper, finest.stepper))
        if progress:
            progress(n, total)
    return [*(row(run, largest.values) for run, largest in runs), row(finest, None)]


def _mesh(scene: Scene, level: int) -> dict[str, Any]:
    """The key of the mesh of a level. Raises SceneError for a level that this mesh does not have."""
    if scene.mesh.file is not None:
        if level & (level - 1) or level > 64:
            why = "no power of two" if level & (level - 1) else "more than 64"
            raise SceneError(f"a mesh from a file is halved: level {level} is {why}; give --levels 1,2,4 --reference 8")
        return {"mesh.refine": level.bit_length() - 1}
    counts = scene.mesh.counts
    if any(level * count % counts[0] for count in counts):
        least = counts[0] // math.gcd(*counts)
        raise SceneError(
            f"mesh.n = {counts}: level {level} cannot keep the ratio of the axes; give multiples of {least}"
        )
    axes = [level * count // counts[0] for count in counts]
    return {"mesh.n": level if len(set(axes)) == 1 else axes}


def _next(steps: Any, run: Simulation) -> None:
    if next(steps, None) is None:
        m = run.scene
        raise RuntimeError(
            f"the run with n = {m.mesh.level}, steps = {m.time.steps} ended after {run.stepper.cost.steps} steps: {run.outcome}"
        )


def stamp(scene: Scene | None, **more: Any) -> dict[str, Any]:
    """Provenance of a table."""
    return provenance.stamp(
        scene,
        petsc=petsc_version,
        compiler=compiler,
        ranks=MPI.COMM_WORLD.size,
        petsc_options=petsc_options(),
        peak_memory_bytes=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
        **more,
    )
