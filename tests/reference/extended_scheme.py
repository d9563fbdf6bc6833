"""One whole run of (PF) in 80 digits, and what a run of any other code leaves over of it.

Written from the mathematics alone: no line is shared with the core. A step of size k is, at the free unknowns,

    K w + E lam = f + rho M w_old/k - A u_old + G theta_*,     K = rho M/k + B + k A,     u = u_old + k w
    H theta = q + C theta_old/k + R w_* + contact heat,        H = C/k + D + J            (monolithic: one system)

with E lam the forces at the contact points (`extended_contact`). Every step is verified by the equations at all free nodes
and by the contact law: `Scheme.step` raises ArithmeticError rather than give what is no solution.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from reference.extended_contact import LAW, Contact, Law
from reference.extended_forms import Forms, Mesh, contact_points, values
from reference.extended_numbers import (
    ONE,
    ZERO,
    Big,
    above,
    big,
    entries,
    eye,
    largest,
    matrix,
    mid,
    solve,
    times,
    zeros,
)
from reference.extended_path import answer
from warmslip.scene.scene import Scene

SOLVED = 1e-30  # what an equation may leave over, relative to its largest term


@dataclass(frozen=True)
class State:
    """u, w (N, d), theta (N,), contact force on the foundation (points, d); how the contact law was solved."""

    u: Big
    w: Big
    theta: Big
    force: Big
    way: str = ""


class Scheme:
    """The scheme of a scene: `start`, then `step` for n = 1, 2, ..."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.mesh = scene, Mesh(scene)
        self.d, self.N = self.mesh.d, len(self.mesh.nodes)
        self.forms = Forms(scene, self.mesh)
        self.k, self.coupling = big(scene.step), scene.time.coupling
        self.points = contact_points(scene, self.mesh)
        self.laws = [Law.of(contact) if contact.stiffness is not None else None for contact in scene.contacts]
        self.frames = np.array([p.frame for p in self.points], dtype=object).reshape(-1, self.d, self.d)
        f, k, dN = self.forms, self.k, self.d * self.N
        self.momentum = zeros(dN, dN)
        for term, factor in ((f.inertia, 1 / k), (f.viscosity, ONE), (f.elasticity, k)):
            if term is not None:
                self.momentum = self.momentum + factor * term
        self.heat = f.storage / k + f.conduction + f.exchange
        held_w = {
            self.d * a + c for part in scene.supports.displacement for a in self._nodes(part) for c in range(self.d)
        }
        held_theta = {a for part in scene.supports.temperature for a in self._nodes(part)}
        self.free_w = [i for i in range(dN) if i not in held_w] if f.moves else []
        self.free_theta = [a for a in range(self.N) if a not in held_theta] if f.conducts else []
        self.monolithic = self.coupling == "monolithic" and f.moves and f.conducts
        self._reduce()

    def _nodes(self, part: str) -> list[int]:
        return self.mesh.nodes_of(part)

    def _reduce(self) -> None:
        """Inverses on the free unknowns, the points' velocities of nodal ones, and the compliance of the points."""
        d, dN = self.d, self.d * self.N
        self.at_points = zeros(d * len(self.points), dN)
        for q, point in enumerate(self.points):
            for node, share in zip(point.nodes, point.shape, strict=True):
                self.at_points[d * q : d * (q + 1), d * node : d * (node + 1)] += share * point.frame
        S, free = self.momentum, self.free_w
        if self.monolithic:
            G = self.forms.expansion if self.forms.expansion is not None else zeros(dN, self.N)
            R = self.forms.heating if self.forms.heating is not None else zeros(self.N, dN)
            S = np.block([[S, -G], [-R, self.heat]])
            free = free + [dN + a for a in self.free_theta]
        self.system, self.free = S, free
        if self.forms.moves:
            self.inverse = matrix(solve(S[np.ix_(free, free)], eye(len(free))))
            gives = matrix(self.at_points[:, self.free_w])
            fills = zeros(len(free), len(self.at_points))
            fills[: len(self.free_w)] = self.at_points[:, self.free_w].T
            back = self.inverse * matrix(fills) if fills.size else None
            top = entries(back)[: len(self.free_w)] if back is not None else fills
            self.W = entries(gives * matrix(top)) if fills.size else zeros(*[len(self.at_points)] * 2)
            self.S, self.shape = matrix(S), matrix(self.at_points)
            self.shape_t = matrix(self.at_points.T)

    # ---- data

    def held(self, name: str, t: float) -> dict[int, Any]:
        """What supports give at time t, by node: `displacement` (d,) or `temperature` (1,)."""
        components = self.d if name == "displacement" else 1
        given = getattr(self.scene.supports, "moved" if name == "displacement" else "warmed")
        out: dict[int, Any] = {}
        for part in getattr(self.scene.supports, name):
            nodes = self._nodes(part)
            out |= dict(zip(nodes, values(given.get(part, 0.0), self.mesh.nodes[nodes], t, components), strict=True))
        return out

    def start(self) -> State:
        """Initial data, made what is given on the supports."""
        x, initial, supports = self.mesh.nodes, self.scene.initial, self.scene.supports
        u, w = (values(getattr(initial, name) or 0.0, x, 0.0, self.d) for name in ("displacement", "velocity"))
        theta = values(initial.temperature, x, 0.0, 1)[:, 0]
        for node, value in self.held("displacement", 0.0).items():
            u[node] = value
        for part in supports.displacement:
            # a component that moves has the velocity that is given
            for c, value in enumerate(supports.moved.get(part, [0.0] * self.d)):
                if not isinstance(value, str):
                    w[self._nodes(part), c] = 0
        for node, value in self.held("temperature", 0.0).items():
            theta[node] = value[0]
        return State(big(u), big(w), big(theta), zeros(len(self.points), self.d))

    def given(self, n: int) -> tuple[Big, Big]:
        """Velocity (dN,) and temperature (N,) of the supports in step n, zero elsewhere."""
        t, w, theta = n * self.scene.step, zeros(self.d * self.N), zeros(self.N)
        before = self.held("displacement", t - self.scene.step)
        for node, value in self.held("displacement", t).items():
            w[self.d * node : self.d * (node + 1)] = (big(value) - big(before[node])) / self.k
        for node, value in self.held("temperature", t).items():
            theta[node] = big(value[0])
        return mid(w), mid(theta)

    def on_points(self, name: str, t: float) -> Big:
        """`gap` or `foundation_temperature` at the points, (points,)."""
        out = zeros(len(self.points))
        for q, point in enumerate(self.points):
            contact = self.scene.contacts[point.part]
            exchange = contact.heat_exchange
            data = contact.gap if name == "gap" else exchange.foundation_temperature if exchange else 0.0
            out[q] = big(values(data, point.position[None], t, 1))[0, 0]
        return out

    # ---- a step

    def right_side(self, old: State, n: int) -> tuple[Big, Big]:
        """Right-hand sides (dN,) of motion, without theta_n, and (N,) of heat, without w_n and contact heat."""
        f = self.forms
        force, source = f.loads(n * self.scene.step)
        u, w, theta = old.u.ravel(), old.w.ravel(), old.theta
        if f.inertia is not None:
            force = force + times(matrix(f.inertia), w) / self.k
        if f.elasticity is not None:
            force = force - times(matrix(f.elasticity), u)
        if f.expansion is not None:
            assert self.scene.heat is not None and self.scene.heat.expansion is not None
            reference = zeros(self.N) + big(self.scene.heat.expansion.reference_temperature or 0.0)
            warmer = -reference if self.monolithic else theta - reference
            force = force + times(matrix(f.expansion), warmer)
        return mid(force), mid(source + times(matrix(f.storage), theta) / self.k)

    def reduced(self, old: State, n: int) -> tuple[Contact, Big, Big]:
        """The contact problem of step n, with the right-hand side of the free unknowns and what supports give."""
        force, source = self.right_side(old, n)
        w, theta = self.given(n)
        right = np.concatenate([force, source]) if self.monolithic else force
        given = np.concatenate([w, theta]) if self.monolithic else w
        right = mid(right - times(self.S, given))[self.free]
        unloaded = given.copy()
        unloaded[self.free] = times(self.inverse, right)
        z = times(self.shape, unloaded[: self.d * self.N]).reshape(-1, self.d)
        return self.contact(old, n, z), right, given

    def step(self, old: State, n: int, guesses: list[Big] | None = None) -> State:
        """The state after step n; `guesses` are contact forces (points, d) to start from."""
        f, dN, d = self.forms, self.d * self.N, self.d
        w, theta = self.given(n)
        lam, way = zeros(len(self.points), d), "none"
        if f.moves:
            contact, right, solution = self.reduced(old, n)
            lam, way = answer(contact, [self._local(g) for g in [*(guesses or []), old.force]])
            pushed = np.concatenate([times(self.shape_t, lam.ravel()), zeros(len(self.system) - dN)])
            solution[self.free] = times(self.inverse, mid(right - pushed[self.free]))
            w, theta = solution[:dN], solution[dN:] if self.monolithic else theta
        new = State(mid(old.u + self.k * w.reshape(-1, d)), w.reshape(-1, d), theta, self._global(lam), way)
        if f.conducts and not self.monolithic:
            new = replace(new, theta=self._temperature(old, new, n, theta))
        left = self.left_over(old, new, n)
        if max(left["momentum"], left["heat"]) > SOLVED or left["law"] > LAW:
            raise ArithmeticError(f"step {n} is not solved: {left}")
        return new

    def _local(self, force: Big) -> Big:
        return mid(np.array([a @ b for a, b in zip(self.frames, force, strict=True)], dtype=object)).reshape(-1, self.d)

    def _global(self, lam: Big) -> Big:
        return mid(np.array([b @ a for a, b in zip(self.frames, lam, strict=True)], dtype=object)).reshape(-1, self.d)

    def contact(self, old: State, n: int, z: Big) -> Contact:
        normal = times(self.shape, old.u.ravel()).reshape(-1, self.d)[:, 0] if self.points else zeros(0)
        r0 = mid(normal - self.on_points("gap", n * self.scene.step))
        weights = np.array([p.weight for p in self.points], dtype=object)
        laws: list[Any] = [self.laws[p.part] for p in self.points]
        W = self.W if self.forms.moves else zeros(0, 0)
        return Contact(W, z, r0, self.k, weights, laws)

    def contact_heat(self, new: State, n: int) -> tuple[Big, Big]:
        """Matrix (N, N) and vector (N,) of the heat that the contact leads by its pressure and makes by friction."""
        conducted, made = zeros(self.N, self.N), zeros(self.N)
        if not any(c.heats for c in self.scene.contacts):
            return conducted, made
        outside, lam = self.on_points("foundation_temperature", n * self.scene.step), self._local(new.force)
        v = times(self.shape, new.w.ravel()).reshape(-1, self.d)
        for q, point in enumerate(self.points):
            contact = self.scene.contacts[point.part]
            exchange, heating = contact.heat_exchange, contact.friction_heating
            h = big(exchange.per_pressure if exchange else 0.0) * lam[q, 0]
            rubbed = big(heating.share if heating else 0.0) * (lam[q, 1:] @ v[q, 1:])
            conducted[np.ix_(point.nodes, point.nodes)] += h * np.outer(point.shape, point.shape)
            made[point.nodes] += (h * outside[q] + rubbed) * point.shape
        return conducted, made

    def _heat_right(self, old: State, new: State, source: Big) -> Big:
        if self.forms.heating is None:
            return source
        return source + times(matrix(self.forms.heating), (old if self.coupling == "lagged" else new).w.ravel())

    def _temperature(self, old: State, new: State, n: int, theta: Big) -> Big:
        conducted, made = self.contact_heat(new, n)
        _, source = self.right_side(old, n)
        H, free = self.heat + conducted, self.free_theta
        right = mid(self._heat_right(old, new, source) + made - times(matrix(H), theta))
        out = theta.copy()
        out[free] = solve(mid(H[np.ix_(free, free)]), right[free])
        return out

    # ---- what a step leaves over

    def left_over(self, old: State, new: State, n: int) -> dict[str, float]:
        """Of a step from `old` to `new`, by whomever: momentum and heat at the free nodes, relative to their largest term;
        the supports and u - u_old - k w, relative to the largest u and w; the contact law, see `Contact.defect`."""
        f, d = self.forms, self.d
        force, source = self.right_side(old, n)
        w, theta = self.given(n)
        out = dict.fromkeys(("momentum", "heat", "supports", "motion", "law"), 0.0)

        def relative(miss: Any, size: Any) -> float:
            return float(miss / size) if above(size) else float("inf") if above(miss) else 0.0

        if f.moves:
            pushed = times(self.shape_t, self._local(new.force).ravel())
            terms = [times(matrix(self.momentum), new.w.ravel()), pushed, -force]
            if self.monolithic and f.expansion is not None:
                terms.append(-times(matrix(f.expansion), new.theta))
            free = self.free_w
            size = self._sizes(old, new)
            out["momentum"] = relative(largest(sum(terms)[free]), max([size, *map(largest, terms)], key=float))
            held = [i for i in range(d * self.N) if i not in set(free)]
            out["supports"] = relative(largest(new.w.ravel()[held] - w[held]), largest(new.w))
            moved = new.u - old.u - self.k * new.w
            out["motion"] = relative(largest(moved), max(largest(new.u), largest(old.u), key=float))
            if self.points:
                v = times(self.shape, new.w.ravel()).reshape(-1, d)
                out["law"] = self.contact(old, n, mid(v)).defect(self._local(new.force), v)
        if f.conducts:
            conducted, made = self.contact_heat(new, n)
            terms = [times(matrix(self.heat + conducted), new.theta), -self._heat_right(old, new, source), -made]
            free = self.free_theta
            out["heat"] = relative(largest(sum(terms)[free]), max(map(largest, terms), key=float))
            held = [i for i in range(self.N) if i not in set(free)]
            warm = relative(largest(new.theta[held] - theta[held]), largest(theta[held]))
            out["supports"] = max(out["supports"], warm)
        return out

    def _sizes(self, old: State, new: State) -> Any:
        """The largest single force in the equations of motion, before the parts of one matrix cancel."""
        f, found = self.forms, [ZERO]
        for matrix_, factor, field in (
            (f.inertia, 1 / self.k, new.w),
            (f.viscosity, ONE, new.w),
            (f.elasticity, ONE, new.u),
        ):
            if matrix_ is not None:
                found.append(factor * largest(matrix_) * largest(field))
        return max(found, key=float)

    def advance(self) -> Iterator[State]:
        """All states after the initial one."""
        state = self.start()
        for n in range(1, self.scene.time.steps + 1):
            state = self.step(state, n)
            yield state
