"""What the closed forms share: a scene with all physics off, distorted meshes, and steps that must be right. All plane."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warmslip._core import Mesh2
from warmslip.model.discretisation import discretise
from warmslip.model.loads import Loads
from warmslip.model.materials import mandel
from warmslip.scene.full import FullScene, build_full
from warmslip.scene.material_tables import IsotropicTable
from warmslip.simulation.simulation import Simulation
from warmslip.typing import Array

ROUND_OFF = 1e-11
NORMALS = {"left": np.array([-1.0, 0.0]), "right": np.array([1.0, 0.0]), "top": np.array([0.0, 1.0])}

_ZERO = [[0.0, 0.0], [0.0, 0.0]]


@dataclass(frozen=True)
class Triangulation:
    """Nodes (n, 2), cells (c, 3) counterclockwise, and the edges (f, 2) of every boundary part."""

    nodes: NDArray[np.float64]
    cells: NDArray[np.int32]
    parts: Mapping[str, NDArray[np.int32]]

    @classmethod
    def of(cls, mesh: Any) -> Triangulation:
        return cls(np.asarray(mesh.nodes), np.asarray(mesh.cells), {k: np.asarray(v) for k, v in mesh.parts.items()})

    def mesh(self) -> Any:
        """As a `_core.Mesh2`."""
        return Mesh2.from_lists(self.nodes, self.cells, dict(self.parts))


def blank(**keys: Any) -> FullScene:
    """A floating plane body without any physics but what `keys` add, `__` for the dots: blank(inertia__density=1.0)."""
    data: dict[str, Any] = {
        "mesh": {"shape": "square"},
        "time": {},
        "inertia": {"density": 0.0},
        "elasticity": {"lame": [0.0, 0.0]},
        "viscosity": {"lame": [0.0, 0.0]},
        "heat": {"conductivity": _ZERO, "expansion": {"tensor": _ZERO}, "heating": {"tensor": _ZERO}},
        "loads": {"body": [0.0, 0.0]},
        "supports": {"displacement": [], "temperature": []},
        "contact": {"part": "bottom", "stiffness": 0.0},
    }
    for key, value in keys.items():
        *tables, last = key.split("__")
        place = data
        for table in tables:
            place = place.setdefault(table, {})
        place[last] = value
    return build_full(data)


def distorted(counts: tuple[int, int], lengths: tuple[float, float], *, seed: int = 1) -> Triangulation:
    """A rectangle of crossed cells whose nodes are moved by up to a quarter of a grid cell, along the sides on the boundary."""
    x, y = (np.linspace(0.0, length, n + 1) for n, length in zip(counts, lengths, strict=True))
    return jiggled(crossed(x, y), 0.2 * np.array([x[1], y[1]]), seed)


def jiggled(mesh: Triangulation, amount: Array, seed: int) -> Triangulation:
    """`mesh`, a rectangle, with nodes moved by up to `amount` (2); boundary nodes stay on their side, corners stay."""
    nodes = mesh.nodes
    shift = amount * np.random.default_rng(seed).uniform(-1, 1, nodes.shape)
    shift[(nodes == nodes.min(axis=0)) | (nodes == nodes.max(axis=0))] = 0
    return Triangulation(nodes + shift, mesh.cells, mesh.parts)


def crossed(x: Array, y: Array) -> Triangulation:
    """The rectangle with grid lines `x` and `y`, every grid cell cut by both diagonals: mirror images have mirrored meshes."""
    columns, rows = len(x), len(y)
    corner = np.arange(columns * rows, dtype=np.int32).reshape(rows, columns)
    grid = np.stack(np.meshgrid(x, y), axis=-1)
    middle = (grid[:-1, :-1] + grid[1:, 1:]) / 2
    centre = (columns * rows + np.arange((columns - 1) * (rows - 1), dtype=np.int32)).reshape(rows - 1, columns - 1)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    cells = [np.stack([p, q, centre], axis=-1).reshape(-1, 3) for p, q in ((a, b), (b, c), (c, d), (d, a))]
    sides = {"left": corner[:, 0], "right": corner[:, -1], "bottom": corner[0], "top": corner[-1]}
    parts = {name: np.stack([line[:-1], line[1:]], axis=1) for name, line in sides.items()}
    return Triangulation(np.vstack([grid.reshape(-1, 2), middle.reshape(-1, 2)]), np.vstack(cells), parts)


def run(scene: FullScene, loads: Loads | None = None, mesh: Triangulation | None = None) -> Simulation:
    """A scene ready to be stepped by `steps`, with its own loads and mesh where none are given."""
    return Simulation(scene, discretisation=discretise(scene, loads=loads, mesh=None if mesh is None else mesh.mesh()))


def steps(simulation: Simulation) -> Iterator[Any]:
    """A report a step. Raises RuntimeError when a step is rejected: a closed form has nothing to say about it."""
    yield from (report for _, report in simulation.steps())
    if simulation.outcome != "completed":
        raise RuntimeError(f"the run ended: {simulation.outcome}, {simulation.failure}")


def nodes(simulation: Simulation) -> Array:
    """Positions of the nodes, (nodes, 2)."""
    return np.asarray(simulation.discretisation.mesh.nodes)


def fields(simulation: Simulation) -> tuple[Array, Array, Array]:
    """u, w (nodes, 2) and theta (nodes,) of the present state."""
    d, s = simulation.discretisation, simulation.stepper
    return d.field(s.u), d.field(s.w), d.field(s.theta)


def start(
    simulation: Simulation, *, u: Array | float = 0.0, w: Array | float = 0.0, theta: Array | float = 0.0
) -> None:
    """Sets the initial state; values broadcast to (nodes, 2), (nodes, 2) and (nodes,)."""
    n = len(nodes(simulation))
    displacement, velocity = (np.array(np.broadcast_to(v, (n, 2)), dtype=float) for v in (u, w))
    temperature = np.array(np.broadcast_to(theta, (n,)), dtype=float)
    simulation.discretisation.restart(simulation.stepper, displacement, velocity, temperature, 0.0)


def mean(simulation: Simulation, field: Array) -> Array:
    """Mean over the body of a P1 field (nodes, ...), exactly."""
    cells = np.asarray(simulation.discretisation.mesh.cells)
    x = nodes(simulation)[cells]
    area = np.abs(np.linalg.det(x[:, 1:] - x[:, :1]))
    return np.asarray(np.tensordot(area, field[cells].mean(axis=1), axes=1) / area.sum())


def on(simulation: Simulation, part: str) -> Any:
    """Numbers of the nodes on a boundary part."""
    return np.unique(simulation.discretisation.mesh.parts[part])


def worst(a: Array, b: Array | float, scale: float | None = None) -> float:
    """Largest difference, relative to the largest |b| unless `scale` is given."""
    return float(np.abs(a - b).max() / (np.abs(b).max() if scale is None else scale))


def isotropic(table: IsotropicTable, strain: Array) -> Array:
    """The isotropic tensor applied to a plane strain, both symmetric (2, 2)."""
    root = np.sqrt(2.0)
    s = mandel(table, 2) @ np.array([strain[0, 0], strain[1, 1], root * strain[0, 1]])
    return np.array([[s[0], s[2] / root], [s[2] / root, s[1]]])


def pulls(stress: Callable[[float], Array]) -> dict[str, Callable[[Array, float], Array]]:
    """Tractions sigma nu (points, 2) on left, right and top of a stress that depends on time alone."""

    def on_side(normal: Array) -> Callable[[Array, float], Array]:
        return lambda x, t: np.broadcast_to(stress(t) @ normal, x.shape)

    return {part: on_side(normal) for part, normal in NORMALS.items()}
