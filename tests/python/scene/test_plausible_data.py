"""What the data alone say is hardly sensible, and what is taken for granted."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.folders import DOCS
from support.sensible import FALLING, KELVIN, PRESSED, WARM, body

import warmslip
from warmslip.model.meshes import make_mesh
from warmslip.scene import plan, plausible_data
from warmslip.scene.reader import build


def test_heat_of_friction_that_expands_the_body_is_said() -> None:
    rubs = {
        "contact__friction_heating": {"share": 0.5},
        "heat": {"conductivity": 1.0, "capacity": 1.0, "expansion": {"tensor": 1e-3}},
    }
    one = body(PRESSED, **rubs)
    (message,) = [one for one in plausible_data.of_scene(one) if "presses harder" in one]
    assert message.startswith("the friction of 'bottom', 0.3, heats a body that expands")
    for cured in ({"heat.expansion": None}, {"contact.friction.coefficient": 0.0}, {"contact.friction_heating": None}):
        assert not [word for word in plausible_data.of_scene(one.override(**cured)) if "presses harder" in word]


def test_friction_that_does_not_fall_or_moves_no_mass_feeds_nothing() -> None:
    for base, kinetic in ((FALLING, 0.5), (PRESSED, 0.1)):
        friction = {"coefficient": 0.5, "kinetic": kinetic, "speed": 0.2}
        assert not [one for one in plausible_data.of_scene(body(base, contact__friction=friction)) if "feed" in one]


def test_what_is_taken_for_granted() -> None:
    shut = body(WARM, elasticity={"lame": [1.0, 1.0]}, supports={"displacement": ["top"]}, contact__stiffness=10.0)
    assert "heat is exchanged on 'bottom' also across an open gap, with the conductance 5" in plan.plan(shut).assumed
    both = shut.override(**{"contact.heat_exchange.per_pressure": 2.0})
    assert any(
        one.endswith("the conductance 5; per_pressure acts only where it touches") for one in plan.plan(both).assumed
    )
    only = both.override(**{"contact.heat_exchange.conductance": 0.0})
    assert "heat is exchanged on 'bottom' only where it touches" in plan.plan(only).assumed
    assert "the body has no stress along z: no assumption says plane_strain" in plan.plan(shut).assumed
    assert plan.plan(body(WARM)).assumed == []  # without contact there is no gap
    strained = body(PRESSED | KELVIN, heat__expansion={"tensor": [[1.0, 0.0], [0.0, 2.0]]})
    assert any("mean of M_xx and M_yy" in one for one in plan.plan(strained).assumed)
    inherits = body(WARM, heat__capacity=3.0, regions={"part": {"where": "x < 0.5", "heat": {"conductivity": 2.0}}})
    assert "region 'part' has the capacity of the body, 3" in plan.plan(inherits).assumed
    assert "taken for granted\n  region 'part'" in plan.text(plan.plan(inherits))


def test_what_is_left_open_stays_open_when_a_key_is_replaced() -> None:
    scene = body(WARM, heat={"conductivity": 1.0}).override(**{"time.steps": 3}).override(**{"mesh.n": 4})
    assert any("the capacity is 1" in one for one in plausible_data.of_scene(scene))


def cantilever(ratio: float, mesh: dict[str, Any]) -> float:
    """Tip displacement under a shear traction, 4 cells in height and 20 in length, over that of beam theory with shear."""
    space = mesh["shape"] == "cube"
    scene = build(
        {
            "mesh": {"n": [20, 4, 4][: 3 if space else 2], "lengths": [5.0, 1.0, 1.0][: 3 if space else 2]} | mesh,
            "time": {"steps": 1},
            "elasticity": {"young": 1e3, "poisson": ratio, "assumption": "solid" if space else "plane_strain"},
            "supports": {"displacement": ["left"]},
            "loads": {"traction": {"right": [0.0, 0.0, 0.01] if space else [0.0, 0.01]}},
        }
    )
    u, x = warmslip.run(scene).u, np.asarray(make_mesh(scene).nodes)
    bending = 1e3 if space else 1e3 / (1 - ratio**2)
    beam = 0.01 * (5**3 / (3 * bending / 12) + 5 * 6 / 5 / (1e3 / 2 / (1 + ratio)))
    return float(u[x[:, 0] == 5.0][:, -1].mean() / beam)


def test_how_much_a_cantilever_locks() -> None:
    """The numbers that the warning and the docs give are measured; criss-cross triangles do not lock."""
    page = (DOCS / "howto/sensible.md").read_text()
    for i, ratio in enumerate(plausible_data.RATIOS):
        row = [
            cantilever(ratio, {"shape": "square"}),
            cantilever(ratio, {"shape": "square", "diagonal": "crisscross"}),
            cantilever(ratio, {"shape": "cube"}),
        ]
        assert plausible_data.CANTILEVER[2][i] == pytest.approx(row[0], rel=0.02)
        assert plausible_data.CANTILEVER[3][i] == pytest.approx(row[2], rel=0.02)
        assert row[1] > 0.9
        assert f"| {ratio} | {row[0]:.2f} | {row[1]:.2f} | {row[2]:.2f} |" in page, (ratio, row)
