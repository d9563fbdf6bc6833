"""The gap to a foundation of a simple shape, along the outward normals of the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip.model.loads import data, evaluate
from warmslip.scene.foundation_tables import ShapeTable
from warmslip.typing import Array

PARALLEL = 1e-12  # sine of the angle at which a normal meets a plane


@dataclass(frozen=True)
class ShapeGap:
    """Distance of points to a shape along their normals (points, d), as a datum of positions and time.

    Where a ray misses the shape or leaves it behind, the gap is no smaller than the distance to the shape: nothing touches.
    """

    table: ShapeTable
    normals: Array

    @property
    def of_time(self) -> bool:
        return self.table.of_time

    def __call__(self, x: Array, t: float) -> Array:
        return self._along_normals(x, t)[0]

    def meets(self, x: Array, t: float) -> Any:
        """Whether the normals of the points meet the shape, (points,)."""
        return self._along_normals(x, t)[1]

    def _along_normals(self, x: Array, t: float) -> tuple[Array, Any]:
        """The gap, and whether the normals meet the shape."""
        d = x.shape[1]
        away = evaluate(data(self.table.at), x, t, d, "contact.gap.at") - x
        if self.table.shape == "plane":
            return _to_half_spaces(away, self.normals, [_unit(self.table.normal)])
        if self.table.shape == "wedge":
            return _to_half_spaces(away, self.normals, self._sides(d))
        assert self.table.radius is not None
        directions = self.normals
        if self.table.axis is not None:  # only what is across the axis counts
            axis = _unit(self.table.axis)
            away, directions = _across(away, axis), _across(directions, axis)
        return _to_ball(away, directions, self.table.radius)

    def _sides(self, d: int) -> list[Array]:
        """Outward normals of the two faces of the wedge."""
        assert self.table.angle is not None
        top = _unit(self.table.normal)
        edge = _unit(self.table.axis) if d == 3 else None
        side = np.cross(edge, top) if edge is not None else np.array([-top[1], top[0]])
        half = np.deg2rad(self.table.angle) / 2
        return [np.sin(half) * top + sign * np.cos(half) * _unit(side) for sign in (1.0, -1.0)]


def _unit(vector: object) -> Array:
    given = np.asarray(vector, dtype=float)
    return np.asarray(given / np.linalg.norm(given))


def _across(vectors: Array, axis: Array) -> Array:
    return vectors - np.outer(vectors @ axis, axis)


def _to_half_spaces(away: Array, normals: Array, sides: list[Array]) -> tuple[Array, Any]:
    """Along normals (points, d) to what half-spaces have in common; `sides` are their outward unit normals at the place that
    `away` leads to."""
    enter, leave = np.full(len(away), -np.inf), np.full(len(away), np.inf)
    for side in sides:
        height, rises = -(away @ side), normals @ side
        crosses = np.abs(rises) > PARALLEL
        at = np.divide(-height, rises, out=np.where(height > 0, np.inf, -np.inf), where=crosses)
        inwards = ~crosses | (rises < 0)
        enter = np.where(inwards, np.maximum(enter, at), enter)
        leave = np.where(crosses & (rises > 0), np.minimum(leave, at), leave)
    meets = np.isfinite(enter) & (enter <= leave) & (leave >= 0)
    return np.where(meets, enter, _beside(away)), meets


def _to_ball(away: Array, directions: Array, radius: float) -> tuple[Array, Any]:
    """Along directions (points, d), of a length of at most 1, to a circle or sphere about the points that `away` leads to."""
    length2 = np.maximum((directions**2).sum(axis=1), 1e-300)
    middle = (away * directions).sum(axis=1) / length2  # where the ray comes nearest to the centre
    # of a large radius the differences of squares keep no digit: |away|^2 - radius^2 by its largest component
    size = np.abs(away)
    most = size.max(axis=1)
    rest2 = (np.sort(size, axis=1)[:, :-1] ** 2).sum(axis=1)
    outside = ((most - radius) * (most + radius) + rest2) / length2
    half2 = middle**2 - outside
    far = middle + np.sqrt(np.maximum(half2, 0))
    meets = (half2 >= 0) & (far >= 0)
    near = np.divide(outside, far, out=np.zeros_like(far), where=far > 0)
    return np.where(meets, near, _beside(away) + radius), meets


def _beside(away: Array) -> Array:
    """The gap of points whose normal misses the foundation: more than the distance to it, so that nothing touches."""
    return np.asarray(2 * np.linalg.norm(away, axis=1) + np.abs(away).max())
