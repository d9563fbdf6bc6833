"""The pages of the site are true: files they show are written, Python is run, commands are typed and say what the page says.

In a page, in order: a ```toml block that begins with `# NAME.toml` is that file, ```python is run, in a ```console block each
line after `$` is a command and the lines after it are what it says (`...` for anything; numbers with an exponent may differ,
since they are round-off). Blocks of other languages are only shown.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

import pytest
from support.folders import DOCS
from support.processes import child_environment

from warmslip import _core
from warmslip.cli import main
from warmslip.model import discretisation
from warmslip.simulation import signals

PAGES = [page for page in sorted(DOCS.rglob("*.md")) if "```" in page.read_text()]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)
STOPPED = (
    "data_not_finite:",
    "supports_contradict:",
    "support_inside_foundation:",
    *(f"{name}:" for name in _core.Outcome.__members__ if name != "completed"),
)
OWN_PROCESS = ("--petsc", "--log", "|", ">")


def said_by(command: str, folder: Path) -> tuple[str, int]:
    """What a command says, and its exit code; `warmslip` in this process, as it starts slowly."""
    words = shlex.split(command)
    if words[0] != "warmslip" or any(word.startswith(OWN_PROCESS) for word in words):
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["bash", "-c", command],
            cwd=folder,
            env=child_environment() | {"PATH": path, "COLUMNS": "200"},
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
            timeout=300,
        )
        return done.stdout, done.returncode
    output = io.StringIO()
    with (
        patch.object(sys, "argv", shlex.split(command)),
        contextlib.chdir(folder),
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(output),
    ):
        try:
            main.main()
        except SystemExit as end:
            return output.getvalue(), int(end.code or 0)
    return output.getvalue(), 0


def plain(text: str) -> str:
    """Blanks are one blank, round-off and the digits that it leaves are `#`."""
    text = re.sub(r"\b\d(\.\d+)?e[-+]\d+", "#", " ".join(text.split()))
    return re.sub(r"\b(u|theta|stress|contact force) \d+(?=[,)])", r"\1 #", text)


def commands(block: str) -> list[tuple[str, list[str]]]:
    found: list[tuple[str, list[str]]] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif line.strip():
            found[-1][1].append(line)
    return found


def check(block: str, folder: Path) -> None:
    code = 0
    for command, expected in commands(block):
        output, code = (f"{code}\n", 0) if command == "echo $?" else said_by(command, folder)
        lines, at = [plain(line) for line in output.splitlines()], 0
        for line in (plain(one) for one in expected if one.strip() != "..."):
            pattern = re.compile(re.escape(line).replace(r"\.\.\.", ".*"))
            while at < len(lines) and not pattern.fullmatch(lines[at]):
                at += 1
            assert at < len(lines), f"$ {command}\ndoes not say: {line}\nit says:\n{output}"
        if command != "echo $?":
            fails = any(line.startswith(("error:", *STOPPED)) for line in expected)
            assert (code != 0) == fails, f"$ {command}\nends with {code} and says:\n{output}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_a_page_is_true(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "page"}
    for language, block in BLOCK.findall(page.read_text()):
        if language == "toml" and (name := re.match(r"(?:#:schema .*\n)?# (\w+\.toml)", block)):
            (tmp_path / name[1]).write_text(block)
        elif language == "python":
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(block, str(page), "exec"), names)
        elif language == "console":
            check(block, tmp_path)


def test_every_term_of_the_balances_is_explained() -> None:
    text = (DOCS / "reference" / "core.md").read_text()
    assert [term for term in _core.Balances.terms if f"`{term}`" not in text] == []


def test_every_outcome_is_explained() -> None:
    text = (DOCS / "messages.md").read_text()
    for name in (
        *_core.Outcome.__members__,
        "data_not_finite",
        "supports_contradict",
        "support_inside_foundation",
        "law_failed",
        "interrupted",
    ):
        assert f"`{name}`" in text, name


def test_outcomes_that_no_command_provokes(tmp_path: Path) -> None:
    """A contact solver without a method, and Ctrl-C in the first step: what is said then is what the page says."""
    ordinary = _core.ContactOptions

    def powerless() -> object:
        options = ordinary()
        options.newton_steps = options.fixed_point_steps = options.enumerate_points = 0
        return options

    page = plain((DOCS / "messages.md").read_text())
    command = "warmslip run paper_mixed --set mesh.n=8 --set time.steps=8"
    for where, name, stand_in, code in (
        (discretisation, "ContactOptions", powerless, 1),
        (signals.Interruption, "agreed", lambda *_: (True, False), 130),
    ):
        with patch.object(where, name, stand_in):
            output, ended = said_by(command, tmp_path)
        assert plain(output) in page
        assert ended == code
