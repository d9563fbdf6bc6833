"""The bar that shows how far a run has come, in a terminal and in a notebook."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

console = Console(stderr=True)


def progress_bar(rank: int = 0) -> Progress:
    """A bar with a note, on rank 0 of a terminal or of a notebook that has ipywidgets; elsewhere it shows nothing."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    seen = console.is_terminal or (console.is_jupyter and find_spec("ipywidgets") is not None)
    return Progress(*columns, console=console, disable=rank != 0 or not seen)


@contextmanager
def stepping(steps: int, rank: int) -> Iterator[Callable[[int, int, Any], None]]:
    """A bar of time steps: what is yielded takes the step, the steps that are expected, and the report."""
    with progress_bar(rank) as bar:
        task = bar.add_task("stepping", total=steps, note="")

        def progress(step: int, steps: int, report: Any) -> None:
            note = f"open {report.open} stick {report.stick} slip {report.slip}"
            bar.update(task, completed=step, total=steps, note=note)

        yield progress
