"""What the commands share: their arguments, the console, the progress bar."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

SceneName = Annotated[str, typer.Argument(help="a scene of the library by name, or the path of a TOML file")]
Set = Annotated[list[str] | None, typer.Option("--set", help="table.key=value, any number of times")]

console = Console(stderr=True)


def progress_bar(rank: int = 0) -> Progress:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    return Progress(*columns, console=console, disable=rank != 0 or not console.is_terminal)
