"""What an audit says: one finding a question, as a table to read and as a file to keep."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from rich.markup import escape
from rich.table import Table

from warmslip.records import tables

Holds = Literal["yes", "no", "not needed"]
STYLE: dict[Holds, str] = {"yes": "green", "no": "red", "not needed": "dim"}


@dataclass(frozen=True)
class Finding:
    """`values` are (name, number) pairs in the units of the scene's data; `meaning` is what follows for the answer."""

    topic: str
    statement: str
    values: tuple[tuple[str, float], ...]
    holds: Holds
    meaning: str

    def __getitem__(self, name: str) -> float:
        """One of the values. Raises KeyError for a name that is not there."""
        return dict(self.values)[name]


def verdict(holds: bool) -> Holds:
    """The word for a statement that is needed."""
    return "yes" if holds else "no"


def find(findings: Sequence[Finding], topic: str, words: str = "") -> Finding:
    """The one finding on `topic` whose statement has `words`. Raises ValueError unless there is exactly one."""
    (one,) = (f for f in findings if f.topic == topic and words in f.statement)
    return one


def in_words(finding: Finding) -> str:
    """The values on one line, four digits."""
    return ", ".join(f"{name} = {value:.4g}" for name, value in finding.values)


def table(findings: Sequence[Finding], title: str = "") -> Table:
    """For the terminal; rich folds the sentences."""
    out = Table(title=escape(title) or None, show_lines=True)
    for column in ("what", "holds", "numbers", "what it means"):
        out.add_column(column)
    for one in findings:
        holds = f"[{STYLE[one.holds]}]{one.holds}[/]"
        out.add_row(f"[bold]{one.topic}[/]\n{one.statement}", holds, in_words(one), one.meaning)
    return out


def write(path: Path, findings: Sequence[Finding], stamp: dict[str, Any]) -> None:
    """`.json` holds findings and stamp; `.csv` the findings with 17 digits and the stamp beside it as .json.

    Numbers that are not finite are written as the strings inf and nan. Raises ValueError for any other ending.
    """
    if path.suffix not in (".csv", ".json"):
        raise ValueError(f"an audit is written as .csv or .json, not '{path.name}'; choose one of the two")
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".json":
        rows = [asdict(one) | {"values": {k: _plain(v) for k, v in one.values}} for one in findings]
        path.write_text(
            json.dumps({"findings": rows, "stamp": stamp}, indent=2, allow_nan=False) + "\n", encoding="utf-8"
        )
        return
    joined = ["; ".join(f"{name} = {value:.17g}" for name, value in one.values) for one in findings]
    tables.write(path, (asdict(one) | {"values": text} for one, text in zip(findings, joined, strict=True)), stamp)


def _plain(value: float) -> float | str:
    return value if abs(value) < float("inf") else str(value)
