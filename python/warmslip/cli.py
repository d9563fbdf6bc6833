"""The command line: run a scene, measure, judge and draw. Every error is one sentence a problem and a non-zero exit."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from warmslip import cli_verify
from warmslip import scene as scenes
from warmslip.cli_verify import SceneName, Set
from warmslip.figures import KINDS
from warmslip.scene import Scene, SceneError

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=__doc__)
console = Console(stderr=True)

Csv = Annotated[Path, typer.Option(help="the CSV file to write; its stamp goes beside it as .json")]
Tables = Annotated[list[Path], typer.Argument(help="tables written by `warmslip study`")]


def _levels(text: str) -> list[int]:
    try:
        levels = [int(part) for part in text.split(",")]
    except ValueError:
        raise SceneError(f"--levels '{text}' is not a list of integers; write 16,32,64") from None
    if not levels or any(level < 1 for level in levels):
        raise SceneError(f"--levels '{text}' needs positive integers; write 16,32,64")
    return levels


def _writable(out: Path) -> Path:
    """`out`, whose folder is there now: nothing is computed for a file that cannot be written. Raises OSError."""
    out.parent.mkdir(parents=True, exist_ok=True)
    there = out.exists()
    out.open("a").close()
    if not there:
        out.unlink()  # an interrupted run leaves no empty table
    return out


def _bar(rank: int = 0) -> Progress:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}"),
    )
    return Progress(*columns, console=console, disable=rank != 0 or not console.is_terminal)


@app.command()
def run(
    scene: SceneName,
    out: Annotated[Path, typer.Option(help="folder for trajectory.h5 and summary.json")],
    set_: Set = None,
    backend: Annotated[str, typer.Option(help="automatic, cholmod or petsc")] = "automatic",
    resume: Annotated[bool, typer.Option("--resume", help="go on from the newest checkpoint in the folder")] = False,
) -> None:
    """Run a scene. Exit code 0 when the outcome is right, 1 when it is not, 2 when the scene cannot be run."""
    import warmslip

    checked = scenes.load(scene, set_)
    if backend not in ("automatic", "cholmod", "petsc"):
        raise SceneError(f"--backend '{backend}' is unknown; use automatic, cholmod or petsc")
    from mpi4py import MPI

    rank = MPI.COMM_WORLD.rank
    with _bar(rank) as bar:
        task = bar.add_task("stepping", total=checked.time.steps, note="")

        def progress(step: int, steps: int, report: Any) -> None:
            bar.update(task, completed=step, note=f"open {report.open} stick {report.stick} slip {report.slip}")

        result = warmslip.run(checked, out=out, backend=backend, progress=progress, resume=resume)
    if rank == 0:
        typer.echo(f"{result.outcome}: {_told(result.summary)}, see {out}/summary.json")
    if not result.right:
        raise typer.Exit(1)


def _told(summary: dict[str, Any]) -> str:
    """The end of a run in a few words; of one that stopped, the residuals of the step that was not taken."""
    failure = summary["failure"]
    if failure is None:
        worst = max(summary["identities"][i] for i in ("energy", "heat", "force", "law"))
        return f"{summary['steps']} steps, worst identity {worst:.1e}"
    words = [failure["reason"]] if failure["reason"] else []
    words += [f"{k.replace('_', ' ')} {v:.1e}" for k, v in failure.items() if k not in ("step", "reason")]
    return f"step {failure['step']} was not taken ({', '.join(words)})"


@app.command()
def export(
    run: Annotated[Path, typer.Argument(help="the folder that `warmslip run` wrote")],
    out: Annotated[Path, typer.Option(help="folder for body.pvd, contact.pvd and series.csv")],
) -> None:
    """Write a stored run as a series that ParaView opens, and its resultants and ledger as CSV."""
    from warmslip import export as series

    with _bar() as bar:
        task = bar.add_task("writing", total=None, note="")
        count, _ = series.export(run, out, progress=lambda n, total: bar.update(task, completed=n, total=total))
    typer.echo(f"{count} states in {out}/body.pvd, contact points in contact.pvd, time series in series.csv")


@app.command()
def study(
    scene: SceneName,
    out: Csv,
    levels: Annotated[
        str, typer.Option(help="bricks along the first axis, and steps, of the members")
    ] = "16,32,64,128",
    reference: Annotated[int, typer.Option(help="bricks and steps of the solution taken as exact")] = 256,
    grid: Annotated[str, typer.Option(help="diagonal (h = k) or full")] = "diagonal",
    set_: Set = None,
) -> None:
    """Measure an h,k refinement study against its finest solution."""
    from warmslip import study as studies

    checked = scenes.load(scene, set_)
    if grid not in ("diagonal", "full"):
        raise SceneError(f"--grid '{grid}' is unknown; use diagonal or full")
    sizes = _levels(levels)
    studies.members(sizes, reference, grid)  # refuses before anything is computed
    _writable(out)
    with _bar() as bar:
        task = bar.add_task(out.stem, total=reference, note="")
        rows = studies.study(
            checked,
            levels=sizes,
            reference=reference,
            grid=grid,
            progress=lambda n, _: bar.update(task, completed=n),
        )
    studies.write(out, rows, studies.stamp(checked, levels=levels, reference=reference, grid=grid))


@app.command()
def manufactured(
    out: Csv,
    levels: Annotated[str, typer.Option(help="1/h of the meshes")] = "8,16,32,64",
    set_: Set = None,
) -> None:
    """Measure the orders on a manufactured solution with contact and slip: h = k for every coupling, k = h^2 staggered."""
    from warmslip import manufactured as made
    from warmslip import study as studies

    checked = scenes.load("paper_isotropic", set_).full()
    _writable(out)
    rows = made.table(checked, ["staggered", "lagged", "monolithic"], _levels(levels), "h=k")
    rows += made.table(checked, ["staggered"], _levels(levels), "k=h^2")
    studies.write(out, rows, studies.stamp(checked, levels=levels))


@app.command()
def extremes(
    out: Csv,
    n: Annotated[int, typer.Option(help="bricks a side")] = 16,
    steps: Annotated[int, typer.Option(help="time steps")] = 16,
    scene: Annotated[str, typer.Option(help="the scene whose parameters climb the ladders")] = "paper_isotropic",
    set_: Set = None,
) -> None:
    """Climb the ladders of extreme parameters and say what became of every run."""
    from warmslip import extremes as ladders
    from warmslip import study as studies

    checked = scenes.load(scene, [f"mesh.n={n}", f"time.steps={steps}", *(set_ or [])]).full()
    studies.write(_writable(out), ladders.table(checked), studies.stamp(checked))


def _derived(out: Path, make: Callable[[], list[dict[str, Any]]], sources: list[Path]) -> None:
    """Writes a table made from other tables; ValueError when those are not what they should be."""
    from warmslip import provenance
    from warmslip import study as studies

    names = [p.name for p in sources]
    try:
        rows = make()
    except (LookupError, TypeError, UnicodeDecodeError, ZeroDivisionError) as error:
        raise ValueError(f"{', '.join(names)}: not tables that `warmslip study` wrote ({error!r})") from error
    studies.write(out, rows, provenance.stamp(sources=names))


@app.command()
def rates(tables: Tables, out: Csv) -> None:
    """Observed, bias-corrected and entitled orders of studies."""
    from warmslip import rates as orders

    _derived(out, lambda: [row for path in tables for row in orders.table(path, _scene_of(path))], tables)


def _scene_of(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.with_suffix(".json").read_text())["scene"])


@app.command()
def readings(tables: Tables, out: Csv) -> None:
    """Which reading of the paper satisfies which of its claims."""
    from warmslip import readings as claims

    _derived(out, lambda: claims.table(tables), tables)


@app.command()
def work(tables: Tables, out: Csv) -> None:
    """Work against precision of every run of studies, with the front."""
    from warmslip import work as precision

    _derived(out, lambda: precision.table(tables), tables)


@app.command()
def judge(
    out: Annotated[Path, typer.Option(help="the verdict to write, JSON")],
    expected: Annotated[Path, typer.Option(help="stored values, JSON")],
    studies: Annotated[list[Path] | None, typer.Option(help="a study's table, any number of times")] = None,
    manufactured: Annotated[Path | None, typer.Option()] = None,
    readings: Annotated[Path | None, typer.Option()] = None,
    extremes: Annotated[Path | None, typer.Option()] = None,
    fail: Annotated[bool, typer.Option(help="exit 1 when a check fails")] = True,
    record: Annotated[
        bool, typer.Option(help="overwrite the stored values with the measured ones, for review")
    ] = False,
) -> None:
    """Compare measured tables with bands and stored values; always writes the verdict."""
    from warmslip import judge as court
    from warmslip import provenance

    def verdict() -> dict[str, Any]:
        return court.verdict(
            studies=studies or [],
            manufactured_table=manufactured,
            readings=readings,
            extremes=extremes,
            expected=court.load(expected),
        )

    result = verdict()
    if record:
        expected.write_text(json.dumps(court.record(result), indent=1) + "\n")
        result = verdict()
    out.parent.mkdir(parents=True, exist_ok=True)
    stamp = provenance.stamp(sources=[p.name for p in (*(studies or []), manufactured, readings, extremes) if p])
    out.write_text(json.dumps(result | {"stamp": stamp}, indent=1) + "\n")
    typer.echo(
        f"{'passed' if result['passed'] else 'FAILED'}: {result['checks'] - len(result['failed'])} of {result['checks']} checks"
    )
    for name in result["failed"]:
        detail = next(d for d in result["details"] if d["name"] == name)
        typer.echo(f"  {name}: {detail['value']} not in [{detail['low']}, {detail['high']}]", err=True)
    if fail and not result["passed"]:
        raise typer.Exit(1)


@app.command()
def draw(
    kind: Annotated[str, typer.Argument(help="; ".join(f"{kind}: from {what}" for kind, (_, what) in KINDS.items()))],
    inputs: Annotated[list[Path], typer.Argument(help="tables or trajectories it is drawn from")],
    out: Annotated[Path, typer.Option(help="the PNG to write; its caption goes beside it as .rst")],
) -> None:
    """Draw a figure from tables."""
    from warmslip import figures

    figures.draw(kind, inputs, out)


app.command()(cli_verify.check)
app.command()(cli_verify.explain)
app.command()(cli_verify.verify)
app.command()(cli_verify.report)


@app.command("list")
def list_() -> None:
    """List the scenes of the library."""
    for name in scenes.library():
        typer.echo(f"{name:18s} {scenes.load(name).title}")


@app.command()
def schema() -> None:
    """Print the JSON schema of scene files."""
    typer.echo(json.dumps(Scene.model_json_schema(), indent=2))


def main() -> None:
    """Entry point: expected errors become sentences and an exit code; WARMSLIP_DEBUG keeps their tracebacks."""
    try:
        app(standalone_mode=True)
    except SceneError as error:  # every rank reads the same scene and refuses it alike
        _say(str(error), everywhere=False)
        sys.exit(2)
    except Exception as error:
        if os.environ.get("WARMSLIP_DEBUG"):
            raise
        message, code = _explain(error)
        _say(message, everywhere=True)
        from mpi4py import MPI

        if MPI.COMM_WORLD.size > 1:  # a rank that ends alone would leave the others waiting for ever
            sys.stderr.flush()
            MPI.COMM_WORLD.Abort(code)
        sys.exit(code)


def _explain(error: Exception) -> tuple[str, int]:
    """A sentence and an exit code: 2 for what the user can mend in the call, 1 for a run that failed."""
    if isinstance(error, OSError):
        where = f" ({error.filename})" if error.filename else ""
        return f"cannot read or write a file{where}: {error.strerror or error}; check the path and its rights", 2
    if isinstance(error, ValueError):
        return str(error), 2
    if isinstance(error, MemoryError):
        return "out of memory; use a coarser mesh or more machines", 1
    if isinstance(error, RuntimeError):
        return str(error), 1
    return f"{type(error).__name__}: {error}; this is a defect, WARMSLIP_DEBUG=1 shows where", 1


def _say(message: str, *, everywhere: bool) -> None:
    from mpi4py import MPI

    if everywhere or MPI.COMM_WORLD.rank == 0:
        for line in message.splitlines():
            console.print(f"error: {line}", highlight=False, soft_wrap=True, markup=False)


if __name__ == "__main__":
    main()
