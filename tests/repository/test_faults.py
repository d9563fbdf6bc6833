"""The seeded faults still fit the code: each text stands once, and what replaces it is still Python."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

from support.folders import TESTS

sys.path.insert(0, str(TESTS / "mutants"))

import run


def test_every_fault_applies() -> None:
    faults = run.faults()  # raises when a text does not stand exactly once
    assert len(faults) >= 80
    for fault in faults:
        assert fault.old != fault.new
        assert fault.what
        source = (run.ROOT / fault.file).read_text().replace(fault.old, fault.new)
        if fault.file.endswith(".py"):
            ast.parse(source)


def test_earlier_killers_run_first(tmp_path: Path) -> None:
    fault, *_ = run.faults()
    by = "core/test_rates.py::test_case[a-1]; ctest: something; python/io/test_plot.py::test_x"
    run.write(tmp_path / "table.csv", {}, {fault.name: by})  # untried with its present text
    assert run.read(tmp_path / "table.csv") == {}
    assert run.files_in(run.killers(tmp_path / "table.csv")[fault.name]) == [
        "tests/core/test_rates.py",
        "tests/python/io/test_plot.py",
    ]
