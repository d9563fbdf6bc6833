"""What is drawn of a scene before it runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.processes import Command

import warmslip
from warmslip.report.sketch import sketch
from warmslip.scene.roles import roles


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("paper_mixed", {"left": "traction", "top": "clamped", "bottom": "contact, stiffness 10000, friction 0.2"}),
        ("quarter_sphere", {"left": "held along x", "front": "held along y", "top": "held along z, moves"}),
        ("drum", {"bottom": "contact with a rigid foundation, cylinder, friction 0.3, foundation moves"}),
        ("hertz", {"top": "held along x and y, moves"}),
        ("heat_slab", {"bottom": "exchanges heat"}),
    ],
)
def test_the_roles_of_parts(name: str, expected: dict[str, str]) -> None:
    found = roles(warmslip.load(name))
    for part, words in expected.items():
        assert words in found[part], found


def test_guides_springs_and_points() -> None:
    scene = warmslip.Scene(
        mesh={"n": 2},
        time={"steps": 2},
        elasticity={"young": 1.0, "poisson": 0.3, "assumption": "plane_strain"},
        supports={
            "displacement": {"left": {"normal": "t"}, "right": {"normal": 0.0}},
            "springs": {"bottom": {"stiffness": 1.0}},
            "points": [{"at": [0.5, 1.0]}],
        },
    )
    assert roles(scene) == {
        "left": ["held along its normal, moves"],
        "right": ["held along its normal"],
        "bottom": ["on springs or dashpots"],
    }
    assert np.array_equal(sketch(scene).points, [[0.5, 1.0]])


def test_the_foundation_lies_below_the_body() -> None:
    (line,) = sketch(warmslip.load("drum")).foundations
    assert np.all(np.diff(line[:, 0]) > 0)
    assert np.hypot(line[:, 0] - 0.5, line[:, 1] + 1) == pytest.approx(1.0, abs=1e-12)


def test_tractions_are_those_of_the_end() -> None:
    scene = warmslip.load("paper_mixed").override(**{"mesh.n": 4, "loads.traction.left": ["2 * t", 0.0]})
    (left, vectors), _ = sketch(scene).tractions
    assert np.all(left[:, 0] == 0)
    assert np.all(vectors == [2.0, 0.0])


@pytest.mark.parametrize("name", ["drum", "quarter_sphere"])
def test_the_command_draws(name: str, command: Command, tmp_path: Path) -> None:
    done = command("explain", name, "--no-trial", "--draw", "scene.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "scene.png").stat().st_size > 10_000
    assert "before the run" in (tmp_path / "scene.rst").read_text()
    refused = command("explain", name, "--no-trial", "--draw", "scene.svg")
    assert refused.returncode == 2
    assert "ends in .png" in refused.stderr
