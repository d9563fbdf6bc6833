"""The stamp on every result: what produced it, without naming a host or a user."""

from __future__ import annotations

import hashlib
import os
import platform
import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from warmslip.scene.scene import Scene

PACKAGE = Path(__file__).parents[1]


# the packages that take part in a run
SOLVING = ("mesh", "scene", "records", "model", "io", "simulation")


@cache
def _git(*arguments: str) -> str | None:
    """What git says of the checkout; None where there is none, or where the package is installed inside a foreign one."""
    git = ("git", "-C", str(PACKAGE))
    try:
        subprocess.run([*git, "ls-files", "--error-unmatch", "__init__.py"], capture_output=True, check=True)
        result = subprocess.run([*git, *arguments], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return result.stdout.strip()


@cache
def cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


@cache
def fingerprint() -> str:
    """A hash of everything that solves: the compiled core and the Python modules that step it."""
    digest = hashlib.sha256()
    compiled = sorted(PACKAGE.parent.parent.glob("build/cp*/_core.*.so")) or sorted(PACKAGE.glob("_core.*.so"))
    sources = [path for name in SOLVING for path in sorted((PACKAGE / name).glob("*.py"))]
    for path in [*compiled, *sources, *sorted(PACKAGE.glob("scenes/paper_*.toml"))]:
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def stamp(scene: Scene | None = None, **more: Any) -> dict[str, Any]:
    """Version, commit, scene and machine; `more` adds what the caller knows (PETSc, ranks, times, counts)."""
    changes = _git("status", "--porcelain", "--untracked-files=no", "--", ":/cpp", ":/python")
    record: dict[str, Any] = {
        "version": metadata.version("warmslip"),
        "commit": _git("rev-parse", "HEAD"),
        "dirty": None if changes is None else bool(changes),
        "fingerprint": fingerprint(),
        "python": platform.python_version(),
        "cpu": cpu_model(),
        "threads": int(os.environ.get("OMP_NUM_THREADS", "1")),
    }
    if scene is not None:
        record |= {"scene": scene.resolved(), "scene_hash": scene.digest()}
    return record | more
