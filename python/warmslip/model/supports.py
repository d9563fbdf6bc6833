"""What supports hold: for every node the directions and the displacement along them, supports that meet joined."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from warmslip.model.loads import Data, Loads, given_displacement, of_time
from warmslip.model.materials import of_dim
from warmslip.scene.scene import Scene
from warmslip.scene.support_tables import NormalTable
from warmslip.typing import Array

EDGE = np.cos(np.deg2rad(20))  # facets whose normals differ more from their mean hold their node one by one
EXACT = 1e-14  # entries of directions and projectors that are nearer to 0 or 1 are rounding
ALIKE = 1e-3  # directions at a smaller angle count as one, as coordinates have few digits
AGREE, ROUNDING = 1e-6, 1e-12  # differences of displacements that are the same: relative to them, and to the body

Evaluate = Callable[[Data, Array, float, int, str], Array]


@dataclass(frozen=True)
class Support:
    """One entry of [supports]: nodes (n,), each with `directions` (n, d) along which one component of its data is given.

    `components` counts those of the data, and `component` says which of them belongs to this direction.
    """

    key: str
    name: str
    nodes: Array
    directions: Array
    given: Data
    components: int
    component: int


def supports(scene: Scene, loads: Loads, mesh: Any) -> list[Support]:
    """The supports of a scene on its mesh; what a function of `loads` gives takes the place of what the scene states.

    Raises
    ------
    ValueError
        For a point that is no place of the mesh.
    """
    d, out = scene.mesh.dim, []
    table, nodes = scene.supports, np.asarray(mesh.nodes)
    smooth = [part for part in table.displacement if isinstance(table.moved.get(part), NormalTable)]
    normals = _Normals(len(nodes), [(np.asarray(mesh.parts[part]), mesh.area_normals(part)) for part in smooth])
    for part in table.displacement:
        held = table.moved.get(part, [0.0] * d)
        key, name = f"supports.displacement.{part}", f"'{part}'"
        given = loads.displacement.get(part, 0.0)
        if isinstance(held, NormalTable):
            out += [
                Support(key, name, at, directions, given, 1, 0)
                for at, directions in normals.of(np.asarray(mesh.parts[part]), mesh.area_normals(part))
            ]
            continue
        at = np.unique(np.asarray(mesh.parts[part]))
        out += [
            Support(key, name, at, np.tile(np.eye(d)[i], (len(at), 1)), given, d, i)
            for i, value in enumerate(held)
            if value != "free"
        ]
    cells = nodes[np.asarray(mesh.cells)]
    for number, point in enumerate(table.points or []):
        distance = np.linalg.norm(nodes - point.at, axis=1)
        nearest = int(distance.argmin())
        if distance[nearest] > np.ptp(cells, axis=1).max():
            where = ", ".join(f"{x:g}" for x in point.at)
            raise ValueError(
                f"supports.points.{number}: the nearest node of ({where}) is {distance[nearest]:.3g} away; correct the place"
            )
        held = point.displacement or [0.0] * d
        given = given_displacement(held)
        out += [
            Support(f"supports.points.{number}", f"points.{number}", np.array([nearest]), np.eye(d)[[i]], given, d, i)
            for i, value in enumerate(held)
            if value != "free"
        ]
    return out


class SupportsContradictError(ValueError):
    """Supports give a common node displacements that contradict each other."""


class _Normals:
    """Normals of the nodes of several parts together, so that a surface may be cut into parts; (facets, areas) of each part."""

    def __init__(self, nodes: int, parts: list[tuple[Any, Array]]) -> None:
        facets, area = (
            (np.concatenate(one) for one in zip(*parts, strict=True)) if parts else (np.empty((0, 2), int),) * 2
        )
        self._mean = np.zeros((nodes, facets.shape[1]))
        for i in range(facets.shape[1]):
            np.add.at(self._mean, facets[:, i], area)
        size = np.linalg.norm(self._mean, axis=1, keepdims=True)
        self._mean = np.divide(self._mean, size, out=np.zeros_like(self._mean), where=size > 0)
        self._edge = np.zeros(nodes, dtype=bool)
        if len(facets):
            unit = area / np.linalg.norm(area, axis=1, keepdims=True)
            self._edge[facets[np.einsum("fa,fia->fi", unit, self._mean[facets]) < EDGE]] = True

    def of(self, facets: Any, area: Array) -> list[tuple[Array, Array]]:
        """Nodes of a part and a normal of each; at an edge, a node comes once for every smooth patch of facets there."""
        at = np.unique(facets)
        inside = at[~self._edge[at]]
        out = [(inside, _exact(self._mean[inside]))]
        for node in at[self._edge[at]]:
            patches = _patches(area[(facets == node).any(axis=1)])
            out += [(np.array([node]), _exact(patch[None])) for patch in patches]
        return [(where, normals) for where, normals in out if len(where)]


def _patches(area: Array) -> list[Array]:
    """Mean unit normals of facets that differ by no more than an edge does from the largest of them."""
    out = []
    size = np.linalg.norm(area, axis=1)
    left = np.ones(len(area), dtype=bool)
    while left.any():
        largest = np.flatnonzero(left)[size[left].argmax()]
        near = left & (area @ area[largest] >= EDGE * size * size[largest])
        mean = area[near].sum(axis=0)
        out.append(mean / np.linalg.norm(mean))
        left &= ~near
    return out


def _exact(values: Array) -> Array:
    """Entries that are 0 or +-1 but for rounding made so."""
    near = np.round(values)
    return np.where(np.abs(values - near) < EXACT, near, values)


@dataclass(frozen=True)
class Supports:
    """All supports of a problem together.

    Parameters
    ----------
    parts : list of Support
        In the order of the scene.
    positions : array
        Positions of all nodes, (nodes, d), length.
    """

    parts: list[Support]
    positions: Array

    @cached_property
    def nodes(self) -> Array:
        """Nodes that are held in some direction, (n,), in rising order."""
        return np.unique(np.concatenate([s.nodes for s in self.parts])) if self.parts else np.empty(0, dtype=int)

    @cached_property
    def _forms(self) -> tuple[Any, Array, Any, Any]:
        """Of every direction of a support, node by node: its node in `nodes`, the direction, its support, where it stood."""
        where = np.concatenate([np.searchsorted(self.nodes, s.nodes) for s in self.parts])
        number = np.concatenate([np.full(len(s.nodes), i) for i, s in enumerate(self.parts)])
        order = np.argsort(where, kind="stable")
        return where[order], np.concatenate([s.directions for s in self.parts])[order], number[order], order

    @cached_property
    def _groups(self) -> list[tuple[Any, Any, Array]]:
        """Nodes with equally many conditions: their places in `nodes` (n,), forms (n, m) and pseudo-inverses (n, d, m)."""
        if not self.parts:
            return []
        where, directions, _, _ = self._forms
        first, count = np.searchsorted(where, np.arange(len(self.nodes))), np.bincount(where, minlength=len(self.nodes))
        out = []
        for m in np.unique(count):
            at = np.flatnonzero(count == m)
            forms = first[at][:, None] + np.arange(m)
            out.append((at, forms, np.linalg.pinv(directions[forms], rcond=ALIKE)))
        return out

    @cached_property
    def projectors(self) -> Array:
        """Orthogonal projectors onto the held directions of `nodes`, (n, d, d)."""
        d = self.positions.shape[1]
        out = np.zeros((len(self.nodes), d, d))
        if self.parts:
            directions = self._forms[1]
            for at, forms, inverse in self._groups:
                full = inverse @ directions[forms]
                out[at] = _exact((full + full.swapaxes(1, 2)) / 2)
        return out

    @cached_property
    def still(self) -> Supports:
        """Those that do not move."""
        return Supports([s for s in self.parts if not of_time(s.given, s.component)], self.positions)

    @property
    def meet(self) -> bool:
        """Whether a node has more conditions than one for each axis it is held along."""
        return len(self._groups) > 0 and sum(len(s.nodes) for s in self.parts) > round(
            float(self.projectors.trace(axis1=1, axis2=2).sum())
        )

    def released(self, values: Array) -> Array:
        """Values at `nodes`, (n, d), without what lies in held directions."""
        return np.asarray(values - np.einsum("nab,nb->na", self.projectors, values))

    def partly_clamped(self, clamped: list[str], parts: Any) -> list[tuple[int, Array]]:
        """Nodes that lie on no clamped part, with their projectors."""
        on_clamped = np.zeros(len(self.positions), dtype=bool)
        for part in clamped:
            on_clamped[np.unique(parts[part])] = True
        return [
            (int(node), projector)
            for node, projector in zip(self.nodes, self.projectors, strict=True)
            if not on_clamped[node]
        ]

    @property
    def held(self) -> Any:
        """Which of all nodes are held in every direction, (nodes,)."""
        out = np.zeros(len(self.positions), dtype=bool)
        out[self.nodes[(self.projectors == np.eye(self.positions.shape[1])).all(axis=(1, 2))]] = True
        return out

    @property
    def of_time(self) -> bool:
        """Whether a support moves."""
        return any(of_time(support.given) for support in self.parts)

    def displacement(self, t: float, evaluate: Evaluate) -> Array:
        """The given displacement of `nodes` at time t, zero in directions that are free, (n, d), length.

        Raises
        ------
        SupportsContradictError
            Where supports contradict each other.
        """
        out = np.zeros((len(self.nodes), self.positions.shape[1]))
        if not self.parts:
            return out
        where, directions, number, order = self._forms
        given = np.concatenate(self._values(t, evaluate))[order]
        same = max(AGREE * np.abs(given).max(), ROUNDING * float(np.ptp(self.positions, axis=0).max()))
        for at, forms, inverse in self._groups:
            out[at] = np.einsum("naf,nf->na", inverse, given[forms])
            left = np.abs(np.einsum("nfa,na->nf", directions[forms], out[at]) - given[forms]).max(axis=1)
            if (left > same).any():
                raise SupportsContradictError(self._conflict(int(at[left.argmax()]), where, number, given, t))
        return out

    def _values(self, t: float, evaluate: Evaluate) -> list[Array]:
        known: dict[tuple[str, int], Array] = {}  # the components of one support are evaluated together
        out = []
        for support in self.parts:
            key = support.key, id(support.nodes)
            if key not in known:
                known[key] = evaluate(support.given, self.positions[support.nodes], t, support.components, support.key)
            out.append(known[key][:, support.component])
        return out

    def _conflict(self, node: int, where: Array, number: Array, given: Array, t: float) -> str:
        here, directions = np.flatnonzero(where == node), self._forms[1]
        names = list(dict.fromkeys(self.parts[i].name for i in number[here]))
        place = ", ".join(f"{x:.4g}" for x in self.positions[self.nodes[node]])
        along = [", ".join(f"{x:.3g}" for x in directions[i]) for i in here]
        values = ", ".join(
            f"{self.parts[number[i]].name} {given[i]:.4g} along ({way})" for i, way in zip(here, along, strict=True)
        )
        return (
            f"supports: {' and '.join(names)} hold their common node at ({place}) at displacements that contradict each other "
            f"at t = {t:.4g} ({values}); make them agree there, or leave a component free"
        )


def part_springs(scene: Scene) -> list[Any]:
    """The springs and dashpots of a scene as values of the core."""
    d = scene.mesh.dim
    return [
        of_dim("PartSprings", d)(
            part=part,
            stiffness=table.along("stiffness", d),
            normal_stiffness=table.normal_stiffness,
            damping=table.along("damping", d),
            normal_damping=table.normal_damping,
        )
        for part, table in (scene.supports.springs or {}).items()
    ]
