"""A manufactured solution with contact and slip on all of Gamma_C, its data derived by sympy from one description.

On the unit square with the supports of the paper's problem, u and theta vanish where they must, the body penetrates the
foundation everywhere on the bottom (u_nu > g) and slides in one direction, so the data are smooth and O(h+k) is owed.
What the contact law does not give is prescribed as an extra traction g_C and an extra flux on Gamma_C:

    sigma nu + p_nu(u_nu - g) nu + p_tau w_tau/|w_tau| = g_C,        -q.nu + k_c (theta_F - theta) = -(extra flux)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from warmslip import rates
from warmslip.errors import TERMS, ExactErrors, Largest
from warmslip.loads import Array, Loads
from warmslip.problem import mandel
from warmslip.runner import Run
from warmslip.scene import Scene

X, Y, T = sp.symbols("x y t", real=True)


@dataclass(frozen=True)
class Manufactured:
    """Exact fields (functions of positions and time) and the loads that produce them."""

    u: Callable[[Array, float], Array]
    w: Callable[[Array, float], Array]
    theta: Callable[[Array, float], Array]
    gradient: Callable[[Array, float], Array]
    loads: Loads


def _function(expression: Any) -> Callable[[Array, float], Array]:
    """A sympy scalar or matrix as a function of positions (points, 2) and time."""
    shape = expression.shape if isinstance(expression, sp.MatrixBase) else ()
    flat = list(expression) if shape else [expression]
    compiled = [sp.lambdify((X, Y, T), e, "numpy", cse=True) for e in flat]
    columns = tuple(s for s in shape if s != 1)

    def function(x: Array, t: float) -> Array:
        values = [np.broadcast_to(f(x[:, 0], x[:, 1], t), (len(x),)) for f in compiled]
        return np.stack(values, axis=1).reshape((len(x), *columns)) if shape else np.array(values[0])

    return function


def slipping(scene: Scene) -> Manufactured:
    """Full slip to the right with a varying pressure, for a 2D scene clamped at the top and cooled at top, left and right.

    Raises ValueError when the scene's supports are not those, or when the fields would leave contact or reverse the slip.
    """
    if (
        scene.mesh.dim != 2
        or scene.supports.displacement != ["top"]
        or set(scene.supports.temperature) != {"top", "left", "right"}
    ):
        raise ValueError(
            "the manufactured solution is for a square clamped at the top and cooled at top, left and right"
        )
    grow = sp.exp(T)
    # u_y < 0 on y = 0 presses the body into the foundation; u_x grows in time, so w_x > 0 there
    u = sp.Matrix(
        [
            sp.Rational(1, 10) * (1 - Y**2) * (1 + sp.sin(sp.pi * X) / 2) * grow,
            -sp.Rational(1, 1000) * (1 - Y) * (2 + sp.cos(sp.pi * X)) * (1 + T / 2),
        ]
    )
    # theta moves fast, so that the errors in time are seen beside those in space
    theta = sp.sin(sp.pi * X) * (1 - Y) * (1 + Y / 2) * (2 + sp.sin(6 * T))
    w = u.diff(T)
    nu = sp.Matrix([0, -1])

    def strain(v: Any) -> Any:
        g = v.jacobian([X, Y])
        return (g + g.T) / 2

    def apply(tensor: Array, e: Any) -> Any:
        root = sp.sqrt(2)
        m = sp.Matrix([e[0, 0], e[1, 1], root * e[0, 1]])
        s = sp.Matrix(3, 3, [sp.nsimplify(float(v), rational=True) for v in tensor.ravel()]) * m
        return sp.Matrix([[s[0], s[2] / root], [s[2] / root, s[1]]])

    heat = scene.heat
    expansion, heating, conductivity = (
        sp.Matrix(m) for m in (heat.expansion.tensor, heat.heating.tensor, heat.conductivity)
    )
    sigma = (
        apply(mandel(scene.viscosity, 2), strain(w)) + apply(mandel(scene.elasticity, 2), strain(u)) - theta * expansion
    )
    q = -conductivity * sp.Matrix([theta.diff(X), theta.diff(Y)])
    body = scene.inertia.density * w.diff(T) - sp.Matrix(
        [sum(sigma[i, j].diff((X, Y)[j]) for j in range(2)) for i in range(2)]
    )
    source = (
        theta.diff(T)
        + q[0].diff(X)
        + q[1].diff(Y)
        - sum(heating[i, j] * strain(w)[i, j] for i in range(2) for j in range(2))
    )
    normals = {"left": sp.Matrix([-1, 0]), "right": sp.Matrix([1, 0])}
    contact = scene.contact
    pressure = contact.stiffness * (u.dot(nu) - contact.gap)
    slip = sp.Matrix([1, 0])  # the direction of w_tau
    extra = sigma * nu + pressure * nu + contact.friction.coefficient * pressure * slip
    foundation = contact.heat_exchange.foundation_temperature
    flux = -q.dot(nu) + contact.heat_exchange.conductance * (theta - foundation)

    x = np.stack([np.linspace(0, 1, 101), np.zeros(101)], axis=1)
    for t in (0.0, scene.time.end):
        if (_function(u)(x, t)[:, 1] > -contact.gap).any() or (_function(w)(x, t)[:, 0] <= 0).any():
            raise ValueError(
                "the manufactured fields leave contact or reverse the slip with these data; reduce contact.gap"
            )
    loads = Loads(
        body=_function(body),
        source=_function(source),
        traction={part: _function(sigma * n) for part, n in normals.items()},
        contact_traction=_function(extra),
        contact_flux=_function(flux),
        gap=contact.gap,
        foundation_temperature=foundation,
        points=3,
    )
    return Manufactured(_function(u), _function(w), _function(theta), _function(u.jacobian([X, Y])), loads)


def errors(scene: Scene, solution: Manufactured) -> tuple[dict[str, float], Run]:
    """Largest errors over all times of a run with the manufactured data, and the run."""
    job = Run(scene, loads=solution.loads)
    d = job.discretisation
    nodes = np.asarray(d.mesh.nodes)
    d.restart(job.stepper, solution.u(nodes, 0.0), solution.w(nodes, 0.0), solution.theta(nodes, 0.0), 0.0)
    measure = ExactErrors(d, w=solution.w, theta=solution.theta, gradient=solution.gradient)
    largest = Largest()
    for _ in job.steps():
        largest.add(measure.of(job.stepper))
    if job.outcome != "right":
        raise RuntimeError(
            f"the manufactured run with n = {scene.mesh.n}, steps = {scene.time.steps} ended: {job.outcome}"
        )
    return largest.values, job


def grid(path: str, levels: list[int]) -> list[tuple[int, int]]:
    """(1/h, steps) along `h=k`, or along `k=h^2` starting from three quarters of the mesh, with as many steps as bricks."""
    if path == "h=k":
        return [(n, n) for n in levels]
    coarse = [3 * n // 4 for n in levels]
    return [(n, coarse[0] * (n // coarse[0]) ** 2) for n in coarse]


def table(scene: Scene, couplings: list[str], levels: list[int], path: str) -> list[dict[str, Any]]:
    """Errors and orders along one path for each coupling; `levels` are 1/h, each twice the one before."""
    out = []
    for coupling in couplings:
        before: dict[str, float] | None = None
        for n, steps in grid(path, levels):
            one = scene.override(**{"mesh.n": n, "time.steps": steps, "time.coupling": coupling})
            found, job = errors(one, slipping(one))
            line = {"path": path, "coupling": coupling, "n": n, "steps": steps, "h": 1 / n, "k": one.step}
            line |= {f"e_{t}": found[t] for t in TERMS}
            line |= {f"order_{t}": rates.observed(before[t], found[t]) if before else float("nan") for t in TERMS}
            line |= {"slip": job.report.slip, "stick": job.report.stick, "open": job.report.open}
            line |= {f"identity_{name}": value for name, value in job.worst.items()}
            out.append(line)
            before = found
    return out
