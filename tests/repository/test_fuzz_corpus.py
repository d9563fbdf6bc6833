"""Inputs that once broke a reader of files, and those that reach every branch of it: none may crash, hang or raise at random.

`make fuzz` looks for more.
"""

from __future__ import annotations

import contextlib
import sys
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.folders import TESTS

from warmslip import SceneError, load
from warmslip.scene.reader import build, library

FUZZ = TESTS / "fuzz"
sys.path.insert(0, str(FUZZ))
import readers  # noqa: E402

# these are read; everything else is there for how it is refused
SOUND = {
    "checkpoint": ["resumed.json"],
    "formula": ["cases", "powers", "pulse"],
    "lists": ["five_nodes", "square", "tetrahedra"],
    "mesh": [
        "square.msh",
        "square_41.msh",
        "square_binary.msh",
        "two_tetrahedra.msh",
        "mixed_22.msh",
        "partitioned_41.msh",
        "prisms_22_binary.msh",
        "pyramids_41.msh",
        "second_order_41.msh",
        "signed_groups_41_binary.msh",
    ],
    "scene": ["mesh_file.toml", "paper_mixed.toml", "two_materials.toml"],
    "trajectory": ["two_steps.json"],
}


@pytest.mark.parametrize("reader", readers.READERS)
def test_every_input_of_the_corpus_is_read_or_refused(reader: str) -> None:
    read = {path.name: readers.READERS[reader](path.read_bytes()) for path in (FUZZ / "corpus" / reader).iterdir()}
    assert [name for name in SOUND[reader] if not read[name]] == []
    assert not all(read.values())


LEAVES = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8), st.just(10**400), st.just(16**5000)
)
VALUES = st.one_of(LEAVES, st.lists(LEAVES, max_size=3), st.dictionaries(st.sampled_from(["n", "one", "x"]), LEAVES))
SCENES = {name: load(name).resolved() for name in library()}


def places(tree: Any, at: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where a scene's data can be changed: every table, every key, every entry of a list."""
    inner = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [at, *(place for key, value in inner for place in places(value, (*at, key)))]


@settings(max_examples=300, deadline=None)
@given(name=st.sampled_from(sorted(SCENES)), value=VALUES, data=st.data())
def test_a_scene_with_any_value_anywhere_is_one_or_is_refused(name: str, value: Any, data: st.DataObject) -> None:
    place = data.draw(st.sampled_from(places(SCENES[name])[1:]))

    def changed(tree: Any, at: tuple[Any, ...]) -> Any:
        if not at:
            return value
        copy: Any = dict(tree) if isinstance(tree, dict) else list(tree)
        copy[at[0]] = changed(copy[at[0]], at[1:])
        return copy

    with contextlib.suppress(SceneError):
        build(changed(SCENES[name], place))
