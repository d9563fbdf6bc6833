"""Facets of simplices: which of them are the same, which lie on the boundary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


def row_codes(rows: Any) -> Any:
    """A number for each row (m, k) of node numbers, (m,): the same for the same nodes in any order."""
    rows = np.sort(rows.astype(np.int64), axis=1)
    base = int(rows.max(initial=0)) + 1
    codes, bound = rows[:, 0], base
    for column in rows.T[1:]:
        if bound * base >= 2**63:
            found, codes = np.unique(codes, return_inverse=True)
            bound = len(found)
        codes, bound = codes * base + column, bound * base
    return codes


def distinct(rows: Any) -> tuple[Any, Any]:
    """Positions of the rows that come first with their nodes, ascending, and for each row the position among those."""
    _, first, inverse = np.unique(row_codes(rows), return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return first[order], place[inverse]


def of_cells(cells: Any) -> Any:
    """The facets of all cells (c, d + 1), those opposite the first corner first: ((d + 1) c, d)."""
    corners = np.arange(cells.shape[1])
    return np.concatenate([cells[:, corners != i] for i in corners])


@dataclass(frozen=True)
class Incidence:
    """The facets (b, d) on the `boundary` of a mesh; how many `cells` (f,) each of other facets has."""

    boundary: Any
    cells: Any


def incidence(cells: Any, others: Any, tags: Any) -> Incidence:
    """How many cells the facets of a mesh have.

    Parameters
    ----------
    cells : array (c, d + 1)
        Cells of positive volume.
    others : array (f, d)
        Facets to look up, which need not belong to a cell.
    tags : array (n,)
        Numbers of the nodes in messages.

    Returns
    -------
    Incidence

    Raises
    ------
    ValueError
        When three cells share a facet, or two that lie on the same side of it.
    """
    facets = of_cells(cells)
    codes = row_codes(np.concatenate([facets, others]))
    known, rest = codes[: len(facets)], codes[len(facets) :]
    order = np.argsort(known, kind="stable")
    found, start, count = np.unique(known[order], return_index=True, return_counts=True)
    if (count > 2).any():
        raise ValueError(
            f"more than two cells share the facet {_nodes(tags[facets[order[start[count > 2][0]]]])}; repair the mesh there"
        )
    pairs = start[count == 2]
    signs = _signs(facets, len(cells))
    same = signs[order[pairs]] == signs[order[pairs + 1]]
    if same.any():
        worst = _nodes(tags[facets[order[pairs[same][0]]]])
        raise ValueError(f"two cells overlap: they lie on one side of the facet {worst}; repair the mesh there")
    at = np.minimum(np.searchsorted(found, rest), len(found) - 1)
    return Incidence(facets[np.sort(order[start[count == 1]])], np.where(found[at] == rest, count[at], 0))


def _signs(facets: Any, cells: int) -> Any:
    """On which side of a facet, seen with its nodes in ascending order, its cell lies: True or False."""
    inversions = sum((facets[:, i] > facets[:, j]).astype(int) for j in range(facets.shape[1]) for i in range(j))
    return (inversions + np.repeat(np.arange(len(facets) // max(cells, 1)), cells)) % 2 == 1


def _nodes(facet: Any) -> str:
    return "of the nodes " + ", ".join(map(str, facet.tolist()))
