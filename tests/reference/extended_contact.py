"""The contact law at all points together, in 80 digits: Newton, and where it cycles a path that leads to a solution.

With v = z - W lam the velocities of the contact points in their own frames (normal first), r = r0 + k v_nu the penetrations
and omega the weights, the law is

    lam_nu = omega p_nu(r)  (rigid: r <= 0 <= lam_nu, lam_nu r = 0),   |lam_tau| <= T,   lam_tau . v_tau = T |v_tau|,

T = omega times the friction bound. Newton starts where it is told, or at the last step's forces. If it fails, the pull of the
body off the foundation is reduced to nothing along a path: at its beginning only the open state obeys the law, and the path of
solutions (a broken line, for d = 2 and piecewise linear laws) leads to the end, as in Lemke's method. Laws that bend are
replaced by their tangents on the way. Whatever the way, `Contact.defect` judges what comes out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reference.extended_numbers import ONE, ZERO, Big, above, big, eye, largest, matrix, mid, solve, times, zeros

CLOSE = big(1e-40)  # of a residual, relative
# of the points' compliance: sticking points creep by it, which fixes how they share a force (least sum of squares over weights)
CREEP = big(1e-40)
NOTHING = big(1e-30)  # forces that are none, over those that would stop the body
LAW = 1e-25  # defect of a solution that counts as one


@dataclass(frozen=True)
class Law:
    """Compliance and friction of one part, in 80 digits; None: no limit, no fall, no smearing."""

    stiffness: Any  # None: rigid
    exponent: Any
    most: Any
    coefficient: Any
    cohesion: Any
    limit: Any
    kinetic: Any
    speed: Any
    smear: Any

    @classmethod
    def of(cls, contact: Any) -> Law:
        f = contact.friction
        rigid = contact.stiffness == "rigid"

        def number(value: Any) -> Any:
            return None if value is None else big(value)

        return cls(
            None if rigid else big(contact.stiffness),
            contact.exponent,
            number(contact.pressure_limit),
            big(f.coefficient if f else 0.0),
            big(f.cohesion if f else 0.0),
            number(f.limit if f else None),
            number(f.kinetic if f else None),
            number(f.speed if f else None),
            number(f.regularisation if f else None),
        )

    @property
    def bent(self) -> bool:
        """Whether it is not piecewise linear in the plane."""
        return self.exponent != 1 or self.speed is not None or self.smear is not None

    @property
    def rubs(self) -> bool:
        return above(self.coefficient) or above(self.cohesion)

    def pressure(self, r: Any) -> tuple[Any, Any]:
        """p_nu and its derivative."""
        if not above(r):
            return ZERO, ZERO
        if self.exponent == 1:
            p, slope = self.stiffness * r, self.stiffness
        else:
            p = self.stiffness * r ** big(self.exponent)
            slope = p * big(self.exponent) / r
        return (self.most, ZERO) if self.most is not None and above(p, self.most) else (p, slope)

    def bound(self, p: Any, speed: Any) -> tuple[Any, Any, Any]:
        """Friction bound and its derivatives by pressure and slip speed."""
        mu, fall = self.coefficient, ZERO
        if self.speed is not None:
            part = (self.coefficient - self.kinetic) * (-speed / self.speed).exp()
            mu, fall = self.kinetic + part, -part / self.speed * p
        value = self.cohesion + mu * p
        return (self.limit, ZERO, ZERO) if self.limit is not None and above(value, self.limit) else (value, mu, fall)


def norm(x: Big) -> Any:
    if len(x) == 1:
        return abs(x[0])
    size = (x @ x).mid()
    return size.sqrt().mid() if above(size) else ZERO


@dataclass
class Contact:
    """W (P d, P d), z (P, d), r0 (P,), step k, weights (P,), one `Law` a point."""

    W: Big
    z: Big
    r0: Big
    k: Any
    weights: Big
    laws: list[Law]

    def __post_init__(self) -> None:
        P, d = self.z.shape
        self.P, self.d = P, d
        self.creeping = self.W.copy()
        diagonal = [self.W[i, i] for i in range(P * d) if above(self.W[i, i])]
        least = min(diagonal, key=float) if diagonal else ONE
        self.beta, self.alpha = zeros(P), zeros(P)
        mean = sum(self.weights, ZERO) / P if P else ONE
        for q in range(P):
            for i in range(d * q + 1, d * (q + 1)):
                self.creeping[i, i] += CREEP * least * mean / self.weights[q]
            row = sum((abs(x) for x in self.W[d * q + d - 1]), ZERO)
            self.beta[q] = (1 / row).mid() if above(row) else 1 / least
            stiff = self.W[d * q, d * q]
            self.alpha[q] = (1 / (self.k * stiff)).mid() if above(stiff) else 1 / (self.k * least)
        self.creeping = mid(self.creeping)
        self.compliance = matrix(self.creeping)

    def velocity(self, lam: Big) -> Big:
        return mid(self.z - times(self.compliance, lam.ravel()).reshape(self.P, self.d))

    # ---- Newton

    def rows(self, lam: Big, v: Big) -> tuple[Big, Big, Big]:
        """The law as an equation (P, d), in forces, with its derivatives by force and velocity (P, d, d)."""
        P, d = self.P, self.d
        F, by_force, by_velocity = zeros(P, d), zeros(P, d, d), zeros(P, d, d)
        for q, law in enumerate(self.laws):
            omega, r = self.weights[q], self.r0[q] + self.k * v[q, 0]
            t = slice(1, d)
            if law.stiffness is None:
                touching = above(lam[q, 0] + self.alpha[q] * r)
                F[q, 0] = -self.alpha[q] * r if touching else lam[q, 0]
                by_force[q, 0, 0], by_velocity[q, 0, 0] = (ZERO, -self.alpha[q] * self.k) if touching else (ONE, ZERO)
            else:
                p, slope = law.pressure(r)
                touching = above(r)
                F[q, 0] = lam[q, 0] - omega * p
                by_force[q, 0, 0], by_velocity[q, 0, 0] = ONE, -omega * slope * self.k
            pressing = touching and above(lam[q, 0])
            speed = norm(v[q, t])
            value, by_p, by_speed = law.bound(lam[q, 0] / omega if pressing else ZERO, speed)
            T = omega * value
            one = eye(d - 1)
            if not above(T):
                F[q, t] = lam[q, t]
                by_force[q, t, t] = one
                continue
            wider_force = by_p if pressing else ZERO
            moving = v[q, t] / speed if above(speed) else zeros(d - 1)
            wider_velocity = omega * by_speed * moving
            if law.smear is not None:
                smoothed_speed = (speed * speed + law.smear * law.smear).sqrt()
                along = v[q, t] / smoothed_speed
                F[q, t] = lam[q, t] - T * along
                by_force[q, t, t] = one
                by_force[q, t, 0] = -along * wider_force
                by_velocity[q, t, t] = -T / smoothed_speed * (one - np.outer(along, along)) - np.outer(
                    along, wider_velocity
                )
                continue
            beta = self.beta[q]
            trial = lam[q, t] + beta * v[q, t]
            size = norm(trial)
            if not above(size, T):
                F[q, t] = -beta * v[q, t]
                by_velocity[q, t, t] = -beta * one
                continue
            along = trial / size
            turn = T / size * (one - np.outer(along, along)) if d == 3 else zeros(1, 1)
            F[q, t] = lam[q, t] - T * along
            by_force[q, t, t] = one - turn
            by_force[q, t, 0] = -along * wider_force
            by_velocity[q, t, t] = -beta * turn - np.outer(along, wider_velocity)
        return mid(F), mid(by_force), mid(by_velocity)

    def newton(self, lam: Big, limit: int = 40, damped: bool = False) -> Big | None:
        """The forces (P, d), or None where Newton cycles."""
        P, d = self.P, self.d
        best, stale = None, 0
        for _ in range(limit):
            v = self.velocity(lam)
            F, by_force, by_velocity = self.rows(lam, v)
            size = largest(F)
            scale = largest(lam) + largest(self.beta[:, None] * v) * big(1e-30)
            if not above(size, CLOSE * scale):
                return lam
            stale = 0 if best is None or above(best * big(0.99), size) else stale + 1
            best = size if best is None or above(best, size) else best
            if stale > 12:
                return None
            J = zeros(P * d, P * d)
            for q in range(P):
                own = slice(d * q, d * (q + 1))
                active = [i for i in range(d) if any(not x.is_zero() for x in by_velocity[q, i])]
                for i in active:
                    J[d * q + i] = -(by_velocity[q, i] @ self.creeping[own])
                J[own, own] += by_force[q]
            try:
                step = solve(J, -F.ravel()).reshape(P, d)
            except ZeroDivisionError:
                return None
            share = ONE
            if damped:
                for _ in range(12):
                    trial = mid(lam + share * step)
                    if above(size * (1 - share / 10), largest(self.rows(trial, self.velocity(trial))[0])):
                        break
                    share = share / 2
            lam = mid(lam + share * step)
        return None

    # ---- what decides

    def defect(self, lam: Big, v: Big) -> float:
        """How far forces and velocities (without creep) are from the law, relative to the largest of each; 0 is the law."""
        if not self.P:
            return 0.0
        force = largest(lam)
        for q, law in enumerate(self.laws):
            if law.stiffness is not None:
                force = max(force, abs(self.weights[q] * law.pressure(self.r0[q] + self.k * v[q, 0])[0]), key=float)
        speed = max(largest(v), largest(times(self.compliance, lam.ravel())), key=float)
        force = max(force, NOTHING * largest(self.beta) * speed, key=float)
        if not above(force):
            return 0.0
        depth = max(largest(self.r0), self.k * speed, key=float)
        worst = ZERO
        for q, law in enumerate(self.laws):
            omega, r, tangential = self.weights[q], self.r0[q] + self.k * v[q, 0], lam[q, 1:]
            if law.stiffness is None:
                found = [max(r, ZERO, key=float) / depth, max(-lam[q, 0], ZERO, key=float) / force]
                found.append(abs(lam[q, 0] * r) / (force * depth))
                p = max(lam[q, 0], ZERO, key=float) / omega
            else:
                p, _ = law.pressure(r)
                found = [abs(lam[q, 0] - omega * p) / force]
            slip = norm(v[q, 1:])
            T = omega * law.bound(p, slip)[0]
            if law.smear is not None:
                smoothed_speed = (slip * slip + law.smear * law.smear).sqrt()
                found.append(norm(tangential - T / smoothed_speed * v[q, 1:]) / force)
            elif law.rubs or largest(tangential):
                found.append(max(norm(tangential) - T, ZERO, key=float) / force)
                if above(speed):
                    found.append(abs(T * slip - tangential @ v[q, 1:]) / (max(force, T, key=float) * speed))
            worst = max([worst, *found], key=float)
        return float(worst)

    def straight(self, lam: Big) -> Contact:
        """The same with laws that bend replaced by their tangents at the forces lam."""
        v = self.velocity(lam)
        laws = []
        r0 = self.r0.copy()
        for q, law in enumerate(self.laws):
            r = self.r0[q] + self.k * v[q, 0]
            change: dict[str, Any] = {"exponent": 1.0, "smear": None, "speed": None, "kinetic": None}
            if law.exponent != 1 and above(r):
                p = law.stiffness * r ** big(law.exponent)
                slope = p * big(law.exponent) / r
                change["stiffness"] = slope.mid()
                r0[q] = (self.r0[q] - (r - p / slope)).mid()
            if law.speed is not None:
                change["coefficient"] = law.bound(ONE, norm(v[q, 1:]))[1].mid()
            laws.append(replace(law, **change) if law.bent else law)
        return Contact(self.W, self.z, r0, self.k, self.weights, laws)
