"""Initial data that do not fit the boundary conditions, and the order in k they leave.

Backward Euler for y' + L y = f, L a positive self-adjoint operator, has the error O(k^s) in the largest L2 error over all
steps if f is smooth and y(0) minus the particular solution is in the domain of L^s (V. Thomee, Galerkin Finite Element
Methods for Parabolic Problems, chapter 7). A function that misses the value on a held part is in it for s < 1/4 only, one
that misses a flux or traction for s < 3/4: the layer after one step has width sqrt(k) and height 1, or sqrt(k). These are
the orders of theta, which diffuses by K, and of w, which diffuses by the viscosity. Without viscosity w has jumps that
travel, and no order is stated; without inertia w is no state and forgets its initial value.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from warmslip.model.discretisation import Discretisation
from warmslip.model.loads import evaluate
from warmslip.typing import Array
from warmslip.verification.assumptions.findings import Finding

VALUE, FLUX, SMOOTH = 0.25, 0.75, 1.0  # orders left by a missed value, a missed flux, and data that fit
FIT = 1e-12  # mismatch that is round-off, relative


def start(d: Discretisation) -> Iterator[Finding]:
    """What of the initial data fits: temperature on held parts and on the rest, displacement, velocity, tractions."""
    scene = d.full
    held_u, held_theta = scene.supports.displacement, scene.supports.temperature
    theta, k_c = scene.initial.temperature, scene.contact.heat_exchange.conductance
    spreads = float(np.linalg.eigvalsh(d.problem.material.conductivity)[-1]) > 0
    w_moves = scene.inertia.density > 0
    w_order = None if scene.viscosity.pair(d.dim)[1] > 0 else float("nan")
    u0, v0 = (
        np.zeros(d.dim) if v is None else np.array(v) for v in (scene.initial.displacement, scene.initial.velocity)
    )

    yield _fit("theta(0) = 0 on cooled parts", "theta", abs(theta) if held_theta else 0.0, VALUE, needed=spreads)
    yield _fit("heat flux at t = 0 is what theta(0) conducts", "theta", _flux(d, theta, k_c), FLUX, needed=spreads)
    yield _displacement(float(np.abs(u0).max()) if held_u else 0.0)
    miss = float(np.abs(v0).max()) if held_u else 0.0
    yield _fit("v0 = 0 on clamped parts", "w", miss, VALUE, needed=w_moves, order=w_order)
    traction = _traction(d, u0, v0, theta)
    yield _fit("tractions at t = 0 are those of the initial stress", "w", traction, FLUX, needed=w_moves, order=w_order)


def _fit(statement: str, field: str, miss: float, left: float, *, needed: bool, order: float | None = None) -> Finding:
    """`left` is the order a miss leaves by diffusion, `order` what is said in its place."""
    topic, fits = f"start of {field}", miss <= FIT
    expected = SMOOTH if fits or not needed else left if order is None else order
    values = (("mismatch", miss), ("order in k", expected))
    if fits:
        return Finding(topic, statement, values, "yes", "Nothing here holds back the first order in k.")
    if not needed:
        meaning = "It does not fit, but this field has no boundary layer in time here: no conduction, or no inertia."
        return Finding(topic, statement, values, "not needed", meaning)
    if np.isnan(expected):
        meaning = "It does not fit, and without viscosity the jump travels: expect clearly less than first order; none is proved."
    else:
        meaning = (
            f"A sudden start: the largest L2 error of {field} over time is O(k^{expected:g}), made by the first steps. Shorter "
            "first steps, or data that rise from a fit, restore the first order; at a fixed later time it is O(k)."
        )
    return Finding(topic, statement, values, "no", meaning)


def _displacement(miss: float) -> Finding:
    return Finding(
        "start of u",
        "u0 = 0 on clamped parts",
        (("mismatch", miss),),
        "yes" if miss <= FIT else "no",
        "u0 lies in V."
        if miss <= FIT
        else "u0 is brought to zero within one layer of cells, whose strain grows like 1/sqrt(h): |u|_V does not converge.",
    )


def _flux(d: Discretisation, theta: float, k_c: float) -> float:
    """The largest heat flux into the body at t = 0 on parts that are not cooled; theta(0), a constant, conducts none."""
    cooled, loads = d.full.supports.temperature, d.loads
    fluxes = [evaluate(h, _nodes(d, part), 0.0, 1) for part, h in loads.heat_flux.items() if part not in cooled]
    x = np.asarray(d.surface.positions)
    exchange = k_c * (evaluate(loads.foundation_temperature, x, 0.0, 1) - theta) + evaluate(
        loads.contact_flux, x, 0.0, 1
    )
    return max(float(np.abs(flux).max()) for flux in [*fluxes, exchange])


def _traction(d: Discretisation, u0: Array, v0: Array, theta: float) -> float:
    """The largest |f - sigma nu| at t = 0 over all parts that are not clamped, stress; sigma = -theta M for constant data.

    On Gamma_C f = gC - p nu - the friction nearest to balance that Coulomb's law allows: opposite to the slip, or in stick
    at most the bound.
    """
    stress, contact = -theta * np.asarray(d.problem.material.expansion), d.full.contact
    worst = 0.0
    for part, facets in d.mesh.parts.items():
        if part in d.full.supports.displacement or part == contact.part:
            continue
        normals = _normals(d, np.asarray(facets))
        x = np.asarray(d.mesh.nodes)[np.asarray(facets)].mean(axis=1)
        applied = evaluate(d.loads.traction.get(part, 0.0), x, 0.0, d.dim)
        worst = max(worst, float(np.linalg.norm(applied - normals @ stress, axis=1).max()))
    x, nu = np.asarray(d.surface.positions), np.asarray(d.surface.normals)
    gap = evaluate(d.loads.gap, x, 0.0, 1)[:, 0]
    pressure = contact.stiffness * np.maximum(nu @ u0 - gap, 0)
    rest = evaluate(d.loads.contact_traction, x, 0.0, d.dim) - pressure[:, None] * nu - nu @ stress
    slip = v0 - (nu @ v0)[:, None] * nu
    tangential = rest - np.sum(rest * nu, axis=1)[:, None] * nu
    size, speed = (np.linalg.norm(v, axis=1)[:, None] for v in (tangential, slip))
    bound = contact.friction.coefficient * pressure[:, None]
    opposing = np.where(size > 0, tangential / np.where(size > 0, size, 1) * np.minimum(size, bound), 0)
    friction = np.where(speed > 0, bound * slip / np.where(speed > 0, speed, 1), opposing)
    return max(worst, float(np.linalg.norm(rest - friction, axis=1).max()))


def _nodes(d: Discretisation, part: str) -> Array:
    return np.asarray(np.asarray(d.mesh.nodes)[np.unique(d.mesh.parts[part])])


def _normals(d: Discretisation, facets: Array) -> Array:
    """Outward unit normals (facets, d): away from the node of the cell that the facet leaves out."""
    x, cells = np.asarray(d.mesh.nodes), np.asarray(d.mesh.cells)
    owner: dict[tuple[int, ...], int] = {}
    for out in range(d.dim + 1):
        rest = np.sort(np.delete(cells, out, axis=1), axis=1)
        owner.update(zip(map(tuple, rest.tolist()), cells[:, out].tolist(), strict=True))
    inner = x[[owner[tuple(sorted(f))] for f in facets.tolist()]]
    sides = x[facets[:, 1:]] - x[facets[:, :1]]
    normal = np.linalg.svd(sides).Vh[:, -1]
    away = np.sum(normal * (x[facets[:, 0]] - inner), axis=1)
    return np.asarray(normal * np.sign(away)[:, None])
