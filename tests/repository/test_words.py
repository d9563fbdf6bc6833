"""Public text uses the field's words: a short list of private ones stays out of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from support.folders import ROOT

# private words, and what to write
BANNED = {
    r"ledgers?": "balances",
    r"bookkeeper": "balances",
    r"(close|closes|open|the) books": "balances",
    r"bricks?": "cells",
    r"entitled": "expected",
    r"essays?": "example",
    r"identity_violated": "balance_violated",
    r"held_inside": "support_inside_foundation",
    r"bricks a side": "cells per side",
    r"rooms": "modules",
}
TEXT = [
    *(ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "results/README.md")),
    *(p for p in (ROOT / "python").rglob("*") if p.suffix in (".md", ".py", ".pyi", ".toml", ".html", ".json")),
    *(p for p in (ROOT / "cpp").rglob("*") if p.suffix in (".hpp", ".cpp")),
    *(p for p in (ROOT / "workflows").rglob("*") if p.suffix in (".smk", ".yaml", ".sh") or p.name == "Snakefile"),
]


@pytest.mark.parametrize("path", TEXT, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_private_word(path: Path) -> None:
    text = path.read_text()
    for word, instead in BANNED.items():
        if found := re.search(rf"\b{word}\b", text, re.IGNORECASE):
            line = text.count("\n", 0, found.start()) + 1
            pytest.fail(f"{path.relative_to(ROOT)}:{line}: '{found[0]}'; write '{instead}'")
