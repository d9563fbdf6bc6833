"""The contact parts as lines or triangles for other programs, with their fields at the points or as means over the facets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from warmslip.mesh.part_points import located
from warmslip.model.discretisation import Discretisation
from warmslip.model.state import part_points
from warmslip.typing import Array

GEOMETRY = ("normal", "arc length", "part")


@dataclass(frozen=True)
class ContactMesh:
    """The facets of all parts with contact points.

    Parameters
    ----------
    points : array (points, d)
        With nodal quadrature the contact points themselves, so that fields are nodal. With Gauss quadrature on some part the
        nodes of the facets, and fields are means over the facets.
    cells : array of int (facets, d)
        Points of each facet.
    means : sparse array (facets, contact points) or None
        Means over each facet, None where fields are nodal. The sum of means times areas is the sum over the points, weighted.
    """

    points: Array
    cells: Any
    means: Any = None

    @classmethod
    def of(cls, d: Discretisation) -> ContactMesh:
        """That of a discretisation, found once."""
        return d.remember("contact mesh", lambda: _found(d))  # type: ignore[no-any-return]

    def fields(self, of_points: dict[str, Array]) -> tuple[dict[str, Array], dict[str, Array]]:
        """Fields of the contact points as those of this mesh: at its points, and of its facets.

        The status of a facet is the largest of its points: slip, else stick, else open. Its part is theirs.
        """
        if self.means is None:
            return of_points, {}
        return {}, {
            name: _largest(self.means, values) if name in ("status", "part") else self.means @ values
            for name, values in of_points.items()
        }


def geometry(d: Discretisation) -> dict[str, Array]:
    """Outward normals of the contact points, their arc length along their part (in the plane), and the number of its table."""

    def find() -> dict[str, Array]:
        numbers = np.asarray(d.surface.contacts, dtype=int)
        found: dict[str, Array] = {"normal": np.asarray(d.surface.normals)}
        if d.dim == 2:
            found["arc length"] = np.zeros(len(numbers))
            for i in np.unique(numbers):
                points = part_points(d, d.scene.contacts[i].part)
                found["arc length"][points.number] = points.arc_length
        return found | {"part": numbers}

    return d.remember("contact geometry", find)  # type: ignore[no-any-return]


def _found(d: Discretisation) -> ContactMesh:
    numbers, positions = np.asarray(d.surface.contacts, dtype=int), np.asarray(d.surface.positions)
    touching = np.unique(numbers)
    facets = [np.asarray(d.mesh.parts[d.scene.contacts[i].part]) for i in touching]
    at_nodes = [d.scene.contacts[i].quadrature == "nodal" for i in touching]
    corners = [
        _contact_points(d, i, nodes) if nodal else None
        for i, nodes, nodal in zip(touching, facets, at_nodes, strict=True)
    ]
    if all(at_nodes):
        return ContactMesh(positions, np.concatenate([one for one in corners if one is not None]))
    nodes, cells = np.unique(np.concatenate(facets), return_inverse=True)
    x, begin = np.asarray(d.mesh.nodes), 0
    entries: list[tuple[Array, Any, Any]] = []  # share, facet, contact point
    for i, own, corner in zip(touching, facets, corners, strict=True):
        if corner is not None:
            rows, columns = np.repeat(np.arange(len(own)), d.dim), corner.ravel()
            share = np.full(len(rows), 1 / d.dim)
        else:
            columns = np.flatnonzero(numbers == i)
            rows, _ = located(x, own, positions[columns])
            weights = np.asarray(d.surface.weights)[columns]
            share = weights / np.bincount(rows, weights)[rows]
        entries.append((share, begin + rows, columns))
        begin += len(own)
    share, rows, columns = (np.concatenate(one) for one in zip(*entries, strict=True))
    means = csr_array((share, (rows, columns)), shape=(begin, len(numbers)))
    return ContactMesh(x[nodes], cells.reshape(-1, d.dim), means)


def _contact_points(d: Discretisation, contact: int, facets: Any) -> Any:
    """The contact point at each node of the facets of a part, (facets, d): of several at a node, that with their normal."""
    positions, normals, x = np.asarray(d.surface.positions), np.asarray(d.surface.normals), np.asarray(d.mesh.nodes)
    here: dict[tuple[float, ...], list[int]] = {}
    for point in np.flatnonzero(np.asarray(d.surface.contacts) == contact).tolist():
        here.setdefault(tuple(positions[point]), []).append(point)
    found = np.empty_like(facets)
    for facet, normal in enumerate(d.mesh.area_normals(d.scene.contacts[contact].part)):
        for corner, node in enumerate(facets[facet]):
            points = here[tuple(x[node])]
            found[facet, corner] = points[int(np.argmax(normals[points] @ normal))]
    return found


def _largest(means: Any, values: Array) -> Array:
    """The largest value of the points of each facet."""
    return np.asarray(
        [values[means.indices[a:b]].max() for a, b in zip(means.indptr[:-1], means.indptr[1:], strict=True)]
    )
