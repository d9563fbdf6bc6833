"""Packaging files that repeat what pyproject.toml and workflows/setup.sh say."""

from __future__ import annotations

import re
import tomllib
from typing import Any

import yaml
from support.folders import ROOT

PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
RECIPE: dict[str, Any] = yaml.safe_load((ROOT / "conda" / "recipe.yaml").read_text())
CONDA_NAMES = {"matplotlib-base": "matplotlib"}  # without Qt


def requirements(lines: list[str]) -> set[str]:
    """As PyPI writes them: no blanks, no build of a package."""
    found = set()
    for line in lines:
        name, _, bound = line.removesuffix(" * real_*").partition(" ")
        found.add(CONDA_NAMES.get(name, name) + bound)
    return found


def test_the_recipe_has_what_rattler_build_asks_for() -> None:
    assert {"package", "source", "build", "requirements", "tests", "about"} <= RECIPE.keys()
    assert RECIPE["package"] == {"name": PYPROJECT["project"]["name"], "version": "${{ version }}"}
    assert (ROOT / "conda" / RECIPE["source"]["path"]).resolve() == ROOT
    assert RECIPE["about"]["license"] == PYPROJECT["project"]["license"]


def test_the_recipe_needs_what_the_package_needs() -> None:
    needs, project = RECIPE["requirements"], PYPROJECT["project"]
    python = f"python{project['requires-python']}"
    assert requirements(needs["run"]) == {python, *project["dependencies"]}
    assert set(PYPROJECT["build-system"]["requires"]) <= requirements(needs["host"])
    assert f"cmake{PYPROJECT['tool']['scikit-build']['cmake']['version']}" in requirements(needs["build"])
    assert {"eigen>=3.4", "petsc>=3.18 real_*", "suitesparse", "mpi4py"} <= requirements(needs["host"])


def test_read_the_docs_installs_the_packages_of_the_set_up() -> None:
    (system,) = re.findall(
        r"^system=\((.*?)\)", (ROOT / "workflows" / "setup.sh").read_text(), re.MULTILINE | re.DOTALL
    )
    site = yaml.safe_load((ROOT / ".readthedocs.yaml").read_text())
    assert sorted(site["build"]["apt_packages"]) == sorted(
        [*system.split(), "doxygen"]
    )  # which workflows/docs.sh installs
