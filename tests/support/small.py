"""A small run of the paper's problem that keeps checkpoints."""

from __future__ import annotations

from typing import Any

import warmslip


def scene(end: float = 0.5, steps: int = 8, **keys: Any) -> warmslip.Scene:
    small = {"mesh.n": 6, "time.end": end, "time.steps": steps, "output.checkpoint": 3}
    return warmslip.load("paper_mixed").override(**{**small, **keys})
