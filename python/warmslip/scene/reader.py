"""Scenes by name or from a file."""

from __future__ import annotations

import difflib
import re
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from warmslip.messages import quoted
from warmslip.scene.errors import SceneError, validated
from warmslip.scene.overrides import parse, replace
from warmslip.scene.scene import Scene

MAX_SCENE_CHARS, MAX_KEY_DOTS = 10**6, 50  # of a scene file: characters, dots in a key


def library() -> list[str]:
    """Names of the scenes that come with the package."""
    folder = resources.files("warmslip") / "scenes"
    return sorted(p.name.removesuffix(".toml") for p in folder.iterdir() if p.name.endswith(".toml"))


def load(scene: str | Path, overrides: list[str] | None = None) -> Scene:
    """Reads a scene by library name or path and applies overrides.

    Parameters
    ----------
    scene : str or Path
        Name of a scene of the library, or path of a TOML file.
    overrides : list of str, optional
        Keys to replace, written `table.key=value` as on the command line.

    Returns
    -------
    Scene
        The checked scene.

    Raises
    ------
    SceneError
        One sentence a problem: missing file, invalid TOML, unknown key, wrong type, value out of range.
    TypeError
        For arguments of another kind.
    """
    if not isinstance(scene, str | Path):
        raise TypeError(f"scene: {quoted(scene)} is neither a name of the library nor a path; give one")
    if not isinstance(overrides, list | tuple | None) or not all(isinstance(one, str) for one in overrides or []):
        raise TypeError(
            f"overrides: {quoted(overrides)} is no list of texts; write ['mesh.n=8'], or load(...).override(**{{'mesh.n': 8}})"
        )
    path = Path(scene)
    if str(scene) in library():
        text = (resources.files("warmslip") / "scenes" / f"{scene}.toml").read_text(encoding="utf-8")
    else:
        try:
            with path.open(encoding="utf-8-sig") as file:  # some editors begin a file with a byte-order mark
                text = file.read(MAX_SCENE_CHARS + 1)
        except (OSError, ValueError) as error:  # ValueError: bytes that are no text, or a null byte in the name
            raise SceneError(f"cannot read scene '{scene}' {_unread(error, scene)}") from None
    if len(text) > MAX_SCENE_CHARS:
        raise SceneError(f"scene '{scene}' is longer than {MAX_SCENE_CHARS} characters; keep meshes and tables outside")
    if any(
        piece.count(".") > MAX_KEY_DOTS for piece in re.split(r"[=\[\]{},\n]", text)
    ):  # tomllib takes the square of their number
        raise SceneError(f"scene '{scene}' has a key with more than {MAX_KEY_DOTS} dots; correct it")
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        if re.search(r"^\s*\[contact\]", text, re.M) and re.search(r"^\s*\[\[contact\]\]", text, re.M):
            raise SceneError(
                "contact: [contact] is one part, [[contact]] one of several; write [[contact]] for each"
            ) from None
        raise SceneError(
            f"scene '{scene}' is not valid TOML: {error}; correct that line (decimals take a point)"
        ) from None
    except (ValueError, RecursionError) as error:
        raise SceneError(f"scene '{scene}' cannot be read ({_limit(error)}); write it more plainly") from None
    for item in overrides or []:
        key, equals, value = item.partition("=")
        if not equals or not key.strip():
            raise SceneError(f"'{item}' is no override; write table.key=value")
        replace(data, key.strip(), parse(value.strip()))
    mesh = data.get("mesh")
    if isinstance(mesh, dict) and isinstance(mesh.get("file"), str) and path.exists():
        mesh["file"] = str(path.parent / mesh["file"])  # a mesh lies beside its scene
    initial = data.get("initial")
    if isinstance(initial, dict) and isinstance(initial.get("from"), str) and path.exists():
        initial["from"] = str(path.parent / initial["from"])
    return build(data)


def _unread(error: Exception, scene: str | Path) -> str:
    """Why a scene was not read, and what to do."""
    if isinstance(error, UnicodeDecodeError):
        return "(not a text file in UTF-8); save it in that encoding"
    if isinstance(error, OSError) and not isinstance(error, FileNotFoundError):
        return f"({error.strerror}); give a TOML file, and check its rights"
    reason = error.strerror if isinstance(error, OSError) else "no file has that name"
    near = difflib.get_close_matches(str(scene), library(), 1)
    return f"({reason}); " + (f"did you mean '{near[0]}'?" if near else f"give a file or one of {', '.join(library())}")


def _limit(error: Exception) -> str:
    """What tomllib cannot read although it is TOML."""
    return "tables or lists are nested too deeply" if isinstance(error, RecursionError) else "an integer is too long"


def build(data: dict[str, Any]) -> Scene:
    """A checked scene from plain data; raises SceneError with all problems at once."""
    return validated(data, Scene)
