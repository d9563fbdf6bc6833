"""Points along lines of edges."""

from __future__ import annotations

import numpy as np

from warmslip.model.arc_length import along_part, arc_length
from warmslip.model.meshes import make_mesh
from warmslip.scene.reader import build


def test_open_lines_in_any_order_of_their_edges() -> None:
    path = np.array([[0.0, 0], [1, 0], [1, 1], [5, 5], [5, 6]])
    middle = np.array([[0.5, 0.0], [1.0, 0.25], [5.0, 5.5], [1.0, 0.0]])
    for edges in ([[0, 1], [1, 2], [3, 4]], [[4, 3], [1, 2], [1, 0]]):
        assert np.allclose(arc_length(path, np.array(edges), middle), [0.5, 1.25, 2.5, 1.0], rtol=0, atol=1e-15)


def test_a_closed_line_goes_round() -> None:
    angles = np.linspace(0, 2 * np.pi, 13)
    circle = np.column_stack([-np.cos(angles), np.sin(angles)])[:-1]  # the first node is the leftmost
    edges = np.array([[i, (i + 1) % 12] for i in range(12)])
    side = 2 * np.sin(np.pi / 12)
    assert np.allclose(arc_length(circle, edges, circle), side * np.arange(12))
    halves = (circle + np.roll(circle, -1, axis=0)) / 2  # the last lies on the edge that closes the line
    assert np.allclose(arc_length(circle, edges, halves), side * (np.arange(12) + 0.5))


def test_the_points_of_a_part() -> None:
    mesh = make_mesh(build({"mesh": {"shape": "square", "n": 5}, "time": {}, "heat": {"conductivity": 1.0}}))
    random = np.random.default_rng(3)
    points = np.column_stack([np.ones(2500), random.random(2500)])
    order, length = along_part(mesh, "right", points)
    assert np.allclose(length, points[order, 1], rtol=0, atol=1e-15) and (np.diff(length) >= 0).all()
