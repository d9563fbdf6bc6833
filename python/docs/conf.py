"""The site: `make docs` builds it into build/docs, with warnings as errors."""

from __future__ import annotations

import importlib.util
import logging
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import gallery  # noqa: E402
import generated  # noqa: E402

project = "warmslip"
author = "The warmslip authors"
copyright = author
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx.ext.napoleon", "breathe"]
exclude_patterns = ["conf.py", "generated.py", "gallery.py", "README.md"]
html_theme = "furo"
html_title = "warmslip"
# one file of MathJax, from the package that holds it; sphinx would refer to a server
_mathjax = importlib.util.find_spec("sphinx-mathjax-offline")
assert _mathjax is not None and _mathjax.origin is not None, "pip install sphinx-mathjax-offline"
html_static_path = ["_static", str(Path(_mathjax.origin).parent / "static/mathjax/tex-svg.js")]
mathjax_path = "tex-svg.js"
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False

myst_enable_extensions = ["amsmath", "colon_fence", "dollarmath"]
myst_heading_anchors = 3
nb_custom_formats = {".py": "generated.example"}
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_timeout = 120
nb_execution_raise_on_error = True
nb_merge_streams = True
# the kernels that run the examples print errors only
_settings = tempfile.TemporaryDirectory()
os.environ["IPYTHONDIR"] = _settings.name
_profile = Path(_settings.name) / "profile_default"
_profile.mkdir()
(_profile / "ipython_kernel_config.py").write_text("c.IPKernelApp.log_level = 'ERROR'\n")
logging.getLogger("traitlets").setLevel(logging.WARNING)

breathe_projects = {"warmslip": str(HERE.parents[1] / "build/doxygen/xml")}
breathe_default_project = "warmslip"
suppress_warnings = ["duplicate_declaration.cpp"]  # the namespace stands in every header
napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 80


def _replaced(app: Any, name: str, source: list[str]) -> None:
    """Lines such as `% generated: scene` become what the function of that name in generated.py writes."""
    source[0] = re.sub(r"^% generated: (\w+)$", lambda m: getattr(generated, m[1])(), source[0], flags=re.MULTILINE)
    if "% gallery" in source[0]:
        source[0] = source[0].replace("% gallery", gallery.gallery())


def _escaped(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Doc comments are plain text with `code`: what reStructuredText would read as markup is escaped."""
    parts = "\n".join(lines).split("`")
    for i in range(0, len(parts), 2):
        parts[i] = re.sub(r"([\\*|_])", r"\\\1", parts[i])
    lines[:] = "``".join(parts).split("\n")


def setup(app: Any) -> None:
    (HERE.parents[1] / "build/doxygen").mkdir(parents=True, exist_ok=True)
    subprocess.run(["doxygen", str(HERE / "Doxyfile")], cwd=HERE.parents[1], check=True)
    app.connect("source-read", _replaced)
    app.connect("autodoc-process-docstring", _escaped, priority=400)  # before napoleon reads the sections
