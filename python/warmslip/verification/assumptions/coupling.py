"""Sign and size of the thermo-mechanical coupling, and the steps for which the energy of the scheme cannot grow.

Energy. Test the motion with w and the heat balance with g theta, g > 0 any weight (it carries the units). With
E = rho/2 |w|^2 + a(u,u)/2 + Phi + g/2 |theta|^2, no loads, theta_F = 0 and N = M + g R,

    dE/dt = -b(w,w) - friction - g [d(theta,theta) + int k_c theta^2] + (theta N, eps w).                           (1)

R = -c M, c > 0: g = 1/c makes N = 0, nothing else is asked. Otherwise Young's inequality and the decay rate lambda_1 of
heat bound the last term by the others if N x N <= 4 g lambda_1 A. In the metric of A^-1 the best weight is g = |M|/|R|:

    W = (|M| |R| + M . R) / 2 <= lambda_1                                                                           (2)

Staggered. With k w_n and g k theta_n the last term of (1) becomes k (theta_n N, e_n) + k (M : e_n, theta_{n-1} - theta_n),
e_n = eps(w_n). Backward Euler dissipates g/2 |theta_n - theta_{n-1}|^2 and k^2/2 (F e_n, e_n) besides, so that E does not
grow if, as quadratic forms,

    M x M / g + N x N / (2 k g lambda_1) <= (2/k) A + F                                                             (3)

For R = -M this is R x R <= (2/k) A + F, for R = -c M it is c M x M <= (2/k) A + F. It is sharp: without inertia and
conduction a uniform strain is multiplied by 1 - k (c M^2 + F)/(A + k F) a step.

Lagged. Each of k (theta_{n-1} M, e_n) and g k (R : e_{n-1}, theta_n) takes half of the decay, and summed over the steps

    M x M / g + g R x R <= 2 lambda_1 (A + k F / 2)                                                                 (4)

keeps E below its start and the terms of the first step. Monolithic has (2). All are sufficient, none but (3) is sharp.

Adiabatic stiffness. Without conduction theta = R : eps(u) + const, and the body has the stiffness F - M x R: if its
symmetric part is not positive, some strain feeds itself. With conduction that part being positive is NOT sufficient for
R = +c M: a single mode has rho s^3 + (rho K + A) q s^2 + ... with Routh-Hurwitz condition A^2 K q + A K^2 rho q +
A (F - M R) > rho K M R, q its squared wave number, which no positive F - M R meets without viscosity.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from warmslip.model.coupling import (
    ZERO,
    adiabatic_stiffness,
    bounds,
    coupling_rate,
    mandel_vector,
    parts,
    ratio,
    staggered_limit,
)
from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array
from warmslip.verification.assumptions.constants import decay_rate
from warmslip.verification.assumptions.findings import Finding, verdict


def lagged_margin(a: Array, f: Array, m: Array, r: Array, rate: float, k: float) -> float:
    """Smallest eigenvalue of right minus left side of (4), divided by 2 lambda_1: a viscosity, negative if not proved."""
    if not m.any() or not r.any():
        return bounds(a)[0]
    if rate <= 0:
        return -float("inf")
    return bounds(a + k / 2 * f - sum(parts(a, m, r)) / (2 * rate))[0]


def coupling(d: Discretisation) -> Iterator[Finding]:
    """What the scene's coupling does to the energy, and for which steps."""
    material = d.problem.material
    a, f = np.asarray(material.viscosity), np.asarray(material.elasticity)
    m, r = (mandel_vector(np.asarray(t)) for t in (material.expansion, material.heating))
    c, rate, k = ratio(m, r), decay_rate(d), d.full.step
    yield _sign(c, m, r)
    yield _adiabatic(adiabatic_stiffness(f, m, r), bounds(f)[1])
    power = coupling_rate(a, m, r)
    yield Finding(
        "coupling, energy",
        "the coupling gives no more power than viscosity and conduction take: W <= lambda_1",
        (("W", power), ("lambda_1", rate)),
        verdict(power <= rate),
        "Without loads the energy cannot grow, whatever the sign of the coupling and of F - sym(M x R)."
        if power <= rate
        else "Nothing proves that the energy stays bounded without loads; compare expansion work and heating in the balances.",
    )
    yield _step(d.full.time.coupling, a, f, m, r, rate, k)


def _sign(c: float, m: Array, r: Array) -> Finding:
    values = (("c", -c), ("|M|", float(np.linalg.norm(m))), ("|R|", float(np.linalg.norm(r))))
    statement = "R = -c M with c > 0: what expansion takes from the motion, heating gives back"
    if not m.any() or not r.any():
        meaning = "One of M and R is zero: one field acts on the other and nothing comes back."
        return Finding("coupling, sign", statement, values, "not needed", meaning)
    if c < 0:
        meaning = (
            "The coupling cancels in the energy balance, as thermodynamics has it; c is the weight of its heat part."
        )
    elif c > 0:
        meaning = "The coupling acts with the sign opposite to thermodynamics: stretching heats, and heat stretches."
    else:
        meaning = (
            "R is no multiple of M: the coupled operators have no symmetric form and part of the coupling does work."
        )
    return Finding("coupling, sign", statement, values, verdict(c < 0), meaning)


def _adiabatic(least: float, size: float) -> Finding:
    values = (("smallest eigenvalue", least), ("largest of F", size))
    holds = least >= -ZERO * size
    if not holds:
        meaning = (
            "Faster than heat is conducted, some strain heats the body so much that expansion drives it on. Viscosity slows "
            "this down and conduction may stop it: 'coupling, energy' tells whether that is proved."
        )
    else:
        near = f" Barely: the stiffness left is {least / size:.2g} of F's." if least < 0.15 * size else ""
        meaning = (
            "Without conduction the coupling cannot drive a strain."
            + near
            + " It does not replace 'coupling, energy': with "
            "conduction and too little viscosity a coupling R = +c M makes vibrations grow all the same."
        )
    return Finding(
        "coupling, adiabatic", "F - sym(M x R) is not negative on symmetric tensors", values, verdict(holds), meaning
    )


def _step(scheme: str, a: Array, f: Array, m: Array, r: Array, rate: float, k: float) -> Finding:
    topic = f"coupling, {scheme} step"
    if scheme == "monolithic":
        power = coupling_rate(a, m, r)
        meaning = "Both fields are solved together: the step inherits 'coupling, energy' for every k."
        return Finding(topic, "W <= lambda_1", (("k", k),), verdict(power <= rate), meaning)
    if scheme == "lagged":
        margin = lagged_margin(a, f, m, r, rate, k)
        meaning = (
            "The energy stays bounded by its start without loads."
            if margin >= 0
            else "Boundedness is not proved for old values on both sides of the coupling; staggered or monolithic ask for less."
        )
        statement = "M x M / g + g R x R <= 2 lambda_1 (A + k F / 2), g = |M|/|R|"
        return Finding(topic, statement, (("k", k), ("margin", margin)), verdict(margin >= 0), meaning)
    limit = staggered_limit(a, f, m, r, rate)
    statement = "M x M / g + N x N / (2 k g lambda_1) <= (2/k) A + F, N = M + g R, g = |M|/|R|"
    if k <= limit:
        meaning = f"Without loads the scheme's energy cannot grow{'' if limit < np.inf else ' for any step'}."
    elif limit > 0:
        meaning = (
            f"Taking the old temperature may feed energy in: use a step of {limit:.3g} or less, more time.steps, or "
            "coupling = 'monolithic'."
        )
    else:
        meaning = "No step is proved safe, because 'coupling, energy' is not; watch the energy balance."
    return Finding(topic, statement, (("k", k), ("largest k", limit)), verdict(k <= limit), meaning)
