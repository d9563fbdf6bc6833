"""What the package offers to Python: few names, laws and observers of one's own, states read in the loop."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Law, Scene

Small = Callable[..., Scene]
STIFF, MU = 10.0, 0.4


def linear(r: float) -> Sequence[float]:
    return STIFF * r, STIFF, STIFF * r**2 / 2


def coulomb(pressure: float, speed: float) -> Sequence[float]:
    return MU * pressure, MU, 0.0


def exponential(r: float) -> Sequence[float]:
    """As rough surfaces have it."""
    return math.expm1(20 * r), 20 * math.exp(20 * r), math.expm1(20 * r) / 20 - r


def test_about_a_dozen_names_all_keyword_only_but_the_first() -> None:
    assert len(warmslip.__all__) == 12
    for name in ("run", "discretise", "Run"):
        _, *more = [p for p in inspect.signature(getattr(warmslip, name)).parameters.values() if p.name != "self"]
        assert all(p.kind is p.KEYWORD_ONLY for p in more), name
    with pytest.raises(TypeError):
        Law(linear)  # type: ignore[misc]


@pytest.mark.parametrize("quadrature", ["nodal", "gauss-2"])
def test_the_scenes_own_law_written_in_python_gives_the_same(
    small: Small, quadrature: str, caplog: pytest.LogCaptureFixture
) -> None:
    scene = small(contact__stiffness=STIFF, contact__friction__coefficient=MU, contact__quadrature=quadrature)
    told = warmslip.run(scene)
    assert not caplog.records
    own = warmslip.run(scene, laws={"bottom": Law(compliance=linear, friction=coulomb)})
    assert own.right and np.abs(own.u - told.u).max() < 1e-13 and np.abs(told.u).max() > 1e-3
    assert (
        own.summary["functions"] == ["laws.bottom.compliance", "laws.bottom.friction"]
        and told.summary["functions"] == []
    )
    assert "slower" in caplog.text
    weaker = warmslip.run(scene, laws={"bottom": Law(friction=lambda p, s: (0.9 * MU * p, 0.9 * MU, 0.0))})
    assert np.abs(weaker.u - told.u).max() > 1e-6


def test_an_exponential_law_closes_its_books(small: Small) -> None:
    job = warmslip.Run(small(), laws={"bottom": Law(compliance=exponential)})
    for state, _ in job.steps():
        p, r = state.contact["pressure"], np.maximum(-state.contact["gap"], 0)
        assert np.abs(p - np.expm1(20 * r)).max() < 1e-11
    assert job.outcome == "right" and p.max() > 1e-3


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        (Law(compliance=lambda r: (r, 1.0, r**2)), "third value is the integral of the first"),
        (Law(compliance=lambda r: (r, 1.0, r**2 / 2 + 3)), "it starts at 0"),
        (Law(compliance=lambda r: (r, 2.0, r**2 / 2)), "correct the second value"),
        (Law(compliance=lambda r: (1 / r, -1 / r**2, math.log(r))), "must not"),
        (Law(compliance=lambda r: (-r, -1.0, -(r**2) / 2)), "negative"),
        (Law(compliance=lambda r: (r, 1.0)), "three finite numbers"),
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


def test_a_kink_is_no_wrong_derivative() -> None:
    Law(compliance=lambda r: (min(r, 1e-4), float(r < 1e-4), r**2 / 2 if r < 1e-4 else 1e-4 * r - 5e-9)).check(
        "side", 1.0
    )


def test_states_are_read_in_the_loop(small: Small) -> None:
    job = warmslip.Run(small())
    states = []
    for state, report in job.steps():
        assert state.u.shape == state.w.shape == (25, 2) and state.theta.shape == (25,)
        assert state.stress.shape == (32, 2, 2) and state.mises.shape == (32,)
        pressing = state.contact["pressure"] @ np.asarray(job.discretisation.surface.weights)
        assert pressing == pytest.approx(report.normal_force, rel=1e-12)
        states.append(state)
    assert [state.step for state in states] == [1, 2, 3, 4]
    assert np.abs(states[0].u - states[3].u).max() > 1e-6  # kept, as it was read
    late = warmslip.Run(small())
    first, *_ = [state for state, _ in late.steps()]
    with pytest.raises(RuntimeError, match="not read before the next step"):
        _ = first.u


def test_observers_see_every_step(small: Small) -> None:
    seen: list[tuple[int, float, float]] = []
    done = warmslip.run(
        small(), observers=[lambda state, report: seen.append((state.step, state.time, report.normal_force))]
    )
    assert [step for step, *_ in seen] == [1, 2, 3, 4]
    assert seen[-1][1:] == (1.0, done.summary["contact"]["normal_force"])


def test_operators_and_factors_are_petsc_objects(small: Small) -> None:
    job = warmslip.Run(small())
    right = job.discretisation.operators.elasticity.createVecRight()
    out = right.duplicate()
    right.set(1.0)
    job.stepper.momentum_factor.solve(right, out)
    assert out.norm() > 0


def test_a_trajectory_as_xarray(small: Small, tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    done = warmslip.run(small(), out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        data = stored.xarray()
    assert dict(data.sizes) == {"time": 5, "node": 25, "axis": 2}
    assert np.array_equal(data.u.isel(time=-1).values, done.u)
    assert float(data.theta.sel(time=1.0)[np.argmax(done.theta)]) == done.theta.max()


def test_resultants_of_every_part(tmp_path: Path) -> None:
    scene = warmslip.load("paper_mixed").override(**{"mesh.n": 4, "time.steps": 4})
    one = scene.resolved()["contact"]
    two: Any = [one, one | {"part": "left"}]
    held = {"supports.displacement": ["top"], "supports.temperature": ["top"], "loads.body": [-3.0, -1.0]}
    done = warmslip.run(scene.override(contact=two, **held), out=tmp_path)
    parts, contact = done.summary["contact"]["parts"], done.summary["contact"]
    pressing = [parts["normal_force bottom"], parts["normal_force left"]]
    assert sum(pressing) == pytest.approx(contact["normal_force"], rel=1e-12) and min(pressing) > 0
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        at, friction = stored.series("contact"), stored.series("steps")["friction_traction"][-1]
    on_body = [sum(parts[f"friction_{axis} {part}"] for part in ("bottom", "left")) for axis in "xy"]
    assert on_body == pytest.approx(friction, rel=1e-9) and max(map(abs, on_body)) > 1e-3
    assert set(at["part"]) == {0, 1}
    assert (at["normals"][at["part"] == 1] == [-1, 0]).all()


def test_a_law_is_that_of_its_part_alone() -> None:
    scene = warmslip.load("paper_mixed").override(**{"mesh.n": 4, "time.steps": 4})
    one = scene.resolved()["contact"]
    held = {"supports.displacement": ["top"], "supports.temperature": ["top"], "loads.body": [-3.0, -1.0]}
    parts = [one | {"stiffness": 100.0}, one | {"part": "left", "stiffness": STIFF}]
    scene = scene.override(contact=parts, **held)
    told, own = warmslip.run(scene), warmslip.run(scene, laws={"left": Law(compliance=linear)})
    assert np.abs(own.u - told.u).max() < 1e-13 and np.abs(told.u).max() > 1e-2
