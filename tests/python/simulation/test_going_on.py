"""Runs that go on to a later end, or are complete already."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.small import scene
from support.stopped import KilledError, stop_after

import warmslip
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary


@pytest.mark.parametrize(
    "keys", [{}, {"time.tolerance": 3e-2}, {"output.every": 5}, {"supports.displacement": [], "loads.traction": {}}]
)
def test_a_later_end(tmp_path: Path, keys: dict[str, Any]) -> None:
    """A run of twice the length, at once and in two pieces with another cadence of output: the same to the last bit."""
    whole = warmslip.run(scene(1.0, 16, **keys), out=tmp_path / "whole")
    warmslip.run(scene(0.5, 8, **keys), out=tmp_path / "pieces")
    taken: list[int] = []
    longer = scene(1.0, 16, **keys | {"output.every": 2})
    end = warmslip.run(longer, out=tmp_path / "pieces", resume=True, progress=lambda step, *_: taken.append(step))
    assert end.completed
    assert taken[0] > 8 if "time.tolerance" in keys else taken[0] == 9
    for name in ("u", "w", "theta"):
        assert np.array_equal(getattr(whole, name), getattr(end, name)), name
    with warmslip.Trajectory(tmp_path / "whole" / "trajectory.h5") as one, warmslip.Trajectory(end.trajectory) as other:
        for group in ("steps", "balances"):
            for name, values in one.series(group).items():
                assert np.array_equal(values, other.series(group)[name]), name
        assert other.time[-1] == 1.0
        assert np.all(np.diff(other.time) > 0)


def test_a_run_that_stops_at_once_says_what_it_said(tmp_path: Path) -> None:
    """A large strain, an interruption, then a load without a value: the run stops where it goes on, with its warnings."""
    keys = {"loads.body": [0.0, -20.0], "viscosity.lame": [0.1, 0.1], "output.checkpoint": 1}
    broken = scene(**{"loads.traction.left": ["sqrt(0.4 - t)", 0.4], **keys})
    whole = warmslip.run(broken)
    with pytest.raises(KilledError):
        warmslip.run(broken, out=tmp_path, progress=stop_after(whole.summary["steps"]))
    again = warmslip.run(broken, out=tmp_path, resume=True)
    assert whole.outcome == again.outcome == "data_not_finite"
    assert any("strain" in one for one in whole.summary["warnings"])
    assert again.summary["warnings"] == whole.summary["warnings"]


def test_an_end_that_is_past_is_refused(tmp_path: Path) -> None:
    warmslip.run(scene(0.5, 8), out=tmp_path)
    with pytest.raises(ValueError, match=r"is at t = 0.5 after 8 steps, where this scene has no such step"):
        warmslip.run(scene(0.25, 4), out=tmp_path, resume=True)
    with pytest.raises(ValueError, match="is of another scene"):
        warmslip.run(scene(1.0, 8), out=tmp_path, resume=True)  # steps of another size
    assert warmslip.run(scene(0.5, 8), out=tmp_path, resume=True).completed


def contact_numbers(result: warmslip.Result) -> dict[str, Any]:
    return {name: value for name, value in result.summary["contact"].items() if name != "parts"}


def test_a_complete_run_stays_as_it_is(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    whole = warmslip.run(scene(), out=tmp_path)
    assert whole.summary["contact"]["normal_force"] > 0
    files = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for keys in ({}, {"output.every": 2}):
        again = warmslip.run(scene(**keys), out=tmp_path, resume=True)
        assert again.summary == whole.summary
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == files
    (told,) = caplog.messages
    assert "is complete and stays as it is; output.every holds for new steps alone" in told


def test_the_contact_of_a_summary_is_that_of_the_last_report() -> None:
    simulation = Simulation(scene())
    *_, (_, report) = simulation.steps()
    found = summary(simulation)["contact"]
    assert min(report.open, report.slip) > 0 and report.normal_force > 0
    for name in ("open", "stick", "slip"):
        assert found[name] == getattr(report, name)
    assert (found["normal_force"], found["max_penetration"]) == (report.normal_force, report.max_penetration)
    assert found["tangential_force"] == pytest.approx(np.linalg.norm(report.friction_traction), rel=1e-14)
    np.testing.assert_allclose(found["traction"], report.traction, rtol=1e-14)


def test_a_summary_that_was_lost_is_written_from_the_state(tmp_path: Path) -> None:
    """No step is left to take: forces, statuses and penetration are those of the stored state."""
    whole = warmslip.run(scene(), out=tmp_path)
    (tmp_path / "summary.json").unlink()
    again = warmslip.run(scene(), out=tmp_path, resume=True)
    one, other = contact_numbers(whole), contact_numbers(again)
    assert min(one["normal_force"], one["max_penetration"], one["slip"] + one["stick"]) > 0
    assert one.keys() == other.keys()
    for name, value in one.items():
        np.testing.assert_allclose(other[name], value, rtol=1e-13)


def test_a_load_that_ends_at_a_step_ends_there_in_pieces_too(tmp_path: Path) -> None:
    """The times of a run to 0.4 and of one to 1 in steps of 0.1 are the same numbers, and formulas in t do the same."""

    def pushed(end: float, steps: int) -> warmslip.Scene:
        keys = {"time.end": end, "time.steps": steps, "loads.body": ["0", "-1*(t<=0.3)"]}
        return scene(**keys)

    whole = warmslip.run(pushed(1.0, 10), out=tmp_path / "whole")
    warmslip.run(pushed(0.4, 4), out=tmp_path / "pieces")
    end = warmslip.run(pushed(1.0, 10), out=tmp_path / "pieces", resume=True)
    assert np.array_equal(whole.u, end.u)
    with warmslip.Trajectory(end.trajectory) as stored:
        assert np.asarray(stored.time).tolist() == [n / 10 for n in range(11)]


def test_states_that_are_stored_stay_whatever_the_new_cadence(tmp_path: Path) -> None:
    warmslip.run(scene(0.5, 8, **{"output.every": 3}), out=tmp_path)
    end = warmslip.run(scene(1.0, 16, **{"output.every": 5}), out=tmp_path, resume=True)
    with warmslip.Trajectory(end.trajectory) as stored:
        assert (np.asarray(stored.time) * 16).tolist() == [0, 3, 6, 10, 15, 16]
    with pytest.raises(KilledError):
        warmslip.run(scene(1.0, 16, **{"output.every": 2}), out=tmp_path / "killed", progress=stop_after(7))
    end = warmslip.run(scene(1.0, 16, **{"output.every": 5}), out=tmp_path / "killed", resume=True)
    with warmslip.Trajectory(end.trajectory) as stored:
        assert (np.asarray(stored.time) * 16).tolist() == [0, 2, 4, 6, 10, 15, 16]
