"""Constants of the theory on a scene's own mesh: best constants of inequalities, by symmetric generalised eigenproblems.

On P1 functions a trace constant is a lower bound of the continuous one, the decay rate an upper bound; both converge
under refinement. They are exact for the scheme, whose functions these are. One rank.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from scipy.linalg import eigh
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from warmslip.model.coupling import ZERO
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.typing import Array

DENSE = 150  # unknowns up to which LAPACK is quicker than Lanczos


def trace_constants(d: Discretisation) -> tuple[float, float]:
    """(c_1, c_3): |v|_L2(Gamma_C) <= c_1 |eps(v)|_L2 on V^h and |eta|_L2(Gamma_C) <= c_3 |grad eta|_L2 on Q^h.

    The paper's names: c_1 belongs to V with |v|_V = |eps(v)|, c_3 to Q with |eta|_Q = |grad eta|. Squares are lengths.
    Infinite where no part holds the field: a rigid motion, or a constant, has a trace and no norm.
    """
    # the same assembly with unit tensors gives the norms themselves
    unit = d.full.override(
        elasticity={"lame": [0.0, 0.5]},
        **{"heat.conductivity": np.eye(d.dim).tolist(), "contact.heat_exchange.conductance": 1.0},
    )
    forms = discretise(unit, comm=MPI.COMM_SELF, mesh=d.mesh).operators
    boundary = sparse(forms.exchange)
    c_1 = _largest(sp.kron(boundary, sp.identity(d.dim)), sparse(forms.elasticity), forms.prescribed_displacement)
    c_3 = _largest(boundary, sparse(forms.conductivity), forms.prescribed_temperature)
    return float(np.sqrt(c_1)), float(np.sqrt(c_3))


def decay_rate(d: Discretisation) -> float:
    """lambda_1, one over time: d(theta, theta) + int k_c theta^2 >= lambda_1 |theta|_L2^2 on Q^h, the slowest decay of heat."""
    forms = d.operators
    flow, mass = sparse(forms.conductivity), sparse(forms.mass)
    if forms.exchange is not None:
        flow = flow + sparse(forms.exchange)
    free = _free(flow.shape[0], forms.prescribed_temperature)
    flow, mass = flow[free][:, free], mass[free][:, free]
    if len(free) == 0:
        return float("inf")
    size = abs(flow).max() / abs(mass).max()
    if size == 0:
        return 0.0
    if len(free) <= DENSE:
        low = eigh(flow.toarray(), mass.toarray(), eigvals_only=True, subset_by_index=[0, 0])[0]
    else:  # a shift below the spectrum, so that a singular K can be factored too
        start = np.ones(len(free))
        low = eigsh(flow, k=1, M=mass, sigma=-1e-6 * size, v0=start, tol=1e-8, return_eigenvectors=False)[0]
    return float(low) if low > ZERO * size else 0.0


def sparse(matrix: Any) -> sp.csr_matrix:
    """A petsc4py matrix of one rank as SciPy's, same numbering."""
    pointers, columns, values = matrix.getValuesCSR()
    return sp.csr_matrix((values, columns, pointers), shape=matrix.getSize())


def _free(size: int, held: list[int]) -> Array:
    return np.setdiff1d(np.arange(size), held)


def _largest(form: Any, norm: sp.csr_matrix, held: list[int]) -> float:
    """The largest form(v, v) / norm(v, v) over vectors that vanish at `held`; infinite when nothing is held."""
    if not held:
        return float("inf")
    free = _free(norm.shape[0], held)
    form, norm = form.tocsr()[free][:, free], norm[free][:, free].tocsc()
    if len(free) == 0 or form.nnz == 0:
        return 0.0
    if len(free) <= DENSE:
        last = len(free) - 1
        return float(eigh(form.toarray(), norm.toarray(), eigvals_only=True, subset_by_index=[last, last])[0])
    inverse = LinearOperator(norm.shape, matvec=splu(norm).solve, dtype=float)
    start = np.random.default_rng(1).standard_normal(len(free))  # no symmetry that could hide the largest
    return float(eigsh(form, k=1, M=norm, Minv=inverse, which="LA", v0=start, return_eigenvectors=False)[0])
