"""Tables of numbers as CSV files: the one reader and the one writer."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

Row = dict[str, Any]


def texts(path: Path) -> list[dict[str, str]]:
    """The rows of a table as they are written, in order."""
    with path.open(newline="", encoding="utf-8-sig") as file:
        return list(csv.DictReader(file))


def read(path: str | Path) -> list[Row]:
    """The rows of a table with numbers where they are numbers."""
    return [{key: _value(text) for key, text in row.items()} for row in texts(Path(path))]


def _value(text: str) -> Any:
    try:
        return float(text) if any(c in text for c in ".einf") else int(text)
    except ValueError:
        return {"True": True, "False": False}.get(text, text)


def write(path: Path, rows: Iterable[Mapping[str, Any]], stamp: Mapping[str, Any] | None = None) -> None:
    """Writes rows that have the same columns, numbers with 17 digits, and their stamp beside them as .json.

    Raises ValueError for a table without rows, OSError.
    """
    table = [dict(row) for row in rows]
    if not table:
        raise ValueError(f"there is no row to write to {path}")
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(table[0])
        out.writerows([f"{v:.17g}" if isinstance(v, float) else v for v in row.values()] for row in table)
    if stamp is not None:
        path.with_suffix(".json").write_text(json.dumps(stamp, indent=2) + "\n", encoding="utf-8")


def aligned(rows: Iterable[Mapping[str, Any]], columns: Iterable[str]) -> str:
    """Some columns of a table as text for a terminal, numbers with four digits; columns without a value are left out."""
    table = [dict(row) for row in rows]
    cells = {name: [_cell(row.get(name)) for row in table] for name in columns}
    there = {name: values for name, values in cells.items() if any(value not in ("", "-", "0") for value in values)}
    widths = {name: max(map(len, [name, *values])) for name, values in there.items()}
    lines = [[name.rjust(widths[name]) for name in there]]
    lines += [[there[name][i].rjust(widths[name]) for name in there] for i in range(len(table))]
    return "\n".join("  ".join(line) for line in lines)


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if value == value else "-"
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)
