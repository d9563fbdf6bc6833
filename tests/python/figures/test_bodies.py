"""Edges of bodies in space."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from warmslip.figures.run import creases

NODES = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
SQUARES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLES = np.array([(a, b, c) for a, b, c, _ in SQUARES] + [(a, c, d) for a, _, c, d in SQUARES])


@pytest.mark.parametrize("turn", list(itertools.product((-1.0, 1.0), repeat=3)))
def test_a_cube_shows_nine_of_its_edges(turn: tuple[float, float, float]) -> None:
    """From a corner: all edges but the three that meet in the opposite corner; no diagonal of a side is one."""
    towards = np.array(turn) * [0.5, 0.6, 0.7]
    edges = NODES[creases(NODES, TRIANGLES, towards)]
    assert len(edges) == 9
    assert np.abs(edges[:, 1] - edges[:, 0]).sum(axis=1) == pytest.approx(1.0)
    hidden = (np.array(turn) < 0).astype(float)
    assert not (edges == hidden).all(axis=2).any()
    flipped = TRIANGLES[:, ::-1]
    assert np.array_equal(np.sort(creases(NODES, flipped, towards)), np.sort(creases(NODES, TRIANGLES, towards)))
