"""Fixtures of all tests: the installed command, and the paper's problem on few cells."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.processes import Command, child_environment

import warmslip


@pytest.fixture(name="command")
def _command(tmp_path: Path) -> Command:
    """Runs the installed command `warmslip` in an empty folder, on `ranks` processes."""
    program = str(Path(sys.executable).parent / "warmslip")

    def call(*arguments: object, ranks: int = 1) -> subprocess.CompletedProcess[str]:
        start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
        return subprocess.run(
            [*start, program, *map(str, arguments)],
            cwd=tmp_path,
            env=child_environment(),
            text=True,
            capture_output=True,
            check=False,
            timeout=300,
        )

    return call


@pytest.fixture(name="small")
def _small() -> Callable[..., warmslip.Scene]:
    """The paper's problem on few cells; keywords with `__` for dots override keys."""

    def make(reading: str = "mixed", **keys: Any) -> warmslip.Scene:
        values = {"mesh.n": 4, "time.steps": 4} | {k.replace("__", "."): v for k, v in keys.items()}
        return warmslip.load(f"paper_{reading}").override(**values)

    return make
