"""What happens on each boundary part of a scene, in a few words."""

from __future__ import annotations

from typing import Any

from warmslip.scene.contact_tables import ContactTable
from warmslip.scene.expressions import constant
from warmslip.scene.foundation_tables import ShapeTable
from warmslip.scene.scene import Scene


def held_along(held: Any, dim: int) -> str:
    """The directions of a support: `along x and y`, `along its normal`."""
    if not isinstance(held, list):
        return "along its normal"
    return "along " + " and ".join(axis for axis, value in zip("xyz"[:dim], held, strict=True) if value != "free")


def roles(scene: Scene) -> dict[str, list[str]]:
    """By boundary part, in the order of the mesh: what holds, loads, warms and touches it; parts with nothing are left out."""
    found: dict[str, list[str]] = {part: [] for part in scene.mesh.parts}
    table = scene.supports
    for part in table.displacement:
        held = table.moved.get(part)
        values = held if isinstance(held, list) else [held.normal] if held is not None else []
        given = [value for value in values if value != "free"]
        moves = ", moves" if not constant(*given) or any(given) else ""
        found[part].append("clamped" if held is None else f"held {held_along(held, scene.mesh.dim)}{moves}")
    for part in table.springs or {}:
        found[part].append("on springs or dashpots")
    for part in scene.loads.traction:
        found[part].append("traction")
    for part in table.temperature:
        found[part].append("temperature given")
    for part in scene.loads.heat_flux:
        found[part].append("heat flux")
    for contact in scene.contacts:
        found[contact.part].append(_contact(contact))
    return {part: words for part, words in found.items() if words}


def _contact(contact: ContactTable) -> str:
    if contact.stiffness is None:
        return "exchanges heat"
    words = ["contact with a rigid foundation" if contact.rigid else f"contact, stiffness {contact.compliance:g}"]
    if isinstance(contact.gap, ShapeTable):
        words.append(contact.gap.shape)
    if contact.friction is not None:
        words.append(f"friction {contact.friction.coefficient:g}" if contact.friction.coefficient else "friction")
    if contact.velocity is not None:
        words.append("foundation moves")
    return ", ".join(words)
