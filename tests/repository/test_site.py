"""The site needs no network: its mathematics lies beside its pages, and the check of the built site sees what does not."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.folders import DOCS, ROOT

CHECK = ROOT / "workflows/remote.py"


def checked(folder: Path) -> tuple[int, list[str]]:
    """Exit code of the check of a site, and what it says."""
    done = subprocess.run([sys.executable, str(CHECK), str(folder)], text=True, capture_output=True, check=False)
    return done.returncode, done.stderr.splitlines()


@pytest.mark.parametrize(
    "line",
    [
        '<script defer="defer" src="https://cdn.example.org/mathjax/tex-mml-chtml.js"></script>',
        '<script src="//cdn.example.org/require.min.js"></script>',
        '<link rel="stylesheet" href="https://fonts.example.org/css?family=Serif">',
        '<link rel="preload icon" href="http://example.org/icon.png">',
        '<img alt="" src="https://example.org/badge.svg">',
        "<style>@import url(https://example.org/a.css);</style>",
        "<p style=\"background: url('//example.org/a.png')\">text</p>",
        '<script type="module">import x from "https://example.org/x.mjs"</script>',
    ],
)
def test_what_the_network_gives_is_found(line: str, tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep/page.html").write_text(f"<!doctype html><html><head>{line}</head><body></body></html>")
    code, said = checked(tmp_path)
    assert code == 1 and len(said) == 1 and said[0].startswith("error: loaded from the network: deep/page.html: ")


def test_what_lies_beside_a_page_and_links_are_no_fault(tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text(
        '<html><head><link rel="canonical" href="https://example.org/page.html"><script src="_static/tex-svg.js"></script>'
        '<link rel="stylesheet" href="_static/a.css"><img src="data:image/png;base64,AAAA"></head>'
        '<body><a href="https://example.org">a link</a><pre>&lt;script src="https://example.org/a.js"&gt;</pre></body></html>'
    )
    (tmp_path / "a.css").write_text("p { background: url(a.png); }")
    assert checked(tmp_path) == (0, [])
    (tmp_path / "a.css").write_text("@font-face { src: url('https://example.org/a.woff2'); }")
    assert checked(tmp_path) == (1, ["error: loaded from the network: a.css: style https://example.org/a.woff2"])


def test_the_mathematics_comes_with_the_site() -> None:
    """`mathjax_path` names a file among the static ones, and the build ends with the check."""
    text = (DOCS / "conf.py").read_text()
    (name,) = re.findall(r'^mathjax_path = "(.*)"$', text, re.MULTILINE)
    assert "/" not in name and re.search(rf'^html_static_path = .*/{re.escape(name)}"', text, re.MULTILINE)
    assert "python workflows/remote.py build/docs" in (ROOT / "workflows/docs.sh").read_text()
