"""Pilot runs of a scene: how its errors and its cost depend on mesh and steps, and the cheapest setting of every kind.

Errors are modelled by a part C h^p of space for every kind of mesh (uniform, or graded to the singular corners) and a part D k^q
of time for every kind of steps (equal, graded to t = 0, or chosen by a tolerance k^2), with constants and orders from pilot
runs. So is how the parts add up: two that are largest at different times or places make less than their sum.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warmslip.mesh import files
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.scene.errors import SceneError
from warmslip.scene.mesh_table import COARSEST
from warmslip.scene.scene import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.studies.companions import QUANTITIES, Companion, march, order
from warmslip.studies.error_estimate import JUMPS, orders, richardson

FAR = 2.5  # of a choice from its pilots, in cells along a side or steps
CLOSER = 0.1  # share of the cost of a choice that another pilot run is worth
AGAIN = 0.25  # or share of what the pilots have cost
SPENT = 0.5  # share of the seconds that are allowed which such runs may take
BINDING = 0.3  # share of the error of a setting from which on a part of it matters
ASSUMED = 0.9  # order of a mesh of which there are but two pilots
HALVINGS = 8  # of the first block of graded steps
EXPONENTS = {2: (2.2, 3.0), 3: (4.0, 6.0)}  # of cells an axis, in the cost of a step and of a factorization
MESHES, STEPS = ("uniform", "graded"), ("equal", "graded", "adaptive")
LONGEST = 16  # longest steps of an adaptive clock
LEAST, LARGEST = {2: 8, 3: 4}, {2: 1024, 3: 64}  # cells along the shortest side that are considered
MOST_STEPS = 100_000
MOST_PILOT_CELLS = 100_000

WAVES = 1.25  # by which errors are raised where waves jump: two scenes erred 1.20 and 1.24 times as much as estimated
UNKNOWN = 0.1  # of the larger part: a smaller one does not show how parts add up

Say = Callable[[str], None]


def together(space: float, time: float, power: float) -> float:
    """The error of two parts: their sum for a power of 1, and as if they were orthogonal for 2."""
    larger = max(space, time)
    return larger * ((space / larger) ** power + (time / larger) ** power) ** (1 / power) if larger > 0 else 0.0


def power_of(space: float, time: float, both: float) -> float:
    """The power in [1, 2] with which two parts make what they make together."""
    from scipy.optimize import brentq  # a quarter of a second, for few runs

    if both >= space + time:
        return 1.0
    if both <= together(space, time, 2.0):
        return 2.0
    return float(brentq(lambda power: together(space, time, power) - both, 1.0, 2.0))


@dataclass(frozen=True)
class Setting:
    """Kind of mesh and steps, how fine the mesh is, and the number of steps where all are equal.

    `cells` multiplies the smallest counts of cells that have the ratio of the scene's; of a file it is `refine`.

    With graded steps the longest one is that of so many equal ones; the tolerance of adaptive ones is 1/count^2.
    """

    mesh: str
    steps: str
    cells: int
    count: int


@dataclass(frozen=True)
class Model:
    """An error C (1/size)^order of every quantity, and the distances to half the size from which it was found."""

    constant: dict[str, float]
    order: dict[str, float]
    size: float
    gap: dict[str, float]

    def at(self, quantity: str, size: float) -> float:
        """The error at so many cells along a side, or steps."""
        return float(self.constant[quantity] * size ** -self.order[quantity])

    def order_to(self, quantity: str, size: float, gap: float, bounds: tuple[float, float]) -> float:
        """The order between this size and a finer one with its own distance, safer than that of the pilots alone."""
        if size < 1.5 * self.size or not (gap > 0 and self.gap[quantity] > 0):
            return self.order[quantity]
        return float(np.clip(math.log(self.gap[quantity] / gap) / math.log(size / self.size), *bounds))


@dataclass(frozen=True)
class Price:
    """What pilots cost: CPU seconds of a step and a factorization, and bytes of a factor, at so many cells."""

    cells: int
    step: float
    factor: float
    bytes: float


@dataclass(frozen=True)
class Choice:
    """A setting with what it is predicted to err and to cost."""

    setting: Setting
    scene: Scene
    error: float  # relative, dimensionless
    seconds: float
    bytes: float
    met: bool  # whether the error is what was asked for


class Pilots:
    """Pilot runs of one scene, and the models that they give."""

    def __init__(self, scene: Scene, quantities: Sequence[str], say: Say, limit: float = math.inf) -> None:
        self.scene, self.quantities, self._say, self.limit = scene, list(quantities), say, limit
        self.seconds = 0.0
        self.sizes = dict.fromkeys(QUANTITIES, 0.0)
        self.space: dict[str, Model] = {}
        self.time: dict[str, Model] = {}
        self.power = dict.fromkeys(QUANTITIES, 1.0)  # with which the parts of space and time add up
        self.price: Price | None = None
        # their errors in space grow with the number of steps: pilots with few of them say little
        self._undamped = orders(scene, "time")[0] == JUMPS
        self._assembled: dict[str, Discretisation] = {}
        self._cells: dict[str, int] = {}  # the finest pilot of every kind of mesh, and of steps
        self._counts: dict[str, int] = {}
        self._clocks: dict[str, tuple[float, int]] = {}  # steps over the count, and step sizes, of every kind of steps
        d = scene.mesh.dim
        self.file = scene.mesh.file is not None
        counts = scene.mesh.counts if not self.file else [1]
        self._cells_of_file = len(files.read(str(scene.mesh.file)).cells) if self.file else 0
        gcd = math.gcd(*counts)
        self._unit = [count // gcd for count in counts]
        self.first = 4
        while self.first * min(self._unit) < (16 if d == 2 else 8):
            self.first *= 2
        self.count = 16

    def make(self, setting: Setting) -> Scene:
        """The scene with a setting."""
        graded = setting.steps == "graded"
        keys: dict[str, Any] = {
            "mesh.graded_to": ["corners"] if setting.mesh == "graded" else [],
            "time.steps": LONGEST if setting.steps == "adaptive" else setting.count,
            "time.graded_to": sorted({0.0, *self.scene.time.graded_to}) if graded else [],
            "time.halvings": HALVINGS if graded else None,
            "time.tolerance": setting.count**-2.0 if setting.steps == "adaptive" else None,
        }
        if self.file:
            keys["mesh.refine"] = setting.cells
        else:
            counts = [unit * setting.cells for unit in self._unit]
            keys["mesh.n"] = counts[0] if len(set(counts)) == 1 else counts
            keys["mesh.grading"] = None if setting.mesh == "graded" else self.scene.mesh.grading
        return self.scene.override(**keys)

    def size(self, cells: int) -> float:
        """The inverse of h, relative: 2^refine for a file."""
        return 2.0**cells if self.file else float(cells)

    def companion(self, setting: Setting) -> Companion:
        """A run with a setting; runs on one mesh share its operators."""
        one = self.make(setting)
        key = one.mesh.model_dump_json()
        if key not in self._assembled:
            self._assembled[key] = discretise(one)
        return Companion(one, Simulation(one, discretisation=replace(self._assembled[key], scene=one)))

    def _march(self, settings: Sequence[Setting], pairs: Sequence[tuple[int, int]] = ()) -> list[dict[str, float]]:
        """Distances of neighbours, the finest pair first, or of the given pairs."""
        runs = [self.companion(setting) for setting in settings]
        found, size = march(runs, pairs or [(i, i + 1) for i in range(len(runs) - 1)])
        self.seconds += sum(run.seconds for run in runs)
        if self.seconds > self.limit:
            raise SceneError(f"the pilot runs alone took {self.seconds:.2g} s of CPU; allow more seconds")
        self.sizes = {name: max(value, size[name]) for name, value in self.sizes.items()}
        finest = runs[0].simulation.stepper.cost
        sizes = len(runs[0].simulation.pace.record.sizes)
        self._clocks[settings[0].steps] = finest.steps / settings[0].count, sizes
        if self.price is None or settings[0].cells >= self.price.cells:
            self.price = Price(
                settings[0].cells,
                finest.step_seconds / max(finest.steps, 1),
                finest.setup_seconds / max(sizes, 1),
                finest.factor_bytes / max(sizes, 1),
            )
        return [distance.values for distance in found]

    def _model(self, part: str, gaps: list[dict[str, float]], size: float) -> Model:
        least, most = orders(self.scene, part)
        seen = {name: order([gap[name] for gap in reversed(gaps)], least, most, ASSUMED) for name in QUANTITIES}
        return Model(
            {name: richardson(name, part, gaps[0][name], seen[name]) * size ** seen[name] for name in QUANTITIES},
            seen,
            size,
            gaps[0],
        )

    def measure_space(self, mesh: str, cells: int) -> None:
        """Three meshes, up to so many cells along the shortest side, with few steps; two where a third cannot be graded."""
        if self.file and self._cells_of_file * 2.0 ** (self.scene.mesh.dim * cells) > MOST_PILOT_CELLS:
            raise SceneError(
                f"a pilot run on the file with refine = {cells} has too many cells; start from a coarser file"
            )
        sizes = [cells, cells - 1, cells - 2] if self.file else [cells, cells // 2, cells // 4]
        sizes = [one for one in sizes if self.gradable(mesh, one)] if not self.file else sizes
        if len(sizes) < 3 and self._undamped:
            raise SceneError("errors of waves need three graded meshes; the third cannot be graded")
        self._cells[mesh] = cells
        self._say(f"pilot runs: {mesh} meshes up to {'refine = ' if self.file else 'n = '}{cells}")
        settings = [Setting(mesh, "equal", one, self.count) for one in sizes]
        slower = Setting(mesh, "equal", sizes[1], self.count // 2)
        last = len(settings)
        pairs = [*((i, i + 1) for i in range(last - 1)), (1, last), (0, last)]
        *gaps, time, both = self._march([*settings, slower], pairs)
        self.space[mesh] = self._model("space", gaps, self.size(cells))
        for name in self.quantities:
            self.learn_power(name, gaps[0][name], time[name], both[name])

    def learn_power(self, name: str, space: float, time: float, both: float) -> None:
        """How the parts of a quantity add up, from three distances; what was known stays where one part hardly matters."""
        if min(space, time) > UNKNOWN * max(space, time):
            self.power[name] = power_of(space, time, both)

    def measure_time(self, steps: str, count: int) -> None:
        """Three clocks, with up to so many steps, on a coarse mesh."""
        self._counts[steps] = count
        cells = 1 if self.file else self.first
        self._say(f"pilot runs: {steps} steps, up to {count}")
        gaps = self._march([Setting("uniform", steps, cells, one) for one in (count, count // 2, count // 4)])
        self.time[steps] = self._model("time", gaps, float(count))

    def gradable(self, mesh: str, cells: int) -> bool:
        """Whether a mesh of so many cells along the shortest side exists: a graded one needs half of them as well."""
        counts = [unit * cells for unit in self._unit]
        return mesh == "uniform" or (cells % 2 == 0 and min(counts) >= 2 * COARSEST)

    def look_closer(self, found: Sequence[Choice]) -> bool:
        """Another pilot run where it is worth its cost; whether there was one.

        It is where the first choice lies far beyond the runs there were, and where the order in time of any choice is the
        smallest that is believed and matters to its error: the steps of the pilots are then too long to show the order.
        """
        best = found[0]
        worth = min(max(CLOSER * best.seconds, AGAIN * self.seconds), SPENT * self.limit - self.seconds)
        mesh, cells = best.setting.mesh, self._cells[best.setting.mesh]
        finer = cells + 1 if self.file else 2 * cells
        if self.size(best.setting.cells) > FAR * self.size(cells):
            seconds, _ = self.cost(Setting(mesh, "equal", finer, self.count))
            if 1.3 * seconds < worth:
                self.measure_space(mesh, finer)
                return True
        for choice in found:
            steps = choice.setting.steps
            count = self._counts[steps]
            far = choice is best and choice.setting.count > FAR * count
            if far or self._clamped(choice.setting):
                seconds, _ = self.cost(Setting("uniform", steps, 1 if self.file else self.first, 2 * count))
                if 1.8 * seconds < worth:
                    self.measure_time(steps, 2 * count)
                    return True
        return False

    def _clamped(self, setting: Setting) -> bool:
        """Whether the error of a setting depends on an order in time that is the smallest one believed."""
        least, _ = orders(self.scene, "time")
        model, error = self.time[setting.steps], self.error(setting)
        return any(
            model.order[name] <= least
            and self.sizes[name] > 0
            and model.at(name, float(setting.count)) > BINDING * error * self.sizes[name]
            for name in self.quantities
        )

    def error(self, setting: Setting) -> float:
        """The predicted relative error of a setting, the largest of the quantities."""
        worst = 0.0
        for name in self.quantities:
            if self.sizes[name] > 0:
                space = self.space[setting.mesh].at(name, self.size(setting.cells))
                time = self.time[setting.steps].at(name, float(setting.count))
                worst = max(worst, self.total(name, space, time) / self.sizes[name])
        return worst

    def total(self, name: str, space: float, time: float) -> float:
        """The error of a quantity from its parts, in their unit; raised where waves jump."""
        return (WAVES if self._undamped else 1.0) * together(space, time, self.power[name])

    def cost(self, setting: Setting) -> tuple[float, float]:
        """Predicted CPU seconds, and bytes of the factors, of a setting."""
        assert self.price is not None
        d = self.scene.mesh.dim
        step, factor = EXPONENTS[d]
        ratio = self.size(setting.cells) / self.size(self.price.cells)
        many, sizes = self._clocks.get(setting.steps, (1.0, 1))
        seconds = many * setting.count * self.price.step * ratio**step + sizes * self.price.factor * ratio**factor
        return seconds, min(2, sizes) * self.price.bytes * ratio ** (factor - 0.8)

    def kinds(self) -> list[tuple[str, str]]:
        """Kinds of mesh and steps that were measured."""
        return [(mesh, steps) for mesh in self.space for steps in self.time]

    def settings(self, mesh: str, steps: str) -> list[Setting]:
        """All settings of a kind that are considered."""
        d = self.scene.mesh.dim
        if self.file:
            sizes = list(range(1, 7))
        else:
            side = min(self._unit)
            sizes = sorted({base * 2**i for base in range(4, 8) for i in range(9) if base * 2**i * side <= LARGEST[d]})
            sizes = [n for n in sizes if n % 2 == 0 and n * side >= LEAST[d] and self.gradable(mesh, n)]
            if self._undamped:  # so that the run has a companion on half of them
                sizes = [n for n in sizes if self.gradable(mesh, n // 2)]
        counts = sorted({4 * max(2, round(2 ** (i / 3))) for i in range(45)})
        return [Setting(mesh, steps, cells, count) for cells in sizes for count in counts if count <= MOST_STEPS]

    def cheapest(self, mesh: str, steps: str, aim: float, seconds: float, room: float) -> Choice:
        """The cheapest setting of a kind that errs less than `aim`; the most accurate one within the limits if none does."""
        best: tuple[float, Setting] | None = None
        nearest: tuple[float, Setting] | None = None
        for setting in self.settings(mesh, steps):
            error, (cost, taken) = self.error(setting), self.cost(setting)
            if cost > seconds or taken > room:
                continue
            if error <= aim and (best is None or cost < best[0]):
                best = cost, setting
            if nearest is None or error < nearest[0]:
                nearest = error, setting
        chosen = best or nearest
        if chosen is None:
            raise SceneError("no setting is cheap enough for the time limit; allow more seconds")
        setting = chosen[1]
        cost, taken = self.cost(setting)
        return Choice(setting, self.make(setting), self.error(setting), cost, taken, best is not None)


def describe(choice: Choice) -> str:
    """A setting in words."""
    mesh, time = choice.scene.mesh, choice.scene.time
    grading = "graded to the singular corners" if choice.setting.mesh == "graded" else "uniform"
    cells = f"refine = {mesh.refine}" if mesh.file is not None else f"n = {mesh.n}"
    clock = choice.scene.clock
    steps = f"{clock.steps} steps graded to t = 0" if time.graded_to else f"{clock.steps} equal steps"
    steps = f"steps with a tolerance of {time.tolerance:.2g}" if time.tolerance is not None else steps
    return f"a mesh with {cells}, {grading}, {steps}"


def keys_of(scene: Scene) -> list[str]:
    """The keys of mesh and time of a chosen scene, as `--set` takes them."""
    mesh, time = scene.mesh, scene.time
    out = [f"mesh.refine={mesh.refine}" if mesh.file is not None else f"mesh.n={mesh.n}"]
    out += [f"mesh.graded_to={['corners'] if mesh.graded_to else []}", f"time.steps={time.steps}"]
    if time.tolerance is not None:
        return [*out, f"time.tolerance={time.tolerance!r}"]
    return [*out, f"time.graded_to={time.graded_to}"]
