"""The tables of a scene: typed, frozen, unknown keys forbidden, each refusing what no other table is needed to refuse."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, strict=True)]
Vector = Annotated[list[Finite], Field(min_length=2, max_length=3)]
Matrix = Annotated[list[Vector], Field(min_length=2, max_length=3)]

PARTS = {"square": ("left", "right", "bottom", "top"), "cube": ("left", "right", "front", "back", "bottom", "top")}


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class MeshTable(Table):
    """A structured box. `n` bricks a side (or one number an axis), each cut along `diagonal`."""

    shape: Literal["square", "cube"] = "square"
    n: Count | list[Count] = 32
    lengths: list[Positive] | None = None  # default: 1 along every axis
    diagonal: Literal["right", "left", "crisscross"] = "right"

    @property
    def dim(self) -> int:
        return 2 if self.shape == "square" else 3

    @property
    def counts(self) -> list[int]:
        return [self.n] * self.dim if isinstance(self.n, int) else self.n

    @property
    def sides(self) -> list[float]:
        return self.lengths or [1.0] * self.dim

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        for key in ("n", "lengths"):
            value = getattr(self, key)
            if isinstance(value, list) and len(value) != self.dim:
                raise ValueError(
                    f"{key} has {len(value)} entries but a {self.shape} has {self.dim} axes; give {self.dim}"
                )
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
    """An isotropic tensor: `lame` = [lambda, mu], or `young` and `poisson` under an assumption on the third axis."""

    lame: Annotated[list[Finite], Field(min_length=2, max_length=2)] | None = None
    young: NonNegative | None = None
    poisson: Finite | None = None
    assumption: Literal["plane_stress", "plane_strain", "solid"] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        engineering = (self.young, self.poisson, self.assumption)
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
        assert self.young is not None and self.poisson is not None
        mu = self.young / (2 * (1 + self.poisson))
        if self.assumption == "plane_stress":
            return self.young * self.poisson / (1 - self.poisson**2), mu
        return self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson)), mu


class ExpansionTable(Table):
    tensor: Matrix  # M of (2.1), stress per temperature


class HeatingTable(Table):
    tensor: Matrix  # R of (2.4), heat per strain


class HeatTable(Table):
    conductivity: Matrix  # K of (2.2)
    source: Finite = 0.0  # q0
    expansion: ExpansionTable
    heating: HeatingTable


class LoadsTable(Table):
    body: Vector  # f0
    traction: dict[str, Vector] = {}  # fN by boundary part


class SupportsTable(Table):
    displacement: list[str]  # parts with u = 0 (Gamma_D)
    temperature: list[str]  # parts with theta = 0


class FrictionTable(Table):
    coefficient: NonNegative = 0.0  # mu_tau


class ExchangeTable(Table):
    conductance: NonNegative = 0.0  # k_c
    foundation_temperature: Finite = 0.0  # theta_F


class ContactTable(Table):
    """Normal compliance p_nu(r) = stiffness max(r, 0) on `part`, with Coulomb friction and heat exchange."""

    part: str
    stiffness: NonNegative  # c_nu
    gap: Finite = 0.0  # g
    quadrature: Annotated[str, Field(pattern=r"^(nodal|gauss-[1-8])$")] = "nodal"
    friction: FrictionTable = FrictionTable()
    heat_exchange: ExchangeTable = ExchangeTable()

    @property
    def points(self) -> int:
        """Gauss points an edge, 0 for the vertex rule."""
        return 0 if self.quadrature == "nodal" else int(self.quadrature.removeprefix("gauss-"))


class InitialTable(Table):
    """Constant initial data, set to zero on the supports."""

    displacement: Vector | None = None
    velocity: Vector | None = None
    temperature: Finite = 0.0


class OutputTable(Table):
    every: Count = 1  # states stored every so many steps; the last one always
