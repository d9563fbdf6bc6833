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
    for name, partitioned in ((b"Entities", False), (b"PartitionedEntities", True)):
        if found := section(data, name, optional=True):
            numbers = Numbers(found, binary)
            groups |= _entities(numbers, partitioned)
            numbers.finish()
    index = _nodes(Numbers(section(data, b"Nodes"), binary), raw)
    numbers = Numbers(section(data, b"Elements"), binary)
    for _ in range(int(numbers.take("size", 4)[0])):
        dim, entity, kind = numbers.take("int", 3).tolist()
        shape, size = gmsh_element(kind)
        rows = numbers.take("size", numbers.one("size") * (1 + size)).reshape(-1, 1 + size)
        raw.blocks.append(Block.of(shape, index(rows[:, 1:].astype(np.int64)), groups.get((dim, entity), ())))
    numbers.finish()


def _entities(numbers: Numbers, partitioned: bool) -> Groups:
    """The groups of every entity; a sign is the orientation of the entity in the group, a partition has those of its parent."""
    groups: Groups = {}
    if partitioned:
        numbers.one("size")  # how many partitions
        numbers.take("int", 2 * numbers.one("size"))  # ghosts
    for dim, count in enumerate(numbers.take("size", 4).tolist()):
        for _ in range(count):
            tag = numbers.one("int")
            if partitioned:
                numbers.take("int", 2)  # its parent
                numbers.take("int", numbers.one("size"))  # its partitions
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
