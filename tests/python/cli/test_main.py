"""The command `warmslip`: exit codes, one line a problem, the files a run leaves."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from support.processes import Command

from warmslip.cli import main
from warmslip.scene.reader import load
from warmslip.studies import refinement_study

SMALL = ("--set", "mesh.n=4", "--set", "time.steps=2")


@pytest.mark.parametrize(
    ("arguments", "lines"),
    [
        (["paper_mixed", "--set", "contact.stifness=1"], ["contact.stifness: unknown key; did you mean 'stiffness'"]),
        (
            ["paper_mixed", "--set", "inertia.density=-1", "--set", "time.steps=nan"],
            ["time.steps", "inertia.density = -1"],
        ),
        (
            ["heat_slab", "--set", "elasticity.lame=[1.0,1.0]"],
            ["nothing holds the body"],
        ),
        (["nowhere.toml"], ["cannot read scene 'nowhere.toml'"]),
        (
            ["paper_mixed", *SMALL, "--set", "supports.displacement=['top','left']", "--set", "contact.part='flor'"],
            ["unknown boundary part", "a traction on it does nothing"],
        ),
        (["paper_mixed", "--backend", "magic"], ["--backend 'magic' is unknown"]),
        (
            ["paper_mixed", "--set", "contact.friction=0.3"],
            ["contact.friction is a table, not 0.3; its keys are coeff"],
        ),
    ],
    ids=["unknown key", "two problems", "unsupported", "missing file", "unknown part", "backend", "table"],
)
def test_refusals(command: Command, tmp_path: Path, arguments: list[str], lines: list[str]) -> None:
    result = command("run", *arguments, "--out", "run")
    message = result.stderr.strip().splitlines()
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr + result.stdout
    assert len(message) == len(lines)
    assert all(line.startswith("error: ") and words in line for line, words in zip(message, lines, strict=True))
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "paper_mixed", "mesh.n=16"], "a key of the scene needs --set; write --set mesh.n=16"),
        (["run", "paper_mixed", "mesh.n=4", "time.steps=2"], "write --set mesh.n=4 --set time.steps=2"),
        (["run", "paper_mixed", "again"], "'again' is too much for `warmslip run`; leave it out"),
        (["view", "run", "mesh.n=4", "--out", "a"], "'mesh.n=4' is too much for `warmslip view`"),
        (["run"], "missing argument 'scene'; see `warmslip run --help`"),
        (["view", "run"], "missing option '--out'; see `warmslip view --help`"),
        (["view", "run", "--out", "a", "--at", "soon"], "invalid value for '--at'"),
        (["run", "paper_mixed", "--sett", "a=1"], "no such option: --sett"),
        (["run", "paper_mixed", "--set"], "option '--set' requires an argument"),
        (["rum", "paper_mixed"], "no such command 'rum'; did you mean 'run'?"),
        (
            ["run", "paper_mixed", "--petsc", "log_view"],
            "'log_view' is neither an option nor the value of one; write -log_view",
        ),
        (["run", "paper_mixed", "--petsc", "-ksp_rtol 1e-3 log_view"], "write -log_view"),
    ],
)
def test_a_call_of_the_wrong_form_is_one_sentence(
    command: Command, tmp_path: Path, arguments: list[str], message: str
) -> None:
    result = command(*arguments)
    (line,) = result.stderr.splitlines()
    assert (result.returncode, result.stdout) == (2, "")
    assert line.startswith("error: ") and message in line
    assert list(tmp_path.iterdir()) == []


def test_help_is_help(command: Command) -> None:
    assert command("--help").returncode == command("run", "--help").returncode == 0
    alone = command()
    assert alone.returncode == 2 and "Usage" in alone.stdout + alone.stderr


def test_output_folder_that_is_a_file(command: Command, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    result = command("run", "paper_mixed", *SMALL, "--out", "taken")
    assert result.returncode == 2
    assert "Traceback" not in result.stderr
    assert "taken" in result.stderr


def test_run_leaves_summary_and_trajectory(command: Command, tmp_path: Path) -> None:
    result = command("run", "paper_mixed", *SMALL, "--set", "contact.friction.coefficient=0.1", "--out", "run")
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("completed: 2 steps")
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert summary["outcome"] == "completed"
    assert summary["stamp"]["scene"]["contact"]["friction"]["coefficient"] == 0.1
    assert (tmp_path / "run/trajectory.h5").stat().st_size > 0


def test_list_and_schema(command: Command) -> None:
    listed = command("list").stdout
    assert all(name in listed for name in ("paper_printed", "paper_consistent", "block_3d"))
    printed = json.loads(command("schema").stdout)
    assert printed == type(load("paper_mixed")).model_json_schema()


def test_a_study_is_refused_before_it_is_computed(command: Command, tmp_path: Path) -> None:
    """Sizes that measure nothing, and a place where nothing can be written."""
    result = command("study", "paper_mixed", "--levels", "16,32", "--reference", "32", "--out", "study.csv")
    assert result.returncode == 2
    assert "not finer" in result.stderr
    assert not (tmp_path / "study.csv").exists()
    (tmp_path / "taken").mkdir()
    result = command("study", "paper_mixed", "--levels", "2,4", "--reference", "8", "--out", "taken")
    assert result.returncode == 2
    assert "taken" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["rates", "table.csv", "--out", "rates.csv"], "is no table of `warmslip study` with its stamp"),
        (["draw", "errors", "table.csv", "--out", "a.png"], "'errors' is drawn from studies named"),
        (["draw", "errors", "mixed_0_staggered.csv", "--out", "a.png"], "will not do"),
        (["draw", "figure_9", "table.csv", "--out", "a.png"], "unknown figure 'figure_9'; give one of setting"),
    ],
)
def test_tables_of_another_kind_are_refused(command: Command, tmp_path: Path, arguments: list[str], words: str) -> None:
    (tmp_path / "table.csv").write_text("a,b\n1,2\n")
    (tmp_path / "table.json").write_text("{}")
    (tmp_path / "mixed_0_staggered.csv").write_bytes(b"\x89PNG")
    result = command(*arguments)
    assert result.returncode == 2
    assert words in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_a_study_of_ones_own(command: Command, tmp_path: Path) -> None:
    """Its steps keep steps_per_level with the scene, its errors can be drawn, and what is no study is named."""
    call = "study elastic_drop --levels 2,4 --reference 8 --steps-per-level 5 --out own.csv"
    done = command(*call.split())
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "own.csv").read_text().splitlines()))
    assert [(row["n"], row["steps"]) for row in rows] == [("2", "10"), ("4", "20"), ("8", "40")]
    drawn = command("draw", "study", "own.csv", "--out", "own.png")
    assert drawn.returncode == 0, drawn.stderr
    message = (tmp_path / "own.rst").read_text()
    first, last = (float(rows[i]["e_u_V"]) for i in (0, 1))
    assert f"u_V {first:.3g} to {last:.3g}" in " ".join(message.split()) and "theta" not in message
    refused = command("draw", "errors", "own.csv", "--out", "own.png")
    assert refused.returncode == 2 and "`warmslip draw study` draws any study" in refused.stderr
    nothing = command("rates", "nope.csv", "--out", "rates.csv")
    assert nothing.returncode == 2 and "'nope.csv' is no table of `warmslip study`" in nothing.stderr
    slow = command(*call.replace("--steps-per-level 5", "--steps-per-level 0").split())
    assert slow.returncode == 2 and "--steps-per-level 0 is no number of steps" in slow.stderr


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("initial.from=none.h5", "initial.from: 'none.h5' is no file; give the trajectory.h5 of a run"),
        ("supports.points=[{at=[5,5]}]", "supports.points.0: the nearest node of (5, 5) is"),
    ],
)
def test_a_dry_run_refuses_what_a_run_refuses(command: Command, key: str, words: str) -> None:
    for how in ((), ("--dry-run",)):
        done = command("run", "paper_mixed", "--set", "mesh.n=4", "--set", key, *how)
        assert done.returncode == 2 and words in done.stderr


def test_what_is_odd_is_said_before_a_run(command: Command) -> None:
    small = [word for key in ("mesh.n=4", "time.steps=2") for word in ("--set", key)]
    done = command("run", "paper_mixed", *small, "--set", "contact.gap=-0.01")
    assert done.returncode == 0 and "note: the gap of 'bottom' is negative" in done.stderr
    dry = command("run", "two_materials", "--dry-run", "--set", "regions.insert.where=x > 9")
    assert dry.returncode == 2 and "no cell lies in it" in dry.stderr


def test_an_interrupted_command_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(refinement_study, "study", interrupted)
    monkeypatch.setattr("sys.argv", ["warmslip", "study", "paper_mixed", "--out", str(tmp_path / "s.csv")])
    with pytest.raises(SystemExit) as end:
        main.main()
    assert end.value.code == 130 and "interrupted; files that were written are kept" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
