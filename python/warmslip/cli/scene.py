"""The commands of one scene: explain it, run it, look at what came out."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from warmslip.cli.options import SceneName, Set, console, progress_bar
from warmslip.scene import reader
from warmslip.scene.errors import SceneError
from warmslip.scene.scene import Scene

RunFolder = Annotated[Path, typer.Argument(help="the folder that `warmslip run` wrote")]


def run(
    scene: SceneName,
    out: Annotated[Path, typer.Option(help="folder for trajectory.h5 and summary.json")] = Path("run"),
    set_: Set = None,
    backend: Annotated[str, typer.Option(help="automatic, cholmod or petsc")] = "automatic",
    resume: Annotated[bool, typer.Option("--resume", help="go on from the newest checkpoint in the folder")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="check and explain the scene, write nothing")] = False,
    petsc: Annotated[
        str, typer.Option(help='PETSc options, such as "-log_view -momentum_ksp_type cg"; see also PETSC_OPTIONS')
    ] = "",
) -> None:
    """Run a scene. Exit code 0: completed; 1: stopped early; 2: invalid input; 130: interrupted, see --resume."""
    if backend not in ("automatic", "cholmod", "petsc"):
        raise SceneError(f"--backend '{backend}' is unknown; use automatic, cholmod or petsc")
    if dry_run:
        explain(scene, set_, trial=False)
        return
    checked = reader.load(scene, set_)
    _refuse_dashless(petsc)
    if petsc:  # read once, when PETSc starts; it says at the end which of them nothing has used
        os.environ["PETSC_OPTIONS"] = f"{os.environ.get('PETSC_OPTIONS', '')} {petsc} -options_left"
    from mpi4py import MPI

    from warmslip.scene import plan
    from warmslip.simulation.run import run

    rank = MPI.COMM_WORLD.rank
    for odd in plan.plan(checked).suspicious if rank == 0 else ():
        console.print(f"note: {odd}", highlight=False, soft_wrap=True, markup=False)
    with progress_bar(rank) as bar:
        task = bar.add_task("stepping", total=checked.clock.steps, note="")

        def progress(step: int, steps: int, report: Any) -> None:
            bar.update(
                task, completed=step, total=steps, note=f"open {report.open} stick {report.stick} slip {report.slip}"
            )

        result = run(checked, out=out, backend=backend, progress=progress, resume=resume)
    if rank == 0:
        typer.echo(f"{result.outcome}: {_ending(result.summary)}, see {out}/summary.json")
        for sentence in result.summary["warnings"]:
            console.print(f"warning: {sentence}", highlight=False, soft_wrap=True, markup=False)
    if not result.completed:
        sys.exit(130 if result.outcome == "interrupted" else 1)  # it has given the reason


def _refuse_dashless(petsc: str) -> None:
    """Raises SceneError for a word that PETSc would pass over in silence: neither an option nor the value of one."""
    before = ""
    for word in petsc.split():
        if not word.startswith("-") and not before.startswith("-"):
            raise SceneError(f"--petsc: '{word}' is neither an option nor the value of one; write -{word}")
        before = word


def _digits(found: dict[str, float]) -> str:
    """How many digits of each field can be trusted."""
    return "digits: " + ", ".join(f"{name.replace('_', ' ')} {int(value)}" for name, value in found.items())


def _ending(summary: dict[str, Any]) -> str:
    """The end of a run in a few words; of one that stopped, the residuals of the step that was rejected."""
    failure = summary["failure"]
    if summary["outcome"] == "interrupted":
        return f"after {summary['steps']} of {summary['stamp']['scene']['time']['steps']} steps, --resume goes on"
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
            progress=lambda n, total: bar.update(task, completed=n, total=total),
            warn=lambda words: console.print(f"note: {words}", highlight=False, soft_wrap=True, markup=False),
        )
    body, points = ((out / f"{name}.pvd").exists() for name in ("body", "contact"))
    where = f"{out}/body.pvd" if body else f"{out}/contact.pvd" if points else str(out)
    typer.echo(
        f"{count} states in {where}{', contact points in contact.pvd' * (body and points)}, time series in series.csv"
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
) -> None:
    """Say what a scene will do and cost before it runs: fields, operators, solver, what could be left out, what is missing."""
    from mpi4py import MPI

    from warmslip.scene import plan

    checked = reader.load(scene, set_)
    if trial:
        from warmslip.report import cost

        found = cost.measured(checked)
    else:
        from warmslip.model.materials import cell_regions
        from warmslip.model.meshes import make_mesh

        found = plan.plan(checked)
        cell_regions(checked, make_mesh(checked))  # what else a run would refuse
    if MPI.COMM_WORLD.rank == 0:
        typer.echo(plan.text(found))


def list_() -> None:
    """List the scenes of the library."""
    for name in reader.library():
        typer.echo(f"{name:18s} {reader.load(name).title}")


def schema() -> None:
    """Print the JSON schema of scene files."""
    typer.echo(json.dumps(Scene.model_json_schema(), indent=2))
