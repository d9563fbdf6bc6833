"""The verification commands: check a scene's assumptions, verify a topic, write the report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from warmslip.cli.options import SceneName, Set
from warmslip.scene import reader
from warmslip.scene.full import full_model


def check(
    scene: SceneName,
    out: Annotated[
        Path | None, typer.Option(help="also write the findings here, .csv (stamp beside it) or .json")
    ] = None,
    set_: Set = None,
) -> None:
    """Audit a scene: which assumptions of the theory hold, by how much, and what follows. Takes no step, blocks nothing."""
    from mpi4py import MPI
    from rich.console import Console

    from warmslip.studies import refinement_study
    from warmslip.verification.assumptions import audit, findings

    checked = full_model(reader.load(scene, set_))
    found = audit.audit(checked)
    if MPI.COMM_WORLD.rank == 0:
        Console().print(findings.table(found, checked.title))
        if out is not None:
            findings.write(out, found, refinement_study.stamp(checked))


def verify(
    topic: Annotated[str, typer.Argument(help="a topic of the report, or `list`")],
    out: Annotated[Path, typer.Option(help="the CSV of checks to write; tables and stamp go beside it")] = Path(
        "checks.csv"
    ),
    fail: Annotated[bool, typer.Option(help="exit 1 when a check is out of its band")] = True,
) -> None:
    """Verify one topic: each check says what it proves, where the expected number comes from, and whether it holds."""
    from warmslip.records import check as checks
    from warmslip.studies.refinement_study import stamp
    from warmslip.verification.suite import TOPICS

    if topic == "list":
        for name, run in TOPICS.items():
            typer.echo(f"{name:16s} {title(run)}")
        return
    if topic not in TOPICS:
        raise ValueError(f"unknown topic '{topic}'; give one of {', '.join(TOPICS)}")
    found = TOPICS[topic](out.parent)
    passed = checks.write(out, found, stamp(None, title=title(TOPICS[topic])))
    for one in found:
        if not one.passed:
            typer.echo(
                f"  {one.case}: {one.proves}: {one.observed:.6g} not in [{one.low:.6g}, {one.high:.6g}]", err=True
            )
    typer.echo(f"{'passed' if passed else 'FAILED'}: {sum(o.passed for o in found)} of {len(found)} checks")
    if fail and not passed:
        raise typer.Exit(1)


def report(
    tables: Annotated[list[Path], typer.Argument(help="checks written by `warmslip verify`")],
    out: Annotated[Path, typer.Option(help="the Markdown file to write")],
    figures: Annotated[list[Path] | None, typer.Option(help="a figure to show, any number of times")] = None,
    audits: Annotated[list[Path] | None, typer.Option(help="written by `warmslip check`, any number of times")] = None,
    faults: Annotated[Path | None, typer.Option(help="written by `make mutants`")] = None,
    fail: Annotated[bool, typer.Option(help="exit 1 when a check is out of its band")] = True,
) -> None:
    """Put the checks of all topics into one report."""
    from warmslip.verification import report as writing

    try:
        text, passed = writing.markdown(tables, figures or [], audits or [], faults)
    except (LookupError, TypeError) as error:
        given = ", ".join(path.name for path in tables)
        raise ValueError(
            f"{given}: not tables of checks that `warmslip verify` wrote ({error!r}); give those"
        ) from error
    out.write_text(text, encoding="utf-8")
    typer.echo(f"{'passed' if passed else 'FAILED'}: read {out}")
    if fail and not passed:
        raise typer.Exit(1)


def title(run: object) -> str:
    """The first line of a topic's docstring, without its full stop."""
    return (run.__doc__ or "").strip().splitlines()[0].rstrip(".")
