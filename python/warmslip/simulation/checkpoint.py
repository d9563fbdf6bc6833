"""A checkpoint: the state of a run after a step, from which the next steps come out the same to the last bit.

Two files are kept, the newest and the one before. Each is written beside them and then renamed, so that a process that is
killed leaves at least one whole.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.simulation import monitor, pace
from warmslip.simulation.statistics import Statistics
from warmslip.typing import Array

NAMES = ("checkpoint.npz", "checkpoint.previous.npz")  # newest first
END = "checkpoint.end.npz"  # of a run that was completed, which may go on to a later end
STATUSES = (0, 1, 2)  # open, stick, slip


@dataclass(frozen=True)
class Checkpoint:
    """All that the steps after `step` depend on, and all that the summary of the whole run needs of the steps before.

    `owner` is what must be the same for the same next step: scene, code, linear algebra, ranks, names of Python functions.
    `arrays` holds the fields in mesh numbering, (nodes, d) or (nodes,), forces (d points,) and statuses (points,) of the contact.
    """

    owner: dict[str, Any]
    step: int
    time: float
    pace: dict[str, Any]
    statistics: Statistics
    seen: dict[str, Any]
    extents: list[float]
    arrays: dict[str, Array]

    def write(self, folder: Path, end: bool = False) -> None:
        """Writes the newest checkpoint of a folder; the newest so far becomes the previous one. Raises OSError.

        `end` is for the last state of a run, which has a file of its own.
        """
        record = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "arrays"}  # not copied
        record |= {"time": self.time.hex(), "statistics": asdict(self.statistics)}
        newest, previous = (folder / name for name in NAMES)
        written = folder / "checkpoint.part.npz"
        try:
            np.savez(written, record=np.array(json.dumps(record)), **self.arrays)
        except OSError:
            written.unlink(missing_ok=True)  # the disk may be full
            raise
        if end:
            os.replace(written, folder / END)
            return
        if newest.exists():
            os.replace(newest, previous)
        os.replace(written, newest)

    def resembles(self, other: Checkpoint) -> bool:
        """Whether it has the arrays and entries of the `other`, which is sound, all of them finite."""
        if self.arrays.keys() != other.arrays.keys():
            return False
        for name, like in other.arrays.items():
            one = self.arrays[name]
            if one.shape != like.shape or one.dtype.kind != like.dtype.kind or not np.isfinite(one).all():
                return False
        return (
            bool(np.isin(self.arrays["status"], STATUSES).all())
            and math.isfinite(self.time)
            and type(self.step) is int
            and self.statistics.sound
            and pace.fits(self.pace, other.pace)
            and monitor.fits(self.seen, other.seen)
            and len(self.extents) == len(other.extents)
            and all(type(value) is float and 0 <= value < math.inf for value in self.extents)
        )


def _whole(path: Path) -> Checkpoint | None:
    """What a file holds, None for a torn one."""
    try:
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            arrays = {name: np.array(file[name]) for name in file.files}
        record = json.loads(str(arrays.pop("record")))
        record |= {"time": float.fromhex(record["time"]), "statistics": Statistics(**record["statistics"])}
        return Checkpoint(arrays=arrays, **record)
    except Exception:  # zip, zlib, NumPy's header and JSON each have their own words for torn bytes
        return None


def read(folder: Path, start: Checkpoint, scene: str) -> Checkpoint | None:
    """The newest whole checkpoint in a folder of the run that begins with `start`, None if there is none.

    `scene` is the digest of the whole scene. Raises ValueError when the only whole ones belong to another scene, code or number
    of ranks. The last state of a run that was completed is passed over there, unless its scene is another one.
    """
    foreign, sound = {}, []
    for name in (*NAMES, END):
        found = _whole(folder / name)
        if found is None or not isinstance(found.owner, dict):
            continue
        if other := [key for key, value in start.owner.items() if found.owner.get(key) != value]:
            foreign[name] = f"{folder / name} is of another {' and '.join(other)}"
        elif _sound(found, start):
            sound.append(found)
    if sound:
        return max(sound, key=lambda one: one.step)
    ended, another = foreign.pop(END, ""), _of_another_scene(folder, scene)
    if reason := next(iter(foreign.values()), "") or (another and (ended or another)):
        raise ValueError(f"{reason}; run it as it was, or without --resume from the start")
    return None


def _sound(found: Checkpoint, start: Checkpoint) -> bool:
    try:
        return found.resembles(start) and 0 < found.step == found.pace["taken"]
    except (AttributeError, TypeError, ValueError):  # entries of other types
        return False


def _of_another_scene(folder: Path, scene: str) -> str:
    """What to say when the run that ended in the folder was of another scene: it would be overwritten."""
    path = folder / "summary.json"
    try:
        there = json.loads(path.read_text(encoding="utf-8"))["stamp"]["scene_hash"]
    except (OSError, ValueError, LookupError, TypeError):
        return ""
    return "" if there == scene else f"{path} is of another scene"
