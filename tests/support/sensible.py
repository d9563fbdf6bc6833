"""Scenes of which there is nothing to say, to be changed until there is; and one whose coupling feeds it."""

from __future__ import annotations

from typing import Any

import warmslip
from warmslip import Scene
from warmslip.scene.reader import build

PRESSED: dict[str, Any] = {  # and nothing to say of it
    "mesh": {"shape": "square", "n": 8},
    "time": {"end": 1.0, "steps": 10},
    "elasticity": {"young": 100.0, "poisson": 0.3, "assumption": "plane_strain"},
    "supports": {"displacement": {"top": ["0.001 * t", "-0.005 * t"]}},
    "contact": {"part": "bottom", "stiffness": 1e4, "friction": {"coefficient": 0.3}},
}
WARM: dict[str, Any] = {
    "mesh": {"shape": "square", "n": 8},
    "time": {"end": 0.1, "steps": 10},
    "heat": {"conductivity": 1.0, "capacity": 1.0},
    "initial": {"temperature": 20.0},
    "contact": {
        "part": "bottom",
        "heat_exchange": {"conductance": 5.0, "foundation_temperature": "20 + 50 * t"},
    },
}
FALLING: dict[str, Any] = {
    "mesh": {"shape": "square", "n": 6},
    "time": {"end": 0.5, "steps": 400},
    "inertia": {"density": 1.0},
    "elasticity": {"lame": [0.0, 50.0]},
    "initial": {"velocity": [0.0, -0.1]},
    "contact": {"part": "bottom", "stiffness": 2e3, "gap": 0.005},
}
KELVIN = {
    "heat": {"conductivity": 1.0, "capacity": 1.0, "expansion": {"tensor": 1e-3}},
    "initial": {"temperature": 293.0},
    "supports": {"temperature": {"top": 300.0}, "displacement": ["top"]},
    "contact": None,
}

STRETCHED = {"tensor": [[0.0, 0.0], [0.0, 3.0]]}
# a column, as in test_coupling_limit, in steps of 0.54 where 0.533 is the longest that staggered ones stand
COUPLED: dict[str, Any] = {
    "mesh": {"shape": "square", "n": 4},
    "time": {"end": 162.0, "steps": 300},
    "elasticity": {"lame": [0.0, 0.75]},
    "viscosity": {"lame": [0.0, 1.0]},
    "heat": {
        "conductivity": 1e-6,
        "capacity": 1.0,
        "expansion": STRETCHED,
        "heating": {"tensor": [[0.0, 0.0], [0.0, -3.0]]},
    },
    "supports": {"displacement": ["top"]},
    "loads": {"body": [0.0, -1e-6]},  # it expands freely: the stress would be zero else, and said to have no digits
    "initial": {"temperature": 1e-5},
}


def body(base: dict[str, Any], **keys: Any) -> Scene:
    return build(base).override(**{key.replace("__", "."): value for key, value in keys.items()})


def warnings(scene: Scene, **given: Any) -> list[str]:
    done = warmslip.run(scene, **given)
    assert done.completed, done.summary["failure"]
    return list(done.summary["warnings"])
