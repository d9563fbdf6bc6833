"""warmslip: dynamic frictional contact of thermo-viscoelastic bodies, with its numbers proved.

import warmslip
scene = warmslip.load("paper_isotropic").override(**{"mesh.n": 64, "time.steps": 64})
result = warmslip.run(scene, out="results/runs/first")
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from warmslip.scene import Scene, SceneError, load

if TYPE_CHECKING:
    from warmslip.laws import Law
    from warmslip.loads import Loads
    from warmslip.problem import Discretisation, discretise
    from warmslip.runner import Result, Run, run
    from warmslip.state import State
    from warmslip.trajectory import Trajectory

__all__ = [
    "Discretisation",
    "Law",
    "Loads",
    "Result",
    "Run",
    "Scene",
    "SceneError",
    "State",
    "Trajectory",
    "discretise",
    "load",
    "run",
]

# the compiled core is loaded when it is first needed: scenes can be read and checked without it
_LAZY = {
    "Law": "laws",
    "Loads": "loads",
    "Discretisation": "problem",
    "discretise": "problem",
    "Result": "runner",
    "Run": "runner",
    "run": "runner",
    "State": "state",
    "Trajectory": "trajectory",
}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        value = getattr(importlib.import_module(f"warmslip.{_LAZY[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'warmslip' has no attribute '{name}'")
