"""The examples of the site run as scripts, with assertions for what they state; every page is in a table of contents."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.folders import DOCS
from support.processes import child_environment

EXAMPLES = sorted((DOCS / "examples").glob("*.py"))


def test_there_are_examples() -> None:
    names = {path.stem for path in EXAMPLES}
    assert {"the_papers_problem", "a_scene_of_your_own", "writing_a_contact_law", "comparing_readings"} <= names
    assert {"a_quarter_of_a_block", "a_belt_and_what_follows"} <= names


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(example: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(example)],
        cwd=tmp_path,
        env=child_environment() | {"MPLBACKEND": "Agg"},
        text=True,
        capture_output=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_claims_what_it_checks(example: Path) -> None:
    text = example.read_text()
    assert text.startswith("# %% [markdown]\n# # ")
    assert len(re.findall(r"^ *assert ", text, re.MULTILINE)) >= 4
    assert 60 <= len(text.splitlines()) <= 130


def test_every_page_is_in_a_table_of_contents() -> None:
    listed: set[Path] = {DOCS / "index"}
    for page in DOCS.rglob("*.md"):
        for block in re.findall(r"```\{toctree\}\n(.*?)```", page.read_text(), re.DOTALL):
            for line in block.splitlines():
                if line.strip() and not line.startswith(":"):
                    listed.add((page.parent / line.strip().removeprefix("/")).resolve())
    there = {path.with_suffix("").resolve() for path in (*DOCS.rglob("*.md"), *EXAMPLES)}
    assert there == {path.resolve() for path in listed}
