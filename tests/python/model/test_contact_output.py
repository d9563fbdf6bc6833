"""Contact fields along a part: the same of a state and of the file, ordered, and in the law of the contact."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import Law, Scene
from warmslip.model.contact_output import ContactFields

Small = Callable[..., Scene]
FIELDS = ("pressure", "traction", "slip", "gap", "status", "friction_bound", "temperature")


def ran(scene: Scene, folder: Path, **more: Any) -> list[ContactFields]:
    """The contact fields of every step, by observers; the run is in the folder."""
    found: list[ContactFields] = []
    warmslip.run(scene, out=folder, observers=[lambda state, _: found.append(state.contact_on())], **more)
    return found


@pytest.mark.parametrize(
    ("scene", "keys"),
    [
        ("paper_mixed", {"mesh.n": 4, "time.steps": 4, "contact.quadrature": "gauss-2"}),
        ("quasistatic_punch", {"mesh.n": 4, "time.steps": 4}),
        ("sliding_block", {"time.steps": 9, "contact.friction.kinetic": 0.1, "contact.friction.speed": 0.3}),
        ("block_3d", {"mesh.n": 2, "time.steps": 3}),
        ("plate_with_hole", {"time.steps": 3}),
    ],
)
def test_the_file_holds_what_the_states_had(scene: str, keys: dict[str, Any], tmp_path: Path) -> None:
    seen = ran(warmslip.load(scene).override(**keys), tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        whole = stored.contact_history()
        one = stored.contact_on(time=seen[1].time)
    assert len(whole.time) == len(seen)
    for name in FIELDS:
        if getattr(seen[0], name) is None:
            assert getattr(whole, name) is None
            continue
        values = np.array([getattr(at, name) for at in seen])
        assert np.allclose(getattr(whole, name), values, rtol=1e-9, atol=1e-12 * np.abs(values).max()), name
        assert np.array_equal(getattr(one, name), getattr(whole, name)[1]), name
    size = np.abs(whole.traction) if whole.arc_length is not None else np.linalg.norm(whole.traction, axis=2)
    assert (size <= whole.friction_bound * (1 + 1e-10) + 1e-12).all()
    slips = whole.status == 2
    assert slips.any() and np.allclose(size[slips], whole.friction_bound[slips], rtol=1e-9, atol=1e-12)


def test_the_points_are_ordered_and_signs_follow_the_part(tmp_path: Path) -> None:
    """A block thrown to the right: friction points back to the left, and the slip is that of the nodes."""
    ran(warmslip.load("sliding_block").override(**{"time.steps": 20}), tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        at, u = stored.contact_on("bottom", 0.1), np.asarray(stored.u[2])
        x, theta = stored.nodes, np.asarray(stored.theta[2])
        steps = stored.series("steps")
    assert np.array_equal(at.arc_length, np.linspace(0, 1, len(at.weights)))
    below = np.flatnonzero(x[:, 1] == 0)
    below = below[np.argsort(x[below, 0])]
    assert np.allclose(at.positions, x[below]) and np.allclose(at.slip, u[below, 0], rtol=1e-12)
    assert np.allclose(at.temperature, theta[below], rtol=1e-12)
    assert at.friction_force < 0 < at.normal_force
    assert at.friction_force == pytest.approx(steps["friction_traction"][1, 0], rel=1e-12)
    assert at.normal_force == pytest.approx(steps["normal_force"][1], rel=1e-12)


def test_the_direction_is_that_of_the_arc_length_on_every_side(small: Small) -> None:
    """The outward normal turned by 90 degrees points the other way on the top and on the left."""
    from warmslip.mesh.part_points import arc_length
    from warmslip.model.contact_output import PartPoints

    d = warmslip.discretise(small())
    nodes = np.asarray(d.mesh.nodes)
    for part, normal, direction in (("bottom", [0, -1], [1, 0]), ("top", [0, 1], [1, 0]), ("left", [-1, 0], [0, 1])):
        facets = np.asarray(d.mesh.parts[part])
        x = nodes[np.unique(facets)][[2, 0, 4, 1, 3]]
        normals = np.broadcast_to(np.array(normal, dtype=float), x.shape)
        points = PartPoints.of(part, nodes, facets, x, normals, np.ones(len(x)), np.ones(len(x), dtype=bool))
        assert np.allclose(points.tangents, direction), part
        assert np.array_equal(points.arc_length, np.sort(arc_length(nodes, facets, x)[0]))
        assert points.number.tolist() == [1, 3, 0, 4, 2]


def test_of_states_that_are_not_stored_the_temperature_is_not_known(small: Small, tmp_path: Path) -> None:
    warmslip.run(small(output__every=2), out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        known = np.isfinite(stored.contact_history().temperature).all(axis=1)
    assert known.tolist() == [False, True, False, True]


def test_a_bound_of_ones_own_is_known_to_the_state_and_not_to_the_file(small: Small, tmp_path: Path) -> None:
    law = Law(friction=lambda pressure, speed: (0.05 * pressure, 0.05, 0.0))
    (*_, last) = ran(small(), tmp_path, laws={"bottom": law})
    assert last.friction_bound is not None and np.allclose(last.friction_bound, 0.05 * last.pressure)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        assert stored.contact_on().friction_bound is None


def test_what_cannot_be_had_is_said_in_a_sentence(small: Small, tmp_path: Path) -> None:
    warmslip.run(small(), out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        for arguments, words in ((("top",), "no contact points lie on 'top'"), ((None, 3.0), "to t = 1, not at 3")):
            with pytest.raises(ValueError, match=words):
                stored.contact_on(*arguments)
    with pytest.raises(ValueError, match="is closed"):
        stored.contact_on()
    warmslip.run(warmslip.load("heat_slab").override(**{"time.steps": 2}), out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored, pytest.raises(ValueError, match="no part"):
        stored.contact_history()


@pytest.mark.parametrize("name", ["part", "positions", "normals"])
def test_a_damaged_file_is_refused(name: str, small: Small, tmp_path: Path) -> None:
    import h5py

    warmslip.run(small(), out=tmp_path)
    path = tmp_path / "trajectory.h5"
    with h5py.File(path, "r+") as file:
        values = np.asarray(file[f"contact/{name}"])
        del file[f"contact/{name}"]
        file[f"contact/{name}"] = values + 7 if name == "part" else values[:-1]
    with pytest.raises(ValueError, match=f"damaged or no trajectory .*contact/{name}"):
        warmslip.Trajectory(path)


def test_of_several_parts_one_is_named(tmp_path: Path) -> None:
    parts = [{"part": part, "stiffness": 1e4} for part in ("bottom", "left")]
    warmslip.run(warmslip.load("two_materials").override(**{"time.steps": 2, "contact": parts}), out=tmp_path)
    with warmslip.Trajectory(tmp_path / "trajectory.h5") as stored:
        assert stored.contact_parts == ["bottom", "left"]
        with pytest.raises(ValueError, match="several contact parts; give one of 'bottom'"):
            stored.contact_on()
        forces = [stored.contact_on(part).normal_force for part in stored.contact_parts]
        assert sum(forces) == pytest.approx(stored.series("steps")["normal_force"][-1], rel=1e-12)


def test_the_friction_bound_on_a_belt_is_that_of_the_slip(tmp_path: Path) -> None:
    """Friction that falls with the slip speed: on a moving foundation the bound of a slipping point is its traction."""
    scene = warmslip.load("belt").override(
        **{"mesh.n": [6, 3], "time.steps": 40, "contact.friction": {"coefficient": 0.3, "kinetic": 0.1, "speed": 0.1}}
    )
    result = warmslip.run(scene, out=tmp_path)
    with warmslip.Trajectory(result.trajectory) as stored:
        history = stored.contact_history("bottom")
    slips = np.asarray(history.status) == 2
    assert slips.sum() > 20
    traction, bound = np.abs(history.traction[slips]), history.friction_bound[slips]
    assert np.abs(traction - bound).max() <= 1e-9 * bound.max()
