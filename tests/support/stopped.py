"""Runs of one scene that are stopped on the way, and whether two folders hold the same run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from warmslip import Scene, Trajectory, load

KEYS = ["mesh.n=8", "time.steps=24", "output.every=7", "output.checkpoint=5"]


def scene(*more: str) -> Scene:
    return load("paper_mixed", [*KEYS, "contact.heat_exchange.foundation_temperature=10.0", *more])


def contents(path: Path) -> dict[str, np.ndarray]:
    found = {}
    with h5py.File(path, "r") as file:
        file.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    return found


def same(one: Path, other: Path) -> None:
    first, second = contents(one / "trajectory.h5"), contents(other / "trajectory.h5")
    assert first.keys() == second.keys()
    for name, values in first.items():
        assert np.array_equal(values, second[name]), name


class KilledError(Exception):
    pass


def stop_after(steps: int) -> Callable[[int, int, object], None]:
    def progress(step: int, _: int, __: object) -> None:
        if step == steps:
            raise KilledError

    return progress


def readable(path: Path) -> None:
    """What a killed run left is whole to its last second: as many steps in every series, and states of those."""
    with Trajectory(path) as t:
        lengths = {len(values) for group in ("steps", "balances") for values in t.series(group).values()}
        lengths |= {len(t.series("contact")[name]) for name in ("force", "displacement", "status", "gap")}
        assert len(lengths) == 1
        assert len(t.time) == len(t.u) == len(t.w) == len(t.theta) >= 1
        (steps,) = lengths
        step = t.scene["time"]["end"] / t.scene["time"]["steps"]
        assert round(float(t.time[-1]) / step) <= steps and np.isfinite(t.u[-1]).all()
