"""The coupling's tensors and what they say of growth; the equations (1) to (4) stand in `verification.assumptions.coupling`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip.typing import Array

ZERO = 1e-12  # relative: an eigenvalue below is round-off


def bounds(tensor: Array) -> tuple[float, float]:
    """Smallest and largest eigenvalue of a symmetric matrix; for a Mandel form, m and M of (H1) and (H2)."""
    values = np.linalg.eigvalsh(tensor)
    return float(values[0]), float(values[-1])


def mandel_vector(tensor: Array) -> Array:
    """A symmetric (d, d) tensor as a Mandel vector (d (d + 1) / 2) in the core's order: 11, 22, (33, 23, 13,) 12."""
    i, j = np.triu_indices(len(tensor), 1)
    return np.concatenate([np.diag(tensor), np.sqrt(2) * tensor[i, j][::-1]])


def ratio(m: Array, r: Array) -> float:
    """c with R = c M, nan if there is none or M = 0; Mandel vectors."""
    if not m.any():
        return float("nan")
    c = float(m @ r / (m @ m))
    return c if np.linalg.norm(r - c * m) <= ZERO * np.linalg.norm(r) else float("nan")


def adiabatic_stiffness(f: Array, m: Array, r: Array) -> float:
    """Smallest eigenvalue of F - sym(M x R), stress; F a Mandel form, M and R Mandel vectors."""
    return bounds(f - (np.outer(m, r) + np.outer(r, m)) / 2)[0]


def coupling_rate(a: Array, m: Array, r: Array) -> float:
    """W of (2), one over time: 0 where the coupling is one-sided or R = -c M, infinite without viscosity."""
    if not m.any() or not r.any() or ratio(m, r) < 0:
        return 0.0
    if bounds(a)[0] <= ZERO * bounds(a)[1]:
        return float("inf")
    mm, mr, rr = m @ np.linalg.solve(a, m), m @ np.linalg.solve(a, r), r @ np.linalg.solve(a, r)
    return float((np.sqrt(mm * rr) + mr) / 2)


def staggered_limit(a: Array, f: Array, m: Array, r: Array, rate: float) -> float:
    """The largest k that satisfies (3), time; infinite if every k does, 0 if none is proved to. `rate` is lambda_1."""
    if not m.any() or not r.any():
        return float("inf")
    damping, (load, _) = 2 * a, parts(a, m, r)
    if not ratio(m, r) < 0:
        if rate <= 0 or coupling_rate(a, m, r) > rate:
            return 0.0
        g = weight(a, m, r)
        n = m + g * r
        damping = damping - np.outer(n, n) / (2 * g * rate)

    def margin(s: float) -> float:  # s = 1/k; concave, and not decreasing because damping >= 0
        return bounds(s * damping + f - load)[0]

    least, most = bounds(damping)
    slack = ZERO * max(bounds(load)[1], bounds(f)[1])
    if margin(0.0) >= -slack:
        return float("inf")
    if most <= 0:
        return 0.0
    enough = 2 * bounds(load)[1] / (least if least > ZERO * most else ZERO * most)
    from scipy.optimize import brentq  # a tenth of a second, for few scenes

    return 1 / float(brentq(margin, 0.0, enough, xtol=1e-300, rtol=1e-14)) if margin(enough) > 0 else 0.0


def weight(a: Array, m: Array, r: Array) -> float:
    """g = |M|/|R| in the metric of A^-1, which for R = -c M is 1/c in any."""
    if bounds(a)[0] <= ZERO * bounds(a)[1]:
        return float(np.linalg.norm(m) / np.linalg.norm(r))
    return float(np.sqrt((m @ np.linalg.solve(a, m)) / (r @ np.linalg.solve(a, r))))


def parts(a: Array, m: Array, r: Array) -> tuple[Array, Array]:
    g = weight(a, m, r)
    return np.outer(m, m) / g, g * np.outer(r, r)


@dataclass(frozen=True)
class Coupled:
    """A material whose motion and heat act on each other: Mandel forms A and F, Mandel vectors M and R, by its capacity."""

    a: Array
    f: Array
    m: Array
    r: Array  # of the heat equation divided by the capacity
    density: float
    diffusion: float  # largest conductivity over the capacity, area over time

    @property
    def cancels(self) -> bool:
        """Whether R = -c M, c > 0: what expansion takes from the motion, heating gives back."""
        return ratio(self.m, self.r) < 0

    @property
    def weight(self) -> float:
        """g, which makes g/2 capacity theta^2 comparable with an energy."""
        return float(np.linalg.norm(self.m) / np.linalg.norm(self.r))

    def limit(self, scheme: str) -> float:
        """The largest step in which a uniform strain of an insulated body without inertia does not grow, for R = -c M, time.

        Staggered (3), which inertia and conduction can only raise. Lagged |growth|^2 = k c M^2/(A + k F), c M x M <= A/k + F.
        """
        if scheme == "monolithic":
            return np.inf
        return staggered_limit(self.a if scheme == "staggered" else self.a / 2, self.f, self.m, self.r, 0.0)

    def feeds(self, step: float, finest: float) -> bool:
        """Whether staggered steps grow for R = -c M although inertia and conduction resist.

        A mode of squared wave number q, up to the mesh's `finest`, alternates and grows if k c (M : e)^2 exceeds
        (2 A + k F + 4 rho/(k q)) (1 + k K q/2) in e. Shear has twice the inertia of a strain of its size.
        """
        held = 2 * self.a + step * self.f
        e = np.linalg.lstsq(held, self.m, rcond=None)[0]
        straining, inertia = float(e @ held @ e), 8 * self.density * float(e @ e) / step
        lost = step * self.diffusion / 2
        fed = step * float(self.m @ e) ** 2 / self.weight
        if inertia == 0:
            return fed > straining
        q = min(finest, math.sqrt(inertia / (lost * straining))) if lost * straining > 0 else finest  # the least of all
        return fed > (straining + inertia / q) * (1 + lost * q)

    def drives_itself(self, length: float) -> bool:
        """Whether F - sym(M x R) is negative for some strain, also with what conduction over `length` takes away.

        A mode of squared wave number q without inertia grows if M R > F + A K q; inertia only adds to it.
        """
        held = self.f - (np.outer(self.m, self.r) + np.outer(self.r, self.m)) / 2
        values, vectors = np.linalg.eigh(held)
        e = vectors[:, 0]
        taken = self.diffusion * (np.pi / length) ** 2 * (e @ self.a @ e)
        return bool(values[0] < -ZERO * bounds(self.f)[1] and values[0] + taken < 0)


def coupled(materials: Sequence[Any]) -> list[Coupled]:
    """The core's materials whose motion and heat act on each other."""
    found = []
    for one in materials:
        if one.expansion is None or one.heating is None or not (np.any(one.expansion) and np.any(one.heating)):
            continue
        m, r = (mandel_vector(np.asarray(tensor)) for tensor in (one.expansion, one.heating))
        none = np.zeros((len(m), len(m)))
        a, f = (none if tensor is None else np.asarray(tensor) for tensor in (one.viscosity, one.elasticity))
        conductivity = np.linalg.norm(np.asarray(one.conductivity), 2)
        found.append(Coupled(a, f, m, r / one.capacity, one.density, float(conductivity) / one.capacity))
    return found
