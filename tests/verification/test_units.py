"""The same problem in a mirror and in other units has the same answer."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Scene


def test_mirror_image() -> None:
    """The isotropic problem seen in a mirror: left diagonal, tractions exchanged and reversed."""
    scene = warmslip.load("paper_isotropic").override(
        **{"mesh.n": 8, "time.steps": 8, "contact.heat_exchange.foundation_temperature": 10.0}
    )
    image = scene.override(**{"mesh.diagonal": "left", "loads.traction": {"left": [0.8, 0.4], "right": [-1.4, 0.4]}})
    a, b = warmslip.run(scene).summary, warmslip.run(image).summary
    assert a["norms"] == pytest.approx(b["norms"], rel=1e-12)
    assert [a["contact"][s] for s in ("open", "stick", "slip")] == [b["contact"][s] for s in ("open", "stick", "slip")]
    assert a["contact"]["traction"] == pytest.approx(
        [-b["contact"]["traction"][0], b["contact"]["traction"][1]], rel=1e-11
    )


def scaled(scene: Scene, length: float, time: float, stress: float, temperature: float) -> Scene:
    """The same problem in other units (displacements scale like lengths)."""
    s, heat, exchange = scene, scene.heat, scene.contact.heat_exchange

    def times(tensor: Any, factor: float) -> Any:
        return (np.array(tensor) * factor).tolist()

    return scene.override(
        **{
            "mesh.lengths": [length, length],
            "time.end": s.time.end * time,
            "inertia.density": s.inertia.density * stress * time**2 / length**2,
            "elasticity.young": s.elasticity.young * stress,
            "viscosity.lame": times(s.viscosity.lame, stress * time),
            "heat.conductivity": times(heat.conductivity, length**2 / time),
            "heat.source": heat.source * temperature / time,
            "heat.expansion.tensor": times(heat.expansion.tensor, stress / temperature),
            "heat.heating.tensor": times(heat.heating.tensor, temperature),
            "loads.body": times(s.loads.body, stress / length),
            "loads.traction": {part: times(value, stress) for part, value in s.loads.traction.items()},
            "contact.stiffness": s.contact.stiffness * stress / length,
            "contact.heat_exchange.conductance": exchange.conductance * length / time,
            "contact.heat_exchange.foundation_temperature": exchange.foundation_temperature * temperature,
        }
    )


@pytest.mark.parametrize("coupling", ["staggered", "monolithic"])
@pytest.mark.parametrize(
    "units",
    [
        (1, 1, 4, 1),
        (4, 1, 1, 1),
        (1, 4, 1, 1),
        (1, 1, 1, 4),
        (2.0**-10, 2.0**8, 2.0**30, 2.0**9),
        (2.0**12, 2.0**-9, 2.0**-20, 2.0**-7),
    ],
    ids=["stress", "length", "time", "temperature", "all", "all the other way"],
)
def test_units(units: tuple[float, float, float, float], coupling: str) -> None:
    """Units of powers of two change nothing but the exponents: no tolerance is hidden in an absolute number."""
    scene = warmslip.load("paper_mixed").override(
        **{
            "mesh.n": 6,
            "time.steps": 5,
            "time.coupling": coupling,
            "contact.heat_exchange.foundation_temperature": 10.0,
        }
    )
    length, time, _, temperature = units
    a, b = warmslip.run(scene), warmslip.run(scaled(scene, *units))
    for name, unit in (("u", length), ("w", length / time), ("theta", temperature)):
        expected = getattr(a, name)
        assert np.abs(getattr(b, name) / unit - expected).max() <= 1e-13 * np.abs(expected).max(), name
    assert [a.summary["contact"][s] for s in ("open", "stick", "slip")] == [
        b.summary["contact"][s] for s in ("open", "stick", "slip")
    ]
