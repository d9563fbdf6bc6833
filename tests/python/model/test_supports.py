"""Nodal normals of guides, and supports that meet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from warmslip import _core
from warmslip.model.loads import evaluate
from warmslip.model.supports import Support, Supports, _Normals


def ring(parts: dict[str, Any]) -> Any:
    """Eight triangles about the origin, whose boundary is an octagon."""
    angles = np.arange(8) * np.pi / 4
    nodes = np.vstack([np.zeros(2), np.column_stack([np.cos(angles), np.sin(angles)])])
    cells = [[0, 1 + i, 1 + (i + 1) % 8] for i in range(8)]
    return _core.Mesh2.from_lists(nodes, cells, parts)


def of(mesh: Any, part: str, *others: str) -> list[tuple[Any, Any]]:
    """Nodes and normals of a part, which may continue in others."""
    given = [(np.asarray(mesh.parts[name]), mesh.area_normals(name)) for name in (part, *others)]
    return _Normals(len(mesh.nodes), given).of(*given[0])


def test_normals_of_a_curved_part_are_means_and_those_of_its_edges_are_not() -> None:
    whole = ring({"rim": [[1 + i, 1 + (i + 1) % 8] for i in range(8)]})
    found = of(whole, "rim")
    assert sum(len(nodes) for nodes, _ in found) == 16  # 22.5 degrees from the mean: an edge at every node
    flat = ring({"side": [[1, 2]]})
    ((nodes, normals),) = of(flat, "side")
    assert list(nodes) == [1, 2]
    assert normals == pytest.approx(np.tile([np.cos(np.pi / 8), np.sin(np.pi / 8)], (2, 1)), abs=1e-15)


def test_a_surface_in_two_parts_has_one_normal_at_their_seam() -> None:
    """A smooth rim of 32 edges, whole and in halves: the same directions at every node."""
    angles = np.arange(32) * np.pi / 16
    nodes = np.vstack([np.zeros(2), np.column_stack([np.cos(angles), np.sin(angles)])])
    edges = [[1 + i, 1 + (i + 1) % 32] for i in range(32)]
    cells = [[0, a, b] for a, b in edges]
    whole = _core.Mesh2.from_lists(nodes, cells, {"rim": edges})
    halves = _core.Mesh2.from_lists(nodes, cells, {"one": edges[:16], "other": edges[16:]})
    ((at, expected),) = of(whole, "rim")
    for part, other in (("one", "other"), ("other", "one")):
        ((here, normals),) = of(halves, part, other)
        assert np.abs(normals - expected[np.searchsorted(at, here)]).max() <= 1e-15


def test_an_edge_in_space_holds_one_normal_for_each_of_its_sides() -> None:
    """A box whose bottom is slightly uneven, as one part with a side: two directions along their edge."""
    box = _core.Mesh3.box([3, 3, 3], [1.0, 1.0, 1.0], _core.Diagonal.right)
    nodes = np.array(box.nodes)
    nodes[:, 2] -= np.where(nodes[:, 2] == 0, 0.02 * np.sin(7 * nodes[:, 0] + 5 * nodes[:, 1]), 0.0)
    both = np.vstack([box.parts["bottom"], box.parts["left"]])
    mesh = _core.Mesh3.from_lists(nodes, box.cells, {"both": both})
    count = np.zeros(len(nodes), dtype=int)
    for at, _ in of(mesh, "both"):
        np.add.at(count, at, 1)
    on_edge = (np.abs(nodes[:, 0]) < 1e-12) & (np.array(box.nodes)[:, 2] == 0)
    assert list(count[on_edge]) == [2, 2, 2, 2]
    assert count.max() == 2


def test_directions_along_the_axes_are_exact() -> None:
    mesh = _core.Mesh2.box([2, 2], [1.0, 1.0], _core.Diagonal.right)
    for part, normal in (("left", [-1.0, 0.0]), ("top", [0.0, 1.0])):
        ((_, normals),) = of(mesh, part)
        assert np.array_equal(normals, np.tile(normal, (3, 1)))


def _support(node: int, direction: Any, value: Any, name: str = "'a'") -> Support:
    return Support("supports.displacement.a", name, np.array([node]), np.array([direction], dtype=float), value, 1, 0)


def test_directions_that_differ_by_the_digits_of_coordinates_are_one() -> None:
    tilted = [np.sin(1e-7), np.cos(1e-7)]
    held = Supports([_support(1, [0, 1], 0.2), _support(1, tilted, 0.2)], np.eye(3)[:, :2])
    assert np.linalg.matrix_rank(held.projectors[0], tol=1e-3) == 1
    assert held.displacement(0.0, evaluate) == pytest.approx(np.array([[0.0, 0.2]]), abs=1e-7)
    with pytest.raises(ValueError, match="contradict"):
        Supports([_support(1, [0, 1], 0.2), _support(1, tilted, 0.21, "'b'")], np.eye(3)[:, :2]).displacement(
            0.0, evaluate
        )


def test_agreement_is_judged_beside_the_body_where_all_is_near_zero() -> None:
    held = Supports([_support(1, [1, 0], 5.6e-18), _support(1, [1, 0], -6.9e-18)], np.eye(3)[:, :2])
    assert np.abs(held.displacement(0.0, evaluate)).max() < 1e-17


def test_two_directions_askew_hold_a_node_as_a_whole() -> None:
    diagonal = np.sqrt(0.5)
    held = Supports([_support(1, [1, 0], 0.2), _support(1, [diagonal, diagonal], 0.0)], np.eye(3)[:, :2])
    assert np.array_equal(held.projectors, np.eye(2)[None])
    assert held.displacement(0.0, evaluate) == pytest.approx(np.array([[0.2, -0.2]]), abs=1e-15)
    assert list(held.held) == [False, True, False]
    assert not held.meet


def test_a_third_direction_must_agree() -> None:
    diagonal = np.sqrt(0.5)
    both = [_support(1, [1, 0], 0.2), _support(1, [0, 1], 0.1)]
    agrees, differs = (
        Supports([*both, _support(1, [diagonal, diagonal], value, "'b'")], np.eye(3)[:, :2])
        for value in (0.3 * diagonal, 0.3)
    )
    assert agrees.meet
    assert agrees.displacement(0.0, evaluate) == pytest.approx(np.array([[0.2, 0.1]]), abs=1e-15)
    with pytest.raises(ValueError, match=r"'a' and 'b' hold their common node .*'b' 0.3 along"):
        differs.displacement(0.0, evaluate)
