"""The command line: run a scene, measure, judge and draw. Every error is one sentence a problem and a non-zero exit."""

from __future__ import annotations

import errno
import logging
import os
import re
import sys
from importlib import metadata
from typing import Annotated, Any

import typer
from rich.logging import RichHandler

from warmslip.cli import scene, study, sweep, verify
from warmslip.scene.errors import SceneError
from warmslip.simulation import ranks
from warmslip.simulation.progress import console

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=__doc__)

LEVELS = ("debug", "info", "warning", "error")


def _version(wanted: bool) -> None:
    if wanted:
        print(f"warmslip {metadata.version('warmslip')}")
        raise typer.Exit


@app.callback()
def logged(
    log: Annotated[str, typer.Option(help="debug (every step), info (the solver), warning or error")] = "warning",
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version and exit")
    ] = False,
) -> None:
    if log not in LEVELS:
        raise SceneError(f"--log '{log}' is unknown; use {', '.join(LEVELS)}")
    logging.basicConfig(
        level=log.upper(), format="%(message)s", handlers=[RichHandler(console=console, show_path=False)]
    )
    for noisy in ("matplotlib", "PIL", "h5py", "numexpr"):
        logging.getLogger(noisy).setLevel(logging.ERROR)  # matplotlib warns of a cache that cannot be written


# what a newcomer needs comes first in --help
PANELS: dict[str, tuple[tuple[str, Any], ...]] = {
    "Run a scene": (
        ("list", scene.list_),
        ("explain", scene.explain),
        ("check", verify.check),
        ("run", scene.run),
        ("plan", scene.plan_),
        ("view", scene.view),
        ("export", scene.export),
        ("sweep", sweep.sweep),
    ),
    "Measure and verify": (
        ("study", study.study),
        ("rates", study.rates),
        ("draw", study.draw),
        ("verify", verify.verify),
        ("report", verify.report),
        ("manufactured", study.manufactured),
        ("extremes", study.extremes),
        ("blocks", study.blocks),
        ("trade", study.trade),
        ("front", study.front),
        ("schema", scene.schema),
    ),
    "Reproduce the paper": (
        ("readings", study.readings),
        ("work", study.work),
        ("judge", study.judge),
        ("page", study.page),
    ),
}
for panel, commands in PANELS.items():
    for name, function in commands:
        app.command(name, rich_help_panel=panel)(function)


def main() -> None:
    """Entry point: expected errors become sentences and an exit code; WARMSLIP_DEBUG keeps their tracebacks."""
    os.environ.setdefault("MPLBACKEND", "Agg")  # files are drawn, and no window
    try:
        code = app(
            prog_name="warmslip", standalone_mode=False
        )  # else typer draws a box around what is wrong with a call
        if code == 130:  # typer's word for Ctrl-C
            _say("interrupted; files that were written are kept", everywhere=False)
        sys.exit(code if isinstance(code, int) else 0)
    except SceneError as error:  # every rank reads the same scene and refuses it alike
        _say(str(error), everywhere=False)
        if not ranks.others_come():  # they have read another scene
            _say(f"the ranks read different scenes; one of them refused: {error}", everywhere=True)
            ranks.abort(2)
        sys.exit(2)
    except Exception as error:
        if hasattr(error, "format_message"):  # of the call itself; typer brings a click of its own, or uses another's
            if type(error).__name__ == "NoArgsIsHelpError":
                error.show()  # type: ignore[attr-defined]
            else:
                _say(_misused(error), everywhere=False)
            sys.exit(2)
        if os.environ.get("WARMSLIP_DEBUG"):
            raise
        message, code = _explain(error)
        if not ranks.others_come():  # this rank alone
            _say(message, everywhere=True)
            ranks.abort(code)
        _say(message, everywhere=False)
        sys.exit(code)


def _misused(error: Any) -> str:
    """A sentence about a call that has not the form of the command."""
    context, sentence = getattr(error, "ctx", None), " ".join(error.format_message().split()).rstrip(".")
    if context is None:
        return f"{sentence[0].lower()}{sentence[1:]}; see `warmslip --help`"
    if extra := re.search(r"unexpected extra arguments?(?:\(s\))? \((.*)\)$", sentence):
        words = extra[1].split()
        if all("=" in word for word in words) and any(one.name == "set_" for one in context.command.params):
            return f"a key of the scene needs --set; write {' '.join(f'--set {word}' for word in words)}"
        return f"'{extra[1]}' is too much for `{context.command_path}`; leave it out, or see its --help"
    sentence, near, guess = sentence.partition(". Did you mean")
    if near:
        return f"{sentence[0].lower()}{sentence[1:]}; did you mean{guess}"
    return f"{sentence[0].lower()}{sentence[1:]}; see `{context.command_path} --help`"


def _explain(error: Exception) -> tuple[str, int]:
    """A sentence and an exit code: 2 for what the user can mend in the call, 1 for a run that failed."""
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        where = f" ({error.filename})" if error.filename else ""
        running = "run" in sys.argv[1:]
        cure = "and give the command again" + " with --resume" * running
        return f"the disk is full{where}; make room {cure}", 1
    if isinstance(error, FileNotFoundError) and error.errno is None:  # of a reader, with the cure
        return str(error), 2
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
