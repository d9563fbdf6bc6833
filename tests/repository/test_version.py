"""The version stands in CMakeLists.txt; what repeats it agrees."""

from __future__ import annotations

import re
from importlib import metadata

import yaml
from support.folders import ROOT
from support.processes import Command

import warmslip

VERSION = re.findall(r"^project\(\w+ VERSION ([0-9.]+) ", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[0]


def test_the_package_and_the_citation_agree() -> None:
    assert metadata.version("warmslip") == warmslip.__version__ == VERSION
    assert re.findall(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE) == [VERSION]


def test_the_changelog_ends_its_news_with_it() -> None:
    headings = re.findall(r"^## \[(.*)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert headings[:2] == ["Unreleased", VERSION]


def test_the_recipe_for_conda_repeats_it() -> None:
    assert yaml.safe_load((ROOT / "conda" / "recipe.yaml").read_text())["context"]["version"] == VERSION


def test_the_command_prints_it(command: Command) -> None:
    result = command("--version")
    assert (result.returncode, result.stdout) == (0, f"warmslip {VERSION}\n"), result.stderr
