"""The page of the paper: it opens on its figures, its readings are a table of text, and it needs no other file."""

from __future__ import annotations

import base64
import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from support.folders import ROOT
from support.processes import Command

from warmslip.paper.page import claims, page
from warmslip.records import tables

RESULTS = ROOT / "results/paper"
FIGURES = [RESULTS / "figures" / f"{name}.png" for name in ("figure_1", "figure_5_mixed", "figure_5_isotropic")]


class Page(HTMLParser):
    """Headings, images and rows of tables in the order of the page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.seen: list[tuple[str, Any]] = []
        self.cells: list[list[str]] = []
        self._open = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self._open = tag
        if tag == "img":
            self.seen.append(("img", given))
        elif tag == "tr":
            self.cells.append([])
        elif tag in ("td", "th"):
            self.cells[-1].append("")
        assert not str(given.get("src") or given.get("href") or "").startswith(("http", "//")), "a remote file"
        assert tag not in ("script", "link")

    def handle_endtag(self, tag: str) -> None:
        self._open = ""

    def handle_data(self, data: str) -> None:
        if self._open in ("h1", "h2", "p", "figcaption"):
            self.seen.append((self._open, " ".join(data.split())))
        elif self._open in ("td", "th"):
            self.cells[-1][-1] += data


@pytest.fixture(name="written", scope="module")
def _written(tmp_path_factory: pytest.TempPathFactory) -> Page:
    out = tmp_path_factory.mktemp("page") / "report.html"
    page(FIGURES, RESULTS / "readings.csv", RESULTS / "verdict.json", out)
    return Page(out.read_text(encoding="utf-8"))


def test_it_opens_on_its_figures(written: Page) -> None:
    kinds = [kind for kind, _ in written.seen]
    assert kinds[:3] == ["h1", "p", "h2"] and kinds[3] == "img"  # the title, the verdict in a line, figure 1
    titles = [text for kind, text in written.seen if kind == "h2"]
    assert titles == ["Figure 1: the setting", "Figure 5: convergence", titles[2], "Verdict"]
    images = [given for kind, given in written.seen if kind == "img"]
    for path, image in zip(FIGURES, images, strict=True):
        assert base64.b64decode(image["src"].partition(",")[2]) == path.read_bytes()
        assert image["alt"] == path.with_suffix(".rst").read_text().strip()


def test_the_readings_are_a_table_of_their_numbers(written: Page) -> None:
    rows = tables.texts(RESULTS / "readings.csv")
    lines = {cells[0]: cells[1:] for cells in written.cells if len(cells) == 5}
    assert lines[""] == [row["reading"] for row in rows]
    yes = [sum(value == "yes" for value in row.values()) for row in rows]
    every = [sum(value in ("yes", "no") for value in row.values()) for row in rows]
    assert lines["claims satisfied"] == [f"{a} of {b}" for a, b in zip(yes, every, strict=True)]
    assert lines["|u|_V: ratio"] == [f"{float(row['deformation_ratio']):.3g}" for row in rows]
    assert lines["all of them larger"] == [row["all_larger"] for row in rows]
    names, groups = claims(rows)
    assert sum(len(group) for _, group in groups) == len(rows[0]) - 1
    (group,) = (found for title, found in groups if title == "Figure 5: error of u, w and θ, θ_F = 10")
    assert ("order of the whole curve", [f"{float(row['order_u_w_theta_10']):.3g}" for row in rows]) in group
    assert names == ["printed", "mixed", "isotropic", "consistent"]


def test_a_verdict_that_failed_is_shown(tmp_path: Path) -> None:
    verdict = json.loads((RESULTS / "verdict.json").read_text())
    wrong = verdict["details"][3]
    wrong |= {"passed": False, "observed": 0.125}
    (tmp_path / "verdict.json").write_text(json.dumps(verdict | {"passed": False, "failed": [wrong["case"]]}))
    page(FIGURES[:1], RESULTS / "readings.csv", tmp_path / "verdict.json", tmp_path / "report.html")
    found = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    count = verdict["checks"]
    assert ("p", f"{count - 1} of {count} checks of the results pass.") in found.seen
    assert [wrong["case"], str(wrong["expected"]), "0.125", f"{wrong['low']} to {wrong['high']}"] in found.cells


def test_what_belongs_to_no_page_is_refused(command: Command, tmp_path: Path) -> None:
    (tmp_path / "other.png").write_bytes(FIGURES[0].read_bytes())
    (tmp_path / "other.rst").write_text("a caption")
    good = {"readings": RESULTS / "readings.csv", "verdict": RESULTS / "verdict.json", "out": tmp_path / "report.html"}
    with pytest.raises(ValueError, match=r"other\.png belongs to no section of the page"):
        page([tmp_path / "other.png"], **good)
    (tmp_path / "verdict.json").write_text("{}")
    with pytest.raises(ValueError, match="is no verdict of `warmslip judge`"):
        page(FIGURES, **good | {"verdict": tmp_path / "verdict.json"})
    with pytest.raises(ValueError, match="the table of readings has no rows"):
        claims([])
    options = [word for name, path in good.items() for word in (f"--{name}", str(path))]
    assert command("page", str(FIGURES[0]), *options).returncode == 0
    assert (tmp_path / "report.html").exists()
