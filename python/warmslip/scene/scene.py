"""A scene: what a user asks for, typed and checked before anything is assembled. No compiled code is needed here."""

from __future__ import annotations

import hashlib
import json
import os
from copy import deepcopy
from functools import lru_cache
from typing import Any, Self

from pydantic import ValidationError, model_validator

from warmslip.mesh import files
from warmslip.messages import Shown, quoted
from warmslip.scene.errors import SceneError, refusal, validated
from warmslip.scene.overrides import replace
from warmslip.scene.tables import SceneTables
from warmslip.scene.validation import problems


class Scene(Shown, SceneTables):
    """A whole scene. Tables are blocks of the problem, and what is absent costs nothing; keys are those of the TOML file."""

    def __init__(self, /, **tables: Any) -> None:
        """Raises SceneError, one sentence a problem: unknown key, wrong type, value out of range."""
        try:
            super().__init__(**tables)
        except ValidationError as error:
            raise refusal(error, tables, type(self)) from None

    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Self:
        """The scene of some tables, with the options of pydantic. Raises SceneError."""
        try:
            return super().model_validate(obj, **options)
        except ValidationError as error:
            raise refusal(error, obj, cls) from None

    @classmethod
    def model_validate_json(cls, json_data: str | bytes | bytearray, **options: Any) -> Self:
        """The scene of some tables as JSON, with the options of pydantic. Raises SceneError."""
        try:
            return super().model_validate_json(json_data, **options)
        except ValidationError as error:
            try:
                data = json.loads(json_data)
            except ValueError as wrong:
                raise SceneError(f"the scene is no JSON ({wrong}); correct it") from None
            raise refusal(error, data, cls) from None

    def _facts(self) -> dict[str, str]:
        mesh, time = self.mesh, self.time
        size = f"refined {mesh.refine} times" if mesh.file is not None else f"{' x '.join(map(str, mesh.counts))} cells"
        steps = f"{self.clock.steps} steps" if time.tolerance is None else f"steps with tolerance {time.tolerance:g}"
        present = ("inertia", "elasticity", "viscosity", "heat")
        parts = ", ".join(f"'{contact.part}'" for contact in self.contacts)
        return {
            "": quoted(self.title),
            "mesh": f"{mesh.name}, {size}",
            "time": f"{steps} to t = {time.end:g}",
            "model": ", ".join(name for name in present if getattr(self, name) is not None),
            **({"contact": f"on {parts}"} if parts else {}),
        }

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if found := problems(self):
            raise ValueError("\n".join(found))
        return self

    def digest(self) -> str:
        """A hash of the resolved scene and of its mesh file."""
        return self._hash(self.resolved())

    def digest_of_steps(self) -> str:
        """A hash of all that single steps depend on: the scene but for its end, the number of its steps and its output."""
        kept = {name: table for name, table in self.resolved().items() if name not in ("title", "output")}
        kept["time"] = {name: value for name, value in kept["time"].items() if name not in ("end", "steps")}
        return self._hash(kept | {"step": f"{self.step:.10e}"})

    def _hash(self, tables: dict[str, Any]) -> str:
        # of the run that it begins with, the content counts and not the path
        initial = {key: value for key, value in tables.get("initial", {}).items() if key != "from"}
        data = json.dumps(tables | {"initial": initial}, sort_keys=True)
        if self.mesh.file is not None:
            data += files.read(self.mesh.file).digest
        if self.initial.run is not None:
            data += _content(self.initial.run)
        return hashlib.sha256(data.encode()).hexdigest()[:16]

    def override(self, **values: Any) -> Self:
        """The scene with some keys replaced, dots written as in `override(**{"mesh.n": 64})`, None to leave a table out.

        Raises SceneError.
        """
        data = self.model_dump(
            mode="json", exclude_none=True, exclude_unset=True, by_alias=True
        )  # what was left open stays so
        for key, value in values.items():
            # numbers and arrays of NumPy; a table that is given stays as it is when a later key goes into it
            replace(data, key, value.tolist() if hasattr(value, "tolist") else deepcopy(value))
        return validated(data, type(self))


def _content(path: str) -> str:
    """A hash of a file, "" where there is none."""
    try:
        return _content_of(path, os.stat(path).st_mtime_ns)
    except OSError:
        return ""


@lru_cache(maxsize=8)
def _content_of(path: str, _: int) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]
