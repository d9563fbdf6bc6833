"""Data of a problem (forces, sources, gap, foundation temperature) and their load vectors."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warmslip import _core
from warmslip.scene import Scene

Array = NDArray[np.float64]
# constants, or functions of positions (points, d) and time returning (points,) or (points, d)
Data = Any


@dataclass(frozen=True)
class Loads:
    """Right-hand sides in the letters of the paper. Each value is a constant or a function (x, t) -> array.

    body f0, source q0; traction fN and heat_flux h by boundary part (a flux into the body); contact_traction gC, an extra
    traction on Gamma_C for manufactured solutions; contact_flux likewise; gap g and foundation_temperature theta_F on
    Gamma_C. `points` is the number of quadrature points per direction of the functions.
    """

    body: Data = 0.0
    source: Data = 0.0
    traction: dict[str, Data] = field(default_factory=dict)
    heat_flux: dict[str, Data] = field(default_factory=dict)
    contact_traction: Data = 0.0
    contact_flux: Data = 0.0
    gap: Data = 0.0
    foundation_temperature: Data = 0.0
    points: int = 3

    @classmethod
    def of(cls, scene: Scene) -> Loads:
        return cls(
            body=np.array(scene.loads.body),
            source=scene.heat.source,
            traction={part: np.array(value) for part, value in scene.loads.traction.items()},
            gap=scene.contact.gap,
            foundation_temperature=scene.contact.heat_exchange.foundation_temperature,
        )


def evaluate(data: Data, x: Array, t: float, components: int) -> Array:
    """Values of `data` at positions x (points, d), as (points, components). Raises ValueError when not finite or misshaped."""
    value = np.asarray(data(x, t) if callable(data) else data, dtype=float)
    if value.ndim < 2 and components == 1 and value.shape in ((), (len(x),)):
        value = np.broadcast_to(value, (len(x),))[:, None]
    elif value.ndim < 2:
        value = np.broadcast_to(value, (len(x), components))
    if value.shape != (len(x), components):
        raise ValueError(f"a load must give shape {(len(x), components)} at {len(x)} points, got {value.shape}")
    if not np.isfinite(value).all():
        raise ValueError(f"a load is not finite at t = {t:g}; check its expression")
    return np.ascontiguousarray(value)


class LoadVectors:
    """Load vectors (f, v) and (q, eta) and the gap at any time; what does not depend on time is assembled once."""

    def __init__(
        self, layout: Any, surface: Any, loads: Loads, contact_part: str, conductance: float, dim: int, comm: Any
    ) -> None:
        self._surface, self._loads, self._comm = surface, loads, comm
        quadrature = _core.LoadQuadrature2 if dim == 2 else _core.LoadQuadrature3
        rules: dict[tuple[str | None, int], Any] = {}

        def rule(part: str | None, data: Data) -> Any:
            # a constant times a P1 function is integrated exactly by one point
            key = part, loads.points if callable(data) else 1
            if key not in rules:
                rules[key] = quadrature(layout, *key)
            return rules[key]

        foundation = loads.foundation_temperature
        heated: Data = (
            (lambda x, t: conductance * foundation(x, t)) if callable(foundation) else conductance * foundation
        )
        terms = [
            (True, None, loads.body),
            *((True, part, data) for part, data in loads.traction.items()),
            (True, contact_part, loads.contact_traction),
            (False, None, loads.source),
            *((False, part, data) for part, data in loads.heat_flux.items()),
            (False, contact_part, heated),
            (False, contact_part, loads.contact_flux),
        ]
        self._dim = dim
        self._constant = layout.vector(dim), layout.vector(1)
        self._present = layout.vector(dim), layout.vector(1)
        self._moving: list[tuple[bool, Any, Data]] = []
        for mechanical, part, data in terms:
            if callable(data):
                self._moving.append((mechanical, rule(part, data), data))
            elif np.any(data):
                self._add(self._constant, mechanical, rule(part, data), data, 0.0)

    def _add(self, pair: tuple[Any, Any], mechanical: bool, rule: Any, data: Data, t: float) -> None:
        vector = rule.load(self._together(data, rule.positions, t, self._dim if mechanical else 1))
        (pair[0] if mechanical else pair[1]).axpy(1.0, vector)
        vector.destroy()  # petsc4py would only mark it for a later collection

    def _together(self, data: Data, x: Array, t: float, components: int) -> Array:
        """`evaluate` on every rank's own places; when it fails on one, all raise ValueError and none waits for the others."""
        if self._comm.size == 1:
            return evaluate(data, x, t, components)
        values, error = np.empty((0, components)), ""
        try:
            values = evaluate(data, x, t, components)
        except Exception as own:
            error = str(own) or repr(own)
        errors = [other for other in self._comm.allgather(error) if other]
        if errors:
            raise ValueError(errors[0])
        return values

    def at(self, t: float) -> tuple[Any, Any, Array]:
        """(force, heat, gap) at time t, valid until the next call; the vectors must not be changed."""
        pair = self._constant
        if self._moving:
            pair = self._present
            for constant, present in zip(self._constant, self._present, strict=True):
                constant.copy(present)
            for mechanical, rule, data in self._moving:
                self._add(pair, mechanical, rule, data, t)
        return *pair, self._together(self._loads.gap, self._surface.positions, t, 1)[:, 0]
