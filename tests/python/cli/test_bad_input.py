"""What editors, disks and other users do to files: it works, or it is said in one sentence with exit code 2."""

from __future__ import annotations

import codecs
import os
import subprocess
import sys
from importlib import resources
from pathlib import Path

import pytest
from support.processes import Command, child_environment

import warmslip
from warmslip.records import tables

PLATE = resources.files("warmslip") / "scenes" / "plate_with_hole.toml"
MESH = resources.files("warmslip") / "scenes" / "plate_with_hole.msh"
TEXT = PLATE.read_text(encoding="utf-8").replace("A plate", "Eine schöne Platte θ:")


def written(folder: Path, data: bytes) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "plate_with_hole.msh").write_bytes(MESH.read_bytes())
    (folder / "eine Platte ü.toml").write_bytes(data)
    return folder / "eine Platte ü.toml"


@pytest.mark.parametrize(
    "data", [codecs.BOM_UTF8 + TEXT.encode(), TEXT.replace("\n", "\r\n").encode()], ids=["byte-order mark", "line ends"]
)
def test_files_of_other_editors_are_read(data: bytes, tmp_path: Path) -> None:
    plain = warmslip.load(written(tmp_path / "one", TEXT.encode()))
    other = warmslip.load(written(tmp_path / "other ö", data))
    assert other.title == plain.title and other.title.startswith("Eine schöne")
    assert other.override(**{"mesh.file": plain.mesh.file}) == plain


@pytest.mark.parametrize("code", ["latin-1", "utf-16"])
def test_a_scene_in_another_encoding_is_refused(code: str, tmp_path: Path) -> None:
    path = written(tmp_path, TEXT.replace("θ", "").encode(code))
    with pytest.raises(warmslip.SceneError, match=r"not a text file in UTF-8\); save it in that encoding"):
        warmslip.load(path)


def test_a_folder_is_no_scene(tmp_path: Path) -> None:
    with pytest.raises(warmslip.SceneError, match=r"\(Is a directory\); give a TOML file"):
        warmslip.load(tmp_path)


def test_titles_and_names_in_any_language_and_locale(tmp_path: Path) -> None:
    """A run and its page in the plain locale of a batch job."""
    path = written(tmp_path / "mit Leerzeichen", TEXT.encode())
    locale = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    program = str(Path(sys.executable).parent / "warmslip")
    for arguments in (
        ["run", str(path), "--set", "time.steps=1", "--out", str(tmp_path / "aus gabe ß")],
        ["view", str(tmp_path / "aus gabe ß"), "--out", str(tmp_path / "sicht"), "--no-animate"],
        ["export", str(tmp_path / "aus gabe ß"), "--out", str(tmp_path / "reihe ö")],
    ):
        done = subprocess.run(
            [program, *arguments], env=child_environment() | locale, capture_output=True, check=False, timeout=300
        )
        assert done.returncode == 0, done.stderr.decode()
    assert "schöne Platte θ" in (tmp_path / "sicht" / "report.html").read_text(encoding="utf-8")


def test_a_table_that_a_spreadsheet_saved_is_read(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_bytes(codecs.BOM_UTF8 + b"n,error\r\n16,0.5\r\n")
    assert tables.read(tmp_path / "table.csv") == [{"n": 16, "error": 0.5}]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["draw", "work", "empty.csv", "--out", "x.png"], "there are too few rows"),
        (["draw", "work", "other.csv", "--out", "x.png"], "there is no column 'case'"),
        (["draw", "stick_slip", "nothing", "--out", "x.png"], "error: 'nothing' is no file; give the trajectory.h5"),
        (["draw", "work", "other.csv", "--out", "/dev/null/x/y.png"], "there is no column"),
        (
            ["report", "other.csv", "--out", "x.md"],
            "error: other.csv: not tables of checks that `warmslip verify` wrote",
        ),
        (["run", "paper_mixed", "--out", "other.csv"], "cannot read or write a file (other.csv): File exists"),
        (["trade", "heat", "--out", "other.csv/x.csv"], "check the path and its rights"),
    ],
)
def test_one_sentence_and_exit_code_2(arguments: list[str], words: str, command: Command, tmp_path: Path) -> None:
    (tmp_path / "empty.csv").touch()
    (tmp_path / "other.csv").write_text("a\n1\n")
    (tmp_path / "other.json").write_text("{}")
    done = command(*arguments)
    assert (done.returncode, done.stderr.count("error:"), done.stderr.count("\n")) == (2, 1, 1), done.stderr
    assert words in done.stderr


def unread(words: list[str | Path], folder: Path) -> subprocess.CompletedProcess[str]:
    """A program that writes into a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(words, stdout=writing, stderr=subprocess.PIPE, cwd=folder, env=child_environment(), text=True)
    os.close(writing)
    return done


@pytest.mark.parametrize("words", ["list", "explain paper_mixed", "run heat_slab --set time.steps=2 --out run"])
def test_a_reader_that_has_seen_enough_ends_a_command(words: str, tmp_path: Path) -> None:
    """No traceback, no banner, exit code 1, and the files of a run."""
    done = unread([Path(sys.executable).parent / "warmslip", *words.split()], tmp_path)
    assert (done.returncode, done.stderr) == (1, "")
    assert (tmp_path / "run/summary.json").exists() == words.startswith("run")


def test_a_program_whose_output_nobody_reads_gets_the_error_of_python(tmp_path: Path) -> None:
    run = (
        "import warmslip\nwarmslip.run(warmslip.load('heat_slab').override(**{'time.steps': 1}))\nprint(1, flush=True)"
    )
    done = unread([sys.executable, "-c", run], tmp_path)
    assert "BrokenPipeError" in done.stderr and "PETSC" not in done.stderr


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="a folder in which nobody can make files")
def test_a_folder_in_which_nothing_can_be_made(command: Command) -> None:
    for words in (
        "run heat_slab --set time.steps=1 --out /proc/run",
        "run heat_slab --set time.steps=1 --out /proc/self",
    ):
        done = command(*words.split())
        assert done.returncode == 2 and done.stderr.count("error:") == 1 and "/proc/" in done.stderr
        assert "Traceback" not in done.stderr


def test_meshes_of_other_kinds_and_with_a_byte_order_mark(tmp_path: Path) -> None:
    scene = warmslip.load("plate_with_hole")
    for suffix in (".vtk", ".stl"):
        (tmp_path / f"body{suffix}").write_bytes(b"# vtk DataFile Version 2.0")
        with pytest.raises(ValueError, match=rf"files of the kind \{suffix} are not read; save it as .msh, .vtu, .inp"):
            scene.override(**{"mesh.file": str(tmp_path / f"body{suffix}")})
    (tmp_path / "marked.msh").write_bytes(codecs.BOM_UTF8 + MESH.read_bytes())
    marked = warmslip.discretise(scene.override(**{"mesh.file": str(tmp_path / "marked.msh")}))
    assert len(marked.mesh.nodes) == len(warmslip.discretise(scene).mesh.nodes)


def test_figures_are_png_files() -> None:
    from matplotlib.figure import Figure

    from warmslip.figures import style

    with pytest.raises(ValueError, match=r"give a name that ends in \.png in place of 'full'"):
        style.save(Figure(), "", Path("/dev/full"))


def test_a_full_disk_does_not_speak_of_checkpoints_where_there_are_none() -> None:
    done = subprocess.run(
        ["bash", "-c", f"{Path(sys.executable).parent / 'warmslip'} schema > /dev/full"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr == "error: the disk is full; make room and give the command again\n"


def test_a_checkout_of_another_user_is_used_as_it_was_compiled() -> None:
    """Its build folder cannot be written, and nothing is compiled at import."""
    code = (
        "import os, sys; real = os.access\n"
        "os.access = lambda path, mode, **more: mode != os.W_OK and real(path, mode, **more)\n"
        "import warmslip; from warmslip import _core\n"
        "print([finder.rebuild_flag for finder in sys.meta_path if hasattr(finder, 'rebuild_flag')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "True" not in done.stdout


def test_a_cache_that_cannot_be_written_is_no_matter(tmp_path: Path) -> None:
    done = subprocess.run(
        [str(Path(sys.executable).parent / "warmslip"), "draw", "table", "nothing.csv", "--out", "x.png"],
        cwd=tmp_path,
        env=os.environ | {"MPLCONFIGDIR": "/dev/null/cache", "HOME": "/dev/null"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2 and "MPLCONFIGDIR" not in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.mpi
def test_what_all_ranks_refuse_is_said_once(tmp_path: Path) -> None:
    call = [
        "mpirun",
        "-n",
        "2",
        sys.executable,
        "-m",
        "warmslip.cli.main",
        "run",
        "paper_mixed",
        "--backend",
        "cholmod",
    ]
    done = subprocess.run(
        [*call, "--set", "mesh.n=4", "--out", str(tmp_path)],
        env=child_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.count("error: the CHOLMOD backend needs one rank") == 1
    assert "MPI_ABORT" not in done.stderr
