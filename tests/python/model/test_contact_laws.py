"""Contact laws of one's own: Python functions that are tried before a run, watched in it, and named where they are none."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

import warmslip
from warmslip import Law, Scene
from warmslip.model import contact_laws

Small = Callable[..., Scene]
STIFF, MU = 10.0, 0.4


def linear(r: float) -> Sequence[float]:
    return STIFF * r, STIFF, STIFF * r**2 / 2


def coulomb(pressure: float, speed: float) -> Sequence[float]:
    return MU * pressure, MU, 0.0


def exponential(r: float) -> Sequence[float]:
    """As rough surfaces have it."""
    return math.expm1(20 * r), 20 * math.exp(20 * r), math.expm1(20 * r) / 20 - r


@pytest.mark.parametrize("quadrature", ["nodal", "gauss-2"])
def test_the_scenes_own_law_written_in_python_gives_the_same(
    small: Small, quadrature: str, caplog: pytest.LogCaptureFixture
) -> None:
    scene = small(contact__stiffness=STIFF, contact__friction__coefficient=MU, contact__quadrature=quadrature)
    output = warmslip.run(scene)
    assert not caplog.records
    own = warmslip.run(scene, laws={"bottom": Law(compliance=linear, friction=coulomb)})
    assert own.completed and np.abs(own.u - output.u).max() < 1e-13 and np.abs(output.u).max() > 1e-3
    assert (
        own.summary["functions"] == ["laws.bottom.compliance", "laws.bottom.friction"]
        and output.summary["functions"] == []
    )
    assert "slower" in caplog.text
    weaker = warmslip.run(scene, laws={"bottom": Law(friction=lambda p, s: (0.9 * MU * p, 0.9 * MU, 0.0))})
    assert np.abs(weaker.u - output.u).max() > 1e-6


def test_an_exponential_law_closes_its_books(small: Small) -> None:
    simulation = warmslip.Simulation(small(), laws={"bottom": Law(compliance=exponential)})
    for state, _ in simulation.steps():
        p, r = state.contact["pressure"], np.maximum(-state.contact["gap"], 0)
        assert np.abs(p - np.expm1(20 * r)).max() < 1e-11
    assert simulation.outcome == "completed" and p.max() > 1e-3


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        (Law(compliance=lambda r: (r, 1.0, r**2)), "third value is the integral of the first"),
        (Law(compliance=lambda r: (r, 1.0, r**2 / 2 + 3)), "it starts at 0"),
        (Law(compliance=lambda r: (r, 2.0, r**2 / 2)), "correct the second value"),
        (Law(compliance=lambda r: (1 / (1 + r), -1 / (1 + r) ** 2, math.log1p(r))), "a pressure that does not fall"),
        (Law(compliance=lambda r: (-r, -1.0, -(r**2) / 2)), "negative"),
        (Law(compliance=lambda r: (r, 1.0)), "three numbers"),
        (Law(compliance=lambda r: (math.nan, 1.0, 1.0)), "three finite numbers"),
        (Law(compliance=lambda r: "soft"), "three numbers"),
        (Law(friction=lambda p, s: (0.3 * p, 0.2, 0.0)), "correct the second value"),
        (Law(friction=lambda p, s: (0.3 * p / (1 + s), 0.3 / (1 + s), 0.0)), "correct the third value"),
        (Law(friction=lambda p, s: (-p, -1.0, 0.0)), "negative"),
    ],
)
def test_a_law_that_is_none_is_refused(small: Small, law: Law, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence) as refused:
        warmslip.run(small(), laws={"bottom": law})
    assert str(refused.value).startswith("laws.bottom.")


def test_a_law_needs_a_part_that_touches(small: Small) -> None:
    with pytest.raises(ValueError, match=r"laws.top: no contact part .* \(bottom\)"):
        warmslip.run(small(), laws={"top": Law(compliance=linear)})


def far(r: float) -> Sequence[float]:
    """A law that is one as far as it is tried before a run, to a hundredth of the body."""
    if r > 0.02:
        raise ArithmeticError("no data beyond 0.02")
    return linear(r)


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        (Law(compliance=far), "raised ArithmeticError('no data beyond 0.02')"),
        (Law(compliance=lambda r: linear(r) if r < 0.02 else (-1.0, 0.0, 0.0)), "which is negative"),
        (
            Law(compliance=lambda r: linear(r) if r < 0.02 else (0.05, 0.0, STIFF * r**2 / 2)),
            "the pressure falls from r = 0.",
        ),
        (
            Law(compliance=lambda r: linear(r) if r < 0.02 else (*linear(r)[:2], 0.45 * STIFF * r**2)),
            "is the integral of",
        ),
        (Law(friction=lambda p, s: coulomb(p, s) if not 1.5 < p < 9 else ()), "must give three numbers"),
        (Law(friction=lambda p, s: coulomb(p, s) if not 1.5 < p < 9 else (math.inf, 0.0, 0.0)), "three finite numbers"),
    ],
    ids=["raises", "negative", "falls", "energy", "nothing", "infinite"],
)
def test_a_law_that_fails_in_the_run_ends_it_with_the_place(
    small: Small, tmp_path: Path, law: Law, sentence: str
) -> None:
    pushed = {"loads__body": [0.0, -5.0], "time__steps": 8, "time__end": 8.0}
    scene = small(contact__stiffness=STIFF if law.compliance else 1e4, **pushed)
    result = warmslip.run(scene, laws={"bottom": law}, out=tmp_path)
    failure = result.summary["failure"]
    assert (
        result.outcome == "law_failed"
        and failure["reason"].startswith("laws.bottom.")
        and sentence in failure["reason"]
    )
    assert result.summary["steps"] == failure["step"] - 1
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as t:
        assert len(t.time) == failure["step"]  # the initial state and those before


def test_a_law_may_end_beyond_what_is_reached(small: Small) -> None:
    """No iterate asks for more than a little beyond the answer."""
    scene = small(contact__stiffness=STIFF, loads__body=[0.0, -1.0], time__steps=8, time__end=8.0)

    def ends(r: float) -> Sequence[float]:
        return linear(r) if r < 1.01 * reached else [math.exp(1e3)]

    simulation = warmslip.Simulation(scene, laws={"bottom": Law(compliance=linear)})
    reached = max(report.max_penetration for _, report in simulation.steps())
    assert simulation.outcome == "completed" and reached > 0
    result = warmslip.run(scene, laws={"bottom": Law(compliance=ends)})
    assert result.completed and np.array_equal(result.u, simulation.discretisation.field(simulation.stepper.u))


def test_what_is_no_law_is_refused(small: Small) -> None:
    with pytest.raises(ValueError, match="a Law needs a function"):
        Law()
    with pytest.raises(TypeError, match=r"Law\(friction=0.3\) is no function"):
        Law(friction=0.3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"laws\['bottom'\] is .* give a Law"):
        warmslip.run(small(), laws={"bottom": linear})  # type: ignore[dict-item]


def test_a_kink_is_no_wrong_derivative() -> None:
    Law(compliance=lambda r: (min(r, 1e-4), float(r < 1e-4), r**2 / 2 if r < 1e-4 else 1e-4 * r - 5e-9)).validate(
        "side", 1.0
    )


def test_a_law_is_that_of_its_part_alone() -> None:
    scene = warmslip.load("paper_mixed").override(**{"mesh.n": 4, "time.steps": 4})
    one = scene.resolved()["contact"]
    held = {"supports.displacement": ["top"], "supports.temperature": ["top"], "loads.body": [-3.0, -1.0]}
    parts = [one | {"stiffness": 100.0}, one | {"part": "left", "stiffness": STIFF}]
    scene = scene.override(contact=parts, **held)
    output, own = warmslip.run(scene), warmslip.run(scene, laws={"left": Law(compliance=linear)})
    assert np.abs(own.u - output.u).max() < 1e-13 and np.abs(output.u).max() > 1e-2


def test_kinks_on_round_numbers_and_energies_by_quadrature_are_laws(small: Small) -> None:
    """Limits stand at 1 or 0.1, tables at powers of ten, and scipy's quad knows the integral of a bent function to 1e-8."""
    for law in (
        Law(friction=lambda p, s: (0.3 * min(p, 1.0), 0.3 * (p < 1), 0.0)),
        Law(
            friction=lambda p, s: (
                (bent := 0.3 * min(1, 0.1 / (s + 1e-300))) and (bent * p, bent, 0.0 if s < 0.1 else -0.03 * p / s**2)
            )
        ),
        Law(compliance=lambda r: (*linear(r)[:2], linear(r)[2] * (1 + 4e-8 * math.sin(1e4 * r)))),
    ):
        assert warmslip.run(small(contact__stiffness=STIFF), laws={"bottom": law}).completed


def test_a_law_asked_far_away_still_knows_what_falls() -> None:
    """One huge value does not blind the watch, and what went wrong before a step is forgotten."""
    law = Law(compliance=lambda r: (math.exp(400 * r) - 1 if r < 0.013 or r > 0.1 else 44.0, 1.0, 1.0))
    watch = contact_laws.CheckedLaw.of("bottom", law, 1.0).compliance
    assert watch is not None
    for r in (0.12, 0.0125, 0.0135):
        watch(r)
    assert watch.violation is not None
    watch.reset()
    assert watch.violation is None


def test_an_overshooting_iterate_is_led_back(small: Small) -> None:
    """Newton asks this law at penetrations where it overflows; the answer lies where it does not."""
    stiff = Law(compliance=lambda r: (math.expm1(200 * r), 200 * math.exp(200 * r), math.expm1(200 * r) / 200 - r))
    pushed = {"loads__body": [0.0, -20.0], "time__steps": 2, "time__end": 10.0}
    result = warmslip.run(small(**pushed), laws={"bottom": stiff})
    assert result.completed and 1e-3 < result.summary["contact"]["max_penetration"] < 0.1


def test_how_exact_a_law_has_to_be() -> None:
    """An energy to 1e-6 of its neighbours', a derivative to 1e-3 at nine samples of ten; beyond, it is refused."""

    def near(error: float) -> str | None:
        law = Law(compliance=lambda r: (*linear(r)[:2], linear(r)[2] * (1 + error * (r > 0.01))))
        watch = contact_laws.CheckedLaw.of("bottom", law, 1.0).compliance
        assert watch is not None
        for r in (0.01, 0.01000001):
            watch(r)
        return watch.violation

    assert near(1e-7) is None and "is the integral of" in str(near(1e-5))

    def sloped(error: float, above: float, faster: float = 0.0) -> Law:
        return Law(friction=lambda p, s: (MU * p, MU * (1 + error * (p > above and s >= faster)), 0.0))

    sloped(5e-4, 0.0).validate("bottom", 1.0)
    sloped(0.5, 50.0, faster=0.5).validate("bottom", 1.0)  # at one pressure of nine, three speeds of nine
    for law in (sloped(5e-3, 0.0), sloped(0.5, 50.0)):
        with pytest.raises(ValueError, match="correct the second value"):
            law.validate("bottom", 1.0)
    with pytest.raises(ValueError, match="three finite numbers"):
        Law(friction=lambda p, s: (MU * p, MU, 0.0) if s > 0 else (math.nan, 0.0, 0.0)).validate("bottom", 1.0)
