"""The gap to a foundation of a simple shape, along the outward normals of the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warmslip.model.loads import data, evaluate
from warmslip.scene.foundation_tables import ShapeTable
from warmslip.typing import Array


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
        d = x.shape[1]
        away = evaluate(data(self.table.at), x, t, d, "contact.gap.at") - x
        if self.table.shape == "plane":
            return _to_plane(away, self.normals, _unit(self.table.normal))
        if self.table.shape == "wedge":
            return np.asarray(np.max([_to_plane(away, self.normals, side) for side in self._sides(d)], axis=0))
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


def _to_plane(away: Array, normals: Array, up: Array) -> Array:
    """Along normals (points, d) to a plane that `away` leads to, with the unit normal `up` towards the body."""
    falls, height = -(normals @ up), -(away @ up)
    meets = falls > 1e-12
    distance = np.divide(height, falls, out=np.abs(height), where=meets)
    return np.where(meets, distance, np.abs(height) + np.linalg.norm(away, axis=1))


def _to_ball(away: Array, directions: Array, radius: float) -> Array:
    """Along directions (points, d), of a length of at most 1, to a circle or sphere about the points that `away` leads to."""
    length2 = np.maximum((directions**2).sum(axis=1), 1e-300)
    middle = (away * directions).sum(axis=1) / length2  # where the ray comes nearest to the centre
    past2 = (away**2).sum(axis=1) - middle**2 * length2  # squared distance there
    half2 = (radius**2 - past2) / length2
    nearest = np.linalg.norm(away, axis=1) - radius
    meets = (half2 >= 0) & (middle > 0)
    # inside the foundation the distance is negative: the root that is smaller is where the ray enters
    return np.where(
        meets, middle - np.sqrt(np.maximum(half2, 0)), np.maximum(nearest, 0) + np.sqrt(np.abs(half2)) + np.abs(middle)
    )
