"""Scenes: what a user asks for, typed and checked before anything is assembled. No compiled code is needed here."""

from __future__ import annotations

import difflib
import hashlib
import json
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, Self

from pydantic import ValidationError, model_validator

from warmslip import tables as t

SHORTEST = 1e-150  # step, time: its inverse is squared on the way


class SceneError(ValueError):
    """A scene that cannot be run; the message is one sentence a problem, each with its key and its cure."""


class Scene(t.Table):
    """A whole scene. Tables are blocks of the problem; keys are those of the TOML file."""

    title: str = ""
    mesh: t.MeshTable
    time: t.TimeTable
    inertia: t.InertiaTable
    elasticity: t.IsotropicTable
    viscosity: t.IsotropicTable
    heat: t.HeatTable
    loads: t.LoadsTable
    supports: t.SupportsTable
    contact: t.ContactTable
    initial: t.InitialTable = t.InitialTable()
    output: t.OutputTable = t.OutputTable()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        problems = [*self._part_problems(), *self._size_problems(), *self._tensor_problems()]
        if self.inertia.density == 0 and not self.supports.displacement:
            problems.append(
                "supports.displacement: the momentum operator is singular without support and without inertia; "
                "clamp a part or give inertia.density > 0"
            )
        if self.step < SHORTEST:
            problems.append(f"time: a step of {self.step:g} is too short to divide by; take fewer steps or a later end")
        if problems:
            raise ValueError("\n".join(problems))
        return self

    def _part_problems(self) -> list[str]:
        known = t.PARTS[self.mesh.shape]
        held = self.supports.displacement
        named = {
            "supports.displacement": self.supports.displacement,
            "supports.temperature": self.supports.temperature,
            "loads.traction": list(self.loads.traction),
            "contact.part": [self.contact.part],
        }
        found = [
            f"{key}: unknown boundary part '{part}'; a {self.mesh.shape} has {', '.join(known)}"
            for key, parts in named.items()
            for part in parts
            if part not in known
        ]
        found += [
            f"loads.traction.{part}: the part is clamped and a traction on it does nothing; remove one of the two"
            for part in self.loads.traction
            if part in held
        ]
        for key in ("displacement", "temperature"):
            parts = getattr(self.supports, key)
            if len(set(parts)) < len(parts):
                found.append(f"supports.{key}: a part is named twice; name each once")
            if self.contact.part in parts:
                found.append(f"supports.{key}: '{self.contact.part}' is the contact part and cannot be held; remove it")
        return found

    def _size_problems(self) -> list[str]:
        d = self.mesh.dim
        vectors = {
            "loads.body": self.loads.body,
            "initial.displacement": self.initial.displacement,
            "initial.velocity": self.initial.velocity,
            **{f"loads.traction.{part}": value for part, value in self.loads.traction.items()},
        }
        found = [
            f"{key} has {len(value)} components; a {self.mesh.shape} needs {d}"
            for key, value in vectors.items()
            if value is not None and len(value) != d
        ]
        for key, tensor in self._matrices().items():
            if len(tensor) != d or any(len(row) != d for row in tensor):
                found.append(f"{key} must be a {d} x {d} matrix")
            elif any(tensor[i][j] != tensor[j][i] for i in range(d) for j in range(i)):
                found.append(f"{key} must be symmetric; set its entries [i][j] and [j][i] equal")
        return found

    def _tensor_problems(self) -> list[str]:
        d, found = self.mesh.dim, []
        stiff = False
        for key in ("elasticity", "viscosity"):
            table: t.IsotropicTable = getattr(self, key)
            if d == 3 and table.assumption in ("plane_stress", "plane_strain"):
                found.append(f"{key}.assumption: {table.assumption} has no meaning in a cube; use solid")
                continue
            lam, mu = table.pair(d)
            if mu < 0 or d * lam + 2 * mu < 0:
                found.append(f"{key}: the tensor must not be negative; it needs mu >= 0 and {d} lambda + 2 mu >= 0")
            stiff = stiff or mu > 0
        if not found and not stiff and self.inertia.density == 0:
            found.append(
                "inertia.density: without inertia, viscosity and elasticity there is no momentum operator; give one of them"
            )
        k = self.heat.conductivity
        if (
            len(k) == d
            and all(len(row) == d for row in k)
            and _smallest_eigenvalue(k) < -1e-12 * max(abs(x) for r in k for x in r)
        ):
            found.append("heat.conductivity must not have a negative eigenvalue; heat would flow from cold to hot")
        return found

    def _matrices(self) -> dict[str, list[list[float]]]:
        return {
            "heat.conductivity": self.heat.conductivity,
            "heat.expansion.tensor": self.heat.expansion.tensor,
            "heat.heating.tensor": self.heat.heating.tensor,
        }

    @property
    def step(self) -> float:
        """k, time."""
        return self.time.end / self.time.steps

    def resolved(self) -> dict[str, Any]:
        """The scene as plain data, defaults filled in."""
        return self.model_dump(mode="json")

    def digest(self) -> str:
        """A hash of the resolved scene."""
        return hashlib.sha256(json.dumps(self.resolved(), sort_keys=True).encode()).hexdigest()[:16]

    def override(self, **values: Any) -> Scene:
        """The scene with some keys replaced, dots written as in `override(**{"mesh.n": 64})`; raises SceneError."""
        data = self.model_dump(mode="json", exclude_none=True)
        for key, value in values.items():
            _set(data, key, value)
        return build(data)


def _smallest_eigenvalue(matrix: list[list[float]]) -> float:
    import numpy as np

    return float(np.linalg.eigvalsh(np.array(matrix))[0])


def library() -> list[str]:
    """Names of the scenes that come with the package."""
    folder = resources.files("warmslip") / "scenes"
    return sorted(p.name.removesuffix(".toml") for p in folder.iterdir() if p.name.endswith(".toml"))


def load(scene: str | Path, overrides: list[str] | None = None) -> Scene:
    """Reads a scene by library name or path and applies `key=value` overrides.

    Raises SceneError with a sentence for each problem: missing file, bad TOML, unknown key, wrong type, value out of range.
    """
    path = Path(scene)
    if str(scene) in library():
        text = (resources.files("warmslip") / "scenes" / f"{scene}.toml").read_text()
    else:
        try:
            text = path.read_text()
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "not a text file"
            near = difflib.get_close_matches(str(scene), library(), 1)
            hint = f"did you mean '{near[0]}'?" if near else f"give a file or one of {', '.join(library())}"
            raise SceneError(f"cannot read scene '{scene}' ({reason}); {hint}") from None
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"scene '{scene}' is not valid TOML: {error}; correct that line") from None
    for item in overrides or []:
        key, equals, value = item.partition("=")
        if not equals or not key.strip():
            raise SceneError(f"'{item}' is no override; write table.key=value")
        _set(data, key.strip(), _parse(value.strip()))
    return build(data)


def _parse(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _set(data: dict[str, Any], key: str, value: Any) -> None:
    *tables, last = key.split(".")
    for depth, table in enumerate(tables):
        data = data.setdefault(table, {})
        if not isinstance(data, dict):
            raise SceneError(f"{key}: '{'.'.join(tables[: depth + 1])}' is a value, not a table")
    data[last] = value


def build(data: dict[str, Any]) -> Scene:
    """A checked scene from plain data; raises SceneError with all problems at once."""
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        # a union of types gives one error a member: the first tells what is wrong
        first: dict[str, str] = {}
        for e in error.errors():
            first.setdefault(_key(e), _sentence(e))
        raise SceneError("\n".join(first.values())) from None


def _where(error: Any) -> list[str]:
    return [str(part) for part in error["loc"] if not str(part).startswith(("int", "list[", "constrained"))]


def _key(error: Any) -> str:
    return ".".join(_where(error)) or "scene"


def _sentence(error: Any) -> str:
    where, key = _where(error), _key(error)
    given = error.get("input")
    match error["type"]:
        case "extra_forbidden":
            allowed = _allowed(where[:-1])
            near = difflib.get_close_matches(where[-1], allowed, 1)
            hint = f"did you mean '{near[0]}'?" if near else f"the keys here are {', '.join(allowed)}"
            return f"{key}: unknown key; {hint}"
        case "missing":
            return f"{key}: missing; add it"
        case "value_error":
            message = str(error["ctx"]["error"])
            return message if key == "scene" else f"{key}: {message}"
        case "model_type":
            return f"{key} is a table, not {given!r}; its keys are {', '.join(_allowed(where))}"
        case "finite_number":
            return f"{key}: {given} is not a finite number; give one"
        case _:
            return f"{key} = {given!r}: {error['msg'][0].lower()}{error['msg'][1:]}; correct the value"


def _allowed(where: list[str]) -> list[str]:
    model: Any = Scene
    for part in where:
        field = model.model_fields.get(part) if hasattr(model, "model_fields") else None
        model = field.annotation if field else None
    return sorted(model.model_fields) if hasattr(model, "model_fields") else []
