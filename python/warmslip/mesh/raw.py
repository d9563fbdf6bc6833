"""A mesh as a file gives it: nodes in space, elements of any shape, numbered groups and their names."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

MAX_GROUPS = 64  # of one entity: with more, memberships would be out of proportion to the file


@dataclass(frozen=True)
class Block:
    """Elements of one `shape` (a key of `elements.SHAPES`).

    nodes (m, k) are positions in `Raw.nodes`, corners first; element `member[i]` is in the physical group `group[i]`.
    """

    shape: str
    nodes: NDArray[np.int64]
    member: NDArray[np.int64]
    group: NDArray[np.int64]

    @classmethod
    def of(cls, shape: str, nodes: NDArray[np.int64], groups: tuple[int, ...]) -> Block:
        """Elements that are all in the same groups. Raises ValueError for more than MAX_GROUPS."""
        if len(groups) > MAX_GROUPS:
            raise ValueError(f"an entity is in {len(groups)} physical groups; put it into {MAX_GROUPS} at most")
        member = np.tile(np.arange(len(nodes)), len(groups))
        return cls(shape, nodes, member, np.repeat(np.array(groups, np.int64), len(nodes)))


@dataclass
class Raw:
    """Nodes (n, 3) and their numbers in the file (n,); elements; names as (dimension, number of the group, name)."""

    nodes: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    tags: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    blocks: list[Block] = field(default_factory=list)
    names: list[tuple[int, int, str]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


class NodeIndex:
    """Positions of nodes by their numbers.

    Raises ValueError for a number that two different places have.
    """

    def __init__(self, tags: NDArray[np.int64], nodes: NDArray[np.float64]) -> None:
        self._order = np.argsort(tags, kind="stable")
        self._tags = tags[self._order]
        again = np.flatnonzero(self._tags[1:] == self._tags[:-1])
        first, second = self._order[again], self._order[again + 1]
        if (nodes[first] != nodes[second]).any():
            raise ValueError(f"two nodes have the number {self._tags[again[0]]}; renumber the nodes")

    def __call__(self, used: NDArray[np.int64]) -> NDArray[np.int64]:
        """Positions of the nodes with the numbers `used`. Raises ValueError for a number that no node has."""
        at = np.searchsorted(self._tags, used)
        at[at == len(self._tags)] = 0
        if used.size and (len(self._tags) == 0 or (wrong := self._tags[at] != used).any()):
            number = used.flat[0] if len(self._tags) == 0 else used[wrong][0]
            raise ValueError(f"an element names node {number}, which the file does not hold; save the mesh again")
        return self._order[at]
