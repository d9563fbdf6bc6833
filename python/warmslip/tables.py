"""The tables of a scene: typed, frozen, unknown keys forbidden, each refusing what no other table is needed to refuse."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from warmslip import mesh_files
from warmslip.expressions import Value, finite, told

Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=2**31 - 1, strict=True)]  # steps and bricks are counted in 32 bits
Vector = Annotated[list[Finite], Field(min_length=2, max_length=3)]
Matrix = Annotated[list[Vector], Field(min_length=2, max_length=3)]
Values = Annotated[list[Value], Field(min_length=2, max_length=3)]


def _number_or_matrix(value: Any) -> Any:
    if isinstance(value, list):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not finite(value):
        raise ValueError(f"{told(value)} is neither a finite number nor a matrix; give one")
    return value


def _listed(value: Any) -> str:
    return "one" if isinstance(value, dict) else "several"


# c stands for c times the identity
Tensor = Annotated[Matrix | float, BeforeValidator(_number_or_matrix)]

PARTS = {"square": ("left", "right", "bottom", "top"), "cube": ("left", "right", "front", "back", "bottom", "top")}


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MeshTable(Table):
    """A structured box, `n` bricks a side (or one number an axis), each cut along `diagonal`; or a gmsh `file`.

    `grading` is the size of the last brick over that of the first, one number an axis.
    """

    shape: Literal["square", "cube"] | None = None  # square unless there is a file
    n: Count | list[Count] = 32
    lengths: list[Positive] | None = None  # default: 1 along every axis
    grading: list[Positive] | None = None  # default: 1 along every axis
    diagonal: Literal["right", "left", "crisscross"] = "right"
    file: str | None = None  # .msh with physical names, beside the scene file

    @property
    def dim(self) -> int:
        if self.file is not None:
            return mesh_files.read(self.file).dim
        return 3 if self.shape == "cube" else 2

    @property
    def name(self) -> str:
        """What messages call the body."""
        return f"mesh '{self.file}'" if self.file is not None else self.shape or "square"

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the boundary parts."""
        if self.file is not None:
            return tuple(mesh_files.read(self.file).parts)
        return PARTS[self.shape or "square"]

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the regions of a mesh file."""
        return tuple(mesh_files.read(self.file).regions) if self.file is not None else ()

    @property
    def counts(self) -> list[int]:
        return [self.n] * self.dim if isinstance(self.n, int) else self.n

    @property
    def sides(self) -> list[float]:
        return self.lengths or [1.0] * self.dim

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        if self.file is not None:
            fields = type(self).model_fields
            given = [key for key in fields if key != "file" and getattr(self, key) != fields[key].default]
            if given:
                raise ValueError(f"a mesh from a file has no {', '.join(given)}; remove that, or the file")
            mesh_files.read(self.file)  # refuses
            return self
        body = self.shape or "square"
        for key in ("n", "lengths", "grading"):
            value = getattr(self, key)
            if isinstance(value, list) and len(value) != self.dim:
                raise ValueError(f"{key} has {len(value)} entries but a {body} has {self.dim} axes; give {self.dim}")
        if math.prod(n + 1 for n in self.counts) > 10**8:
            raise ValueError(
                "n gives more than 100 million nodes, which 32-bit numbering cannot hold; use a coarser mesh"
            )
        if self.dim == 3 and self.diagonal == "crisscross":
            raise ValueError("diagonal 'crisscross' exists for shape 'square' only; use 'right' or 'left'")
        return self


class TimeTable(Table):
    """`steps` uniform steps of backward Euler to time `end`."""

    end: Positive = 1.0
    steps: Count = 32
    coupling: Literal["staggered", "lagged", "monolithic"] = "staggered"


class InertiaTable(Table):
    density: NonNegative = 1.0  # rho; 0 leaves the motion quasistatic


class IsotropicTable(Table):
    """An elasticity or viscosity tensor: `lame` = [lambda, mu]; `young` and `poisson` under an assumption on the third axis;
    or any symmetric `tensor` that takes engineering strains (xx, yy, xy) or (xx, yy, zz, yz, xz, xy) to stresses."""

    lame: Annotated[list[Finite], Field(min_length=2, max_length=2)] | None = None
    young: NonNegative | None = None
    poisson: Finite | None = None
    assumption: Literal["plane_stress", "plane_strain", "solid"] | None = None
    tensor: list[list[Finite]] | None = None

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
        if self.lame is not None and any(value is not None for value in engineering):
            raise ValueError("give either lame or young, poisson and assumption, not both")
        if self.lame is None and any(value is None for value in engineering):
            raise ValueError("give lame = [lambda, mu], or young, poisson and assumption together")
        if self.poisson is not None:
            top = 1.0 if self.assumption == "plane_stress" else 0.5
            if not -1 < self.poisson < top:
                raise ValueError(f"poisson must lie between -1 and {top:g} for {self.assumption}, got {self.poisson:g}")
        return self

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
    tensor: Tensor  # M of (2.1), stress per temperature


class HeatingTable(Table):
    tensor: Tensor  # R of (2.4), heat per strain


class HeatTable(Table):
    conductivity: Tensor  # K of (2.2)
    capacity: Positive = 1.0  # per volume and temperature
    source: Value = 0.0  # q0
    expansion: ExpansionTable | None = None
    heating: HeatingTable | None = None


class RegionHeatTable(Table):
    """As [heat], without the source, which is one formula for the whole body."""

    conductivity: Tensor
    capacity: Positive = 1.0
    expansion: ExpansionTable | None = None
    heating: HeatingTable | None = None


class RegionTable(Table):
    """A part of the body with a material of its own: named in the mesh file, or `where` a formula of x, y, z holds.

    Tables replace those of the whole body; a block that is absent there is absent everywhere.
    """

    where: str | None = None
    inertia: InertiaTable | None = None
    elasticity: IsotropicTable | None = None
    viscosity: IsotropicTable | None = None
    heat: RegionHeatTable | None = None


class LoadsTable(Table):
    body: Values | None = None  # f0
    traction: dict[str, Values] = {}  # fN by boundary part
    heat_flux: dict[str, Value] = {}  # into the body, by boundary part


class SupportsTable(Table):
    """Parts that are held: names (at zero), or a table of names and what they are held at."""

    displacement: Annotated[
        Annotated[list[str], Tag("several")] | Annotated[dict[str, Values], Tag("one")], Discriminator(_listed)
    ] = []  # Gamma_D
    temperature: Annotated[
        Annotated[list[str], Tag("several")] | Annotated[dict[str, Value], Tag("one")], Discriminator(_listed)
    ] = []

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

    coefficient: NonNegative = 0.0  # mu_tau
    cohesion: NonNegative = 0.0  # stress
    limit: Positive | None = None  # stress
    kinetic: NonNegative | None = None
    speed: Positive | None = None  # velocity
    regularisation: Positive | None = None  # velocity

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
    conductance: NonNegative = 0.0  # k_c
    per_pressure: NonNegative = 0.0  # conductance per contact pressure, added to k_c
    foundation_temperature: Value = 0.0  # theta_F


class FrictionHeatTable(Table):
    share: Annotated[
        float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)
    ]  # of the frictional heat, into the body


class ContactTable(Table):
    """Contact on `part`: p_nu(r) = min(stiffness max(r, 0)^exponent, pressure_limit), friction, heat.

    Without a stiffness the part only exchanges heat.
    """

    part: str
    stiffness: NonNegative | None = None  # c_nu
    exponent: Annotated[float, Field(strict=True, ge=1, allow_inf_nan=False)] = 1.0
    pressure_limit: Positive | None = None  # stress
    gap: Value = 0.0  # g
    quadrature: Annotated[str, Field(pattern=r"^(nodal|gauss-[1-8])$")] = "nodal"
    friction: FrictionTable | None = None
    heat_exchange: ExchangeTable | None = None
    friction_heating: FrictionHeatTable | None = None

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
    velocity: Values | None = None
    temperature: Value = 0.0


class OutputTable(Table):
    every: Count = 1  # states stored every so many steps; the last one always
    checkpoint: Count = 100  # steps between two checkpoints
    checkpoint_minutes: Positive | None = None  # between two checkpoints, whichever comes first


# The same for a scene in which every block is there and every datum is a constant. Narrower types of frozen lists are safe,
# which mypy cannot know.


class FullExpansionTable(ExpansionTable):
    tensor: Matrix


class FullHeatingTable(HeatingTable):
    tensor: Matrix


class FullHeatTable(HeatTable):
    conductivity: Matrix
    source: Finite = 0.0
    expansion: FullExpansionTable
    heating: FullHeatingTable


class FullLoadsTable(LoadsTable):
    body: Vector  # type: ignore[assignment]
    traction: dict[str, Vector] = {}  # type: ignore[assignment]


class FullSupportsTable(SupportsTable):
    displacement: list[str]
    temperature: list[str]


class FullExchangeTable(ExchangeTable):
    foundation_temperature: Finite = 0.0


class FullContactTable(ContactTable):
    stiffness: NonNegative
    gap: Finite = 0.0
    friction: FrictionTable = FrictionTable()
    heat_exchange: FullExchangeTable = FullExchangeTable()


class FullInitialTable(InitialTable):
    displacement: Vector | None = None  # type: ignore[assignment]
    velocity: Vector | None = None  # type: ignore[assignment]
    temperature: Finite = 0.0
