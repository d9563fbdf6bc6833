"""The forms of (PF), the loads and the contact points of a scene in 80 digits, from their definitions.

Component c of node a is entry d a + c of a vector field. What a formula gives is a double, as in any code; everything else,
the lengths of the mesh and the constants of the materials among it, are the doubles of the scene taken as exact.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from reference.extended_numbers import ONE, ZERO, Array, Big, big, entries, floats, matrix, mid, simplex_rule, zeros
from warmslip.scene.expressions import Expression
from warmslip.scene.scene import Scene

LOAD_POINTS = 3  # of a formula, an edge
PARTS = {2: ("left", "right", "bottom", "top"), 3: ("left", "right", "front", "back", "bottom", "top")}
VOIGT = {2: [(0, 0), (1, 1), (0, 1)], 3: [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]}


def values(data: Any, x: Array, t: float, components: int) -> Array:
    """Numbers or formulas, one or one a component, at positions x (points, d): (points, components)."""
    listed = data if isinstance(data, list | tuple) else [data] * components
    return np.column_stack([Expression(v)(x, t) if isinstance(v, str) else np.full(len(x), float(v)) for v in listed])


def formulas(data: Any) -> bool:
    return any(isinstance(v, str) for v in (data if isinstance(data, list | tuple) else [data]))


class Mesh:
    """A box in cells, cut along a diagonal as the scene says: nodes (N, d) doubles, cells (C, d+1), facets by part."""

    def __init__(self, scene: Scene) -> None:
        table = scene.mesh
        if table.file is not None or table.grading is not None:
            raise NotImplementedError("a mesh from a file, or a graded one")
        self.d = d = table.dim
        counts, sides = table.counts, table.sides
        lattice = [p[::-1] for p in itertools.product(*(range(c + 1) for c in reversed(counts)))]  # x runs fastest
        number = {p: i for i, p in enumerate(lattice)}
        nodes = [[length * i / n for length, i, n in zip(sides, p, counts, strict=True)] for p in lattice]
        self.cells: list[list[int]] = []
        for corner in (p[::-1] for p in itertools.product(*(range(c) for c in reversed(counts)))):
            if table.diagonal == "crisscross":
                centre = len(nodes)
                nodes.append([length * (i + 0.5) / n for length, i, n in zip(sides, corner, counts, strict=True)])
                ring = [number[corner[0] + a, corner[1] + b] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))]
                self.cells += [[a, b, centre] for a, b in itertools.pairwise(ring)]
                continue
            for order in itertools.permutations(range(d)):
                path = [[int(axis in order[:i]) for axis in range(d)] for i in range(d + 1)]
                if table.diagonal == "left":
                    path = [[1 - bits[0], *bits[1:]] for bits in path]
                cell = [number[tuple(a + b for a, b in zip(corner, bits, strict=True))] for bits in path]
                odd = sum(a > b for a, b in itertools.combinations(order, 2)) % 2
                if odd != (table.diagonal == "left"):
                    cell[-2:] = cell[:-3:-1]
                self.cells.append(cell)
        self.nodes = np.array(nodes)
        self.parts: dict[str, list[list[int]]] = {name: [] for name in PARTS[d]}
        for cell in self.cells:
            for left_out in range(d + 1):
                facet = cell[:left_out] + cell[left_out + 1 :]
                for name, (axis, end) in zip(PARTS[d], itertools.product(range(d), (0, 1)), strict=True):
                    if all(i < len(lattice) and lattice[i][axis] == end * counts[axis] for i in facet):
                        self.parts[name].append(facet)

    @cached_property
    def x(self) -> Big:
        return big(self.nodes)

    def nodes_of(self, part: str) -> list[int]:
        return sorted({i for facet in self.parts[part] for i in facet})

    def facet(self, nodes: list[int]) -> tuple[Big, Any]:
        """Outward unit normal (d,) and measure."""
        edges = self.x[nodes[1:]] - self.x[nodes[0]]
        area = np.array([edges[0][1], -edges[0][0]]) if self.d == 2 else np.cross(edges[0], edges[1]) / 2
        inside = next(c for c in self.cells if set(nodes) < set(c))
        (other,) = set(inside) - set(nodes)
        if (area @ (self.x[other] - self.x[nodes[0]])).mid() > 0:
            area = -area
        size = (area @ area).sqrt().mid()
        return mid(area / size), size


def isotropic(table: Any, d: int) -> Big:
    """The matrix (s, s) that takes engineering strains to stresses."""
    s = d * (d + 1) // 2
    if table.tensor is not None:
        return big(table.tensor)
    if table.lame is not None:
        lam, mu = big(table.lame)
    else:
        E, nu = big([table.young, table.poisson])
        mu = E / (2 * (1 + nu))
        lam = E * nu / (1 - nu**2) if table.assumption == "plane_stress" else E * nu / ((1 + nu) * (1 - 2 * nu))
    out = zeros(s, s)
    out[:d, :d] = lam
    for i in range(s):
        out[i, i] += 2 * mu if i < d else mu
    return out


def square(value: Any, d: int) -> Big:
    return big(value if isinstance(value, list) else np.eye(d) * value)


class Forms:
    """Matrices before supports: (w, v), a, b, (theta, eta), d, m, e, k_c (theta, eta); None for what is absent."""

    def __init__(self, scene: Scene, mesh: Mesh) -> None:
        if scene.regions:
            raise NotImplementedError("regions")
        d, N, heat = mesh.d, len(mesh.nodes), scene.heat
        self.scene, self.mesh = scene, mesh
        self.moves, self.conducts = scene.moves, heat is not None
        self.inertia = zeros(d * N, d * N) if scene.inertia and scene.inertia.density > 0 else None
        springs = scene.supports.springs or {}
        self.elasticity = zeros(d * N, d * N) if scene.elasticity or springs else None
        self.viscosity = zeros(d * N, d * N) if scene.viscosity or springs else None
        self.storage, self.conduction, self.exchange = (zeros(N, N) for _ in range(3))
        self.expansion = zeros(d * N, N) if heat and heat.expansion else None
        self.heating = zeros(N, d * N) if heat and heat.heating else None
        self.strains: list[tuple[list[int], Big]] = []  # dofs and strain matrix (s, d(d+1)) of every cell
        self.volumes: list[Any] = []
        for cell in mesh.cells:
            self._cell(cell)
        for part in springs:
            self._springs(part)
        for contact in scene.contacts:
            k_c = contact.heat_exchange.conductance if contact.heat_exchange else 0.0
            for facet in mesh.parts[contact.part] if k_c else ():
                _, size = mesh.facet(facet)
                self.exchange[np.ix_(facet, facet)] += self._products(len(facet), size * big(k_c))

    def _springs(self, part: str) -> None:
        """Adds those of a part to elasticity, and its dashpots to viscosity."""
        d, springs = self.mesh.d, (self.scene.supports.springs or {})[part]
        for axes, normal, into in (
            (springs.stiffness, springs.normal_stiffness, self.elasticity),
            (springs.damping, springs.normal_damping, self.viscosity),
        ):
            assert into is not None
            each = big(axes if isinstance(axes, list) else [axes] * d)
            for facet in self.mesh.parts[part]:
                nu, size = self.mesh.facet(facet)
                block = big(normal) * np.outer(nu, nu)
                block[np.arange(d), np.arange(d)] += each
                products = self._products(len(facet), size)
                for i, a in enumerate(facet):
                    for j, b in enumerate(facet):
                        into[d * a : d * (a + 1), d * b : d * (b + 1)] += products[i, j] * block

    @staticmethod
    def _products(corners: int, measure: Any) -> Big:
        """The integrals of products of hat functions over a simplex."""
        out = zeros(corners, corners) + measure / (corners * (corners + 1))
        out[np.arange(corners), np.arange(corners)] *= 2
        return out

    def _cell(self, cell: list[int]) -> None:
        d, scene = self.mesh.d, self.scene
        corners = np.hstack([zeros(d + 1, 1) + ONE, self.mesh.x[cell]])
        gradients = entries(matrix(corners).inv())[1:].T  # (corners, d)
        volume = (matrix(corners).det() / math.factorial(d)).mid()
        dofs = [d * a + c for a in cell for c in range(d)]
        strain = zeros(len(VOIGT[d]), len(dofs))
        for row, (i, j) in enumerate(VOIGT[d]):
            for a in range(d + 1):
                strain[row, d * a + i] = gradients[a, j]
                strain[row, d * a + j] = gradients[a, i]
        self.strains.append((dofs, strain))
        self.volumes.append(volume)
        both = np.ix_(dofs, dofs)
        B = matrix(strain)
        for table, into in ((scene.elasticity, self.elasticity), (scene.viscosity, self.viscosity)):
            if table is not None and into is not None:
                into[both] += volume * entries(B.transpose() * matrix(isotropic(table, d)) * B)
        if self.inertia is not None:
            block = self._products(d + 1, volume * big(scene.inertia.density))  # type: ignore[union-attr]
            for c in range(d):
                axis = dofs[c::d]
                self.inertia[np.ix_(axis, axis)] += block
        if scene.heat is None:
            return
        here = np.ix_(cell, cell)
        self.storage[here] += self._products(d + 1, volume * big(scene.heat.capacity))
        self.conduction[here] += volume * (gradients @ square(scene.heat.conductivity, d) @ gradients.T)
        for table, into in ((scene.heat.expansion, self.expansion), (scene.heat.heating, self.heating)):
            if into is None:
                continue
            full = square(table.tensor, d)  # type: ignore[union-attr]
            column = volume / (d + 1) * (strain.T @ np.array([full[i, j] for i, j in VOIGT[d]]))
            if into is self.expansion:
                into[np.ix_(dofs, cell)] += column[:, None]
            else:
                into[np.ix_(cell, dofs)] += column[None, :]

    def _load(self, out: Big, simplices: list[tuple[list[int], Any]], data: Any, t: float, components: int) -> None:
        """Adds the integral of the datum times every hat function over simplices (corners, measure)."""
        if not formulas(data) and not np.any(data):
            return
        dim = len(simplices[0][0]) - 1
        shape, weights = simplex_rule(dim, LOAD_POINTS if formulas(data) else 1)
        places = floats(shape)
        for nodes, measure in simplices:
            here = big(values(data, places @ self.mesh.nodes[nodes], t, components))
            added = measure * ((shape * weights[:, None]).T @ here)
            for a, node in enumerate(nodes):
                out[components * node : components * (node + 1)] += added[a]

    def _facets(self, part: str) -> list[tuple[list[int], Any]]:
        return [(facet, self.mesh.facet(facet)[1]) for facet in self.mesh.parts[part]]

    def loads(self, t: float) -> tuple[Big, Big]:
        """(f, v) and (q, eta) with the foundation's k_c theta_F, at time t."""
        scene, d, N = self.scene, self.mesh.d, len(self.mesh.nodes)
        force, source = zeros(d * N), zeros(N)
        cells = list(zip(self.mesh.cells, self.volumes, strict=True))
        if self.moves:
            self._load(force, cells, scene.loads.body or 0.0, t, d)
            for part, data in scene.loads.traction.items():
                self._load(force, self._facets(part), data, t, d)
        if scene.heat is not None:
            self._load(source, cells, scene.heat.source, t, 1)
            for part, flux in scene.loads.heat_flux.items():
                self._load(source, self._facets(part), flux, t, 1)
            for contact in scene.contacts:
                exchange = contact.heat_exchange
                if exchange and exchange.conductance:
                    warmed = zeros(N)
                    self._load(warmed, self._facets(contact.part), exchange.foundation_temperature, t, 1)
                    source = source + big(exchange.conductance) * warmed
        return mid(force), mid(source)

    def stress(self, u: Big, w: Big, theta: Big) -> Big:
        """Cauchy stress (cells, s) at the centroids, in the order xx, yy, xy or xx, yy, zz, yz, xz, xy."""
        scene, d = self.scene, self.mesh.d
        elastic, viscous = (isotropic(t, d) if t else None for t in (scene.elasticity, scene.viscosity))
        expansion = scene.heat.expansion if scene.heat else None
        out = zeros(len(self.mesh.cells), d * (d + 1) // 2)
        for i, ((dofs, strain), cell) in enumerate(zip(self.strains, self.mesh.cells, strict=True)):
            for tensor, field in ((elastic, u), (viscous, w)):
                if tensor is not None:
                    out[i] += tensor @ (strain @ field[dofs])
            if expansion is not None:
                full = square(expansion.tensor, d)
                warmer = sum(theta[cell], ZERO) / (d + 1) - big(expansion.reference_temperature or 0.0)
                out[i] -= warmer * np.array([full[a, b] for a, b in VOIGT[d]])
        return mid(out)


@dataclass(frozen=True)
class Point:
    """A point of the contact law: position, frame (rows: outward normal, tangents), weight, nodes and their shares."""

    position: Array
    frame: Big
    weight: Any
    nodes: list[int]
    shape: Big
    part: int


def frame(normal: Big) -> Big:
    """Normal and tangents as rows of an orthonormal (d, d)."""
    if len(normal) == 2:
        return np.array([normal, [-normal[1], normal[0]]], dtype=object)
    axis = zeros(3)
    axis[int(np.argmin(np.abs(floats(normal))))] = ONE
    first = np.cross(normal, axis)
    first = first / (first @ first).sqrt()
    return mid(np.array([normal, first, np.cross(normal, first)], dtype=object))


def contact_points(scene: Scene, mesh: Mesh) -> list[Point]:
    """All points of all parts that touch, those on supports too; at a node one for each normal."""
    out: list[Point] = []
    for part, contact in enumerate(scene.contacts):
        if contact.stiffness is None:
            continue
        at_node: dict[tuple[int, tuple[float, ...]], tuple[Big, Any]] = {}
        for nodes in mesh.parts[contact.part]:
            normal, size = mesh.facet(nodes)
            if contact.quadrature == "nodal":
                for node in nodes:
                    key = node, tuple(np.round(floats(normal), 12) + 0.0)
                    _, weight = at_node.get(key, (normal, ZERO))
                    at_node[key] = normal, weight + size / len(nodes)
                continue
            shape, weights = simplex_rule(mesh.d - 1, contact.points)
            for row, weight in zip(shape, weights, strict=True):
                x = floats(row) @ mesh.nodes[nodes]
                out.append(Point(x, frame(normal), (weight * size).mid(), nodes, row, part))
        for (node, _), (normal, weight) in at_node.items():
            one = zeros(1) + ONE
            out.append(Point(mesh.nodes[node], frame(normal), weight.mid(), [node], one, part))
    return out
