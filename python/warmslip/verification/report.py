"""The verification report in Markdown: figures, audits, seeded faults, and every line of every topic."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

from warmslip.records import tables

FAULTS = 80  # fewer say nothing

HEAD = """# Verification

{summary} Written by `make verify`; nothing was edited by hand. A line passes when the observed number lies in its band. Every
topic below is also a CSV with 17 digits, and beside it a stamp (.json) says what computed it. `comparison` are two numbers of
the core itself, `own rule` is what the code says of itself; neither is a proof of the answer.

| topic | what | lines | failed |
| --- | --- | --- | --- |
"""


def number(text: str) -> str:
    """A number of a CSV as people write it; zero is zero."""
    value = float(text)
    return "0" if value == 0 else f"{value:.4g}"


def band(low: str, high: str) -> str:
    middle, half = (float(low) + float(high)) / 2, (float(high) - float(low)) / 2
    if 0 < half < 1e-3 * abs(middle):  # as far as four digits do not show it
        return f"within {half / abs(middle):.0e} of it"
    return f"at most {number(high)}" if float(low) == 0 else f"{number(low)} to {number(high)}"


def row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"


def audits(paths: Sequence[Path]) -> Iterator[str]:
    """What the theory assumes, a line a statement and a column a data set: whether it holds, and the numbers."""
    names = [path.stem.removeprefix("audit_") for path in paths]
    found = {
        name: {(r["topic"], r["statement"]): r for r in tables.texts(path)}
        for name, path in zip(names, paths, strict=True)
    }
    yield "\n## audits\n\nWhat the theory assumes, on the paper's data sets with the hot foundation (`warmslip check SCENE`). "
    yield "What each answer means is in "
    yield ", ".join(f"[{path.name}]({path.name})" for path in paths)
    yield "; the topic `assumptions` puts to a run what a run can contradict.\n\n"
    yield row("what", "statement", *names) + "| --- " * (2 + len(names)) + "|\n"
    for topic, statement in dict.fromkeys(key for own in found.values() for key in own):
        cells = []
        for name in names:
            one = found[name].get((topic, statement))
            pairs = [pair.split(" = ") for pair in one["values"].split("; ") if pair] if one else []
            numbers = ", ".join(f"{key} = {number(value)}" for key, value in pairs)
            cells.append(f"**{one['holds']}** {numbers}" if one else "")
        yield row(topic, statement, *cells)


def faults(path: Path) -> tuple[list[str], bool]:
    """The score of the seeded faults, what kills most of them, and every other with the reason; whether all is well.

    That is: every fault tried, at least 80, 95 per cent of them killed, every survivor explained, and `control`, which is no
    fault, alive.
    """
    rows = {r["fault"]: r for r in tables.texts(path)}
    control = rows.pop("control", None)
    tried = [r for r in rows.values() if r["outcome"] != "untried"]
    killers = Counter(r["by"].split("::")[0].split("[")[0] for r in tried if r["outcome"] == "killed")
    killed, others = killers.total(), [r for r in tried if r["outcome"] != "killed"]
    sound = control is not None and control["outcome"] == "survived"
    whole = len(tried) == len(rows) >= FAULTS and killed >= 0.95 * len(tried)
    good = sound and whole and all(r["outcome"] == "survived" and r["by"] for r in others)
    share = f"{100 * killed / len(tried):.1f} %" if tried else "none tried"
    out = [f"\n## seeded faults\n\n**{killed} of {len(tried)} killed ({share})** by the fast tests (`make mutants`)"]
    if len(tried) < len(rows):
        out.append(f", {len(rows) - len(tried)} not tried yet")
    out.append(f"; which check kills which fault is in [{path.name}]({path.name}).\n\n")
    commits = Counter(r["commit"] for r in tried)
    out.append(
        f"Tried at {', '.join(f'{c} ({n})' for c, n in commits.most_common())}; a row is kept while its fault is as it was.\n\n"
    )
    if not sound:
        out.append("**A change that changes nothing did not survive: the score means nothing.**\n\n")
    out.append(row("first to fail", "faults") + "| --- | --- |\n")
    out += [row(name, str(count)) for name, count in killers.most_common()]
    if others:
        out.append("\n" + row("not killed", "what it does", "why no check can fail") + "| --- | --- | --- |\n")
        for r in others:
            why = r["by"] if r["outcome"] == "survived" else f"**{r['outcome']}**: {r['by']}"
            out.append(row(r["fault"], r["what"], why or "**unexplained**"))
    return out, good


def markdown(
    paths: Sequence[Path], figures: Sequence[Path], audited: Sequence[Path] = (), seeded: Path | None = None
) -> tuple[str, bool]:
    """The report and whether all checks passed; titles come from the stamps. Raises ValueError for a table without checks."""
    topics = {path.stem: tables.texts(path) for path in paths}
    titles = {path.stem: json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))["title"] for path in paths}
    empty = [name for name, rows in topics.items() if not rows]
    if empty:
        raise ValueError(f"no lines in {', '.join(empty)}: a verification that checks nothing proves nothing")
    failed = {name: sum(one["verdict"] != "pass" for one in rows) for name, rows in topics.items()}
    total, wrong = sum(map(len, topics.values())), sum(failed.values())
    origins: dict[str, int] = {}
    for rows in topics.values():
        for one in rows:
            origins[one["origin"]] = origins.get(one["origin"], 0) + 1
    counts = ", ".join(f"{count} {origin}" for origin, count in sorted(origins.items(), key=lambda item: -item[1]))
    summary = f"**{total - wrong} of {total} lines pass.** Where the expected numbers come from: {counts}."
    out = [HEAD.format(summary=summary)]
    out += [
        row(f"[{name}](#{name})", titles[name], str(len(rows)), str(failed[name] or ""))
        for name, rows in topics.items()
    ]
    for figure in figures:
        caption = figure.with_suffix(".rst")
        out.append(
            f"\n![{figure.stem}]({figure.name})\n\n{caption.read_text(encoding='utf-8').strip() if caption.exists() else ''}\n"
        )
    if audited:
        out += audits(audited)
    if seeded:
        text, explained = faults(seeded)
        out += text
        wrong += not explained
    for name, rows in topics.items():
        out.append(f"\n## {name}\n\n{titles[name]}\n\n")
        out.append(
            "| case | what it proves | origin | expected | observed | band | |\n| --- | --- | --- | --- | --- | --- | --- |\n"
        )
        for one in rows:
            cells = (
                one["case"],
                one["proves"],
                one["origin"],
                number(one["expected"]),
                number(one["observed"]),
                band(one["low"], one["high"]),
                "" if one["verdict"] == "pass" else "**FAIL**",
            )
            out.append(row(*cells))
    return "".join(out), wrong == 0
