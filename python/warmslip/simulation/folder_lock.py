"""One run a folder: what a run holds while it writes, so that no other run replaces its files."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def held(folder: Path | None, comm: Any = None) -> Iterator[None]:
    """Holds a folder until the run in it is over or its process ends (collective).

    The lock is advisory and on the folder itself, of which nothing is left. A file system without locks has none.

    Raises
    ------
    ValueError
        When another run holds it, or when a program writes the trajectory in it.
    """
    from mpi4py import MPI

    comm = MPI.COMM_WORLD if comm is None else comm
    handle, taken = None, None
    if folder is not None and comm.rank == 0:
        handle = os.open(folder, os.O_RDONLY)
        taken = folder if not _lock(handle) else None
        path = folder / "trajectory.h5"
        if taken is None and path.exists():  # another program's, which HDF5 locks
            with path.open("rb") as file:
                taken = None if _lock(file.fileno()) else path
    try:
        taken = comm.bcast(taken, root=0)
        if taken is not None:
            raise ValueError(f"{taken} is being written by another run; wait for its end, or choose another folder")
        yield
    finally:
        if handle is not None:
            os.close(handle)


def _lock(handle: int) -> bool:
    """Locks an open file; False when somebody else did."""
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass  # a file system without locks
    return True
