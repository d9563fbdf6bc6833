"""The coupling just inside and outside the limit of its steps, and growth beyond it, which is said and ends as such."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.boxes import along, completed, field, scene

from warmslip import Scene
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

pytestmark = pytest.mark.parametrize("d", [2, 3])

A, F, M = 2.0, 1.5, 3.0  # viscosity, elasticity and expansion along the column
LIMIT = 2 * A / (M * M - F)  # of the staggered step for R = -M
LAGGED = LIMIT / 2  # k c M^2 = A + k F
FED = "the coupling feeds the run"


def column(d: int, r: float, k: float, steps: int, **keys: Any) -> Scene:
    """Strained along itself alone, without inertia and conduction, in `steps` of k; warm by `theta` at the start."""
    coupling, theta = keys.pop("coupling", "staggered"), keys.pop("theta", 1.0)
    axis = np.zeros((d, d))
    axis[-1, -1] = 1.0
    return scene(
        d,
        2,
        **{
            "time": {"end": k * steps, "steps": steps, "coupling": coupling},
            "elasticity": {"lame": [0.0, F / 2]},
            "viscosity": {"lame": [0.0, A / 2]},
            "heat": {
                "conductivity": 0.0,
                "capacity": 1.0,
                "expansion": {"tensor": (M * axis).tolist()},
                "heating": {"tensor": (r * axis).tolist()},
            },
            "supports": {"displacement": ["top"]},
            "initial": {"temperature": theta},
        }
        | keys,
    )


def message(simulation: Simulation) -> str:
    """What the summary says of growth, nothing where it says nothing."""
    return " ".join(one for one in summary(simulation)["warnings"] if one.startswith(FED))


@pytest.mark.parametrize(
    ("r", "k", "grows"),
    [
        (-M, 0.98 * LIMIT, False),
        (-M, 1.02 * LIMIT, True),
        (0.98 * F / M, 0.1, False),
        (1.02 * F / M, 0.1, True),
        (1.02 * F / M, 10.0, True),
    ],
    ids=["R = -M inside", "R = -M outside", "R = +M inside", "R = +M outside", "R = +M outside, long steps"],
)
def test_growth_of_the_staggered_coupling(d: int, r: float, k: float, grows: bool) -> None:
    """A column strained along itself that does not conduct: a step multiplies the strain rate by 1 + k (M R - F)/(A + k F).

    For R = -M it grows beyond k = 2 A/(M^2 - F) by the splitting. For R = +M it grows beyond M R = F, as the equations do.
    """
    steps, speeds = 200, []
    completed(
        column(d, r, k, steps), each=lambda simulation, report: speeds.append(float(field(simulation, "w")[0, -1]))
    )
    factor = 1 + k * (M * r - F) / (A + k * F)
    assert (abs(factor) > 1) == grows
    assert speeds[-1] / speeds[0] == pytest.approx(factor ** (steps - 1), rel=1e-9)


SMALL = 1e-5  # the growth is of no size that anything else would see


@pytest.mark.parametrize(
    ("coupling", "r", "k", "steps", "cure"),
    [
        ("staggered", -M, 1.02 * LIMIT, 300, f"or steps below {LIMIT:.3g}"),
        ("lagged", -M, 1.02 * LAGGED, 800, f"or steps below {LAGGED:.3g}"),
        ("staggered", 1.02 * F / M, 10.0, 400, "no step is short enough"),
        ("staggered", 1.02 * F / M, 0.1, 4000, "no step is short enough"),
        ("lagged", 1.02 * F / M, 1.0, 800, "no step is short enough"),
        ("monolithic", 1.02 * F / M, 1.0, 800, "no step is short enough"),
        ("monolithic", M, 0.01, 300, "no step is short enough"),
    ],
)
def test_growth_is_said(d: int, coupling: str, r: float, k: float, steps: int, cure: str) -> None:
    """Two per cent outside the limit, with the factor a step that the equations have, and what helps."""
    one = column(d, r, k, steps, coupling=coupling, theta=SMALL)
    words = message(completed(one, digits=7.0))
    strained = k * (M * r - F)
    factor = {
        "staggered": abs(1 + strained / (A + k * F)),
        "lagged": np.abs(np.roots([A + k * F, -A, -k * M * r])).max(),
        "monolithic": A / (A - strained),
    }[coupling]
    assert cure in words and "nothing drives it" in words, words
    assert float(words.split("by a factor of ")[1].split()[0]) == pytest.approx(factor, rel=2e-3)


DRIVEN: dict[str, dict[str, Any]] = {
    "alone": {},
    "a wave": {"loads": {"body": "sin(t)"}},
    "a ramp": {"loads": {"body": "t * t"}},
    "a growing load": {"loads": {"body": "exp(0.05 * t / k)"}},
    "a growing flux": {"loads": {"heat_flux": {"bottom": "exp(0.05 * t / k)"}}},
    "a support": {"supports": {"displacement": {"top": "1e-5 * exp(0.05 * t / k)"}}},
    "a gap": {"contact": {"part": "bottom", "stiffness": 5.0, "gap": "0.1 - 1e-5 * exp(0.03 * t / k)"}},
    "an impact": {
        "supports": {},
        "loads": {"body": "-1"},
        "contact": {"part": "bottom", "stiffness": 500.0, "gap": 0.5, "friction": {"coefficient": 0.5}},
    },
    "heat": {"loads": {"heat_flux": {"bottom": 1.0}}},
}


@pytest.mark.parametrize("keys", DRIVEN.values(), ids=DRIVEN)
@pytest.mark.parametrize(
    ("coupling", "r", "k"),
    [
        ("staggered", -M, 0.98 * LIMIT),
        ("staggered", -M, 0.01 * LIMIT),
        ("lagged", -M, 0.98 * LAGGED),
        ("monolithic", -M, 3 * LIMIT),
        ("staggered", 0.98 * F / M, 0.1),
        ("monolithic", 0.9 * F / M, 10.0),
    ],
)
def test_what_is_driven_does_not_grow(d: int, coupling: str, r: float, k: float, keys: dict[str, Any]) -> None:
    """Inside the limit nothing is said, whatever the data do."""

    def filled(value: Any, name: str = "") -> Any:
        if isinstance(value, dict):
            return {key: filled(one, key) for key, one in value.items()}
        formula = value.replace("/ k", f"/ {k}") if isinstance(value, str) else value
        return along(d, formula) if name in ("body", "top") else formula

    inertia = {"inertia": {"density": 1.0}} if keys else {}
    simulation = Simulation(column(d, r, k, 300, coupling=coupling, theta=SMALL, **inertia, **filled(keys)))
    for _ in simulation.steps():
        pass
    assert message(simulation) == ""


@pytest.mark.parametrize(
    ("r", "k", "coupling"), [(-M, 10 * LIMIT, "staggered"), (M, 1.0, "lagged"), (M, 0.05, "monolithic")]
)
def test_growth_until_numbers_overflow_is_the_reason(d: int, r: float, k: float, coupling: str) -> None:
    simulation = Simulation(column(d, r, k, 3000, coupling=coupling))
    for _ in simulation.steps():
        pass
    assert simulation.outcome == "not_finite" and simulation.failure is not None
    assert simulation.failure["reason"].startswith(FED) and simulation.failure["reason"].endswith(
        "; in the end a number overflowed"
    )


def test_a_growth_ends_where_the_step_is_cured(d: int) -> None:
    """What the sentence advises: the very run, monolithic or in steps below the number that it says."""
    for coupling, k in (("monolithic", 1.02 * LIMIT), ("staggered", 0.99 * LIMIT)):
        assert message(completed(column(d, -M, k, 300, coupling=coupling, theta=SMALL))) == ""
