"""Sections of an MSH file and the numbers in them. No count is believed before the section is seen to hold as much."""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np

TYPES: dict[str, Any] = {
    "byte": np.dtype("u1"),
    "int": np.dtype("<i4"),
    "size": np.dtype("<u8"),
    "real": np.dtype("<f8"),
}
CUT = "save the mesh again"
SHORT = f"a section ends before all that it announces; {CUT}"


class Numbers:
    """The numbers of a section, from the first to the last. Its methods raise ValueError with the fault and its cure."""

    def __init__(self, section: bytes, binary: bool) -> None:
        self._binary, self._at = binary, 0
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy stops at what is no number and only warns
            try:
                self._all: Any = section if binary else np.fromstring(section.decode("ascii"), sep=" ")
            except (DeprecationWarning, UnicodeDecodeError):
                raise ValueError(f"a section holds something else than numbers; {CUT}") from None

    def take(self, kind: str, count: int) -> Any:
        """The next `count` numbers of a kind of TYPES."""
        size = TYPES[kind].itemsize if self._binary else 1
        if not 0 <= count * size <= len(self._all) - self._at:
            raise ValueError(SHORT)
        start, self._at = self._at, self._at + count * size
        if self._binary:
            return np.frombuffer(self._all, TYPES[kind], count, start)
        found = self._all[start : self._at]
        return found if kind == "real" else whole(found)

    def one(self, kind: str) -> int:
        return int(self.take(kind, 1)[0])

    def rest(self, kind: str) -> Any:
        """All whole numbers of a kind that are left."""
        size = TYPES[kind].itemsize if self._binary else 1
        return self.take(kind, (len(self._all) - self._at) // size)

    def finish(self) -> None:
        """Raises ValueError when something is left, which would be lost."""
        left = self._all[self._at :]
        if left.strip() if self._binary else len(left):
            raise ValueError(f"a section holds more than it announces; {CUT}")


def whole(found: Any) -> Any:
    """Numbers of a text that count or name, as integers. Raises ValueError for those that do not."""
    if not (np.abs(found) < 2**53).all():  # nan is not, either
        raise ValueError(f"a number that counts or names is not a whole one; {CUT}")
    return found.astype(np.int64)


def section(data: bytes, name: bytes, *, optional: bool = False) -> bytes:
    """What stands between $name and $Endname.

    Raises
    ------
    ValueError
        For a section that is missing, has no end, or is there twice.
    """
    text, begin = name.decode(), _start(data, name, 0)
    end = data.find(b"$End" + name, begin) if begin else -1
    if end < 0:
        if optional and not begin:
            return b""
        raise ValueError(f"${text} ... $End{text} is missing; {CUT}")
    if _start(data, name, end):
        raise ValueError(f"there are two sections ${text}; save each mesh in a file of its own")
    return data[begin:end]


def _start(data: bytes, name: bytes, at: int) -> int:
    """Where the next section of a name begins, behind the line with it; 0 for none."""
    while (at := data.find(b"$" + name, at)) >= 0:
        line = data.find(b"\n", at)
        if (at == 0 or data[at - 1 : at] == b"\n") and line >= 0 and not data[at + 1 + len(name) : line].strip(b" \r"):
            return line + 1
        at += 1
    return 0


def counted(found: bytes, binary: bool) -> tuple[int, Numbers]:
    """The count in the first line, text also in a binary file, and what follows."""
    line, _, rest = found.partition(b"\n")
    if not re.fullmatch(rb"\s*\d{1,18}\s*", line):
        raise ValueError(f"a section does not begin with a count; {CUT}")
    return int(line), Numbers(rest, binary)
