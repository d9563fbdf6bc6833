"""Contact points with more friction, and loads on one piece of their law that another piece solves as well."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from warmslip.model.uniqueness import ContactPoints

Array = Any


def scaled(points: ContactPoints, factor: float) -> ContactPoints:
    return replace(points, friction=factor * points.friction)


def turned_piece(points: ContactPoints) -> tuple[Array, Array] | None:
    """Free velocity and penetration of a step inside a piece whose determinant is negative; None where there is none.

    Every point is open, sticks, or slips one way; the piece's matrix takes normal and tangential forces to what its status fixes.
    """
    n, nu = len(points.weights), points.normals
    tau = np.column_stack([-nu[:, 1], nu[:, 0]])
    give = 1 / (points.weights * points.stiffness * points.step)
    for status in itertools.product((0, 1, 2, 3), repeat=n):
        basis, rows = [], []  # directions of the forces that the status leaves free, and what is then prescribed
        for i, one in enumerate(status):
            across, along = np.zeros((n, 2)), np.zeros((n, 2))
            across[i], along[i] = nu[i], tau[i]
            if one == 1:
                basis += [across.ravel(), along.ravel()]
                rows += [across.ravel(), along.ravel()]
            elif one > 1:
                basis.append((across + (1 if one == 2 else -1) * points.friction[i] * along).ravel())
                rows.append(across.ravel())
        if not rows:
            continue
        total = points.compliance + sum(np.outer(v, v) * g for v, g in zip(_normal(nu), give, strict=True))
        if np.linalg.det(np.array(rows) @ total @ np.array(basis).T) >= 0:
            continue
        force, slip = np.zeros((n, 2)), np.zeros(n)
        apart = np.zeros(n)
        for i, one in enumerate(status):
            sign = {2: 1.0, 3: -1.0}.get(one, 0.0)
            force[i] = (one > 0) * (nu[i] + sign * points.friction[i] * tau[i])
            slip[i], apart[i] = sign, one == 0
        pressure = np.sum(force * nu, axis=1)
        moved = (points.compliance @ force.ravel()).reshape(n, 2)
        scale = np.abs(moved).max()
        w = scale * slip[:, None] * tau
        r = np.where(apart, -scale * points.step, pressure / (points.weights * points.stiffness))
        return w + moved, r  # w has no normal part
    return None


def _normal(normals: Array) -> Iterator[Array]:
    for i, nu in enumerate(normals):
        out = np.zeros_like(normals)
        out[i] = nu
        yield out.ravel()
