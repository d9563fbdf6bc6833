"""Nodal normals of guides, and supports that meet."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from warmslip import _core
from warmslip.model.loads import evaluate
from warmslip.model.supports import Support, Supports, _normals


def ring(parts: dict[str, Any]) -> Any:
    """Eight triangles about the origin, whose boundary is an octagon."""
    angles = np.arange(8) * np.pi / 4
    nodes = np.vstack([np.zeros(2), np.column_stack([np.cos(angles), np.sin(angles)])])
    cells = [[0, 1 + i, 1 + (i + 1) % 8] for i in range(8)]
    return _core.Mesh2.from_lists(nodes, cells, parts)


def test_normals_of_a_curved_part_are_means_and_those_of_its_edges_are_not() -> None:
    whole = ring({"rim": [[1 + i, 1 + (i + 1) % 8] for i in range(8)]})
    found = _normals(9, np.asarray(whole.parts["rim"]), whole.area_normals("rim"))
    assert sum(len(nodes) for nodes, _ in found) == 16  # 22.5 degrees from the mean: an edge at every node
    flat = ring({"side": [[1, 2]]})
    ((nodes, normals),) = _normals(9, np.asarray(flat.parts["side"]), flat.area_normals("side"))
    assert list(nodes) == [1, 2]
    assert normals == pytest.approx(np.tile([np.cos(np.pi / 8), np.sin(np.pi / 8)], (2, 1)), abs=1e-15)


def test_directions_along_the_axes_are_exact() -> None:
    mesh = _core.Mesh2.box([2, 2], [1.0, 1.0], _core.Diagonal.right)
    for part, normal in (("left", [-1.0, 0.0]), ("top", [0.0, 1.0])):
        ((_, normals),) = _normals(9, np.asarray(mesh.parts[part]), mesh.area_normals(part))
        assert np.array_equal(normals, np.tile(normal, (3, 1)))


def _support(node: int, direction: Any, value: Any, name: str = "'a'") -> Support:
    return Support("supports.displacement.a", name, np.array([node]), np.array([direction], dtype=float), value, 1, 0)


def test_two_directions_askew_hold_a_node_as_a_whole() -> None:
    diagonal = np.sqrt(0.5)
    held = Supports([_support(1, [1, 0], 0.2), _support(1, [diagonal, diagonal], 0.0)], np.zeros((3, 2)))
    assert np.array_equal(held.projectors, np.eye(2)[None])
    assert held.displacement(0.0, evaluate) == pytest.approx(np.array([[0.2, -0.2]]), abs=1e-15)
    assert list(held.held) == [False, True, False]
    assert not held.meet


def test_a_third_direction_must_agree() -> None:
    diagonal = np.sqrt(0.5)
    both = [_support(1, [1, 0], 0.2), _support(1, [0, 1], 0.1)]
    agrees, differs = (
        Supports([*both, _support(1, [diagonal, diagonal], value, "'b'")], np.zeros((3, 2)))
        for value in (0.3 * diagonal, 0.3)
    )
    assert agrees.meet
    assert agrees.displacement(0.0, evaluate) == pytest.approx(np.array([[0.2, 0.1]]), abs=1e-15)
    with pytest.raises(ValueError, match="'a' and 'b' hold their common node"):
        differs.displacement(0.0, evaluate)
