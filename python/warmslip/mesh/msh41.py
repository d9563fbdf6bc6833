"""The format MSH 4.1: blocks of nodes and elements by entity; entities have the physical groups."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip.mesh.elements import gmsh_element
from warmslip.mesh.raw import Block, NodeIndex, Raw
from warmslip.mesh.sections import Numbers, section

Groups = dict[tuple[int, int], tuple[int, ...]]  # of an entity by its dimension and number


def parse(data: bytes, binary: bool, raw: Raw) -> None:
    """Fills `raw`. Raises ValueError."""
    groups: Groups = {}
    partitions: Groups = {}
    for name, partitioned in ((b"Entities", False), (b"PartitionedEntities", True)):
        if found := section(data, name, optional=True):
            numbers = Numbers(found, binary)
            groups |= _entities(numbers, partitions if partitioned else None)
            numbers.finish()
    index = _nodes(Numbers(section(data, b"Nodes"), binary), raw)
    numbers = Numbers(section(data, b"Elements"), binary)
    found_in: dict[int, set[int]] = {}
    for _ in range(int(numbers.take("size", 4)[0])):
        dim, entity, kind = numbers.take("int", 3).tolist()
        shape, size = gmsh_element(kind)
        rows = numbers.take("size", numbers.one("size") * (1 + size)).reshape(-1, 1 + size)
        raw.blocks.append(Block.of(shape, index(rows[:, 1:].astype(np.int64)), groups.get((dim, entity), ())))
        found_in[dim] = found_in.get(dim, set()) | set(partitions.get((dim, entity), ()))
    numbers.finish()
    _refuse_one_of_several(found_in[max(found_in)] if found_in else set(), partitions)


def _refuse_one_of_several(here: set[int], partitions: Groups) -> None:
    """Raises ValueError for a file with the cells of some partitions alone."""
    if here and len(here) < (many := partitions[-1, 0][0]):
        some = ", ".join(map(str, sorted(here)))
        raise ValueError(
            f"the file holds partition {some} of {many} alone; save the mesh in one file (Mesh.PartitionSplitMeshFiles = 0)"
        )


def _entities(numbers: Numbers, partitions: Groups | None) -> Groups:
    """The groups of every entity; a sign is the orientation of the entity in the group, a partition has those of its parent.

    `partitions`, where given, receives those of every entity, and their number as that of the entity (-1, 0).
    """
    groups: Groups = {}
    if partitions is not None:
        partitions[-1, 0] = (int(numbers.one("size")),)
        numbers.take("int", 2 * numbers.one("size"))  # ghosts
    for dim, count in enumerate(numbers.take("size", 4).tolist()):
        for _ in range(count):
            tag = numbers.one("int")
            if partitions is not None:
                numbers.take("int", 2)  # its parent
                partitions[dim, tag] = tuple(numbers.take("int", numbers.one("size")).tolist())
            numbers.take("real", 6 if dim else 3)  # its bounding box
            signed = numbers.take("int", numbers.one("size"))
            groups[dim, tag] = tuple(dict.fromkeys(np.abs(signed).tolist()))
            if dim:
                numbers.take("int", numbers.one("size"))  # what bounds it
    return groups


def _nodes(numbers: Numbers, raw: Raw) -> NodeIndex:
    tags: list[Any] = [np.empty(0, np.int64)]
    nodes: list[Any] = [np.empty((0, 3))]
    for _ in range(int(numbers.take("size", 4)[0])):
        dim, _, parametric = numbers.take("int", 3).tolist()
        count = numbers.one("size")
        tags.append(numbers.take("size", count).astype(np.int64))
        width = 3 + (min(max(dim, 0), 3) if parametric else 0)
        nodes.append(numbers.take("real", width * count).reshape(-1, width)[:, :3])
    numbers.finish()
    raw.nodes, raw.tags = np.concatenate(nodes), np.concatenate(tags)
    return NodeIndex(raw.tags, raw.nodes)
