"""The tables of the materials of a scene: of the body, and of its regions."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from warmslip.scene.expressions import Value
from warmslip.scene.types import Finite, NonNegative, Positive, Table, Tensor


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
