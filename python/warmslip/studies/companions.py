"""Runs of one scene on several meshes and clocks that advance together, and how far they are from each other.

Nothing is stored: two runs are compared at each time that both reach.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from warmslip.scene.errors import SceneError
from warmslip.scene.mesh_table import COARSEST
from warmslip.scene.scene import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.studies.error_norms import TERMS, Comparison
from warmslip.studies.point_values import PointComparison

FUNCTIONALS = ("normal_force", "tangential_force", "largest_pressure", "dissipated_energy", "theta_max", "theta_mean")
QUANTITIES = (*TERMS, *FUNCTIONALS)
SAME_TIME = 1e-9  # of the end


class Companion:
    """A run that is advanced step by step; `values` are its functionals at its present time."""

    def __init__(self, scene: Scene, simulation: Simulation | None = None) -> None:
        self.scene = scene
        self.simulation = simulation or Simulation(scene)
        self._steps = self.simulation.steps()
        self._dissipated = 0.0
        self._weights = np.asarray(self.simulation.discretisation.surface.weights)
        self._normals = np.asarray(self.simulation.discretisation.surface.normals)
        self.values = dict.fromkeys(FUNCTIONALS, 0.0)
        self._factoring = float(self.simulation.stepper.cost.setup_seconds)
        self._stepping = 0.0
        self.seconds = 0.0  # CPU, of the first factorization and of the steps

    @property
    def next_time(self) -> float:
        """The end of the step that is next, time; infinite at the end."""
        ahead = self.simulation.pace.next()
        return np.inf if ahead is None else ahead.time

    @property
    def finished(self) -> bool:
        """Whether the run is at its end."""
        return self.next_time == np.inf

    @property
    def time(self) -> float:
        """The present time."""
        return float(self.simulation.stepper.time)

    def advance(self) -> None:
        """One step. Raises RuntimeError, naming the run, when it is rejected."""
        began = time.process_time()
        done = next(self._steps, None)
        self._stepping += time.process_time() - began
        s = self.simulation
        if done is None:
            level, clock = self.scene.mesh.level, self.scene.time
            why = f": {s.failure['reason']}" if s.failure and s.failure["reason"] else ""
            raise RuntimeError(
                f"the run with n = {level}, steps = {clock.steps} ended at t = {s.stepper.time:g} with {s.outcome}{why}"
            )
        report = done[1]
        balances = report.balances
        self._dissipated += balances.viscous + balances.friction
        d, stepper = s.discretisation, s.stepper
        values = {
            "normal_force": report.normal_force,
            "tangential_force": float(np.linalg.norm(report.friction_traction)),
            "dissipated_energy": self._dissipated,
        }
        if len(self._weights) and d.problem.moves:
            force = np.reshape(stepper.contact_force, (-1, d.dim))
            values["largest_pressure"] = float((np.sum(force * self._normals, axis=1) / self._weights).max())
        if d.problem.conducts:
            values["theta_max"] = float(stepper.theta.max()[1])
            values["theta_mean"] = self._mean()
        self.values = {name: values.get(name, 0.0) for name in FUNCTIONALS}
        self.seconds = self._factoring + self._stepping

    def _mean(self) -> float:
        """Mean temperature of the body."""
        d = self.simulation.discretisation

        def integral() -> Any:
            one = d.layout.vector(1)
            one.set(1.0)
            weights = one.duplicate()
            d.operators.mass.mult(one, weights)
            return weights, one.dot(weights)

        weights, whole = d.remember("mean", integral)
        return float(self.simulation.stepper.theta.dot(weights) / whole)

    def norms(self) -> dict[str, float]:
        """|u|_V, |w|_L2 and |theta|_L2, 0 of a field there is not (collective)."""
        d, s = self.simulation.discretisation, self.simulation.stepper
        measures = (("u_V", s.u, d.norms.v), ("w_L2", s.w, d.norms.l2), ("theta_L2", s.theta, d.norms.l2))
        return {name: norm(field) if field is not None else 0.0 for name, field, norm in measures}


@dataclass
class Distance:
    """Largest differences of two runs over their common times, by quantity, and how many such times there were."""

    values: dict[str, float] = field(default_factory=lambda: dict.fromkeys(QUANTITIES, 0.0))
    times: int = 0

    def add(self, found: dict[str, float]) -> None:
        """Takes in one time."""
        self.values = {name: max(value, found[name]) for name, value in self.values.items()}
        self.times += 1


def march(
    runs: Sequence[Companion],
    pairs: Sequence[tuple[int, int]],
    progress: Callable[[float, float], None] | None = None,
    *,
    nested: bool = True,
) -> tuple[list[Distance], dict[str, float]]:
    """Advances runs to their end together (collective).

    Parameters
    ----------
    runs : sequence of Companion
        All have the same end.
    pairs : sequence of (int, int)
        Which two to compare, the finer one first.
    progress : callable, optional
        Called as ``progress(time, end)``.
    nested : bool
        Whether the mesh of the first one of a pair is a refinement of the other's: distances are exact then.

    Returns
    -------
    list of Distance
        A pair each.
    dict of float
        The largest value of every quantity in the first run.

    Raises
    ------
    RuntimeError
        When a run is rejected.
    """
    distances = [Distance() for _ in pairs]
    comparisons = [
        (Comparison if nested else PointComparison)(
            runs[coarse].simulation.discretisation, runs[fine].simulation.discretisation
        )
        for fine, coarse in pairs
    ]
    largest = dict.fromkeys(QUANTITIES, 0.0)
    end = runs[0].scene.time.end
    while (ahead := min(run.next_time for run in runs)) < np.inf:
        # a step that is taken back ends earlier than was announced; the others then wait until its run has come to their time
        moved = [run for run in runs if run.next_time <= ahead + SAME_TIME * end]
        for run in moved:
            run.advance()
        if runs[0] in moved:
            found = runs[0].norms() | runs[0].values
            largest = {name: max(value, abs(found[name])) for name, value in largest.items()}
        for distance, comparison, (fine, coarse) in zip(distances, comparisons, pairs, strict=True):
            one, other = runs[fine], runs[coarse]
            if (one in moved or other in moved) and abs(one.time - other.time) <= SAME_TIME * end:
                gaps = comparison.difference(other.simulation.stepper, one.simulation.stepper)
                distance.add(gaps | {name: abs(one.values[name] - other.values[name]) for name in FUNCTIONALS})
        if progress:
            progress(ahead, end)
    return distances, largest


def coarser(scene: Scene, times: int = 1) -> Scene:
    """The scene on the mesh of which its own is the `times`-fold refinement. Raises SceneError where there is none."""
    table = scene.mesh
    if table.file is not None:
        if table.refine - times < (1 if table.graded_to else 0):
            least = times + (1 if table.graded_to else 0)
            raise SceneError(
                f"mesh.refine = {table.refine}: the mesh cannot be coarsened {times} times; give refine = {least}"
            )
        return scene.override(**{"mesh.refine": table.refine - times})
    if any(ratio != 1 for ratio in table.grading or []):
        raise SceneError("mesh.grading: its cells are not nested in coarser ones; leave it out, or give graded_to")
    divisor, counts = 2**times, table.counts
    small = any(count % divisor or count < 2 * divisor for count in counts)
    if small or (table.graded_to and table.halvings <= times):
        least = 2 * COARSEST * divisor if table.graded_to else 2 * divisor  # cells along the shortest side
        common = math.gcd(*counts)
        unit = [count // common for count in counts]
        multiple = divisor * max(1, round(common / divisor), math.ceil(least / min(unit) / divisor))
        wanted = [one * multiple for one in unit]
        n = wanted[0] if len(set(wanted)) == 1 else wanted
        raise SceneError(
            f"mesh.n = {table.n}: the mesh cannot be halved {times} times to two cells or more along each side; give n = {n}"
        )
    halves = [count // divisor for count in counts]
    return scene.override(**{"mesh.n": halves[0] if isinstance(table.n, int) else halves})


def slower(scene: Scene, times: int = 1) -> Scene:
    """The scene with steps that are 2^times as long, at times that its own contain. Raises SceneError where there are none."""
    time, factor = scene.time, 2**times
    if time.tolerance is not None:
        return scene.override(**{"time.tolerance": min(1.0, time.tolerance * 4.0**times)})

    def nests(steps: int) -> bool:
        return steps % factor == 0 and all(
            one.steps == factor * other.steps
            for one, other in zip(
                scene.override(**{"time.steps": steps}).clock.blocks,
                scene.override(**{"time.steps": steps // factor}).clock.blocks,
                strict=True,
            )
        )

    if not nests(time.steps):
        above = factor * math.ceil(time.steps / factor)
        found = next((n for n in range(above, above + 400 * factor, factor) if nests(n)), None)
        cure = f"give {found}" if found else "give times whose distances are simple fractions of the end"
        raise SceneError(f"time.steps = {time.steps}: the steps cannot be joined {times} times in pairs; {cure}")
    return scene.override(**{"time.steps": time.steps // factor})


def order(gaps: Sequence[float], least: float, most: float, default: float) -> float:
    """The order that successive gaps, coarse to fine, of halved sizes show: between `least` and `most`."""
    seen = [float(np.log2(a / b)) for a, b in pairwise(gaps) if a > 0 and b > 0]
    return float(np.clip(seen[-1], least, most)) if seen else default
