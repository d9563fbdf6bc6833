"""What the package offers to Python: few names, laws and observers of one's own, states read in the loop."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Law, Scene, laws
from warmslip.export import export

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
    """The scale of a step asks for the tangent where the body would be without contact."""
    scene = small(contact__stiffness=STIFF, loads__body=[0.0, -1.0], time__steps=8, time__end=8.0)
    seen: list[float] = []

    def recorded(r: float) -> Sequence[float]:
        seen.append(r)
        return linear(r)

    def ends(r: float) -> Sequence[float]:
        return linear(r) if r < 1.01 * reached else [math.exp(1e3)]

    job = warmslip.Run(scene, laws={"bottom": Law(compliance=recorded)})
    reached = max(report.max_penetration for _, report in job.steps())
    assert job.outcome == "right" and max(seen) > 1.01 * reached > 0
    result = warmslip.run(scene, laws={"bottom": Law(compliance=ends)})
    assert result.right and np.array_equal(result.u, job.discretisation.field(job.stepper.u))


def test_what_is_no_law_is_refused(small: Small) -> None:
    with pytest.raises(ValueError, match="a Law needs a function"):
        Law()
    with pytest.raises(TypeError, match=r"Law\(friction=0.3\) is no function"):
        Law(friction=0.3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"laws\['bottom'\] is .* give a Law"):
        warmslip.run(small(), laws={"bottom": linear})  # type: ignore[dict-item]


def test_a_kink_is_no_wrong_derivative() -> None:
    Law(compliance=lambda r: (min(r, 1e-4), float(r < 1e-4), r**2 / 2 if r < 1e-4 else 1e-4 * r - 5e-9)).tried(
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


def wrong(x: np.ndarray, t: float) -> Any:
    raise KeyError("force")


def late(x: np.ndarray, t: float) -> Any:
    return 1 / (t - 0.5) if t < 0.6 else {}["force"]


FUNCTIONS = {
    "loads.body": {"body": wrong},
    "heat.source": {"source": wrong},
    "loads.traction.left": {"traction": {"left": wrong}},
    "loads.heat_flux.bottom": {"heat_flux": {"bottom": wrong}},
    "supports.displacement.top": {"displacement": {"top": wrong}},
    "supports.temperature.top": {"temperature": {"top": wrong}},
    "contact_traction": {"contact_traction": wrong},
    "contact_flux": {"contact_flux": wrong},
    "contact.gap": {"gap": wrong},
    "contact.heat_exchange.foundation_temperature": {"foundation_temperature": wrong},
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_load_that_raises_is_named_with_its_time(small: Small, name: str) -> None:
    scene = small()
    with pytest.raises(ValueError, match=r"the function raised KeyError\('force'\); correct it") as refused:
        warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), **FUNCTIONS[name]))
    assert str(refused.value).startswith(f"{name} at t = ") and "\n" not in str(refused.value)
    assert isinstance(refused.value.__cause__, KeyError)


@pytest.mark.parametrize("per_pressure", [0.0, 1.0])
def test_a_foundation_temperature_is_named_however_it_acts(small: Small, per_pressure: float) -> None:
    scene = small(contact__heat_exchange__conductance=1.0 - per_pressure)
    scene = scene.override(**{"contact.heat_exchange.per_pressure": per_pressure})
    with pytest.raises(ValueError, match=r"foundation_temperature at t = 0.25: the function raised KeyError"):
        warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), foundation_temperature=wrong))


@pytest.mark.parametrize(
    ("load", "words"),
    [
        (lambda x, t: None, "loads.body at t = 0.25: the function gave None"),
        (lambda x, t: ["much", "more"], "loads.body at t = 0.25: ['much', 'more'] is no array of numbers"),
        (lambda x, t: np.zeros(3), "loads.body must give shape"),
    ],
)
def test_a_load_that_gives_no_numbers_is_named(small: Small, load: Any, words: str) -> None:
    scene = small()
    with pytest.raises(ValueError, match=re.escape(words)):
        warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), body=load))


def test_a_load_that_raises_later_ends_the_run_with_its_name(small: Small) -> None:
    scene = small(time__steps=5)
    done = warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), source=late))
    assert (done.outcome, done.summary["steps"]) == ("data_not_finite", 2)
    assert done.summary["failure"]["reason"].startswith("heat.source at t = 0.6: the function raised KeyError('force')")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"scene": "x.toml"}, "scene: 'x.toml' is no Scene; read it with warmslip.load"),
        ({"scene": Path("x.toml")}, "read it with warmslip.load"),
        ({"scene": {"mesh": {"n": 4}}}, "scene: {'mesh': {'n': 4}} is no Scene; warmslip.load and"),
        (
            {"loads": {"body": [0.0, 1.0]}},
            "loads: {'body': [0.0, 1.0]} is no warmslip.Loads; write dataclasses.replace",
        ),
        ({"loads": wrong}, "loads: the function wrong is no warmslip.Loads"),
        ({"laws": linear}, "laws: the function linear is no dictionary; give laws by part"),
    ],
)
def test_arguments_of_another_kind_are_refused(small: Small, given: dict[str, Any], words: str) -> None:
    arguments = dict(given)
    scene = arguments.pop("scene", small())
    with pytest.raises(TypeError, match=re.escape(words)):
        warmslip.run(scene, **arguments)


def test_loads_of_another_kind_are_refused(small: Small) -> None:
    scene = small()
    loads = warmslip.Loads.of(scene)
    with pytest.raises(
        TypeError, match=re.escape("loads.traction: the function wrong is no dictionary; give it by part")
    ):
        replace(loads, traction=wrong)
    with pytest.raises(ValueError, match=r"loads.displacement: 'left' is not held \(top\); name it in the scene's"):
        warmslip.run(scene, loads=replace(loads, displacement={"left": [0.0, 1.0]}))  # which would do nothing
    with pytest.raises(ValueError, match=r"loads\.gap: a list of 2; give one for each of 1 contact parts"):
        warmslip.run(scene, loads=replace(loads, gap=[0.0, 1.0]))
    with pytest.raises(ValueError, match="backend 'fast' is unknown; use automatic, cholmod, petsc"):
        warmslip.run(scene, backend="fast")


def test_what_load_and_export_are_given(small: Small, tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="scene: 3 is neither a name of the library nor a path"):
        warmslip.load(3)  # type: ignore[arg-type]
    for overrides in ("mesh.n=8", {"mesh.n": 8}, [("mesh.n", 8)]):
        with pytest.raises(
            TypeError, match=re.escape("is no list of texts; write ['mesh.n=8'], or load(...).override")
        ):
            warmslip.load("paper_mixed", overrides)  # type: ignore[arg-type]
    warmslip.run(small(time__steps=1), out=tmp_path)
    with pytest.raises(TypeError, match=re.escape("fields: 'pressure' is no list; write ['pressure']")):
        export(tmp_path, tmp_path / "series", fields="pressure")
    with pytest.raises(TypeError, match=re.escape("times: 0.5 is no list; write [0.5]")):
        export(tmp_path, tmp_path / "series", times=0.5)  # type: ignore[arg-type]


def test_a_file_that_is_no_trajectory(small: Small, tmp_path: Path) -> None:
    warmslip.run(small(time__steps=1), out=tmp_path / "run")
    with pytest.raises(
        FileNotFoundError, match=r"nowhere.h5' is no file; give the trajectory.h5 that `warmslip run` wrote"
    ):
        warmslip.Trajectory(tmp_path / "nowhere.h5")
    with pytest.raises(FileNotFoundError, match=r"run' is no file; give '.*run/trajectory.h5'"):
        warmslip.Trajectory(tmp_path / "run")
    (tmp_path / "text.h5").write_text("no HDF5")
    with pytest.raises(ValueError, match="is damaged or no trajectory"):
        warmslip.Trajectory(tmp_path / "text.h5")
    stored = warmslip.Trajectory(tmp_path / "run/trajectory.h5")
    stored.close()
    for read in (
        lambda: stored.u,
        lambda: stored.time,
        lambda: stored.series("steps"),
        lambda: stored.contact("gap", 0),
    ):
        with pytest.raises(ValueError, match="is closed; read it inside its `with` block"):
            read()


def test_a_call_of_another_kind_leaves_an_earlier_run_as_it_is(small: Small, tmp_path: Path) -> None:
    warmslip.run(small(time__steps=1), out=tmp_path)
    with pytest.raises(TypeError, match=r"read it with warmslip\.load"):
        warmslip.run("scene.toml", out=tmp_path)  # type: ignore[arg-type]
    assert (tmp_path / "summary.json").exists()
    with pytest.raises(TypeError, match="observers: one function is given"):
        warmslip.run(small(), observers=lambda state, report: None)  # type: ignore[arg-type]


def test_what_a_load_may_not_be(small: Small) -> None:
    loads = warmslip.Loads.of(small())
    with pytest.raises(TypeError, match=r"loads.body: '-1' is a text; formulas stand in the scene"):
        replace(loads, body="-1")
    with pytest.raises(TypeError, match=r"loads.traction: 't' is a text"):
        replace(loads, traction={"left": "t"})
    for body in (-1.0, lambda x, t: -1.0):
        with pytest.raises(ValueError, match=r"loads\.body is one number, -1, where 2 are due; give one for each axis"):
            warmslip.run(small(), loads=replace(loads, body=body))
    with pytest.raises(ValueError, match=r"(?s)loads.body at t = .* is complex; give real numbers"):
        warmslip.run(small(), loads=replace(loads, body=lambda x, t: x * 1j))
    with pytest.raises(TypeError, match="observers: 3 is no function"):
        warmslip.run(small(), observers=[3])  # type: ignore[list-item]
    with pytest.raises(ValueError, match="resume: there is no folder to go on from; give out="):
        warmslip.run(small(), resume=True)


@pytest.mark.parametrize(
    ("without", "given"),
    [
        ("heat", {"source": 1e9}),
        ("heat", {"heat_flux": {"top": lambda x, t: x[:, 0]}}),
        ("motion", {"body": [0.0, -1.0]}),
        ("contact", {"gap": lambda x, t: x[:, 0]}),
    ],
)
def test_loads_that_no_field_takes_are_refused(without: str, given: dict[str, Any]) -> None:
    scene = {
        "heat": warmslip.load("quasistatic_punch"),
        "motion": warmslip.load("heat_slab"),
        "contact": warmslip.load("quasistatic_punch").override(contact=None),
    }[without]
    with pytest.raises(ValueError, match=rf"loads\.{next(iter(given))}: the scene has no \[.* nothing would take it"):
        warmslip.run(scene, loads=replace(warmslip.Loads.of(scene), **given))


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
        assert warmslip.run(small(contact__stiffness=STIFF), laws={"bottom": law}).right


def test_a_law_asked_far_away_still_knows_what_falls() -> None:
    """One huge value does not blind the watch, and what went wrong before a step is forgotten."""
    law = Law(compliance=lambda r: (math.exp(400 * r) - 1 if r < 0.013 or r > 0.1 else 44.0, 1.0, 1.0))
    watch = laws.Watched.of("bottom", law, 1.0).compliance
    assert watch is not None
    for r in (0.12, 0.0125, 0.0135):
        watch(r)
    assert watch.wrong is not None
    watch.forget()
    assert watch.wrong is None


def test_an_overshooting_iterate_is_led_back(small: Small) -> None:
    """Newton asks this law at penetrations where it overflows; the answer lies where it does not."""
    stiff = Law(compliance=lambda r: (math.expm1(200 * r), 200 * math.exp(200 * r), math.expm1(200 * r) / 200 - r))
    pushed = {"loads__body": [0.0, -20.0], "time__steps": 2, "time__end": 10.0}
    result = warmslip.run(small(**pushed), laws={"bottom": stiff})
    assert result.right and 1e-3 < result.summary["contact"]["max_penetration"] < 0.1


def test_how_exact_a_law_has_to_be() -> None:
    """An energy to 1e-6 of its neighbours', a derivative to 1e-3 at nine samples of ten; beyond, it is refused."""

    def near(error: float) -> str | None:
        law = Law(compliance=lambda r: (*linear(r)[:2], linear(r)[2] * (1 + error * (r > 0.01))))
        watch = laws.Watched.of("bottom", law, 1.0).compliance
        assert watch is not None
        for r in (0.01, 0.01000001):
            watch(r)
        return watch.wrong

    assert near(1e-7) is None and "is the integral of" in str(near(1e-5))

    def sloped(error: float, above: float, faster: float = 0.0) -> Law:
        return Law(friction=lambda p, s: (MU * p, MU * (1 + error * (p > above and s >= faster)), 0.0))

    sloped(5e-4, 0.0).tried("bottom", 1.0)
    sloped(0.5, 50.0, faster=0.5).tried("bottom", 1.0)  # at one pressure of nine, three speeds of nine
    for law in (sloped(5e-3, 0.0), sloped(0.5, 50.0)):
        with pytest.raises(ValueError, match="correct the second value"):
            law.tried("bottom", 1.0)
    with pytest.raises(ValueError, match="three finite numbers"):
        Law(friction=lambda p, s: (MU * p, MU, 0.0) if s > 0 else (math.nan, 0.0, 0.0)).tried("bottom", 1.0)
