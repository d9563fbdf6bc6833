"""Figures, animation and page of a run: all there for every kind of run, and showing what was computed."""

from __future__ import annotations

import html
import json
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image
from support.processes import Command

import warmslip
from warmslip import Scene
from warmslip.figures import run as drawings
from warmslip.io import drawn
from warmslip.io.paraview import opened
from warmslip.report import page as view

Small = Callable[..., Scene]
KINDS = {
    "paper_mixed": ["mesh.n=4", "time.steps=3"],
    "heat_slab": ["time.steps=3"],  # nothing moves
    "elastic_drop": ["time.steps=3", "mesh.n=[1,4]"],  # no heat, nothing touches yet
    "plate_with_hole": ["time.steps=2"],
    "block_with_hole": ["time.steps=2"],  # in space
}


class Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.images = 0
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag == "img":
            self.images += 1
            assert (given["src"] or "").startswith("data:image/")  # nothing else is needed to read it
            assert given["alt"]

    def handle_data(self, data: str) -> None:
        self.words += data.split()


# matplotlib's registry of callbacks may find one gone that the garbage collector took at the same moment
@pytest.mark.filterwarnings(
    "error", "ignore:Exception ignored in. <function WeakMethod:pytest.PytestUnraisableExceptionWarning"
)
@pytest.mark.parametrize("name", KINDS)
def test_every_kind_of_run_is_drawn(name: str, tmp_path: Path) -> None:
    done = warmslip.run(warmslip.load(name, KINDS[name]), out=tmp_path)
    files = view.view(tmp_path, tmp_path / "view")
    expected = [
        "body.png",
        *(["contact.png"] if name != "heat_slab" else []),
        *(["pressure.png", "stick_slip.png"] if name not in ("heat_slab", "block_with_hole") else []),
        "history.png",
        "animation.gif",
        "report.html",
    ]
    assert [path.name for path in files] == expected
    for path in files[:-1]:
        with Image.open(path) as image:
            assert min(image.size) > 200 and len(image.convert("L").getcolors()) > 20  # not blank
    with Image.open(tmp_path / "view" / "animation.gif") as image:
        assert image.n_frames == 1 + done.summary["steps"]
    page = Page((tmp_path / "view" / "report.html").read_text())
    assert page.images == len(expected) - 1
    assert "completed:" in page.words and done.summary["stamp"]["scene_hash"] in page.words
    norm = next(iter(done.summary["norms"].values()))
    assert f"{norm:.6g}" in page.words


def test_what_is_drawn_is_what_was_computed(small: Small, tmp_path: Path) -> None:
    states = []
    done = warmslip.run(small(), out=tmp_path, observers=[lambda state, _: states.append((state.mises, state.contact))])
    with opened(tmp_path) as t:
        d = t.discretisation()
        last = drawn.body(t, d, 4)
        parts = drawn.parts(t, 4)
        panels = drawn.history(t, d)
    assert np.array_equal(last.fields["temperature"], done.theta)
    assert np.allclose(last.fields["displacement"], np.linalg.norm(done.u, axis=1))
    mises, contact = states[-1]
    assert np.allclose(last.fields["von Mises stress"], mises, rtol=1e-12)
    assert np.allclose(np.sort(parts["bottom"]["pressure"]), np.sort(contact["pressure"]), rtol=1e-12)
    assert np.allclose(parts["bottom"]["position"], np.linspace(0, 1, 5))
    assert panels["contact forces"]["normal force bottom"][-1] == pytest.approx(done.summary["contact"]["normal_force"])
    assert panels["forces of supports"]["y top"][-1] == done.summary["reactions"]["top"]["force"][1]
    flows = panels["heat into the body, per time"]
    assert {name: values[-1] for name, values in flows.items()} == done.summary["heat_flows"]


def test_a_run_that_was_stopped_is_drawn_too(small: Small, tmp_path: Path) -> None:
    warmslip.run(small(), out=tmp_path)
    (tmp_path / "summary.json").unlink()
    view.view(tmp_path, tmp_path / "view", animate=False, at=0.5)
    message = (tmp_path / "view" / "report.html").read_text()
    assert "did not end" in message and "at t = 0.5" in message
    assert not (tmp_path / "view" / "animation.gif").exists()


def test_the_page_has_the_warnings_of_the_run(tmp_path: Path, command: Command) -> None:
    done = command(
        "run", "paper_mixed", "--set", "mesh.n=4", "--set", "time.steps=2", "--set", "contact.gap=5.0", "--out", "far"
    )
    assert done.returncode == 0 and "warning: " in done.stderr + done.stdout
    assert command("view", "far", "--out", "view").returncode == 0
    (warning, *_) = json.loads((tmp_path / "far/summary.json").read_text())["warnings"]
    page = html.unescape((tmp_path / "view/report.html").read_text())
    assert f"warning: {warning}" in page


def test_a_title_is_text_and_no_markup(small: Small, tmp_path: Path) -> None:
    warmslip.run(small(title="<script>alert(1)</script>"), out=tmp_path)
    view.view(tmp_path, tmp_path / "view", animate=False)
    assert "<script>" not in (tmp_path / "view" / "report.html").read_text()


def test_the_command_says_what_it_wrote_and_what_it_cannot(command: Command) -> None:
    keys = ["--set", "mesh.n=4", "--set", "time.steps=2", "--out", "run"]
    assert command("run", "paper_mixed", *keys).returncode == 0
    output = command("view", "run", "--out", "seen", "--at", "0.5")
    assert output.returncode == 0 and "report.html in seen" in output.stdout
    beyond = command("view", "run", "--out", "seen", "--at", "3")
    assert beyond.returncode == 2 and "from t = 0 to 1, not at 3" in beyond.stderr
    nothing = command("view", ".", "--out", "seen")
    assert nothing.returncode == 2 and "holds no trajectory.h5" in nothing.stderr
    some = command("export", "run", "--out", "series", "--fields", "temperature,pressure", "--times", "1.0")
    assert some.returncode == 0 and some.stdout.startswith("1 states")
    wrong = command("export", "run", "--out", "series", "--fields", "presure")
    assert wrong.returncode == 2 and "did you mean 'pressure'?" in wrong.stderr
    assert command("export", "run", "--out", "series", "--times", "soon").returncode == 2


def test_a_status_has_one_colour_in_every_figure(small: Small, tmp_path: Path) -> None:
    warmslip.run(small(), out=tmp_path)
    with opened(tmp_path) as t:
        d = t.discretisation()
        last, parts, history = drawn.body(t, d, 4), drawn.parts(t, 4), drawn.history(t, d)
        display, output = drawings.bodies(last, 5.0)
        points, _ = drawings.contact(parts, 1.0)
        lines, _ = drawings.history(t.series("steps")["time"], history)
    for figure in (display, points):
        (legend,) = figure.legends
        assert [text.get_text() for text in legend.get_texts()] == [name for name, _ in drawings.STATUS]
        assert [dot.get_markerfacecolor() for dot in legend.legend_handles] == [c for _, c in drawings.STATUS]
    (panel,) = (ax for ax in lines.axes if ax.get_title() == "contact points")
    assert [(line.get_label(), line.get_color()) for line in panel.lines] == list(drawings.STATUS)
    present = {drawings.STATUS[int(i)][1] for i in last.status}
    assert {dot.get_markerfacecolor() for dot in display.axes[0].lines if len(dot.get_xdata())} == present
    assert display.get_suptitle() == "t = 1, displacement 5 times magnified" and "5 times magnified" in output
    plain, message = drawings.bodies(last, 1.0)
    assert plain.get_suptitle() == "t = 1" and "magnified" not in message
    for figure in (display, points, lines, plain):
        plt.close(figure)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 6])
def test_a_history_has_no_hole(count: int) -> None:
    time = np.arange(1.0, 4.0)
    figure, _ = drawings.history(time, {f"panel {i}": {"one": time} for i in range(count)})
    grid = figure.axes[0].get_gridspec()
    taken = [ax.get_subplotspec() for ax in figure.axes if ax.get_visible()]
    assert sum((s.rowspan.stop - s.rowspan.start) * (s.colspan.stop - s.colspan.start) for s in taken) == (
        grid.nrows * grid.ncols
    )
    plt.close(figure)


def test_a_flat_body_has_a_flat_figure() -> None:
    nodes, nothing = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 1.0]]), np.zeros((3, 2))
    flat = drawings.Body(
        0.0, nodes, np.array([[0, 1, 2]]), nothing, {"displacement": np.arange(3.0)}, *[nothing[:0]] * 3
    )
    figure, _ = drawings.bodies(flat, 1.0)
    assert figure.get_figheight() < 2.2 and not figure.legends
    plt.close(figure)


def test_a_body_in_space_shows_its_contact() -> None:
    """The camera stands where the contact points are."""
    nodes = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])

    def seen(points: list[list[float]]) -> tuple[float, float]:
        at = np.array(points).reshape(-1, 3)
        return drawings._seen_from(
            drawings.Body(0.0, nodes, np.array([[0, 1, 2]]), 0 * nodes, {}, at, at, np.zeros(len(at)))
        )

    assert seen([[0.5, 0.5, 0.0]])[0] < 0 < seen([[0.5, 0.5, 1.0]])[0]
    assert abs(seen([[1.0, 0.5, 0.5]])[1] - 25) < 1e-9 and abs(seen([[0.0, 0.5, 0.5]])[1] - 205) < 1e-9
