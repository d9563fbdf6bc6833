"""The table [contact] of a scene and the tables inside it."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from warmslip.scene.expressions import Value
from warmslip.scene.foundation_tables import ShapeTable
from warmslip.scene.types import NonNegative, Positive, Table, _word


def _value_or_shape(value: Any) -> str:
    return "of_a_shape" if isinstance(value, dict | ShapeTable) else "value"


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
    gap: Annotated[
        Annotated[Value, Tag("value")] | Annotated[ShapeTable, Tag("of_a_shape")], Discriminator(_value_or_shape)
    ] = 0.0
    """g, distance to the foundation along the outward normal at rest, length: a number, a formula, or the shape of the
    foundation."""
    velocity: Annotated[list[Value], Field(min_length=2, max_length=3)] | None = None
    """Velocity of the foundation, a number or a formula for each axis: that of a belt, a disc or a drum. Slip is relative to it.
    Only its part along the surface acts; a foundation that comes nearer has a gap that depends on t."""
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
