"""MSH files of gmsh, formats 2.2 and 4.1, as text and binary. No number in a file is believed before the file is seen to hold
as much, so that reading takes memory and time in proportion to the file, whatever is in it."""

from __future__ import annotations

import re

from warmslip.mesh import msh22, msh41
from warmslip.mesh.raw import Raw
from warmslip.mesh.sections import CUT, section

VERSIONS = {b"2": msh22.parse, b"2.1": msh22.parse, b"2.2": msh22.parse, b"4.1": msh41.parse}
NAME = re.compile(rb'\s*(\d{1,9})\s+(-?\d{1,18})\s+"([^"\n]*)"\s*')


def parse(data: bytes) -> Raw:
    """A mesh from the bytes of an MSH file.

    Parameters
    ----------
    data : bytes
        The whole file.

    Returns
    -------
    Raw
        Nodes, elements, groups and names. Signs of group numbers, which give orientations, are left out.

    Raises
    ------
    ValueError
        For a file of another format or a broken one: one sentence with the cure.
    """
    head = section(data, b"MeshFormat").split(None, 3)
    version, binary, *_ = [*head, b"", b""]
    if not re.fullmatch(rb"\d[\d.]*", version):
        raise ValueError(f"$MeshFormat does not begin with a version; {CUT}")
    if version not in VERSIONS:
        raise ValueError(f"its format is MSH {version.decode()[:20]}; save it as MSH 4.1 or 2.2")
    if binary not in (b"0", b"1") or head[2:3] != [b"8"]:
        raise ValueError(f"its header is '{b' '.join(head[:3]).decode(errors='replace')[:40]}'; {CUT}")
    if binary == b"1" and not b"".join(head[3:]).startswith(b"\1\0\0\0"):
        raise ValueError("it was written on a machine with another order of bytes; save it as text")
    raw = Raw(names=_names(data))
    VERSIONS[version](data, binary == b"1", raw)
    return raw


def _names(data: bytes) -> list[tuple[int, int, str]]:
    """Dimension, number and name of every physical group that has one."""
    found = section(data, b"PhysicalNames", optional=True)
    if not found.strip():
        return []
    count, *lines = [line for line in found.split(b"\n") if line.strip()]
    out = []
    for line in lines:
        if (name := NAME.fullmatch(line)) is None:
            text = line.decode(errors="replace").strip()[:60]
            raise ValueError(f"a line of $PhysicalNames is '{text}'; give the group a name without quotes")
        out.append((int(name[1]), abs(int(name[2])), name[3].decode(errors="replace")))
    if count.strip() != str(len(out)).encode():
        raise ValueError(f"$PhysicalNames announces another number of names than the {len(out)} it holds; {CUT}")
    return out
