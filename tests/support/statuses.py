"""All solutions of a small step in the plane, by trying every status: slow, and indifferent to how forces are shared.

A status of every point makes law and momentum linear. What its equalities leave free, a share of the forces say, is
looked for by a linear programme, so that no determinant is asked.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import null_space, orth
from scipy.optimize import linprog

from warmslip.model.uniqueness import ContactPoints

Array = Any
OPEN, STICK, AHEAD, BACK = range(4)
ROUGH, SMOOTH = (OPEN, STICK, AHEAD, BACK), (OPEN, AHEAD)  # a point without friction is open or pressed
TINY, APART = 1e-9, 1e-5  # relative: what counts as none, and two velocities that differ


@dataclass(frozen=True)
class Step:
    """A load of a step, `free` (points, 2) and `penetration` (points,), and a velocity (points, 2) that is known to solve it."""

    free: Array
    penetration: Array
    known: Array


def _tangents(points: ContactPoints) -> Array:
    return np.column_stack([-points.normals[:, 1], points.normals[:, 0]])


def _rows(vectors: Array) -> Array:
    """(points, 2 points): the component along each point's own vector."""
    out = np.zeros((len(vectors), len(vectors), 2))
    out[range(len(vectors)), range(len(vectors))] = vectors
    return out.reshape(len(vectors), -1)


def random_step(points: ContactPoints, rng: Any) -> Step:
    """A load made from one of its solutions: random statuses, lawful forces, and a velocity that the body can have."""
    n, tau, c = len(points.weights), _tangents(points), points.compliance
    base, along = orth(c, rcond=TINY), _rows(tau)
    chosen = rng.random(n) < rng.random()
    held = null_space(along[chosen] @ base, rcond=TINY) if chosen.any() else np.eye(base.shape[1])
    w = base @ held @ rng.normal(size=held.shape[1]) if held.shape[1] else np.zeros(2 * n)
    slip = along @ w
    pressure = 10 ** rng.uniform(-1, 1, n) * (rng.random(n) < 0.8) / np.trace(c)
    share = np.where(np.abs(slip) > TINY * np.abs(w).max(initial=0.0), np.sign(slip), rng.uniform(-1, 1, n))
    force = pressure[:, None] * (points.normals + (points.friction * share)[:, None] * tau)
    apart = np.where(pressure > 0, 0.0, rng.random(n) * points.step)
    give = pressure / (points.weights * points.stiffness)
    penetration = give - apart - points.step * _rows(points.normals) @ w
    return Step((w + c @ force.ravel()).reshape(n, 2), penetration, w.reshape(n, 2))


def velocities(points: ContactPoints, step: Step) -> list[Array]:
    """The different velocities (points, 2) that solve a step, one for every status that has any."""
    found: list[Array] = []
    for status in itertools.product(*(ROUGH if mu > 0 else SMOOTH for mu in points.friction)):
        for w in _under(points, step, np.array(status)):
            if all(np.abs(w - other).max() > APART * np.abs(step.free).max() for other in found):
                found.append(w)
    return found


def _under(points: ContactPoints, step: Step, status: Array) -> Iterator[Array]:
    """A velocity under one status: forces along the normals and then the tangents, in units of the free velocity."""
    n, mu, unit = len(points.weights), points.friction, np.abs(step.free).max()
    normal, along = _rows(points.normals), _rows(_tangents(points))
    to_xy = np.concatenate([normal, along]).T
    moved = np.concatenate([normal, along]) @ points.compliance @ to_xy  # components of C force
    free = np.concatenate([normal, along]) @ step.free.ravel() / unit
    size = 1 / np.sqrt(np.diag(moved) + TINY * moved.max())
    into, depth = np.eye(n, 2 * n), step.penetration / (points.step * unit)
    give = np.diag(1 / (points.weights * points.stiffness * points.step))
    # depth + w_n - give = 0 where closed, <= 0 where open
    closing, at = -(moved[:n] + give @ into), -(depth + free[:n])
    tangential = np.eye(2 * n)[n:]
    closed, stick, slips = status != OPEN, status == STICK, (status >= AHEAD) & (mu > 0)
    sign = np.where(status == AHEAD, 1.0, -1.0)
    equal = [closing[closed], into[~closed], tangential[~closed]]
    values = [at[closed], np.zeros(2 * (~closed).sum())]
    equal += [moved[n:][stick], (tangential - (sign * mu)[:, None] * into)[closed & ~stick]]
    values += [free[n:][stick], np.zeros((closed & ~stick).sum())]
    below = [closing[~closed], -into[closed], (tangential - mu[:, None] * into)[stick]]
    most = [at[~closed], np.zeros(closed.sum() + stick.sum())]
    below += [-(tangential + mu[:, None] * into)[stick], (sign[:, None] * moved[n:])[slips]]
    most += [np.zeros(stick.sum()), (sign * free[n:])[slips]]
    a, b = np.concatenate(equal) * size, np.concatenate(values)
    f, g = np.concatenate(below) * size, np.concatenate(most)
    force, _, rank, _ = np.linalg.lstsq(a, b, rcond=TINY)
    if np.abs(a @ force - b).max(initial=0.0) > TINY * max(1.0, np.abs(b).max(initial=0.0)):
        return
    if rank < 2 * n:
        ways = null_space(a, rcond=TINY)
        held = linprog(np.zeros(ways.shape[1]), A_ub=f @ ways, b_ub=g - f @ force + TINY, bounds=(None, None))
        if held.status != 0:
            return
        force = force + ways @ held.x
    room = TINY * (1 + np.abs(f) @ np.abs(force) + np.abs(g))
    if np.all(f @ force <= g + 100 * room):
        yield step.free - unit * (points.compliance @ to_xy @ (size * force)).reshape(n, 2)
