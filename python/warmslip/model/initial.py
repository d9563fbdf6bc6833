"""The fields that a run begins with: those of its scene, or a stored state of another run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.model.load_vectors import LoadVectors
from warmslip.model.loads import data, evaluate
from warmslip.model.point_location import interpolated
from warmslip.scene.scene import Scene
from warmslip.typing import Array

SAME = 1e-9  # relative difference of times that are one
FITS = 1e-6  # relative to the displacement: how far supports may be from the state that a run begins with
BETWEEN = 0.05  # likewise where the state is interpolated between two meshes
NEAR = 0.2  # of a cell: how far nodes may lie outside of the mesh of the run that they begin with, at a curved boundary
SIZE = 0.02  # by how much sizes of two meshes of one body may differ


def initial_fields(scene: Scene, mesh: Any, vectors: LoadVectors) -> tuple[Array, Array, Array]:
    """Displacement and velocity (nodes, d) and temperature (nodes,) at the start of a scene on its mesh.

    They are not yet made what is given on the supports, see `Discretisation.restart`.

    Raises
    ------
    ValueError
        For formulas without finite values, a run that cannot be read or does not fit, and supports that begin elsewhere than
        its state has them.
    """
    initial, x, d = scene.initial, np.asarray(mesh.nodes), scene.mesh.dim
    if initial.run is not None:
        found = _read(initial.run, initial.time)
        _refuse_another_body(found, x, initial.run)
        same = np.array_equal(found.nodes, x) and np.array_equal(found.cells, mesh.cells)
        u, w, theta = _on_mesh(found, x, same)
        _refuse_jump(vectors, initial.run, u, FITS if same else BETWEEN)
        return u, w, theta

    def start(name: str, components: int) -> Array:
        value = getattr(initial, name)
        return evaluate(data(value) if value is not None else 0.0, x, 0.0, components, f"initial.{name}")

    return start("displacement", d), start("velocity", d), start("temperature", 1)[:, 0]


def missing_fields(scene: Scene) -> list[str]:
    """What a scene needs of the state it begins with and the run does not have; nothing where that run is gone."""
    import h5py

    if scene.initial.run is None or not Path(scene.initial.run).is_file():
        return []
    with h5py.File(scene.initial.run, "r", locking=False) as file:
        there = list(file["states"])
    needed = {"displacement": ("u", scene.moves), "temperature": ("theta", scene.heat is not None)}
    return [words for words, (name, wanted) in needed.items() if wanted and name not in there]


def refuse_unusable(scene: Scene, mesh: Any) -> None:
    """Raises ValueError where the run that a scene begins with cannot be read, or is of another body."""
    if scene.initial.run is not None:
        _refuse_another_body(_read(scene.initial.run, scene.initial.time), np.asarray(mesh.nodes), scene.initial.run)


def _on_mesh(found: _Stored, x: Array, same: bool) -> tuple[Array, Array, Array]:
    """The fields of a stored state at the nodes x, of the same mesh or another; zero where the other run has none."""

    def here(values: Array | None, zero: Array) -> Array:
        if values is None or same:
            return zero if values is None else values
        return interpolated(values, found.nodes, found.cells, x, NEAR)

    return here(found.u, np.zeros_like(x)), here(found.w, np.zeros_like(x)), here(found.theta, np.zeros(len(x)))


def _refuse_another_body(found: _Stored, x: Array, run: str) -> None:
    """Raises ValueError for a body of other dimensions, another size or at another place."""
    if found.nodes.shape[1] != x.shape[1]:
        raise ValueError(f"initial.from: '{run}' has {found.nodes.shape[1]} dimensions; give one of {x.shape[1]}")
    ends = [np.array([nodes.min(axis=0), nodes.max(axis=0)]) for nodes in (found.nodes, x)]
    if np.abs(ends[0] - ends[1]).max() > SIZE * (ends[0][1] - ends[0][0]).max():
        boxes = [" x ".join(f"[{low:.4g}, {high:.4g}]" for low, high in end.T) for end in ends]
        raise ValueError(
            f"initial.from: the body of '{run}' lies in {boxes[0]}, that of the scene in {boxes[1]}; give a run of the same body"
        )


def _refuse_jump(vectors: LoadVectors, run: str, u: Array, fits: float) -> None:
    """Raises ValueError for a displacement that the supports would change at once."""
    supports = vectors.supports
    if not len(supports.nodes):
        return
    off = np.abs(u[supports.nodes] - supports.released(u[supports.nodes]) - vectors.displacement(0.0))
    if off.max() > fits * max(np.abs(u).max(), 1e-300):
        raise ValueError(
            f"initial.from: at t = 0 the supports are up to {off.max():.3g} away from where the state in '{run}' has them; "
            "let them begin there, as in top = ['0.1 - 0.1 * t', 0.0]"
        )


@dataclass(frozen=True)
class _Stored:
    """Fields of a run at a time: u, w (nodes, d), theta (nodes,), None where absent; nodes (n, d) and cells (c, d+1)."""

    nodes: Array
    cells: Any
    time: float
    u: Array | None
    w: Array | None
    theta: Array | None


def _read(path: str, time: float | None) -> _Stored:
    """The state of a trajectory at a time, the last one for None. Raises ValueError for no trajectory, and a time not stored."""
    import h5py  # a tenth of a second, for few scenes

    if not Path(path).is_file():
        raise ValueError(f"initial.from: '{path}' is no file; give the trajectory.h5 of a run")
    try:
        with h5py.File(path, "r", locking=False) as file:
            states = file["states"]
            times = np.asarray(states["time"], dtype=float)
            i = len(times) - 1 if time is None else int(np.abs(times - time).argmin())
            fields = {name: np.asarray(states[name][i]) if name in states else None for name in ("u", "w", "theta")}
            nodes, cells = np.asarray(file["mesh/nodes"]), np.asarray(file["mesh/cells"])
    except (OSError, KeyError, ValueError, IndexError, RuntimeError) as error:
        raise ValueError(f"initial.from: '{path}' is no trajectory that can be read ({error})") from None
    if time is not None and abs(times[i] - time) > SAME * max(abs(time), abs(times[-1])):
        raise ValueError(
            f"initial.time: '{path}' holds no state at t = {time:g}; the nearest is at {times[i]:.6g} (output.every stores more)"
        )
    return _Stored(nodes, cells, float(times[i]), **fields)
