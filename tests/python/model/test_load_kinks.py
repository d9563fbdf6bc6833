"""Order of load quadrature, and formulas whose kinks it does not see."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Loads
from warmslip.model.foresight import before
from warmslip.model.load_kinks import load_kinks
from warmslip.scene.kinks import switches
from warmslip.scene.reader import build

BODY: dict[str, Any] = {
    "mesh": {"shape": "square", "n": 4},
    "time": {"steps": 2},
    "elasticity": {"young": 10.0, "poisson": 0.3, "assumption": "plane_strain"},
    "supports": {"displacement": ["bottom"]},
}


def body(**loads: Any) -> Any:
    return build(BODY | {"loads": loads})


def total(scene: Any) -> Any:
    d = warmslip.discretise(scene)
    return d.field(d.load_vectors.at(1.0).force).sum(axis=0)


def test_the_scene_sets_the_points() -> None:
    """Of x^6 on edges and x^5 in cells: the integrals are exact from 4 points a direction on."""
    for points, exact in ((None, False), (1, False), (3, False), (4, True), (8, True)):
        more = {} if points is None else {"quadrature": points}
        one = body(traction={"top": [0.0, "x**6"]}, **more)
        assert Loads.of(one).points == (points or 3)
        assert (abs(total(one)[1] - 1 / 7) <= 1e-15) == exact, points
    assert body().digest() == body(quadrature=None).digest()
    assert "quadrature" not in body().resolved()["loads"]


@pytest.mark.parametrize(
    ("formula", "arguments"),
    [
        ("x + sin(y)", []),
        ("max(0, x - 0.3)", [("0 - (x - 0.3)", False)]),
        ("abs(y - t) + (x < 0.5)", [("x - 0.5", False), ("y - t", False)]),
        ("min(x, y, 1)", [("x - 1", False), ("x - y", False), ("y - 1", False)]),
        ("floor(4 * x) + y % 2", [("4 * x", True), ("y / 2", True)]),
        ("where(x < 0.5 and y >= 0.1, 1, 2)", [("x - 0.5", False), ("y - 0.1", False)]),
    ],
)
def test_switches(formula: str, arguments: list[tuple[str, bool]]) -> None:
    assert [(one.argument.text, one.steps) for one in switches(formula)] == arguments


def test_a_kink_on_the_edges_of_cells_is_none() -> None:
    for formula in (
        "5 * (x < 0.5)",
        "max(0, x - 0.25)",
        "floor(4 * x)",
        "abs(sin(t) - 0.3)",
        "max(0, t - 0.3)",
        "sin(x)",
    ):
        assert load_kinks(warmslip.discretise(body(body=[0.0, formula], traction={"top": [0.0, formula]}))) == []


def test_a_kink_inside_cells_is_said_with_its_size() -> None:
    """5 (x < 0.3) on edges of length 1/4: Gauss points at 0.113, 0.5, 0.887 of the second edge see 5/18 of it, and not 1/5."""
    one = body(traction={"top": [0.0, "5 * (x < 0.3)"]})
    d = warmslip.discretise(one)
    (message,) = load_kinks(d)
    missed = (5 / 18 - 1 / 5) / 4
    assert total(one)[1] == pytest.approx(5 * (0.3 + missed), rel=1e-13)
    assert message.startswith(
        "the formula of loads.traction.top has a kink or a jump inside 1 of 4 facets, and a quadrature of 3 "
    )
    stated = float(message.split(" misses ")[1].split(" %")[0])
    assert stated == pytest.approx(100 * missed / 0.3, rel=0.02)  # as a sum over the facet, and in two digits
    assert message in before(d) and message in warmslip.run(one).summary["warnings"]
    moving = body(body=[0.0, "max(0, x - 0.1 - 0.4 * t)"])
    (message,) = load_kinks(warmslip.discretise(moving))
    assert "of loads.body has a kink or a jump inside 8 of 32 cells" in message
    assert not load_kinks(warmslip.discretise(body(traction={"top": [0.0, "1e3 + abs(x - 0.3)"]})))  # too little
    given = Loads.of(one)
    function = {"top": lambda x, t: np.zeros_like(x)}
    assert not load_kinks(warmslip.discretise(one, loads=Loads(traction=function)))
    assert load_kinks(warmslip.discretise(one, loads=given))
