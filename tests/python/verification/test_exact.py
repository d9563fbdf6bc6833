"""Scenes with an answer on paper: every line of every case, and what must turn the cases red."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid

from warmslip import Loads, Scene
from warmslip.records.check import Check
from warmslip.verification.exact import creep, fixtures, halfplane, hertz, impact, slab
from warmslip.verification.exact.cases import CASES

Mutant = Callable[[Scene, Loads], tuple[Scene, Loads]]


def failed(lines: list[Check]) -> list[str]:
    return [f"{x.case}: {x.proves}: {x.observed!r} not in [{x.low!r}, {x.high!r}]" for x in lines if not x.passed]


@pytest.mark.parametrize("case", CASES)
def test_every_line_passes(case: str) -> None:
    lines = CASES[case]()
    assert lines != []
    assert failed(lines) == []


def times(value: Any, factor: float) -> Any:
    return [times(one, factor) for one in value] if isinstance(value, list) else factor * value


def scaled(key: str, factor: float = 1.01) -> Mutant:
    def change(scene: Scene, loads: Loads) -> tuple[Scene, Loads]:
        value: Any = scene.resolved()
        for part in key.split("."):
            value = value[part]
        return scene.override(**{key: times(value, factor)}), loads

    return change


def coupled(name: str) -> Mutant:
    return lambda scene, loads: (scene.override(**{"time.coupling": name}), loads)


def axes_exchanged(scene: Scene, loads: Loads) -> tuple[Scene, Loads]:
    flipped = np.flip(np.array(scene.heat.conductivity)).tolist()
    return scene.override(**{"heat.conductivity": flipped}), loads


def gap_of_wrong_sign(scene: Scene, loads: Loads) -> tuple[Scene, Loads]:
    gap = loads.gap
    return scene, replace(loads, gap=(lambda x, t: -gap(x, t)) if callable(gap) else -gap)


MUTANTS: dict[str, tuple[Mutant, list[str]]] = {
    "friction": (
        scaled("contact.friction.coefficient"),
        [
            "coupled uniform strain",
            "sliding elastic block",
            "sliding rigid block",
            "slipping patch",
            "patch at the threshold",
            "Cattaneo-Mindlin",
        ],
    ),
    "no friction": (scaled("contact.friction.coefficient", 0.0), ["sticking patch"]),
    "stiffness": (
        scaled("contact.stiffness"),
        [
            "creeping column",
            "inertial column",
            "coupled uniform strain",
            "sticking patch",
            "slipping patch",
            "heated column",
            "compliant line contact",
        ],
    ),
    "conductance": (scaled("contact.heat_exchange.conductance"), ["Robin slab"]),
    "density": (
        scaled("inertia.density"),
        [
            "inertial column",
            "sliding elastic block",
            "sliding rigid block",
            "bar on a soft foundation",
            "bar on a stiff foundation",
            "modes of backward Euler",
        ],
    ),
    "elasticity": (
        scaled("elasticity.lame"),
        ["creeping column", "heated column", "Hertz", "compliant line contact", "modes of backward Euler"],
    ),
    "elasticity of the frequency": (scaled("elasticity.lame"), ["longitudinal frequency"]),
    "viscosity": (
        scaled("viscosity.lame"),
        ["creeping column", "inertial column", "coupled uniform strain", "sticking patch", "modes of backward Euler"],
    ),
    "conductivity": (scaled("heat.conductivity"), ["Robin slab"]),
    "axes of the conductivity": (axes_exchanged, ["Robin slab"]),
    "expansion": (scaled("heat.expansion.tensor"), ["coupled uniform strain", "heated column"]),
    "sign of the expansion": (scaled("heat.expansion.tensor", -1.0), ["coupled uniform strain"]),
    "heating": (scaled("heat.heating.tensor"), ["coupled uniform strain", "creeping column"]),
    "step": (scaled("time.end"), ["creeping column", "sliding rigid block", "modes of backward Euler"]),
    "sign of the gap": (gap_of_wrong_sign, ["creeping column", "coupled uniform strain"]),
    "staggered": (coupled("staggered"), ["creeping column", "coupled uniform strain"]),
    "lagged": (coupled("lagged"), ["creeping column"]),
    "monolithic": (coupled("monolithic"), ["coupled uniform strain", "heated column"]),
}


@pytest.mark.parametrize(
    ("change", "case"),
    [pytest.param(change, case, id=f"{name}-{case}") for name, (change, cases) in MUTANTS.items() for case in cases],
)
def test_a_mutant_is_seen(monkeypatch: pytest.MonkeyPatch, change: Mutant, case: str) -> None:
    """One wrong constant or index in what is run, not in what is expected: some line turns red, or the run does not end."""
    assemble = fixtures.discretise

    def discretise(scene: Scene, *, loads: Loads | None, mesh: Any) -> Any:
        wrong, data = change(scene, loads or Loads.of(scene))
        return assemble(wrong, loads=data, mesh=mesh)

    simulation = fixtures.Simulation
    monkeypatch.setattr(fixtures, "discretise", discretise)
    monkeypatch.setattr(
        fixtures,
        "Simulation",
        lambda _, *, discretisation: simulation(discretisation.scene, discretisation=discretisation),
    )
    try:
        red = failed(CASES[case]())
    except RuntimeError as stopped:
        red = [str(stopped)]
    assert red != []


def test_the_formulas_agree_with_themselves() -> None:
    """The formulas against numerical integration, differences, and each other."""
    for stiffness in (20.0, 200.0):
        exact = impact.Impact(stiffness)
        t = np.linspace(0, impact.END, 200001)
        assert trapezoid(exact.pressure(t), t) == pytest.approx(exact.impulse, rel=1e-8)
    y = np.array([0.0, 0.7, slab.HEIGHT])
    assert slab.series(y, 1e-9) == pytest.approx([0.0, 0.0, 0.0], abs=0.2)
    assert slab.series(y, 100.0) == pytest.approx(slab.SLOPE * (slab.HEIGHT - y))
    assert slab.series(y, 0.4, 100000) == pytest.approx(slab.series(y, 0.4), rel=1e-4, abs=1e-12)
    t = np.linspace(0, creep.END, 100001)
    a = creep.creep(t)
    rate = (creep.TRACTION - creep.E * a - creep.STIFFNESS * np.maximum(a * creep.H - creep.GAP, 0)) / creep.ETA
    assert np.gradient(a, t)[1:-1] == pytest.approx(rate[1:-1], rel=1e-3, abs=1e-6)


def test_the_integral_equation_tends_to_hertz() -> None:
    x, p = hertz.winkler(halfplane.HalfPlane(1.0, 8.0, 16, stiffness=1e8))
    assert p.max() == pytest.approx(halfplane.PEAK, rel=1e-3)
    assert hertz._width(x, p, np.ones(len(x))) == pytest.approx(1.0, rel=1e-3)
