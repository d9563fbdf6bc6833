"""Exact arithmetic for the reference scheme: Fractions, the field Q(sqrt 3), elimination and determinants.

Arrays are NumPy's with objects in them: Fraction, Root3 or, for `eliminate`, mpmath's mpf.
"""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from functools import total_ordering
from typing import Any

import numpy as np

Exact = Any  # an array of exact numbers


@total_ordering
class Root3:
    """(p + q sqrt(3)) / d with integers in lowest terms, d > 0: an ordered field that contains the Fractions."""

    __slots__ = ("d", "p", "q")

    def __init__(self, p: int, q: int, d: int = 1) -> None:
        common = math.gcd(p, q, d) if d > 0 else -math.gcd(p, q, d)
        self.p, self.q, self.d = p // common, q // common, d // common

    @staticmethod
    def of(x: Any) -> Root3:
        """A Root3 from itself, a Fraction or an integer."""
        return x if isinstance(x, Root3) else Root3(int(x.numerator), 0, int(x.denominator))

    def __add__(self, other: Any) -> Root3:
        o = Root3.of(other)
        return Root3(self.p * o.d + o.p * self.d, self.q * o.d + o.q * self.d, self.d * o.d)

    def __mul__(self, other: Any) -> Root3:
        if isinstance(other, np.ndarray):
            return NotImplemented  # NumPy multiplies entry by entry
        o = Root3.of(other)
        return Root3(self.p * o.p + 3 * self.q * o.q, self.p * o.q + self.q * o.p, self.d * o.d)

    def __truediv__(self, other: Any) -> Root3:
        o = Root3.of(other)
        return self * Root3(o.p * o.d, -o.q * o.d, o.p**2 - 3 * o.q**2)

    def __rtruediv__(self, other: Any) -> Root3:
        return Root3.of(other) / self

    def __neg__(self) -> Root3:
        return Root3(-self.p, -self.q, self.d)

    def __sub__(self, other: Any) -> Root3:
        return self + -Root3.of(other)

    def __rsub__(self, other: Any) -> Root3:
        return -self + other

    __radd__, __rmul__ = __add__, __mul__

    def sign(self) -> int:
        """-1, 0 or 1: the larger of |p| and |q| sqrt(3) decides."""
        larger = self.p if self.p**2 > 3 * self.q**2 else self.q
        return (larger > 0) - (larger < 0)

    def __abs__(self) -> Root3:
        return -self if self.sign() < 0 else self

    def __eq__(self, other: object) -> bool:
        o = Root3.of(other)
        return (self.p, self.q, self.d) == (o.p, o.q, o.d)

    def __lt__(self, other: Any) -> bool:
        return (self - other).sign() < 0

    def __hash__(self) -> int:
        return hash((self.p, self.q, self.d)) if self.q else hash(Fraction(self.p, self.d))

    def __float__(self) -> float:
        root = math.isqrt(3 * self.q**2 << 1024)  # with 512 bits behind the point, for where the two terms cancel
        return float(Fraction((self.p << 512) + (root if self.q > 0 else -root), self.d << 512))


def exact(values: Any) -> Exact:
    """Numbers, nested or not, as Fractions: the decimals that are written, not the doubles that stand for them."""
    return np.vectorize(lambda x: Fraction(str(x)), otypes=[object])(values)


def floats(values: Exact) -> Any:
    """The nearest doubles."""
    return np.vectorize(float, otypes=[float])(values)


def zeros(*shape: int) -> Exact:
    return np.full(shape, Fraction(0), dtype=object)


def eye(n: int) -> Exact:
    return exact(np.eye(n, dtype=int))


def eliminate(matrix: Exact, right: Exact) -> tuple[Exact, Exact] | None:
    """(x, kernel) with matrix (n, n) x = right (n, columns) and matrix kernel = 0; None without a solution. Gauss-Jordan."""
    n, row = len(matrix), 0
    table, pivots = np.hstack([matrix, right]), []
    for column in range(n):
        best = max(range(row, n), key=lambda i: abs(table[i, column]), default=n)
        if best == n or table[best, column] == 0:
            continue
        table[[row, best]] = table[[best, row]]
        table[row] = table[row] / table[row, column]
        for i in range(n):
            if i != row and table[i, column] != 0:
                table[i] = table[i] - table[i, column] * table[row]
        pivots.append(column)
        row += 1
    if any(x != 0 for x in table[row:, n:].ravel()):
        return None
    free = [c for c in range(n) if c not in pivots]
    x, kernel = zeros(n, right.shape[1]), zeros(n, len(free))
    x[pivots] = table[:row, n:]
    kernel[pivots] = -table[:row, free]
    kernel[free] = eye(len(free))
    return x, kernel


def determinant(matrix: Exact) -> Any:
    """Leibniz's sum."""
    n, total = len(matrix), Fraction(0)
    for order in itertools.permutations(range(n)):
        inversions = sum(order[i] > order[j] for i in range(n) for j in range(i + 1, n))
        total += (-1) ** inversions * math.prod((matrix[i, order[i]] for i in range(n)), start=Fraction(1))
    return total


def root(x: Fraction) -> Fraction:
    """The square root, rounded to a relative 2^-256 or better."""
    shift = 512 + max(0, x.denominator.bit_length() - x.numerator.bit_length())
    return Fraction(math.isqrt(x.numerator * x.denominator << 2 * shift), x.denominator << shift)


def square_root(x: Fraction) -> Fraction:
    """The exact root; ValueError when it is irrational."""
    root = Fraction(math.isqrt(x.numerator), math.isqrt(x.denominator))
    if root * root != x:
        raise ValueError(f"{x} is no square of a fraction; give contact facets a rational measure")
    return root
