"""The state of a run that another one begins with, read from its trajectory."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.typing import Array

SAME = 1e-9  # relative difference of times that are one
PIECE = 2**24  # bytes that are hashed at once


@dataclass(frozen=True)
class InitialState:
    """Fields of a run at a time: u, w (nodes, d), theta (nodes,), None where absent; nodes (n, d) and cells (c, d+1)."""

    nodes: Array
    cells: Any
    time: float
    u: Array | None
    w: Array | None
    theta: Array | None


def read(path: str, time: float | None = None) -> InitialState:
    """The state of a trajectory at a time, the last one for None.

    Raises
    ------
    ValueError
        For a file that is no trajectory, and a time that is not stored.
    """
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
    return InitialState(nodes, cells, float(times[i]), **fields)


def digest(path: str) -> str:
    """A hash of the file, "" where there is none."""
    try:
        return _digest(path, os.stat(path).st_mtime_ns)
    except OSError:
        return ""


@lru_cache(maxsize=8)
def _digest(path: str, _: int) -> str:
    found = hashlib.sha256()
    with open(path, "rb") as file:
        while piece := file.read(PIECE):
            found.update(piece)
    return found.hexdigest()[:16]
