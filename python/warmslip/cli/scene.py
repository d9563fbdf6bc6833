"""The commands of one scene: explain it, run it, look at what came out."""

from __future__ import annotations

import json
import os
import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from warmslip.cli.options import SceneName, Set
from warmslip.scene import reader
from warmslip.scene.errors import SceneError
from warmslip.scene.scene import Scene
from warmslip.simulation.progress import console, progress_bar, stepping

RunFolder = Annotated[Path, typer.Argument(help="the folder that `warmslip run` wrote")]


def run(
    scene: SceneName,
    out: Annotated[Path, typer.Option(help="folder for trajectory.h5 and summary.json")] = Path("run"),
    set_: Set = None,
    backend: Annotated[str, typer.Option(help="automatic, cholmod or petsc")] = "automatic",
    resume: Annotated[bool, typer.Option("--resume", help="go on from the newest checkpoint in the folder")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="check and explain the scene, write nothing")] = False,
    estimate: Annotated[
        bool,
        typer.Option(
            "--estimate", help="also estimate the errors from coarser companions: three to eight times the cost"
        ),
    ] = False,
    error: Annotated[
        str, typer.Option(help="relative error, such as 1%: mesh, grading and steps are chosen for it from pilot runs")
    ] = "",
    of: Annotated[str, typer.Option(help="what --error is of: all, u_V, w_L2, theta_L2, normal_force ...")] = "all",
    seconds: Annotated[float, typer.Option(help="CPU seconds that a run with --error may take")] = 3600.0,
    petsc: Annotated[
        str, typer.Option(help='PETSc options, such as "-log_view -momentum_ksp_type cg"; see also PETSC_OPTIONS')
    ] = "",
) -> None:
    """Run a scene. Exit code 0: completed; 1: stopped early; 2: invalid input; 130: interrupted, see --resume."""
    if backend not in ("automatic", "cholmod", "petsc"):
        raise SceneError(f"--backend '{backend}' is unknown; use automatic, cholmod or petsc")
    if dry_run and error:
        plan_(scene, error, set_, of, seconds)
        return
    if dry_run:
        explain(scene, set_, trial=False)
        return
    if of != "all" and not error:
        raise SceneError("--of says what --error is of; give both")
    checked = reader.load(scene, set_)
    _refuse_dashless(petsc)
    wanted = relative(error) if error else None
    if wanted is not None and (resume or estimate):
        raise SceneError("--error chooses a new run and estimates its error; leave --resume and --estimate out")
    if estimate:
        from warmslip.studies.companions import coarser, slower

        for one in (coarser(checked, 2), slower(checked, 2)):  # before the run: a mesh and steps that can be halved
            assert one
    if petsc:  # read once, when PETSc starts; it says at the end which of them nothing has used
        os.environ["PETSC_OPTIONS"] = f"{os.environ.get('PETSC_OPTIONS', '')} {petsc} -options_left"
    from mpi4py import MPI

    from warmslip.scene import plan
    from warmslip.simulation.run import run

    rank = MPI.COMM_WORLD.rank
    answer = None
    if wanted is not None:
        from warmslip.studies import ask

        answer = ask.solve(checked, wanted, of, seconds=seconds, say=_say if rank == 0 else lambda _: None)
        checked = answer.scene
    for odd in plan.plan(checked).suspicious if rank == 0 else ():
        console.print(f"note: {odd}", highlight=False, soft_wrap=True, markup=False)
    with stepping(checked.clock.steps, rank) as progress:
        result = run(checked, out=out, backend=backend, progress=progress, resume=resume)
    if answer is not None:
        _tell_error(result, answer, wanted, out, rank)
    if estimate and result.completed:
        _estimate(checked, out, rank)
    if rank == 0:
        typer.echo(f"{result.outcome}: {_ending(result.summary)}, see {out}/summary.json")
        _tell_numbers(result.summary)
        for sentence in result.summary["warnings"]:
            console.print(f"warning: {sentence}", highlight=False, soft_wrap=True, markup=False)
    if not result.completed:
        sys.exit(130 if result.outcome == "interrupted" else 1)  # it has given the reason


def relative(text: str) -> float:
    """A relative error, given as a number or in percent. Raises SceneError."""
    number, percent, rest = text.strip().partition("%")
    try:
        value = float(number) / (100 if percent else 1)
    except ValueError:
        value = float("nan")
    if rest or not 0 < value < 1:
        raise SceneError(f"--error '{text}' is no relative error; write 1% or 0.01")
    return value


def _say(line: str) -> None:
    console.print(line, highlight=False, soft_wrap=True, markup=False)


def _tell_error(result: Any, answer: Any, wanted: Any, out: Path, rank: int) -> None:
    """What a run with --error has come to; into its summary too."""
    from warmslip.studies.accuracy import with_error

    if rank == 0:
        with_error(result, answer, wanted, out)
        parts = "; ".join(
            f"{name} {100 * answer.errors[name]:.2g} % (mesh {100 * one['space']:.2g} %, steps {100 * one['time']:.2g} %)"
            for name, one in answer.parts.items()
        )
        typer.echo(
            f"estimated error {100 * answer.error:.2g} %: {parts}; {answer.seconds:.3g} s of CPU with the pilot runs"
        )


def _estimate(scene: Scene, out: Path, rank: int) -> None:
    """Estimates the errors of a run that was completed: a table, a figure and lines on the terminal."""
    from warmslip.figures import draw
    from warmslip.records import tables
    from warmslip.studies import error_estimate
    from warmslip.studies.refinement_study import stamp

    with progress_bar(rank) as bar:
        task = bar.add_task("companions", total=scene.time.end, note="")
        found, _ = error_estimate.estimate(scene, lambda time, _: bar.update(task, completed=time))
    if rank == 0:
        tables.write(out / "error.csv", found.rows(), stamp(scene))
        draw("error", [out / "error.csv"], out / "error.png")
        typer.echo(error_estimate.text(found))


def plan_(
    scene: SceneName,
    error: Annotated[str, typer.Option(help="relative error that is asked for, such as 1%")],
    set_: Set = None,
    of: Annotated[str, typer.Option(help="all, u_V, w_L2, theta_L2, normal_force ...")] = "all",
    seconds: Annotated[float, typer.Option(help="CPU seconds that the run may take")] = 3600.0,
) -> None:
    """Choose mesh, grading and steps for an error: the choice, what it will cost, and the alternatives."""
    from mpi4py import MPI

    from warmslip.studies import ask, pilots

    checked = reader.load(scene, set_)
    first = MPI.COMM_WORLD.rank == 0
    found = ask.plan(checked, relative(error), of, seconds=seconds, say=_say if first else lambda _: None)
    if first:
        typer.echo(ask.text(found))
        keys = [*(set_ or []), *pilots.keys_of(found.choice.scene)]
        words = ["warmslip", "run", scene, *(word for key in keys for word in ("--set", key))]
        typer.echo(f"run it with: {shlex.join(words)}")
        if checked.time.tolerance is not None and found.choice.scene.time.tolerance is None:
            typer.echo("and leave time.tolerance out of the scene")


def _refuse_dashless(petsc: str) -> None:
    """Raises SceneError for a word that PETSc would pass over in silence: neither an option nor the value of one."""
    before = ""
    for word in petsc.split():
        if not word.startswith("-") and not before.startswith("-"):
            raise SceneError(f"--petsc: '{word}' is neither an option nor the value of one; write -{word}")
        before = word


def _digits(found: dict[str, float]) -> str:
    from warmslip.simulation.summary import trusted_digits

    return f"digits: {trusted_digits(found)}"


def _tell_numbers(summary: dict[str, Any]) -> None:
    """Prints the numbers of the last state, the body on one line and the contact on another."""
    from warmslip.simulation.summary import numbers

    found = {name: f"{name} {words}" for name, words in numbers(summary).items()}
    if not summary["steps"]:
        return
    body = [
        found.pop(name) for name in ("largest displacement", "largest von Mises stress", "temperature") if name in found
    ]
    typer.echo(f"  at t = {summary['time']:g}: {', '.join(body)}")
    if found:
        typer.echo(f"  contact: {', '.join(found.values())}")


def _ending(summary: dict[str, Any]) -> str:
    """The end of a run in a few words; of one that stopped, the residuals of the step that was rejected."""
    failure = summary["failure"]
    if summary["outcome"] == "interrupted":
        end = summary["stamp"]["scene"]["time"]["end"]
        return f"after {summary['steps']} steps, at t = {summary['time']:g} of {end:g}; --resume goes on"
    if failure is None:
        worst = max(summary["balances"][i] for i in ("energy", "heat", "force", "law"))
        return f"{summary['steps']} steps, largest balance residual {worst:.1e}, {_digits(summary['digits'])}"
    numbers = [f"{k.replace('_', ' ')} {v:.1e}" for k, v in failure.items() if k not in ("step", "reason", "digits")]
    parts = [failure["reason"]] if failure["reason"] else []
    parts += [f"residuals: {', '.join(numbers)}"] if numbers else []
    parts += [_digits(failure["digits"])] if "digits" in failure else []
    return f"step {failure['step']} rejected: {'; '.join(parts)}"


def export(
    run: RunFolder,
    out: Annotated[Path, typer.Option(help="folder for body.pvd, contact.pvd and series.csv")],
    fields: Annotated[str, typer.Option(help="names, comma between: displacement,pressure; default all")] = "",
    times: Annotated[str, typer.Option(help="times, comma between, of the nearest stored states; default all")] = "",
    form: Annotated[
        str, typer.Option(help="vtu: a file for each state; vtkhdf: one file, for ParaView 5.12 and later")
    ] = "vtu",
) -> None:
    """Write a stored run as a series that ParaView opens, and its resultants and balances as CSV."""
    from warmslip.io import paraview

    names = [name.strip() for name in fields.split(",")] if fields else paraview.FIELDS
    with progress_bar() as bar:
        task = bar.add_task("writing", total=None, note="")
        count = paraview.export(
            run,
            out,
            fields=names,
            times=_times(times),
            form=form,
            progress=lambda n, total: bar.update(task, completed=n, total=total),
            warn=lambda words: console.print(f"note: {words}", highlight=False, soft_wrap=True, markup=False),
        )
    end = "vtkhdf" if form == "vtkhdf" else "pvd"
    body, points = ((out / f"{name}.{end}").exists() for name in ("body", "contact"))
    where = f"{out}/body.{end}" if body else f"{out}/contact.{end}" if points else str(out)
    typer.echo(
        f"{count} states in {where}{f', contact points in contact.{end}' * (body and points)}, time series in series.csv"
    )


def _times(text: str) -> list[float] | None:
    try:
        return [float(part) for part in text.split(",")] if text else None
    except ValueError:
        raise SceneError(f"--times '{text}' is not a list of times; write 0.25,0.5") from None


def view(
    run: RunFolder,
    out: Annotated[Path, typer.Option(help="folder for report.html, the figures and the animation")],
    at: Annotated[float | None, typer.Option(help="time of the state that is drawn; default the last one")] = None,
    animate: Annotated[bool, typer.Option(help="also draw the body through time, animation.gif")] = True,
) -> None:
    """Draw a stored run: body, contact, history and animation, and one page with all of it, report.html."""
    from warmslip.report import page

    with progress_bar() as bar:
        task = bar.add_task("drawing", total=None, note="")
        files = page.view(
            run, out, at=at, animate=animate, progress=lambda n, total: bar.update(task, completed=n, total=total)
        )
    typer.echo(f"{', '.join(path.name for path in files)} in {out}")


def explain(
    scene: SceneName,
    set_: Set = None,
    trial: Annotated[bool, typer.Option(help="set up and take a few steps to tell the cost")] = True,
    draw: Annotated[
        Path | None, typer.Option(help="draw mesh, parts, supports, loads and foundation into a PNG")
    ] = None,
) -> None:
    """Say what a scene will do and cost before it runs: fields, operators, solver, what could be left out, what is missing."""
    from mpi4py import MPI

    from warmslip.scene import plan

    checked = reader.load(scene, set_)
    if trial:
        from warmslip.report import cost

        found = cost.measured(checked)
    else:
        from warmslip.model.initial import refuse_unusable
        from warmslip.model.loads import Loads
        from warmslip.model.materials import cell_regions
        from warmslip.model.meshes import make_mesh
        from warmslip.model.probes import refuse_outside
        from warmslip.model.supports import supports

        found = plan.plan(checked)
        mesh = make_mesh(checked)
        cell_regions(checked, mesh)  # what else a run would refuse
        refuse_outside(checked, mesh)
        refuse_unusable(checked, mesh)
        supports(checked, Loads.of(checked), mesh)
    if MPI.COMM_WORLD.rank == 0:
        typer.echo(plan.text(found))
        if draw is not None:
            _draw(checked, draw)


def _draw(scene: Scene, out: Path) -> None:
    """Draws a scene before it runs."""
    from warmslip.figures import scene as drawing
    from warmslip.figures import style
    from warmslip.report.sketch import sketch

    with style.applied():
        style.save(*drawing.scene(sketch(scene), scene.title or "scene"), out)


def list_() -> None:
    """List the scenes of the library."""
    for name in reader.library():
        typer.echo(f"{name:18s} {reader.load(name).title}")


def schema() -> None:
    """Print the JSON schema of scene files."""
    typer.echo(json.dumps(Scene.model_json_schema(), indent=2))
