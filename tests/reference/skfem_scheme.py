"""The paper's test problem assembled by scikit-fem and solved without condensation: an independent check of the core.

Scheme (PF) as in model.md. Every unknown of a step stays in one sparse system,

    (K + contact) w_n = r        K = rho M/k + B + k A, bordered by the heat equation if monolithic,

in which a node in contact brings its compliance p = c_nu (u_nu,old + k w_nu - g), one that slips mu p against its
direction, and one that sticks the condition w_tau = 0, its friction being read off as the reaction. The statuses of the
nodes are iterated until the solution confirms them (a primal active set: Newton's method on the piecewise linear law,
with neither multipliers nor parameters). Every iteration is a sparse direct solve. Everything is dimensionless.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementTriP1, ElementVector, FacetBasis, LinearForm, MeshTri, condense, solve
from skfem.helpers import ddot, dot, grad, sym_grad, trace

ONES, ID = np.ones((2, 2)), np.eye(2)
READINGS = {  # K, M, R
    "printed": (ONES, ONES, ONES),
    "mixed": (ID, ONES, ONES),
    "isotropic": (ID, ID, ID),
    "consistent": (ID, ONES, -ONES),
}
E, KAPPA, MU_1, MU_2, RHO, T = 2.0, 0.1, 10.0, 10.0, 1.0, 1.0
C_NU, MU_TAU, K_C, Q0 = 1e4, 0.2, 1.0, 1.0
F0, FN = (0.0, -1.0), {"left": (1.4, 0.4), "right": (-0.8, 0.4)}
OPEN, STICK, PLUS, MINUS = range(4)  # status of a contact node; the slips have w_x > 0 and w_x < 0
SIGN = np.array([0, 0, 1, -1])
ITERATIONS = 40


def _viscoelastic(trace_factor: float, factor: float) -> BilinearForm:
    """(a tr eps(u) I + b eps(u), eps(v))"""
    return BilinearForm(
        lambda u, v, _: trace_factor * trace(sym_grad(u)) * trace(sym_grad(v)) + factor * ddot(sym_grad(u), sym_grad(v))
    )


MASS = BilinearForm(lambda u, v, _: u * v)
VECTOR_MASS = BilinearForm(lambda u, v, _: dot(u, v))
STRAIN = _viscoelastic(0, 1)


@dataclass(frozen=True)
class Space:
    """Right-diagonal mesh of n x n squares with its spaces and, on the bottom, contact nodes and vertex weights."""

    vector: Basis
    scalar: Basis
    tangential: Any  # (n+1,) unknowns w_x of the bottom nodes, from left to right
    vertical: Any  # (n+1,) their w_y
    weights: Any  # (n+1,) integrals of their hat functions over the bottom
    prescribed_displacement: Any
    prescribed_temperature: Any


@cache
def space(n: int) -> Space:
    line = np.linspace(0, 1, n + 1)
    mesh = MeshTri.init_tensor(line, line).with_defaults()  # the parts left, right, bottom and top
    vector, scalar = Basis(mesh, ElementVector(ElementTriP1())), Basis(mesh, ElementTriP1())
    nodes = np.flatnonzero(mesh.p[1] == 0)
    nodes = nodes[np.argsort(mesh.p[0, nodes])]
    hats = LinearForm(lambda v, _: v).assemble(FacetBasis(mesh, ElementTriP1(), facets="bottom"))
    return Space(
        vector,
        scalar,
        vector.nodal_dofs[0, nodes],
        vector.nodal_dofs[1, nodes],
        hats[scalar.nodal_dofs[0, nodes]],
        vector.get_dofs("top").flatten(),
        scalar.get_dofs(["top", "left", "right"]).flatten(),
    )


class Operators:
    """The matrices and loads of the problem for one reading, before supports."""

    def __init__(self, on: Space, reading: str, theta_F: float, body: tuple[float, float]) -> None:
        K, M, R = READINGS[reading]
        self.mass, self.inertia = MASS.assemble(on.scalar), RHO * VECTOR_MASS.assemble(on.vector)
        self.elasticity = _viscoelastic(E * KAPPA / (1 - KAPPA**2), E / (1 + KAPPA)).assemble(on.vector)
        self.viscosity = _viscoelastic(MU_1, MU_2).assemble(on.vector)
        self.conduction = BilinearForm(
            lambda t, eta, _: sum(K[i, j] * grad(t)[j] * grad(eta)[i] for i in range(2) for j in range(2))
        ).assemble(on.scalar)
        # m(theta, v) maps theta to v, e(w, eta) maps w to eta
        self.expansion = BilinearForm(lambda t, v, _: t * _double_dot(M, sym_grad(v))).assemble(on.scalar, on.vector)
        self.heating = BilinearForm(lambda w, eta, _: _double_dot(R, sym_grad(w)) * eta).assemble(on.vector, on.scalar)
        bottom = FacetBasis(on.scalar.mesh, ElementTriP1(), facets="bottom")
        self.exchange = K_C * MASS.assemble(bottom)
        self.source = LinearForm(lambda eta, _: Q0 * eta).assemble(on.scalar)
        self.source = self.source + LinearForm(lambda eta, _: K_C * theta_F * eta).assemble(bottom)
        self.force = LinearForm(lambda v, _: body[0] * v[0] + body[1] * v[1]).assemble(on.vector)
        for part, (x, y) in FN.items():
            side = FacetBasis(on.vector.mesh, on.vector.elem, facets=part)
            self.force = self.force + LinearForm(lambda v, _, x=x, y=y: x * v[0] + y * v[1]).assemble(side)


def _double_dot(tensor: Any, strain: Any) -> Any:
    return sum(tensor[i, j] * strain[i, j] for i in range(2) for j in range(2))


def contact_step(
    on: Space, system: Any, right: Any, held: Any, gap: Any, k: float, mu: float, status: Any, solver: Any = None
) -> tuple[Any, Any, Any, Any]:
    """(unknowns, status, friction, pressure): friction and pressure are forces by node, on the foundation.

    `gap` is the penetration (n+1,) at w_n = 0, `status` the guess, `solver` a function (matrix, right-hand side) -> unknowns in
    the place of SciPy's. RuntimeError when no statuses are confirmed.
    """
    spring = on.weights * C_NU
    for _ in range(ITERATIONS):
        closed, drag = status != OPEN, mu * SIGN[status]
        # on the foundation: p = spring (gap - k w_y) down, drag p along x
        stiffness = np.where(closed, spring * k, 0)
        extra = sp.coo_matrix(
            (
                np.concatenate([stiffness, -drag * stiffness]),
                (np.concatenate([on.vertical, on.tangential]), np.tile(on.vertical, 2)),
            ),
            shape=system.shape,
        )
        load = right.copy()
        load[on.vertical] += np.where(closed, spring * gap, 0)
        load[on.tangential] -= drag * np.where(closed, spring * gap, 0)
        stuck = on.tangential[status == STICK]
        y = solve(*condense(sp.csr_matrix(system + extra), load, D=np.union1d(held, stuck)), solver=solver)
        r = gap - k * y[on.vertical]
        pressure = np.where(closed, spring * r, 0)
        friction = np.where(status == STICK, (right - system @ y)[on.tangential], drag * pressure)
        next_ = _confirm(status, r, y[on.tangential], friction, mu * pressure)
        if (next_ == status).all():
            return y, status, friction, pressure
        status = next_
    raise RuntimeError(f"no statuses of the contact nodes are confirmed in {ITERATIONS} iterations")


def _confirm(status: Any, r: Any, w_tau: Any, friction: Any, bound: Any) -> Any:
    """The statuses that the solution asks for: unchanged where it obeys the law."""
    forward = np.where(w_tau > 0, PLUS, MINUS)
    stuck = np.where(np.abs(friction) <= bound, STICK, np.where(friction > 0, PLUS, MINUS))
    slipping = np.where(SIGN[status] * w_tau >= 0, status, STICK)
    return np.select([r <= 0, status == OPEN, status == STICK], [OPEN, forward, stuck], slipping)


def simulate(
    reading: str,
    theta_F: float,
    n: int,
    steps: int,
    coupling: str = "staggered",
    body: tuple[float, float] = F0,
    mu: float = MU_TAU,
) -> dict[str, float]:
    """From rest to time T: norms of the last fields, and the force on the body over Gamma_C, by name."""
    on, k, monolithic = space(n), T / steps, coupling == "monolithic"
    ops = Operators(on, reading, theta_F, body)
    size = on.vector.N
    momentum = ops.inertia / k + ops.viscosity + k * ops.elasticity
    heat = ops.mass / k + ops.conduction + ops.exchange
    system, held = momentum, on.prescribed_displacement
    if monolithic:
        system = sp.bmat([[momentum, -ops.expansion], [-ops.heating, heat]]).tocsr()
        held = np.concatenate([on.prescribed_displacement, size + on.prescribed_temperature])
    u, w, theta = np.zeros(size), np.zeros(size), np.zeros(on.scalar.N)
    status = np.full(n + 1, OPEN)
    for _ in range(steps):
        right = ops.force + ops.inertia @ w / k - ops.elasticity @ u
        warmth = ops.source + ops.mass @ theta / k
        right = np.concatenate([right, warmth]) if monolithic else right + ops.expansion @ theta
        y, status, friction, pressure = contact_step(on, system, right, held, -u[on.vertical], k, mu, status)
        w_star = w if coupling == "lagged" else y[:size]
        theta = (
            y[size:]
            if monolithic
            else solve(*condense(heat, warmth + ops.heating @ w_star, D=on.prescribed_temperature))
        )
        w = y[:size]
        u = u + k * w
    return final(on, ops, u, w, theta, friction, pressure)


def final(on: Space, ops: Operators, u: Any, w: Any, theta: Any, friction: Any, pressure: Any) -> dict[str, float]:
    """Norms of the fields, and the force on the body over Gamma_C, by name."""
    plain = ops.inertia / RHO
    return {
        "u_V": float(np.sqrt(u @ STRAIN.assemble(on.vector) @ u)),
        "u_L2": float(np.sqrt(u @ plain @ u)),
        "w_L2": float(np.sqrt(w @ plain @ w)),
        "theta_L2": float(np.sqrt(theta @ ops.mass @ theta)),
        "traction_x": -float(friction.sum()),
        "traction_y": float(pressure.sum()),
    }
