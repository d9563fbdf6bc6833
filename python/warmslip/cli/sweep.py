"""The command that varies keys of a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from warmslip.cli.options import SceneName, Set
from warmslip.scene import reader
from warmslip.scene.errors import SceneError
from warmslip.scene.overrides import parse


def values_of(text: str) -> tuple[str, list[Any]]:
    """Key and values of `KEY=0,0.1,0.2`, `KEY=0:1:11` (eleven values from 0 to 1) or `KEY=[[0, 1], [0, 2]]`.

    Raises SceneError.
    """
    key, equals, given = text.partition("=")
    if not equals or not key.strip() or not given.strip():
        raise SceneError(f"--vary '{text}' has no values; write --vary contact.gap=0,0.1 or contact.gap=0:0.1:11")
    parts = given.split(":")
    if len(parts) == 3 and "[" not in given:
        try:
            first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
        except ValueError:
            raise SceneError(f"--vary '{text}' is no range; write first:last:count, such as 0:1:11") from None
        if count < 1 or not np.isfinite([first, last]).all():
            raise SceneError(f"--vary '{text}' has no values; give finite ends and a count of 1 or more")
        values = [float(value) for value in np.linspace(first, last, count)]
        whole = all(part.strip().lstrip("-").isdecimal() for part in parts) and all(v.is_integer() for v in values)
        return key.strip(), [int(value) for value in values] if whole else values
    if ":" in given and "[" not in given:
        raise SceneError(f"--vary '{text}' is no range; write first:last:count, such as 0:1:11")
    whole = parse(given.strip())
    if isinstance(whole, list):
        return key.strip(), whole
    return key.strip(), [parse(part.strip()) for part in _split(given)]


def _split(text: str) -> list[str]:
    """A list at its commas, but for those inside brackets or quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        else:
            depth += (letter in "([{") - (letter in ")]}")
        if letter == "," and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def _part(text: str) -> tuple[int, int]:
    first, slash, second = text.partition("/")
    if not slash or not first.isdecimal() or not second.isdecimal():
        raise SceneError(f"--part '{text}' is none; write 1/4 for the first of four")
    return int(first), int(second)


def sweep(
    scene: SceneName,
    vary: Annotated[
        list[str],
        typer.Option(
            help="KEY=0,0.1,0.2 or KEY=0:1:11 (eleven values from 0 to 1), any number of times: all combinations"
        ),
    ],
    out: Annotated[Path, typer.Option(help="folder for sweep.csv and sweep.png")] = Path("sweep"),
    set_: Set = None,
    jobs: Annotated[int, typer.Option(help="processes at once")] = 1,
    part: Annotated[
        str, typer.Option(help="only the i-th of n parts, i/n, into a table of its own: for a cluster")
    ] = "1/1",
) -> None:
    """Run a scene with every combination of some values of its keys. Runs that are in the folder are not run again."""
    from mpi4py import MPI

    from warmslip.figures import draw
    from warmslip.studies import sweep as sweeps

    checked = reader.load(scene, set_)
    wanted = dict(values_of(one) for one in vary)
    if len(wanted) < len(vary):
        raise SceneError("--vary names a key twice; give all its values at once")
    whole = _part(part)
    rows = sweeps.sweep(checked, wanted, out=out, jobs=jobs, part=whole, progress=True)
    if MPI.COMM_WORLD.rank != 0:
        return
    counts: dict[str, int] = {}
    for row in rows:
        counts[row["outcome"]] = counts.get(row["outcome"], 0) + 1
    name = sweeps.NAME if whole[1] == 1 else f"{sweeps.NAME}.{whole[0]}of{whole[1]}"
    table = out / f"{name}.csv"
    if rows and whole[1] == 1:
        draw("sweep", [table], out / f"{name}.png")
    found = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items())) or "no run in this part"
    typer.echo(f"{found}, see {table if rows else out}")
    if set(counts) - {"completed"}:
        raise typer.Exit(1)
