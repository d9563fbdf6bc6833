"""Figures of a run for Python: axes that show what the file holds, and refusals in a sentence."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from support.processes import Command

import warmslip
from warmslip import Result, Scene
from warmslip.figures.contact import STATUS, borders
from warmslip.io.plot import Plot

Small = Callable[..., Scene]


@pytest.fixture(name="result", scope="module")
def _result(tmp_path_factory: pytest.TempPathFactory) -> Result:
    folder = tmp_path_factory.mktemp("run")
    keys = {"mesh.n": 4, "time.steps": 8, "output.every": 2, "loads.body": [0.0, "where(t < 0.4, 5, -40)"]}
    scene = warmslip.load("paper_mixed").override(**keys)
    return warmslip.run(scene, out=folder)


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    plt.close("all")


def test_pressure_and_traction_with_its_bound(result: Result) -> None:
    assert len(result.plot.contact(times=0.5)[0].lines) == len(result.plot.contact(times=[0.5])[0].lines)
    for wrong in ([], [9.0], [-3.0], "x", [None]):
        for draw in (result.plot.contact, result.plot.temperature):
            with pytest.raises(ValueError, match=r"times = .*; give (times from 0 to 1|a time or a list of times)"):
                draw(times=wrong)
    with warmslip.Trajectory(result.trajectory) as stored:
        for ask in (stored.state, stored.contact_on):
            with pytest.raises(ValueError, match="time = 'end' is no number; give a time"):
                ask(time="end")
        with pytest.raises(ValueError, match="has no series 'stepz'; give steps, balances"):
            stored.series("stepz")
    upper, lower = result.plot.contact(times=[0.5, 1.0])
    with warmslip.Trajectory(str(result.trajectory)) as stored:
        seen = [stored.contact_on(time=time) for time in (0.5, 1.0)]
    drawn = [line for line in upper.lines if len(line.get_xdata()) > 2]
    for line, at in zip(drawn, seen, strict=True):
        assert np.array_equal(line.get_xdata(), at.arc_length) and np.array_equal(line.get_ydata(), at.pressure)
    values = [line.get_ydata() for line in lower.lines]
    assert min(at.friction_bound.max() for at in seen) > 0
    (one, other) = (shade.get_paths()[0].vertices for shade in lower.collections)
    for shade, at in ((one, seen[0]), (other, seen[1])):
        assert shade[:, 1].max() == at.friction_bound.max() and shade[:, 1].min() == -at.friction_bound.max()
    for at in seen:
        for wanted in (at.traction, at.friction_bound, -at.friction_bound):
            assert any(np.array_equal(one, wanted) for one in values)
    assert [text.get_text() for text in upper.get_legend().get_texts()] == ["t = 0.5", "t = 1"]


def test_steps_that_touch_are_drawn_unless_times_are_given(result: Result) -> None:
    """The body rises first: no curve is of that time."""
    upper, _ = result.plot.contact()
    with warmslip.Trajectory(str(result.trajectory)) as stored:
        touching = [float(t) for t in np.arange(1, 9) / 8 if (stored.contact_on(time=float(t)).status > 0).any()]
    assert 0 < len(touching) < 8
    times = [float(text.get_text().removeprefix("t = ")) for text in upper.get_legend().get_texts()]
    assert times and set(times) <= set(touching) and times[-1] == touching[-1]


def test_the_map_shows_the_status_of_every_step(result: Result) -> None:
    ax = result.plot.stick_slip_map("bottom")
    (mesh,) = ax.collections
    with warmslip.Trajectory(str(result.trajectory)) as stored:
        at = stored.contact_history()
    assert np.array_equal(np.asarray(mesh.get_array()).reshape(5, 8), at.status.T)
    assert np.allclose(mesh.get_coordinates()[:, 0, 1], borders(at.arc_length, at.weights))
    assert np.allclose(mesh.get_coordinates()[0, :, 0], [0.0, *at.time])
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [name for name, _ in STATUS]


def test_the_pieces_of_a_part_end_where_the_part_ends() -> None:
    assert np.allclose(borders(np.linspace(0, 1, 5), np.array([1, 2, 2, 2, 1]) / 8), [0, 0.125, 0.375, 0.625, 0.875, 1])
    with_gap = borders(np.array([0.0, 0.1, 0.9, 1.0]), np.array([0.05, 0.05, 0.05, 0.05]))
    assert np.allclose(with_gap, [-0.025, 0.05, 0.5, 0.95, 1.025])


def test_friction_and_temperature_along_the_part(result: Result) -> None:
    with warmslip.Trajectory(str(result.trajectory)) as stored:
        at, steps = stored.contact_history(), stored.series("steps")
    line, *_ = result.plot.friction().lines
    assert np.allclose(line.get_ydata(), steps["friction_traction"][:, 0], rtol=1e-12)
    assert np.allclose(line.get_xdata(), at.slip @ at.weights / at.weights.sum(), rtol=1e-12)
    (line,) = result.plot.temperature(times=[1.0]).lines
    below = np.abs(line.get_ydata() - at.temperature[-1])
    assert below.max() == 0 and result.theta[:5].max() >= line.get_ydata().max() > 0


@pytest.mark.parametrize("field", ["displacement", "mises", "temperature"])
def test_the_body_and_the_history(result: Result, field: str) -> None:
    _, free = plt.subplots()
    assert result.plot.body(field, time=0.5, ax=free) is free
    ax = result.plot.body(field)
    assert (
        "at t = 1" in ax.get_title()
        and "at t = 0.5" in free.get_title()
        and free.get_title().startswith(ax.get_title().split(" at ")[0])
    )
    titles = [one.get_title() for one in result.plot.history()]
    assert {"contact forces", "residuals"} <= set(titles)


def test_a_result_is_read_again(result: Result) -> None:
    assert result.trajectory is not None
    again = Result.read(result.trajectory.parent)
    assert again.summary == result.summary and np.array_equal(again.u, result.u)


def test_what_cannot_be_drawn_is_said(small: Small, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"was not stored.*run it with out="):
        _ = warmslip.run(small()).plot
    with pytest.raises(ValueError, match=r"holds no summary\.json"):
        Result.read(tmp_path)
    with pytest.raises(ValueError, match=r"holds no trajectory\.h5"):
        Plot(tmp_path).contact()
    cold = warmslip.run(warmslip.load("quasistatic_punch").override(**{"mesh.n": 4, "time.steps": 2}), out=tmp_path)
    for call, words in (
        (lambda: cold.plot.body("misses"), "'misses' is unknown; give one of displacement, mises, temperature"),
        (lambda: cold.plot.body("temperature"), "the run has no temperature; it has displacement, mises"),
        (lambda: cold.plot.temperature(), "the run has no temperature"),
        (lambda: cold.plot.stick_slip_map("top"), "no contact points lie on 'top'"),
    ):
        with pytest.raises(ValueError, match=words):
            call()
    space = warmslip.run(warmslip.load("block_3d").override(**{"mesh.n": 2, "time.steps": 1}), out=tmp_path)
    with pytest.raises(ValueError, match="of a body in space is no line"):
        space.plot.contact()
    assert space.plot.body().get_title().startswith("displacement at t")


@pytest.mark.parametrize("kind", ["pressure", "stick_slip", "friction", "contact_temperature"])
def test_the_command_draws_runs(kind: str, result: Result, command: Command, tmp_path: Path) -> None:
    done = command("draw", kind, result.trajectory, "--out", "figure.png")
    assert done.returncode == 0, done.stderr
    assert "'bottom'" in (tmp_path / "figure.rst").read_text() and (tmp_path / "figure.png").stat().st_size > 5000
    refused = command("draw", kind, tmp_path, "--out", "figure.png")
    assert refused.returncode == 2 and "Traceback" not in refused.stderr


def test_plotting_leaves_the_backend_alone(result: Result) -> None:
    """A notebook shows figures through a backend of its own."""
    assert result.trajectory is not None
    code = (
        "import sys, warmslip; assert 'matplotlib' not in sys.modules; import matplotlib; matplotlib.use('svg');"
        f"warmslip.Result.read({str(result.trajectory.parent)!r}).plot.friction(); print(matplotlib.get_backend())"
    )
    done: Any = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "svg"


def test_panels_of_several_runs_name_them(command: Command, tmp_path: Path) -> None:
    small = ["--set", "mesh.n=4", "--set", "time.steps=2"]
    for name in ("one", "other"):
        assert command("run", "paper_mixed", *small, "--out", name).returncode == 0
    assert command("draw", "pressure", "one", "other/trajectory.h5", "--out", "both.png").returncode == 0
    assert command("draw", "pressure", "one", "--out", "single.png").returncode == 0
    both, single = ((tmp_path / f"{name}.rst").read_text() for name in ("both", "single"))
    assert "along 'bottom' of 'one'" in both and "along 'bottom' of 'other'" in both
    assert "along 'bottom'" in single and " of 'one'" not in single
