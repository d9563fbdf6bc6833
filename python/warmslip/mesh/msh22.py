"""The format MSH 2.2: one row for each element, repeated for each of its physical groups."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from warmslip.mesh.elements import gmsh_element
from warmslip.mesh.raw import Block, NodeIndex, Raw
from warmslip.mesh.sections import SHORT, counted, section, whole


def parse(data: bytes, binary: bool, raw: Raw) -> None:
    """Fills `raw`. Raises ValueError."""
    if section(data, b"ParametricNodes", optional=True):
        raise ValueError("its nodes have parameters; save it with Mesh.SaveParametric = 0")
    count, numbers = counted(section(data, b"Nodes"), binary)
    if binary:
        rows = numbers.take("byte", 28 * count).view([("tag", "<i4"), ("x", "<f8", 3)])
        raw.tags, raw.nodes = rows["tag"].astype(np.int64), rows["x"].copy()
    else:
        table = numbers.take("real", 4 * count).reshape(-1, 4)
        raw.tags, raw.nodes = whole(table[:, 0]), table[:, 1:].copy()
    numbers.finish()
    index = NodeIndex(raw.tags, raw.nodes)
    count, numbers = counted(section(data, b"Elements"), binary)
    flat = numbers.rest("int")
    numbers.finish()
    for shape, groups, nodes in _binary(flat, count) if binary else _text(flat, count):
        inside = np.flatnonzero(groups)  # 0 is no group
        raw.blocks.append(Block(shape, index(nodes.astype(np.int64)), inside, np.abs(groups[inside]).astype(np.int64)))
    if raw.names and raw.blocks and not any(len(block.group) for block in raw.blocks):
        raise ValueError(
            "its physical groups have names but no elements, as gmsh writes MSH 2.2 with Mesh.SaveAll = 1; save it with "
            "Mesh.SaveAll = 0, or as MSH 4.1"
        )


Rows = Iterator[tuple[str, Any, Any]]  # shape, the group of each element, its nodes


def _text(flat: Any, count: int) -> Rows:
    """Rows: number, type, how many tags, tags (the physical group first), nodes."""
    at = 0
    while count > 0:
        kind, tags = _head(flat, at + 1, 2)
        shape, size = gmsh_element(kind)
        width = 3 + tags + size
        rows = _alike(flat, at, width, np.array([1, 2]), count)
        yield shape, _groups(rows[:, 3:], tags), rows[:, 3 + tags :]
        at, count = at + rows.size, count - len(rows)
    _ended(flat, at)


def _binary(flat: Any, count: int) -> Rows:
    """Headers of three numbers, type, how many of it, how many tags; then for each its number, tags and nodes."""
    at = 0
    while count > 0:
        kind, many, tags = _head(flat, at, 3)
        shape, size = gmsh_element(kind)
        if many == 1:  # as gmsh writes them
            rows = _alike(flat, at, 4 + tags + size, np.arange(3), count)
            at, rows = at + rows.size, rows[:, 3:]
        else:
            end = at + 3 + many * (1 + tags + size)
            if not 1 <= many <= count or end > len(flat):
                raise ValueError(SHORT)
            rows = flat[at + 3 : end].reshape(many, -1)
            at = end
        yield shape, _groups(rows[:, 1:], tags), rows[:, 1 + tags :]
        count -= len(rows)
    _ended(flat, at)


def _head(flat: Any, at: int, length: int) -> list[int]:
    """The numbers before the tags, of which the last says how many tags follow."""
    head: list[int] = flat[at : at + length].tolist()
    if len(head) < length or head[-1] < 0:
        raise ValueError(SHORT)
    return head


def _alike(flat: Any, at: int, width: int, columns: Any, most: int) -> Any:
    """The rows of `width` numbers from `at` on that agree with the first one in some columns; `most` of them at most."""
    fit = min(most, (len(flat) - at) // width)
    if fit < 1:
        raise ValueError(SHORT)
    first, found, chunk = flat[at + columns], 1, 1
    while found < fit:
        end = min(found + chunk, fit)
        rows = flat[at + found * width : at + end * width].reshape(-1, width)
        other = (rows[:, columns] != first).any(axis=1)
        if other.any():
            found += int(other.argmax())
            break
        found, chunk = end, 2 * chunk  # so that short runs cost no more than long ones
    return flat[at : at + found * width].reshape(found, width)


def _groups(tagged: Any, tags: int) -> Any:
    return tagged[:, 0] if tags else np.zeros(len(tagged), np.int64)


def _ended(flat: Any, at: int) -> None:
    if at < len(flat):
        raise ValueError("a section holds more than it announces; save the mesh again")
