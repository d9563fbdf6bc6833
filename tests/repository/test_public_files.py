"""Files that repeat what the code says: the scene schema, the stubs, and the README's example."""

from __future__ import annotations

import json
import re
from importlib import import_module
from pathlib import Path

import pytest
from support.folders import ROOT

from warmslip import _core, figures
from warmslip.scene import scene

PACKAGE = ROOT / "python" / "warmslip"


def test_schema_is_that_of_the_scene() -> None:
    stored = json.loads((PACKAGE / "scene.schema.json").read_text())
    assert stored == scene.Scene.model_json_schema(), (
        "write it anew: warmslip schema > python/warmslip/scene.schema.json"
    )


def test_stubs_name_everything_in_the_core() -> None:
    stub = (PACKAGE / "_core.pyi").read_text()
    for name in (n for n in dir(_core) if not n.startswith("_")):
        assert re.search(rf"^(class|def) {name}\b|^{name}:", stub, re.MULTILINE), f"the stubs lack {name}"
        members = [m for m in vars(getattr(_core, name, object)) if not m.startswith("_")] if name[0].isupper() else []
        missing = [m for m in members if not re.search(rf"^    (def )?{m}\b", stub, re.MULTILINE)]
        assert not missing, f"the stubs of {name} lack {missing}"


def test_readme_examples_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, law = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(law, "README.md", "exec"), {})
    outcome, force = capsys.readouterr().out.split()
    assert outcome == "completed" and float(force) > 0.1
    exec(compile(code, "README.md", "exec"), {})
    message = capsys.readouterr().out.splitlines()
    assert message[-2].startswith("completed {'energy'")
    assert "'u_V': 0.09" in message[-1] or "'u_V': 0.10" in message[-1], message[-1]


def test_every_kind_of_figure_is_a_drawing() -> None:
    for kind, (module, inputs) in figures.KINDS.items():
        assert callable(getattr(import_module(f"warmslip.figures.{module}"), kind)), kind
        assert inputs
