"""Values of P1 functions at points of another mesh: distances of solutions whose meshes are not nested."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import csr_array

from warmslip._core import LoadQuadrature2, LoadQuadrature3
from warmslip.model.discretisation import Discretisation
from warmslip.model.point_location import located
from warmslip.studies.error_norms import TERMS


class PointComparison:
    """Distances of states on one mesh to states on a fine one, by quadrature of degree 3 on the fine mesh.

    A kink of the coarse function inside a fine cell is integrated approximately. One rank.
    """

    def __init__(self, coarse: Discretisation, fine: Discretisation) -> None:
        quadrature = LoadQuadrature2 if fine.dim == 2 else LoadQuadrature3
        self._fine, self._coarse = fine, coarse
        self._rule = fine.remember("points of the fine mesh", lambda: quadrature(fine.layout, None, 2))
        points = np.asarray(self._rule.positions)
        nodes, cells = np.asarray(coarse.mesh.nodes), np.asarray(coarse.mesh.cells)
        cell, weights = located(nodes, cells, points)
        rows = np.repeat(np.arange(len(points)), cells.shape[1])
        self._values = csr_array((weights.ravel(), (rows, cells[cell].ravel())), shape=(len(points), len(nodes)))
        corners = nodes[cells]
        inner = np.swapaxes(np.linalg.inv(corners[:, 1:] - corners[:, :1]), 1, 2)
        self._slopes = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
        self._cells, self._cell = cells, cell

    def difference(self, coarse: Any, fine: Any) -> dict[str, float]:
        """Errors of the state of stepper `coarse` against that of stepper `fine`; 0 of a field there is not."""
        found = dict.fromkeys(TERMS, 0.0)
        if fine.u is not None:
            u = np.asarray(self._coarse.field(coarse.u))
            gradient = np.einsum("ckj,cki->cij", self._slopes, u[self._cells])[self._cell]
            square = self._rule.squared_strain_distance(fine.u, gradient.reshape(len(self._cell), -1))
            found["u_V"] = float(np.sqrt(max(square, 0.0)))
            w = np.asarray(self._values @ np.asarray(self._coarse.field(coarse.w)))
            found["w_L2"] = float(np.sqrt(max(self._rule.squared_distance(fine.w, w), 0.0)))
        if fine.theta is not None:
            theta = np.asarray(self._values @ np.asarray(self._coarse.field(coarse.theta)))
            found["theta_L2"] = float(np.sqrt(max(self._rule.squared_distance(fine.theta, theta[:, None]), 0.0)))
        return found
