"""Checks that take the dimension, run by pytest on one rank and as a program on several."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from support.processes import child_environment

Check = Callable[[int], None]


class Checks:
    """A registry and its decorator."""

    def __init__(self) -> None:
        self._checks: dict[str, Check] = {}

    def __call__(self, function: Check) -> Check:
        self._checks[function.__name__] = function
        return function

    @property
    def names(self) -> list[str]:
        return list(self._checks)

    def run(self, name: str, d: int) -> None:
        self._checks[name](d)

    def main(self) -> None:
        """All of them, for the dimension that the command line gives."""
        for name in self.names:
            self.run(name, int(sys.argv[1]))
        print(self.verdict, flush=True)

    def tests(self, file: str) -> tuple[Any, Any]:
        """Two functions for pytest: every check on one rank, and all of them together, the program `file`, on two."""

        @pytest.mark.parametrize("d", [2, 3])
        @pytest.mark.parametrize("name", self.names)
        def on_one(name: str, d: int) -> None:
            self.run(name, d)

        @pytest.mark.mpi
        @pytest.mark.parametrize("d", [2, 3])
        def on_two(d: int) -> None:
            on_two_ranks(file, d, self)

        return on_one, on_two

    @property
    def verdict(self) -> str:
        return f"{len(self._checks)} checks hold"


def on_two_ranks(file: str, d: int, checks: Checks) -> None:
    """Runs the program `file`, whose `main` is that of `checks`, on two ranks."""
    result = subprocess.run(
        ["mpirun", "-n", "2", sys.executable, str(Path(file).resolve()), str(d)],
        env=child_environment(),
        text=True,
        capture_output=True,
        timeout=300,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.count(checks.verdict) == 2
