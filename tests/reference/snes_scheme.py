"""The paper's test problem with PETSc's SNES: what a user of petsc4py would write around the matrices of scikit-fem.

The unknowns of a step are the velocity and one friction force for each contact node. Friction solves lam = clip(lam + r w_tau,
mu p), so that Coulomb's law is exact. SNES calls for a new Jacobian in each iteration, and MUMPS factors it. Everything is
dimensionless.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from reference import skfem_scheme as code

TOLERANCE = 1e-11  # absolute, of the residual
AUGMENTATION = 10.0  # r: the answer does not depend on it, the iterations do
ITERATIONS = 100


@dataclass
class Step:
    """Residual and Jacobian of the momentum equation of a step, whose data change from step to step."""

    on: code.Space
    momentum: Any  # (size, size) before supports
    k: float
    right: Any  # (size,)
    gap: Any  # (n+1,) penetration at w_n = 0

    def __post_init__(self) -> None:
        size, held = self.on.vector.N, self.on.prescribed_displacement
        self.friction = size + np.arange(len(self.on.tangential))  # places of these unknowns
        free = sp.diags(np.isin(np.arange(size), held, invert=True).astype(float))
        linear = sp.csr_matrix(free @ self.momentum @ free + sp.identity(size) - free)
        self.linear = sp.block_diag([linear, sp.csr_matrix((len(self.friction),) * 2)]).tocsr()
        self.spring = self.on.weights * code.C_NU

    def law(self, x: Any) -> tuple[Any, Any]:
        """Pressures of the nodes, and their frictions before these are clipped."""
        pressure = self.spring * np.maximum(self.gap - self.k * x[self.on.vertical], 0)
        return pressure, x[self.friction] + AUGMENTATION * self.on.weights * x[self.on.tangential]

    def residual(self, _: Any, x: Any, out: Any) -> None:
        y, found = x.getArray(readonly=True), out.getArray()
        pressure, trial = self.law(y)
        found[:] = self.linear @ y
        found[: len(self.right)] -= self.right
        found[self.on.tangential] += y[self.friction]
        found[self.on.vertical] -= pressure
        found[self.on.prescribed_displacement] = y[self.on.prescribed_displacement]
        bound = code.MU_TAU * pressure
        found[self.friction] = y[self.friction] - np.clip(trial, -bound, bound)

    def jacobian(self, _: Any, x: Any, matrix: Any, __: Any) -> None:
        whole = self.linear + self._contact(x.getArray(readonly=True))
        matrix.zeroEntries()
        matrix.setValuesCSR(whole.indptr, whole.indices, whole.data)
        matrix.assemble()

    def _contact(self, y: Any) -> Any:
        pressure, trial = self.law(y)
        slips = np.abs(trial) >= code.MU_TAU * pressure
        slope = np.where(pressure > 0, self.spring * self.k, 0)
        drag = np.where(slips, np.sign(trial) * code.MU_TAU * slope, 0)
        creep = np.where(slips, 0, -AUGMENTATION * self.on.weights)
        return self._places(slope, np.ones(len(slope)), slips.astype(float), creep, drag)

    def _places(self, *values: Any) -> Any:
        on, friction = self.on, self.friction
        rows = (on.vertical, on.tangential, friction, friction, friction)
        columns = (on.vertical, friction, friction, on.tangential, on.vertical)
        where = (np.concatenate(rows), np.concatenate(columns))
        return sp.csr_matrix((np.concatenate(values), where), shape=self.linear.shape)

    @cached_property
    def matrix(self) -> Any:
        """With room for all entries of the Jacobian."""
        return aij(abs(self.linear) + self._places(*np.ones((5, len(self.friction)))))


def aij(matrix: Any) -> Any:
    """A sparse matrix of SciPy as one of PETSc."""
    matrix = sp.csr_matrix(matrix)
    matrix.sort_indices()
    return PETSc.Mat().createAIJ(matrix.shape, csr=(matrix.indptr, matrix.indices, matrix.data), comm=PETSc.COMM_SELF)


def direct(ksp: Any) -> None:
    """Solves by factors of MUMPS."""
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")


def simulate(theta_F: float, n: int, steps: int, reading: str = "mixed") -> dict[str, float]:
    """Staggered backward Euler to the end: final norms and forces, CPU seconds and factorizations.

    RuntimeError where SNES does not converge.
    """
    on, k = code.space(n), code.T / steps
    ops = code.Operators(on, reading, theta_F, code.F0)
    size, free = on.vector.N, np.setdiff1d(np.arange(on.scalar.N), on.prescribed_temperature)
    momentum = ops.inertia / k + ops.viscosity + k * ops.elasticity
    heat = ops.mass / k + ops.conduction + ops.exchange
    step = Step(on, momentum, k, np.zeros(size), np.zeros(n + 1))
    x, snes = step.matrix.createVecRight(), PETSc.SNES().create(PETSc.COMM_SELF)
    snes.setFunction(step.residual, x.duplicate())
    snes.setJacobian(step.jacobian, step.matrix)
    snes.setTolerances(rtol=0, atol=TOLERANCE, stol=0, max_it=ITERATIONS)
    direct(snes.getKSP())
    warm = PETSc.KSP().create(PETSc.COMM_SELF)
    warm.setOperators(aij(heat[free][:, free]))
    direct(warm)
    y, b = warm.getOperators()[0].createVecs()
    u, w, theta = np.zeros(size), np.zeros(size), np.zeros(on.scalar.N)
    iterations, began = 0, time.process_time()
    for _ in range(steps):
        step.right = ops.force + ops.inertia @ w / k - ops.elasticity @ u + ops.expansion @ theta
        step.gap = -u[on.vertical]
        snes.solve(None, x)
        if snes.getConvergedReason() <= 0:
            raise RuntimeError(f"SNES ends with reason {snes.getConvergedReason()}")
        iterations += snes.getIterationNumber()
        w = x.getArray()[:size].copy()
        b.setArray((ops.source + ops.mass @ theta / k + ops.heating @ w)[free])
        warm.solve(b, y)
        theta = np.zeros(on.scalar.N)
        theta[free] = y.getArray()
        u = u + k * w
    taken = time.process_time() - began
    found = x.getArray()
    final = code.final(on, ops, u, w, theta, found[step.friction], step.law(found)[0])
    return final | {"seconds": taken, "factorizations": iterations + 1}
