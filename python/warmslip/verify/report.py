"""The verification report: every line of every topic in one table, in Markdown, with the figures beside it."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path

HEAD = """# Verification

{summary} Written by `make verify`; nothing was edited by hand. A line passes when the observed number lies in its band. Every
table below is also a CSV with 17 digits, and beside it a stamp (.json) says what computed it.

| topic | what | lines | failed |
| --- | --- | --- | --- |
"""


def number(text: str) -> str:
    """A number of a CSV as people write it; zero is zero."""
    value = float(text)
    return "0" if value == 0 else f"{value:.4g}"


def band(low: str, high: str) -> str:
    return f"at most {number(high)}" if float(low) == 0 else f"{number(low)} to {number(high)}"


def read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def markdown(tables: Sequence[Path], figures: Sequence[Path]) -> tuple[str, bool]:
    """The report and whether all lines passed; titles come from the stamps. Raises ValueError for a table without lines."""
    topics = {path.stem: read(path) for path in tables}
    titles = {path.stem: json.loads(path.with_suffix(".json").read_text())["title"] for path in tables}
    empty = [name for name, rows in topics.items() if not rows]
    if empty:
        raise ValueError(f"no lines in {', '.join(empty)}: a verification that checks nothing proves nothing")
    failed = {name: sum(row["verdict"] != "pass" for row in rows) for name, rows in topics.items()}
    total, wrong = sum(map(len, topics.values())), sum(failed.values())
    origins: dict[str, int] = {}
    for rows in topics.values():
        for row in rows:
            origins[row["origin"]] = origins.get(row["origin"], 0) + 1
    counts = ", ".join(f"{count} {origin}" for origin, count in sorted(origins.items(), key=lambda item: -item[1]))
    summary = f"**{total - wrong} of {total} lines pass.** Where the expected numbers come from: {counts}."
    out = [HEAD.format(summary=summary)]
    out += [
        f"| [{name}](#{name}) | {titles[name]} | {len(rows)} | {failed[name] or ''} |\n"
        for name, rows in topics.items()
    ]
    for figure in figures:
        caption = figure.with_suffix(".rst")
        out.append(f"\n![{figure.stem}]({figure.name})\n\n{caption.read_text().strip() if caption.exists() else ''}\n")
    for name, rows in topics.items():
        out.append(f"\n## {name}\n\n{titles[name]}\n\n")
        out.append(
            "| case | what it proves | origin | expected | observed | band | |\n| --- | --- | --- | --- | --- | --- | --- |\n"
        )
        for row in rows:
            cells = (
                row["case"],
                row["proves"],
                row["origin"],
                number(row["expected"]),
                number(row["observed"]),
                band(row["low"], row["high"]),
                "" if row["verdict"] == "pass" else "**FAIL**",
            )
            out.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n")
    return "".join(out), wrong == 0
