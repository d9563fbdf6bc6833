"""Ends non-zero where a page or style of a site loads something from the network: scripts, styles, images, fonts, frames.

Links for readers may go anywhere. `python workflows/remote.py FOLDER`.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

LOADED = {  # attributes by tag that a browser follows by itself
    "script": ("src",),
    "img": ("src", "srcset"),
    "iframe": ("src",),
    "source": ("src", "srcset"),
    "video": ("src", "poster"),
    "audio": ("src",),
    "embed": ("src",),
    "object": ("data",),
    "link": ("href",),
}
LINKS = {"canonical", "next", "prev", "index", "search", "author", "help", "license", "alternate"}  # not followed
REMOTE = re.compile(r"\s*(https?:)?//", re.IGNORECASE)
IN_STYLES = re.compile(r"(?:url\(\s*|@import\s+)['\"]?\s*((?:https?:)?//[^'\")\s;]+)", re.IGNORECASE)
IN_SCRIPTS = re.compile(r"(?:import\s*\(|\bfrom|\bimport|\.src\s*=)\s*['\"]((?:https?:)?//[^'\"]+)")


class _Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self._inside = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self._inside = tag
        if tag == "link" and set(given.get("rel", "").lower().split()) <= LINKS:
            return
        for name in LOADED.get(tag, ()):
            if REMOTE.match(given.get(name, "")):
                self.found.append(f"<{tag}> {given[name]}")
        self.found += [f"style {url}" for url in IN_STYLES.findall(given.get("style", ""))]

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        pattern = {"style": IN_STYLES, "script": IN_SCRIPTS}.get(self._inside)
        if pattern:
            self.found += [f"<{self._inside}> {url}" for url in pattern.findall(data)]


def remote(folder: Path) -> list[str]:
    """A line for each thing that a page or style in a folder loads from the network."""
    found = []
    for path in sorted([*folder.rglob("*.html"), *folder.rglob("*.css")]):
        text = path.read_text(encoding="utf-8", errors="replace")
        here = _Page(text).found if path.suffix == ".html" else [f"style {url}" for url in IN_STYLES.findall(text)]
        found += [f"{path.relative_to(folder)}: {what}" for what in dict.fromkeys(here)]
    return found


if __name__ == "__main__":
    lines = remote(Path(sys.argv[1]))
    for line in lines:
        print(f"error: loaded from the network: {line}", file=sys.stderr)
    sys.exit(bool(lines))
