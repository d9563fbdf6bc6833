"""A run whose states are kept, so that other runs are measured against it one after the other, at every time that they reach.

Between two times of the kept run its states lie on the straight line. Runs that are measured alone share no cache and no memory:
their CPU seconds are their own, and each can be dropped before the next one begins.
"""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np

from warmslip.studies.companions import FUNCTIONALS, QUANTITIES, Companion, Distance
from warmslip.studies.point_values import PointComparison
from warmslip.typing import Array

BRIEF = 0.5  # CPU seconds up to which a run is repeated, since its time is uncertain
REPEATS = 5


class Recording:
    """States and functionals of a run at all its times, on one rank.

    Attributes
    ----------
    run : Companion
        The run, at its end.
    size : dict of float
        The largest value of every quantity over its times.
    """

    def __init__(self, run: Companion) -> None:
        """Advances the run to its end. Raises RuntimeError when it is rejected."""
        d = run.simulation.discretisation
        self.run, self.size = run, dict.fromkeys(QUANTITIES, 0.0)
        moves, conducts = d.problem.moves, d.problem.conducts
        names = [*(["u", "w"] if moves else []), *(["theta"] if conducts else [])]
        self._vectors = {name: d.layout.vector(1 if name == "theta" else d.dim) for name in names}
        self._times, self._states, self._values = [run.time], [self._state()], [run.values]
        while run.next_time < np.inf:
            run.advance()
            self._times.append(run.time)
            self._states.append(self._state())
            self._values.append(run.values)
            found = run.norms() | run.values
            self.size = {name: max(value, abs(found[name])) for name, value in self.size.items()}
        self._compared: tuple[str, PointComparison] | None = None  # of the mesh that was measured last

    def _state(self) -> dict[str, Array]:
        d, stepper = self.run.simulation.discretisation, self.run.simulation.stepper
        return {name: d.layout.gather(getattr(stepper, name)).copy() for name in self._vectors}

    def at(self, time: float) -> tuple[Any, dict[str, float]]:
        """Fields `u`, `w`, `theta` (None of one there is not) and functionals at a time within the run."""
        after = int(np.clip(np.searchsorted(self._times, time), 1, len(self._times) - 1))
        start, end = self._times[after - 1], self._times[after]
        share = float(np.clip((time - start) / (end - start), 0.0, 1.0))
        layout = self.run.simulation.discretisation.layout
        for name, vector in self._vectors.items():
            before, then = self._states[after - 1][name], self._states[after][name]
            layout.distribute(before + share * (then - before), vector)
        earlier, later = self._values[after - 1], self._values[after]
        values = {name: earlier[name] + share * (later[name] - earlier[name]) for name in FUNCTIONALS}
        return SimpleNamespace(**{name: self._vectors.get(name) for name in ("u", "w", "theta")}), values

    def distance(self, run: Companion, enough: Callable[[Distance], bool] | None = None) -> Distance:
        """Advances another run to its end: its largest differences over all its times.

        It is left where it is once `enough` says so of its differences so far. Raises RuntimeError when it is rejected.
        """
        comparison, distance = self._comparison(run), Distance()
        while run.next_time < np.inf and not (enough and enough(distance)):
            run.advance()
            state, values = self.at(run.time)
            gaps = comparison.difference(run.simulation.stepper, state)
            distance.add(gaps | {name: abs(run.values[name] - values[name]) for name in FUNCTIONALS})
        return distance

    def _comparison(self, run: Companion) -> PointComparison:
        key = run.scene.mesh.model_dump_json()
        if self._compared is None or self._compared[0] != key:
            self._compared = None  # before the next one takes its memory
            coarse, fine = run.simulation.discretisation, self.run.simulation.discretisation
            self._compared = key, PointComparison(coarse, fine)
        return self._compared[1]


def seconds(run: Companion, again: Callable[[], Companion]) -> float:
    """CPU seconds of a finished run; of a brief one the least of several runs, which `again` begins."""
    best, spent = run.seconds, run.seconds
    for _ in range(REPEATS - 1):
        if spent > BRIEF:
            break
        other = again()
        while other.next_time < np.inf:
            other.advance()
        best, spent = min(best, other.seconds), spent + other.seconds
    return best
