"""Estimated errors against errors that are known, from a run that is much finer."""

from __future__ import annotations

from typing import Any

import pytest
from support.processes import Command

import warmslip
from warmslip import SceneError
from warmslip.records import tables
from warmslip.scene.scene import Scene
from warmslip.studies.companions import Companion, march
from warmslip.studies.error_estimate import estimate, richardson

HOT = {"contact.heat_exchange.foundation_temperature": 10.0}
# scene, its keys, those of the finer run, and quantities that the estimate must get right within a factor of three
CASES: dict[str, tuple[str, dict[str, Any], dict[str, Any], list[str]]] = {
    "paper": (
        "paper_mixed",
        HOT | {"mesh.n": 16, "time.steps": 16},
        {"mesh.n": 64, "time.steps": 128},
        ["u_V", "w_L2", "theta_L2", "dissipated_energy", "theta_mean"],
    ),
    "graded": (
        "paper_mixed",
        HOT | {"mesh.n": 32, "time.steps": 16, "mesh.graded_to": ["corners"], "time.graded_to": [0.0]},
        {"mesh.n": 64, "time.steps": 64},
        ["w_L2", "theta_L2", "theta_mean"],
    ),
    "adaptive": (
        "heat_slab",
        {"mesh.n": [8, 32], "time.steps": 8, "time.tolerance": 0.004},
        {"mesh.n": [16, 64], "time.tolerance": 0.00004},
        ["theta_L2", "theta_mean"],
    ),
    "space": (
        "block_3d",
        HOT | {"mesh.n": 8, "time.steps": 8},
        {"mesh.n": 16, "time.steps": 32},
        ["u_V", "theta_L2", "theta_mean"],
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_effectivity(case: str) -> None:
    name, keys, finer, quantities = CASES[case]
    scene = warmslip.load(name).override(**keys)
    found, simulation = estimate(scene)
    assert simulation.outcome == "completed"
    fine, run = Companion(scene.override(**finer)), Companion(scene)
    (true,), _ = march([fine, run], [(0, 1)])
    for quantity in quantities:
        assert 0.5 <= found.total(quantity) / true.values[quantity] <= 3, (quantity, found.total(quantity), true)
    assert found.work < 12
    assert {row["quantity"] for row in found.rows()} == set(found.quantities)


@pytest.mark.parametrize("p", [0.7, 1.0, 1.6])
def test_the_error_from_a_distance(p: float) -> None:
    """Errors C h^p: their difference in L2 and of functionals, in the energy norm the root of that of the squares."""
    fine, coarse = 3.0, 3.0 * 2**p
    assert richardson("theta_L2", "space", coarse - fine, p) == pytest.approx(fine, rel=1e-12)
    assert richardson("u_V", "time", coarse - fine, p) == pytest.approx(fine, rel=1e-12)
    assert richardson("u_V", "space", (coarse**2 - fine**2) ** 0.5, p) == pytest.approx(fine, rel=1e-12)


def small(**keys: Any) -> Scene:
    return warmslip.load("paper_mixed").override(
        **(HOT | {"mesh.n": 16, "time.steps": 16} | {k.replace("__", "."): v for k, v in keys.items()})
    )


def test_parts_of_the_model() -> None:
    soft, stiff = (estimate(small(contact__stiffness=c))[0] for c in (1e2, 1e4))
    assert soft.parts["u_V"]["stiffness"].error / stiff.parts["u_V"]["stiffness"].error > 10
    sharp, smooth = (estimate(small(contact__friction__regularisation=r))[0] for r in (1e-6, 1e-2))
    assert smooth.parts["u_V"]["regularisation"].error > 100 * sharp.parts["u_V"]["regularisation"].error
    assert {"coupling", "stiffness"} <= set(soft.parts["u_V"])
    both = estimate(small(time__coupling="monolithic"))[0]
    assert "coupling" not in both.parts["u_V"]
    assert both.parts["u_V"]["round-off"].error < 1e-9 * both.size["u_V"]


def test_time_and_space_are_told_apart() -> None:
    long, short = (estimate(small(time__steps=steps))[0].parts["theta_L2"] for steps in (8, 64))
    assert long["time"].error > 3 * short["time"].error
    assert long["space"].error == pytest.approx(short["space"].error, rel=0.5)


def test_the_command_writes_a_table_and_a_figure(command: Command, tmp_path: Any) -> None:
    result = command("run", "paper_mixed", "--set", "mesh.n=16", "--set", "time.steps=8", "--estimate", "--out", "run")
    assert result.returncode == 0, result.stderr
    rows = tables.read(tmp_path / "run/error.csv")
    assert {"space", "time", "round-off", "coupling", "stiffness"} == {row["part"] for row in rows}
    assert "theta_L2" in result.stdout and "space" in result.stdout
    assert (tmp_path / "run/error.png").exists()
    assert command("view", "run", "--out", "seen", "--no-animate").returncode == 0
    assert (tmp_path / "seen/error.png").exists()
    refused = command("run", "paper_mixed", "--set", "mesh.n=6", "--estimate", "--out", "none")
    assert refused.returncode == 2 and "give n = 8" in refused.stderr
    assert not (tmp_path / "none").exists()  # nothing was run for it


def test_a_mesh_that_cannot_be_halved_is_refused() -> None:
    with pytest.raises(SceneError, match="cannot be halved"):
        estimate(small(mesh__n=6))
