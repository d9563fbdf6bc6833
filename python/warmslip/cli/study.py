"""The commands of the workflow: measure studies, derive tables from them, judge and draw."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from warmslip.cli.options import SceneName, Set
from warmslip.figures import KINDS
from warmslip.records import tables
from warmslip.scene import reader
from warmslip.scene.errors import SceneError
from warmslip.scene.full import full_model
from warmslip.simulation.progress import progress_bar

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


def study(
    scene: SceneName,
    out: Csv,
    levels: Annotated[
        str,
        typer.Option(help="cells along the first axis, and steps; of a file, pieces of an edge and of a step: 1,2,4"),
    ] = "16,32,64,128",
    reference: Annotated[int, typer.Option(help="cells and steps of the solution taken as exact")] = 256,
    grid: Annotated[str, typer.Option(help="diagonal (h = k) or full")] = "diagonal",
    steps_per_level: Annotated[
        int | None, typer.Option(help="steps of level 1; default 1, for a mesh from a file the scene's time.steps")
    ] = None,
    set_: Set = None,
) -> None:
    """Measure an h,k refinement study against its finest solution."""
    from warmslip.studies import refinement_study

    checked = reader.load(scene, set_)
    if grid not in ("diagonal", "full"):
        raise SceneError(f"--grid '{grid}' is unknown; use diagonal or full")
    sizes = _levels(levels)
    refinement_study.members(sizes, reference, grid)  # refuses before anything is computed
    _writable(out)
    with progress_bar() as bar:
        task = bar.add_task(out.stem, total=None, note="")
        rows = refinement_study.study(
            checked,
            levels=sizes,
            reference=reference,
            grid=grid,
            steps_per_level=steps_per_level,
            progress=lambda n, total: bar.update(task, completed=n, total=total),
        )
    tables.write(
        out,
        rows,
        refinement_study.stamp(checked, levels=levels, reference=reference, grid=grid, steps_per_level=steps_per_level),
    )
    typer.echo(tables.aligned(rows, ("n", "steps", "h", "k", "e_u_V", "e_w_L2", "e_theta_L2", "cpu_seconds")))


def manufactured(
    out: Csv,
    levels: Annotated[str, typer.Option(help="1/h of the meshes")] = "8,16,32,64",
    set_: Set = None,
) -> None:
    """Measure the orders on a manufactured solution with contact and slip: h = k for every coupling, k = h^2 staggered."""
    from warmslip.studies import refinement_study
    from warmslip.verification.mms import manufactured as made

    checked = full_model(reader.load("paper_isotropic", set_))
    _writable(out)
    rows = made.table(checked, ["staggered", "lagged", "monolithic"], _levels(levels), "h=k")
    rows += made.table(checked, ["staggered"], _levels(levels), "k=h^2")
    tables.write(out, rows, refinement_study.stamp(checked, levels=levels))


def extremes(
    out: Csv,
    n: Annotated[int, typer.Option(help="cells per side")] = 16,
    steps: Annotated[int, typer.Option(help="time steps")] = 16,
    scene: Annotated[str, typer.Option(help="the scene whose parameters climb the ladders")] = "paper_isotropic",
    set_: Set = None,
) -> None:
    """Climb the ladders of extreme parameters and say what became of every run."""
    from warmslip.studies import refinement_study, robustness

    checked = full_model(reader.load(scene, [f"mesh.n={n}", f"time.steps={steps}", *(set_ or [])]))
    tables.write(_writable(out), robustness.table(checked), refinement_study.stamp(checked))


def blocks(
    out: Csv,
    explained: Annotated[
        Path, typer.Option(help="another CSV: what `explain` says of the library and what its runs take")
    ],
    n: Annotated[int, typer.Option(help="cells per side")] = 96,
    steps: Annotated[int, typer.Option(help="time steps of every combination, a multiple of 5")] = 30,
) -> None:
    """Measure what every combination of blocks costs, against the whole model and against the least code."""
    from warmslip.report import cost
    from warmslip.studies import block_cost, refinement_study

    for path in (out, explained):
        _writable(path)
    stamp = refinement_study.stamp(block_cost.whole(n, steps))
    with progress_bar() as bar:
        task = bar.add_task("combinations", total=None, note="")
        rows = block_cost.table(n, steps, lambda done, total: bar.update(task, completed=done, total=total))
        tables.write(out, rows, stamp)
        task = bar.add_task("library", total=None, note="")
        rows = cost.table(progress=lambda done, total: bar.update(task, completed=done, total=total))
        tables.write(explained, rows, refinement_study.stamp(None))


def _derived(
    out: Path, make: Callable[[], list[dict[str, Any]]], sources: list[Path], shown: Sequence[str] = ()
) -> None:
    """Writes a table made from other tables and prints the columns `shown`; ValueError for tables that will not do."""
    from warmslip.records import provenance

    names = [p.name for p in sources]
    try:
        rows = make()
    except (LookupError, TypeError, UnicodeDecodeError, ZeroDivisionError) as error:
        raise ValueError(f"{', '.join(names)}: not tables that `warmslip study` wrote ({error!r})") from error
    tables.write(out, rows, provenance.stamp(sources=names))
    if shown:
        typer.echo(tables.aligned(rows, shown))


def rates(tables: Tables, out: Csv) -> None:
    """Observed, bias-corrected and expected orders of studies."""
    from warmslip.studies import rates as orders
    from warmslip.studies.work_precision import scene_of

    shown = ("case", "term", "h", "error", "observed", "corrected", "expected")
    _derived(out, lambda: [row for path in tables for row in orders.table(path, scene_of(path))], tables, shown)


def readings(tables: Tables, out: Csv) -> None:
    """Which reading of the paper satisfies which of its claims."""
    from warmslip.paper import readings as claims

    _derived(out, lambda: claims.table(tables), tables)


def work(tables: Tables, out: Csv) -> None:
    """Work against precision of every run of studies, with the front."""
    from warmslip.studies import work_precision

    shown = ("problem", "case", "coupling", "quadrature", "n", "steps", "error", "cpu_seconds", "front")
    _derived(out, lambda: work_precision.table(tables), tables, shown)


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
    from warmslip.paper import acceptance
    from warmslip.records import provenance

    def verdict() -> dict[str, Any]:
        return acceptance.verdict(
            studies=studies or [],
            manufactured_table=manufactured,
            readings=readings,
            extremes=extremes,
            expected=acceptance.load(expected),
        )

    result = verdict()
    if record:
        expected.write_text(json.dumps(acceptance.record(result), indent=1) + "\n", encoding="utf-8")
        result = verdict()
    out.parent.mkdir(parents=True, exist_ok=True)
    stamp = provenance.stamp(sources=[p.name for p in (*(studies or []), manufactured, readings, extremes) if p])
    out.write_text(json.dumps(result | {"stamp": stamp}, indent=1) + "\n", encoding="utf-8")
    typer.echo(
        f"{'passed' if result['passed'] else 'FAILED'}: {result['checks'] - len(result['failed'])} of {result['checks']} checks"
    )
    for name in result["failed"]:
        detail = next(d for d in result["details"] if d["case"] == name)
        typer.echo(f"  {name}: {detail['observed']} not in [{detail['low']}, {detail['high']}]", err=True)
    if fail and not result["passed"]:
        raise typer.Exit(1)


def page(
    figures: Annotated[list[Path], typer.Argument(help="figures with their captions beside them, in their order")],
    readings: Annotated[Path, typer.Option(help="the table of `warmslip readings`")],
    verdict: Annotated[Path, typer.Option(help="the verdict of `warmslip judge`")],
    out: Annotated[Path, typer.Option(help="the page to write, HTML")],
) -> None:
    """Write the page of the paper: its figures, the readings and the verdict in one file."""
    from warmslip.paper import page as paper

    paper.page(figures, readings, verdict, out)


def draw(
    kind: Annotated[str, typer.Argument(help="; ".join(f"{kind}: from {what}" for kind, (_, what) in KINDS.items()))],
    inputs: Annotated[list[Path], typer.Argument(help="tables or trajectories it is drawn from")],
    out: Annotated[Path, typer.Option(help="the PNG to write; its caption goes beside it as .rst")],
) -> None:
    """Draw a figure from tables."""
    import warmslip.figures as figures

    def contact_parts(path: Path) -> list[Any]:
        from warmslip.io import drawn  # the compiled core, which other figures do not need

        return drawn.lines(path, told=len(inputs) > 1)

    figures.draw(kind, inputs, out, contact_parts)


def trade(
    contest: Annotated[str, typer.Argument(help="paper_cold, paper_hot, smooth, heat, impact, stick_slip or block")],
    out: Csv,
) -> None:
    """Measure what accuracy costs: every method on a scene, against one reference that no method shares, or an exact solution."""
    from warmslip.studies import tradeoff

    def say(line: str) -> None:
        typer.echo(line, err=True)

    if contest not in (*tradeoff.CONTESTS, "smooth"):
        raise SceneError(f"there is no contest '{contest}'; give one of {', '.join([*tradeoff.CONTESTS, 'smooth'])}")
    _writable(out)
    if contest == "smooth":
        from warmslip.verification.mms.contest import run

        rows = run(say=say)
    else:
        rows = tradeoff.run(tradeoff.CONTESTS[contest], say)
    from warmslip.studies.refinement_study import stamp

    tables.write(out, rows, stamp(None, contest=contest))
    typer.echo(f"{len(rows)} runs in {out}")


def front(
    contests: Annotated[list[Path], typer.Argument(help="tables of `warmslip trade`, called trade_CONTEST.csv")],
    out: Csv,
) -> None:
    """List the settings that err less than every cheaper one, with what is typed for them."""
    from warmslip.studies import tradeoff
    from warmslip.studies.refinement_study import stamp

    _writable(out)
    rows = []
    for path in contests:
        found, name = tables.read(path), path.stem.removeprefix("trade_")
        for quantity in ("e_sum", "e_normal_force"):
            rows += tradeoff.front(name, found, quantity)
    tables.write(out, rows, stamp(None))
    sums = [row for row in rows if row["quantity"] == "e_sum"]
    typer.echo(tables.aligned(sums, ["contest", "error", "cpu_seconds", "method", "n"]))
