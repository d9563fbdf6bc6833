"""Where the error of a run comes from: estimates of its parts, from companions on coarser meshes and longer steps.

Space and time: with D(h) the largest distance of the solutions on h and 2h, and p = log2(D(2h)/D(h)) between the bounds below,
the error on h is D(h)/(2^p - 1) (Richardson). In the energy norm, where errors in space are orthogonal to the coarser space, it
is D(h)/(4^p - 1)^(1/2). Models (a foundation of finite stiffness, regularised friction, a coupling that lags) are compared with
what they stand for on the mesh 2h with steps 2k. Linear algebra and Newton's method: the digits of the run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip.model.discretisation import discretise
from warmslip.scene.errors import SceneError
from warmslip.scene.scene import Scene
from warmslip.scene.validation import contact_keys
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.statistics import digits
from warmslip.studies import rates
from warmslip.studies.companions import QUANTITIES, Companion, Distance, coarser, march, order, slower

ORDERS = {"space": (0.4, 2.0), "time": (0.4, 1.2)}  # what an observed order may be
# backward Euler in L2 for waves that jump: half of p/(p + 1), p = 1 (Brenner & Thomee, Math. Scand. 26, 1970)
JUMPS = 0.25
NUMERICAL = ("space", "time", "round-off")  # parts of the distance to the model's own solution
MODELS = ("coupling", "stiffness", "regularisation")  # parts that the model itself is off, or part of that in time


@dataclass(frozen=True)
class Part:
    """One part of an error: its estimate, in the unit of the quantity, and the order that was observed (nan for none)."""

    error: float
    order: float


@dataclass(frozen=True)
class Estimate:
    """Estimated errors of a run, the largest over time.

    Attributes
    ----------
    parts : dict of str to dict of str to Part
        By quantity, then by part: space, time, round-off; coupling, stiffness, regularisation where the scene has them.
    size : dict of str to float
        The largest value of every quantity.
    work : float
        Seconds of all companions over those of the run, dimensionless.
    """

    parts: dict[str, dict[str, Part]]
    size: dict[str, float]
    work: float

    @property
    def quantities(self) -> list[str]:
        """Those that the scene has, that is, whose size is not 0."""
        return [name for name in QUANTITIES if self.size[name] > 0]

    def total(self, quantity: str) -> float:
        """Estimated distance to the solution of the model: the sum of space, time and round-off."""
        return sum(part.error for name, part in self.parts[quantity].items() if name in NUMERICAL)

    def relative(self, quantity: str) -> float:
        """`total` over the size of the quantity, dimensionless."""
        return self.total(quantity) / self.size[quantity] if self.size[quantity] > 0 else 0.0

    def rows(self) -> list[dict[str, Any]]:
        """A line a quantity and part, for a table."""
        return [
            {
                "quantity": quantity,
                "part": name,
                "error": part.error,
                "relative": part.error / self.size[quantity],
                "order": part.order,
                "size": self.size[quantity],
            }
            for quantity in self.quantities
            for name, part in self.parts[quantity].items()
        ]


def estimate(scene: Scene, progress: Callable[[float, float], None] | None = None) -> tuple[Estimate, Simulation]:
    """Runs a scene with its companions on coarser meshes and with longer steps, and estimates its errors.

    The companions took 2 to 7 times the time of the run in the scenes that were tried; `Estimate.work` is the ratio.

    Parameters
    ----------
    scene : Scene
        A scene whose mesh can be halved twice, and whose steps can be paired twice.
    progress : callable, optional
        Called as ``progress(time, end)``.

    Returns
    -------
    Estimate
        The parts of the errors.
    Simulation
        The run itself, at its end.

    Raises
    ------
    SceneError
        For a mesh or steps that cannot be made coarser.
    RuntimeError
        When a run is rejected.
    """
    levels = [scene, coarser(scene), coarser(scene, 2), slower(scene), slower(scene, 2)]
    runs = [Companion(one) for one in levels]
    pairs = [(0, 1), (1, 2), (0, 3), (3, 4)]
    found, size = march(runs, pairs, progress)
    parts = {name: _numerical(scene, name, found, size[name]) for name in QUANTITIES}
    trusted = digits(runs[0].simulation.statistics.trusted(runs[0].simulation.stepper.extents))
    for name, known in _round_off(trusted).items():
        parts[name]["round-off"] = Part(size[name] * 10.0**-known, float("nan"))
    seconds = sum(run.seconds for run in runs[1:])
    models = _models(coarser(slower(scene)))
    if models:
        base = Companion(next(iter(models.values()))[0])
        mesh = base.simulation.discretisation.mesh  # also where the other model has other singular corners
        others = {
            name: Companion(other, Simulation(other, discretisation=discretise(other, mesh=mesh)))
            for name, (_, other) in models.items()
        }
        several = [base, *others.values()]
        gaps, _ = march(several, [(0, i) for i in range(1, len(several))])
        for name, gap in zip(others, gaps, strict=True):
            # the lag of a coupling is of first order in the step, which is half as long in the run
            factor = 0.5 if name == "coupling" else 1.0
            for quantity in QUANTITIES:
                parts[quantity][name] = Part(factor * gap.values[quantity], float("nan"))
        seconds += sum(run.seconds for run in several)
    return Estimate(parts, size, seconds / max(runs[0].seconds, 1e-9)), runs[0].simulation


def orders(scene: Scene, part: str) -> tuple[float, float]:
    """The smallest and the largest order that is believed, of the error in space or time."""
    least, most = ORDERS[part]
    undamped = scene.moves and scene.inertia is not None and scene.inertia.density > 0 and scene.viscosity is None
    return (JUMPS if part == "time" and undamped else least), most


def richardson(quantity: str, part: str, gap: float, p: float) -> float:
    """The error of a solution from its distance to the one on twice its size, with order p."""
    if part == "space" and quantity in rates.QUADRATIC:
        return float(gap / np.sqrt(4.0**p - 1))
    return float(gap / (2.0**p - 1))


def _numerical(scene: Scene, name: str, found: list[Distance], size: float) -> dict[str, Part]:
    out = {}
    for part, fine, coarse in (("space", 0, 1), ("time", 2, 3)):
        gaps = [found[coarse].values[name], found[fine].values[name]]
        least, most = orders(scene, part)
        default = 1.0
        p = order(gaps, least, most, default)
        seen = gaps[0] > 0 and gaps[1] > 0 and gaps[1] > 1e-12 * size
        out[part] = Part(richardson(name, part, gaps[1], p), p if seen else float("nan"))
    return out


def _round_off(trusted: dict[str, float]) -> dict[str, float]:
    """Digits of every quantity, from those of the fields."""
    least = min(trusted.values(), default=16.0)
    fields = {"u_V": "stress", "theta_L2": "theta", "theta_max": "theta", "theta_mean": "theta"}
    fields |= dict.fromkeys(("normal_force", "tangential_force", "largest_pressure"), "contact_force")
    return {name: trusted.get(fields.get(name, ""), least) for name in QUANTITIES}


def _models(scene: Scene) -> dict[str, tuple[Scene, Scene]]:
    """The scene, and the same with what an approximate part of its model stands for, by part."""
    out: dict[str, dict[str, Any]] = {}
    contacts = contact_keys(scene)
    if scene.moves and scene.heat is not None and scene.time.coupling != "monolithic":
        both = scene.heat.expansion is not None or scene.heat.heating is not None
        if both and not any(contact.heats for contact in scene.contacts):
            out["coupling"] = {"time.coupling": "monolithic"}
    finite = [
        key for key, contact in contacts if contact.stiffness is not None and not contact.rigid and contact.linear
    ]
    if finite and len(finite) == len([1 for _, contact in contacts if contact.stiffness is not None]):
        out["stiffness"] = {f"{key}.stiffness": "rigid" for key in finite}
    regular = [key for key, contact in contacts if contact.friction is not None and contact.friction.regularisation]
    if regular:
        out["regularisation"] = {f"{key}.friction.regularisation": None for key in regular}
    found = {}
    for name, keys in out.items():
        try:
            found[name] = scene, scene.override(**keys)
        except SceneError:  # what it stands for is no scene of its own
            continue
    return found


def text(found: Estimate, quantities: list[str] | None = None) -> str:
    """The estimate in lines for a terminal: a quantity each, its total in percent and its parts."""
    lines = []
    for name in quantities or found.quantities:
        parts = ", ".join(
            f"{part} {100 * value.error / found.size[name]:.2g} %" for part, value in found.parts[name].items()
        )
        lines.append(f"{name:18s} {100 * found.relative(name):.2g} % of {found.size[name]:.4g}: {parts}")
    return "\n".join(lines)
