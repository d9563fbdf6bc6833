"""The tables [output.probes.NAME] of a scene."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from warmslip.scene.types import Count, Table, Vector

BodyField = Literal["displacement", "velocity", "temperature", "stress", "von Mises"]
ContactField = Literal["pressure", "friction traction", "gap", "slip", "status"]
DEFAULT_COUNT = 101


class ProbeTable(Table):
    """Fields at one place over time, written to probes/NAME.csv while the run goes on: a point, a line or a boundary part."""

    at: Vector | None = None
    """Position of a point of the body, length."""
    line: Annotated[list[Vector], Field(min_length=2, max_length=2)] | None = None
    """Positions of the two ends of a straight line in the body, length."""
    count: Annotated[int, Field(ge=2, le=100_000, strict=True)] | None = None
    """With line: the number of its points, at equal distances with both ends; 101 unless given."""
    part: str | None = None
    """A boundary part: the contact points of a part that touches, and the nodes of another. In the plane they are ordered by arc
    length."""
    fields: Annotated[list[BodyField | ContactField], Field(min_length=1)] | None = None
    """What is written: displacement, velocity, temperature, stress, von Mises, and on a part that touches pressure, friction
    traction, gap, slip, status. Everything that the scene has unless given."""
    every: Count = 1
    """Rows are written every so many steps."""

    @model_validator(mode="after")
    def _one_place(self) -> ProbeTable:
        given = [name for name in ("at", "line", "part") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"{' and '.join(given) or 'no place'} given; give one of at, line and part")
        if self.count is not None and self.line is None:
            raise ValueError("count is the number of points of a line; give line, or leave count out")
        if self.line is not None and self.line[0] == self.line[1]:
            raise ValueError("both ends of the line are the same; give two points")
        if self.fields is not None and len(set(self.fields)) < len(self.fields):
            raise ValueError("a field is named twice; name each once")
        return self
