"""Contact points that supports hold: no motion mends what of them lies inside a rigid foundation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from warmslip.model.load_vectors import LoadVectors
from warmslip.model.loads import Loads, of_time
from warmslip.scene.scene import Scene
from warmslip.typing import Array

ROUNDING = 1e-12  # relative to displacement and gap: what the law of contact does not see


@dataclass(frozen=True)
class PrescribedContact:
    """Of one problem; `user_compliances` names the parts whose compliance is a function of the user's."""

    scene: Scene
    mesh: Any
    surface: Any
    loads: Loads
    vectors: LoadVectors
    user_compliances: frozenset[str]

    @cached_property
    def _points(self) -> list[tuple[int, Any, Array]]:
        """Number, nodes and their weights of every contact point on a rigid foundation whose nodes are held across it."""
        touched = np.zeros(len(self.mesh.nodes), dtype=bool)
        touched[self.vectors.supports.nodes] = True
        of_part = np.asarray(self.surface.contacts, dtype=int)
        out: list[tuple[int, Any, Array]] = []
        for i, contact in enumerate(self.scene.contacts):
            facets = np.asarray(self.mesh.parts[contact.part])
            if contact.stiffness is None or not np.isinf(contact.compliance) or contact.part in self.user_compliances:
                continue
            points = np.flatnonzero(of_part == i)
            if not len(points) or not touched[facets].any():
                continue
            places = np.asarray(self.surface.positions)[points]
            if contact.quadrature == "nodal":
                found = _at_nodes(points, places, np.asarray(self.mesh.nodes), np.unique(facets[touched[facets]]))
            else:
                found = _on_facets(points, places, np.asarray(self.mesh.nodes), facets[touched[facets].all(axis=1)])
            out += [point for point in found if self._across(point)]
        return out

    def _across(self, point: tuple[int, Any, Array]) -> bool:
        """Whether the nodes of a point are held along the point's normal."""
        supports, normal = self.vectors.supports, np.asarray(self.surface.normals)[point[0]]
        projectors = supports.projectors[np.searchsorted(supports.nodes, point[1])]
        return bool(np.abs(projectors @ normal - normal).max() < ROUNDING)

    @property
    def of_time(self) -> bool:
        """Whether supports or gaps of such points change in time."""
        if not self._points:
            return False
        gaps = [self.loads.on_contact("gap", i) for i, c in enumerate(self.scene.contacts) if c.stiffness is not None]
        return self.vectors.supports.of_time or any(map(of_time, gaps))

    def inside(self, t: float) -> str:
        """Which of them is deepest inside at time t, with its cure; "" where none is (collective)."""
        if not self._points:
            return ""
        nodes, normals = np.asarray(self.mesh.nodes), np.asarray(self.surface.normals)
        moved = np.zeros_like(nodes)
        moved[self.vectors.supports.nodes] = self.vectors.displacement(t)
        gap = self.vectors.on_points("gap", t)
        deepest, place, part = 0.0, np.zeros(0), ""
        for point, at, weights in self._points:
            across = float(weights @ moved[at] @ normals[point])
            depth = across - float(gap[point])
            if depth > max(deepest, ROUNDING * (np.abs(moved[at]).max() + abs(gap[point]))):
                contact = self.scene.contacts[int(self.surface.contacts[point])]
                deepest, place, part = depth, weights @ nodes[at], contact.part
        if deepest == 0:
            return ""
        where = ", ".join(f"{one:.4g}" for one in place)
        return (
            f"a support holds '{part}' {deepest:.3g} inside its rigid foundation at ({where}) at t = {t:.4g}, which no motion "
            "can mend; widen contact.gap there by as much, move the support out, or give a finite contact.stiffness"
        )


def _at_nodes(points: Any, places: Array, nodes: Array, held: Any) -> Iterator[tuple[int, Any, Array]]:
    from scipy.spatial import cKDTree  # a tenth of a second, for few scenes

    distance, found = cKDTree(nodes[held]).query(places)
    for point, away, node in zip(points, distance, held[found], strict=True):
        if away <= ROUNDING * np.ptp(nodes, axis=0).max():
            yield int(point), np.array([node]), np.ones(1)


def _on_facets(points: Any, places: Array, nodes: Array, facets: Any) -> Iterator[tuple[int, Any, Array]]:
    from scipy.spatial import cKDTree

    tree = cKDTree(places)
    for facet in facets:
        corners = nodes[facet]
        middle = corners.mean(axis=0)
        for i in tree.query_ball_point(middle, np.linalg.norm(corners - middle, axis=1).max()):
            weights = np.linalg.lstsq(np.vstack([corners.T, np.ones(len(facet))]), [*places[i], 1.0], rcond=None)[0]
            on = np.abs(weights @ corners - places[i]).max() <= 1e-9 * np.ptp(nodes, axis=0).max()
            if on and weights.min() > 0:
                yield int(points[i]), facet, weights
