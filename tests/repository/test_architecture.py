"""The layout: no circle of imports, few levels, and a map that names every folder."""

from __future__ import annotations

import re
import tomllib
from graphlib import TopologicalSorter

import grimp
import pytest
from support.folders import ROOT

PYTHON, CPP = ROOT / "python" / "warmslip", ROOT / "cpp" / "warmslip"
MAP = (ROOT / "ARCHITECTURE.md").read_text()


@pytest.fixture(name="graph", scope="module")
def _graph() -> dict[str, set[str]]:
    """What each module imports, at run time and for type checking; the facade is left out."""
    graph = grimp.build_graph("warmslip", cache_dir=None)
    modules = graph.modules - {"warmslip"}
    return {module: graph.find_modules_directly_imported_by(module) & modules for module in modules}


def test_no_circle_of_modules(graph: dict[str, set[str]]) -> None:
    assert len(graph) > 100
    tuple(TopologicalSorter(graph).static_order())  # raises CycleError


def test_nothing_imports_the_facade() -> None:
    imported = re.compile(r"^\s*(import warmslip(?! as)\b(?!\.)|from warmslip import )", re.MULTILINE)
    for path in PYTHON.rglob("*.py"):
        assert path == PYTHON / "__init__.py" or not imported.search(path.read_text()), path


def test_one_contract_of_at_most_ten_levels() -> None:
    (contract,) = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    assert len(contract["layers"]) <= 10 and contract["exhaustive"]


def test_headers_run_downwards() -> None:
    """A C++ module includes itself and those above it in the map; the kernels see neither PETSc nor MPI."""
    order = re.findall(r"^\| `cpp/warmslip/(\w+)`", MAP, re.MULTILINE)
    assert sorted(order) == sorted(p.name for p in CPP.iterdir())
    for path in (p for p in CPP.rglob("*.?pp")):
        text, module = path.read_text(), path.parent.name
        for other in re.findall(r'#include "warmslip/(\w+)/', text):
            assert order.index(other) <= order.index(module), f"{path.name} includes {other}"
        if module in ("mesh", "physics", "contact"):
            assert not re.search(r"#include [<\"](petsc|mpi)", text), path


def test_the_map_names_every_package() -> None:
    named = set(re.findall(r"`warmslip\.(\w+)`", MAP[MAP.index("| Python package") :].split("\n\n")[0]))
    there = {p.name for p in PYTHON.iterdir() if (p / "__init__.py").exists()}
    there |= {p.stem for p in PYTHON.glob("*.py")} - {"__init__"}
    assert named == there
