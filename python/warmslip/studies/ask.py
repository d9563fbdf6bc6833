"""An error asked for: a few cheap runs tell how errors and cost depend on mesh and steps, and the cheapest setting is run.

Errors are modelled by C h^p + D k^q for every kind of mesh (uniform, or graded to the singular corners) and of steps (equal,
graded to t = 0, or chosen by a tolerance k^2), with constants and orders from pilot runs. The run that is chosen has companions
on half its mesh and steps; if their distance says that the error is larger than was asked for, a finer setting is run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from warmslip.mesh import files
from warmslip.messages import quoted
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.scene.errors import SceneError
from warmslip.scene.mesh_table import COARSEST
from warmslip.scene.scene import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.studies.companions import QUANTITIES, Companion, march, order
from warmslip.studies.error_estimate import ORDERS, richardson
from warmslip.studies.error_norms import TERMS

SAFETY = 1.3  # what is aimed at lies so far below what is asked for
ROUND_OFF = 1e-10  # relative errors below it are not promised
FAR = 2.5  # of a choice from its pilots, in cells along a side or steps
CLOSER = 0.1  # share of the cost of a choice that another pilot run is worth
TRIES = 3  # settings that are run at most
HALVINGS = 8  # of the first block of graded steps
EXPONENTS = {2: (2.2, 3.0), 3: (4.0, 6.0)}  # of cells an axis, in the cost of a step and of a factorization
MESHES, STEPS = ("uniform", "graded"), ("equal", "graded", "adaptive")
LONGEST = 16  # longest steps of an adaptive clock
LARGEST = {2: 1024, 3: 64}  # cells along the shortest side that are considered
MOST_STEPS = 100_000
MOST_PILOT_CELLS = 100_000
KEPT = 0.5  # share of the memory of the machine that a run may take

Say = Callable[[str], None]


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
    """An error C (1/size)^order of every quantity, and where it was seen."""

    constant: dict[str, float]
    order: dict[str, float]

    def at(self, quantity: str, size: float) -> float:
        """The error at so many cells along a side, or steps."""
        return float(self.constant[quantity] * size ** -self.order[quantity])


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


@dataclass
class Plan:
    """All that pilots found: the choice, the best of every other kind of mesh and steps, and what the pilots cost.

    Attributes
    ----------
    choice : Choice
        The cheapest setting whose predicted error is small enough.
    alternatives : list of Choice
        The cheapest one of every other kind.
    quantities : list of str
        What the error is of.
    pilot_seconds : float
        CPU seconds of the pilot runs.
    orders : dict
        Observed orders by kind and quantity.
    """

    choice: Choice
    alternatives: list[Choice]
    quantities: list[str]
    pilot_seconds: float
    orders: dict[str, dict[str, float]] = field(default_factory=dict)


def wanted(scene: Scene, of: str) -> list[str]:
    """The quantities that a name stands for. Raises SceneError for one that the scene does not have."""
    there = {
        "u_V": scene.moves,
        "w_L2": scene.moves,
        "theta_L2": scene.heat is not None,
        **dict.fromkeys(("theta_max", "theta_mean"), scene.heat is not None),
        **dict.fromkeys(
            ("normal_force", "tangential_force", "largest_pressure"),
            any(c.stiffness is not None for c in scene.contacts),
        ),
        "dissipated_energy": scene.moves,
    }
    if of == "all":  # without viscosity the velocity jumps, and its largest error over time does not fall
        smooth = scene.viscosity is not None and scene.inertia is not None
        return [name for name in TERMS if there[name] and (smooth or name != "w_L2")]
    if not isinstance(of, str) or of not in QUANTITIES:
        raise SceneError(f"of: {quoted(of)} is unknown; give all, or one of {', '.join(QUANTITIES)}")
    if not there[of]:
        raise SceneError(f"of: the scene has no {of}; give another quantity")
    return [of]


class Pilots:
    """Pilot runs of one scene, and the models that they give."""

    def __init__(self, scene: Scene, quantities: Sequence[str], say: Say, limit: float = math.inf) -> None:
        self.scene, self.quantities, self._say, self.limit = scene, list(quantities), say, limit
        self.seconds = 0.0
        self.sizes = dict.fromkeys(QUANTITIES, 0.0)
        self.space: dict[str, Model] = {}
        self.time: dict[str, Model] = {}
        self.price: Price | None = None
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
        self._first = 4
        while self._first * min(self._unit) < (16 if d == 2 else 8):
            self._first *= 2
        self._count = 16

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

    def _march(self, settings: Sequence[Setting]) -> list[dict[str, float]]:
        """Distances of neighbours, the finest pair first."""
        runs = [self.companion(setting) for setting in settings]
        found, size = march(runs, [(i, i + 1) for i in range(len(runs) - 1)])
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
        least, most = ORDERS[part]
        orders = {name: order([gap[name] for gap in reversed(gaps)], least, most, 1.0) for name in QUANTITIES}
        return Model(
            {name: richardson(name, part, gaps[0][name], orders[name]) * size ** orders[name] for name in QUANTITIES},
            orders,
        )

    def measure_space(self, mesh: str, cells: int) -> None:
        """Three meshes, up to so many cells along the shortest side, with few steps."""
        if self.file and self._cells_of_file * 2.0 ** (self.scene.mesh.dim * cells) > MOST_PILOT_CELLS:
            raise SceneError(
                f"a pilot run on the file with refine = {cells} has too many cells; start from a coarser file"
            )
        self._cells[mesh] = cells
        sizes = [cells, cells - 1, cells - 2] if self.file else [cells, cells // 2, cells // 4]
        self._say(f"pilot runs: {mesh} meshes up to {'refine = ' if self.file else 'n = '}{cells}")
        gaps = self._march([Setting(mesh, "equal", one, self._count) for one in sizes])
        self.space[mesh] = self._model("space", gaps, self.size(cells))

    def measure_time(self, steps: str, count: int) -> None:
        """Three clocks, with up to so many steps, on a coarse mesh."""
        self._counts[steps] = count
        cells = 1 if self.file else self._first
        self._say(f"pilot runs: {steps} steps, up to {count}")
        gaps = self._march([Setting("uniform", steps, cells, one) for one in (count, count // 2, count // 4)])
        self.time[steps] = self._model("time", gaps, float(count))

    def look_closer(self, choice: Choice) -> bool:
        """Another pilot run where a choice lies far beyond those there were and costs far more; whether there was one."""
        mesh, steps, worth = choice.setting.mesh, choice.setting.steps, CLOSER * choice.seconds
        cells, count = self._cells[mesh], self._counts[steps]
        finer = cells + 1 if self.file else 2 * cells
        if self.size(choice.setting.cells) > FAR * self.size(cells):
            seconds, _ = self.cost(Setting(mesh, "equal", finer, self._count))
            if 1.3 * seconds < worth:
                self.measure_space(mesh, finer)
                return True
        if choice.setting.count > FAR * count:
            seconds, _ = self.cost(Setting("uniform", steps, 1 if self.file else self._first, 2 * count))
            if 1.8 * seconds < worth:
                self.measure_time(steps, 2 * count)
                return True
        return False

    def error(self, setting: Setting) -> float:
        """The predicted relative error of a setting, the largest of the quantities."""
        worst = 0.0
        for name in self.quantities:
            if self.sizes[name] > 0:
                space = self.space[setting.mesh].at(name, self.size(setting.cells))
                time = self.time[setting.steps].at(name, float(setting.count))
                worst = max(worst, (space + time) / self.sizes[name])
        return worst

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
            sizes = [n for n in sizes if n % 2 == 0 and n * side >= 8]
            if mesh == "graded":  # also on half the cells, which the companions have
                sizes = [n for n in sizes if n % 4 == 0 and n * side >= 4 * COARSEST]
        counts = sorted({4 * max(4, round(2 ** (i / 3))) for i in range(45)})
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


def _memory() -> float:
    """Bytes of the machine's memory."""
    import os

    return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))


def plan(scene: Scene, error: float, of: str = "all", *, seconds: float = math.inf, say: Say = lambda _: None) -> Plan:
    """Chooses mesh, grading and steps for a relative error.

    Parameters
    ----------
    scene : Scene
        What is to be run; its own sizes of mesh and steps do not matter.
    error : float
        Largest relative error over time, dimensionless, in (0, 1).
    of : str
        `all` (the norms of the fields there are), or one of `companions.QUANTITIES`.
    seconds : float
        CPU seconds that the run may take.
    say : callable, optional
        Called with a line about every pilot run.

    Returns
    -------
    Plan
        The choice, alternatives, and what the pilots found.

    Raises
    ------
    SceneError
        For an error that cannot be had, with the best that can be.
    RuntimeError
        When a pilot run is rejected.
    """
    return _plan(scene, error, of, seconds, say)[0]


def _plan(scene: Scene, error: float, of: str, seconds: float, say: Say) -> tuple[Plan, Pilots]:
    if isinstance(error, bool) or not isinstance(error, int | float) or not 0 < error < 1:
        raise SceneError(f"error: {quoted(error)} is no relative error; give a number between 0 and 1, such as 0.01")
    if error < ROUND_OFF:
        raise SceneError(f"error: {error:g} is below what rounding leaves; ask for {ROUND_OFF:g} or more")
    if not seconds > 0:
        raise SceneError(f"seconds: {seconds:g} s is no time to run in; give a positive number")
    if any(ratio != 1 for ratio in scene.mesh.grading or []):
        raise SceneError(
            "mesh.grading: its cells are not nested in coarser ones; leave it out, the mesh is chosen here"
        )
    quantities = wanted(scene, of)
    pilots = Pilots(scene, quantities, say, seconds)
    first = 2 if pilots.file else 2 * pilots._first
    for mesh in MESHES:
        try:
            pilots.measure_space(mesh, first + (1 if pilots.file and mesh == "graded" else 0))
        except (SceneError, ValueError):  # no singular corner, or a mesh that cannot be graded
            if mesh == "uniform" or pilots.seconds > seconds:
                raise
            say("no graded mesh: the solution is singular at no corner, or the mesh cannot be halved often enough")
    for steps in STEPS:
        pilots.measure_time(steps, 4 * pilots._count)
    aim, room = error / SAFETY, KEPT * _memory()
    while True:
        found = [pilots.cheapest(mesh, steps, aim, seconds, room) for mesh, steps in pilots.kinds()]
        best = min((one for one in found if one.met), key=lambda one: one.seconds, default=None)
        if not pilots.look_closer(best or min(found, key=lambda one: one.error)):
            break
    if best is None:
        nearest = min(found, key=lambda one: one.error)
        least = math.ceil(1000 * SAFETY * nearest.error * 1.05) / 1000
        limit = f" in {seconds:g} s" if math.isfinite(seconds) else ""
        raise SceneError(
            f"an error of {100 * error:.3g} % cannot be had{limit}; the best is {100 * least:.3g} %, in about "
            f"{nearest.seconds:.2g} s: ask for that, or allow more"
        )
    orders = {f"{mesh} mesh": pilots.space[mesh].order for mesh in pilots.space}
    orders |= {f"{steps} steps": pilots.time[steps].order for steps in pilots.time}
    orders = {kind: {name: values[name] for name in quantities} for kind, values in orders.items()}
    others = sorted((one for one in found if one is not best), key=lambda one: (not one.met, one.seconds))
    return Plan(best, others, quantities, pilots.seconds, orders), pilots


@dataclass(frozen=True)
class Answer:
    """A run whose error was asked for.

    Attributes
    ----------
    scene : Scene
        What was run.
    simulation : Simulation
        The run at its end.
    error : float
        Its estimated relative error, the largest of the quantities, dimensionless.
    parts : dict
        Relative errors from space and time by quantity.
    plan : Plan
        How it was chosen.
    tries : list of Choice
        The settings that were run.
    seconds : float
        CPU seconds of all runs together.
    """

    scene: Scene
    simulation: Simulation
    error: float
    parts: dict[str, dict[str, float]]
    plan: Plan
    tries: list[Choice]
    seconds: float


def solve(
    scene: Scene,
    error: float,
    of: str = "all",
    *,
    seconds: float = math.inf,
    say: Say = lambda _: None,
    progress: Callable[[float, float], None] | None = None,
) -> Answer:
    """Runs a scene so that its estimated relative error is at most `error`; parameters and errors as in `plan`."""
    found, pilots = _plan(scene, error, of, seconds, say)
    choice, tries, spent = found.choice, [found.choice], found.pilot_seconds
    while True:
        setting = choice.setting
        say(f"running {describe(choice)}")
        half = max(1, setting.cells - 1) if pilots.file else setting.cells // 2
        settings = [
            setting,
            replace(setting, cells=half),
            replace(setting, cells=half, count=setting.count // 2),
        ]
        runs = [pilots.companion(one) for one in settings]
        (space, time), size = march(runs, [(0, 1), (1, 2)], progress)
        spent += sum(run.seconds for run in runs)
        parts: dict[str, dict[str, float]] = {}
        for name in found.quantities:
            p, q = pilots.space[setting.mesh].order[name], pilots.time[setting.steps].order[name]
            scale = size[name] or 1.0
            parts[name] = {
                "space": richardson(name, "space", space.values[name], p) / scale,
                "time": richardson(name, "time", time.values[name], q) / scale,
            }
        estimated = max(sum(one.values()) for one in parts.values())
        if estimated <= error or len(tries) == TRIES:
            break
        choice = _finer(pilots, choice, parts, error, seconds)
        if choice.setting == setting:
            break
        tries.append(choice)
    if estimated > error:
        raise SceneError(
            f"an error of {100 * error:.3g} % was not reached: {describe(choice)} has {100 * estimated:.2g} %; ask for that, or "
            "allow more"
        )
    return Answer(choice.scene, runs[0].simulation, estimated, parts, found, tries, spent)


def _finer(pilots: Pilots, choice: Choice, parts: dict[str, dict[str, float]], error: float, seconds: float) -> Choice:
    """The next setting after one whose error turned out to be too large: the models are made to agree with what was found."""
    setting = choice.setting
    models = (
        ("space", pilots.space, setting.mesh, pilots.size(setting.cells)),
        ("time", pilots.time, setting.steps, setting.count),
    )
    for part, models_of, kind, at in models:
        model = models_of[kind]
        constant = dict(model.constant)
        for name, found in parts.items():
            known = found[part] * (pilots.sizes[name] or 1.0)
            constant[name] = max(constant[name], known * float(at) ** model.order[name])
        models_of[kind] = replace(model, constant=constant)
    return pilots.cheapest(setting.mesh, setting.steps, error / SAFETY, seconds, KEPT * _memory())


def describe(choice: Choice) -> str:
    """A setting in words."""
    mesh, time = choice.scene.mesh, choice.scene.time
    grading = "graded to the singular corners" if choice.setting.mesh == "graded" else "uniform"
    cells = f"refine = {mesh.refine}" if mesh.file is not None else f"n = {mesh.n}"
    clock = choice.scene.clock
    steps = f"{clock.steps} steps graded to t = 0" if time.graded_to else f"{clock.steps} equal steps"
    steps = f"steps with a tolerance of {time.tolerance:.2g}" if time.tolerance is not None else steps
    return f"a mesh with {cells}, {grading}, {steps}"


def text(found: Plan) -> str:
    """A plan in lines for a terminal."""
    best = found.choice
    lines = [
        f"choice: {describe(best)}",
        f"  predicted error {100 * best.error:.2g} % of {', '.join(found.quantities)}; {best.seconds:.2g} s of CPU, "
        f"{best.bytes / 1e6:.3g} MB of factors (pilot runs took {found.pilot_seconds:.2g} s)",
        "alternatives:",
    ]
    lines += [
        f"  {describe(one)}: {100 * one.error:.2g} %, {one.seconds:.2g} s"
        + ("" if one.met else f" (too large: {SAFETY:g} times the error must be below the target)")
        for one in found.alternatives
    ]
    return "\n".join(lines)


def keys_of(scene: Scene) -> list[str]:
    """The keys of mesh and time of a chosen scene, as `--set` takes them."""
    mesh, time = scene.mesh, scene.time
    out = [f"mesh.refine={mesh.refine}" if mesh.file is not None else f"mesh.n={mesh.n}"]
    out += [f"mesh.graded_to={['corners'] if mesh.graded_to else []}", f"time.steps={time.steps}"]
    if time.tolerance is not None:
        return [*out, f"time.tolerance={time.tolerance!r}"]
    return [*out, f"time.graded_to={time.graded_to}"]
