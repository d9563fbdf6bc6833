"""The stamp names the commit of the sources, or none."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from warmslip.records import provenance


def test_a_package_inside_a_foreign_repository_names_no_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    git = ["git", "-C", str(tmp_path), "-c", "user.name=somebody", "-c", "user.email=some@body"]
    subprocess.run([*git, "init", "--quiet"], check=True)
    subprocess.run([*git, "commit", "--quiet", "--allow-empty", "--message", "nothing"], check=True)
    (tmp_path / "__init__.py").touch()
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path)
    head = provenance._git.__wrapped__
    assert head("rev-parse", "HEAD") is None
    subprocess.run([*git, "add", "__init__.py"], check=True)
    assert head("rev-parse", "HEAD") is not None
