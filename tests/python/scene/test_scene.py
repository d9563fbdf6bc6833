"""What a scene refuses, and that it says so in one sentence a problem, with the key; what overrides do."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from warmslip.scene.errors import SceneError
from warmslip.scene.reader import build, library, load
from warmslip.scene.scene import Scene

REFUSED = [
    ("mesh.m=8", "mesh.m: unknown key"),
    ("mesh.diagnal='left'", "did you mean 'diagonal'"),
    ("colour='blue'", "colour: unknown key"),
    ("contact.friction.mu=0.1", "contact.friction.mu: unknown key"),
    ("mesh.n=0", "mesh.n"),
    ("mesh.n=2.5", "mesh.n"),
    ("mesh.n=[4]", "n has 1 entries"),
    ("mesh.lengths=[1.0,-1.0]", "mesh.lengths.1"),
    ("mesh.diagonal='up'", "mesh.diagonal"),
    ("mesh.shape='ball'", "mesh.shape"),
    ("mesh=4", "mesh"),
    ("time.end=0", "time.end"),
    ("time.end=inf", "time.end: inf is not a finite number"),
    ("time.end=1e-320", "too short to divide by"),
    ("time.steps=0", "time.steps = 0"),
    ("time.steps=-3", "time.steps = -3"),
    ("time.steps=1.5", "time.steps = 1.5"),
    ("time.steps='many'", "time.steps"),
    ("time.coupling='loose'", "'staggered', 'lagged' or 'monolithic'"),
    ("inertia.density=-1", "inertia.density = -1"),
    ("inertia.density=nan", "inertia.density: nan is not a finite number"),
    ("elasticity.young=-2", "elasticity.young = -2"),
    ("elasticity.poisson=1.5", "poisson must lie between -1 and 1"),
    ("viscosity.lame=[1.0]", "viscosity.lame"),
    ("elasticity={young=2.0, poisson=0.6, assumption='plane_strain'}", "poisson must lie between -1 and 0.5"),
    ("viscosity.lame=[-10.0,5.0]", "viscosity: the tensor must not be negative"),
    ("viscosity.lame=[10.0,-5.0]", "viscosity: the tensor must not be negative"),
    ("viscosity.young=1.0", "viscosity: give either lame or young"),
    ("heat.conductivity=[[1.0,2.0],[0.0,1.0]]", "heat.conductivity must be symmetric"),
    ("heat.conductivity=[[1.0,2.0],[2.0,1.0]]", "heat.conductivity must not have a negative eigenvalue"),
    ("heat.conductivity=[[inf,0.0],[0.0,1.0]]", "heat.conductivity.0.0"),
    ("heat.expansion.tensor=[[1.0,2.0],[0.0,1.0]]", "heat.expansion.tensor must be symmetric"),
    ("heat.heating.tensor=[[1.0,nan],[nan,1.0]]", "heat.heating.tensor.0.1"),
    ("heat.source='warm'", "heat.source"),
    ("loads.body=[0.0,nan]", "loads.body.1"),
    ("loads.body=[0.0,0.0,-1.0]", "loads.body has 3 components; a square needs 2"),
    ("loads.traction.roof=[0.0,1.0]", "unknown boundary part 'roof'; a square has left, right, bottom, top"),
    ("loads.traction.left=[0.0,inf]", "loads.traction.left.1"),
    ("supports.displacement=['roof']", "supports.displacement: unknown boundary part 'roof'"),
    ("supports.displacement=['bottom']", "'bottom' is the contact part and cannot be held"),
    ("supports.temperature=['bottom']", "'bottom' is the contact part and cannot be held"),
    ("contact.part='floor'", "contact.part: unknown boundary part 'floor'"),
    ("contact.stiffness=-1", "contact.stiffness = -1"),
    ("contact.stiffness=inf", "contact.stiffness: inf is not a finite number"),
    ("contact.stiffness='stiff'", "contact.stiffness"),
    ("contact.stiffness='1e4'", "contact.stiffness"),
    ("inertia.density=true", "inertia.density"),
    ("contact.gap=nan", "contact.gap"),
    ("contact.quadrature='simpson'", "contact.quadrature"),
    ("contact.quadrature='gauss-9'", "contact.quadrature"),
    ("contact.friction.coefficient=-0.1", "contact.friction.coefficient = -0.1"),
    ("contact.friction.coefficient=nan", "contact.friction.coefficient"),
    ("contact.heat_exchange.conductance=-1", "contact.heat_exchange.conductance = -1"),
    ("contact.heat_exchange.foundation_temperature=-inf", "contact.heat_exchange.foundation_temperature"),
    ("initial.velocity=[1.0,nan]", "initial.velocity.1"),
    ("output.every=0", "output.every = 0"),
    ("loads.body.x=1", "'loads.body' is a value, not a table"),
    ("=3", "is no override"),
    ("mesh", "is no override"),
]


@pytest.mark.parametrize(("override", "words"), REFUSED, ids=[o for o, _ in REFUSED])
def test_refuses(override: str, words: str) -> None:
    with pytest.raises(SceneError) as refusal:
        load("paper_mixed", [override])
    assert words in str(refusal.value)
    assert all(line.strip() for line in str(refusal.value).splitlines())


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["inertia.density=0", "supports.displacement=[]", "contact.stiffness=0"], "nothing holds the body"),
        (["inertia.density=0", "viscosity.lame=[0.0,0.0]", "elasticity.young=0"], "there is no momentum operator"),
        (["mesh.shape='cube'", "mesh.diagonal='crisscross'"], "exists for shape 'square' only"),
        (["mesh.shape='cube'"], "plane_stress has no meaning in a cube"),
        (["mesh.shape='cube'"], "loads.body has 2 components; a cube needs 3"),
    ],
)
def test_refuses_what_does_not_fit_together(overrides: list[str], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        load("paper_mixed", overrides)


def test_all_problems_at_once() -> None:
    with pytest.raises(SceneError) as refusal:
        load("paper_mixed", ["inertia.density=-1", "time.steps=0", "mesh.m=3"])
    lines = str(refusal.value).splitlines()
    assert len(lines) == 3
    assert {line.split(":")[0].split(" =")[0] for line in lines} == {"inertia.density", "time.steps", "mesh.m"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "cannot read scene"),
        ("mesh = {", "is not valid TOML"),
        ("", "mesh: missing; add it"),
        (b"\xff\xfe\x00", "not a text file"),
    ],
)
def test_refuses_files(tmp_path: Path, text: str | bytes | None, words: str) -> None:
    path = tmp_path / "scene.toml"
    if text is not None:
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(SceneError, match=words):
        load(path)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("stiffness = 0,5", "is not valid TOML"),
        ("stiffness = -1,5e3 # soft", "(at line 10, column 15); correct that line (decimals take a point)"),
        ("stiffness = 0,05", "decimals take a point"),
        ("friction = { coefficient = 0,3 }", "decimals take a point"),
        ("gap = [1,05, 2]", "decimals take a point"),
        ("stiffness = '0,5'", "contact.stiffness = '0,5'"),
        ("gap = '0,5 * x'", "contact.gap: in '0,5 * x': a comma stands between the arguments of a function only"),
        ("gap = 'x-0,05'", "is not a formula"),
        ("gap = 'max(1,2) + 0,5'", "a decimal takes a point"),
        ("gap = 'max(0,1'", "contact.gap: 'max(0,1' is not a formula"),
        ("stiffness = 05", "is not valid TOML"),
        ("stiffness = 1,", "is not valid TOML"),
        ("gap = '(x, 1)'", "a decimal takes a point"),
    ],
)
def test_a_decimal_comma_is_refused(tmp_path: Path, line: str, words: str) -> None:
    tables = (
        "mesh.n = 4",
        "time.steps = 1",
        "[elasticity]",
        "lame = [1.0, 1.0]",
        "[supports]",
        "displacement = ['top']",
    )
    path = tmp_path / "scene.toml"
    path.write_text("\n".join([*tables, "", "[contact]", "part = 'bottom'", line, "exponent = 1.5"]))
    with pytest.raises(SceneError) as refusal:
        load(path)
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "override",
    [
        "contact.stiffness=0,5",
        "contact.gap=0,05",
        "initial.velocity=[0.0,-1,05]",
        "contact.friction={coefficient=0,3}",
        "mesh.n=8,8",
    ],
)
def test_a_decimal_comma_in_an_override_is_refused(override: str) -> None:
    with pytest.raises(SceneError) as refusal:
        load("paper_mixed", [override])
    assert str(refusal.value).startswith(override.partition("=")[0])
    assert load("paper_mixed", ["title=1,5 m", "contact.gap=max(0,5*x)"]).title == "1,5 m"


def test_a_contact_part_is_named_by_its_number() -> None:
    one = load("paper_mixed")
    part = one.resolved()["contact"]
    free = {"supports.displacement": ["top"], "supports.temperature": ["top"], "loads.traction": {}}
    two = one.override(contact=[part, part | {"part": "left"}], **free)
    for key, cure in {
        "contact.stiffness": "contact.0.stiffness",
        "contact.friction.coefficient": "contact.0.friction.coefficient",
        "contact.2.friction.coefficient": "contact.0.friction.coefficient",
        "contact.left.stiffness": "contact.1.stiffness",
        "contact.0": "contact.0.KEY",
    }.items():
        with pytest.raises(SceneError) as refusal:
            two.override(**{key: 0.1})
        assert str(refusal.value) == f"{key}: contact has the parts 0 to 1; write {cure}"
    assert two.override(**{"contact.1.friction.coefficient": 0.1}).contacts[1].friction.coefficient == 0.1
    with pytest.raises(SceneError, match=r"there is one contact part; write contact\.friction\.coefficient"):
        one.override(**{"contact.0.friction.coefficient": 0.1})


def test_library_scenes_load_and_say_what_they_are() -> None:
    assert {f"paper_{r}" for r in ("printed", "mixed", "isotropic", "consistent")} | {"block_3d"} <= set(library())
    for name in library():
        scene = load(name)
        assert scene.title
        assert build(scene.model_dump(mode="json", exclude_none=True)) == scene


def test_the_paper_has_its_data() -> None:
    ones, identity = [[1.0, 1.0], [1.0, 1.0]], [[1.0, 0.0], [0.0, 1.0]]
    minus = [[-1.0, -1.0], [-1.0, -1.0]]
    expected = {
        "printed": (ones, ones, ones),
        "mixed": (identity, ones, ones),
        "isotropic": (identity,) * 3,
        "consistent": (identity, ones, minus),
    }
    for reading, tensors in expected.items():
        s = load(f"paper_{reading}")
        assert (s.heat.conductivity, s.heat.expansion.tensor, s.heat.heating.tensor) == tensors
        lam, mu = s.elasticity.pair(2)
        assert math.isclose(lam, 2 * 0.1 / (1 - 0.01), rel_tol=1e-15)
        assert math.isclose(2 * mu, 2 / 1.1, rel_tol=1e-15)
        assert s.viscosity.pair(2) == (10.0, 5.0)
        assert (s.inertia.density, s.time.end, s.contact.stiffness, s.contact.gap) == (1.0, 1.0, 1e4, 0.0)
        assert (s.contact.friction.coefficient, s.contact.heat_exchange.conductance) == (0.2, 1.0)
        assert (s.loads.body, s.loads.traction) == ([0.0, -1.0], {"left": [1.4, 0.4], "right": [-0.8, 0.4]})
        assert (s.time.coupling, s.contact.quadrature, s.mesh.diagonal) == ("staggered", "nodal", "right")


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"contact.velocity": [0.1]}, r"contact.velocity = \[0.1\] has too few entries; give at least 2$"),
        ({"loads.body": [0.0] * 4}, r"loads.body = .* has too many entries; give at most 3$"),
        (
            {"contact.velocity": 0.1},
            r"contact.velocity = 0.1 is no list; give an entry for each axis, as in \[0.0, 0.1\]",
        ),
        ({"loads.body": 3}, r"loads.body = 3 is no list; give an entry for each axis, as in \[0.0, 3\]"),
        ({"supports.displacement": 0}, r"supports.displacement = 0 names no part; write \[\"top\"\], or { top = ... }"),
        (
            {"supports.displacement": {"top": "free"}},
            r"top = 'free'; write what each axis is held at, as in \[0.0, \"free\"\]",
        ),
        ({"supports.displacement": {"top": {"nromal": 0.0}}}, "top.nromal: unknown key; did you mean 'normal'?"),
        ({"supports.displacement": {"top": {"normal": 0.0, "x": 1}}}, "top.x: unknown key; the keys here are normal"),
        (
            {"supports.points": {"0": {"at": [0.0, 0.0]}}},
            r"supports.points is a list of tables; write \[\[supports.points\]\]",
        ),
        ({"supports.springs": {"left": {"stifness": 1.0}}}, "did you mean 'stiffness'"),
        (
            {"supports.springs": {"left": {"k": 1.0}}},
            "the keys here are damping, normal_damping, normal_stiffness, stiffness",
        ),
    ],
)
def test_lists_and_free_names(small: Callable[..., Scene], tables: dict[str, Any], words: str) -> None:
    with pytest.raises(SceneError, match=words):
        small().override(**tables)


def test_a_scene_does_not_change(small: Callable[..., Scene]) -> None:
    scene = small()
    for table, name in ((scene, "title"), (scene.mesh, "n")):
        with pytest.raises(AttributeError, match=f"a scene does not change; scene.override with '{name}'"):
            setattr(table, name, 3)
    assert scene.mesh.n == 4


def test_an_override_leaves_what_it_is_given(small: Callable[..., Scene]) -> None:
    """A table among the values stays as it is when a later key goes into it."""
    table = {"young": 3.0, "poisson": 0.2, "assumption": "plane_strain"}
    given = dict(table)
    scene = small().override(**{"elasticity": table, "elasticity.young": 5.0})
    assert scene.elasticity is not None and scene.elasticity.young == 5.0
    assert table == given


def test_overrides(small: Callable[..., Scene]) -> None:
    s = load(
        "paper_mixed",
        ["mesh.n=64", "time.coupling=lagged", "loads.traction.left=[1.0, 2.0]", "initial.velocity=[0.0,1.0]"],
    )
    assert (s.mesh.n, s.time.coupling, s.loads.traction["left"], s.initial.velocity) == (
        64,
        "lagged",
        [1.0, 2.0],
        [0.0, 1.0],
    )
    assert s.override(**{"mesh.n": 8}).mesh.n == 8
    assert s.mesh.n == 64
    assert s.override(**{"mesh.n": 8}).digest() != s.digest() == s.override(**{"mesh.n": 64}).digest()
    with pytest.raises(SceneError, match=r"mesh\.size"):
        small(mesh__size=3)


def test_files_mean_what_the_library_means(tmp_path: Path) -> None:
    scene = load("block_3d")
    path = tmp_path / "mine.toml"
    path.write_text(tomli_w.dumps(scene.model_dump(mode="json", exclude_none=True)))
    assert load(path) == scene
    assert load(str(path), ["mesh.n=2"]).mesh.counts == [2, 2, 2]


def test_schema_forbids_what_scenes_forbid() -> None:
    schema: dict[str, Any] = json.loads(json.dumps(Scene.model_json_schema()))
    tables = [schema, *schema["$defs"].values()]
    assert all(table["additionalProperties"] is False for table in tables)
    assert set(schema["required"]) <= set(load("paper_mixed").resolved())


def test_a_list_is_given_as_a_whole() -> None:
    with pytest.raises(SceneError, match=r"give the whole list, loads.body=\[...\]"):
        load("paper_mixed", ["loads.body.1=2"])
    assert load("paper_mixed").override(**{"mesh.n": np.int64(4), "loads.body": np.zeros(2)}).mesh.n == 4


@pytest.mark.parametrize(
    "tables",
    [
        {"mesh": {"n": "x"}, "time": {}, "heat": {"conductivity": 1.0}},
        {"mesh": {"n": 4}, "time": {}, "heat": {"conductivitie": 1.0}},
        {"mesh": 3},
        {"mesh": {"n": 4}, "time": {}, "supports": {"temperature": ["lid"]}, "heat": {"conductivity": 1.0}},
    ],
)
def test_every_way_to_a_scene_refuses_with_the_same_words(tables: dict[str, Any]) -> None:
    """The constructor and the two readers that the class inherits."""
    ways = (
        lambda: Scene(**tables),
        lambda: Scene.model_validate(tables),
        lambda: Scene.model_validate_json(json.dumps(tables)),
        lambda: build(tables),
    )
    said = set()
    for way in ways:
        with pytest.raises(SceneError) as refused:
            way()
        said.add(str(refused.value))
    assert len(said) == 1 and "validation error" not in said.pop()
    good = {"mesh": {"n": 4}, "time": {}, "heat": {"conductivity": 1.0}}
    assert Scene.model_validate(good) == Scene.model_validate_json(json.dumps(good)) == build(good)
    with pytest.raises(SceneError, match="the scene is no JSON"):
        Scene.model_validate_json("{")
