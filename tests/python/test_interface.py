"""What the package offers to Python: few names, states read in the loop, observers, and what it refuses to be given."""

from __future__ import annotations

import inspect
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Law, Scene
from warmslip.io.paraview import export

Small = Callable[..., Scene]


def function(x: Any, t: Any = 0.0) -> Any:
    """In the place of something else."""
    return x


def test_about_a_dozen_names_all_keyword_only_but_the_first() -> None:
    assert len(warmslip.__all__) == 14
    for name in ("run", "discretise", "Simulation"):
        _, *more = [p for p in inspect.signature(getattr(warmslip, name)).parameters.values() if p.name != "self"]
        assert all(p.kind is p.KEYWORD_ONLY for p in more), name
    with pytest.raises(TypeError):
        Law(function)  # type: ignore[misc]


def test_states_are_read_in_the_loop(small: Small) -> None:
    simulation = warmslip.Simulation(small())
    states = []
    for state, report in simulation.steps():
        assert state.u.shape == state.w.shape == (25, 2) and state.theta.shape == (25,)
        assert state.stress.shape == (32, 2, 2) and state.mises.shape == (32,)
        pressing = state.contact["pressure"] @ np.asarray(simulation.discretisation.surface.weights)
        assert pressing == pytest.approx(report.normal_force, rel=1e-12)
        states.append(state)
    assert [state.step for state in states] == [1, 2, 3, 4]
    assert np.abs(states[0].u - states[3].u).max() > 1e-6  # kept, as it was read
    late = warmslip.Simulation(small())
    first, *_ = [state for state, _ in late.steps()]
    with pytest.raises(RuntimeError, match="not read before the next step"):
        _ = first.u


def test_a_stored_state_is_the_one_of_the_loop(small: Small, tmp_path: Path) -> None:
    seen = []
    names = ("u", "w", "theta", "stress", "stress_zz", "mises", "nodal_stress")

    def look(state: warmslip.State, _: object) -> None:
        seen.append({name: getattr(state, name) for name in names} | {"pressure": state.contact_on().pressure})

    warmslip.run(small(), out=tmp_path, observers=[look])
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        state, start = stored.state(0.51), stored.state(0.0)
        assert stored.state().discretisation is state.discretisation
    assert (state.step, state.time, start.step) == (2, 0.5, 0)
    for name in names:
        assert np.allclose(getattr(state, name), seen[1][name], rtol=1e-10, atol=1e-13), name
    assert repr(state).startswith("<StoredState: step 2, t = 0.5, fields displacement, velocity, temperature")
    with pytest.raises(ValueError, match="start of the run, where no contact forces"):
        start.contact_on()
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        assert np.array_equal(stored.state(0.5).contact_on("bottom").pressure, seen[1]["pressure"])
        with pytest.raises(ValueError, match="from t = 0 to 1, not at 2"):
            stored.state(2.0)


def test_observers_see_every_step(small: Small) -> None:
    seen: list[tuple[int, float, float]] = []
    done = warmslip.run(
        small(), observers=[lambda state, report: seen.append((state.step, state.time, report.normal_force))]
    )
    assert [step for step, *_ in seen] == [1, 2, 3, 4]
    assert seen[-1][1:] == (1.0, done.summary["contact"]["normal_force"])


def test_stress_at_the_nodes_is_the_mean_of_the_cells_around(small: Small) -> None:
    """Of a linear function at the centroids the mean over a symmetric patch is its value at the node; sums are kept."""
    simulation = warmslip.Simulation(small())
    d = simulation.discretisation
    state, _ = next(simulation.steps())
    x, cells = np.asarray(d.mesh.nodes), np.asarray(d.mesh.cells)
    centroids = x[cells].mean(axis=1)
    inner = np.flatnonzero((np.abs(x - 0.5) < 0.49).all(axis=1))
    assert np.allclose(d.nodal(centroids)[inner], x[inner])
    assert d.volumes.sum() == pytest.approx(1.0) and np.allclose(d.nodal(np.ones(len(cells))), 1.0)
    corner = np.flatnonzero((x == [1.0, 0.0]).all(axis=1))
    around = np.flatnonzero((cells == corner).any(axis=1))
    assert np.allclose(state.nodal_stress[corner[0]], state.stress[around].mean(axis=0))
    graded = warmslip.discretise(small(mesh__grading=[30.0, 1.0]))
    values, node = np.arange(32.0), 12
    around = (np.asarray(graded.mesh.cells) == node).any(axis=1)
    expected = (graded.volumes * values)[around].sum() / graded.volumes[around].sum()
    assert graded.nodal(values)[node] == pytest.approx(expected, rel=1e-12)
    assert np.allclose(warmslip.von_mises(state.stress, state.stress_zz), state.mises)
    with pytest.raises(ValueError, match=r"stress: the shape is \(32,\)"):
        warmslip.von_mises(state.mises)


def test_operators_and_factors_are_petsc_objects(small: Small) -> None:
    simulation = warmslip.Simulation(small())
    right = simulation.discretisation.operators.elasticity.createVecRight()
    out = right.duplicate()
    right.set(1.0)
    simulation.stepper.momentum_factor.solve(right, out)
    assert out.norm() > 0


def test_a_trajectory_as_xarray(small: Small, tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    done = warmslip.run(small(), out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        data = stored.xarray()
        contact, steps = stored.contact_on(time=0.5), stored.series("steps")
        balances = stored.series("balances")
    assert dict(data.sizes) == {"time": 5, "node": 25, "axis": 2, "step": 4, "point": 5}
    here = data.sel(step=0.5)
    for name in ("pressure", "traction", "slip", "gap", "status", "friction_bound"):
        assert np.array_equal(here[f"contact_{name}"], getattr(contact, name)), name
    assert np.array_equal(here.arc_length, contact.arc_length) and set(here.part.values) == {"bottom"}
    assert np.array_equal(data.normal_force, steps["normal_force"])
    assert np.array_equal(data.balance_viscous, balances["viscous"])
    total = float((here.contact_pressure * here.contact_weight).sum())
    assert total == pytest.approx(float(here.normal_force), rel=1e-12)
    assert np.array_equal(data.u.isel(time=-1).values, done.u)
    assert float(data.theta.sel(time=1.0)[np.argmax(done.theta)]) == done.theta.max()


@pytest.mark.parametrize("scene", ["heat_slab", "block_3d"])
def test_of_any_run_an_xarray(scene: str, tmp_path: Path) -> None:
    pytest.importorskip("xarray")
    keys = ["time.steps=2"] if scene == "heat_slab" else ["time.steps=2", "mesh.n=2"]
    warmslip.run(warmslip.load(scene, keys), out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        data = stored.xarray()
    assert ("contact_traction" in data) == (scene == "block_3d") and "arc_length" not in data
    if scene == "block_3d":
        assert data.contact_traction.dims == ("step", "point", "axis")


@pytest.mark.parametrize("more", [{}, {"error": 0.3}])
def test_progress_is_that_of_the_command(small: Small, monkeypatch: pytest.MonkeyPatch, more: dict[str, Any]) -> None:
    from rich.console import Console

    from warmslip.simulation import progress

    screen = io.StringIO()
    monkeypatch.setattr(progress, "console", Console(file=screen, force_terminal=True, width=120))
    done = warmslip.run(small(), progress=True, **more)
    assert f"{done.summary['steps']}/{done.summary['steps']}" in screen.getvalue() and "stick" in screen.getvalue()
    before = len(screen.getvalue())
    warmslip.run(small(), progress=False)
    assert len(screen.getvalue()) == before


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
        ({"loads": function}, "loads: the function function is no warmslip.Loads"),
        ({"laws": function}, "laws: the function function is no dictionary; give laws by part"),
    ],
)
def test_arguments_of_another_kind_are_refused(small: Small, given: dict[str, Any], words: str) -> None:
    arguments = dict(given)
    scene = arguments.pop("scene", small())
    with pytest.raises(TypeError, match=re.escape(words)):
        warmslip.run(scene, **arguments)


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
