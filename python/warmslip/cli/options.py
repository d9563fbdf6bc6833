"""What the commands share: their arguments."""

from __future__ import annotations

from typing import Annotated

import typer

SceneName = Annotated[str, typer.Argument(help="a scene of the library by name, or the path of a TOML file")]
Set = Annotated[list[str] | None, typer.Option("--set", help="table.key=value, any number of times")]
