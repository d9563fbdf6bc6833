"""The scenes of the library: each runs from its file and from Python, in studies and on two ranks to the same numbers."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from support.folders import DOCS
from support.processes import Command

import warmslip
from warmslip.scene.reader import library
from warmslip.studies import refinement_study

# one number of each, regression: norm of the last state, or what its file states
PINNED = {
    "heat_slab": ("theta_L2", 4.590521916),
    "quasistatic_punch": ("u_V", 0.0128852955),
    "elastic_drop": ("w_L2", 0.9097956351),
    "sliding_block": ("theta_L2", 0.1813131821),
    "brake_pad": ("theta_L2", 1.026810617),
    "two_materials": ("u_V", 0.06233801862),
    "plate_with_hole": ("theta_L2", 2.363267372),
    "block_with_hole": ("u_V", 0.088526593),
    "creep_column": ("u_L2", 0.3169927902),
    "hertz": ("u_V", 0.1941622024),
    "belt": ("w_L2", 0.2826249710),
    "drum": ("theta_L2", 1.664430192),
    "quarter_sphere": ("u_V", 0.01781753075),
    "wavy_road": ("w_L2", 0.00477215511),
}
LARGE = {"paper_printed", "paper_mixed", "paper_isotropic", "paper_consistent", "block_3d"}  # the studies run them


def test_every_scene_has_its_number() -> None:
    assert set(library()) == set(PINNED) | LARGE


def test_first_steps_lists_what_the_command_lists(command: Command) -> None:
    page = (DOCS / "tutorial.md").read_text()
    display = page.partition("$ warmslip list\n")[2].partition("$ ")[0]
    assert display == command("list").stdout


@pytest.mark.parametrize("name", PINNED)
def test_a_scene_from_its_file_and_from_python(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path(str(resources.files("warmslip") / "scenes"))
    result = warmslip.run(warmslip.load(name))
    assert result.outcome == "completed"
    norm, value = PINNED[name]
    assert result.summary["norms"][norm] == pytest.approx(value, rel=2e-9)
    for file in (*folder.glob("*.msh"), folder / f"{name}.toml"):  # elsewhere, the mesh beside it
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path.parent)
    again = warmslip.run(warmslip.load(tmp_path / f"{name}.toml"))
    assert again.summary["norms"] == result.summary["norms"]


@pytest.mark.parametrize("name", ["quasistatic_punch", "heat_slab", "two_materials", "sliding_block"])
def test_a_study_of_a_scene_without_some_blocks(name: str, tmp_path: Path) -> None:
    """Its errors fall, those of absent fields are 0, and the axes keep their ratio."""
    levels, reference = ([8, 16], 32) if name == "heat_slab" else ([4, 8], 16)
    scene = warmslip.load(name).override(**{"time.end": 0.25})
    rows = refinement_study.study(scene, levels=levels, reference=reference)
    assert (rows[0]["e_u_V"] > rows[1]["e_u_V"] > 0) == scene.moves
    assert (rows[0]["e_theta_L2"] > rows[1]["e_theta_L2"] > 0) == (scene.heat is not None)
    counts = scene.mesh.counts
    assert rows[0]["unknowns"] == (2 * scene.moves + (scene.heat is not None)) * (levels[0] + 1) * (
        levels[0] * counts[1] // counts[0] + 1
    )


def test_a_moving_support_has_the_velocity_of_every_step_size() -> None:
    """Members of a study share their data; each has its own step."""
    scene = warmslip.load("quasistatic_punch").override(**{"mesh.n": 4, "time.steps": 8})
    alone = warmslip.run(scene.override(**{"time.steps": 4})).u
    shared = warmslip.discretise(scene)
    run = warmslip.Simulation(
        scene.override(**{"time.steps": 4}),
        discretisation=replace(shared, scene=scene.override(**{"time.steps": 4})),
    )
    assert len(list(run.steps())) == 4
    assert np.abs(shared.field(run.stepper.u) - alone).max() <= 1e-15


@pytest.mark.parametrize(("name", "words"), [("plate_with_hole", "no power of two"), ("brake_pad", "are not nested")])
def test_what_cannot_be_refined_is_said(name: str, words: str) -> None:
    with pytest.raises(warmslip.SceneError, match=words):
        refinement_study.study(warmslip.load(name), levels=[3, 6], reference=12)


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["plate_with_hole", "block_with_hole", "brake_pad", "heat_slab"])
def test_two_ranks_give_the_answer_of_one(command: Command, tmp_path: Path, name: str) -> None:
    summaries = []
    for ranks in (1, 2):
        result = command("run", name, "--out", f"run{ranks}", ranks=ranks)
        assert result.returncode == 0, result.stderr
        summaries.append(json.loads((tmp_path / f"run{ranks}/summary.json").read_text()))
    assert summaries[1]["norms"] == pytest.approx(summaries[0]["norms"], rel=1e-9)
    assert summaries[1]["contact"]["normal_force"] == pytest.approx(summaries[0]["contact"]["normal_force"], rel=1e-9)


SAID = {
    **{f"paper_{reading}": ["the largest strain is 2"] for reading in ("consistent", "isotropic", "mixed", "printed")},
    "brake_pad": [
        "the friction coefficient of 'bottom' falls from 0.4 to 0.3 over a slip speed of 0.5, which may feed vibrations",
        "the friction of 'bottom', 0.4, heats a body that expands and then presses harder: rounding may then grow",
        "the friction coefficient is 0.4, and no value of a coefficient is known up to which every step has one solution",
    ],
    "block_with_hole": ["the largest strain is 23.3 %"],
    "creep_column": ["the body sinks into the foundation by 0.0882, 4.4 %"],
    "sliding_block": ["18 of 153 temperatures lie below 0"],
    "wavy_road": ["the gap of 'bottom' is -0.01 at its nearest point", "the body sinks into the foundation by 0.0142"],
}


@pytest.mark.parametrize("name", [name for name in library() if name != "hertz"])
def test_what_a_run_says(name: str) -> None:
    message, expected = warmslip.run(warmslip.load(name)).summary["warnings"], SAID.get(name, [])
    assert len(message) == len(expected) and all(
        one.startswith(words) for one, words in zip(message, expected, strict=True)
    ), message
