"""Errors of discrete solutions: against a finer nested one, and against exact functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from warmslip._core import LoadQuadrature2, LoadQuadrature3, prolongation
from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array

TERMS = ("u_V", "w_L2", "theta_L2")
SUMS = {"u_theta": ("u_V", "theta_L2"), "u_w_theta": ("u_V", "w_L2", "theta_L2")}


class Comparison:
    """Measures the distance of states on a coarse mesh to states on a nested fine one, exactly."""

    def __init__(self, coarse: Discretisation, fine: Discretisation) -> None:
        self._coarse, self._fine = coarse, fine
        # the same mesh needs no interpolation
        self._prolong = None if coarse.mesh is fine.mesh else prolongation(coarse.mesh, fine.mesh)
        moves, conducts = fine.problem.moves, fine.problem.conducts
        self._fields = [*(["u", "w"] if moves else []), *(["theta"] if conducts else [])]
        self._errors = {name: fine.layout.vector(1 if name == "theta" else fine.dim) for name in self._fields}

    def difference(self, coarse: Any, fine: Any) -> dict[str, float]:
        """Errors of the state of stepper `coarse` against that of stepper `fine`; 0 of a field there is not (collective)."""
        states = [getattr(coarse, name) for name in self._fields]
        errors = list(self._errors.values())
        if self._prolong is None:
            for error, state in zip(errors, states, strict=True):
                state.copy(error)
        else:
            nodes = len(self._coarse.mesh.nodes)
            parts = [self._coarse.layout.gather(state).reshape(nodes, -1) for state in states]
            values = np.split(self._prolong @ np.hstack(parts), np.cumsum([p.shape[1] for p in parts])[:-1], axis=1)
            for error, part in zip(errors, values, strict=True):
                self._fine.layout.distribute(np.ascontiguousarray(part).ravel(), error)
        for name, error in self._errors.items():
            error.axpy(-1.0, getattr(fine, name))
        norms = {"u": self._fine.norms.v, "w": self._fine.norms.l2, "theta": self._fine.norms.l2}
        return {
            term: norms[name](self._errors[name]) if name in self._errors else 0.0
            for name, term in zip(("u", "w", "theta"), TERMS, strict=True)
        }


class ExactErrors:
    """Distance of a state to exact fields by quadrature of degree 7.

    `w`, `theta` map positions (points, d) and time to (points, d) or (points,); `gradient` maps to (points, d, d), the
    derivative of component i along axis j at [i, j], of u.
    """

    def __init__(
        self,
        discretisation: Discretisation,
        *,
        w: Callable[[Array, float], Array],
        theta: Callable[[Array, float], Array],
        gradient: Callable[[Array, float], Array],
    ) -> None:
        quadrature = LoadQuadrature2 if discretisation.dim == 2 else LoadQuadrature3
        self._rule = quadrature(discretisation.layout, None, 4)
        self._exact = w, theta, gradient

    def of(self, stepper: Any) -> dict[str, float]:
        """The errors of the stepper's state at its time (collective)."""
        x, t = self._rule.positions, stepper.time
        w, theta, gradient = (np.asarray(f(x, t), dtype=float) for f in self._exact)
        distance = self._rule.squared_distance
        squares = {
            "u_V": self._rule.squared_strain_distance(stepper.u, gradient.reshape(len(x), -1)),
            "w_L2": distance(stepper.w, w),
            "theta_L2": distance(stepper.theta, theta[:, None]),
        }
        return {name: float(np.sqrt(value)) for name, value in squares.items()}


class Largest:
    """Largest error over time, of every term and of every sum of terms at one time, as the theorem has it."""

    def __init__(self) -> None:
        self.values = dict.fromkeys([*TERMS, *SUMS], 0.0)

    def add(self, errors: dict[str, float]) -> None:
        for name in TERMS:
            self.values[name] = max(self.values[name], errors[name])
        for name, terms in SUMS.items():
            self.values[name] = max(self.values[name], sum(errors[term] for term in terms))
