"""The workflow: what it plans for both configurations, what it refuses, and the small grid from end to end."""

from __future__ import annotations

import csv
import os
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from support.folders import ROOT

from warmslip.studies import block_cost

CI = "workflows/config/ci.yaml"
PAPER = "workflows/config/paper.yaml"
READINGS = ("printed", "mixed", "isotropic", "consistent")

Snakemake = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(name="snakemake")
def _snakemake(tmp_path: Path) -> Snakemake:
    """Runs snakemake on the project's Snakefile in a directory of its own, where nothing has been computed yet."""
    for name in ("Snakefile", "workflows", "profiles", "python", ".venv"):
        (tmp_path / name).symlink_to(ROOT / name)
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_COMM", "PMIX_"))}

    def call(*arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
        command = ["bash", "-c", '. workflows/env.sh && exec snakemake "$@"', "-", *arguments]
        return subprocess.run(
            command, cwd=tmp_path, env=environment | more, text=True, capture_output=True, check=False
        )

    return call


def plan(result: subprocess.CompletedProcess[str]) -> dict[str, int]:
    """Jobs by rule of a dry run; empty when there is nothing to do."""
    assert result.returncode == 0, result.stdout + result.stderr
    table = result.stdout.partition("Job stats:")[2].partition("total")[0]
    return {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", table, re.MULTILINE)}


def test_paper_plans_every_case(snakemake: Snakemake) -> None:
    jobs = plan(snakemake("--dry-run", "--quiet", "rules"))  # the paper is the default
    assert jobs["study"] == len(READINGS) * 2 * 3 + 1
    assert jobs["run"] == len(READINGS) * 2
    assert all(jobs[f"figure_{n}"] == len(READINGS) for n in (2, 3, 4, 5))
    assert all(
        jobs[name] == 1 for name in ("figure_1", "verdict", "page", "judged", "rates", "readings", "work", "extremes")
    )


def test_fresh_clone_makes_all_of_it_anew(snakemake: Snakemake, tmp_path: Path) -> None:
    """What is committed under results/ is no reason to leave a job out: its runs are not there."""
    committed = subprocess.run(["git", "ls-files", "results"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in committed.stdout.split():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    jobs = plan(snakemake("--dry-run", "--quiet", "rules"))
    assert jobs == plan(snakemake("--dry-run", "--quiet", "rules", "--forceall"))
    assert jobs["run"] == len(READINGS) * 2
    assert jobs["figure_1"] == 1


def test_small_grid_plans_every_case(snakemake: Snakemake) -> None:
    jobs = plan(snakemake("--dry-run", "--quiet", "rules", "--configfile", CI))
    assert jobs["study"] == len(READINGS) * 2 * 2 + 1
    assert jobs["figure_5"] == jobs["orders"] == jobs["grid"] == len(READINGS)


def test_levels_reach_the_studies(snakemake: Snakemake) -> None:
    shown = snakemake("--dry-run", "--printshellcmds", "results/runs/paper/studies/isotropic_10_staggered_gauss-2.csv")
    assert shown.returncode == 0, shown.stderr
    command = next(line for line in shown.stdout.splitlines() if "warmslip study" in line)
    assert "paper_isotropic" in command
    assert "contact.quadrature=gauss-2" in command
    assert "foundation_temperature=10" in command
    assert "--levels 16,32,64,128 --reference 256 --grid diagonal" in command


@pytest.mark.parametrize(
    ("change", "word"),
    [({"colour": "blue"}, "colour"), ({"levels": [16, "many"]}, "many"), ({"readings": ["guessed"]}, "guessed")],
)
def test_schema_refuses(snakemake: Snakemake, tmp_path: Path, change: dict[str, object], word: str) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(yaml.safe_dump(yaml.safe_load((ROOT / PAPER).read_text()) | change))
    result = snakemake("--dry-run", "--configfile", str(config))
    assert result.returncode != 0
    assert word in result.stdout + result.stderr


@pytest.mark.slow
def test_small_grid_end_to_end(snakemake: Snakemake, tmp_path: Path) -> None:
    """From nothing to verdict and report; then nothing is left to do; a deleted figure comes back alone, a changed core
    solves anew."""
    small = ("--configfile", CI)
    first = snakemake(*small)
    assert first.returncode == 0, first.stdout + first.stderr
    paper = tmp_path / "results/runs/ci/paper"
    for name in (
        "verdict.json",
        "rates.csv",
        "readings.csv",
        "manufactured.csv",
        "figures/figure_1.png",
        "report.html",
    ):
        assert (paper / name).stat().st_size > 0
    pictures = sorted((tmp_path / "results/runs/ci").rglob("*.png"))
    assert len(pictures) == 1 + 6 * len(READINGS) + 3
    assert all(picture.stat().st_size < 2**20 for picture in pictures)
    assert all(picture.with_suffix(".rst").read_text().strip() for picture in pictures)

    assert plan(snakemake("--dry-run", "--quiet", "rules", *small)) == {}

    (paper / "figures/figure_5_printed.png").unlink()
    assert plan(snakemake("--dry-run", "--quiet", "rules", *small)) == {"figure_5": 1, "page": 1, "all": 1}
    assert snakemake(*small).returncode == 0

    (tmp_path / "other").mkdir()
    (tmp_path / "other/sitecustomize.py").write_text(
        "import warmslip.records.provenance as provenance\nprovenance.fingerprint = lambda: 'another core'\n"
    )
    other = plan(snakemake("--dry-run", "--quiet", "rules", *small, PYTHONPATH=str(tmp_path / "other")))
    everything = plan(snakemake("--dry-run", "--quiet", "rules", "--forceall", *small))
    solves = ("study", "run", "manufactured", "extremes", "blocks")
    assert {rule: other.get(rule) for rule in solves} == {rule: everything[rule] for rule in solves}

    report = snakemake("--report", "report.html", *small)
    assert report.returncode == 0, report.stderr
    assert (tmp_path / "report.html").stat().st_size > 2**20


def test_committed_costs_are_of_every_combination() -> None:
    """And their counts are those of the blocks that are there."""
    chosen = list(block_cost.combinations())
    with (ROOT / "results/tradeoff/blocks.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [{key: row[key] for key in chosen[0]} for row in rows] == chosen
    for row in rows:
        assert float(row["substitutions"]) == (row["motion"] != "none") + (row["heat"] != "none")
