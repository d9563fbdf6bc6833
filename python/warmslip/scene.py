"""Scenes: what a user asks for, typed and checked before anything is assembled. No compiled code is needed here."""

from __future__ import annotations

import difflib
import hashlib
import json
import re
import tomllib
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar, get_args, get_origin

from pydantic import Discriminator, Field, Tag, ValidationError, model_validator

from warmslip import full_tables, mesh_files
from warmslip import tables as t
from warmslip.consistency import problems
from warmslip.expressions import NUMBER, decimal_comma, told


class SceneError(ValueError):
    """A scene that cannot be run; the message is one sentence a problem, each with its key and its cure."""


OneOrMore = Annotated[
    Annotated[t.ContactTable, Tag("one")] | Annotated[list[t.ContactTable], Tag("several")],
    Discriminator(lambda value: "several" if isinstance(value, list) else "one"),
]
LARGEST, DEEPEST = 10**6, 50  # of a scene file: characters, dots in a key


class Scene(t.Table):
    """A whole scene. Tables are blocks of the problem, and what is absent costs nothing; keys are those of the TOML file."""

    title: str = ""
    """One line that says what the scene is."""
    mesh: t.MeshTable
    time: t.TimeTable
    inertia: t.InertiaTable | None = None
    elasticity: t.IsotropicTable | None = None
    viscosity: t.IsotropicTable | None = None
    heat: t.HeatTable | None = None
    loads: t.LoadsTable = t.LoadsTable()
    supports: t.SupportsTable = t.SupportsTable()
    contact: OneOrMore | None = None
    regions: dict[str, t.RegionTable] = Field(default_factory=dict)
    initial: t.InitialTable = t.InitialTable()
    output: t.OutputTable = t.OutputTable()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if found := problems(self):
            raise ValueError("\n".join(found))
        return self

    @property
    def moves(self) -> bool:
        """Whether there is a velocity to solve for."""
        return (
            self.elasticity is not None
            or self.viscosity is not None
            or (self.inertia is not None and self.inertia.density > 0)
        )

    @property
    def contacts(self) -> list[t.ContactTable]:
        """The contact tables, also of one; none gives an empty list."""
        if self.contact is None:
            return []
        return self.contact if isinstance(self.contact, list) else [self.contact]

    @property
    def step(self) -> float:
        """k, time."""
        return self.time.end / self.time.steps

    def resolved(self) -> dict[str, Any]:
        """The scene as plain data, defaults filled in and absent tables left out."""
        return self.model_dump(mode="json", exclude_none=True)

    def digest(self) -> str:
        """A hash of the resolved scene and of its mesh file."""
        data = json.dumps(self.resolved(), sort_keys=True)
        if self.mesh.file is not None:
            data += mesh_files.read(self.mesh.file).digest
        return hashlib.sha256(data.encode()).hexdigest()[:16]

    def override(self, **values: Any) -> Self:
        """The scene with some keys replaced, dots written as in `override(**{"mesh.n": 64})`, None to leave a table out.

        Raises SceneError.
        """
        data = self.model_dump(mode="json", exclude_none=True, exclude_unset=True)  # what was left open stays so
        for key, value in values.items():
            _set(data, key, value.tolist() if hasattr(value, "tolist") else value)  # numbers and arrays of NumPy
        return _build(data, type(self))

    def _formulas(self) -> list[tuple[str, Any]]:
        """Data that are formulas, and supports that are not simply held at zero."""
        data: dict[str, Any] = {
            "loads.body": self.loads.body,
            **{f"loads.traction.{part}": value for part, value in self.loads.traction.items()},
            **{f"loads.heat_flux.{part}": value for part, value in self.loads.heat_flux.items()},
            "heat.source": self.heat.source if self.heat else 0.0,
            "initial.displacement": self.initial.displacement,
            "initial.velocity": self.initial.velocity,
            "initial.temperature": self.initial.temperature,
        }
        for contact in self.contacts:
            data["contact.gap"] = contact.gap
            exchange = contact.heat_exchange
            data["contact.heat_exchange.foundation_temperature"] = exchange.foundation_temperature if exchange else 0.0
        held = {"supports.displacement": self.supports.moved, "supports.temperature": self.supports.warmed}
        found = [(key, v) for key, value in data.items() for v in (value if isinstance(value, list) else [value])]
        return [(key, v) for key, v in found if isinstance(v, str)] + [
            (key, value) for key, value in held.items() if value
        ]

    def full(self) -> FullScene:
        """The same problem with every block there, those that were absent with no effect.

        Raises SceneError for what the whole model of the paper does not have: several or no contact parts, formulas,
        regions, other laws than linear compliance with Coulomb friction.
        """
        data = self.resolved()
        d = self.mesh.dim
        zero = [[0.0] * d for _ in range(d)]
        problems = [
            f"{key}: only constant data can be judged here, at zero on the supports; '{value}' is none"
            for key, value in self._formulas()
        ]
        if self.heat and self.heat.expansion and self.heat.expansion.reference_temperature != 0:
            problems.append(
                "heat.expansion.reference_temperature: only 0 can be judged here; measure temperatures from it"
            )
        if self.regions:
            problems.append("regions: only one material can be judged here; leave the table out")
        if len(self.contacts) != 1 or self.contacts[0].stiffness is None:
            problems.append("contact: one contact part with a stiffness is needed here")
        else:
            contact = self.contacts[0]
            if contact.rigid or contact.exponent != 1 or contact.pressure_limit or contact.heats:
                problems.append("contact: only linear compliance with a constant conductance can be judged here")
            if contact.friction and contact.friction != t.FrictionTable(coefficient=contact.friction.coefficient):
                problems.append("contact.friction: only Coulomb's law with a constant coefficient can be judged here")
            data["contact"] = contact.model_dump(mode="json", exclude_none=True)
        if problems:
            raise SceneError("\n".join(problems))
        for table in ("elasticity", "viscosity"):
            data.setdefault(table, {"lame": [0.0, 0.0]})
        data.setdefault("inertia", {"density": 0.0})
        heat = data.setdefault("heat", {"conductivity": zero})
        for table in ("expansion", "heating"):
            heat.setdefault(table, {"tensor": zero})
        if (alpha := heat["expansion"].pop("alpha", None)) is not None:
            assert self.elasticity is not None
            heat["expansion"]["tensor"] = alpha * self.elasticity.per_expansion(d)
        for holder, key in ((heat, "conductivity"), (heat["expansion"], "tensor"), (heat["heating"], "tensor")):
            if not isinstance(holder[key], list):
                holder[key] = [[holder[key] if i == j else 0.0 for j in range(d)] for i in range(d)]
        data["loads"].setdefault("body", [0.0] * d)
        return _build(data, FullScene)


class FullScene(Scene):
    """A scene in which every block is there and every datum is a constant: the paper's whole model."""

    inertia: t.InertiaTable
    elasticity: t.IsotropicTable
    viscosity: t.IsotropicTable
    heat: full_tables.FullHeatTable
    loads: full_tables.FullLoadsTable
    supports: full_tables.FullSupportsTable
    contact: full_tables.FullContactTable
    initial: full_tables.FullInitialTable = full_tables.FullInitialTable()


S = TypeVar("S", bound=Scene)


def library() -> list[str]:
    """Names of the scenes that come with the package."""
    folder = resources.files("warmslip") / "scenes"
    return sorted(p.name.removesuffix(".toml") for p in folder.iterdir() if p.name.endswith(".toml"))


def load(scene: str | Path, overrides: list[str] | None = None) -> Scene:
    """Reads a scene by library name or path and applies `key=value` overrides.

    Raises SceneError with a sentence for each problem: missing file, bad TOML, unknown key, wrong type, value out of range;
    TypeError for arguments of another kind.
    """
    if not isinstance(scene, str | Path):
        raise TypeError(f"scene: {told(scene)} is neither a name of the library nor a path; give one")
    if not isinstance(overrides, list | tuple | None) or not all(isinstance(one, str) for one in overrides or []):
        raise TypeError(
            f"overrides: {told(overrides)} is no list of texts; write ['mesh.n=8'], or load(...).override(**{{'mesh.n': 8}})"
        )
    path = Path(scene)
    if str(scene) in library():
        text = (resources.files("warmslip") / "scenes" / f"{scene}.toml").read_text()
    else:
        try:
            with path.open() as file:
                text = file.read(LARGEST + 1)
        except (OSError, ValueError) as error:  # ValueError: bytes that are no text, or a null byte in the name
            reason = error.strerror if isinstance(error, OSError) else "not a text file"
            near = difflib.get_close_matches(str(scene), library(), 1)
            hint = f"did you mean '{near[0]}'?" if near else f"give a file or one of {', '.join(library())}"
            raise SceneError(f"cannot read scene '{scene}' ({reason}); {hint}") from None
    if len(text) > LARGEST:
        raise SceneError(f"scene '{scene}' is longer than {LARGEST} characters; keep meshes and tables outside")
    if any(
        piece.count(".") > DEEPEST for piece in re.split(r"[=\[\]{},\n]", text)
    ):  # tomllib takes the square of their number
        raise SceneError(f"scene '{scene}' has a key with more than {DEEPEST} dots; correct it")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        if re.search(r"^\s*\[contact\]", text, re.M) and re.search(r"^\s*\[\[contact\]\]", text, re.M):
            raise SceneError(
                "contact: [contact] is one part, [[contact]] one of several; write [[contact]] for each"
            ) from None
        line, cure = _comma(text, str(error))
        if line:
            raise SceneError(f"scene '{scene}' has a decimal comma in line {line}; {cure}") from None
        raise SceneError(f"scene '{scene}' is not valid TOML: {error}; correct that line") from None
    except (ValueError, RecursionError) as error:
        raise SceneError(f"scene '{scene}' cannot be read ({_limit(error)}); write it more plainly") from None
    for item in overrides or []:
        key, equals, value = item.partition("=")
        if not equals or not key.strip():
            raise SceneError(f"'{item}' is no override; write table.key=value")
        _set(data, key.strip(), _parse(key.strip(), value.strip()))
    mesh = data.get("mesh")
    if isinstance(mesh, dict) and isinstance(mesh.get("file"), str) and path.exists():
        mesh["file"] = str(path.parent / mesh["file"])  # a mesh lies beside its scene
    return build(data)


def _comma(text: str, error: str) -> tuple[int, str]:
    """The line of a decimal comma at the place where tomllib gave up, and its cure; or 0 and nothing."""
    if at := re.search(r"at line (\d+), column (\d+)", error):
        line, column = int(at[1]), int(at[2]) - 1
        for found in re.finditer(rf"=[ \t]*{NUMBER}|[\[,][ \t]*([-+]?\d+),(0\d+)", here := text.split("\n")[line - 1]):
            if found.start() <= column and not here[found.end() : column].strip():
                whole, part = (found[1], found[2]) if found[1] else (found[3], found[4])
                several = f", or [{whole}, {part}] for two" if re.match(r"\s*(n|lengths|grading)\s*=", here) else ""
                return line, f"write {whole}.{part} with a point{several}"
    return 0, ""


def _parse(key: str, text: str) -> Any:
    """The value of an override; what is no TOML is a text. Raises SceneError for a list or a table with a decimal comma."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError) as error:
        _, cure = _comma(f"value = {text}", str(error)) if text.startswith(("[", "{")) else (0, "")
        if cure:
            raise SceneError(f"{key} = {told(text)}: a decimal comma; {cure}") from None
        return text


def _limit(error: Exception) -> str:
    """What tomllib cannot read although it is TOML."""
    return "tables or lists are nested too deeply" if isinstance(error, RecursionError) else "an integer is too long"


def _set(data: dict[str, Any], key: str, value: Any) -> None:
    *tables, last = key.split(".")
    place: Any = data
    for depth, table in enumerate(tables):
        here, rest = ".".join(tables[: depth + 1]), [*tables[depth + 1 :], last]
        if isinstance(place, list):  # of contact parts
            place = place[int(table)]
        elif here == f"contact.{table}" and table.isdecimal() and table not in place:
            raise SceneError(f"{key}: there is one contact part; write {'.'.join(['contact', *rest])}")
        else:
            place = place.setdefault(table, {})
        if isinstance(place, list) and place and isinstance(place[0], dict):
            if len(rest) < 2 or not rest[0].isdecimal() or int(rest[0]) >= len(place):
                names = [str(one.get("part")) for one in place if isinstance(one, dict)]
                number = names.index(rest[0]) if rest[0] in names else 0
                named = ".".join(rest[rest[0].isdecimal() or rest[0] in names :]) or "KEY"
                raise SceneError(f"{key}: {here} has the parts 0 to {len(place) - 1}; write {here}.{number}.{named}")
        elif not isinstance(place, dict):
            cure = f"give the whole list, {here}=[...]" if isinstance(place, list) else "give the value itself"
            raise SceneError(f"{key}: '{here}' is a value, not a table; {cure}")
    if value is None:
        place.pop(last, None)
    else:
        place[last] = value


def build(data: dict[str, Any]) -> Scene:
    """A checked scene from plain data; raises SceneError with all problems at once."""
    return _build(data, Scene)


def build_full(data: dict[str, Any]) -> FullScene:
    """A checked scene in which every block is there, from plain data; raises SceneError."""
    return _build(data, FullScene)


def _build(data: dict[str, Any], kind: type[S]) -> S:
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        # a union of types gives one error a member: the first tells what is wrong
        first: dict[str, str] = {}
        for e in error.errors():
            where = _where(e, data)
            first.setdefault(_key(where), _sentence(e, where))
        raise SceneError("\n".join(first.values())) from None


def _where(error: Any, data: Any) -> list[str]:
    """The keys that lead to a problem; pydantic puts names of types and tags between them, which no table here has."""
    found, place = [], data
    for part in error["loc"]:
        if part in place if isinstance(place, dict) else isinstance(place, list | tuple) and isinstance(part, int):
            found.append(str(part))
            place = place[part]
    return [*found, str(error["loc"][-1])] if error["type"] == "missing" else found


def _key(where: list[str]) -> str:
    return ".".join(where) or "scene"


def _sentence(error: Any, where: list[str]) -> str:
    key, given = _key(where), told(error.get("input"))
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
            return f"{key} is a table, not {given}; its keys are {', '.join(_allowed(where))}"
        case "list_type":
            return f"{key} = {given} is no list; write [{given}]"
        case "string_pattern_mismatch" if key.endswith("quadrature"):
            return f"{key} = {given} is unknown; use nodal, or gauss-1 to gauss-8"
        case "finite_number":
            return f"{key}: {given} is not a finite number; give one"
        case _ if isinstance(error.get("input"), str) and (cure := decimal_comma(error["input"])):
            if where[0] == "mesh":
                cure += f", or [{error['input']}] for two numbers"
            return f"{key} = {given}: a decimal comma; {cure}"
        case _:
            return f"{key} = {given}: {error['msg'][0].lower()}{error['msg'][1:]}; correct the value"


def _allowed(where: list[str]) -> list[str]:
    """The keys of the table at a place; numbers and free names lead into lists and tables of tables."""
    model: Any = Scene
    free = False  # the next part is a name that the user chose
    for part in where:
        fields = getattr(model, "model_fields", {})
        if free or part.isdigit():
            free = False
            continue
        model = _table(fields[part].annotation) if part in fields else None
        free = part in fields and get_origin(fields[part].annotation) is dict
    return sorted(getattr(model, "model_fields", {}))


def _table(annotation: Any) -> Any:
    """The table in a type such as ContactTable | list[ContactTable] | None, or None."""
    if isinstance(annotation, type) and issubclass(annotation, t.Table):
        return annotation
    return next((table for table in map(_table, get_args(annotation)) if table is not None), None)
