"""The scheme (PF) on meshes of a few cells in exact arithmetic: what the contact law has to answer, every answer counted.

Written from the mathematics alone: own forms, elimination and law. A number is a Fraction, or a + b sqrt(3) where the
two-point Gauss rule puts its points; nothing is rounded. With y = w_n, or (w_n, theta_n) if monolithic, a step is

    S y + P lam = r       S = rho M/k + B + k A, monolithic bordered by the heat equation; lam the force on the foundation

reduced to the contact points. There every combination of statuses (open, stick, slip along each of `directions`) is
solved, and the answers that obey the inequalities of the law are kept.

In the plane slip has the two directions tried, so that the count is the number of solutions. In space it has infinitely
many: with mu > 0 the answers along the axes are exact and others may exist; `Scheme.polish` solves for given statuses and
any direction with `DIGITS` digits instead. Everything is dimensionless.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpmath import mp

from reference.exact_forms import Mesh, assemble, contact_points
from reference.exact_numbers import Exact, eliminate, exact, eye, floats, root, zeros

OPEN, STICK, SLIP = range(3)
DIGITS = 60
Choice = tuple[int, tuple[int, ...]]  # a status, and the direction of slip along the tangents


@dataclass(frozen=True)
class State:
    """u, w (N, d) and theta (N,); after a step also the first of its `solutions` (0: not counted) by contact point."""

    u: Exact
    w: Exact
    theta: Exact
    force: Exact = None  # (points, d), of the body on the foundation
    status: tuple[int, ...] = ()
    solutions: int = 0


class Scheme:
    """The scheme for a scene given as plain data, the tables of its TOML file, on any mesh."""

    def __init__(self, scene: Mapping[str, Any], mesh: Mesh) -> None:
        contact, time, supports = scene["contact"], scene["time"], scene["supports"]
        self.d, self.N, self.steps = mesh.dim, len(mesh.nodes), time["steps"]
        self.coupling, self.k = time["coupling"], exact(time["end"])[()] / time["steps"]
        self.c_nu, self.gap = exact(contact["stiffness"])[()], exact(contact["gap"])[()]
        self.mu = exact(contact["friction"]["coefficient"])[()]
        self.initial = scene["initial"]
        self.prescribed_displacement, self.prescribed_temperature = (
            sorted({node for part in supports[key] for facet in mesh.parts[part] for node in facet})
            for key in ("displacement", "temperature")
        )
        self.forms = assemble(scene, mesh)
        self.points = contact_points(mesh, contact["part"], contact["quadrature"], self.prescribed_displacement)
        still = (0,) * (self.d - 1)
        axes = [(*still[:i], sign, *still[i + 1 :]) for i in range(self.d - 1) for sign in (1, -1)]
        self.directions = axes if self.mu else [still]
        self._reduce()

    def _reduce(self) -> None:
        """The inverse of S without supports, what takes y to the contact points' (normal, tangential) frame, W = B S^-1 B'."""
        f, k, d = self.forms, self.k, self.d
        momentum, heat = f.inertia / k + f.viscosity + k * f.elasticity, f.storage / k + f.conduction + f.exchange
        held_w, held_theta = (
            [d * a + c for a in self.prescribed_displacement for c in range(d)],
            self.prescribed_temperature,
        )
        S, held = momentum, held_w
        if self.coupling == "monolithic":
            S = np.block([[momentum, -f.expansion], [-f.heating, heat]])
            held = held_w + [d * self.N + a for a in held_theta]
        else:
            self.heat_inverse = _inverse(heat, held_theta)
        self.inverse = _inverse(S, held)
        self.frames = np.array([_frame(point.normal) for point in self.points])
        self.B = zeros(d * len(self.points), len(S))
        for q, point in enumerate(self.points):
            for c in range(d):
                self.B[d * q : d * (q + 1), c : d * self.N : d] = np.outer(self.frames[q][:, c], point.shape)
        self.B[:, held] = 0
        self.W = self.B @ self.inverse @ self.B.T
        self._tabulate()

    def start(self) -> State:
        """The scene's constant initial data, zero on the supports."""
        u, w = (np.tile(exact(self.initial.get(x) or [0] * self.d), (self.N, 1)) for x in ("displacement", "velocity"))
        theta = np.full(self.N, exact(self.initial["temperature"])[()])
        u[self.prescribed_displacement], w[self.prescribed_displacement], theta[self.prescribed_temperature] = 0, 0, 0
        return State(u, w, theta)

    def advance(self) -> Iterator[State]:
        """All steps, each after the first solution of the one before."""
        state = self.start()
        for _ in range(self.steps):
            state = self.step(state)[0]
            yield state

    def step(self, old: State) -> list[State]:
        """Every state the step allows; ArithmeticError if there is none."""
        r, z, penetration = self.free(old)
        found = self.answers(z, penetration)
        if not found:
            raise ArithmeticError("no combination of statuses obeys the law")
        return [self.finish(old, r, lam, status, len(found)) for lam, status in found]

    def free(self, old: State) -> tuple[Exact, Exact, Exact]:
        """r, the contact velocities z without contact forces in the points' frames, and the penetrations at w_n = 0."""
        f, u, w = self.forms, old.u.ravel(), old.w.ravel()
        r = f.force + f.inertia @ w / self.k - f.elasticity @ u
        if self.coupling == "monolithic":
            r = np.concatenate([r, f.source + f.storage @ old.theta / self.k])
        else:
            r = r + f.expansion @ old.theta
        penetration = np.array(
            [frame[0] @ (p.shape @ old.u) for frame, p in zip(self.frames, self.points, strict=True)]
        )
        return r, self.B @ (self.inverse @ r), penetration - self.gap

    def finish(self, old: State, r: Exact, lam: Exact, status: tuple[int, ...], solutions: int) -> State:
        """The fields that go with the contact forces lam (d points,)."""
        f, d, size = self.forms, self.d, self.d * self.N
        y = self.inverse @ (r - self.B.T @ lam)
        w = y[:size]
        if self.coupling == "monolithic":
            theta = y[size:]
        else:
            w_star = old.w.ravel() if self.coupling == "lagged" else w
            theta = self.heat_inverse @ (f.source + f.storage @ old.theta / self.k + f.heating @ w_star)
        w = w.reshape(-1, d)
        force = np.array([x @ frame for x, frame in zip(lam.reshape(-1, d), self.frames, strict=True)])
        return State(old.u + self.k * w, w, theta, force, status, solutions)

    def _tabulate(self) -> None:
        """For each point and choice the rows of the law that hold and the columns that span the forces, and all products."""
        d, unit, columns = self.d, eye(len(self.W)), list[Exact]()
        still = (0,) * (d - 1)
        self.laws, self.choices = self.W.copy(), []
        for q, point in enumerate(self.points):
            n, tangents = d * q, range(d * q + 1, d * (q + 1))
            self.laws[n] = unit[n] + point.weight * self.c_nu * self.k * self.W[n]
            choices: dict[Choice, tuple[list[int], list[int]]] = {(OPEN, still): ([], [])}
            for direction in self.directions:
                choices[SLIP, direction] = [n], [len(columns)]
                columns.append(unit[n] + self.mu * sum(s * unit[t] for s, t in zip(direction, tangents, strict=True)))
            if self.mu:
                choices[STICK, still] = [n, *tangents], [*range(len(columns), len(columns) + d)]
                columns += [unit[t] for t in (n, *tangents)]
            self.choices.append(choices)
        self.columns = np.array(columns).T
        self.table = self.laws @ self.columns

    def answers(self, z: Exact, penetration: Exact) -> list[tuple[Exact, tuple[int, ...]]]:
        """Forces and statuses of all combinations that obey the law, one for each velocity and nodal force."""
        right, found = z.copy(), dict[tuple[Any, ...], tuple[Exact, tuple[int, ...]]]()
        for q, point in enumerate(self.points):
            right[self.d * q] = point.weight * self.c_nu * (penetration[q] + self.k * z[self.d * q])
        for combination in itertools.product(*self.choices):
            chosen = [choices[c] for choices, c in zip(self.choices, combination, strict=True)]
            rows, columns = ([i for pair in chosen for i in pair[side]] for side in (0, 1))
            solved = eliminate(self.table[np.ix_(rows, columns)], right[rows][:, None])
            if solved is None:
                continue
            forces, kernel = (self.columns[:, columns] @ x for x in solved)
            lam = self._share(combination, forces[:, 0], kernel, z, penetration)
            if lam is not None:
                key = *(z - self.W @ lam), *(self.B.T @ lam)
                found.setdefault(key, (lam, tuple(status for status, _ in combination)))
        return list(found.values())

    def _share(
        self, combination: Sequence[Choice], lam: Exact, kernel: Exact, z: Exact, penetration: Exact
    ) -> Exact | None:
        """lam itself, or with more Gauss points than nodes the middle of the shares of stick that obey the law."""
        if kernel.shape[1] == 0:
            return lam if self._obeys(combination, lam, z, penetration) else None
        if kernel.shape[1] > 1 or self.d > 2:
            raise NotImplementedError("a family of forces with more than one parameter")
        at, next_ = (self._law(combination, x, z, penetration)[0] for x in (lam, lam + kernel[:, 0]))
        slopes = [b - a for a, b in zip(at, next_, strict=True)]
        low = [-a / s for a, s in zip(at, slopes, strict=True) if s > 0]
        high = [-a / s for a, s in zip(at, slopes, strict=True) if s < 0]
        lam = lam + (max(low) + min(high)) / 2 * kernel[:, 0]
        return lam if self._obeys(combination, lam, z, penetration) else None

    def _obeys(self, combination: Sequence[Choice], lam: Exact, z: Exact, penetration: Exact) -> bool:
        positive, zero = self._law(combination, lam, z, penetration)
        return all(x >= 0 for x in positive) and all(x == 0 for x in zero)

    def _law(
        self, combination: Sequence[Choice], lam: Exact, z: Exact, penetration: Exact
    ) -> tuple[list[Any], list[Any]]:
        """What must be >= 0 and what must be 0 for these statuses, beside what `_answer` solved."""
        velocity, d, positive, zero = z - self.W @ lam, self.d, [], []
        for q, (status, direction) in enumerate(combination):
            force, v = lam[d * q : d * (q + 1)], velocity[d * q : d * (q + 1)]
            r = penetration[q] + self.k * v[0]
            positive.append(-r if status == OPEN else r)
            if status == STICK and d == 2:
                positive += [self.mu * force[0] - force[1], self.mu * force[0] + force[1]]
            elif status == STICK:
                positive.append((self.mu * force[0]) ** 2 - force[1:] @ force[1:])
            elif status == SLIP and any(direction):
                forward = v[1:] @ np.array(direction)
                positive.append(forward)
                zero += list(v[1:] - np.array(direction) * forward)
        return positive, zero

    def polish(self, old: State, status: Sequence[int], guess: Exact) -> State:
        """The step for given statuses in `DIGITS` digits: Newton from the forces `guess` (points, d). Not an enumeration.

        Raises ArithmeticError when Newton does not converge or its answer does not obey the law.
        """
        r, z, penetration = self.free(old)
        d, exact_lam = self.d, exact(np.concatenate([f @ x for f, x in zip(floats(self.frames), guess, strict=True)]))
        with mp.workdps(DIGITS):
            number = np.vectorize(lambda x: mp.mpf(x.numerator) / x.denominator, otypes=[object])
            W, free, depth, lam, k, mu = map(number, (self.W, z, penetration, exact_lam, self.k, self.mu))
            stiffness = number([p.weight * self.c_nu for p in self.points])
            for _ in range(8):
                v, F, J = free - W @ lam, lam.copy(), number(eye(len(z)))
                for q, kind in enumerate(status):
                    n, t = d * q, slice(d * q + 1, d * (q + 1))
                    if kind == OPEN:
                        continue
                    F[n] -= stiffness[q] * (depth[q] + k * v[n])
                    J[n] += stiffness[q] * k * W[n]
                    if kind == STICK:
                        F[t], J[t] = v[t], -W[t]
                    else:  # |v| lam_tau = mu lam_nu v
                        speed = mp.sqrt(v[t] @ v[t])
                        F[t] = speed * lam[t] - mu * lam[n] * v[t]
                        J[t] = mu * lam[n] * W[t] - np.outer(lam[t], v[t] @ W[t]) / speed
                        J[t, t] += speed * number(eye(d - 1))
                        J[t, n] -= mu * v[t]
                solved = eliminate(J, -F[:, None])
                if solved is None or solved[1].size:
                    raise ArithmeticError("Newton met a singular tangent")
                lam = lam + solved[0][:, 0]
            if max(abs(F)) > mp.mpf(10) ** (15 - DIGITS) * max(abs(lam)):
                raise ArithmeticError(f"Newton left a residual of {float(max(abs(F))):.1e}")
            exact_lam = exact(lam)
        if not self._obeys([(kind, (0,) * (d - 1)) for kind in status], exact_lam, z, penetration):
            raise ArithmeticError("these statuses do not obey the law")
        return self.finish(old, r, exact_lam, tuple(status), 0)

    def inequality(self, old: State, new: State, tests: Iterable[Exact]) -> list[Any]:
        """Left minus right of the inequality of (PF) for each test velocity (N, d), zero on the supports: never < 0.

        Knows neither lam nor statuses. In space |v_tau| is a root, taken with more than `DIGITS` digits.
        """
        f, w, values = self.forms, new.w, []
        theta = new.theta if self.coupling == "monolithic" else old.theta
        forces = f.inertia @ (w - old.w).ravel() / self.k + f.viscosity @ w.ravel() + f.elasticity @ new.u.ravel()
        forces = forces - f.expansion @ theta - f.force

        def size(x: Exact) -> Any:
            return abs(x[0]) if len(x) == 1 else root(x @ x)

        for v in tests:
            value = (v - w).ravel() @ forces
            for p, frame in zip(self.points, self.frames, strict=True):
                r, v_q, w_q = frame[0] @ (p.shape @ new.u) - self.gap, frame @ (p.shape @ v), frame @ (p.shape @ w)
                j = v_q[0] - w_q[0] + self.mu * (size(v_q[1:]) - size(w_q[1:]))
                value += p.weight * self.c_nu * max(r, 0 * r) * j
            values.append(value)
        return values


def _inverse(matrix: Exact, held: Sequence[int]) -> Exact:
    """The inverse on the unknowns that are not held, zero on the others."""
    free = [i for i in range(len(matrix)) if i not in set(held)]
    out = zeros(*matrix.shape)
    solved = eliminate(matrix[np.ix_(free, free)], eye(len(free)))
    if solved is None or solved[1].size:
        raise ArithmeticError("a singular operator")
    out[np.ix_(free, free)] = solved[0]
    return out


def _frame(normal: Exact) -> Exact:
    """Rows: the normal and the tangents. ValueError for a normal in space that is not an axis."""
    if len(normal) == 2:
        return np.array([normal, [-normal[1], normal[0]]])
    axis = [i for i in range(3) if abs(normal[i]) == 1]
    if not axis:
        raise ValueError("contact facets in space need a normal along an axis")
    return np.vstack([normal, np.delete(eye(3), axis[0], axis=0)])
