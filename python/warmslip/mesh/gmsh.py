"""MSH files of gmsh, formats 2.2 and 4.1, as text and binary. No number in a file is believed before the file is seen to hold
as much, so that reading takes memory and time in proportion to the file, whatever is in it."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

# gmsh's number of an element and how many nodes it has: points, lines, triangles, tetrahedra of first order
KINDS = {15: 1, 1: 2, 2: 3, 4: 4}
TYPES: dict[str, Any] = {
    "byte": np.dtype("u1"),
    "int": np.dtype("<i4"),
    "size": np.dtype("<u8"),
    "real": np.dtype("<f8"),
}
SHORT = "a section ends before all that it announces"
NAME = re.compile(rb'\s*(\d+)\s+(-?\d+)\s+"([^"\n]*)"\s*')


@dataclass
class Raw:
    """Nodes (n, 3); blocks of elements: how many nodes each has, their numbers from 0, the physical groups they are in."""

    nodes: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    blocks: list[tuple[int, NDArray[np.int64], tuple[int, ...]]] = field(default_factory=list)
    names: dict[tuple[int, int], str] = field(default_factory=dict)  # by dimension and number of a group


class _Numbers:
    """The numbers of a section, from the first to the last."""

    def __init__(self, section: bytes, binary: bool) -> None:
        self._binary, self._at = binary, 0
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy stops at what is no number and only warns
            try:
                self._all: Any = section if binary else np.fromstring(section.decode("ascii"), sep=" ")
            except (DeprecationWarning, UnicodeDecodeError):
                raise ValueError("a section holds something else than numbers") from None

    def take(self, kind: str, count: int) -> Any:
        size = TYPES[kind].itemsize if self._binary else 1
        if not 0 <= count * size <= len(self._all) - self._at:
            raise ValueError(SHORT)
        start, self._at = self._at, self._at + count * size
        if self._binary:
            return np.frombuffer(self._all, TYPES[kind], count, start)
        found = self._all[start : self._at]
        if kind != "real" and not (np.abs(found) < 2**53).all():  # nan is not, either
            raise ValueError("a number that counts or names is not a whole one")
        return found if kind == "real" else found.astype(np.int64)

    def rest(self, kind: str) -> Any:
        """All that a text has left."""
        return self.take(kind, len(self._all) - self._at)

    def one(self, kind: str) -> int:
        return int(self.take(kind, 1)[0])


def parse(data: bytes) -> Raw:
    """Raises ValueError with what is wrong."""
    head = _section(data, b"MeshFormat").split(None, 3)
    version, binary, *_ = [*head, b"", b""]
    if version not in (b"2", b"2.2", b"4.1") or binary not in (b"0", b"1") or head[2:3] != [b"8"]:
        raise ValueError(f"its format is {b' '.join(head[:3]).decode(errors='replace')[:40] or 'none'}")
    if binary == b"1" and not b"".join(head[3:]).startswith(b"\1\0\0\0"):
        raise ValueError("it was written on a machine with another order of bytes")
    raw = Raw()
    for line in _section(data, b"PhysicalNames", optional=True).split(b"\n")[1:]:
        if found := NAME.fullmatch(line):
            raw.names[int(found[1]), int(found[2])] = found[3].decode(errors="replace")
    (_old if version.startswith(b"2") else _new)(data, binary == b"1", raw)
    return raw


def _section(data: bytes, name: bytes, *, optional: bool = False) -> bytes:
    begin = re.search(rb"^\$" + name + rb"[ \r]*\n", data, re.MULTILINE)
    end = data.find(b"$End" + name, begin.end()) if begin else -1
    if begin is None or end < 0:
        if optional and begin is None:
            return b""
        raise ValueError(f"${name.decode()} ... $End{name.decode()} is missing")
    return data[begin.end() : end]


def _numbered(tags: Any, used: Any) -> Any:
    """Positions in `tags` of what is used."""
    order = np.argsort(tags, kind="stable")
    at = np.searchsorted(tags, used, sorter=order)
    if len(tags) == 0 or (at == len(tags)).any() or (tags[order[at]] != used).any():
        raise ValueError("an element names a node that is not there")
    return order[at]


def _new(data: bytes, binary: bool, raw: Raw) -> None:
    groups: dict[tuple[int, int], tuple[int, ...]] = {}
    if section := _section(data, b"Entities", optional=True):
        numbers = _Numbers(section, binary)
        for dim, count in enumerate(numbers.take("size", 4).tolist()):
            for _ in range(count):
                tag = numbers.one("int")
                numbers.take("real", 6 if dim else 3)  # its bounding box
                groups[dim, tag] = tuple(numbers.take("int", numbers.one("size")).tolist())
                if dim:
                    numbers.take("int", numbers.one("size"))  # what bounds it
    numbers = _Numbers(_section(data, b"Nodes"), binary)
    tags, nodes = [np.empty(0, np.int64)], [raw.nodes]
    for _ in range(int(numbers.take("size", 4)[0])):
        if numbers.take("int", 3)[2]:
            raise ValueError("its nodes have parameters; save it without them")
        count = numbers.one("size")
        tags.append(numbers.take("size", count).astype(np.int64))
        nodes.append(numbers.take("real", 3 * count).reshape(-1, 3))
    raw.nodes, known = np.concatenate(nodes), np.concatenate(tags)
    numbers = _Numbers(_section(data, b"Elements"), binary)
    for _ in range(int(numbers.take("size", 4)[0])):
        dim, entity, kind = numbers.take("int", 3).tolist()
        size, count = _size(kind), numbers.one("size")
        rows = numbers.take("size", count * (1 + size)).reshape(-1, 1 + size).astype(np.int64)
        raw.blocks.append((size, _numbered(known, rows[:, 1:]), groups.get((dim, entity), ())))


def _size(kind: int) -> int:
    if kind not in KINDS:
        raise ValueError(
            f"it holds elements of gmsh's type {kind}; only triangles and tetrahedra of first order can be read"
        )
    return KINDS[kind]


def _old(data: bytes, binary: bool, raw: Raw) -> None:
    count, numbers = _counted(_section(data, b"Nodes"), binary)
    if binary:
        rows = numbers.take("byte", 28 * count).view([("tag", "<i4"), ("x", "<f8", 3)])
        known, raw.nodes = rows["tag"].astype(np.int64), rows["x"].copy()
    else:
        table = numbers.take("real", 4 * count).reshape(-1, 4)
        known, raw.nodes = table[:, 0], table[:, 1:].copy()
    count, numbers = _counted(_section(data, b"Elements"), binary)
    runs: list[tuple[int, int, list[list[int]]]] = []  # of neighbours with as many nodes in the same group
    read = _heads(numbers, count) if binary else _lines(numbers, count)
    for size, group, nodes in read:
        if not runs or runs[-1][:2] != (size, group):
            runs.append((size, group, []))
        runs[-1][2].append(nodes)
    for size, group, found in runs:
        raw.blocks.append((size, _numbered(known, np.array(found, np.int64)), (group,)))


def _counted(section: bytes, binary: bool) -> tuple[int, _Numbers]:
    """The count in the first line, text also in a binary file, and what follows."""
    line, _, rest = section.partition(b"\n")
    if not re.fullmatch(rb"\s*\d{1,18}\s*", line):
        raise ValueError("a section does not begin with a count")
    return int(line), _Numbers(rest, binary)


def _lines(numbers: _Numbers, count: int) -> Iterator[tuple[int, int, list[int]]]:
    """Elements of a text: number, type, how many tags, tags (the physical group first), nodes."""
    left, at = numbers.rest("int").tolist(), 0
    for _ in range(count):
        head = left[at + 1 : at + 3]
        size, tags = _size(head[0]) if head else 0, max(head[-1], 0) if head else 0
        row = left[at + 3 : at + 3 + tags + size]
        if not head or len(row) < tags + size:
            raise ValueError(SHORT)
        at += 3 + len(row)
        yield size, row[0] if tags else 0, row[tags:]


def _heads(numbers: _Numbers, count: int) -> Iterator[tuple[int, int, list[int]]]:
    """Elements of a binary file: type, how many of it, how many tags; then for each its number, tags and nodes."""
    while count > 0:
        kind, many, tags = numbers.take("int", 3).tolist()
        size = _size(kind)
        if many < 1 or tags < 0:
            raise ValueError("a section announces less than nothing")
        for row in numbers.take("int", many * (1 + tags + size)).reshape(many, -1).tolist():
            yield size, row[1] if tags else 0, row[1 + tags :]
        count -= many
