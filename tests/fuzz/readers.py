"""The readers of warmslip as functions of bytes: whether they accept them. What they refuse, they refuse as their docstrings say.

Anything else is a defect: another exception, a crash, a hang, gigabytes. What is accepted is also assembled and stepped once
when it is small, so that whatever the readers let through reaches the compiled core.
"""

from __future__ import annotations

import atexit
import contextlib
import io
import json
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import warmslip
from warmslip import SceneError, _core
from warmslip.mesh import files
from warmslip.scene.expressions import Expression
from warmslip.scene.reader import build
from warmslip.simulation import checkpoint
from warmslip.simulation.checkpoint import Checkpoint
from warmslip.simulation.simulation import Simulation

CORPUS = Path(__file__).parent / "corpus"
FOLDER = Path(tempfile.mkdtemp(prefix="warmslip-fuzz-"))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
shutil.copy(CORPUS / "mesh" / "square.msh", FOLDER)
CELLS = 100  # of what is stepped


def _written(name: str, data: bytes) -> Path:
    files._read.cache_clear()  # it tells files apart by their times, which are coarser than these runs are short
    path = FOLDER / name
    path.write_bytes(data)
    return path


def _refused(error: Exception) -> bool:
    assert str(error), "a refusal without a sentence"
    return False


def _stepped(scene: warmslip.Scene) -> None:
    """One step of a small scene. ValueError is a refusal; the rest that can go wrong in a step is an outcome."""
    table = scene.mesh
    cells = len(files.read(table.file).cells) if table.file else 6 * np.prod(table.counts, dtype=float)
    if cells <= CELLS:
        with contextlib.suppress(ValueError):
            next(Simulation(scene).steps(), None)


def scene(data: bytes) -> bool:
    """A scene file; the mesh `square.msh` lies beside it."""
    try:
        read = warmslip.load(_written("scene.toml", data))
    except SceneError as error:
        return _refused(error)
    read.digest()
    _stepped(read)
    return True


def formula(data: bytes) -> bool:
    try:
        value = Expression(data.decode(errors="replace"))(np.full((2, 2), 0.5), 1.0)
    except ValueError as error:
        return _refused(error)
    return value.shape == (2,)


def mesh(data: bytes) -> bool:
    """A gmsh file, and a body of that mesh that hangs on its first part and touches with the others."""
    path = str(_written("mesh.msh", data))
    try:
        read = files.read(path)
        kind = _core.Mesh2 if read.dim == 2 else _core.Mesh3
        kind.from_lists(read.nodes, read.cells, read.parts)
    except ValueError as error:
        return _refused(error)
    held, touching = list(read.parts)[:1], list(read.parts)[1:]
    tables = {"elasticity": {"lame": [1.0, 1.0]}, "heat": {"conductivity": 1.0}, "supports": {"displacement": held}}
    contact = [{"part": part, "stiffness": 1.0} for part in touching] or None
    _stepped(build({"mesh": {"file": path}, "time": {}, "inertia": {}, "contact": contact, **tables}))
    return True


def lists(data: bytes) -> bool:
    """A mesh from lists: four bytes say its dimension, nodes, cells and facets, one each is a coordinate or a node's number.

    It is also tried as nested in a square or cube, and in itself.
    """
    head, rest = (*data[:4], 0, 0, 0, 0), np.frombuffer(data[4:].ljust(256, b"\0"), np.int8)
    d, n, c, f = 2 + head[0] % 2, head[1] % 20, head[2] % 16, head[3] % 8
    x, cells, facets = np.split(rest[: n * d + c * (d + 1) + f * d], [n * d, n * d + c * (d + 1)])
    nodes = np.where(x == 127, np.inf, np.where(x == -128, 1e-300, x / 4.0)).reshape(n, d)
    kind = _core.Mesh2 if d == 2 else _core.Mesh3
    try:
        built = kind.from_lists(nodes, cells.reshape(c, d + 1), {"part": facets.reshape(f, d)} if f else {})
    except ValueError as error:
        return _refused(error)
    assert built.nodes.shape == (n, d)
    for coarse in (built, kind.box([1] * d, [1.0] * d, _core.Diagonal.right)):
        with contextlib.suppress(ValueError):
            _core.prolongation(coarse, built)
    return True


def _arrays(data: bytes) -> dict[str, Any]:
    """A JSON object of names and values; bytes do not get past the checksums of a zip file, nor far into HDF5."""
    try:
        found = json.loads(data)
        if isinstance(found, dict):
            return {name: value if isinstance(value, str) else np.array(value) for name, value in found.items()}
    except (ValueError, RecursionError):
        pass
    return {}


@cache
def _simulation() -> tuple[Simulation, Checkpoint]:
    """What checkpoints are read into, and its first one; the true owner changes with every source."""
    simulation = Simulation(warmslip.load("paper_mixed").override(**{"mesh.n": 2, "time.steps": 4}))
    return simulation, replace(simulation.take_checkpoint(), owner={"scene": "small"})


def checkpoints(data: bytes) -> bool:
    """The file itself, or a JSON object of its arrays."""
    if arrays := _arrays(data):
        file = io.BytesIO()
        with contextlib.suppress(ValueError):  # names and types that NumPy does not store
            np.savez(file, **arrays)
        data = file.getvalue()
    (simulation, start), path = _simulation(), _written(checkpoint.NAMES[0], data)
    try:
        found = checkpoint.read(path.parent, start, start.owner["scene"])
    except ValueError as error:
        return _refused(error)
    if found is None:
        return False
    simulation.restore(found)
    simulation.stepper.advance(*simulation.discretisation.load_vectors.at(1.0))
    return True


def trajectory(data: bytes) -> bool:
    """The file itself, or a JSON object of its datasets, `scene` being its attribute."""
    path = _written("trajectory.h5", data)
    if arrays := _arrays(data):
        with h5py.File(path, "w") as file:
            for name, value in arrays.items():
                with contextlib.suppress(ValueError, TypeError, OSError):  # which HDF5 does not store
                    (file.attrs if name == "scene" else file)[name] = value
    try:
        with warmslip.Trajectory(path) as t:
            for group in ("steps", "balances", "contact"):
                t.series(group)
            for states in (t.u, t.w, t.theta):
                assert states is None or states[:].shape[1] == len(t.nodes)
            assert len(t.time) >= 0 and t.cells.max() < len(t.nodes)
            assert all(len(values) == len(t.series("steps")["time"]) for values in t.heat_flows.values())
            assert all(force["force"].ndim == 2 for force in t.reactions.values())
            _stepped(t.discretisation().scene)
    except (ValueError, OSError) as error:
        return _refused(error)
    return True


READERS: dict[str, Callable[[bytes], bool]] = {
    "scene": scene,
    "formula": formula,
    "mesh": mesh,
    "lists": lists,
    "checkpoint": checkpoints,
    "trajectory": trajectory,
}
