"""Is the answer of a step the only one? A bound on the friction coefficient below which it is.

With C the compliance of the step, E^T K^-1 E with K = rho M/k + B + k A, a step asks for forces (z, t) at the contact points,
normal and tangential, and velocities (v, s) = free - C (z, t) with z = omega c_nu (r_old + k v)+ and Coulomb's law with the
bound T = mu z. For a frozen T the problem is convex and has one answer. That answer's mu z is the next bound: a fixed
point is an answer of the step, and if the map T -> mu z contracts there is exactly one.

Take the differences D of two such answers. Coulomb's law gives Dt . Ds >= -|DT| . |Ds|, the normal law
Dz = theta Dv with 0 <= theta <= omega c_nu k, point by point. With S = C_nn - C_nt C_tt^+ C_tn and the norms
|z|^2 = sum z_q^2 / omega_q of forces, L the largest eigenvalue of W^1/2 C_tt W^1/2, W = diag(omega),

 (a) (Dz, Dt) C (Dz, Dt) = Dz S Dz + Ds C_tt^+ Ds, so that  Dz (S + 1/(omega c_nu k)) Dz + |Ds|^2_W / L <= |DT| |Ds|_W
     and by Young  |Dz|^2 <= L |DT|^2 / (4 l),  l = 1/(c_nu k) + the smallest eigenvalue of W^1/2 S W^1/2;
 (b) with sigma the largest correlation of normal and tangential forces in the metric C: eliminating Dz gives
     |Dt|^2_C_tt <= L |DT|^2 / (1 - sigma^2), and Dz (C_nn + 1/(omega c_nu k)) Dz = -Dz C_nt Dt gives
     |Dz|^2 <= c_nu k sigma^2 / 4 |Dt|^2_C_tt.

    mu < 2 max( sqrt(l / L), sqrt((1 - sigma^2) / (c_nu k L)) / sigma )   is sufficient.

For one point (a) is sharp where the answer stops being unique, mu = (C_nn + 1/(omega c_nu k)) / |C_nt|, in the worst case.
Monolithic steps with R = -c M, c > 0, have a compliance that is not larger, for which (a) without S holds as it stands.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import orth, pinvh
from scipy.spatial import cKDTree

from warmslip._core import Backend, Factor, Symmetry, momentum_matrix
from warmslip.model.coupling import ZERO, mandel_vector, ratio
from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array
from warmslip.verification.assumptions.findings import Finding, verdict

NEAREST_FACETS = 12  # facets looked at for a contact point, nearest centroids first


@dataclass(frozen=True)
class Uniqueness:
    """Ingredients of the bound: `mobility` L (velocity per traction), `stiffness` l and `correlation` sigma (dimensionless)."""

    mobility: float
    stiffness: float
    correlation: float
    flexibility: float  # 1/(c_nu k): l without the body's own normal compliance

    @property
    def plain(self) -> float:
        """(a) with l = 1/(c_nu k)."""
        return 2 * float(np.sqrt(self.flexibility / self.mobility))

    @property
    def largest(self) -> float:
        """The largest mu for which one answer is proved; infinite if normal and tangential motion do not meet."""
        one = 2 * float(np.sqrt(self.stiffness / self.mobility))
        if self.correlation < 1e-12:
            return float("inf")
        other = self.plain * float(np.sqrt(max(0.0, 1 - self.correlation**2))) / self.correlation
        return max(one, other)


def uniqueness(c: Array, normals: Array, weights: Array, stiffness: float, k: float) -> Uniqueness:
    """From the compliance `c` (d points, d points) of a step of size k; normals (points, d), weights (points)."""
    points, d = normals.shape
    normal = np.zeros((points * d, points))
    for i in range(d):
        normal[np.arange(points) * d + i, np.arange(points)] = normals[:, i]
    # an orthonormal tangent basis at every point: the rest of a QR of its normal
    frames = np.linalg.qr(normals[:, :, None], mode="complete").Q[:, :, 1:]
    tangent = np.zeros((points * d, points * (d - 1)))
    for i in range(d):
        for j in range(d - 1):
            tangent[np.arange(points) * d + i, np.arange(points) * (d - 1) + j] = frames[:, i, j]
    nn, nt, tt = normal.T @ c @ normal, normal.T @ c @ tangent, tangent.T @ c @ tangent
    root, roots = np.sqrt(weights), np.sqrt(np.repeat(weights, d - 1))
    mobility = float(np.linalg.eigvalsh(roots[:, None] * tt * roots)[-1])
    schur = nn - nt @ pinvh(tt, rtol=ZERO) @ nt.T
    least = max(0.0, float(np.linalg.eigvalsh(root[:, None] * (schur + schur.T) / 2 * root)[0]))
    values, vectors = np.linalg.eigh(c)
    # more points than nodes leave forces that move nothing; they have no direction in the metric of C
    real = values > ZERO * values[-1]
    half = np.sqrt(values[real])[:, None] * vectors[:, real].T
    bases = (orth(half @ forces, rcond=np.sqrt(ZERO)) for forces in (normal, tangent))
    correlation = float(np.linalg.norm(next(bases).T @ next(bases), 2))
    return Uniqueness(mobility, 1 / (stiffness * k) + least, correlation, 1 / (stiffness * k))


def step_compliance(d: Discretisation, k: float) -> Array:
    """C at the contact points, (d points, d points), velocity per force, of a staggered or lagged step of size k."""
    matrix = momentum_matrix(d.layout, d.problem, d.operators, k)
    unknowns = d.surface.unknowns(d.dim)
    how = Symmetry.positive_definite, d.dim, "audit", Backend.automatic
    nodal = np.asarray(Factor(matrix, unknowns, *how).compliance())
    nodes = np.asarray(d.layout.mesh_nodes)[np.asarray(unknowns)[:: d.dim] // d.dim]
    values = np.kron(_interpolation(d, nodes), np.eye(d.dim))
    return np.asarray(values @ nodal @ values.T)


def _interpolation(d: Discretisation, nodes: Array) -> Array:
    """P1 values at the contact points from those at `nodes`, mesh numbers: (points, nodes); other nodes are held."""
    x, points = np.asarray(d.mesh.nodes), np.asarray(d.surface.positions)
    facets = np.asarray(d.mesh.parts[d.full.contact.part])
    near = min(NEAREST_FACETS, len(facets))
    _, candidates = cKDTree(x[facets].mean(axis=1)).query(points, k=near)
    candidates = candidates.reshape(len(points), near)
    corners = x[facets[candidates]]  # (points, near, d, d)
    sides = (corners[:, :, 1:] - corners[:, :, :1]).swapaxes(2, 3)
    tail = np.einsum("pfij,pfj->pfi", np.linalg.pinv(sides), points[:, None] - corners[:, :, 0])
    weights = np.concatenate([1 - tail.sum(axis=2, keepdims=True), tail], axis=2)
    miss = np.linalg.norm(np.einsum("pfn,pfnj->pfj", weights, corners) - points[:, None], axis=2)
    size = np.linalg.norm(sides[:, :, :, 0], axis=2)
    best = np.argmin(miss / size + np.clip(-weights, 0, None).sum(axis=2), axis=1)
    every = np.arange(len(points))
    out = np.zeros((len(points), len(x)))
    out[every[:, None], facets[candidates[every, best]]] = weights[every, best]
    return np.asarray(out[:, nodes])


def friction(d: Discretisation) -> Iterator[Finding]:
    """Whether the scene's steps have one answer."""
    scene, material = d.full, d.problem.material
    mu, stiffness, k = scene.contact.friction.coefficient, scene.contact.stiffness, scene.step
    topic, statement = "friction, one answer a step", "the friction coefficient is below the bound proved sufficient"
    if mu == 0 or stiffness == 0:
        why = "Without friction a step is a convex problem." if mu == 0 else "There is no contact force."
        yield Finding(topic, statement, (("mu", mu),), "not needed", f"{why} It has one answer.")
        return
    found = uniqueness(
        step_compliance(d, k), np.asarray(d.surface.normals), np.asarray(d.surface.weights), stiffness, k
    )
    bound = found.largest
    if scene.time.coupling == "monolithic":
        c = ratio(*(mandel_vector(np.asarray(t)) for t in (material.expansion, material.heating)))
        bound = found.plain if c < 0 else 0.0
    if mu < bound:
        meaning = (
            f"Every step has exactly one answer, also under other loads and up to {bound / mu:.3g} times the friction."
        )
    elif bound == 0:
        meaning = "For monolithic steps with a coupling other than R = -c M, c > 0, no bound is known; others have one."
    else:
        meaning = (
            "More than one answer of a step is not excluded; the one found then depends on where the solver starts. The bound "
            "is sufficient only. Viscosity and inertia raise it when steps get smaller."
        )
    values = (
        ("mu", mu),
        ("largest mu", bound),
        ("L c_nu k", found.mobility * stiffness * k),
        ("sigma", found.correlation),
    )
    yield Finding(topic, statement, values, verdict(mu < bound), meaning)
