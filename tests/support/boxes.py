"""Boxes in the plane and in space whose scenes have only the tables that are given, and runs that must end right."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from warmslip import Scene, _core, discretise
from warmslip.model.meshes import make_mesh
from warmslip.scene.mesh_table import PARTS
from warmslip.scene.reader import build
from warmslip.simulation import summary
from warmslip.simulation.simulation import Simulation

SIDES = {2: PARTS["square"], 3: PARTS["cube"]}
FAR = ("right", "top", "back")  # at the far end of their axis


def elasticity(d: int, young: float, poisson: float) -> dict[str, Any]:
    return {"young": young, "poisson": poisson, "assumption": "plane_strain" if d == 2 else "solid"}


def body(d: int, n: Any, length: float = 1.0) -> dict[str, Any]:
    return {"shape": "square" if d == 2 else "cube", "n": n, "lengths": [length] * d}


def scene(d: int, n: Any, **tables: Any) -> Scene:
    length = tables.pop("length", 1.0)
    return build({"mesh": body(d, n, length), "time": {"steps": 4}} | tables)


def axis_of(d: int, part: str) -> int:
    return {"left": 0, "right": 0, "front": 1, "back": 1}.get(part, d - 1)


def turned(one: Scene, turn: Any) -> tuple[Scene, Any]:
    """The scene and its mesh about the origin; `turn` (d, d) is orthonormal. Its body force is a vector of numbers."""
    mesh = make_mesh(one)
    kind = getattr(_core, f"Mesh{len(turn)}")
    parts = {name: np.array(facets) for name, facets in mesh.parts.items()}
    assert one.loads is not None
    load = (turn @ np.array(one.loads.body)).tolist()
    return one.override(**{"loads.body": load}), kind.from_lists(np.array(mesh.nodes) @ turn.T, mesh.cells, parts)


def along(d: int, last: Any, first: Any = 0.0) -> list[Any]:
    """A vector with the given last and first components."""
    return [first, *[0.0] * (d - 2), last]


def completed(
    one: Scene,
    digits: float = 8.0,
    *,
    mesh: Any = None,
    residual: float = 1e-11,
    each: Callable[[Simulation, Any], None] | None = None,
) -> Simulation:
    """A run that must end right, with so many digits in every field that is more than what rounding makes of the others.

    `each` is called with run and report of every step.
    """
    simulation = Simulation(one, discretisation=None if mesh is None else discretise(one, mesh=mesh))
    for _, report in simulation.steps():
        if each is not None:
            each(simulation, report)
    assert simulation.outcome == "completed", (simulation.outcome, simulation.failure)
    assert max(simulation.statistics.residuals.values()) <= residual, simulation.statistics.residuals
    stated = summary.digits(simulation.statistics.errors)
    assert min(stated.values()) >= digits, stated
    return simulation


def field(simulation: Simulation, name: str) -> Any:
    return simulation.discretisation.field(getattr(simulation.stepper, name))


def fields(simulation: Simulation) -> dict[str, Any]:
    """What the run has of u, w and theta in mesh numbering, and its contact forces (points, d)."""
    found = {name: field(simulation, name) for name in ("u", "w", "theta")}
    if len(simulation.stepper.contact_force):
        found["contact force"] = forces_of(simulation)
    return {name: value for name, value in found.items() if value is not None}


def forces_of(simulation: Simulation) -> Any:
    """Contact forces, (points, d)."""
    return np.reshape(simulation.stepper.contact_force, (-1, simulation.discretisation.dim))


def misses(one: dict[str, Any], other: dict[str, Any]) -> dict[str, float]:
    """Largest difference of each field over its largest value in `other`."""
    return {name: float(np.abs(one[name] - exact).max() / np.abs(exact).max()) for name, exact in other.items()}
