"""Refusals of formulas, blocks, laws, regions and mesh files: one sentence, the key, the cure; and no input that crashes."""

from __future__ import annotations

import contextlib
import shutil
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import warmslip
from warmslip import SceneError, load
from warmslip.mesh import files
from warmslip.model.loads import Formula, Loads, evaluate
from warmslip.scene.expressions import Expression
from warmslip.scene.full import full_model
from warmslip.scene.reader import build

HARMFUL = [
    "__import__('os').system('true')",
    "open('x')",
    "x.__class__.__bases__",
    "(lambda: 1)()",
    "[a for a in (1, 2)]",
    "exec('1')",
    "x if t else y",
    "'text'",
    "f'{x}'",
    "x := 1",
    "a",
    "sin",
    "sin(1, 2)",
    "min(1)",
    "x < y < t",
    "1e999",
    "9**9**9**9**9",
    "1/0",
    "True",
    "",
    "1 +",
    "\x00",
    "(" * 3000,
    "-" * 1500 + "1",
    "-(x < 1)",
    "x @ y",
    "x[0]",
    "*x",
]


@pytest.mark.parametrize("text", HARMFUL, ids=range(len(HARMFUL)))
def test_what_is_no_formula_is_refused(text: str) -> None:
    with pytest.raises(
        ValueError, match=r"formula|unknown name|write where|no call|not a number|takes|write a < b|too large|evaluated"
    ):
        Expression(text)
    with pytest.raises(SceneError, match=r"contact\.gap"):
        load("paper_mixed").override(**{"contact.gap": text})


def test_formulas_are_what_numpy_says() -> None:
    x, t = np.random.default_rng(1).uniform(size=(20, 3)), 0.3
    a, b, c = x.T
    known = {
        "sin(x) * exp(-t) + 2 * y ** 2": np.sin(a) * np.exp(-t) + 2 * b**2,
        "where(x < 0.5 and y > 0.2, 1, z)": np.where((a < 0.5) & (b > 0.2), 1, c),
        "min(x, y, z) + max(x, t)": np.minimum(np.minimum(a, b), c) + np.maximum(a, t),
        "arctan2(y, x) - pi / 2": np.arctan2(b, a) - np.pi / 2,
        "abs(x - 0.5) % 0.1": np.abs(a - 0.5) % 0.1,
        "3": np.full(20, 3.0),
        "t": np.full(20, t),
        "(x < 0.5 or y < 0.5) * 2.5": ((a < 0.5) | (b < 0.5)) * 2.5,
    }
    for text, values in known.items():
        assert np.allclose(Expression(text)(x, t), values, rtol=1e-14, atol=0), text
    assert np.array_equal(Expression("z + x")(x[:, :2], t), a)  # z is zero in the plane


@settings(max_examples=400, deadline=None)
@given(st.text(alphabet="xyzt0123456789.+-*/%()<>=&|, sincoexpwhermaxlog_'\"[]{}:\\\n", max_size=60))
def test_any_text_is_a_formula_or_refused(text: str) -> None:
    try:
        value = Expression(text)(np.full((2, 2), 0.5), 1.0)
    except ValueError:
        return
    assert value.shape == (2,)


BAD: list[tuple[dict[str, Any], str]] = [
    ({"heat": None}, "supports.temperature: there is no heat in this scene"),
    ({"heat": None}, "contact.heat_exchange: there is no heat in this scene"),
    ({"contact.stiffness": None}, "contact.friction: friction without contact"),
    ({"contact.stiffness": None, "contact.heat_exchange": None}, "the part neither touches nor exchanges heat"),
    ({"contact.friction": None, "contact.friction_heating": {"share": 0.5}}, "heat of a friction that is not there"),
    ({"contact.friction_heating": {"share": 1.5}}, "contact.friction_heating.share = 1.5"),
    ({"contact.friction_heating": {"share": 0.5}, "time.coupling": "monolithic"}, "needs 'staggered' or 'lagged'"),
    ({"inertia": None, "elasticity": None, "viscosity": None, "heat": None}, "there is neither motion nor heat"),
    ({"inertia": None, "elasticity": None, "viscosity": None}, "loads.body: a body without elasticity"),
    ({"inertia": None, "supports.displacement": [], "contact.stiffness": 0.0}, "nothing holds the body"),
    ({"contact": [{"part": "bottom", "stiffness": 1.0}, {"part": "bottom", "stiffness": 2.0}]}, "has two laws"),
    ({"contact": [{"part": "bottom", "stiffness": -1.0}]}, "contact.0.stiffness = -1"),
    ({"contact": [{"part": "bottom", "stiffnes": 1.0}]}, "contact.0.stiffnes: unknown key; did you mean 'stiffness'?"),
    ({"contact.exponent": 0.5}, "contact.exponent = 0.5"),
    ({"contact.pressure_limit": 0.0}, "contact.pressure_limit = 0.0"),
    ({"contact.friction.kinetic": 0.1}, "kinetic and speed belong together"),
    ({"contact.friction.speed": 0.0}, "contact.friction.speed = 0.0"),
    ({"contact.friction.regularisation": float("nan")}, "contact.friction.regularisation"),
    ({"contact.friction.cohesion": -1.0}, "contact.friction.cohesion = -1"),
    ({"contact.heat_exchange.per_pressure": -1.0}, "contact.heat_exchange.per_pressure = -1"),
    ({"contact.gap": "x +"}, "contact.gap: 'x +' is not a formula"),
    ({"contact.gap": True}, "contact.gap: True is neither a number nor a formula"),
    ({"contact.gap": float("nan")}, "contact.gap: nan is not a finite number"),
    ({"loads.body": ["0", "q"]}, "loads.body.1: in 'q': unknown name 'q'"),
    ({"loads.heat_flux": {"left": 1.0}}, "loads.heat_flux.left: the part's temperature is given"),
    ({"loads.heat_flux": {"roof": 1.0}}, "loads.heat_flux: unknown boundary part 'roof'"),
    ({"supports.displacement": {"top": [0.0]}}, "supports.displacement.top"),
    ({"supports.displacement": {"top": [0.0, 0.0, 0.0]}}, "supports.displacement.top has 3 components"),
    ({"supports.temperature": {"top": "warm"}}, "supports.temperature.top"),
    ({"initial.velocity": ["t", 0.0]}, "initial.velocity.0: initial data cannot depend on t"),
    ({"initial.temperature": "t"}, "initial.temperature: initial data cannot depend on t"),
    ({"elasticity": {"tensor": [[1.0, 0.0], [0.0, 1.0]]}}, "tensor must be a 3 x 3 matrix in the plane"),
    ({"elasticity": {"tensor": np.eye(6).tolist()}}, "elasticity.tensor must be a 3 x 3 matrix"),
    ({"elasticity": {"tensor": np.diag([1.0, 1.0, -1.0]).tolist()}}, "it has a negative eigenvalue"),
    ({"elasticity": {"tensor": [[1.0, 2.0, 0], [0, 1.0, 0], [0, 0, 1.0]]}}, "tensor must be symmetric"),
    ({"elasticity.tensor": np.eye(3).tolist()}, "give either a full tensor or its constants"),
    ({"heat.conductivity": -1.0}, "heat.conductivity must not have a negative eigenvalue"),
    ({"heat.conductivity": "high"}, "heat.conductivity"),
    ({"heat.capacity": 0.0}, "heat.capacity = 0.0"),
    ({"regions": {"core": {"where": "x - 0.5"}}}, "regions.core.where: 'x - 0.5' is no condition; compare"),
    ({"regions": {"core": {"where": "x < 1", "haet": {}}}}, "regions.core.haet: unknown key; did you mean 'heat'?"),
    (
        {"regions": {"core": {"where": "x < 1", "heat": {"conductivity": 1.0, "source": 1.0}}}},
        "heat.source: unknown key",
    ),
    (
        {"contact.friction": {"coefficient": 0.1, "kinetic": 0.2, "speed": 1.0}},
        "kinetic = 0.2 exceeds coefficient = 0.1",
    ),
    ({"contact.gap": "t^2"}, "'^' is no power; write x ** 2"),
    ({"contact.gap": "1 if x < 1 else 2"}, "write where(condition, one, other)"),
    ({"supports.displacement": {"top": ["t^2", 0.0]}}, "supports.displacement.top.0: in 't^2'"),
    ({"regions": {"core": {}}}, "regions.core: unknown region; the mesh has none by name"),
    ({"regions": {"core": {"where": "x < t"}}}, "regions.core.where: a region cannot depend on t"),
    ({"regions": {"core": {"where": "x <"}}}, "regions.core.where: 'x <' is not a formula"),
    ({"elasticity": None, "regions": {"core": {"where": "x < 1", "elasticity": {"lame": [1.0, 1.0]}}}}, "has no table"),
    ({"mesh.grading": [1.0]}, "grading has 1 entries"),
    ({"mesh.file": "nowhere.msh"}, "a mesh from a file has no"),
    ({"mesh": {"file": "nowhere.msh"}}, "mesh file 'nowhere.msh' cannot be read"),
]


@pytest.mark.parametrize(("change", "words"), BAD, ids=[f"{i}: {words[:40]}" for i, (_, words) in enumerate(BAD)])
def test_refused_with_key_and_cure(change: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError) as refusal:
        load("paper_mixed").override(**change)
    assert words in str(refusal.value)


def test_one_line_for_one_formula() -> None:
    with pytest.raises(SceneError) as refusal:
        load("paper_mixed").override(**{"supports.displacement": {"top": ["t^2", 0.0]}})
    assert len(str(refusal.value).splitlines()) == 1


def test_keys_of_several_contact_parts() -> None:
    both = [{"part": "bottom", "stiffness": 10.0}, {"part": "left", "stiffness": 20.0}]
    scene = load("paper_mixed").override(contact=both, **{"supports.temperature": ["top"]})
    assert scene.override(**{"contact.1.gap": "x"}).contacts[1].gap == "x"
    assert load("paper_mixed", ["contact=[{part='bottom', stiffness=1.0}]", "contact.0.gap=0.5"]).contacts[0].gap == 0.5
    for key in ("contact.2.gap", "contact.bottom.gap", "contact.gap.x"):
        with pytest.raises(SceneError, match=r"contact has the parts 0 to 1; write contact\.0\.gap"):
            scene.override(**{key: 1.0})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"contact.gap": "x"}, "contact.gap: only constant data can be judged here"),
        ({"supports.displacement": {"top": ["t", 0.0]}}, "supports.displacement: only constant data"),
        ({"contact.friction.cohesion": 1.0}, "only Coulomb's law"),
        ({"contact": None}, "one contact part with a stiffness is needed here"),
    ],
)
def test_what_the_paper_s_model_has_not_is_said(change: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        full_model(load("paper_mixed").override(**change))


def test_a_formula_that_fails_at_some_time_keeps_what_was_computed(tmp_path: Path) -> None:
    scene = load("paper_mixed").override(
        **{"mesh.n": 4, "time.steps": 8, "loads.body": ["log(0.6 - t)", 0.0], "output.every": 1}
    )
    done = warmslip.run(scene, out=tmp_path)
    assert done.outcome == "data_not_finite"
    assert done.summary["failure"]["reason"].startswith("loads.body is not finite at t = 0.625")
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as t:
        assert t.time[-1] == 0.5


def test_constant_formulas_are_assembled_once() -> None:
    assert not Loads.of(load("paper_mixed").override(**{"loads.body": ["x", 0.0]})).body.of_time
    assert Formula((Expression("t"), Expression("x"))).of_time
    assert evaluate(Formula((Expression("x"),)), np.ones((3, 2)), 0.0, 1).shape == (3, 1)


def test_there_is_no_z_in_the_plane() -> None:
    keys = {"loads.body": ["z", 0.0], "contact.gap": "0.1 * z", "supports.displacement": {"top": ["z * t", 0.0]}}
    with pytest.raises(SceneError) as refused:
        load("paper_mixed").override(**keys)
    message = str(refused.value).splitlines()
    assert [line.split(":")[0] for line in message] == ["loads.body.0", "supports.displacement.top.0", "contact.gap"]
    assert all("has a z, and the body lies in the plane" in line for line in message)
    load("block_3d").override(**{"contact.gap": "0.1 * z"})


def test_one_contact_or_several(tmp_path: Path) -> None:
    (tmp_path / "both.toml").write_text("[contact]\npart = 'bottom'\n[[contact]]\npart = 'left'\n")
    with pytest.raises(SceneError, match=r"write \[\[contact\]\] for each"):
        load(tmp_path / "both.toml")


# ---- mesh files ------------------------------------------------------------------------------------------------------------


FLAT = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]])
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


def spoiled(tmp_path: Path, **change: Any) -> str:
    """A square of two triangles with named sides, changed."""
    mesh: dict[str, Any] = {
        "points": SQUARE,
        "cells": [("line", np.array([[0, 1]])), ("triangle", np.array([[0, 1, 2], [0, 2, 3]]))],
        "names": {"bottom": np.array([1, 1]), "body": np.array([2, 2])},
    }
    mesh |= change
    if all(kind != "line" for kind, _ in mesh["cells"]):
        mesh["names"] = {}
    tags = [np.full(len(data), 1 if kind == "line" else 2) for kind, data in mesh["cells"]]
    path = tmp_path / "mesh.msh"
    meshio.Mesh(
        mesh["points"],
        mesh["cells"],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=mesh["names"],
    ).write(path, file_format="gmsh22", binary=False)
    return str(path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"cells": [("triangle", np.array([[0, 1, 2], [0, 1, 3]]))]},
            "two cells overlap: they lie on one side of the facet of the nodes 1, 2; repair the mesh",
        ),
        ({"points": FLAT}, "the cell of the nodes 1, 2, 3 is flat; repair the mesh"),
        ({"cells": [("line", np.array([[0, 1]]))]}, "no cells; mesh the body"),
        (
            {"points": np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]])},
            "a surface in space, with z from 0 to 1",
        ),
        ({"names": {"bottom": [1, 1], "top": [7, 1], "body": [2, 2]}}, "the physical group 'top' of curves is empty"),
        ({"names": {"top": [7, 1]}}, "the physical group 1 of curves has no name, and 'top' has"),
        (
            {
                "points": np.vstack([[[0.0, 0, 0], [1, 0, 0], [1, 1, 0]], [[5.0, 5, 0], [6, 5, 0], [6, 6, 0]]]),
                "cells": [("triangle", np.array([[0, 1, 2], [3, 4, 5]]))],
            },
            "the body is in 2 pieces",
        ),
    ],
    ids=["overlap", "flat", "no cells", "not plane", "empty part", "no name", "two pieces"],
)
def test_a_faulty_mesh_is_refused_by_name(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    change = {
        key: {k: np.array(v) for k, v in value.items()} if key == "names" else value for key, value in change.items()
    }
    with pytest.raises(ValueError, match=words):
        files.read(spoiled(tmp_path, **change))


def test_a_mesh_numbered_the_other_way_round_is_turned(tmp_path: Path) -> None:
    turned = files.read(spoiled(tmp_path, cells=[("triangle", np.array([[1, 0, 2], [2, 0, 3]]))]))
    edges = turned.nodes[turned.cells[:, 1:]] - turned.nodes[turned.cells[:, :1]]
    assert (np.linalg.det(edges) > 0).all()


def test_the_mesh_is_part_of_the_digest(tmp_path: Path) -> None:
    plate = files.find("plate_with_hole.msh")
    shutil.copy(plate, tmp_path / "plate_with_hole.msh")
    shutil.copy(plate.with_suffix(".toml"), tmp_path / "own.toml")
    before = load(tmp_path / "own.toml").digest()
    text = (tmp_path / "plate_with_hole.msh").read_bytes()
    (tmp_path / "plate_with_hole.msh").write_bytes(text + b"\n$Comments\nother\n$EndComments\n")
    assert load(tmp_path / "own.toml").digest() != before


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=200), at=st.integers(0, 15000), cut=st.integers(0, 16000))
def test_random_bytes_in_a_mesh_never_crash(tmp_path: Path, data: bytes, at: int, cut: int) -> None:
    whole = files.find("plate_with_hole.msh").read_bytes()
    path = tmp_path / "random.msh"
    path.write_bytes((whole[:at] + data + whole[at + len(data) :])[:cut])
    with contextlib.suppress(ValueError):
        files.read(str(path))


KEYS = st.sampled_from(
    ["mesh", "time", "heat", "contact", "loads", "supports", "regions", "inertia", "n", "part", "gap"]
)
LEAVES = st.one_of(st.none(), st.booleans(), st.integers(-5, 5), st.floats(), st.text(max_size=8))
TREES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3), max_leaves=12
)


@settings(max_examples=300, deadline=None)
@given(st.dictionaries(KEYS, TREES, max_size=6))
def test_any_data_is_a_scene_or_refused(data: dict[str, Any]) -> None:
    with contextlib.suppress(SceneError):
        build(data)
