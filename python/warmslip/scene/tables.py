"""The tables of a scene: typed, frozen, unknown keys forbidden, each refusing what no other table is needed to refuse.

What stands below a field is its meaning in the schema, in editors and in the reference of scene files.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from warmslip.scene.expressions import Value
from warmslip.scene.mesh_table import MeshTable
from warmslip.scene.types import Count, Finite, NonNegative, Positive, Table, Tensor, Values, _listed, _word


class TimeTable(Table):
    """`steps` uniform steps of backward Euler to time `end`."""

    end: Positive = 1.0
    """Last time T."""
    steps: Count = 32
    """Number of steps; the step size is k = end/steps."""
    coupling: Literal["staggered", "lagged", "monolithic"] = "staggered"
    """What motion and heat know of each other in a step: old temperature and new velocity, both old, or both new."""


class InertiaTable(Table):
    """Mass; without it every step is in equilibrium."""

    density: NonNegative = 1.0
    """rho, mass per volume; 0 leaves the motion quasistatic."""


class IsotropicTable(Table):
    """An elasticity or viscosity tensor: `lame` = [lambda, mu]; `young` and `poisson` under an assumption on the third axis;
    or any symmetric `tensor` that takes engineering strains (xx, yy, xy) or (xx, yy, zz, yz, xz, xy) to stresses."""

    lame: Annotated[list[Finite], Field(min_length=2, max_length=2)] | None = None
    """[lambda, mu]: stress of an elasticity, stress times time of a viscosity. In the plane the stress along z is 0 unless an
    assumption says plane_strain, here or in the other of elasticity and viscosity: lambda and mu are then those in space."""
    young: NonNegative | None = None
    """Young's modulus; with poisson and assumption."""
    poisson: Finite | None = None
    """Poisson's ratio, between -1 and 0.5 (1 in plane stress)."""
    assumption: Literal["plane_stress", "plane_strain", "solid"] | None = None
    """What holds along the third axis; solid in space. Plane strain has a stress along z, which von Mises counts."""
    tensor: list[list[Finite]] | None = None
    """Symmetric 3 x 3 (plane) or 6 x 6 (space) matrix from engineering strains to stresses."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        engineering = (self.young, self.poisson, self.assumption)
        if self.tensor is not None:
            if self.lame is not None or any(value is not None for value in engineering):
                raise ValueError("give either a full tensor or its constants, not both")
            size = len(self.tensor)
            if size not in (3, 6) or any(len(row) != size for row in self.tensor):
                raise ValueError("tensor must be a 3 x 3 matrix in the plane, 6 x 6 in space")
            if any(self.tensor[i][j] != self.tensor[j][i] for i in range(size) for j in range(i)):
                raise ValueError("tensor must be symmetric; set its entries [i][j] and [j][i] equal")
            return self
        if self.lame is not None and (self.young is not None or self.poisson is not None):
            raise ValueError("give either lame or young, poisson and assumption, not both")
        if self.lame is not None and self.assumption == "plane_stress":
            raise ValueError(
                "lame with plane_stress leaves open which pair is meant; give young and poisson, or leave it out"
            )
        if self.lame is None and any(value is None for value in engineering):
            raise ValueError("give lame = [lambda, mu], or young, poisson and assumption together")
        if self.poisson is not None:
            top = 1.0 if self.assumption == "plane_stress" else 0.5
            if not -1 < self.poisson < top:
                raise ValueError(f"poisson must lie between -1 and {top:g} for {self.assumption}, got {self.poisson:g}")
        return self

    @property
    def strained(self) -> bool:
        """Whether the strain along the third axis is 0 and the stress is not, as this table says."""
        return self.assumption in ("plane_strain", "solid")

    def per_expansion(self, dim: int) -> float:
        """Stress against a free linear expansion: 3 lambda + 2 mu, in plane stress E/(1-k). ValueError for a full tensor."""
        if self.assumption == "plane_stress":
            assert self.young is not None and self.poisson is not None
            return self.young / (1 - self.poisson)
        lam, mu = self.pair(dim)
        return 3 * lam + 2 * mu

    def pair(self, dim: int) -> tuple[float, float]:
        """(lambda, mu) for `dim` dimensions, stress (or viscosity). Plane stress: E k/(1-k^2), E/(2(1+k))."""
        if self.lame is not None:
            return self.lame[0], self.lame[1]
        if self.tensor is not None:
            raise ValueError("a full tensor has no Lame pair; give lame or young and poisson for this")
        assert self.young is not None and self.poisson is not None
        mu = self.young / (2 * (1 + self.poisson))
        if self.assumption == "plane_stress":
            return self.young * self.poisson / (1 - self.poisson**2), mu
        return self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson)), mu


class ExpansionTable(Table):
    """What a temperature adds to the stress: -M (theta - reference_temperature)."""

    tensor: Tensor | None = None
    """M of (2.1), stress per temperature; a number stands for that times the identity. Along z, in plane strain, the mean of M_xx
    and M_yy is taken."""
    alpha: Finite | None = None
    """Linear expansion per temperature, in the place of tensor: M is (3 lambda + 2 mu) alpha, in plane stress
    young alpha / (1 - poisson), of the elasticity that holds there, times the identity."""
    reference_temperature: Finite = 0.0
    """Temperature at which it adds no stress."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.tensor is None) == (self.alpha is None):
            raise ValueError("give either tensor, which is M, or the linear expansion alpha")
        return self


class RegionExpansionTable(ExpansionTable):
    """As [heat.expansion]."""

    reference_temperature: Finite | None = None  # type: ignore[assignment]
    """Temperature at which it adds no stress; the body's unless given."""


class HeatingTable(Table):
    """What a motion adds to the heat: R : e(w)."""

    tensor: Tensor | None = None
    """R of (2.4), heat per volume and strain. Thermodynamics asks for R = -T0 M, with T0 the absolute temperature of the
    unstrained body and a capacity per volume; R = -M is that of a heat equation divided by T0, capacity and conductivity too."""
    thermodynamic: bool = False
    """R = -T0 M in the place of tensor; T0 is heat.expansion.reference_temperature, which must be absolute."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.tensor is None) != self.thermodynamic:
            raise ValueError("give either tensor, which is R, or thermodynamic = true")
        return self


class HeatTable(Table):
    """A temperature, conducted and stored."""

    conductivity: Tensor
    """K of (2.2), a symmetric matrix or a number."""
    capacity: Positive = 1.0
    """Heat per volume and temperature."""
    capacity_matrix: Literal["consistent", "lumped"] = "consistent"
    """lumped: capacity and conductance act at the vertices. No temperature passes what data allow, on meshes without obtuse
    angles, whatever the step; consistent is smoother and overshoots when a step is shorter than the mesh resolves."""
    source: Value = 0.0
    """q0, heat per volume and time: a number or a formula."""
    expansion: ExpansionTable | None = None
    heating: HeatingTable | None = None


class RegionHeatTable(Table):
    """As [heat], without the source, which is one formula for the whole body."""

    conductivity: Tensor
    """K of (2.2), a symmetric matrix or a number."""
    capacity: Positive | None = None
    """Heat per volume and temperature; the body's unless given."""
    expansion: RegionExpansionTable | None = None
    heating: HeatingTable | None = None


class RegionTable(Table):
    """A part of the body with a material of its own: named in the mesh file, or `where` a formula of x, y, z holds.

    Tables replace those of the whole body; a block that is absent there is absent everywhere.
    """

    where: str | None = None
    """A condition in x, y, z that holds at the centres of its cells; without it the name is one of the mesh file."""
    inertia: InertiaTable | None = None
    elasticity: IsotropicTable | None = None
    viscosity: IsotropicTable | None = None
    heat: RegionHeatTable | None = None


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


class FrictionTable(Table):
    """|sigma_tau| <= min(cohesion + mu p_nu, limit): Coulomb, Tresca (cohesion alone), or one that is cut off. A cohesion acts
    on all of the part, also where there is no pressure.

    With `speed`, mu falls from `coefficient` at rest to `kinetic` at slip speeds far above `speed`. With `regularisation`
    the law is smeared over that slip speed, and sticking points creep.
    """

    coefficient: NonNegative = 0.0
    """mu_tau, bound per pressure, dimensionless."""
    cohesion: NonNegative = 0.0
    """Bound without pressure, stress."""
    limit: Positive | None = None
    """The bound never exceeds it, stress."""
    kinetic: NonNegative | None = None
    """Coefficient at slip speeds far above speed."""
    speed: Positive | None = None
    """Slip speed over which the coefficient falls to kinetic, velocity."""
    regularisation: Positive | None = None
    """Slip speed over which the law is smeared, velocity; sticking points creep."""

    @model_validator(mode="after")
    def _pairs(self) -> Self:
        if (self.kinetic is None) != (self.speed is None):
            raise ValueError("kinetic and speed belong together; give both or neither")
        if self.kinetic is not None and self.kinetic > self.coefficient:
            raise ValueError(
                f"kinetic = {self.kinetic:g} exceeds coefficient = {self.coefficient:g}; friction falls with speed"
            )
        return self

    def creep(self, share: float) -> float:
        """Slip speed under a traction that is `share` of the bound, of the regularised law; 0 without one."""
        return (self.regularisation or 0.0) * share / math.sqrt(1 - share**2)


class ExchangeTable(Table):
    """Heat from the body to the foundation: (conductance + per_pressure p_nu) (theta - theta_F)."""

    conductance: NonNegative = 0.0
    """k_c, heat per area, time and temperature difference."""
    per_pressure: NonNegative = 0.0
    """Conductance per contact pressure, added to k_c."""
    foundation_temperature: Value = 0.0
    """theta_F: a number or a formula."""


class FrictionHeatTable(Table):
    """Heat that friction makes: the friction force times the slip speed."""

    share: Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]
    """Of the heat that friction makes, what goes into the body."""


class ContactTable(Table):
    """Contact on `part`: p_nu(r) = min(stiffness max(r, 0)^exponent, pressure_limit), friction, heat.

    A rigid foundation lets nothing in and bears any pressure (Signorini). Without a stiffness the part only exchanges heat.
    """

    part: str
    """Boundary part that touches or exchanges heat."""
    stiffness: (
        Annotated[
            Annotated[NonNegative, Tag("number")] | Annotated[Literal["rigid"], Tag("word")], Discriminator(_word)
        ]
        | None
    ) = None
    """c_nu, pressure per penetration to the power of the exponent; or "rigid", its limit."""
    exponent: Annotated[float, Field(strict=True, ge=1, allow_inf_nan=False)] = 1.0
    """1 is linear compliance; larger exponents begin softly."""
    pressure_limit: Positive | None = None
    """The pressure never exceeds it, stress."""
    gap: Value = 0.0
    """g, distance to the foundation along the outward normal at rest, length: a number or a formula."""
    quadrature: Annotated[str, Field(pattern=r"^(nodal|gauss-[1-8])$")] = "nodal"
    """Where the law holds: at the vertices (nodal), or at that many of Gauss's points a direction (gauss-1 to gauss-8)."""
    friction: FrictionTable | None = None
    heat_exchange: ExchangeTable | None = None
    friction_heating: FrictionHeatTable | None = None

    @model_validator(mode="after")
    def _bends(self) -> Self:
        if self.rigid and (self.exponent != 1 or self.pressure_limit is not None):
            raise ValueError(
                "a rigid foundation has no exponent and no pressure_limit; remove them, or give a stiffness"
            )
        return self

    @property
    def linear(self) -> bool:
        """Whether the pressure is proportional to the penetration, or the foundation rigid."""
        return self.exponent == 1 and self.pressure_limit is None

    @property
    def rigid(self) -> bool:
        """Whether the foundation lets nothing in."""
        return self.stiffness == "rigid"

    @property
    def compliance(self) -> float:
        """c_nu as a number, infinite of a rigid foundation and 0 where there is no contact."""
        return math.inf if self.rigid else float(self.stiffness or 0.0)

    @property
    def points(self) -> int:
        """Gauss points an edge, 0 for the vertex rule."""
        return 0 if self.quadrature == "nodal" else int(self.quadrature.removeprefix("gauss-"))

    @property
    def heats(self) -> bool:
        """Whether its forces conduct or make heat."""
        exchange = self.heat_exchange
        return self.friction_heating is not None or (exchange is not None and exchange.per_pressure > 0)


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
