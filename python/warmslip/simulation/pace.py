"""Which step a run takes next: one of its clock, or one that the estimated error of the last steps allows."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np

from warmslip.scene.scene import Scene

FLOOR = 24  # halvings of the longest step at most
STRIDE = 6  # halvings at once at most
SAME = 1e-9  # relative difference of times that are one
NO_STEP = "the state is at t = {:.6g}, where no step of the scene ends; give a time of its clock"
SAFETY = 2.0  # an estimate is this far below the tolerance before steps grow


class Step(NamedTuple):
    """The step that is to be taken: its number from 1, its end and its size, times, whether it is the last one, and the end of
    the step before."""

    number: int
    time: float
    size: float
    last: bool
    begin: float


@dataclass
class Record:
    """What became of the steps: how many were taken of each size, how many were rejected for their estimated error or for a
    solve that failed, and how many were taken at the smallest size although their estimate exceeds the tolerance."""

    sizes: dict[float, int] = field(default_factory=dict)
    rejected: int = 0
    failed: int = 0
    beyond: int = 0


class FixedPace:
    """The steps of a scene whose clock is known beforehand."""

    def __init__(self, scene: Scene) -> None:
        self._clock, self.taken, self.record = scene.clock, 0, Record()

    @property
    def expected(self) -> int:
        """Number of steps of the whole run."""
        return self._clock.steps

    @property
    def finished(self) -> bool:
        """Whether the last step was taken."""
        return self.taken >= self._clock.steps

    def next(self) -> Step | None:
        """The step to take, None at the end."""
        if self.finished:
            return None
        n = self.taken + 1
        time, size = self._clock.step(n)
        return Step(n, time, size, n == self._clock.steps, self._clock.step(self.taken)[0] if self.taken else 0.0)

    def reached(self, time: float) -> bool:
        """Whether the last step that was taken ends at a time."""
        return self.taken <= self._clock.steps and _same(self._clock.step(self.taken)[0] if self.taken else 0.0, time)

    def start_at(self, time: float) -> None:
        """Begins with the step after a time. Raises ValueError where no step ends."""
        self.taken = int(np.searchsorted(self._clock.times, time * (1 + SAME), side="right"))
        if not self.reached(time):
            raise ValueError(NO_STEP.format(time))

    def accept(self, size: float) -> None:
        """Counts a step that was taken."""
        self.taken += 1
        self.record.sizes[size] = self.record.sizes.get(size, 0) + 1

    def state(self) -> dict[str, Any]:
        """What a checkpoint keeps, plain numbers."""
        sizes = [list(pair) for pair in self.record.sizes.items()]
        return {"taken": self.taken, "steps": self._clock.steps, "sizes": sizes}

    def restore(self, state: dict[str, Any]) -> None:
        """Takes over what a checkpoint kept."""
        self.taken = state["taken"]
        self.record.sizes = dict(state["sizes"])


class AdaptivePace:
    """Steps of the sizes k 2^-j, k the longest one, so that the estimated error of each stays below a tolerance.

    A step of size k 2^-j begins at a multiple of its size: the times are exact, and the last one is the end. The estimate falls
    with the square of the step. A step whose estimate exceeds the tolerance is taken back and repeated with a smaller one. Steps
    grow once the steps that this would have saved are worth the factorization that it costs (none where the factors are kept).
    """

    def __init__(self, scene: Scene) -> None:
        assert scene.time.tolerance is not None
        self.tolerance = scene.time.tolerance
        self._steps, self._end = scene.time.steps, scene.time.end
        self.taken, self.level, self.ticks, self.waste = 0, 0, 0, 0.0
        self.record = Record()

    def size(self, level: int) -> float:
        """The step size of a level, time."""
        return self._end / self._steps * 2.0**-level

    @property
    def expected(self) -> int:
        """Steps taken, and those that are left at the present size."""
        left = self._steps * 2**FLOOR - self.ticks
        return int(self.taken + math.ceil(left * 2.0 ** (self.level - FLOOR)))

    @property
    def finished(self) -> bool:
        """Whether the last step was taken."""
        return self.ticks >= self._steps << FLOOR

    def next(self) -> Step | None:
        """The step to take, None at the end."""
        if self.finished:
            return None
        whole = self._steps * 2**FLOOR
        end = self.ticks + 2 ** (FLOOR - self.level)
        time = self._end if end == whole else self._end * (end / whole)
        return Step(self.taken + 1, time, self.size(self.level), end == whole, self._end * (self.ticks / whole))

    def reached(self, time: float) -> bool:
        """Whether the last step that was taken ends at a time."""
        return self.ticks <= self._steps * 2**FLOOR and _same(self._end * (self.ticks / (self._steps * 2**FLOOR)), time)

    def start_at(self, time: float) -> None:
        """Begins with the step after a time. Raises ValueError where no step of the longest size ends."""
        self.taken = max(0, round(time / self._end * self._steps))
        self.ticks, self.level, self.waste = self.taken * 2**FLOOR, 0, 0.0
        if not self.reached(time):
            raise ValueError(NO_STEP.format(time))

    def fail(self) -> bool:
        """After a step that could not be solved: whether a smaller one is left to try."""
        if self.level >= FLOOR:
            return False
        self.record.failed += 1
        self._refine(2)
        return True

    def judge(self, estimate: float) -> bool:
        """Whether a step with this estimated error, dimensionless, is good enough; if not, the next one is smaller."""
        if estimate <= self.tolerance:
            return True
        if self.level >= FLOOR:
            self.record.beyond += 1
            return True
        self.record.rejected += 1
        needed = math.log2(estimate / self.tolerance) / 2 if math.isfinite(estimate) else STRIDE
        self._refine(max(1, math.ceil(needed)))
        return False

    def _refine(self, levels: int) -> None:
        self.level = min(FLOOR, self.level + min(levels, STRIDE))
        self.waste = 0.0

    def accept(self, estimate: float, price: float) -> None:
        """Counts a step that was taken, and lets the next ones grow. `price` is about what a factorization costs, in steps."""
        size = self.size(self.level)
        self.taken += 1
        self.record.sizes[size] = self.record.sizes.get(size, 0) + 1
        self.ticks += 2 ** (FLOOR - self.level)
        room = self.tolerance / SAFETY
        allowed = 0
        while allowed < self.level and estimate * 4.0 ** (allowed + 1) <= room:
            allowed += 1
        if allowed == 0:
            self.waste = 0.0
            return
        self.waste += 1 - 2.0**-allowed
        while allowed > 0 and self.ticks % 2 ** (FLOOR - self.level + allowed):
            allowed -= 1
        known = (
            self.size(self.level - allowed) in self.record.sizes
        )  # not what is kept: a resumed run has other factors
        if allowed and self.waste >= (1 if known else price):
            self.level -= allowed
            self.waste = 0.0

    def state(self) -> dict[str, Any]:
        """What a checkpoint keeps, plain numbers."""
        record = asdict(self.record) | {"sizes": [list(pair) for pair in self.record.sizes.items()]}
        return {name: getattr(self, name) for name in ("taken", "level", "ticks", "waste")} | record

    def restore(self, state: dict[str, Any]) -> None:
        """Takes over what a checkpoint kept."""
        for name in ("taken", "level", "ticks", "waste"):
            setattr(self, name, state[name])
        sizes = dict(state["sizes"])
        self.record = Record(sizes, state["rejected"], state["failed"], state["beyond"])


def _same(time: float, other: float) -> bool:
    return abs(time - other) <= SAME * max(abs(time), abs(other))


def pace(scene: Scene) -> FixedPace | AdaptivePace:
    """The pace of a scene at its start."""
    return FixedPace(scene) if scene.time.tolerance is None else AdaptivePace(scene)


def fits(state: Any, other: dict[str, Any]) -> bool:
    """Whether what a checkpoint holds is the state of a pace, as the `other` is."""
    if not isinstance(state, dict) or state.keys() != other.keys():
        return False
    pairs = state["sizes"]
    if not isinstance(pairs, list) or not all(isinstance(pair, list) and len(pair) == 2 for pair in pairs):
        return False
    numbers = [value for name, value in state.items() if name != "sizes"] + [value for pair in pairs for value in pair]
    if not all(type(value) in (int, float) and math.isfinite(value) and value >= 0 for value in numbers):
        return False
    if "steps" in other:
        return bool(state["taken"] <= state["steps"])
    return bool(state["level"] <= FLOOR) and all(type(state[name]) is int for name in ("taken", "level", "ticks"))
