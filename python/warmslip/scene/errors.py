"""What is wrong with a scene, in sentences with the key and the cure."""

from __future__ import annotations

import difflib
from types import UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from warmslip.messages import quoted
from warmslip.scene.types import Table


class SceneError(ValueError):
    """A scene that cannot be run. The message is one sentence a problem, each with its key and its cure."""


M = TypeVar("M", bound=BaseModel)


def validated(data: dict[str, Any], model: type[M]) -> M:
    """The model of some data, such as a scene. Raises SceneError with all problems at once."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise refusal(error, data, model) from None


def refusal(error: ValidationError, data: dict[str, Any], model: type[BaseModel]) -> SceneError:
    """What is wrong with the data of a model, one sentence a problem."""
    first: dict[str, str] = {}  # a union of types gives one error a member: the first tells what is wrong
    for e in error.errors():
        where = _where(e, data)
        first.setdefault(_key(where), _sentence(e, where, model))
    return SceneError("\n".join(first.values()))


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


def _sentence(error: Any, where: list[str], model: type[BaseModel]) -> str:
    key, given = _key(where), quoted(error.get("input"))
    match error["type"]:
        case "extra_forbidden":
            allowed = _allowed(where[:-1], model)
            near = difflib.get_close_matches(where[-1], allowed, 1)
            hint = f"did you mean '{near[0]}'?" if near else f"the keys here are {', '.join(allowed)}"
            return f"{key}: unknown key; {hint}"
        case "missing":
            return f"{key}: missing; add it"
        case "value_error":
            message = str(error["ctx"]["error"])
            return message if key == "scene" else f"{key}: {message}"
        case "model_type" if where[-2:-1] == ["displacement"]:
            return f'{key} = {given}; write what each axis is held at, as in [0.0, "free"], or {{ normal = 0.0 }}'
        case "model_type":
            return f"{key} is a table, not {given}; its keys are {', '.join(_allowed(where, model))}"
        case "list_type" if isinstance(error.get("input"), dict):
            return f"{key} is a list of tables; write [[{key}]] once for each, or a list"
        case "list_type" if where[0] == "supports" and where[-1] in ("displacement", "temperature"):
            return f'{key} = {given} names no part; write ["top"], or {{ top = ... }}'
        case "list_type" if isinstance(error.get("input"), int | float):
            return f"{key} = {given} is no list; give an entry for each axis, as in [0.0, {given}]"
        case "list_type":
            return f"{key} = {given} is no list; write [{given}], with as many entries as it needs"
        case "too_short":
            return f"{key} = {given} has too few entries; give at least {error['ctx']['min_length']}"
        case "too_long":
            return f"{key} = {given} has too many entries; give at most {error['ctx']['max_length']}"
        case "string_pattern_mismatch" if key.endswith("quadrature"):
            return f"{key} = {given} is unknown; use nodal, or gauss-1 to gauss-8"
        case "literal_error" if key.endswith("stiffness"):
            return f"{key} = {given} is neither a number nor 'rigid'; write a number without quotes and with a decimal point"
        case "finite_number":
            return f"{key}: {given} is not a finite number; give one"
        case _:
            return f"{key} = {given}: {error['msg'][0].lower()}{error['msg'][1:]}; correct the value"


def _allowed(where: list[str], root: type[BaseModel]) -> list[str]:
    """The keys of the table at a place; numbers and free names lead into lists and tables of tables."""
    model: Any = root
    free = False  # the next part is a name that the user chose
    for part in where:
        fields = getattr(model, "model_fields", {})
        if free or part.isdigit():
            free = False
            continue
        model = _table(fields[part].annotation) if part in fields else None
        free = part in fields and any(get_origin(one) is dict for one in _members(fields[part].annotation))
    return sorted(one.alias or name for name, one in getattr(model, "model_fields", {}).items())


def _members(annotation: Any) -> tuple[Any, ...]:
    """The types of a union, or the type itself."""
    if get_origin(annotation) is Annotated:
        return _members(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType):
        return tuple(member for one in get_args(annotation) for member in _members(one))
    return (annotation,)


def _table(annotation: Any) -> Any:
    """The table in a type such as ContactTable | list[ContactTable] | None, or None."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return annotation
    return next((table for table in map(_table, get_args(annotation)) if table is not None), None)
