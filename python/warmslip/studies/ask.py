"""An error asked for: a few cheap runs tell how errors and cost depend on mesh and steps, and the cheapest setting is run.

The run that is chosen has companions on half its mesh and steps; if their distance says that the error is larger than was asked
for, a finer setting is run.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from warmslip.messages import quoted
from warmslip.scene.errors import SceneError
from warmslip.scene.scene import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.studies.companions import QUANTITIES, Distance, march
from warmslip.studies.error_estimate import orders, richardson
from warmslip.studies.error_norms import TERMS
from warmslip.studies.pilots import MESHES, STEPS, Choice, Pilots, Say, Setting, describe

SAFETY = 1.15  # what is aimed at lies so far below what is asked for
ROUND_OFF = 1e-10  # relative errors below it are not promised
TRIES = 3  # settings that are run at most
KEPT = 0.5  # share of the memory of the machine that a run may take


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


def _memory() -> float:
    """Bytes of the machine's memory."""
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
    first = 2 if pilots.file else 2 * pilots.first
    for mesh in MESHES:
        try:
            pilots.measure_space(mesh, first + (1 if pilots.file and mesh == "graded" else 0))
        except (SceneError, ValueError):  # no singular corner, or a mesh that cannot be graded
            if mesh == "uniform" or pilots.seconds > seconds:
                raise
            say("no graded mesh: the solution is singular at no corner, or the mesh cannot be halved often enough")
    for steps in STEPS:
        pilots.measure_time(steps, 4 * pilots.count)
    aim, room = error / SAFETY, KEPT * _memory()
    while True:
        found = [pilots.cheapest(mesh, steps, aim, seconds, room) for mesh, steps in pilots.kinds()]
        best = min((one for one in found if one.met), key=lambda one: one.seconds, default=None)
        leading = best or min(found, key=lambda one: one.error)
        if not pilots.look_closer([leading, *(one for one in found if one is not leading)]):
            break
    if best is None:
        nearest = min(found, key=lambda one: one.error)
        least = math.ceil(1000 * SAFETY * nearest.error * 1.05) / 1000
        limit = f" in {seconds:g} s" if math.isfinite(seconds) else ""
        raise SceneError(
            f"an error of {100 * error:.3g} % cannot be had{limit}; the best is {100 * least:.3g} %, in about "
            f"{nearest.seconds:.2g} s: ask for that, or allow more"
        )
    seen = {f"{mesh} mesh": pilots.space[mesh].order for mesh in pilots.space}
    seen |= {f"{steps} steps": pilots.time[steps].order for steps in pilots.time}
    seen = {kind: {name: values[name] for name in quantities} for kind, values in seen.items()}
    others = sorted((one for one in found if one is not best), key=lambda one: (not one.met, one.seconds))
    return Plan(best, others, quantities, pilots.seconds, seen), pilots


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
    errors : dict
        What they come to together, by quantity.
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
    errors: dict[str, float]
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
        halved = bool(pilots.file) or pilots.gradable(setting.mesh, half)
        coarse = replace(setting, cells=half) if halved else setting
        slower = replace(coarse, count=setting.count // 2)
        runs = [pilots.companion(one) for one in ([setting, coarse, slower] if halved else [setting, slower])]
        (*space, time), size = march(runs, [(0, 1), (0, 2), (1, 2)] if halved else [(0, 1)], progress)
        spent += sum(run.seconds for run in runs)
        parts = {name: _parts(pilots, setting, name, [*space[:1], time], size[name]) for name in found.quantities}
        for name in found.quantities if halved else []:
            pilots.learn_power(name, *(one.values[name] for one in (space[0], time, space[1])))
        errors = {name: pilots.total(name, one["space"], one["time"]) for name, one in parts.items()}
        estimated = max(errors.values())
        if estimated <= error or len(tries) == TRIES:
            break
        choice = _next(pilots, choice, parts, error, seconds)
        if choice.setting == setting:
            break
        tries.append(choice)
    if estimated > error:
        raise SceneError(
            f"an error of {100 * error:.3g} % was not reached: {describe(choice)} has {100 * estimated:.2g} %; ask for that, or "
            "allow more"
        )
    return Answer(choice.scene, runs[0].simulation, estimated, parts, errors, found, tries, spent)


def _parts(pilots: Pilots, setting: Setting, name: str, found: list[Distance], size: float) -> dict[str, float]:
    """Relative errors of a quantity from the distances to half the mesh, if there is one, and to half the steps.

    The part of space is that of the pilots where half the mesh cannot be graded: they had such a mesh and a finer one.
    """
    one, other = pilots.space[setting.mesh], pilots.time[setting.steps]
    size_here, count = pilots.size(setting.cells), float(setting.count)
    errors = {"space": one.at(name, size_here), "time": 0.0}
    known = [("time", found[-1], other, count), ("space", found[0], one, size_here)][: len(found)]
    for part, gap, model, at in known:
        order = model.order_to(name, at, gap.values[name], orders(pilots.scene, part))
        errors[part] = richardson(name, part, gap.values[name], order)
    return {part: error / (size or 1.0) for part, error in errors.items()}


def _next(pilots: Pilots, choice: Choice, parts: dict[str, dict[str, float]], error: float, seconds: float) -> Choice:
    """What is run after a setting whose error turned out to be too large: its models are made to agree with what was found.

    Of every kind of mesh and steps; the most accurate one where none is predicted to err little enough.
    """
    setting = choice.setting
    models = (
        ("space", pilots.space, setting.mesh, pilots.size(setting.cells)),
        ("time", pilots.time, setting.steps, setting.count),
    )
    for part, models_of, kind, at in models:
        model = models_of[kind]
        constant = dict(model.constant)
        for name, found in parts.items():
            constant[name] = found[part] * (pilots.sizes[name] or 1.0) * float(at) ** model.order[name]
        models_of[kind] = replace(model, constant=constant)
    aim, room = error / SAFETY, KEPT * _memory()
    choices = [pilots.cheapest(mesh, steps, aim, seconds, room) for mesh, steps in pilots.kinds()]
    return min(choices, key=lambda one: (not one.met, one.seconds if one.met else one.error))


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
