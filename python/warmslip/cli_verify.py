"""The verification commands: topics, report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def verify(
    topic: Annotated[str, typer.Argument(help="a topic of the report, or `list`")],
    out: Annotated[Path, typer.Option(help="the CSV of lines to write; tables and stamp go beside it")] = Path(
        "lines.csv"
    ),
    fail: Annotated[bool, typer.Option(help="exit 1 when a line is out of its band")] = True,
) -> None:
    """Verify one topic: each line says what it proves, where the expected number comes from, and whether it holds."""
    from warmslip.study import stamp
    from warmslip.verify import line
    from warmslip.verify.topics import TOPICS

    if topic == "list":
        for name, run in TOPICS.items():
            typer.echo(f"{name:16s} {title(run)}")
        return
    if topic not in TOPICS:
        raise ValueError(f"unknown topic '{topic}'; give one of {', '.join(TOPICS)}")
    found = TOPICS[topic](out.parent)
    passed = line.write(out, found, stamp(None, topic=topic))
    for one in found:
        if not one.passed:
            typer.echo(
                f"  {one.case}: {one.proves}: {one.observed:.6g} not in [{one.low:.6g}, {one.high:.6g}]", err=True
            )
    typer.echo(f"{'passed' if passed else 'FAILED'}: {sum(o.passed for o in found)} of {len(found)} lines")
    if fail and not passed:
        raise typer.Exit(1)


def report(
    tables: Annotated[list[Path], typer.Argument(help="lines written by `warmslip verify`")],
    out: Annotated[Path, typer.Option(help="the Markdown file to write")],
    figures: Annotated[list[Path] | None, typer.Option(help="a figure to show, any number of times")] = None,
    fail: Annotated[bool, typer.Option(help="exit 1 when a line is out of its band")] = True,
) -> None:
    """Put the lines of all topics into one report."""
    from warmslip.verify import report as writing
    from warmslip.verify.topics import TOPICS

    titles = {name: title(run) for name, run in TOPICS.items()}
    text, passed = writing.markdown(tables, figures or [], titles)
    out.write_text(text)
    typer.echo(f"{'passed' if passed else 'FAILED'}: read {out}")
    if fail and not passed:
        raise typer.Exit(1)


def title(run: object) -> str:
    """The first line of a topic's docstring, without its full stop."""
    return (run.__doc__ or "").strip().splitlines()[0].rstrip(".")
