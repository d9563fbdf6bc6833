"""Whole scenes with floating-point traps around every step: nothing is divided by zero, overflows or becomes a nan."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from support.processes import child_environment

TRAPPED = """
import ctypes
import sys
import warmslip

libm = ctypes.CDLL("libm.so.6")
TRAPS = 1 | 4 | 8  # invalid, division by zero, overflow on x86-64


class Trapped:
    def __init__(self, stepper):
        self.stepper = stepper

    def __getattr__(self, name):
        return getattr(self.stepper, name)

    def advance(self, *loads, **options):
        libm.feclearexcept(TRAPS)
        libm.feenableexcept(TRAPS)
        report = self.stepper.advance(*loads, **options)
        libm.fedisableexcept(TRAPS)
        return report


for line in sys.argv[1:]:
    name, *overrides = line.split()
    job = warmslip.Simulation(warmslip.load(name, overrides))
    job.stepper = Trapped(job.stepper)
    taken = sum(1 for _ in job.steps())
    print(f"{name}: {job.outcome} {taken}", flush=True)
"""

PLANE = "paper_mixed mesh.n=4 time.steps=4"
SCENES = [
    PLANE,
    f"{PLANE} time.coupling=monolithic",
    f"{PLANE} time.coupling=lagged contact.quadrature=gauss-2",
    f"{PLANE} contact.stiffness=rigid",
    "block_3d mesh.n=2 time.steps=3",
    "block_3d mesh.n=2 time.steps=3 contact.stiffness=rigid",
    "block_3d mesh.n=2 time.steps=3 contact.quadrature=gauss-2",
    "heat_slab time.steps=4",
    "brake_pad time.steps=3",
    "elastic_drop time.steps=5",
    "creep_column time.steps=4",
    "quasistatic_punch time.steps=4",
]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the traps are those of glibc")
@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 2])
def test_no_step_divides_by_zero_overflows_or_makes_a_nan(tmp_path: Path, ranks: int) -> None:
    (tmp_path / "trapped.py").write_text(TRAPPED)
    start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    result = subprocess.run(
        [*start, sys.executable, str(tmp_path / "trapped.py"), *SCENES],
        env=child_environment(),
        text=True,
        capture_output=True,
        check=False,
        timeout=300,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.count(": completed") == ranks * len(SCENES)
