"""How much friction a step bears before it may have several solutions. `linear_pieces` has the exact value in the plane.

A contact force lambda leaves the points the velocity w = free - C lambda. Let A be C with 1/(weight c k) added to its normal
entries, c the stiffness and k the step. Of two solutions of one step, delta being the difference of their forces, every point has

    delta_n (A delta)_n <= 0,     delta_tau . (C delta)_tau <= mu |delta_n| |(C delta)_tau|                               (1)

the first because the pressure grows with the penetration, the second from Coulomb's law. With any weights p_i, q_i, t_i > 0 the
sum of the first, p_i times, and the second, q_i times, gives

    delta . S delta <= 1/2 sum_i q_i mu_i (t_i |delta_n,i|^2 + |(C delta)_tau,i|^2 / t_i),     S = sym(diag(p, q) A)       (2)

so the solution is unique where the largest eigenvalue of the right side over the left one is below 1. The gap has no part in it.

Where points outnumber nodes, or two parts meet, A is singular: some forces move nothing (`shared`). One solution then means one
velocity, whatever the shares. As long as no normal force with friction is among the shares, the foundation's answer to a velocity
is a convex set of nodal forces, the degree of the step is 1 for all mu, and determinants of one sign, shares aside, mean one
velocity again; (2) holds on what the shares leave, with p = q = 1 for their normal forces. Otherwise a share changes a friction
bound, and nothing is proved.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cholesky, eigh, solve_triangular
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from warmslip.typing import Array

NOTHING = 1e-10  # relative: what forces move that move nothing
SMALL, DENSE = (
    100,
    600,
)  # unknowns up to which Lanczos's method is not worth it; and up to which points have weights of their own
TRIES, TOP, SHARP, WORST = 120, 8, 40.0, 1e3
MAX_LOG_WEIGHT = 16.0  # logarithm of a weight, where the bound grows beyond all limits
COARSE = (  # p, t of all points, the likely ones first
    *itertools.product((4.0, 1.0), (4.0, 16.0, 1.0)),
    *itertools.product((4.0, 1.0), (0.25, 64.0, 256.0)),
    *itertools.product((16.0, 64.0), (4.0, 16.0, 1.0, 64.0, 0.25, 256.0)),
)


@dataclass(frozen=True, kw_only=True)
class ContactPoints:
    """The contact points of a body in one step.

    Attributes
    ----------
    compliance : (d points, d points)
        Velocity per force, C.
    normals : (points, d)
        Outward unit normals of the body.
    weights : (points,)
        Quadrature weights, area.
    step : float
        k, time.
    stiffness : (points,)
        c_nu, pressure per penetration: the steepest rise of the law; infinite on a rigid foundation.
    friction : (points,)
        mu, dimensionless. A constant bound (Tresca) is 0 here, as it leaves one solution.
    rubs : (points,)
        Whether there is a tangential force, as a constant bound has one too; where mu > 0 unless given.
    """

    compliance: Array
    normals: Array
    weights: Array
    step: float
    stiffness: Array
    friction: Array
    rubs: Array | None = None

    def of(self, points: Array) -> ContactPoints:
        """Some of the points, by index or mask (points,); the others bear no force."""
        d = self.normals.shape[1]
        kept = np.arange(len(self.weights))[points]
        rows = (kept[:, None] * d + np.arange(d)).ravel()
        return replace(
            self,
            compliance=self.compliance[np.ix_(rows, rows)],
            normals=self.normals[kept],
            weights=self.weights[kept],
            stiffness=self.stiffness[kept],
            friction=self.friction[kept],
            rubs=None if self.rubs is None else self.rubs[kept],
        )

    @property
    def rubbing(self) -> ContactPoints:
        """The points that a force moves and the foundation presses: the others have no part in the question."""
        own = np.diag(self.compliance).reshape(self.normals.shape).sum(axis=1)
        rubs = (own > 0) & (self.stiffness > 0)
        return self if rubs.all() else self.of(rubs)

    @cached_property
    def balanced(self) -> _Balanced:
        """A by what its forces move."""
        return _Balanced.of(self)

    @property
    def frames(self) -> Array:
        """Normal and tangents of the points as columns, (points, d, d), orthonormal."""
        frames = np.zeros((*self.normals.shape, self.normals.shape[1]))
        for frame, nu in zip(frames, self.normals, strict=True):
            if len(nu) == 2:
                frame[:] = np.column_stack([nu, (-nu[1], nu[0])])
            else:
                first = np.cross(nu, np.eye(3)[np.argmin(np.abs(nu))])
                first /= np.linalg.norm(first)
                frame[:] = np.column_stack([nu, first, np.cross(nu, first)])
        return frames

    @property
    def operator(self) -> Array:
        """A, (d points, d points): the normal components of all points, then the tangential ones by point."""
        n, d = self.normals.shape
        frames, blocks = self.frames, self.compliance.reshape(n, d, n, d)
        turned = np.einsum("iam,iajb,jbn->imjn", frames, blocks, frames, optimize=True).reshape(n * d, n * d)
        order = np.concatenate([np.arange(n) * d, np.delete(np.arange(n * d), np.arange(n) * d)])
        a = turned[np.ix_(order, order)]
        a[range(n), range(n)] += 1 / (self.weights * self.stiffness * self.step)
        return np.asarray(a)


@dataclass(frozen=True)
class _Balanced:
    """A with ones on its diagonal, its rows and columns those of the forces that are there; `scale` makes it of A.

    `there` are the places of these forces in A, `moved` and `shares`, (forces, many), span the forces that move something and
    those that move nothing.
    """

    matrix: Array
    scale: Array
    there: Any
    moved: Array
    shares: Array

    @classmethod
    def of(cls, points: ContactPoints) -> _Balanced:
        a, (n, d) = points.operator, points.normals.shape
        rubs = points.friction > 0 if points.rubs is None else points.rubs
        there = np.flatnonzero(np.concatenate([np.ones(n, dtype=bool), np.repeat(rubs, d - 1)]))
        scale = 1 / np.sqrt(np.maximum(np.diag(a)[there], np.finfo(float).tiny))
        matrix = scale[:, None] * a[np.ix_(there, there)] * scale
        values, vectors = eigh(matrix)
        moves = values > NOTHING * values.max(initial=0.0)
        return cls(matrix, scale, there, vectors[:, moves], vectors[:, ~moves])

    def shared(self, count: int) -> Any:
        """The points, of `count`, whose normal forces are among the shares, as a mask (points,)."""
        return np.linalg.norm(self.shares[:count], axis=1) > np.sqrt(NOTHING)


def shares_friction(points: ContactPoints) -> bool:
    """Whether points with friction share their normal forces in many ways, so that no mu is known to leave one solution.

    On a rigid foundation more Gauss points than nodes do, and the two parts that meet in a corner.
    """
    points = points.rubbing
    return bool(np.any(points.balanced.shared(len(points.weights))[points.friction > 0]))


def bound(points: ContactPoints, *, enough: float = np.inf) -> float:
    """The number by which all coefficients of friction may be multiplied so that every step surely has one solution.

    Any dimension, number of points and load. 0 where nothing is proved, as on a rigid foundation with more Gauss points than
    nodes, whose forces are shared in many ways. Sufficient alone: see `exact`.

    Parameters
    ----------
    points
        Compliance, law and step. The coefficients may differ; a point without friction has 0.
    enough
        Looks for no larger bound than this one, dimensionless.

    Returns
    -------
    float
        Dimensionless; infinite without friction.

    Notes
    -----
    All weights give a bound, the best one found counts: first `COARSE` ones that are the same for all points, then, up to `DENSE`
    unknowns, those that L-BFGS finds on the logarithm of the largest eigenvalue, smoothed over the `TOP` largest. It solves at
    most 24 + `TRIES` eigenvalue problems of order d points: 0.1 s for 20 points, 1 s for 80 in space, 3 s for 250 in the plane.
    """
    points = points.rubbing
    if not np.any(points.friction > 0):
        return np.inf
    if shares_friction(points):
        return 0.0
    n, form, best, start = len(points.weights), _Form(points), 0.0, COARSE[0]
    for pair in COARSE:
        found = form.value(*np.full((3, n), np.array([[pair[0]], [1.0], [pair[1]]])))
        best, start = max((best, start), (found, pair))
        if best >= enough:
            return best
    if form.size > DENSE:
        return best

    def target(x: Array) -> tuple[float, Array]:
        nonlocal best
        if best >= enough:
            return 0.0, np.zeros_like(x)
        found, value, slope = form.at(*np.split(np.exp(x), 3))
        best = max(best, found)
        return value, slope

    tries = int(TRIES * min(1.0, (2 * DENSE / 3 / form.size) ** 2))
    first = np.repeat(np.log([start[0], 1.0, start[1]]), n)
    from scipy.optimize import minimize  # a tenth of a second, for few scenes

    minimize(
        target,
        first,
        jac=True,
        method="L-BFGS-B",
        bounds=[(-MAX_LOG_WEIGHT, MAX_LOG_WEIGHT)] * len(first),
        options={"maxfun": tries, "maxcor": 20},
    )
    return best


class _Form:
    """The two sides of (2) for all weights."""

    def __init__(self, points: ContactPoints) -> None:
        a, n, balanced = points.operator, len(points.weights), points.balanced
        own = np.diag(a)[n:].reshape(n, -1).sum(axis=1)
        slips = own > 0  # a point that supports hold does not, and has no friction to count
        mu = np.where(slips, points.friction, 0.0)
        self._n, self._across = n, points.normals.shape[1] - 1
        # both sides of (2) vanish on forces that move nothing, where all weights of these are the same
        self._free, self._apart = balanced.shares.shape[1] == 0, ~balanced.shared(n)
        base = np.zeros((len(a), balanced.moved.shape[1]))
        base[balanced.there] = np.diag(balanced.scale) if self._free else balanced.scale[:, None] * balanced.moved
        self._mu, self._own = mu, np.where(slips, own, 1.0)
        self._a, self._base, self._moved = a @ base, base, a[n:] @ base
        self.size = base.shape[1]

    def _sides(self, p: Array, q: Array, t: Array) -> tuple[Array, Array]:
        n, mu = self._n, q * self._mu
        weights = np.concatenate([np.where(self._apart, p, q), np.repeat(q, self._across)])
        left = self._base.T @ (weights[:, None] * self._a)
        right = self._moved.T @ (np.repeat(mu / (t * self._own), self._across)[:, None] * self._moved)
        right += self._base[:n].T @ ((mu * t * self._own)[:, None] * self._base[:n])
        return (left + left.T) / 2, right / 2

    def at(self, p: Array, q: Array, t: Array) -> tuple[float, float, Array]:
        """The bound by weights (points,), t over a point's own compliance; what to minimise; its slope by their logarithms."""
        n, (left, right) = self._n, self._sides(p, q, t)
        try:
            values, vectors = eigh(right, left, subset_by_index=[max(self.size - TOP, 0), self.size - 1])
        except LinAlgError:  # the left side is not definite
            return 0.0, WORST, np.zeros(3 * n)
        kept = values > 0.5 * values[-1]
        values, vectors = values[kept], vectors[:, kept]
        shares = (values / values[-1]) ** SHARP
        value = np.log(values[-1]) + np.log(shares.sum()) / SHARP
        moved, reach = self._moved @ vectors, (t * self._own)[:, None]
        forces = self._base @ vectors
        pressing = reach * forces[:n] ** 2
        along = (moved**2).reshape(n, self._across, -1).sum(axis=1) / reach
        work = (forces[n:] * moved).reshape(n, self._across, -1).sum(axis=1)
        mu = (q * self._mu / 2)[:, None]
        by_p = -(self._apart * p)[:, None] * forces[:n] * (self._a[:n] @ vectors)
        by_q = mu * (pressing + along) / values - q[:, None] * work
        by_t = mu * (pressing - along) / values
        slope = np.concatenate([by_p, self._free * by_q, by_t]) @ (shares / shares.sum())
        return float(1 / values[-1]), float(value), slope

    def value(self, p: Array, q: Array, t: Array) -> float:
        """The bound alone."""
        left, right = self._sides(p, q, t)
        try:
            if not right.any():  # nothing slips with friction
                return np.inf
            if self.size <= SMALL:
                return float(1 / eigh(right, left, eigvals_only=True)[-1])
            return 1 / _largest(right, cholesky(left, lower=True))
        except (LinAlgError, ArpackError):  # the left side is not definite
            return 0.0


def _largest(right: Array, factor: Array) -> float:
    """The largest eigenvalue of L^-1 right L^-T by Lanczos's method, to 1e-6."""

    def apply(x: Array) -> Array:
        half = solve_triangular(factor, x, lower=True, trans="T")
        return np.asarray(solve_triangular(factor, right @ half, lower=True))

    operator = LinearOperator(right.shape, matvec=apply, dtype=float)
    start = np.ones(len(right))
    return float(eigsh(operator, k=1, tol=1e-6, v0=start, return_eigenvectors=False)[0])
