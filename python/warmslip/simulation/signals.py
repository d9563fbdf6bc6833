"""Ctrl-C and a polite kill: a run is asked to stop after its step, and every rank agrees on it."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """While it is entered, the first signal is remembered and a second one does what it always did."""

    def __init__(self) -> None:
        self._asked, self._keyboard = False, False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():  # Python takes signals nowhere else
            self._before = {number: signal.signal(number, self._remember) for number in SIGNALS}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._restore()

    def _remember(self, number: int, frame: FrameType | None) -> None:
        self._asked = True
        self._keyboard = number == signal.SIGINT
        self._restore()

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        self._before = {}

    def keyboard(self, comm: Any) -> bool:
        """Whether Ctrl-C was pressed on any rank (collective)."""
        from mpi4py import MPI

        return bool(comm.allreduce(int(self._keyboard), op=MPI.MAX))

    def agreed(self, comm: Any, due: bool) -> tuple[bool, bool]:
        """Whether any rank was asked to stop, and whether rank 0 finds a checkpoint `due` (collective)."""
        if comm.size == 1:
            return self._asked, due
        from mpi4py import MPI

        both = comm.allreduce(2 * self._asked + (due and comm.rank == 0), op=MPI.BOR)
        return bool(both & 2), bool(both & 1)
