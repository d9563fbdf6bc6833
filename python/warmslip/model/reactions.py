"""Forces and moments with which supports and springs hold the body, by support."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip.model.discretisation import Discretisation
from warmslip.model.supports import ALIKE, Supports
from warmslip.scene.scene import Scene
from warmslip.typing import Array


class Reactions:
    """Reaction force and moment of every support of a discretisation.

    Where supports meet at a node, each takes the reaction along its own directions. A direction that several of them hold
    counts for the first in the order of the scene: displacement, points. The sum over all supports is the whole reaction.

    Attributes
    ----------
    names : list of str
        Parts of supports.displacement, `points.0` ... of supports.points, and `springs.PART` of supports.springs.
    """

    def __init__(self, d: Discretisation) -> None:
        self._d, self._springs = d, _springs(d.scene, d.mesh)
        supports = d.load_vectors.supports
        held = list(dict.fromkeys(_name(support.key) for support in supports.parts))
        self.names = [*held, *(f"springs.{part}" for part in d.scene.supports.springs or {})]
        self._held = len(held)
        nodes, number, shares = _shares(supports, held)
        owned = np.full(len(d.mesh.nodes), -1)
        owned[np.asarray(d.layout.mesh_nodes)[: d.layout.owned_nodes]] = np.arange(d.layout.owned_nodes)
        mine = owned[nodes] >= 0
        self._at, self._number, self._shares = owned[nodes[mine]], number[mine], shares[mine]
        self._positions = supports.positions[nodes[mine]]

    @property
    def moments(self) -> int:
        """Components of a moment: 1 in the plane, 3 in space."""
        return 1 if self._d.dim == 2 else 3

    def of(self, stepper: Any) -> tuple[Array, Array]:
        """Of the step that a stepper evaluated last (collective).

        Returns
        -------
        force : array (supports, d)
            On the body, in the order of `names`.
        moment : array (supports, 1 or 3)
            About the origin, of these forces: along z in the plane.
        """
        d = self._d.dim
        out = np.zeros((len(self.names), d + self.moments))
        if self._held:
            vector = stepper.reactions
            forces = np.einsum("nab,nb->na", self._shares, vector.getArray(readonly=1).reshape(-1, d)[self._at])
            np.add.at(out, self._number, np.hstack([forces, moments(self._positions, forces)]))
            out = np.asarray(vector.comm.tompi4py().allreduce(out))
        if self._springs:
            u, w = (self._d.field(vector) for vector in (stepper.u, stepper.w))
            for i, (facets, stiffness, damping) in enumerate(self._springs, start=self._held):
                forces = -_consistent(facets, stiffness, u) - _consistent(facets, damping, w)
                x = np.asarray(self._d.mesh.nodes)[facets]
                out[i] = np.concatenate([forces.sum(axis=(0, 1)), moments(x, forces).sum(axis=(0, 1))])
        return out[:, :d], out[:, d:]


def moments(x: Array, forces: Array) -> Array:
    """Moments about the origin of forces (..., d) at places x (..., d): (..., 1) in the plane, (..., 3) in space."""
    if x.shape[-1] == 3:
        return np.asarray(np.cross(x, forces))
    return np.asarray(x[..., :1] * forces[..., 1:] - x[..., 1:] * forces[..., :1])


def _name(key: str) -> str:
    return key.removeprefix("supports.").removeprefix("displacement.")


def _shares(supports: Supports, names: list[str]) -> tuple[Any, Any, Array]:
    """Of every direction of a support: its node, the number of its name, and the (d, d) matrix that gives its share of the
    node's reaction."""
    d = supports.positions.shape[1]
    if not supports.parts:
        return np.empty(0, dtype=int), np.empty(0, dtype=int), np.empty((0, d, d))
    nodes = np.concatenate([support.nodes for support in supports.parts])
    directions = np.concatenate([support.directions for support in supports.parts])
    number = np.concatenate([np.full(len(s.nodes), names.index(_name(s.key))) for s in supports.parts])
    order = np.argsort(nodes, kind="stable")
    nodes, directions, number = nodes[order], directions[order], number[order]
    shares = np.empty((len(nodes), d, d))
    _, first, count = np.unique(nodes, return_index=True, return_counts=True)
    for m in np.unique(count):
        forms = first[count == m][:, None] + np.arange(m)
        chosen = directions[forms] * _independent(directions[forms])[..., None]
        shares[forms] = np.einsum("nma,nbm->nmab", chosen, np.linalg.pinv(chosen, rcond=ALIKE))
    return nodes, number, shares


def _independent(directions: Array) -> Array:
    """Which of the unit directions (n, m, d) of a node do not depend on those before, 1 or 0, (n, m)."""
    out, basis = np.zeros(directions.shape[:2]), np.zeros_like(directions)
    for i in range(directions.shape[1]):
        rest = directions[:, i] - np.einsum("nja,njb,nb->na", basis, basis, directions[:, i])
        size = np.linalg.norm(rest, axis=1)
        out[:, i] = size > ALIKE
        basis[:, i] = rest / np.where(size > ALIKE, size, np.inf)[:, None]
    return out


def _springs(scene: Scene, mesh: Any) -> list[tuple[Any, Array, Array]]:
    """Facets of each part on springs, and stiffness and damping of each times its area, (facets, d, d)."""
    out = []
    for part, table in (scene.supports.springs or {}).items():
        normals = mesh.area_normals(part)
        area = np.linalg.norm(normals, axis=1)[:, None, None]
        across = np.einsum("fa,fb->fab", normals, normals) / area
        d = scene.mesh.dim
        stiffness = np.diag(np.array(table.along("stiffness", d))) * area + table.normal_stiffness * across
        damping = np.diag(np.array(table.along("damping", d))) * area + table.normal_damping * across
        out.append((np.asarray(mesh.parts[part]), stiffness, damping))
    return out


def _consistent(facets: Any, tensors: Array, values: Array) -> Array:
    """Nodal forces int phi_i T v of P1 functions on facets, (facets, d, d) by node and component."""
    d = facets.shape[1]
    mass = (np.ones((d, d)) + np.eye(d)) / (d * (d + 1))
    return np.asarray(np.einsum("ij,fab,fjb->fia", mass, tensors, values[facets]))
