"""The page of the paper: its figures first, then the table of readings and the verdict, in one file that needs no other."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import jinja2

from warmslip.records import tables

# the beginning of a figure's name, and the section that it belongs to, in their order on the page
SECTIONS = (
    ("figure_1", "Figure 1: the setting"),
    ("figure_2", "Figure 2: deformed configurations"),
    ("figure_3", "Figure 3: temperature"),
    ("figure_4", "Figure 4: von Mises stress"),
    ("figure_5", "Figure 5: convergence"),
    ("orders", "Orders without the error of the reference"),
    ("grid", "Errors with h and k refined separately"),
    ("work", "Accuracy against cost"),
    ("blocks", "What terms of the model cost"),
    ("extremes", "Extremes"),
)
NUMBERS = {
    "coarsest": "error at the coarsest h = k",
    "finest": "error at the finest h = k",
    "order": "order of the whole curve",
    "ticks": "errors lie among the ticks of the paper",
    "linear": "almost linear",
}
TERMS = {"u_theta": "u and θ", "u_w_theta": "u, w and θ"}
NORMS = {"deformation": "|u|_V", "displacement": "|u|_L2", "stress": "von Mises stress", "temperature": "temperature"}

Group = tuple[str, list[tuple[str, list[str]]]]


def page(figures: list[Path], readings: Path, verdict: Path, out: Path) -> None:
    """Writes the page.

    Parameters
    ----------
    figures : list of Path
        PNG files with their captions beside them as .rst; names begin as in `SECTIONS`.
    readings : Path
        The table of `warmslip readings`.
    verdict : Path
        The verdict of `warmslip judge`.
    out : Path
        The HTML file.

    Raises
    ------
    ValueError
        For a figure that belongs to no section, a table without rows, or what is no verdict.
    OSError
        When a file cannot be read or written.
    """
    sections: dict[str, list[tuple[str, str]]] = {title: [] for _, title in SECTIONS}
    for path in figures:
        sections[_section(path)].append(
            (
                base64.b64encode(path.read_bytes()).decode(),
                path.with_suffix(".rst").read_text(encoding="utf-8").strip(),
            )
        )
    names, groups = claims(tables.texts(readings))
    found = json.loads(verdict.read_text(encoding="utf-8"))
    if not isinstance(found, dict) or not {"passed", "checks", "failed", "details", "stamp"} <= found.keys():
        raise ValueError(f"{verdict} is no verdict of `warmslip judge`")
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("warmslip.paper", "templates"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    text = environment.get_template("paper.html").render(
        sections={title: shown for title, shown in sections.items() if shown},
        readings=names,
        groups=groups,
        satisfied=satisfied(names, groups),
        verdict=found,
        failed=[one for one in found["details"] if not one["passed"]],
    )
    out.write_text(text, encoding="utf-8")


def _section(path: Path) -> str:
    """The title of the section of a figure. Raises ValueError."""
    for begin, title in SECTIONS:
        if re.fullmatch(rf"{begin}(_.*)?", path.stem):
            return title
    raise ValueError(
        f"{path} belongs to no section of the page; its name begins with none of {', '.join(b for b, _ in SECTIONS)}"
    )


def claims(rows: list[dict[str, str]]) -> tuple[list[str], list[Group]]:
    """The table of readings, a column a reading: their names, and groups of lines with a title. Raises ValueError."""
    if not rows or "reading" not in rows[0]:
        raise ValueError("the table of readings has no rows; make it with `warmslip readings`")
    groups: dict[str, list[tuple[str, list[str]]]] = {}
    for column in rows[0]:
        if column == "reading":
            continue
        group, label = _named(column)
        groups.setdefault(group, []).append((label, [_short(row[column]) for row in rows]))
    return [row["reading"] for row in rows], list(groups.items())


def _named(column: str) -> tuple[str, str]:
    """Group and label of a column of the table of readings."""
    if error := re.fullmatch(rf"({'|'.join(NUMBERS)})_(u_theta|u_w_theta)_([-\d.e+]+)", column):
        return f"Figure 5: error of {TERMS[error[2]]}, θ_F = {error[3]}", NUMBERS[error[1]]
    group = "On the hotter foundation against the colder one"
    if norm := re.fullmatch(rf"({'|'.join(NORMS)})_(ratio|larger)", column):
        return group, f"{NORMS[norm[1]]}: {'ratio' if norm[2] == 'ratio' else 'larger, as in the paper'}"
    return group, "all of them larger" if column == "all_larger" else column.replace("_", " ")


def _short(text: str) -> str:
    """Numbers to three digits."""
    try:
        return f"{float(text):.3g}"
    except ValueError:
        return text


def satisfied(names: list[str], groups: list[Group]) -> dict[str, str]:
    """How many claims each reading satisfies, as in `11 of 13`."""
    lines = [cells for _, group in groups for _, cells in group if set(cells) <= {"yes", "no"}]
    return {name: f"{sum(cells[i] == 'yes' for cells in lines)} of {len(lines)}" for i, name in enumerate(names)}
