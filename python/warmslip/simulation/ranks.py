"""Many processes end together: a rank that fails alone would leave the others waiting for ever."""

from __future__ import annotations

import sys
import time
from types import TracebackType

PATIENCE = 3.0  # seconds in which the others come to the same end, if they do


def others_come() -> bool:
    """Whether all processes come here within `PATIENCE`; called where this one ends."""
    from mpi4py import MPI

    if MPI.COMM_WORLD.size == 1:
        return True
    request, deadline = MPI.COMM_WORLD.Ibarrier(), time.monotonic() + PATIENCE
    while not request.Test():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


def abort(code: int) -> None:
    """Ends all processes."""
    from mpi4py import MPI

    sys.stdout.flush()
    sys.stderr.flush()
    MPI.COMM_WORLD.Abort(code)


def guard() -> None:
    """From now on an exception that nothing catches ends all processes, after what was done with it before.

    Where all of them raise, each ends by itself. Without other processes nothing changes.
    """
    from mpi4py import MPI

    before = sys.excepthook
    if MPI.COMM_WORLD.size == 1 or getattr(before, "ends_all", False):
        return

    def hook(kind: type[BaseException], value: BaseException, trace: TracebackType | None) -> None:
        before(kind, value, trace)
        if not MPI.Is_finalized() and not others_come():
            sys.stderr.write(f"rank {MPI.COMM_WORLD.rank} failed alone: all ranks are ended\n")
            abort(1)

    hook.ends_all = True  # type: ignore[attr-defined]
    sys.excepthook = hook
