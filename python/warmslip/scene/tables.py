"""The tables of a scene: typed, frozen, unknown keys forbidden, each refusing what no other table is needed to refuse.

What stands below a field is its meaning in the schema, in editors and in the reference of scene files.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Discriminator, Field, Tag, model_validator

from warmslip.messages import quoted
from warmslip.scene.clock import Clock, graded, uniform
from warmslip.scene.contact_tables import ContactTable
from warmslip.scene.expressions import Value
from warmslip.scene.material_tables import HeatTable, InertiaTable, IsotropicTable, RegionTable
from warmslip.scene.mesh_table import MeshTable
from warmslip.scene.probe_tables import ProbeTable
from warmslip.scene.support_tables import SupportsTable
from warmslip.scene.types import Count, NonNegative, Positive, Table, Values


class TimeTable(Table):
    """Steps of backward Euler to time `end`: equal, shrinking towards given times, or chosen by their estimated error."""

    end: Positive = 1.0
    """Last time T."""
    steps: Count = 32
    """Number of steps where all are equal. Else the longest step is at most end/steps, and there are more."""
    graded_to: list[NonNegative] = []
    """Times towards which the steps shrink, such as 0.0 for a sudden start, or the time of a jump of the loads. The steps form
    blocks of equal steps whose lengths double away from such a time; every step size costs one factorization."""
    halvings: Annotated[int, Field(ge=1, le=40, strict=True)] = 8
    """With graded_to: how often the length of the last block is halved to give the first one."""
    tolerance: Annotated[float, Field(strict=True, gt=0, le=1, allow_inf_nan=False)] | None = None
    """Step sizes follow the solution: the estimated error of a single step, relative to the fields, stays below this. The sizes
    are end/steps times powers of 1/2. A tolerance of 1e-4 is moderate; the error at the end falls like its square root."""
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
    quadrature: Annotated[int, Field(ge=1, le=8, strict=True)] | None = None
    """Gauss points per direction that integrate formulas of loads, sources and foundation temperatures over a cell or a facet;
    3 unless given. More are needed where a formula has a kink or a jump inside cells."""


class InitialTable(Table):
    """Initial data, set to what the supports are held at there: fields, or a stored state of another run."""

    model_config = ConfigDict(**Table.model_config, populate_by_name=True)

    run: str | None = Field(default=None, alias="from")
    """Path of a trajectory.h5, relative to the scene file: its state is where this run begins. Meshes may differ; fields that the
    other run lacks are zero."""
    time: NonNegative | None = None
    """With from: time of the stored state; the last one unless given."""
    displacement: Values | None = None
    """Length, a number or a formula of the place an axis; 0 unless given."""
    velocity: Values | None = None
    """A number or a formula of the place an axis; 0 unless given."""
    temperature: Value = 0.0
    """A number or a formula of the place."""

    @model_validator(mode="after")
    def _one_origin(self) -> Self:
        if self.time is not None and self.run is None:
            raise ValueError("time: of which run? give from = 'trajectory.h5', or leave the key out")
        if self.run is not None and (self.displacement or self.velocity or self.temperature):
            raise ValueError(
                "from: the state of a run holds all fields; leave displacement, velocity and temperature out"
            )
        return self


class OutputTable(Table):
    """What is stored and how often."""

    every: Count = 1
    """States are stored every so many steps; the last one always."""
    checkpoint: Count = 100
    """Steps between two checkpoints."""
    checkpoint_minutes: Positive | None = None
    """Minutes between two checkpoints; whichever comes first."""
    probes: dict[str, ProbeTable] | None = None
    """Points, lines and parts whose fields are written as CSV over time. A name is of letters a to z, digits, - and _."""

    @model_validator(mode="after")
    def _names(self) -> OutputTable:
        for name in self.probes or {}:
            if not re.fullmatch(r"[A-Za-z0-9_-]{1,100}", name):
                raise ValueError(f"probes: {quoted(name)} names no file; take letters a to z, digits, - and _")
        return self


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
    def clock(self) -> Clock:
        """The steps. With a tolerance they are chosen as the run goes on; these are then the longest ones."""
        time = self.time
        if time.graded_to:
            return graded(time.end, time.steps, time.graded_to, time.halvings)
        return uniform(time.end, time.steps)

    @property
    def step(self) -> float:
        """k, the size of the longest step, time."""
        return self.clock.longest

    def resolved(self) -> dict[str, Any]:
        """The scene as plain data, defaults filled in and absent tables left out."""
        return self.model_dump(mode="json", exclude_none=True, by_alias=True)
