"""The pieces of a step in the plane: the exact bound on friction, and all solutions of small steps.

With the symbols of `uniqueness`, a step in the plane is a piecewise linear map with four pieces a point, and at most four of
them meet at an edge of codimension two. Such a map is one to one for all loads if, and only if, the determinants of its
pieces have one sign (Kuhn & Loewen, Linear Algebra Appl. 96, 1987; Scholtes, Introduction to Piecewise Differentiable
Equations, 2012). They change it first where a set of slipping points has det(A_nn + sum of +-mu_i columns of A_ntau) = 0,
with points that stick eliminated: an eigenvalue problem.

Forces that move nothing, see `uniqueness`, are left out of the determinants.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warmslip.model.uniqueness import NOTHING, ContactPoints, shares_friction
from warmslip.typing import Array

POINTS = 8  # of which all statuses are looked at: 4^8 = 65,536
ROUNDING, DISTINCT = 1e-12, 1e-9  # relative: of the law, and between two solutions


def exact(points: ContactPoints) -> float:
    """The number by which all coefficients may be multiplied until some load has several solutions, or none, in the plane.

    Below it every load has one solution, of which the velocities count where points share their forces. Looks at all statuses:
    at most `POINTS` points, seconds for 8.

    Parameters
    ----------
    points
        Compliance, law and step; the law piecewise linear with Coulomb's friction or none, d = 2.

    Returns
    -------
    float
        Dimensionless; infinite where no friction makes a difference.

    Raises
    ------
    ValueError
        In space, for more points, or where `shares_friction`.
    """
    points = points.rubbing
    _refuse(points)
    if shares_friction(points):
        raise ValueError("points with friction share their normal forces in many ways; give one law or fewer points")
    step = _Pieces(points)
    rough, smooth = np.flatnonzero(points.friction > 0).tolist(), np.flatnonzero(points.friction == 0).tolist()
    most = 0.0
    for size in range(1, len(rough) + 1):
        rest = list(itertools.product((1.0, -1.0), repeat=size - 1))
        signs = np.hstack([np.ones((len(rest), 1)), np.array(rest).reshape(len(rest), size - 1)])
        for slips in itertools.combinations(rough, size):
            others = [i for i in rough if i not in slips]
            for sticks in _subsets(others):
                for pressed in _subsets(smooth):
                    most = max(most, step.first_change(list(slips), sticks, pressed, signs))
    return 1 / most if most > NOTHING else np.inf


def _subsets(of: list[int]) -> Iterator[list[int]]:
    for count in range(len(of) + 1):
        yield from map(list, itertools.combinations(of, count))


def _refuse(points: ContactPoints) -> None:
    if points.normals.shape[1] != 2 or len(points.weights) > POINTS:
        raise ValueError(f"all statuses are looked at for at most {POINTS} points in the plane; give fewer")


class _Pieces:
    """The pieces of a step in the plane: every point is open, sticks or slips one way, or without friction is pressed."""

    def __init__(self, points: ContactPoints) -> None:
        balanced, n, mu = replace(points, rubs=None).balanced, len(points.weights), points.friction
        self._a, self._singular = balanced.matrix, balanced.shares.shape[1] > 0
        along = np.flatnonzero(mu > 0)
        self._along = np.zeros(n, dtype=int)
        self._along[along] = n + np.arange(len(along))
        self._mu = np.zeros(n)
        self._mu[along] = mu[along] * balanced.scale[along] / balanced.scale[n:]

    def first_change(self, slips: list[int], sticks: list[int], pressed: list[int], signs: Array) -> float:
        """The reciprocal of the least factor of mu at which a determinant of these statuses vanishes."""
        a, along = self._a, self._along
        held, free = pressed + sticks + along[sticks].tolist(), slips + along[slips].tolist()
        rows = a[np.ix_(slips, free)]
        if held:
            rows = rows - a[np.ix_(slips, held)] @ self._solve(a[np.ix_(held, held)], a[np.ix_(held, free)])
        size = len(slips)
        pull = np.linalg.solve(rows[:, :size], rows[:, size:]) * self._mu[slips]
        values = np.linalg.eigvals(pull * signs[:, None, :])
        real = np.abs(values.imag) <= 1e-9 * np.abs(values).max()
        return float(np.abs(values.real[real]).max(initial=0.0))

    def _solve(self, matrix: Array, right: Array) -> Array:
        """Any of the shares will do, as all move the body alike."""
        if self._singular:
            return np.asarray(np.linalg.pinv(matrix, rcond=NOTHING, hermitian=True) @ right)
        return np.linalg.solve(matrix, right)


@dataclass(frozen=True)
class Solution:
    """One solution of a step: `force` of the body on the foundation and `velocity`, (points, d); `status` as in the core."""

    force: Array
    velocity: Array
    status: list[int]  # 0 open, 1 stick, 2 slip


def solutions(points: ContactPoints, free: Array, penetration: Array) -> list[Solution]:
    """All solutions of one step in the plane: every status of every point is solved and held against the law.

    At most `POINTS` points with a linear pressure and Coulomb's friction that share no forces. A load at which
    solutions branch may have a whole line of them, of which the ends are found. Costs 4^points small systems,
    seconds for 8 points.

    Parameters
    ----------
    points
        Compliance, law and step, d = 2.
    free : (points, d)
        Velocity without contact forces.
    penetration : (points,)
        u_nu - g at the start of the step with the gap of its end, length.

    Returns
    -------
    list
        At least one below `exact` times the coefficients, for any load.

    Raises
    ------
    ValueError
        In space, for more points, or where forces move nothing and every share of them is a solution.
    """
    _refuse(points)
    if points.rubbing.balanced.shares.shape[1] > 0:
        raise ValueError("the points share their forces in many ways; take contact.quadrature = 'nodal' and one part")
    n, frames, a = len(points.weights), points.frames, points.operator
    drive = np.einsum("iam,ia->mi", frames, np.asarray(free, dtype=float)).ravel()
    drive[:n] += np.asarray(penetration, dtype=float) / points.step
    forces: list[Array] = []
    statuses = np.stack(np.unravel_index(np.arange(4**n), (4,) * n), axis=1)
    for some in np.array_split(statuses, max(1, len(statuses) // 4096)):
        for force in _lawful(a, drive, points.friction, some):
            size = np.abs(force).max()
            if all(np.abs(force - other).max() > DISTINCT * max(size, np.abs(other).max()) for other in forces):
                forces.append(force)
    return [_told(points, force, np.asarray(free, dtype=float)) for force in forces]


def _lawful(a: Array, drive: Array, mu: Array, statuses: Any) -> Array:
    """Forces (solutions, 2 points) under which the given statuses (many, points) satisfy the law; see `operator`.

    Statuses are open, stick, and slip along and against the tangent. A closed point has (A lambda)_n = drive_n, one that sticks
    (A lambda)_tau = drive_tau; the slip velocity is drive_tau - (A lambda)_tau.
    """
    count, n = statuses.shape
    sign = np.array([0.0, 0.0, 1.0, -1.0])[statuses]
    matrices = np.tile(np.eye(2 * n), (count, 1, 1))
    right = np.zeros((count, 2 * n))
    for rows, here in ((slice(0, n), statuses > 0), (slice(n, 2 * n), statuses == 1)):
        matrices[:, rows] = np.where(here[:, :, None], a[rows], matrices[:, rows])
        right[:, rows] = np.where(here, drive[rows], 0.0)
    at = np.arange(n)
    matrices[:, n + at, at] -= np.where(statuses >= 2, sign * mu, 0.0)
    regular = np.linalg.slogdet(matrices)[0] != 0
    sign, statuses = sign[regular], statuses[regular]
    force = np.linalg.solve(matrices[regular], right[regular][:, :, None])[:, :, 0]
    velocity = drive - force @ a.T
    forces = ROUNDING * np.abs(force).max(axis=1, initial=0.0)[:, None]
    velocities = ROUNDING * (np.abs(drive) + np.abs(force) @ np.abs(a).T).max(axis=1)[:, None]
    closed, sticks = statuses > 0, statuses == 1
    pressure, pull, apart, slip = force[:, :n], force[:, n:], velocity[:, :n], velocity[:, n:]
    holds = np.where(closed, pressure >= -forces, apart <= velocities)
    holds &= np.where(sticks, np.abs(pull) <= mu * pressure + forces, sign * slip >= -velocities)
    return np.asarray(force[holds.all(axis=1)])


def _told(points: ContactPoints, force: Array, free: Array) -> Solution:
    """A solution in components x, y from forces in the frames, with the statuses that the forces tell."""
    n = len(points.weights)
    tells = ROUNDING * 1e3 * np.abs(force).max(initial=0.0)
    pressure, pull = force[:n], np.abs(force[n:])
    slips = pull >= points.friction * pressure - tells
    status = np.where(pressure <= tells, 0, np.where(slips, 2, 1))
    across = np.einsum("iam,mi->ia", points.frames, force.reshape(2, n))
    return Solution(across, free - (points.compliance @ across.ravel()).reshape(n, 2), [int(one) for one in status])
