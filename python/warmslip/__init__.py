"""warmslip: dynamic frictional contact of thermo-viscoelastic bodies, with its numbers proved.

import warmslip
scene = warmslip.load("paper_isotropic").override(**{"mesh.n": 64, "time.steps": 64})
result = warmslip.run(scene, out="results/runs/first")
"""

from __future__ import annotations

import importlib
import os
import sys
from importlib import metadata
from typing import TYPE_CHECKING, Any

from warmslip.scene.errors import SceneError
from warmslip.scene.reader import load
from warmslip.scene.scene import Scene

if TYPE_CHECKING:
    from warmslip.io.trajectory import Trajectory
    from warmslip.model.contact_laws import Law
    from warmslip.model.discretisation import Discretisation, discretise
    from warmslip.model.loads import Loads
    from warmslip.model.state import State
    from warmslip.model.stress import von_mises
    from warmslip.simulation.run import Result
    from warmslip.simulation.simulation import Simulation
    from warmslip.studies.accuracy import run
    from warmslip.studies.sweep import sweep

# a checkout that another user compiled is used as it is: its build folder cannot be brought up to date
for _finder in sys.meta_path:
    if getattr(_finder, "rebuild_flag", False) and not os.access(getattr(_finder, "path", ""), os.W_OK):
        _finder.rebuild_flag = False  # type: ignore[attr-defined]

__all__ = [
    "Discretisation",
    "Law",
    "Loads",
    "Result",
    "Scene",
    "SceneError",
    "Simulation",
    "State",
    "Trajectory",
    "discretise",
    "load",
    "run",
    "sweep",
    "von_mises",
]

__version__ = metadata.version("warmslip")

# the compiled core is loaded when it is first needed: scenes can be read and checked without it
_LAZY = {
    "Law": "model.contact_laws",
    "Loads": "model.loads",
    "Discretisation": "model.discretisation",
    "discretise": "model.discretisation",
    "Result": "simulation.run",
    "Simulation": "simulation.simulation",
    "run": "studies.accuracy",
    "State": "model.state",
    "Trajectory": "io.trajectory",
    "sweep": "studies.sweep",
    "von_mises": "model.stress",
}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        value = getattr(importlib.import_module(f"warmslip.{_LAZY[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'warmslip' has no attribute '{name}'")


def __dir__() -> list[str]:
    """The public names, those included that are loaded when they are first needed."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
