"""Probes as CSV files that grow with a run: probes/NAME.csv in its folder."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from warmslip.model.probes import Probe
from warmslip.model.state import State
from warmslip.typing import Array

FOLDER = "probes"
MAX_BUFFER_CHARS, MAX_BUFFER_SECONDS = 2**24, 1.0  # held back before it is written


class ProbeWriter:
    """Appends the rows of every probe as steps come, and writes them every second.

    A row is a point at the end of a step, or in the state that the run begins with, step 0: `step`, `time`, its place and the
    components of its fields. Rank 0 alone writes.

    Parameters
    ----------
    folder : Path or None
        Of the run; nothing is written without one.
    probes : sequence of Probe
        What is written.
    comm : mpi4py communicator
        The ranks of the run.
    keep : int
        Steps of the files there that are kept, of a run that is resumed; tables of other runs are removed.

    Raises
    ------
    ValueError
        When a table ends before the step that the run goes on from.
    OSError
        When a file cannot be written.
    """

    def __init__(self, folder: Path | None, probes: Sequence[Probe], comm: Any, *, keep: int = 0) -> None:
        self._probes = probes if folder is not None else []
        self._held: dict[Path, list[str]] = {}
        self._size, self._written, self._header = 0, time.monotonic(), set[Path]()
        self._folder = folder / FOLDER if folder is not None and comm.rank == 0 else None
        if self._folder is None:
            return
        names = {f"{probe.name}.csv" for probe in probes}
        for file in self._folder.glob("*.csv") if self._folder.is_dir() else ():
            if not keep or file.name not in names:
                file.unlink()
        if probes:
            self._folder.mkdir(exist_ok=True)
        for probe in probes if keep else ():
            self._cut(self._folder / f"{probe.name}.csv", probe, keep)

    def _cut(self, path: Path, probe: Probe, keep: int) -> None:
        """Takes away the rows after step `keep`, and the rest of a row that a killed run left."""
        if not path.exists():
            return  # of a probe that the run had not, or of steps before the first row
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
        kept = [line for line in lines[1:] if line.endswith("\n") and _step(line) <= keep]
        if not _reaches([_step(line) for line in kept], keep, len(probe.positions)):
            raise ValueError(
                f"{path} ends before the checkpoint, or is not of this run; run from the start, without --resume"
            )
        if not kept:
            path.unlink()
            return
        part = path.with_suffix(".part")
        part.write_text("".join([lines[0], *kept]), encoding="utf-8")
        os.replace(part, path)
        self._header.add(path)

    def step(self, state: State) -> None:
        """Appends the rows of the step just taken, or of the state that the run begins with (collective)."""
        for probe in self._probes:
            if state.step % probe.every:
                continue
            columns = probe.columns(state)
            if self._folder is not None:
                self._append(self._folder / f"{probe.name}.csv", state, columns)
        if self._size > MAX_BUFFER_CHARS or time.monotonic() - self._written > MAX_BUFFER_SECONDS:
            self.write()

    def _append(self, path: Path, state: State, columns: dict[str, Array]) -> None:
        rows = self._held.setdefault(path, [])
        if path not in self._header:
            self._header.add(path)
            rows.append(",".join(["step", "time", *columns]) + "\n")
        start = f"{state.step},{state.time:.17g},"
        for row in np.column_stack(list(columns.values())).tolist():
            rows.append(start + ",".join(f"{value:.17g}" for value in row) + "\n")
            self._size += len(rows[-1])

    def write(self) -> None:
        """Writes what is held back."""
        held, self._held, self._size, self._written = self._held, {}, 0, time.monotonic()
        for path, rows in held.items():
            with path.open("a", encoding="utf-8") as file:
                file.writelines(rows)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError) if kind is not None else contextlib.nullcontext():
            self.write()


def _reaches(steps: list[float], keep: int, points: int) -> bool:
    """Whether rows with these step numbers hold all that was due up to step `keep`; runs before may have had another cadence."""
    found, count = np.unique(steps, return_counts=True)
    whole = bool((count == points).all())
    found = found[found > 0]  # the start has a row at every cadence
    if not len(found):
        return whole
    gap = found[-1] - (found[-2] if len(found) > 1 else 0)
    return whole and bool(found[-1] + gap > keep)


def _step(line: str) -> float:
    """The step of a row; none is as far as one that is not."""
    number = line.split(",", 1)[0]
    return int(number) if number.isdigit() else float("inf")
