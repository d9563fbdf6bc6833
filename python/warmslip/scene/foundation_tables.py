"""Shapes of a foundation in a scene: planes, cylinders, spheres and wedges at a place that may move."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from warmslip.scene.expressions import Expression, Value
from warmslip.scene.types import Positive, Table, Vector

NEEDS: dict[str, tuple[str, ...]] = {
    "plane": ("normal",),
    "cylinder": ("radius",),
    "sphere": ("radius",),
    "wedge": ("normal", "angle"),
}
TAKES = {"cylinder": ("axis",), "wedge": ("axis",)}


class ShapeTable(Table):
    """The foundation as a body of a simple shape. The gap of a contact point is the distance to it along the outward normal."""

    shape: Literal["plane", "cylinder", "sphere", "wedge"]
    """A plane; a cylinder, which is a circle in the plane; a sphere; a wedge, whose edge points towards the body."""
    at: Annotated[list[Value], Field(min_length=2, max_length=3)]
    """A point of the plane, the centre of the circle or sphere, a point of the axis or of the edge, length: a number or a
    formula of t for each axis."""
    normal: Vector | None = None
    """Direction from the foundation to the body: of the plane, or of the wedge from its inside to its edge. Any length."""
    radius: Positive | None = None
    """Of a cylinder or a sphere, length."""
    axis: Vector | None = None
    """In space, direction of the axis of a cylinder or of the edge of a wedge. Any length."""
    angle: Annotated[float, Field(strict=True, gt=0, lt=180)] | None = None
    """Opening angle of the wedge, degrees."""

    @model_validator(mode="after")
    def _fits(self) -> Self:
        needed, known = NEEDS[self.shape], (*NEEDS[self.shape], *TAKES.get(self.shape, ()))
        for name in ("normal", "radius", "axis", "angle"):
            value = getattr(self, name)
            if value is None and name in needed:
                raise ValueError(f"a {self.shape} needs its {name}; give one")
            if value is not None and name not in known:
                raise ValueError(f"a {self.shape} has no {name}; leave it out")
            if isinstance(value, list) and not any(value):
                raise ValueError(f"{name} is the zero vector, which has no direction; give one")
        for value in self.at:
            if isinstance(value, str) and set(Expression(value).names) & set("xyz"):
                raise ValueError(f"at: '{value}' depends on the place; give numbers or formulas of t")
        return self

    @property
    def of_time(self) -> bool:
        """Whether the shape moves."""
        return any(isinstance(value, str) and Expression(value).of_time for value in self.at)

    @property
    def spatial_axis(self) -> bool:
        """Whether the shape has an axis or an edge in space."""
        return self.shape in TAKES
