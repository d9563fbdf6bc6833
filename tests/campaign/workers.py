"""Jobs in processes of their own: one that dies or does not end is named, and the others go on."""

from __future__ import annotations

import multiprocessing as mp
import os
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection, wait
from typing import Any

START = 60.0  # seconds a new process has to say that it is there


def _serve(pipe: Connection, work: Callable[[Any, Callable[[Any], None]], Any]) -> None:
    pipe.send(("ready", None))
    while (simulation := pipe.recv()) is not None:
        pipe.send(("done", work(simulation, lambda half: pipe.send(("half", half)))))


class _Worker:
    """A process, its pipe and what it is at."""

    def __init__(self, work: Callable[..., Any]) -> None:
        context = mp.get_context("spawn")
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=_serve, args=(other, work), daemon=True)
        self.process.start()
        other.close()
        self.job: Any = None
        self.half: Any = None
        self.until = time.monotonic() + START
        self.ready = False

    def give(self, simulation: Any, limit: float) -> None:
        self.job, self.half = simulation, None
        if self.ready:
            self.until = time.monotonic() + limit
        self.pipe.send(simulation)

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


def served(
    work: Callable[[Any, Callable[[Any], None]], Any], simulations: Iterable[Any], *, processes: int, limit: float
) -> Iterator[tuple[Any, str, Any]]:
    """(job, how, result) as they come. `work(job, tell)` may tell half of its result on the way.

    how: `done`; `crash` where the process died, `hang` after `limit` seconds, the result then being what was told, or None.
    """
    left, workers = iter(simulations), [_Worker(work) for _ in range(processes)]
    busy: list[_Worker] = []

    def feed(worker: _Worker) -> None:
        simulation = next(left, None)
        if simulation is not None:
            worker.give(simulation, limit)
            busy.append(worker)

    try:
        for worker in workers:
            feed(worker)
        while busy:
            ready = wait([w.pipe for w in busy], timeout=max(0.0, min(w.until for w in busy) - time.monotonic()))
            for worker in [w for w in busy if w.pipe in ready or time.monotonic() > w.until]:
                how, result = "hang", worker.half
                if worker.pipe in ready:
                    try:
                        how, result = worker.pipe.recv()
                    except EOFError:
                        how, result = "crash", worker.half
                if how == "ready":
                    worker.ready, worker.until = True, time.monotonic() + limit
                    continue
                if how == "half":
                    worker.half = result
                    continue
                busy.remove(worker)
                yield worker.job, how, result
                if how != "done":
                    worker.end()
                    workers.remove(worker)
                    worker = _Worker(work)
                    workers.append(worker)
                feed(worker)
    finally:
        for worker in workers:
            worker.end()


def rehearse(simulation: str, tell: Callable[[Any], None]) -> str:
    """Work that goes wrong when told to, for the tests: `die`, `sleep`, `half` and sleep; anything else comes back."""
    if simulation == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if simulation == "half":
        tell(simulation)
    if simulation in ("die", "half", "sleep"):
        time.sleep(100)
    return simulation
