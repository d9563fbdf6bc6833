"""Every key of the scene language, given what it cannot hold: refused by its own name, one sentence, nothing else."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from warmslip import SceneError
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene

ISOTROPIC = {"young": 1.0, "poisson": 0.3, "assumption": "plane_strain"}
CONTACT: dict[str, Any] = {
    "part": "bottom",
    "stiffness": 10.0,
    "exponent": 1.5,
    "pressure_limit": 5.0,
    "gap": "0.1 * x",
    "quadrature": "gauss-2",
    "friction": {
        "coefficient": 0.3,
        "cohesion": 0.1,
        "limit": 2.0,
        "kinetic": 0.2,
        "speed": 1.0,
        "regularisation": 0.1,
    },
    "heat_exchange": {"conductance": 1.0, "per_pressure": 0.5, "foundation_temperature": "t"},
    "friction_heating": {"share": 0.5},
}
HEAT: dict[str, Any] = {
    "conductivity": [[1.0, 0.0], [0.0, 1.0]],
    "capacity": 2.0,
    "expansion": {"tensor": 0.1},
    "heating": {"tensor": -0.1},
}
WHOLE: dict[str, Any] = {
    "title": "every key",
    "mesh": {"shape": "square", "n": [4, 4], "lengths": [1.0, 1.0], "grading": [1.0, 2.0], "diagonal": "left"},
    "time": {"end": 1.0, "steps": 4, "coupling": "lagged"},
    "inertia": {"density": 1.0},
    "elasticity": ISOTROPIC,
    "viscosity": {"lame": [1.0, 1.0]},
    "heat": HEAT
    | {
        "source": "sin(x)",
        "capacity_matrix": "lumped",
        "expansion": {"alpha": 0.1, "reference_temperature": 2.0},
        "heating": {"thermodynamic": True},
    },
    "loads": {"body": [0.0, "t"], "traction": {"left": [1.0, 0.0]}, "heat_flux": {"left": 1.0}, "quadrature": 4},
    "supports": {
        "displacement": {"top": [0.0, "t"], "right": {"normal": "0.1 * t"}},
        "points": [{"at": [0.0, 1.0], "displacement": [0.0, "free"]}],
        "springs": {"left": {"stiffness": 1.0, "normal_stiffness": 2.0, "damping": 3.0, "normal_damping": 4.0}},
        "temperature": {"top": "t"},
    },
    "contact": CONTACT,
    "regions": {
        "insert": {
            "where": "x < 0.5",
            "inertia": {"density": 2.0},
            "elasticity": {"tensor": [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]]},
            "viscosity": ISOTROPIC,
            "heat": HEAT,
        }
    },
    "initial": {"displacement": [0.0, "0.1 * y"], "velocity": [0.0, 0.0], "temperature": 1.0},
    "output": {
        "every": 2,
        "checkpoint": 3,
        "checkpoint_minutes": 1.0,
        "probes": {
            "corner": {"at": [0.0, 1.0], "fields": ["stress", "temperature"], "every": 2},
            "middle": {"line": [[0.0, 0.5], [1.0, 0.5]], "count": 11},
            "edge": {"part": "bottom"},
        },
    },
}
FILE: dict[str, Any] = {
    "mesh": {"file": "plate_with_hole.msh", "refine": 1},
    "time": {"end": 1.0, "steps": 1},
    "heat": {"conductivity": 1.0},
}
GRADED = {
    "mesh": {"n": 8, "graded_to": [{"at": "corners", "exponent": 0.6}, {"at": "top"}, "left", [0.0, 0.5]]},
    "time": {"end": 1.0, "steps": 2, "graded_to": [0.0, 0.5], "halvings": 3},
    "heat": {"conductivity": 1.0},
}
ADAPTIVE = FILE | {"time": {"end": 1.0, "steps": 2, "tolerance": 0.1}}
CYLINDER = {"shape": "cylinder", "at": [0.0, 0.0, "-1 - t"], "radius": 1.0, "axis": [0.0, 1.0, 0.0]}
WEDGE = {"shape": "wedge", "at": [0.5, 0.0, "-t"], "normal": [0.0, 0.0, 1.0], "axis": [0.0, 1.0, 0.0], "angle": 90.0}
FOUNDATIONS = {
    "mesh": {"shape": "cube", "n": 2},
    "time": {"end": 1.0, "steps": 2},
    "elasticity": {"young": 1.0, "poisson": 0.3, "assumption": "solid"},
    "supports": {"displacement": ["front"]},
    "contact": [
        {
            "part": "bottom",
            "stiffness": 1.0,
            "gap": CYLINDER,
            "velocity": [1.0, 0.0, "t"],
            "friction": {"coefficient": 0.1},
        },
        {"part": "top", "stiffness": 1.0, "gap": WEDGE},
    ],
}
SEVERAL = WHOLE | {
    "contact": [CONTACT, {"part": "left", "stiffness": 1.0}],
    "supports": {"displacement": {"top": [0.0, "t"]}, "temperature": {"top": "t"}},
}
CONTINUED = FOUNDATIONS | {"contact": [], "initial": {"from": "run/trajectory.h5", "time": 0.5}}
SCENES = {
    "whole": WHOLE,
    "file": FILE,
    "graded": GRADED,
    "adaptive": ADAPTIVE,
    "several": SEVERAL,
    "foundations": FOUNDATIONS,
    "continued": CONTINUED,
}
NEVER = [True, "no such thing!", {"surprise": 1.0}, [], [[]], [1.0] * 7, math.nan, math.inf, -math.inf, None, 10**400]
HOLDS: dict[str, list[int]] = {  # which of those a key can hold
    "title": [1],
    "contact": [3],
    "initial.from": [1],
    "supports.displacement": [3],
    "supports.temperature": [3],
    "supports.points": [3],
    "mesh.graded_to": [3],
    "time.graded_to": [3],
    "heat.heating.thermodynamic": [0],
}
SIGNED = (
    "poisson",
    "lame",
    "tensor",
    "source",
    "body",
    "traction",
    "heat_flux",
    "displacement",
    "velocity",
    "temperature",
    "alpha",
)


def leaves(data: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Every table, list and number, with its key."""
    if key:
        yield key, data
    if isinstance(data, dict):
        for name, value in data.items():
            yield from leaves(value, f"{key}.{name}" if key else name)
    elif isinstance(data, list) and data and isinstance(data[0], dict):
        for i, value in enumerate(data):
            yield from leaves(value, f"{key}.{i}")


def put(data: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    out: Any = copy.deepcopy(data)
    place, (*tables, last) = out, key.split(".")
    for table in tables:
        place = place[int(table) if isinstance(place, list) else table]
    place[int(last) if isinstance(place, list) else last] = value
    return out


def models(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    yield model
    for found in model.model_fields.values():
        todo = [found.annotation]
        while todo:
            one = todo.pop()
            if isinstance(one, type) and issubclass(one, BaseModel):
                yield from models(one)
            todo += get_args(one)


def test_the_scenes_here_hold_every_key() -> None:
    given = {key.rsplit(".", 1)[-1] for data in SCENES.values() for key, _ in leaves(data)}
    assert {one.alias or name for model in models(Scene) for name, one in model.model_fields.items()} <= given
    for data in SCENES.values():
        build(data)


CASES = [(name, key, i) for name, data in SCENES.items() for key, _ in leaves(data) for i in range(len(NEVER))]


@pytest.mark.parametrize("name", SCENES)
def test_what_a_key_cannot_hold_is_refused_by_its_name(name: str) -> None:
    wrong = []
    for _, key, i in (case for case in CASES if case[0] == name):
        if i in HOLDS.get(key, []):
            continue
        if NEVER[i] is None and not isinstance(WHOLE.get(key), str):
            continue  # absent, which most keys may be
        try:
            build(put(SCENES[name], key, NEVER[i]))
        except SceneError as error:
            lines = str(error).splitlines()
            if not any(line.startswith(key) or key.startswith(line.split(":")[0].split(" ")[0]) for line in lines):
                wrong.append((key, NEVER[i], lines))
        else:
            wrong.append((key, NEVER[i], "accepted"))
    assert wrong == []


@pytest.mark.parametrize("name", SCENES)
def test_no_number_is_negative_that_must_not_be(name: str) -> None:
    wrong = []
    for key, value in leaves(SCENES[name]):
        signed = any(part in SIGNED or part == "conductivity" for part in key.split("."))
        if signed or isinstance(value, bool) or not isinstance(value, int | float):
            continue
        try:
            build(put(SCENES[name], key, -value))
        except SceneError as error:
            if key not in str(error):
                wrong.append((key, str(error)))
        else:
            wrong.append((key, "accepted"))
    assert wrong == []
