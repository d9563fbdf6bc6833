"""The tables of a scene in which every block is there and every datum is a constant: the paper's whole model.

Narrower types of frozen lists are safe, which mypy cannot know.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from warmslip.tables import (
    ContactTable,
    ExchangeTable,
    ExpansionTable,
    Finite,
    FrictionTable,
    HeatingTable,
    HeatTable,
    InitialTable,
    LoadsTable,
    Matrix,
    NonNegative,
    SupportsTable,
    Vector,
)


class FullExpansionTable(ExpansionTable):
    tensor: Matrix
    reference_temperature: Annotated[float, Field(strict=True, ge=0, le=0)] = 0.0


class FullHeatingTable(HeatingTable):
    tensor: Matrix


class FullHeatTable(HeatTable):
    conductivity: Matrix
    source: Finite = 0.0
    expansion: FullExpansionTable
    heating: FullHeatingTable


class FullLoadsTable(LoadsTable):
    body: Vector  # type: ignore[assignment]
    traction: dict[str, Vector] = Field(default_factory=dict)  # type: ignore[assignment]


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
