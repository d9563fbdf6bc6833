"""Points on a part: their facets in the plane and in space, arc lengths on open, closed and several lines."""

from __future__ import annotations

import numpy as np

from warmslip.mesh.part_points import arc_length, located

CIRCLE = np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0, 2 * np.pi, 13)[:-1]])
ROUND = np.array([[i, (i + 1) % 12] for i in range(12)])
SIDE = 2 * np.sin(np.pi / 12)


def test_length_along_lines_open_closed_and_several() -> None:
    assert np.allclose(np.sort(arc_length(CIRCLE, ROUND, CIRCLE)[0]), SIDE * np.arange(12))
    path, two = np.array([[0.0, 0], [1, 0], [1, 1], [5, 5], [5, 6]]), np.array([[1, 0], [1, 2], [3, 4]])
    middle = np.array([[0.5, 0.0], [1.0, 0.25], [5.0, 5.5]])
    length, onwards = arc_length(path, two, middle)
    assert np.allclose(length, [0.5, 1.25, 2.5])
    assert np.allclose(onwards, [[1, 0], [0, 1], [0, 1]])


def test_the_length_grows_through_the_edge_that_closes_a_line() -> None:
    middles = CIRCLE[ROUND].mean(axis=1)
    length, onwards = arc_length(CIRCLE, ROUND, middles)
    assert np.allclose(np.sort(length), SIDE * (np.arange(12) + 0.5))
    order = np.argsort(length)
    steps = np.roll(middles[order], -1, axis=0) - middles[order]
    assert (np.sum(steps * onwards[order], axis=1) > 0).all()


def test_a_facet_that_is_far_from_the_nearest_centroid_is_found() -> None:
    """Cells that shrink by 1e-4: the centroid of the long edge is farther than those of many short ones."""
    x = np.concatenate([np.linspace(0, 1e-2, 101), [1.0]])
    nodes = np.stack([x, np.zeros_like(x)], axis=1)
    edges = np.stack([np.arange(101), np.arange(1, 102)], axis=1)
    facet, shares = located(nodes, edges, np.array([[0.02, 0.0], [0.00505, 0.0]]))
    assert facet.tolist() == [100, 50]
    assert np.allclose(np.einsum("pk,pki->pi", shares, nodes[edges[facet]]), [[0.02, 0], [0.00505, 0]])


def test_points_of_triangles_in_space() -> None:
    rng = np.random.default_rng(3)
    i, j = np.meshgrid(np.arange(6), np.arange(6), indexing="ij")
    number = np.arange(49).reshape(7, 7)
    corner = [number[i, j], number[i + 1, j], number[i, j + 1], number[i + 1, j + 1]]
    facets = np.concatenate([np.stack(c, axis=-1).reshape(-1, 3) for c in (corner[:3], corner[1:])])
    x, y = np.divmod(np.arange(49), 7)
    nodes = np.stack([x / 6, y / 6, 0.1 * np.sin(x)], axis=1)
    true = rng.dirichlet(np.ones(3), len(facets))
    points = np.einsum("pk,pki->pi", true, nodes[facets])
    facet, shares = located(nodes, facets, points)
    assert (facet == np.arange(len(facets))).all() and np.allclose(shares, true)
