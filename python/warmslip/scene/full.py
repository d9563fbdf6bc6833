"""The tables of a scene in which every block is there and every datum is a constant: the paper's whole model.

Narrower types of frozen lists are safe, which mypy cannot know.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from warmslip.scene.contact_tables import ContactTable, ExchangeTable, FrictionTable
from warmslip.scene.errors import SceneError, validated
from warmslip.scene.material_tables import ExpansionTable, HeatingTable, HeatTable, InertiaTable, IsotropicTable
from warmslip.scene.scene import Scene
from warmslip.scene.support_tables import SupportsTable
from warmslip.scene.tables import InitialTable, LoadsTable
from warmslip.scene.types import Finite, Matrix, NonNegative, Vector


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


class FullScene(Scene):
    """A scene in which every block is there and every datum is a constant: the paper's whole model."""

    inertia: InertiaTable
    elasticity: IsotropicTable
    viscosity: IsotropicTable
    heat: FullHeatTable
    loads: FullLoadsTable
    supports: FullSupportsTable
    contact: FullContactTable
    initial: FullInitialTable = FullInitialTable()


def build_full(data: dict[str, Any]) -> FullScene:
    """A checked scene in which every block is there, from plain data; raises SceneError."""
    return validated(data, FullScene)


def full_model(scene: Scene) -> FullScene:
    """The same problem with every block there, those that were absent with no effect.

    Raises SceneError for what the whole model of the paper does not have: several or no contact parts, formulas,
    regions, other laws than linear compliance with Coulomb friction.
    """
    data = scene.resolved()
    d = scene.mesh.dim
    zero = [[0.0] * d for _ in range(d)]
    problems = [
        f"{key}: only constant data can be judged here, at zero on the supports; '{value}' is none"
        for key, value in _formulas(scene)
    ]
    if scene.heat and scene.heat.expansion and scene.heat.expansion.reference_temperature != 0:
        problems.append("heat.expansion.reference_temperature: only 0 can be judged here; measure temperatures from it")
    if scene.supports.points or scene.supports.springs:
        problems.append("supports: only parts at zero can be judged here; leave points and springs out")
    if scene.initial.run is not None:
        problems.append("initial.from: only initial data of the scene can be judged here; leave the key out")
    if scene.regions:
        problems.append("regions: only one material can be judged here; leave the table out")
    if len(scene.contacts) != 1 or scene.contacts[0].stiffness is None:
        problems.append("contact: one contact part with a stiffness is needed here")
    else:
        contact = scene.contacts[0]
        if contact.rigid or not contact.linear or contact.heats:
            problems.append("contact: only linear compliance with a constant conductance can be judged here")
        if not isinstance(contact.gap, float | int | str) or contact.velocity is not None:
            problems.append("contact: only a foundation at rest without a shape can be judged here")
        if contact.friction and contact.friction != FrictionTable(coefficient=contact.friction.coefficient):
            problems.append("contact.friction: only Coulomb's law with a constant coefficient can be judged here")
        data["contact"] = contact.model_dump(mode="json", exclude_none=True)
    if problems:
        raise SceneError("\n".join(problems))
    for table in ("elasticity", "viscosity"):
        data.setdefault(table, {"lame": [0.0, 0.0]})
    data.setdefault("inertia", {"density": 0.0})
    heat = data.setdefault("heat", {"conductivity": zero})
    for table in ("expansion", "heating"):
        heat.setdefault(table, {"tensor": zero})
    if (alpha := heat["expansion"].pop("alpha", None)) is not None:
        assert scene.elasticity is not None
        heat["expansion"]["tensor"] = alpha * scene.elasticity.per_expansion(d)
    for holder, key in ((heat, "conductivity"), (heat["expansion"], "tensor"), (heat["heating"], "tensor")):
        if not isinstance(holder[key], list):
            holder[key] = [[holder[key] if i == j else 0.0 for j in range(d)] for i in range(d)]
    data["loads"].setdefault("body", [0.0] * d)
    return validated(data, FullScene)


def _formulas(scene: Scene) -> list[tuple[str, Any]]:
    """Data that are formulas, and supports that are not simply held at zero."""
    data: dict[str, Any] = {
        "loads.body": scene.loads.body,
        **{f"loads.traction.{part}": value for part, value in scene.loads.traction.items()},
        **{f"loads.heat_flux.{part}": value for part, value in scene.loads.heat_flux.items()},
        "heat.source": scene.heat.source if scene.heat else 0.0,
        "initial.displacement": scene.initial.displacement,
        "initial.velocity": scene.initial.velocity,
        "initial.temperature": scene.initial.temperature,
    }
    for contact in scene.contacts:
        data["contact.gap"] = contact.gap
        exchange = contact.heat_exchange
        data["contact.heat_exchange.foundation_temperature"] = exchange.foundation_temperature if exchange else 0.0
    moved = {part: held if isinstance(held, list) else held.model_dump() for part, held in scene.supports.moved.items()}
    held = {"supports.displacement": moved, "supports.temperature": scene.supports.warmed}
    found = [(key, v) for key, value in data.items() for v in (value if isinstance(value, list) else [value])]
    return [(key, v) for key, v in found if isinstance(v, str)] + [(key, value) for key, value in held.items() if value]
