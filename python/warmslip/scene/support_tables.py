"""The table [supports] of a scene and the tables inside it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from warmslip.scene.expressions import Value
from warmslip.scene.types import NonNegative, Table, Vector, _listed


def _free_or_value(value: Any) -> str:
    return "free" if value == "free" else "value"


def _components_or_table(value: Any) -> str:
    return "components" if isinstance(value, list) else "by_normal"


Component = Annotated[
    Annotated[Literal["free"], Tag("free")] | Annotated[Value, Tag("value")], Discriminator(_free_or_value)
]
Components = Annotated[list[Component], Field(min_length=2, max_length=3)]


class NormalTable(Table):
    """A support that holds a part across its surface and leaves it free along it, such as a smooth guide or a symmetry plane."""

    normal: Value
    """Displacement along the outward normal, length: a number or a formula. On curved parts the normal of a node is the mean of
    those of its facets; at an edge of the part, where these differ by more than 20 degrees, all of them are held."""


Held = Annotated[
    Annotated[Components, Tag("components")] | Annotated[NormalTable, Tag("by_normal")],
    Discriminator(_components_or_table),
]


class PointTable(Table):
    """A single node that is held, usually against a rigid motion that nothing else prevents."""

    at: Vector
    """Place, length: the nearest node is held."""
    displacement: Components | None = None
    """A number, a formula or "free" for each axis; zero unless given."""


class SpringTable(Table):
    """Springs and dashpots on a part: the traction -(stiffness u + damping w). At least one entry is positive."""

    stiffness: NonNegative | Annotated[list[NonNegative], Field(min_length=2, max_length=3)] = 0.0
    """Stiffness per area, stress per length: a number for all axes, or one for each axis."""
    normal_stiffness: NonNegative = 0.0
    """Stiffness per area along the normal of each facet, stress per length; added to the former."""
    damping: NonNegative | Annotated[list[NonNegative], Field(min_length=2, max_length=3)] = 0.0
    """Damping per area, stress per velocity: a number for all axes, or one for each axis."""
    normal_damping: NonNegative = 0.0
    """Damping per area along the normal of each facet, stress per velocity; added to the former."""

    @model_validator(mode="after")
    def _acts(self) -> SpringTable:
        if not any(_any(value) for value in (self.stiffness, self.normal_stiffness, self.damping, self.normal_damping)):
            raise ValueError(
                "every stiffness and damping is 0, and the springs do nothing; give one or remove the table"
            )
        return self

    def along(self, what: Literal["stiffness", "damping"], dim: int) -> list[float]:
        """The stiffness or the damping along every axis."""
        value = self.stiffness if what == "stiffness" else self.damping
        return list(value) if isinstance(value, list) else [value] * dim


def _any(value: float | list[float]) -> bool:
    return any(value) if isinstance(value, list) else value > 0


class SupportsTable(Table):
    """Parts that are held: names (at zero), or a table of names and what they are held at. Where parts meet, all their supports
    act; supports that contradict each other there are refused."""

    displacement: Annotated[
        Annotated[list[str], Tag("several")] | Annotated[dict[str, Held], Tag("one")], Discriminator(_listed)
    ] = []
    """Gamma_D: ["top"] is clamped; { top = ["0.1 * t", 0.0] } follows that displacement; { left = [0.0, "free"] } is a roller;
    { hole = { normal = 0.0 } } holds a part across its surface alone."""
    points: list[PointTable] | None = None
    """Single nodes that are held."""
    springs: dict[str, SpringTable] | None = None
    """Springs and dashpots, by boundary part."""
    temperature: Annotated[
        Annotated[list[str], Tag("several")] | Annotated[dict[str, Value], Tag("one")], Discriminator(_listed)
    ] = []
    """["top"] is held at zero; { top = "20 * t" } at that temperature."""

    @property
    def moved(self) -> dict[str, list[float | str] | NormalTable]:
        """What parts are held at, by part, of those that are not simply clamped."""
        return self.displacement if isinstance(self.displacement, dict) else {}

    @property
    def given(self) -> list[float | str]:
        """The displacements that parts and points are held at, by component or along a normal."""
        held: list[float | str] = []
        for one in [*self.moved.values(), *(point.displacement or [] for point in self.points or [])]:
            held += [one.normal] if isinstance(one, NormalTable) else [value for value in one if value != "free"]
        return held

    @property
    def clamped(self) -> list[str]:
        """Parts with a given displacement in all directions."""
        if not isinstance(self.displacement, dict):
            return self.displacement
        return [part for part, held in self.displacement.items() if isinstance(held, list) and "free" not in held]

    @property
    def guided(self) -> list[str]:
        """Parts with a given displacement in some directions."""
        return [part for part in self.displacement if part not in self.clamped]

    @property
    def hold(self) -> bool:
        """Whether anything resists a motion."""
        return bool(self.displacement or self.points or self.springs)

    @property
    def warmed(self) -> dict[str, float | str]:
        """Given temperature by part, of those that are not simply held at zero."""
        return self.temperature if isinstance(self.temperature, dict) else {}

    def pattern(self) -> dict[str, Any]:
        """What is held and what is free, without what it is held at."""
        moved = {
            part: [one == "free" for one in held] if isinstance(held, list) else "normal"
            for part, held in self.moved.items()
            if part not in self.clamped
        }
        points = [[point.at, [one == "free" for one in point.displacement or []]] for point in self.points or []]
        springs = {part: table.model_dump(mode="json") for part, table in (self.springs or {}).items()}
        return {"clamped": sorted(self.clamped), "guided": moved, "points": points, "springs": springs}
