"""Meshes that shrink towards places: nested, conforming, graded as the exponents ask; corners and edges of bodies."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

import warmslip
from warmslip import SceneError, _core
from warmslip.mesh import files
from warmslip.mesh.refinement import Grading, fraction, refined
from warmslip.model.corners import corners, scalar_exponent
from warmslip.model.meshes import coarsest, make_mesh
from warmslip.scene.scene import Scene


def scene(name: str, **keys: Any) -> Scene:
    return warmslip.load(name).override(**{key.replace("__", "."): value for key, value in keys.items()})


SQUARE = {"mesh__n": 16}
CASES = {
    "corners of a square": scene("paper_mixed", **SQUARE, mesh__graded_to=["corners"]),
    "crossed": scene("paper_mixed", **SQUARE, mesh__diagonal="crisscross", mesh__graded_to=["corners"]),
    "a side": scene("paper_mixed", **SQUARE, mesh__graded_to=["bottom"]),
    "a side and a point": scene(
        "paper_mixed", **SQUARE, mesh__graded_to=["left", {"at": [1.0, 0.5], "exponent": 0.4}, {"at": "top"}]
    ),
    "a file": scene("plate_with_hole", mesh__refine=2, mesh__graded_to=["corners"]),
    "edges of a cube": scene("block_3d", mesh__n=8, mesh__graded_to=["corners"]),
    "a face of a cube": scene("block_3d", mesh__n=8, mesh__graded_to=["bottom", [0.0, 0.0, 1.0]]),
    "edges of a file": scene("block_with_hole", mesh__refine=1, mesh__graded_to=["corners"]),
}


def volumes(mesh: Any) -> Any:
    x = np.asarray(mesh.nodes)[np.asarray(mesh.cells)]
    return np.linalg.det(x[:, 1:] - x[:, :1])


@pytest.mark.parametrize("case", CASES)
def test_graded_meshes_are_nested_and_conforming(case: str) -> None:
    one, table = CASES[case], CASES[case].mesh
    d = table.dim
    key = "mesh.n" if table.file is None else "mesh.refine"
    finer = one.override(**{key: [2 * n for n in table.counts] if table.file is None else table.refine + 1})
    coarse, fine, start = make_mesh(one), make_mesh(finer), coarsest(table)
    assert len(coarse.cells) == len(start.cells) * 2 ** (d * table.halvings)  # as many as without grading
    for mesh in (coarse, fine):
        assert volumes(mesh).min() > 0
        assert volumes(mesh).sum() == pytest.approx(volumes(start).sum(), rel=1e-12)
        facets = Counter(tuple(sorted(np.delete(cell, i))) for cell in np.asarray(mesh.cells) for i in range(d + 1))
        assert set(facets.values()) == {1, 2}
        for part in mesh.parts.values():
            assert all(facets[tuple(sorted(facet))] == 1 for facet in np.asarray(part).tolist())
    matrix = _core.prolongation(coarse, fine)  # refuses meshes that are not nested
    assert matrix @ np.asarray(coarse.nodes) == pytest.approx(np.asarray(fine.nodes), abs=1e-13)
    plain = make_mesh(one.override(**{"mesh.graded_to": []}))
    assert volumes(coarse).min() < 0.3 * volumes(plain).min()


def test_edges_at_a_corner_shrink_by_its_fraction() -> None:
    kappa = fraction(corners(CASES["corners of a square"], coarsest(CASES["corners of a square"].mesh))[2].exponent)
    mesh = make_mesh(CASES["corners of a square"])
    nodes, cells = np.asarray(mesh.nodes), np.asarray(mesh.cells)
    for corner in ((0.0, 1.0), (1.0, 1.0)):
        at = int(np.linalg.norm(nodes - corner, axis=1).argmin())
        around = np.setdiff1d(cells[(cells == at).any(axis=1)], at)
        lengths = np.linalg.norm(nodes[around] - corner, axis=1)
        assert lengths.min() == pytest.approx(0.25 * kappa**2, rel=1e-12)
        assert lengths.max() <= 0.25 * np.sqrt(2) * kappa**2 * (1 + 1e-12)
    assert kappa < 2 ** (-1 / 0.69)  # at equality a logarithm is lost
    assert fraction(1.0) == 0.5


def test_an_edge_between_two_graded_places_is_halved() -> None:
    nodes, cells = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]], dtype=np.int32)
    mesh = files.MeshFile(2, nodes, cells, {}, {}, "")
    cut = refined(mesh, 1, [Grading(np.array([[0]]), 0.2), Grading(np.array([[1]]), 0.3)]).nodes[3:]
    assert np.array(sorted(map(tuple, cut))) == pytest.approx(np.array([[0.0, 0.2], [0.5, 0.0], [0.7, 0.3]]), abs=1e-15)


def test_layers_along_a_side() -> None:
    heights = np.unique(np.round(np.asarray(make_mesh(CASES["a side"]).nodes)[:, 1], 12))
    kappa = fraction(0.5)
    assert heights[1] == pytest.approx(0.25 * kappa**2, rel=1e-9)


def test_edges_of_a_cube() -> None:
    one = CASES["edges of a cube"]
    found = corners(one, coarsest(one.mesh))
    assert len(found) == 12 * 4
    singular = [corner for corner in found if corner.exponent < 1]
    assert len(singular) == 4 * 4  # the edges of the clamped top
    assert all(corner.point[2] == 1.0 and set(corner.conditions) == {"clamped", "traction"} for corner in singular)
    mesh = make_mesh(one)
    nodes = np.asarray(mesh.nodes)
    near = np.unique(np.round(1 - nodes[:, 2], 12))
    assert near[1] == pytest.approx(0.25 * fraction(singular[0].exponent), rel=1e-9)  # halved once, from 4 cells
    on_edge = np.unique(np.round(nodes[(nodes[:, 1] == 0) & (nodes[:, 2] == 1), 0], 12))
    assert np.diff(on_edge) == pytest.approx(np.full(8, 0.125))  # along an edge cells stay as they are


def test_a_rigid_foundation_may_hold_its_corner() -> None:
    soft, hard = (scene("paper_mixed", mesh__n=4, contact__stiffness=c) for c in (1e3, "rigid"))
    below = {c.point: c.exponent_u for c in corners(hard, coarsest(hard.mesh))}
    above = {c.point: c.exponent_u for c in corners(soft, coarsest(soft.mesh))}
    assert above[0.0, 0.0] == 2.0
    assert below[0.0, 0.0] == pytest.approx(above[0.0, 1.0], rel=1e-12)  # as where a clamp meets a free side


def test_conduction_across_an_edge_is_that_of_the_plane() -> None:
    k = [[1.0, 0.9], [0.9, 1.0]]
    data: dict[str, Any] = {"time": {}, "heat": {"conductivity": k}, "supports": {"temperature": ["left"]}}
    plane = Scene.model_validate(data | {"mesh": {"n": 4}})
    space = Scene.model_validate(
        data
        | {"mesh": {"shape": "cube", "n": 4}, "heat": {"conductivity": [[*k[0], 0.0], [*k[1], 0.0], [0.0, 0.0, 1.0]]}}
    )
    flat = {c.point: c.exponent_theta for c in corners(plane, coarsest(plane.mesh))}
    assert flat[0.0, 0.0] < 0.6 < 1 < flat[0.0, 1.0] or flat[0.0, 1.0] < 0.6
    for corner in corners(space, coarsest(space.mesh)):
        at = corner.point[:2]
        if at in flat and 0 < corner.point[2] < 1:  # an edge along z, at a corner of the plane body
            assert corner.exponent_theta == pytest.approx(flat[at], rel=1e-9)
    assert any(c.exponent_theta < 0.6 for c in corners(space, coarsest(space.mesh)))


def test_scalar_exponents() -> None:
    assert scalar_exponent(1.5 * np.pi, (False, False)) == pytest.approx(2 / 3)
    assert scalar_exponent(1.5 * np.pi, (True, False)) == pytest.approx(1 / 3)
    assert scalar_exponent(np.pi / 2, (True, True)) == 2.0


def test_a_corner_that_is_named_is_graded() -> None:
    mesh = make_mesh(scene("heat_slab", mesh__n=[8, 8], mesh__graded_to=[[0.0, 0.0]]))
    x = np.asarray(mesh.nodes)
    plain = np.asarray(make_mesh(scene("heat_slab", mesh__n=[8, 8])).nodes)
    nearest = [np.sort(np.linalg.norm(nodes, axis=1))[1] for nodes in (x, plain)]
    assert nearest[0] == pytest.approx(2 * fraction(0.5) * nearest[1], rel=1e-9)


def test_a_polygon_for_a_circle_has_no_corners() -> None:
    one = CASES["a file"]
    assert all(abs(corner.angle - np.pi / 2) < 1e-9 for corner in corners(one, coarsest(one.mesh)))


def test_a_slab_has_no_singular_corners() -> None:
    found = corners(one := scene("heat_slab"), make_mesh(one))
    assert all(np.isnan(corner.exponent_u) for corner in found)
    assert min(corner.exponent for corner in found) >= 1


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"mesh__n": 7}, "give n = 8"),
        ({"mesh__n": [16, 4]}, r"give n = \[16, 8\]"),
        ({"mesh__graded_to": ["botom"]}, "no part 'botom'"),
        ({"mesh__graded_to": [[0.1, 0.1]]}, r"no node of the coarsest mesh; the nearest one is \[0, 0\]"),
        ({"mesh__graded_to": [[0.0, 0.0, 0.0]]}, "needs 2 coordinates"),
        ({"mesh__graded_to": [{"at": "top", "exponent": 1.5}]}, "less than 1"),
        ({"mesh__grading": [2.0, 1.0]}, "give one of them"),
        ({"supports__displacement": ["left", "right", "top", "bottom"], "contact": None}, "not singular at any corner"),
    ],
)
def test_refusals(keys: dict[str, Any], message: str) -> None:
    with pytest.raises((SceneError, ValueError), match=message):
        make_mesh(
            scene("paper_mixed", **({"mesh__n": 16, "mesh__graded_to": ["corners"], "loads__traction": {}} | keys))
        )


def test_a_file_needs_to_be_refined() -> None:
    with pytest.raises(SceneError, match="give refine = 1"):
        scene("plate_with_hole", mesh__refine=0, mesh__graded_to=["corners"])
