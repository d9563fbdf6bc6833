"""What must not change the answer: other units, a mirror, other numbers for nodes and cells, a restart, a rigid velocity.

Each function runs a scene twice and returns how far the answers are apart, relative to the largest entry of each field
(dimensionless). They apply to any scene; `lines` runs them all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip._core import Mesh2, Mesh3, Outcome
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.model.meshes import make_mesh
from warmslip.records.check import Check, below
from warmslip.scene.full import FullScene
from warmslip.simulation.simulation import Simulation
from warmslip.typing import Array

# two orders above what is observed, four below the smallest fault worth finding
ROUND_OFF = 1e-11


@dataclass(frozen=True)
class Units:
    """Factors of two by which numbers grow when the units shrink; the unit of mass follows from stress, time and length."""

    length: float = 1.0
    time: float = 1.0
    stress: float = 1.0
    temperature: float = 1.0


UNITS = {
    "length": Units(length=4),
    "time": Units(time=4),
    "stress": Units(stress=4),
    "temperature": Units(temperature=4),
    "all units": Units(2.0**-10, 2.0**8, 2.0**30, 2.0**9),
    "all units back": Units(2.0**12, 2.0**-9, 2.0**-20, 2.0**-7),
}


def finish(scene: FullScene, mesh: Any = None, discretisation: Discretisation | None = None) -> dict[str, Array]:
    """The final u (nodes, d), w (nodes, d), theta (nodes,). Raises RuntimeError when the run is not completed."""
    simulation = Simulation(scene, discretisation=discretisation or discretise(scene, mesh=mesh))
    for _ in simulation.steps():
        pass
    return state(simulation)


def state(simulation: Simulation) -> dict[str, Array]:
    if simulation.outcome != "completed":
        raise RuntimeError(f"'{simulation.scene.title}' ended: {simulation.outcome}")
    return {name: simulation.discretisation.field(getattr(simulation.stepper, name)) for name in ("u", "w", "theta")}


def apart(one: dict[str, Array], other: dict[str, Array]) -> float:
    """The largest difference of any field, relative to the largest entry of that field."""
    sizes = {name: max(np.abs(one[name]).max(), np.abs(other[name]).max()) for name in one}
    return max(float(np.abs(one[name] - other[name]).max() / size) for name, size in sizes.items() if size > 0)


def in_units(scene: FullScene, units: Units) -> FullScene:
    """The same problem in other units; displacements scale like lengths."""
    length, time, stress, temperature = units.length, units.time, units.stress, units.temperature

    def times(values: Any, factor: float) -> Any:
        return None if values is None else (np.array(values) * factor).tolist()

    d, exchange, start = scene.mesh.dim, scene.contact.heat_exchange, scene.initial
    values = {
        "mesh.lengths": times(scene.mesh.sides, length),
        "time.end": scene.time.end * time,
        "inertia.density": scene.inertia.density * stress * time**2 / length**2,
        "elasticity": {"lame": times(scene.elasticity.pair(d), stress)},
        "viscosity": {"lame": times(scene.viscosity.pair(d), stress * time)},
        "heat.conductivity": times(scene.heat.conductivity, length**2 / time),
        "heat.source": scene.heat.source * temperature / time,
        "heat.expansion.tensor": times(scene.heat.expansion.tensor, stress / temperature),
        "heat.heating.tensor": times(scene.heat.heating.tensor, temperature),
        "loads.body": times(scene.loads.body, stress / length),
        "loads.traction": {part: times(value, stress) for part, value in scene.loads.traction.items()},
        "contact.stiffness": scene.contact.stiffness * stress / length,
        "contact.gap": scene.contact.gap * length,
        "contact.heat_exchange.conductance": exchange.conductance * length / time,
        "contact.heat_exchange.foundation_temperature": exchange.foundation_temperature * temperature,
        "initial.temperature": start.temperature * temperature,
    }
    for name, factor in (("displacement", length), ("velocity", length / time)):
        if getattr(start, name) is not None:
            values[f"initial.{name}"] = times(getattr(start, name), factor)
    return scene.override(**values)


def units_apart(scene: FullScene, units: Units) -> float:
    """Solved in other units and scaled back: powers of two change exponents alone, so a hidden absolute number shows."""
    plain = scene.override(
        elasticity={"lame": list(scene.elasticity.pair(scene.mesh.dim))},
        viscosity={"lame": list(scene.viscosity.pair(scene.mesh.dim))},
    )
    other = finish(in_units(scene, units))
    factors = {"u": units.length, "w": units.length / units.time, "theta": units.temperature}
    return apart(finish(plain), {name: values / factors[name] for name, values in other.items()})


def mirror_apart(scene: FullScene) -> float:
    """The body seen in a mirror across its first axis; the parts keep their names and their loads are mirrored."""
    d = scene.mesh.dim
    flip = np.diag([-1.0] + [1.0] * (d - 1))

    def vector(value: Any) -> Any:
        return None if value is None else (flip @ np.array(value)).tolist()

    def tensor(value: Any) -> Any:
        return (flip @ np.array(value) @ flip).tolist()

    values: dict[str, Any] = {
        "loads.body": vector(scene.loads.body),
        "loads.traction": {part: vector(value) for part, value in scene.loads.traction.items()},
        "heat.conductivity": tensor(scene.heat.conductivity),
        "heat.expansion.tensor": tensor(scene.heat.expansion.tensor),
        "heat.heating.tensor": tensor(scene.heat.heating.tensor),
    }
    for name in ("displacement", "velocity"):
        if getattr(scene.initial, name) is not None:
            values[f"initial.{name}"] = vector(getattr(scene.initial, name))
    mesh = make_mesh(scene)
    cells = np.asarray(mesh.cells).copy()
    cells[:, [0, 1]] = cells[:, [1, 0]]  # a mirror turns cells inside out
    image = _lists(d, np.asarray(mesh.nodes) @ flip, cells, {k: np.asarray(v) for k, v in mesh.parts.items()})
    seen = finish(scene.override(**values), image)
    return apart(finish(scene), {"u": seen["u"] @ flip, "w": seen["w"] @ flip, "theta": seen["theta"]})


def renumbering_apart(scene: FullScene, seed: int = 1) -> float:
    """Nodes and cells in a random order."""
    mesh, random = make_mesh(scene), np.random.default_rng(seed)
    nodes, cells = np.asarray(mesh.nodes), np.asarray(mesh.cells)
    new = random.permutation(len(nodes))  # node i becomes new[i]
    shuffled = np.empty_like(nodes)
    shuffled[new] = nodes
    parts = {name: new[np.asarray(facets)] for name, facets in mesh.parts.items()}
    other = finish(scene, _lists(scene.mesh.dim, shuffled, new[cells][random.permutation(len(cells))], parts))
    return apart(finish(scene), {name: values[new] for name, values in other.items()})


def restart_apart(scene: FullScene) -> float:
    """Stopped half way, and started again from u, w, theta alone. The contact solver starts from nothing, too."""
    d = discretise(scene)
    through = finish(scene, discretisation=d)
    half, k = max(1, scene.time.steps // 2), scene.step
    first, second = d.stepper(), d.stepper()
    for n in range(1, scene.time.steps + 1):
        if n == half + 1:
            u, w, theta = (d.field(getattr(first, name)) for name in ("u", "w", "theta"))
            d.restart(second, u, w, theta, half * k)
        stepper = first if n <= half else second
        report = stepper.advance(*d.load_vectors.at(n * k))
        if report.outcome != Outcome.completed:
            raise RuntimeError(f"'{scene.title}' ended at step {n}: {report.outcome.name}")
    last = second if half < scene.time.steps else first
    return apart(through, {name: d.field(getattr(last, name)) for name in ("u", "w", "theta")})


def rigid_velocity_apart(scene: FullScene, speed: float = 0.5) -> float:
    """Released from its supports and without friction, the body moves along the first axis as well: u gains speed t.

    For a contact part that is flat and parallel to the first axis, and a positive density. The velocity is in units of
    length / end time of the scene.
    """
    unit = scene.mesh.sides[0] / scene.time.end
    free = scene.override(**{"supports.displacement": [], "contact.friction.coefficient": 0.0})
    start = np.array(free.initial.velocity or [0.0] * free.mesh.dim)
    rigid = np.array([speed * unit] + [0.0] * (free.mesh.dim - 1))
    moving = finish(free.override(**{"initial.velocity": (start + rigid).tolist()}))
    moving = moving | {"u": moving["u"] - rigid * free.time.end, "w": moving["w"] - rigid}
    return apart(finish(free), moving)


def _lists(d: int, nodes: Array, cells: Any, parts: dict[str, Any]) -> Any:
    make = Mesh2 if d == 2 else Mesh3
    return make.from_lists(nodes, cells.astype(np.int32), {k: np.asarray(v, dtype=np.int32) for k, v in parts.items()})


def lines(name: str, scene: FullScene) -> list[Check]:
    """Every invariance of one scene, and the largest residual of each of its balances."""
    simulation = Simulation(scene)
    for _ in simulation.steps():
        pass
    state(simulation)
    out = [
        below(
            name,
            f"the {balance} balance closes at every step",
            "identity",
            worst,
            ROUND_OFF,
        )
        for balance, worst in simulation.statistics.residuals.items()
    ]
    checks: dict[str, Callable[[], float]] = {
        **{f"unchanged in other units of {key}": lambda u=u: units_apart(scene, u) for key, u in UNITS.items()},  # type: ignore[misc]
        "unchanged in a mirror": lambda: mirror_apart(scene),
        "unchanged when nodes and cells are renumbered": lambda: renumbering_apart(scene),
        "unchanged by a restart half way": lambda: restart_apart(scene),
    }
    if scene.inertia.density > 0:
        checks["a rigid velocity is carried along"] = lambda: rigid_velocity_apart(scene)
    bounds = {key: 1e-13 if "units" in key else ROUND_OFF for key in checks}
    return out + [below(name, key, "identity", check(), bounds[key]) for key, check in checks.items()]
