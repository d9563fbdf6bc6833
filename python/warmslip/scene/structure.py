"""What of a scene its operators depend on: scenes that agree in it share mesh, matrices and factors."""

from __future__ import annotations

import json
from typing import Any

from warmslip.scene.scene import Scene

DATA = (
    "title",
    "time",
    "loads",
    "supports",
    "contact",
    "initial",
    "output",
)  # tables with data that operators do not see


def structure(scene: Scene) -> str:
    """A text that is the same for scenes which differ only in loads, gaps, contact laws, given temperatures and displacements,
    initial data, times and output."""
    whole = scene.resolved()
    kept: dict[str, Any] = {name: table for name, table in whole.items() if name not in DATA}
    if "heat" in kept:
        kept["heat"] = {key: value for key, value in kept["heat"].items() if key != "source"}
    kept["coupling"] = scene.time.coupling
    kept["supports"] = [scene.supports.pattern(), sorted(scene.supports.temperature)]
    kept["contact"] = [
        {
            "part": contact.part,
            "touches": contact.stiffness is not None,
            "quadrature": contact.quadrature,
            "conductance": contact.heat_exchange.conductance if contact.heat_exchange else 0.0,
            "conducts by pressure": bool(contact.heat_exchange and contact.heat_exchange.per_pressure),
            "is heated by friction": bool(contact.friction_heating and contact.friction_heating.share),
        }
        for contact in scene.contacts
    ]
    return json.dumps(kept, sort_keys=True)
