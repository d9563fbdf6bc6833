"""The way to a solution of the contact law where Newton cycles: a path from the open state, and what is tried beside it.

Any solution will do: `Contact.defect` judges it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reference.extended_contact import LAW, Contact
from reference.extended_numbers import ONE, ZERO, Big, above, big, largest, mid, solve, zeros

OPEN, TOUCHING, CAPPED = range(3)
STICK, PLUS, MINUS = 0, 1, -1
MAX_PIECES = 300  # pieces of a path
ROUNDS = 20  # of tangents to laws that bend
PARTS = 300  # of a continuation
Side = tuple[
    Any, Any, "Piece", str
]  # value a + t b that stays positive, what comes where it ends, and what then is positive


@dataclass(frozen=True)
class Piece:
    """What a point does on one piece of the path: touching, sliding, its friction at the limit."""

    touch: int
    slip: int
    limited: bool


def answer(contact: Contact, guesses: list[Big]) -> tuple[Big, str]:
    """Forces (P, d) that obey the law, and by which way. Raises ArithmeticError where none is found."""
    if not contact.P:
        return zeros(0, contact.d), "none"
    rest = zeros(contact.P, contact.d)
    plane = contact.d == 2 and not any(law.bent for law in contact.laws)
    tries: list[tuple[str, Callable[[], Big | None]]] = [
        *(("newton", lambda g=g: contact.newton(g)) for g in [*guesses, rest]),  # type: ignore[misc]
        *(("path", lambda s=s: path(contact, s)) for s in range(3) if plane),  # type: ignore[misc]
        ("tangents", lambda: tangents(contact)),
        ("pulled", lambda: pulled(contact)),
        ("roughened", lambda: roughened(contact)),
        *(("pulled", lambda s=s: pulled(contact, s)) for s in (1, 2)),  # type: ignore[misc]
        ("line search", lambda: contact.newton(rest, 120, damped=True)),
    ]
    for name, attempt in tries:
        try:
            lam = attempt()
        except ZeroDivisionError:
            continue
        if lam is not None and contact.defect(lam, contact.velocity(lam)) < LAW:
            return lam, name
    raise ArithmeticError("no way led to the contact law")


def opened(contact: Contact, seed: int = 0) -> tuple[Big, Big]:
    """Forces and free velocities of a body pulled off so far that only the open state obeys the law.

    With w0 open and slow along the foundation, any other solution w would have (lam - lam0) W (lam - lam0) <= 0.
    """
    random = np.random.default_rng(seed)
    P, d = contact.z.shape
    far = 2 * (largest(contact.z) + largest(contact.r0) / contact.k) + big(1e-300)
    v, lam = zeros(P, d), zeros(P, d)
    v[:, 0] = -far * big(1 + random.random(P))
    if d == 2:
        v[:, 1] = far * big(1e-3 * random.uniform(-1, 1, P))
    for q, law in enumerate(contact.laws if d == 2 else ()):
        slip = contact.weights[q] * law.bound(ZERO, ZERO)[0]
        lam[q, 1] = slip if above(v[q, 1]) else -slip
    return lam, mid(v + contact.z - contact.velocity(lam))


def path(contact: Contact, seed: int = 0) -> Big | None:
    """Follows the broken line of solutions from the open state to the end (plane, piecewise linear laws)."""
    lam, start = opened(contact, seed)
    v = start - contact.z + contact.velocity(lam)
    pieces = [
        Piece(OPEN, PLUS if above(x) else MINUS, law.limit is not None and above(law.cohesion, law.limit))
        for x, law in zip(v[:, 1], contact.laws, strict=True)
    ]
    t, upwards = ZERO, True
    entered: tuple[int, str] | None = None
    for _ in range(MAX_PIECES):
        at, slope = line(contact, start, pieces)
        sides = limits(contact, start, pieces, at, slope)
        if entered is not None:
            grows = sides[entered][1]
            if grows.is_zero():
                return None
            upwards = above(grows)
        nearest, where = None, ONE
        for key, (a, b, _, _) in sides.items():
            if b.is_zero() or key == entered or above(b) == upwards:
                continue
            here = (-a / b).mid()
            if above(t, here) == upwards:  # passed already, by rounding
                here = t
            if (nearest is None and not upwards) or above(where, here) == upwards:
                nearest, where = key, here
        if nearest is None:
            return mid(at + slope).reshape(contact.P, 2) if upwards else None
        _, _, pieces[nearest[0]], twin = sides[nearest]
        t, entered = where, (nearest[0], twin)
    return None


def line(contact: Contact, start: Big, pieces: list[Piece]) -> tuple[Big, Big]:
    """Forces a + t b (2P,) that solve the rows of these pieces, the free velocities being start + t (z - start)."""
    n = 2 * contact.P
    J, right = zeros(n, n), zeros(n, 2)
    z = np.stack([start.ravel(), (contact.z - start).ravel()], axis=1)
    for q, (law, piece) in enumerate(zip(contact.laws, pieces, strict=True)):
        i, omega, W = 2 * q, contact.weights[q], contact.creeping[2 * q : 2 * q + 2]
        if piece.touch == TOUCHING:
            scale = contact.alpha[q] if law.stiffness is None else omega * law.stiffness
            J[i] = scale * contact.k * W[0]
            J[i, i] += ZERO if law.stiffness is None else ONE
            right[i] = scale * contact.k * z[i]
            right[i, 0] += scale * contact.r0[q]
        else:
            J[i, i] = ONE
            if piece.touch == CAPPED:
                right[i, 0] = omega * law.most
        if not law.rubs:
            J[i + 1, i + 1] = ONE
        elif piece.slip == STICK:
            J[i + 1], right[i + 1] = contact.beta[q] * W[1], contact.beta[q] * z[i + 1]
        else:
            J[i + 1, i + 1] = ONE
            right[i + 1, 0] = piece.slip * omega * (law.limit if piece.limited else law.cohesion)
            if not piece.limited:
                J[i + 1, i] = -piece.slip * law.coefficient
    found = solve(mid(J), mid(right))
    return found[:, 0], found[:, 1]


def limits(contact: Contact, start: Big, pieces: list[Piece], at: Big, slope: Big) -> dict[tuple[int, str], Side]:
    """What must stay positive on these pieces, by point and name."""
    P, k = contact.P, contact.k
    zero = contact.z - contact.velocity(at.reshape(P, 2)), contact.z - contact.velocity(slope.reshape(P, 2))
    v = np.stack([start - zero[0], contact.z - start - zero[1]], axis=2)
    lam = np.stack([at.reshape(P, 2), slope.reshape(P, 2)], axis=2)
    out: dict[tuple[int, str], Side] = {}
    for q, (law, piece) in enumerate(zip(contact.laws, pieces, strict=True)):
        omega, r, force = contact.weights[q], k * v[q, 0], lam[q, 0]
        r[0] += contact.r0[q]

        def add(name: str, x: Any, twin: str, q: int = q, piece: Piece = piece, **change: Any) -> None:
            out[q, name] = x[0].mid(), x[1].mid(), replace(piece, **change), twin

        one = np.array([ONE, ZERO])
        if piece.touch == OPEN:
            add("open", -r, "touching", touch=TOUCHING)
        elif piece.touch == TOUCHING:
            add("touching", force if law.stiffness is None else r, "open", touch=OPEN)
            if law.most is not None:
                add("uncapped", omega * law.most * one - force, "capped", touch=CAPPED)
        else:
            add("capped", r - law.most / law.stiffness * one, "uncapped", touch=TOUCHING)
        if not law.rubs:
            continue
        linear = omega * law.cohesion * one + law.coefficient * force
        T = omega * law.limit * one if piece.limited else linear
        nothing = piece.touch == OPEN and not above(law.cohesion)
        if piece.slip == STICK:
            add("below", T - lam[q, 1], "forward", slip=PLUS)
            add("above", T + lam[q, 1], "backward", slip=MINUS)
        elif piece.slip == PLUS:
            add("forward", v[q, 1], "backward" if nothing else "below", slip=MINUS if nothing else STICK)
        else:
            add("backward", -v[q, 1], "forward" if nothing else "above", slip=PLUS if nothing else STICK)
        if law.limit is not None:
            left = omega * law.limit * one - linear
            if piece.limited:
                add("limited", -left, "unlimited", limited=False)
            else:
                add("unlimited", left, "limited", limited=True)
    return out


def tangents(contact: Contact) -> Big | None:
    """Laws that bend replaced by their tangents, again and again, with Newton on the law itself in between."""
    lam = zeros(contact.P, contact.d)
    if not any(law.bent for law in contact.laws):
        return None
    for _ in range(ROUNDS):
        plain = contact.straight(lam)
        following = plain.newton(lam)
        if following is None and contact.d == 2:
            following = path(plain)
        if following is None:
            return None
        lam = following
        found = contact.newton(lam)
        if found is not None:
            return found
    return None


def pulled(contact: Contact, seed: int = 0) -> Big | None:
    """Newton while the pull of `opened` is reduced."""
    lam, start = opened(contact, seed)
    return _followed(lambda t: replace(contact, z=mid(start + big(t) * (contact.z - start))), lam)


def roughened(contact: Contact) -> Big | None:
    """Newton while friction grows from none."""

    def at(t: float) -> Contact:
        share = big(t)
        laws = [replace(x, coefficient=x.coefficient * share, cohesion=x.cohesion * share) for x in contact.laws]
        return replace(contact, laws=laws)

    smooth = at(0.0).newton(zeros(contact.P, contact.d))
    return None if smooth is None else _followed(at, smooth)


def _followed(at: Callable[[float], Contact], lam: Big) -> Big | None:
    """Newton from t = 0 to 1, in parts as short as need be."""
    t, part = 0.0, 0.25
    for _ in range(PARTS):
        here = min(t + part, 1.0)
        found = at(here).newton(lam, 15)
        if found is None:
            part /= 4
            continue
        lam, t, part = found, here, min(4 * part, 0.25)
        if t == 1.0:
            return lam
    return None
