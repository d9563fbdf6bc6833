"""Runs that advance together: distances on nested and on other meshes, clocks of every kind, coarser scenes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import SceneError
from warmslip.model.discretisation import discretise
from warmslip.model.point_location import located
from warmslip.scene.scene import Scene
from warmslip.studies import refinement_study
from warmslip.studies.companions import FUNCTIONALS, QUANTITIES, Companion, coarser, march, order, slower
from warmslip.studies.error_norms import TERMS, Comparison
from warmslip.studies.point_values import PointComparison

HOT = {"contact.heat_exchange.foundation_temperature": 10.0}


def paper(n: int, steps: int, **keys: Any) -> Scene:
    return warmslip.load("paper_mixed").override(
        **(HOT | {"mesh.n": n, "time.steps": steps} | {k.replace("__", "."): v for k, v in keys.items()})
    )


def test_distances_are_those_of_the_study() -> None:
    rows = refinement_study.study(paper(4, 4), levels=[4, 8], reference=16)
    runs = [Companion(paper(n, n)) for n in (16, 4, 8)]
    found, size = march(runs, [(0, 1), (0, 2)])
    for row, distance in zip(rows, found, strict=False):
        for term in TERMS:
            assert distance.values[term] == pytest.approx(row[f"e_{term}"], rel=1e-12)
        assert distance.times == row["steps"]
    assert size["normal_force"] == pytest.approx(max(run.values["normal_force"] for run in runs), rel=0.5)


@pytest.mark.parametrize("method", ["tolerance", "graded"])
def test_runs_are_compared_at_the_times_that_both_reach(method: str) -> None:
    """Also where a step is taken back, so that a run ends its step earlier than it had announced."""
    keys = {"time__tolerance": 0.003} if method == "tolerance" else {"time__graded_to": [0.0, 0.4], "time__halvings": 3}
    run, other = Companion(paper(8, 8, **keys)), Companion(paper(8, 8, **keys))
    (distance,), _ = march([run, other], [(0, 1)])
    assert distance.times == run.simulation.taken
    assert all(value == 0 for value in distance.values.values())
    equal, several = Companion(paper(8, 64)), Companion(paper(8, 8, **keys))
    (distance,), size = march([equal, several], [(0, 1)])
    assert 3 <= distance.times <= 64
    assert distance.values["theta_L2"] < 0.2 * size["theta_L2"]


@pytest.mark.parametrize("name", ["paper_mixed", "block_3d"])
def test_distances_at_points_are_those_of_nested_meshes(name: str) -> None:
    coarse, fine = (warmslip.load(name).override(**{"mesh.n": n, "time.steps": 3}) for n in (4, 8))
    runs = [warmslip.Simulation(one) for one in (coarse, fine)]
    for one in runs:
        for _ in one.steps():
            pass
    states = [one.stepper for one in runs]
    meshes = [one.discretisation for one in runs]
    exact = Comparison(*meshes).difference(*states)
    found = PointComparison(*meshes).difference(*states)
    for term in TERMS:
        assert found[term] == pytest.approx(exact[term], rel=1e-10), term


def test_points_are_found_in_graded_cells() -> None:
    d = discretise(paper(16, 4, mesh__graded_to=["corners", "bottom"]))
    nodes, cells = np.asarray(d.mesh.nodes), np.asarray(d.mesh.cells)
    points = np.random.default_rng(1).uniform(0, 1, (500, 2))
    cell, weights = located(nodes, cells, points)
    assert weights.min() > -1e-9
    assert np.einsum("pk,pkj->pj", weights, nodes[cells[cell]]) == pytest.approx(points, abs=1e-14)
    with pytest.raises(ValueError, match="1 points of one mesh lie in no cell"):
        located(nodes, cells, np.array([[1.1, 0.5]]))


def test_functionals_are_those_of_the_run() -> None:
    run = Companion(paper(8, 6))
    march([run], [])
    result = warmslip.run(paper(8, 6))
    assert run.values["normal_force"] == result.summary["contact"]["normal_force"]
    assert run.values["theta_max"] == result.theta.max()
    mass = run.simulation.discretisation.operators.mass
    ones = mass.createVecRight()
    ones.set(1.0)
    weights = mass * ones
    assert run.values["theta_mean"] == pytest.approx(
        weights.dot(run.simulation.stepper.theta) / weights.sum(), rel=1e-13
    )
    assert run.values["largest_pressure"] > run.values["normal_force"]  # on a side of length 1
    assert run.values["dissipated_energy"] > 0
    assert set(run.values) == set(FUNCTIONALS)
    assert set(QUANTITIES) == {*TERMS, *FUNCTIONALS}
    assert run.seconds > 0


def test_coarser_and_slower_scenes() -> None:
    assert coarser(paper(12, 8)).mesh.n == 6
    assert coarser(warmslip.load("heat_slab").override(**{"mesh.n": [4, 8]}), 1).mesh.n == [2, 4]
    assert coarser(warmslip.load("plate_with_hole").override(**{"mesh.refine": 2}), 2).mesh.refine == 0
    assert slower(paper(12, 8), 2).time.steps == 2
    assert slower(paper(4, 8, time__tolerance=1e-4)).time.tolerance == pytest.approx(4e-4)
    for scene, message in (
        (paper(6, 8), "give n = 8"),
        (paper(16, 8, mesh__graded_to=["corners"]), "give n = 32"),
        (warmslip.load("brake_pad"), "mesh.grading: its cells are not nested"),
        (warmslip.load("heat_slab").override(**{"mesh.n": [3, 6]}), r"give n = \[8, 16\]"),
        (warmslip.load("plate_with_hole"), "give refine = "),
    ):
        with pytest.raises(SceneError, match=message):
            coarser(scene, 2)
    for scene, message in (
        (paper(4, 6), "give 8"),
        (paper(4, 4, time__graded_to=[0.0]), "give 8"),
        (paper(4, 16, time__graded_to=[0.0, 0.3], time__halvings=4), "give "),
    ):
        with pytest.raises(SceneError, match=message):
            slower(scene, 2)


def test_a_run_that_is_rejected_is_named() -> None:
    with pytest.raises(RuntimeError, match=r"n = 4, steps = 4 ended at t = 0\.5 with data_not_finite"):
        march([Companion(paper(4, 4, loads__body=["1 / (t - 0.75)", 0.0]))], [])


def test_orders_are_bounded() -> None:
    assert order([4.0, 1.0], 0.4, 3.0, 1.0) == 2.0
    assert order([4.0, 1.0], 0.4, 1.2, 1.0) == 1.2
    assert order([1.0, 4.0], 0.4, 1.2, 1.0) == 0.4
    assert order([1.0, 0.0], 0.4, 1.2, 1.0) == 1.0


def test_studies_of_graded_steps_compare_states_of_one_time() -> None:
    graded = {"time__graded_to": [0.0], "time__halvings": 3}
    rows = refinement_study.study(paper(4, 4, **graded), levels=[4, 8], reference=16, steps_per_level=2)
    assert [row["steps"] for row in rows] == [paper(4, 2 * n, **graded).clock.steps for n in (4, 8, 16)]
    runs = [Companion(paper(n, 2 * n, **graded)) for n in (16, 4, 8)]
    found, _ = march(runs, [(0, 1), (0, 2)])
    for row, distance in zip(rows, found, strict=False):
        assert row["e_theta_L2"] == pytest.approx(distance.values["theta_L2"], rel=1e-12)
    with pytest.raises(SceneError, match="leave it out"):
        refinement_study.study(paper(4, 4, time__tolerance=0.01), levels=[4, 8], reference=16)
    with pytest.raises(SceneError, match="times of 5 steps are not among"):
        refinement_study.study(paper(4, 4, time__graded_to=[0.0, 0.3]), levels=[5, 10], reference=20)
