"""What probes must agree on with the other tables of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from warmslip.scene.probe_tables import BodyField, ContactField, ProbeTable
from warmslip.scene.tables import SceneTables


def fields(scene: SceneTables, probe: ProbeTable) -> list[str]:
    """The fields that the scene has at the place of a probe, in the order of a table."""
    names = [name for name in get_args(BodyField) if (scene.heat is not None if name == "temperature" else scene.moves)]
    return [*names, *get_args(ContactField)] if touches(scene, probe.part) else names


def touches(scene: SceneTables, part: str | None) -> bool:
    """Whether a part is a contact part with a law."""
    return any(contact.part == part and contact.stiffness is not None for contact in scene.contacts)


def problems(scene: SceneTables) -> Iterator[str]:
    """A sentence for each thing that is wrong with a probe."""
    d = scene.mesh.dim
    for name, probe in (scene.output.probes or {}).items():
        key = f"output.probes.{name}"
        for what, point in [("at", probe.at), *((f"line.{i}", end) for i, end in enumerate(probe.line or []))]:
            if point is not None and len(point) != d:
                yield f"{key}.{what} has {len(point)} components; a {scene.mesh.name} needs {d}"
        if probe.part is not None and probe.part not in scene.mesh.parts:
            has = ", ".join(scene.mesh.parts) or "no named part; give its facets physical names"
            yield f"{key}.part: unknown boundary part '{probe.part}'; a {scene.mesh.name} has {has}"
            continue
        there = fields(scene, probe)
        for field in probe.fields or []:
            if field in there:
                continue
            if field in get_args(ContactField):
                yield f"{key}.fields: '{field}' is known at contact points; give a part that touches, or leave it out"
            else:
                yield f"{key}.fields: the scene has no {field}; leave it out"
