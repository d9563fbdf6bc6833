"""The tables of a scene: typed, frozen, unknown keys forbidden, each refusing what no other table is needed to refuse.

What stands below a field is its meaning in the schema, in editors and in the reference of scene files.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from warmslip.scene.contact_tables import ContactTable
from warmslip.scene.expressions import Value
from warmslip.scene.material_tables import HeatTable, InertiaTable, IsotropicTable, RegionTable
from warmslip.scene.mesh_table import MeshTable
from warmslip.scene.types import Count, Positive, Table, Values, _listed


class TimeTable(Table):
    """`steps` uniform steps of backward Euler to time `end`."""

    end: Positive = 1.0
    """Last time T."""
    steps: Count = 32
    """Number of steps; the step size is k = end/steps."""
    coupling: Literal["staggered", "lagged", "monolithic"] = "staggered"
    """What motion and heat know of each other in a step: old temperature and new velocity, both old, or both new."""


class LoadsTable(Table):
    """Forces and heat from outside; numbers, or formulas of x, y, z and t."""

    body: Values | None = None
    """f0, force per volume: a number or a formula an axis."""
    traction: dict[str, Values] = {}
    """fN, force per area, by boundary part: a number or a formula an axis."""
    heat_flux: dict[str, Value] = {}
    """Heat per area and time into the body, by boundary part: a number or a formula."""


class SupportsTable(Table):
    """Parts that are held: names (at zero), or a table of names and what they are held at."""

    displacement: Annotated[
        Annotated[list[str], Tag("several")] | Annotated[dict[str, Values], Tag("one")], Discriminator(_listed)
    ] = []
    """Gamma_D: ["top"] is clamped; { top = ["0.1 * t", 0.0] } follows that displacement."""
    temperature: Annotated[
        Annotated[list[str], Tag("several")] | Annotated[dict[str, Value], Tag("one")], Discriminator(_listed)
    ] = []
    """["top"] is held at zero; { top = "20 * t" } at that temperature."""

    @property
    def moved(self) -> dict[str, list[float | str]]:
        """Given displacement by part, of those that are not simply clamped."""
        return self.displacement if isinstance(self.displacement, dict) else {}

    @property
    def warmed(self) -> dict[str, float | str]:
        """Given temperature by part, of those that are not simply held at zero."""
        return self.temperature if isinstance(self.temperature, dict) else {}


class InitialTable(Table):
    """Initial data, set to what the supports are held at there."""

    displacement: Values | None = None
    """Length, a number or a formula of the place an axis; 0 unless given."""
    velocity: Values | None = None
    """A number or a formula of the place an axis; 0 unless given."""
    temperature: Value = 0.0
    """A number or a formula of the place."""


class OutputTable(Table):
    """What is stored and how often."""

    every: Count = 1
    """States are stored every so many steps; the last one always."""
    checkpoint: Count = 100
    """Steps between two checkpoints."""
    checkpoint_minutes: Positive | None = None
    """Minutes between two checkpoints; whichever comes first."""


OneOrMore = Annotated[
    Annotated[ContactTable, Tag("one")] | Annotated[list[ContactTable], Tag("several")],
    Discriminator(lambda value: "several" if isinstance(value, list) else "one"),
]


class SceneTables(Table):
    """The tables of a whole scene, and what follows from them. A table adds one term to the model; keys are those of the file."""

    title: str = ""
    """One line that says what the scene is."""
    mesh: MeshTable
    time: TimeTable
    inertia: InertiaTable | None = None
    elasticity: IsotropicTable | None = None
    viscosity: IsotropicTable | None = None
    heat: HeatTable | None = None
    loads: LoadsTable = LoadsTable()
    supports: SupportsTable = SupportsTable()
    contact: OneOrMore | None = None
    regions: dict[str, RegionTable] = Field(default_factory=dict)
    initial: InitialTable = InitialTable()
    output: OutputTable = OutputTable()

    @property
    def moves(self) -> bool:
        """Whether there is a velocity to solve for."""
        return (
            self.elasticity is not None
            or self.viscosity is not None
            or (self.inertia is not None and self.inertia.density > 0)
        )

    @property
    def contacts(self) -> list[ContactTable]:
        """The contact tables, also of one; none gives an empty list."""
        if self.contact is None:
            return []
        return self.contact if isinstance(self.contact, list) else [self.contact]

    @property
    def step(self) -> float:
        """k, time."""
        return self.time.end / self.time.steps

    def resolved(self) -> dict[str, Any]:
        """The scene as plain data, defaults filled in and absent tables left out."""
        return self.model_dump(mode="json", exclude_none=True)
