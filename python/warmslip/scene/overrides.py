"""Keys of a scene that are given beside its file: `mesh.n=64`."""

from __future__ import annotations

import tomllib
from typing import Any

from warmslip.scene.errors import SceneError


def parse(text: str) -> Any:
    """The value of an override; what is no TOML is a text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def replace(data: dict[str, Any], key: str, value: Any) -> None:
    """Puts a value into nested tables; None removes the key. Raises SceneError."""
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


def differing(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """The keys, with dots, whose values differ between two nested tables."""
    found = []
    for key in sorted(one.keys() | other.keys()):
        a, b = one.get(key), other.get(key)
        if isinstance(a, dict) and isinstance(b, dict):
            found += [f"{key}.{inner}" for inner in differing(a, b)]
        elif a != b:
            found.append(key)
    return found
