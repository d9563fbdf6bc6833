"""Bodies that several tests take: the paper's problem on few cells, a column, and the end of a run that must be right."""

from __future__ import annotations

from typing import Any

import warmslip
from warmslip import Scene
from warmslip.scene.reader import build

SMALL = {"mesh.n": 6, "time.steps": 5}


def paper(coupling: str = "staggered", **without: Any) -> Scene:
    values = {"contact.heat_exchange.foundation_temperature": 10.0, "time.coupling": coupling}
    return warmslip.load("paper_isotropic").override(**SMALL | values | without)


def column(height: float = 2.0, **tables: Any) -> Scene:
    """A quasistatic elastic column of width 1 without lateral contraction, free to move; `tables` replace or add."""
    data: dict[str, Any] = {
        "mesh": {"shape": "square", "n": [2, 8], "lengths": [1.0, height]},
        "time": {"end": 1.0, "steps": 4},
        "elasticity": {"lame": [0.0, 50.0]},
    }
    return build({key: value for key, value in (data | tables).items() if value is not None})


def completed(scene: Scene) -> Any:
    """The end of a run whose balances close."""
    result = warmslip.run(scene)
    assert result.outcome == "completed", result.summary["failure"]
    assert max(result.summary["balances"][name] for name in ("energy", "heat", "force", "law")) <= 1e-11
    return result
