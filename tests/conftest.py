"""What all tests share: the independent SciPy scheme, small scenes, and processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import warmslip

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # `from reference import scipy_scheme`

Command = Callable[..., subprocess.CompletedProcess[str]]


def child_environment() -> dict[str, str]:
    """This process's environment without the marks its own MPI left in it, so that children start MPI afresh."""
    marks = ("OMPI_COMM_", "OMPI_UNIVERSE", "OMPI_FILE_", "OMPI_NUM_", "OMPI_FIRST_", "PMIX_", "PRTE_LAUNCHED", "PMI_")
    own = {k: v for k, v in os.environ.items() if not k.startswith(marks)}
    settings = {
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "OMPI_MCA_mpi_yield_when_idle": "1",
        "OMPI_MCA_ess_singleton_isolated": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    }
    return settings | own


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
