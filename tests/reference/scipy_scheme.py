"""The paper's test problem with SciPy alone: an independent check of the core, and the baseline of the speed benchmark.

Scheme (PF): P1 triangles, backward Euler, u_n = u_{n-1} + k w_n. Node i + (n+1) j sits at (i/n, j/n); component c of
node a is entry 2 a + c of a vector field. With K = rho M/k + B + k A (momentum) and H = M/k + D + J (heat) a step is

    K w_n + P s  =  f + rho/k M w_{n-1} - A u_{n-1} + G theta_*      staggered   theta_* = theta_{n-1}, w_* = w_n
    H theta_n    =  q + theta_F J 1 + M/k theta_{n-1} + E w_*        lagged      theta_* = theta_{n-1}, w_* = w_{n-1}
                                                                     monolithic  theta_* = theta_n,     w_* = w_n

P turns the contact tractions s = (lam, p) of the bottom nodes into nodal forces (vertex rule). K never changes, so it
is factored once: a step costs one solve with K, a dense problem for s on the contact nodes (class Contact), the
correction w_n = K^-1 right - Y s with the stored Y = K^-1 P (plainer and slower: a second solve), and one solve with H.
Monolithic factors the coupled matrix of both fields instead. Every quantity is dimensionless.
"""

from dataclasses import dataclass
from itertools import pairwise
from time import process_time

import numpy as np
import scipy.sparse as sp
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import splu

ONES, ID = np.ones((2, 2)), np.eye(2)
READINGS = {  # conductivity K, expansion M, heating R
    "printed": (ONES, ONES, ONES),
    "mixed": (ID, ONES, ONES),
    "isotropic": (ID, ID, ID),
    "consistent": (ID, ONES, -ONES),
}
COUPLINGS = "staggered", "lagged", "monolithic"
ELASTICITY = 2 * 0.1 / (1 - 0.1**2), 2 / (1 + 0.1)  # (a, b) of tau -> a tr(tau) I + b tau, from E = 2, kappa = 0.1
VISCOSITY = 10.0, 10.0
BODY_FORCE, HEAT_SOURCE = np.array([0.0, -1.0]), 1.0
TRACTION_LEFT, TRACTION_RIGHT = np.array([1.4, 0.4]), np.array([-0.8, 0.4])

# The fastest of SciPy's orderings here: the patterns are symmetric and pivoting is not needed.
FACTOR = dict(permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=dict(SymmetricMode=True))

OPEN, STICK, SLIP_PLUS, SLIP_MINUS = range(4)  # status of a contact node; the slips are those with w_x > 0 and w_x < 0
LAW_TOLERANCE = 1e-12  # on the residual of the contact law, relative to the largest traction, above round-off
NEWTON_LIMIT, SWEEP_LIMIT = 30, 10000


def _cells(n):
    """Right-diagonal mesh: cells (2 n^2, 3), gradients (2 n^2, 3, 2) of their hat functions, their strains
    (2 n^2, 6, 2, 2) and numbers (2 n^2, 6) as vector fields, and the area of a cell."""
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    below, above = [0, 1, n + 2], [0, n + 2, n + 1]
    cells = np.vstack([corner[:, None] + below, corner[:, None] + above])
    slopes = n * np.array([[[-1, 0], [1, -1], [0, 1]], [[0, -1], [1, 0], [-1, 1]]], dtype=float)
    gradients = np.repeat(slopes, n * n, axis=0)
    half = np.einsum("eaj,ci->eacij", gradients, ID / 2)  # half the gradient of component c of node a
    strains = (half + half.swapaxes(-1, -2)).reshape(-1, 6, 2, 2)
    return cells, gradients, strains, (2 * cells[:, :, None] + [0, 1]).reshape(-1, 6), 0.5 / n**2


def _assemble(blocks, rows, columns, shape):
    """Sum cell blocks (cells, r, c) into a CSR matrix; rows (cells, r) and columns (cells, c) are global numbers."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return sp.csr_matrix((np.broadcast_to(blocks, i.shape).ravel(), (i.ravel(), j.ravel())), shape=shape)


def _stiffness(n, a, b):
    """Matrix (2N, 2N) of (a tr eps(u) I + b eps(u), eps(v))."""
    _, _, eps, dofs, area = _cells(n)
    trace = np.trace(eps, axis1=2, axis2=3)
    blocks = a * np.einsum("er,ec->erc", trace, trace) + b * np.einsum("erij,ecij->erc", eps, eps)
    return _assemble(area * blocks, dofs, dofs, (2 * (n + 1) ** 2,) * 2)


def operators(n, reading, k_c=1.0):
    """Matrices of the forms on all N = (n+1)^2 nodes, before any boundary condition: dict(M, A, B, D, G, E, J).

    M (N, N) consistent mass of a scalar field (of a vector field: kron(M, I_2)); A, B (2N, 2N) elasticity, viscosity;
    D (N, N) conduction; G (2N, N) with v.G theta = (theta M, eps(v)); E (N, 2N) with eta.E w = (R : eps(w), eta);
    J (N, N) with eta.J theta = k_c int theta eta over the bottom edge.
    """
    conduction, expansion, heating = READINGS[reading]
    cells, gradients, eps, dofs, area = _cells(n)
    edges = np.arange(n)[:, None] + [0, 1]
    N, third = (n + 1) ** 2, np.full(3, area / 3)  # third: integral of a hat function over a cell
    return dict(
        M=_assemble(area / 12 * (np.ones((3, 3)) + np.eye(3)), cells, cells, (N, N)),
        A=_stiffness(n, *ELASTICITY),
        B=_stiffness(n, *VISCOSITY),
        D=_assemble(area * np.einsum("eri,ij,ecj->erc", gradients, conduction, gradients), cells, cells, (N, N)),
        G=_assemble(np.einsum("ij,erij,c->erc", expansion, eps, third), dofs, cells, (2 * N, N)),
        E=_assemble(np.einsum("ij,ecij,r->erc", heating, eps, third), cells, dofs, (N, 2 * N)),
        J=_assemble(k_c / (6 * n) * (ONES + ID), edges, edges, (N, N)),
    )


def edge_weights(n):
    """Integrals (n+1,) of the hat functions over one side of the square; on the bottom, the contact quadrature."""
    return np.r_[0.5, np.ones(n - 1), 0.5] / n


def loads(n, ops, theta_F):
    """Vectors of (f0, v) + int fN v, shape (2N,), and of (q0, eta) + k_c int theta_F eta, shape (N,)."""
    ones = np.ones((n + 1) ** 2)
    force = np.outer(ops["M"] @ ones, BODY_FORCE)
    force[:: n + 1] += np.outer(edge_weights(n), TRACTION_LEFT)
    force[n :: n + 1] += np.outer(edge_weights(n), TRACTION_RIGHT)
    return force.ravel(), HEAT_SOURCE * (ops["M"] @ ones) + theta_F * (ops["J"] @ ones)


class Contact:
    """Normal compliance with exact Coulomb friction at m nodes, by a semismooth Newton method.

    Unknowns s (2m,): friction tractions lam, then pressures p. With v_t = w_x, v_n = -w_y (the normal is (0, -1)), free
    velocities z (those without contact) and v = z - W s, the law, its threshold implicit, is

        p = c_nu max(r, 0),  r = u_n,old + k v_n - g,       lam = projection of lam + c_t v_t on [-mu p, mu p].

    Given every node's status the law is linear: Newton goes from status to status and keeps the last factored tangent.
    The residual of the law decides convergence. When a status comes back, Gauss-Seidel sweeps over the scalar laws, a
    fixed point on the threshold, supply another status to start from.
    """

    def __init__(self, W, k, c_nu, mu, gap=0.0):
        self.W, self.k, self.c_nu, self.mu, self.gap, self.m = W, k, c_nu, mu, gap, len(W) // 2
        self.c_t = 1 / abs(W[: self.m, : self.m]).sum(axis=1)  # 1/diag(W) amplifies round-off with n
        self.status, self.tangent_status = np.full(self.m, OPEN), None
        self.iterations, self.rescues = 0, 0

    def solve(self, z, u_n):
        """Tractions s (2m,) for free velocities z (2m,) and the previous normal displacements u_n (m,)."""
        s = self._newton(z, u_n)
        return self._rescue(z, u_n) if s is None else s

    def residual(self, s, v, r):
        """Residual of the law in units of traction, relative to the largest one; s, v (2m,), r (m,)."""
        lam, p, v_t = s[: self.m], s[self.m :], v[: self.m]
        p_law = self.c_nu * np.maximum(r, 0)
        lam_law = np.clip(lam + self.c_t * v_t, -self.mu * p, self.mu * p)
        return max(abs(p - p_law).max(), abs(lam - lam_law).max()) / (max(abs(s).max(), p_law.max()) or 1.0)

    def _status(self, s, v, r):
        trial, bound = s[: self.m] + self.c_t * v[: self.m], self.mu * self.c_nu * r
        return np.select([r <= 0, trial > bound, trial < -bound], [OPEN, SLIP_PLUS, SLIP_MINUS], STICK)

    def _newton(self, z, u_n):
        """Tractions that satisfy the law, or None if the iteration cycles; starts from self.status."""
        seen = set()
        round_off = 8 * np.finfo(float).eps * self.c_nu * (abs(u_n) + self.k * abs(z[self.m :])).max()
        while self.status.tobytes() not in seen and len(seen) < NEWTON_LIMIT:
            seen.add(self.status.tobytes())
            self.iterations += 1
            s = self._linear(z, u_n)
            v = z - self.W @ s
            r = u_n + self.k * v[self.m :] - self.gap
            if self.residual(s, v, r) <= LAW_TOLERANCE + round_off / (abs(s).max() or 1.0):
                return s
            self.status = self._status(s, v, r)
        return None

    def _linear(self, z, u_n):
        """Tractions of the linear law given by self.status: p where closed, lam = sigma p or, where stick, unknown."""
        closed, stick = self.m + np.flatnonzero(self.status != OPEN), np.flatnonzero(self.status == STICK)
        s = np.zeros(2 * self.m)
        if not len(closed):
            return s
        sigma = self.mu * np.array([0, 0, 1, -1])[self.status[closed - self.m]]
        stiff = self.c_nu * self.k
        if self.tangent_status != self.status.tobytes():
            by_p, by_lam = self.W[:, closed] + self.W[:, closed - self.m] * sigma, self.W[:, stick]
            tangent = np.block(
                [[by_lam[stick], by_p[stick]], [stiff * by_lam[closed], stiff * by_p[closed] + np.eye(len(closed))]]
            )
            self.tangent, self.tangent_status = lu_factor(tangent, check_finite=False), self.status.tobytes()
        penetration = u_n + self.k * z[self.m :] - self.gap
        right = np.concatenate([z[stick], self.c_nu * penetration[closed - self.m]])
        s[np.concatenate([stick, closed])] = lu_solve(self.tangent, right, check_finite=False)
        s[closed - self.m] += sigma * s[closed]
        return s

    def _rescue(self, z, u_n):
        """Gauss-Seidel: at each node p given the rest, then lam given p. Newton is tried after 1, 2, 4, ... sweeps."""
        self.rescues += 1
        s, W, m = np.zeros(2 * self.m), self.W, self.m
        for sweep in range(1, SWEEP_LIMIT + 1):
            for t, n in ((a, m + a) for a in range(m)):
                v_n, v_t = z[n] - W[n] @ s + W[n, n] * s[n], z[t] - W[t] @ s + W[t, t] * s[t]
                p = self.c_nu * max(u_n[t] + self.k * v_n - self.gap, 0) / (1 + self.c_nu * self.k * W[n, n])
                v_t += W[t, n] * (s[n] - p)
                s[n], s[t] = p, np.clip(v_t / W[t, t], -self.mu * p, self.mu * p)
            if sweep & (sweep - 1) == 0:
                v = z - W @ s
                self.status = self._status(s, v, u_n + self.k * v[m:] - self.gap)
                found = self._newton(z, u_n)
                if found is not None:
                    return found
        raise RuntimeError("contact law not satisfied: Newton cycles and the Gauss-Seidel sweeps do not help")


@dataclass
class Result:
    """Fields lead with the time index: steps + 1 levels, or the last one alone with keep="final"."""

    parameters: dict  # the arguments of simulate
    u: np.ndarray  # (levels, N, 2) displacement
    w: np.ndarray  # (levels, N, 2) velocity
    theta: np.ndarray  # (levels, N) temperature
    pressure: np.ndarray  # (steps + 1, n + 1) p at the contact nodes; times edge_weights(n) the nodal force
    friction: np.ndarray  # (steps + 1, n + 1) lam, opposing w_x; the contact force on the body is (-lam, p)
    law_residual: np.ndarray  # (steps + 1,) Contact.residual of the final u_n and w_n of each step
    iterations: int  # Newton iterations of the run
    rescues: int  # steps in which Newton cycled
    seconds_setup: float  # CPU time of assembly and factorisations
    seconds_factor: float  # of the latter
    seconds_compliance: float  # of what unit contact tractions do to the body
    seconds_loop: float  # CPU time of the time loop


def simulate(
    reading, theta_F, n, steps, coupling="staggered", T=1.0, mu=0.2, c_nu=1e4, k_c=1.0, rho=1.0, keep="all", store=True
):
    """Run the scheme on n x n squares from rest, u = w = theta = 0, to time T; keep is "all" or "final". The contact
    tractions correct the velocities through the stored K^-1 P, or by a second solve with K when store is False."""
    parameters = dict(locals())  # the arguments alone, so far
    if coupling not in COUPLINGS or keep not in ("all", "final"):
        raise ValueError(f"unknown coupling {coupling!r} or keep {keep!r}")
    clock = process_time()
    k, N, m, monolithic, ops = T / steps, (n + 1) ** 2, n + 1, coupling == "monolithic", operators(n, reading, k_c)
    j, i = np.divmod(np.arange(N), n + 1)
    free_u, free_theta = np.repeat(j < n, 2) * 1.0, ((j < n) & (i > 0) & (i < n)) * 1.0

    factoring = []

    def factor(matrix, free):  # rows and columns of the unknowns that are not free become those of the identity
        matrix = sp.csc_matrix(sp.diags(free) @ matrix @ sp.diags(free) + sp.diags(1 - free))
        matrix.eliminate_zeros()
        began = process_time()
        found = splu(matrix, **FACTOR)
        factoring.append(process_time() - began)
        return found

    inertia, storage = rho / k * sp.kron(ops["M"], ID), ops["M"] / k
    K, H = inertia + ops["B"] + k * ops["A"], storage + ops["D"] + ops["J"]
    if monolithic:
        solver = factor(sp.bmat([[K, -ops["G"]], [-ops["E"], H]]), np.concatenate([free_u, free_theta]))
    else:
        solver, heat_solver = factor(K, free_u), factor(H, free_theta)
    inertia, elastic, expansion = (sp.csr_matrix(sp.diags(free_u) @ X) for X in (inertia, ops["A"], ops["G"]))
    storage, heating = (sp.csr_matrix(sp.diags(free_theta) @ X) for X in (storage, ops["E"]))
    force, source = loads(n, ops, theta_F)
    force, source = free_u * force, free_theta * source

    node = np.arange(m)  # the contact nodes come first; their unknowns are 2 node and 2 node + 1
    P = np.zeros((solver.shape[0], 2 * m), order="F")
    P[2 * node, node], P[2 * node + 1, m + node] = edge_weights(n), -edge_weights(n)
    began = process_time()
    Y, sparse_P = solver.solve(P), sp.csr_matrix(P)
    seconds_compliance = process_time() - began

    def local(field):  # tangential components, then normal ones, at the contact nodes
        return np.concatenate([field[0 : 2 * m : 2], -field[1 : 2 * m : 2]])

    contact = Contact(local(Y), k, c_nu, mu)
    u, w, theta = np.zeros(2 * N), np.zeros(2 * N), np.zeros(N)
    levels, tractions, law = [(u, w, theta)], np.zeros((steps + 1, 2 * m)), np.zeros(steps + 1)
    seconds_setup, clock = process_time() - clock, process_time()
    for step in range(1, steps + 1):
        right = force + inertia @ w - elastic @ u
        right = np.concatenate([right, source + storage @ theta]) if monolithic else right + expansion @ theta
        fields = solver.solve(right)
        s = contact.solve(local(fields), local(u)[m:])
        closed = np.flatnonzero(s[m:])
        if not store:
            fields = solver.solve(right - sparse_P @ s)
        elif len(closed):
            for block in (0, m):  # only the columns between the first and the last closed node
                span = slice(block + closed[0], block + closed[-1] + 1)
                fields -= Y[:, span] @ s[span]
        w_before, w = w, fields[: 2 * N]
        w_star = w_before if coupling == "lagged" else w
        theta = fields[2 * N :] if monolithic else heat_solver.solve(source + storage @ theta + heating @ w_star)
        u = u + k * w
        tractions[step], law[step] = s, contact.residual(s, local(w), local(u)[m:] - contact.gap)
        if keep == "final":
            levels.clear()
        levels.append((u, w, theta))
    seconds_loop = process_time() - clock
    u, w, theta = (np.array(field) for field in zip(*levels, strict=True))
    return Result(
        parameters,
        u.reshape(-1, N, 2),
        w.reshape(-1, N, 2),
        theta,
        tractions[:, m:],
        tractions[:, :m],
        law,
        contact.iterations,
        contact.rescues,
        seconds_setup,
        sum(factoring),
        seconds_compliance,
        seconds_loop,
    )


def norms(n, u, w, theta):
    """dict(u_V, u_L2, w_L2, theta_L2) of nodal fields u, w (N, 2) and theta (N,), with |u|_V = |eps(u)|_L2."""
    M, strain = operators(n, "isotropic")["M"], _stiffness(n, 0.0, 1.0)
    squares = dict(
        u_V=u.ravel() @ (strain @ u.ravel()),
        u_L2=np.sum(u * (M @ u)),
        w_L2=np.sum(w * (M @ w)),
        theta_L2=theta @ (M @ theta),
    )
    return {name: float(np.sqrt(square)) for name, square in squares.items()}


def identities(result):
    """Worst defects (energy, heat) of a run kept whole, each relative to the largest term of its step: the balances of
    verification.md, section 3, for v = k w_n and eta = k theta_n, from the trajectory alone."""
    run = result.parameters
    n, k, c_nu = run["n"], run["T"] / run["steps"], run["c_nu"]
    ops, weights, worst = operators(n, run["reading"], run["k_c"]), edge_weights(n), np.zeros(2)
    force, source = loads(n, ops, run["theta_F"])
    A, M, mass = ops["A"], ops["M"], run["rho"] * sp.kron(ops["M"], ID)
    levels = [[field.ravel() for field in level] for level in zip(result.u, result.w, result.theta, strict=True)]
    for (u0, w0, theta0), (u, w, theta) in pairwise(levels):
        theta_star = theta if run["coupling"] == "monolithic" else theta0
        w_star = w0 if run["coupling"] == "lagged" else w
        r0, r, slip = -u0[1 : 2 * n + 2 : 2], -u[1 : 2 * n + 2 : 2], w[0 : 2 * n + 2 : 2]
        stored0, stored = (c_nu / 2 * weights @ np.maximum(x, 0) ** 2 for x in (r0, r))
        p = c_nu * np.maximum(r, 0)
        energy = [  # new and old energy; dissipation of backward Euler, then of viscosity and friction; work
            w @ mass @ w / 2,
            u @ A @ u / 2,
            stored,
            -w0 @ mass @ w0 / 2,
            -u0 @ A @ u0 / 2,
            -stored0,
            (w - w0) @ mass @ (w - w0) / 2,
            (u - u0) @ A @ (u - u0) / 2,
            stored0 - stored - weights @ (p * (r0 - r)),
            k * w @ ops["B"] @ w,
            k * run["mu"] * weights @ (p * abs(slip)),
            -k * force @ w,
            -k * w @ ops["G"] @ theta_star,
        ]
        heat = [
            theta @ M @ theta / 2,
            -theta0 @ M @ theta0 / 2,
            (theta - theta0) @ M @ (theta - theta0) / 2,
            k * theta @ (ops["D"] + ops["J"]) @ theta,
            -k * source @ theta,
            -k * theta @ ops["E"] @ w_star,
        ]
        worst = np.maximum(worst, [abs(sum(terms)) / (max(map(abs, terms)) or 1.0) for terms in (energy, heat)])
    return tuple(worst.tolist())
