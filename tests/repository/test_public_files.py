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


@pytest.mark.parametrize(
    "name", [n for n, kind in vars(_core).items() if isinstance(kind, type) and not hasattr(kind, "__members__")]
)
def test_stubs_have_the_sizes_and_the_words_of_the_core(name: str) -> None:
    stub = (PACKAGE / "_core.pyi").read_text()
    begin = re.search(rf"^class {name}\b", stub, re.MULTILINE)
    assert begin is not None
    block = re.split(r"^(?=class |def )", stub[begin.start() + 1 :], maxsplit=1, flags=re.MULTILINE)[0]
    for member, value in vars(getattr(_core, name)).items():
        if member.startswith("_"):
            continue
        signature = (value.fget.__doc__ if isinstance(value, property) else value.__doc__) or ""
        sizes = set(re.findall(r"FixedSize\(\d+\)", signature))
        there = set(re.findall(r"FixedSize\(\d+\)", " ".join(re.findall(rf"def {member}\(.*", block))))
        assert sizes <= there, f"{name}.{member} has {sizes}, its stub {there}"
        if isinstance(value, property):
            assert (value.__doc__ or "").strip() in block, f"{name}.{member} has other words than its stub"


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
