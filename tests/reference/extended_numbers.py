"""Numbers of 80 digits in NumPy arrays of objects (`arb` of python-flint), dense solves of them and Gauss's rules.

Eighty digits outlast any condition number met here (1e24 for a steel body in steps of a million transits of a wave), so
that what is left of an equation after a solve tells whether it was solved.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from flint import arb, arb_mat, ctx

ctx.dps = 80
ZERO, ONE = arb(0), arb(1)
Big = Any  # an array of arb, or one
Array = Any  # of floats

_big = np.frompyfunc(lambda x: arb(float(x)), 1, 1)
_mid = np.frompyfunc(lambda x: x.mid(), 1, 1)
_float = np.frompyfunc(float, 1, 1)


def big(values: Any) -> Big:
    """Doubles as they are, in 80 digits; the shape is kept."""
    return _big(np.asarray(values, dtype=float))


def mid(values: Big) -> Big:
    """The midpoints: from here on the numbers count as exact."""
    return _mid(values)


def floats(values: Big) -> Array:
    return np.asarray(_float(values), dtype=float)


def zeros(*shape: int) -> Big:
    out = np.empty(shape, dtype=object)
    out.fill(ZERO)
    return out


def eye(n: int) -> Big:
    out = zeros(n, n)
    out[np.arange(n), np.arange(n)] = ONE
    return out


def above(x: arb, y: arb = ZERO) -> bool:
    """x > y, of the midpoints."""
    return bool((x - y).mid() > 0)


def largest(values: Any) -> arb:
    """The largest size of any entry, 0 of none."""
    out = ZERO
    for x in np.ravel(values):
        if above(abs(x), out):
            out = abs(x).mid()
    return out


def matrix(values: Big) -> arb_mat:
    rows, columns = values.shape
    return arb_mat(rows, columns, values.ravel().tolist())


def entries(m: arb_mat) -> Big:
    """A matrix as an array (rows, columns)."""
    out = np.empty(m.nrows() * m.ncols(), dtype=object)
    out[:] = m.mid().entries()
    return out.reshape(m.nrows(), m.ncols())


def times(m: arb_mat, x: Big) -> Big:
    """Matrix times vector (n,)."""
    if not len(x):
        return zeros(m.nrows())
    return entries(m * arb_mat(len(x), 1, x.tolist()))[:, 0]


def solve(m: Big, right: Big) -> Big:
    """The solution (n,) or (n, columns) of a dense system. Raises ZeroDivisionError where it is singular."""
    columns = right if right.ndim == 2 else right[:, None]
    if not len(m):
        return right
    x = entries(matrix(m).solve(matrix(columns), algorithm="approx"))
    if not all(e.is_finite() for e in x.ravel()):
        raise ZeroDivisionError("singular matrix")
    return x if right.ndim == 2 else x[:, 0]


@cache
def gauss_jacobi(n: int, a: int) -> tuple[Big, Big]:
    """Points (n,) and weights (n,), summing to 1, for the weight (1 - x)^a on [0, 1]: roots of Jacobi's polynomial."""
    from scipy.special import roots_jacobi

    points = []
    for start in roots_jacobi(n, a, 0)[0]:
        x, step = arb(float(start)), arb("1e-30")
        for _ in range(8):
            slope = (arb.jacobi_p(x + step, n, a, 0) - arb.jacobi_p(x - step, n, a, 0)) / (2 * step)
            x = (x - arb.jacobi_p(x, n, a, 0) / slope).mid()
        points.append((1 + x) / 2)
    x = np.array(points, dtype=object)
    powers = np.array([x**i for i in range(n)], dtype=object)
    moments = zeros(n)  # of x^i (1 - x)^a (a + 1): (a + 1)! i! / (i + a + 1)!
    for i in range(n):
        moments[i] = arb(a + 1).gamma() * (a + 1) * arb(i + 1).gamma() / arb(i + a + 2).gamma()
    return mid(x), solve(powers, mid(moments))


@cache
def simplex_rule(dim: int, n: int) -> tuple[Big, Big]:
    """Stroud's conical product: barycentric coordinates (n^dim, dim + 1) and weights summing to 1.

    The first coordinate collapses: what the others leave over belongs to the simplex's first corner.
    """
    shape, weights = zeros(n**dim, dim + 1), zeros(n**dim) + ONE
    for q in range(n**dim):
        rest, digits = ONE, q
        for axis in range(dim):
            x, w = gauss_jacobi(n, dim - 1 - axis)
            shape[q, axis + 1] = rest * x[digits % n]
            weights[q] *= w[digits % n]
            rest *= 1 - x[digits % n]
            digits //= n
        shape[q, 0] = rest
    return mid(shape), mid(weights)
