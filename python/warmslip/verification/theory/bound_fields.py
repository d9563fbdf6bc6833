"""What the bound of section 4 is evaluated with: exact fields with their derivatives, and quadrature of P1 functions beside them.

Numbers are dimensionless.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from warmslip._core import simplex_rule
from warmslip.scene.full import FullScene
from warmslip.typing import Array
from warmslip.verification.mms import symbolic
from warmslip.verification.mms.manufactured import sliding
from warmslip.verification.mms.symbolic import Function, T

POINTS = 4  # a direction: exact to degree 7


@dataclass(frozen=True)
class Exact:
    """The fields of `manufactured.sliding` and what the bound needs of them; `_x` are gradients, (points, components, 2)."""

    u_x: Function
    w: Function
    w_x: Function
    w_rate: Function
    w_rate_x: Function
    theta: Function
    theta_x: Function
    theta_rate: Function
    theta_rate_x: Function
    stress: Function

    @classmethod
    def of(cls, scene: FullScene) -> Exact:
        fields = sliding()
        u, w, theta = fields.u, fields.w, sp.Matrix([fields.theta])
        axes = symbolic.axes(2)

        def rate(field: Any) -> Any:
            return field.diff(T)

        expressions = {
            "u_x": u.jacobian(axes),
            "w": w,
            "w_x": w.jacobian(axes),
            "w_rate": rate(w),
            "w_rate_x": rate(w).jacobian(axes),
            "theta": theta[0],
            "theta_x": theta.jacobian(axes),
            "theta_rate": rate(theta)[0],
            "theta_rate_x": rate(theta).jacobian(axes),
            "stress": symbolic.stress(scene, u, w, theta[0]),
        }
        return cls(**{name: symbolic.function(one, 2) for name, one in expressions.items()})


@dataclass(frozen=True)
class Rule:
    """Quadrature over cells or facets: points x (simplices * q, 2), weights alike, and P1 functions of nodal values there."""

    x: Array
    weights: Array
    corners: Array  # (simplices, corners) node numbers
    basis: Array  # (q, corners)
    slopes: Array  # (simplices, corners, 2), gradients of the basis; empty on facets

    @classmethod
    def over(cls, nodes: Array, corners: Array) -> Rule:
        sides = nodes[corners[:, 1:]] - nodes[corners[:, :1]]
        basis, weights = (np.asarray(part) for part in simplex_rule(corners.shape[1] - 1, POINTS))
        slopes = np.zeros((0, corners.shape[1], 2))
        if corners.shape[1] == 3:
            measures = np.abs(np.linalg.det(sides)) / 2
            inner = np.linalg.inv(sides).transpose(0, 2, 1)
            slopes = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
        else:
            measures = np.linalg.norm(sides[:, 0], axis=1)
        x = np.einsum("qa,cad->cqd", basis, nodes[corners]).reshape(-1, 2)
        return cls(x, np.outer(measures, weights / weights.sum()).ravel(), corners, basis, slopes)

    def value(self, nodal: Array) -> Array:
        """(nodes, ...) to (points, ...)."""
        found = np.einsum("qa,ca...->cq...", self.basis, nodal[self.corners])
        return np.asarray(found.reshape(len(self.x), *nodal.shape[1:]))

    def slope(self, nodal: Array) -> Array:
        """(nodes, components) to (points, components, 2)."""
        cells = np.einsum("cad,cai->cid", self.slopes, nodal[self.corners])
        return np.asarray(np.repeat(cells, len(self.basis), axis=0))

    def integral(self, values: Array) -> float:
        return float(self.weights @ values.reshape(len(self.x), -1).sum(axis=1))

    def square(self, values: Array) -> float:
        """|values|_L2^2."""
        return self.integral(values**2)


def strain(gradient: Array) -> Array:
    return (gradient + gradient.transpose(0, 2, 1)) / 2
