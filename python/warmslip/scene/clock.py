"""The times of a run: blocks of equal steps."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

SAME = 1e-12  # relative difference of step sizes that are one


@dataclass(frozen=True)
class Block:
    """`steps` steps of equal `size` from time `begin` to time `end`."""

    begin: float
    end: float
    steps: int
    size: float

    def time(self, n: int) -> float:
        """The end of step n of the block, time: the number next to the exact one; 0.3 is the end of step 3 of 4 to 0.4."""
        first, share, whole = self._exact
        return (first + n * share) / whole

    @cached_property
    def _exact(self) -> tuple[int, int, int]:
        """Integers with which the end of step n is (first + n share) / whole, of the times as they are written."""
        begin, end = Fraction(repr(self.begin)), Fraction(repr(self.end))
        common = math.lcm(begin.denominator, end.denominator)
        return int(begin * common) * self.steps, int((end - begin) * common), common * self.steps


@dataclass(frozen=True)
class Clock:
    """All steps of a run. A size that occurs in several blocks is the same number in each, so that factors serve again."""

    blocks: tuple[Block, ...]

    @cached_property
    def _last(self) -> list[int]:
        """The number of the last step of every block, counted from 1."""
        return list(accumulate(block.steps for block in self.blocks))

    @property
    def steps(self) -> int:
        """Number of steps."""
        return self._last[-1]

    @property
    def end(self) -> float:
        """Last time."""
        return self.blocks[-1].end

    @property
    def shortest(self) -> float:
        """The smallest step size, time."""
        return min(block.size for block in self.blocks)

    @property
    def longest(self) -> float:
        """The largest step size, time."""
        return max(block.size for block in self.blocks)

    @property
    def sizes(self) -> list[float]:
        """The different step sizes, in the order of their first use; each needs a factorization."""
        return list(dict.fromkeys(block.size for block in self.blocks))

    def step(self, n: int) -> tuple[float, float]:
        """End and size of step n = 1, 2, ..., times."""
        i = bisect_left(self._last, n)
        block = self.blocks[i]
        return block.time(n - (self._last[i] - block.steps)), block.size

    @property
    def times(self) -> NDArray[np.float64]:
        """The ends of all steps, (steps,), time."""
        return np.array([block.time(n) for block in self.blocks for n in range(1, block.steps + 1)])


def uniform(end: float, steps: int) -> Clock:
    """`steps` equal steps to time `end`."""
    return Clock((Block(0.0, end, steps, end / steps),))


def graded(end: float, steps: int, to: Sequence[float], halvings: int) -> Clock:
    """Steps that shrink towards the times `to`, in blocks of equal steps.

    Parameters
    ----------
    end : float
        Last time.
    steps : int
        The longest step is at most end/steps.
    to : sequence of float
        Times in [0, end].
    halvings : int
        Between such a time and the next one, or half way to it if that is graded too, lies a length L. The blocks are L 2^-m,
        L 2^-m, L 2^(1-m), ..., L/2 long for m halvings, each with the same number of steps. A solution that starts like t^(3/4)
        costs the first block (2^-m k)^(3/4) and the others O(k). Twice the `steps` give times that contain these.

    Returns
    -------
    Clock
        The blocks in their order.
    """
    special = sorted({0.0, end, *to})
    lengths: list[tuple[float, float, int]] = []
    for a, b in pairwise(special):
        left, right = a in to, b in to
        middle = a + (b - a) / 2
        if left and right:
            lengths += _towards_begin(a, middle, steps / end, halvings)
            lengths += _towards_end(middle, b, steps / end, halvings)
        elif left:
            lengths += _towards_begin(a, b, steps / end, halvings)
        elif right:
            lengths += _towards_end(a, b, steps / end, halvings)
        else:
            lengths.append((a, b, _count(b - a, steps / end)))
    sizes: list[float] = []
    blocks = []
    for begin, stop, count in lengths:
        size = (stop - begin) / count
        known = next((one for one in sizes if abs(one - size) <= SAME * one), None)
        if known is None:
            sizes.append(known := size)
        blocks.append(Block(begin, stop, count, known))
    return Clock(tuple(blocks))


def _count(length: float, rate: float) -> int:
    return max(1, math.ceil(length * rate * (1 - SAME)))


def _towards_begin(a: float, b: float, rate: float, halvings: int) -> list[tuple[float, float, int]]:
    cuts = [a, *(a + (b - a) * 2.0 ** (i - halvings) for i in range(halvings)), b]
    count = _count((b - a) / (2 if halvings else 1), rate)
    return [(begin, end, count) for begin, end in pairwise(cuts)]


def _towards_end(a: float, b: float, rate: float, halvings: int) -> list[tuple[float, float, int]]:
    cuts = [a, *(b - (b - a) * 2.0 ** (i - halvings) for i in reversed(range(halvings))), b]
    count = _count((b - a) / (2 if halvings else 1), rate)
    return [(begin, end, count) for begin, end in pairwise(cuts)]
