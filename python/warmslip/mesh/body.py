"""The body of a mesh file: its cells as simplices of positive volume, in one piece."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from warmslip.mesh.elements import SHAPES, split
from warmslip.mesh.facets import distinct
from warmslip.mesh.raw import Raw

THIN = 1e-3  # share of a quadrangle in the smaller of its halves, below which the other diagonal is tried
FLAT = 1e-14  # volume of a cell over the power of its size, below which the core takes it for flat
SAME = 1e-12  # distance of nodes at one place over the size of the body
INSIDE = 1e-6  # barycentric coordinate of a node that lies inside a cell


def simplices(raw: Raw, dim: int, *, plane: bool) -> tuple[Any, dict[int, Any], int]:
    """All elements of a dimension as simplices.

    Parameters
    ----------
    raw : Raw
        What the file holds.
    dim : int
        1, 2 or 3.
    plane : bool
        Whether quadrangles are cells of a plane body, which may be divided along either diagonal.

    Returns
    -------
    rows : array (m, dim + 1)
        Positions of nodes, each simplex once and in the order of the file.
    groups : dict of arrays
        Positions in `rows` of the simplices of each physical group, each once.
    repeated : int
        How many simplices a group holds more than once.
    """
    found = [np.empty((0, dim + 1), np.int64)]
    member, group, total = [np.empty(0, np.int64)], [np.empty(0, np.int64)], 0
    for block in raw.blocks:
        size, corners = SHAPES[block.shape]
        if size != dim:
            continue
        children = split(block.shape, block.nodes[:, :corners])
        if plane and block.shape == "quadrangle":
            children = _convex(raw.nodes, children)
        several = children.shape[1]
        found.append(children.reshape(-1, dim + 1))
        member.append((total + several * block.member[:, None] + np.arange(several)).ravel())
        group.append(np.repeat(block.group, several))
        total += len(found[-1])
    rows = np.concatenate(found)
    first, place = distinct(rows)
    members, repeated = _members(place[np.concatenate(member)], np.concatenate(group), len(first))
    return rows[first], members, repeated


def _members(at: Any, group: Any, count: int) -> tuple[dict[int, Any], int]:
    """The different members of each group, ascending, and how many came again."""
    tags, rank = np.unique(group, return_inverse=True)
    pairs = np.sort(rank * count + at)  # both are in memory: no overflow
    pairs = pairs[np.diff(pairs, prepend=-1) > 0]
    bounds = np.searchsorted(pairs, np.arange(1, len(tags)) * count)
    members = np.split(pairs % max(count, 1), bounds) if len(tags) else []
    return dict(zip(tags.tolist(), members, strict=True)), len(at) - len(pairs)


def _convex(nodes: Any, halves: Any) -> Any:
    """Quadrangles as two triangles (m, 2, 3), divided along the other diagonal where theirs leaves one flat or outside."""
    a, b, c, d = halves[:, 0, 0], halves[:, 0, 1], halves[:, 0, 2], halves[:, 1, 2]
    others = np.stack([np.stack([b, c, d], axis=1), np.stack([b, d, a], axis=1)], axis=1)
    thin, other = _thinnest(nodes, halves), _thinnest(nodes, others)
    return np.where(((thin < THIN) & (other > thin))[:, None, None], others, halves)


def _thinnest(nodes: Any, halves: Any) -> Any:
    """The smaller share of the area of a quadrangle that one of its halves has, negative where it lies outside."""
    x = nodes[halves][..., :2]
    with np.errstate(all="ignore"):  # nodes that are nowhere are refused later
        area = _determinants((x[:, :, 1:] - x[:, :, :1]).reshape(-1, 2, 2)).reshape(-1, 2)
        return np.nan_to_num((area / area.sum(axis=1, keepdims=True)).min(axis=1))


def _determinants(a: Any) -> Any:
    """Of matrices (m, d, d), d = 2 or 3, without the divisions of an elimination."""
    if a.shape[1] == 2:
        return a[:, 0, 0] * a[:, 1, 1] - a[:, 0, 1] * a[:, 1, 0]
    return np.einsum("ij,ij->i", a[:, 0], np.cross(a[:, 1], a[:, 2]))


def oriented(nodes: Any, cells: Any, tags: Any) -> Any:
    """The cells with positive volumes; a file may number them in either sense.

    Raises ValueError for a cell without volume.
    """
    edges = nodes[cells[:, 1:]] - nodes[cells[:, :1]]
    volumes = _determinants(edges)
    size = np.linalg.norm(edges, axis=2).max(axis=1)
    dim = cells.shape[1] - 1
    flat = ~(np.abs(volumes) > FLAT * math.factorial(dim) * size**dim)
    if flat.any():
        worst = cells[int(flat.argmax())]
        raise ValueError(f"the cell of the nodes {', '.join(map(str, tags[worst]))} is flat; repair the mesh there")
    turned = volumes < 0
    if turned.any():
        cells = cells.copy()
        cells[turned, 0], cells[turned, 1] = cells[turned, 1], cells[turned, 0]
    return cells


def check_connected(nodes: Any, cells: Any, boundary: Any, tags: Any) -> None:
    """Raises ValueError for a body in several pieces, or with two nodes at one place."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, others = np.repeat(cells[:, 0], cells.shape[1] - 1), cells[:, 1:].ravel()
    graph = coo_array((np.ones(len(first), np.int8), (first, others)), shape=(len(nodes), len(nodes)))
    count, label = connected_components(graph, directed=False)
    pieces = f"the body is in {count} pieces" if count > 1 else ""
    if shared := _coincident(nodes, np.unique(boundary)):
        several, one, other = shared
        at = ", ".join(f"{x:.6g}" for x in nodes[one])
        raise ValueError(
            f"{pieces and pieces + ', and '}{several} nodes lie where another one does, such as {tags[one]} and {tags[other]} at "
            f"({at}); merge them (in gmsh: Coherence before meshing, or Coherence Mesh after)"
        )
    if count > 1:
        stray = int((label[cells[:, 0]] != label[cells[0, 0]]).argmax())
        near, far = (", ".join(map(str, tags[cells[i]])) for i in (0, stray))
        raise ValueError(f"{pieces}, such as the cells of the nodes {near} and of {far}; mesh one body")


def check_apart(nodes: Any, cells: Any, boundary: Any, tags: Any) -> None:
    """Raises ValueError where a cell covers a node of other cells; of two that overlap, one has a facet on the boundary."""
    from scipy.spatial import cKDTree

    outside = np.zeros(len(nodes), bool)
    outside[boundary] = True
    some = cells[outside[cells].sum(axis=1) >= nodes.shape[1]]
    centres = nodes[some].mean(axis=1)
    sizes = np.linalg.norm(nodes[some] - centres[:, None], axis=2).max(axis=1)
    near = cKDTree(nodes).query_ball_point(centres, sizes)
    cell = np.repeat(np.arange(len(some)), [len(one) for one in near])
    node = np.concatenate([np.empty(0, np.int64), *(np.asarray(one, np.int64) for one in near)])
    edges = (nodes[some[:, 1:]] - nodes[some[:, :1]]).transpose(0, 2, 1)
    rest = np.linalg.solve(edges[cell], (nodes[node] - nodes[some[cell, 0]])[:, :, None])[:, :, 0]
    covered = (rest.min(axis=1) > INSIDE) & (rest.sum(axis=1) < 1 - INSIDE)
    if covered.any():
        i = int(covered.argmax())
        corners = ", ".join(map(str, tags[some[cell[i]]]))
        raise ValueError(
            f"cells overlap: the node {tags[node[i]]} lies inside the cell of the nodes {corners}; repair the mesh there"
        )


def _coincident(nodes: Any, among: Any) -> tuple[int, int, int] | None:
    """How many of the nodes `among` lie where another one does, and two such nodes."""
    from scipy.spatial import cKDTree

    places = nodes[among]
    away, nearest = cKDTree(places).query(places, k=2)
    close = away[:, 1] <= SAME * float(np.ptp(places, axis=0).max())
    if not close.any():
        return None
    i = int(close.argmax())
    j = int(nearest[i][nearest[i] != i][0])
    return int(close.sum()), int(among[i]), int(among[j])
