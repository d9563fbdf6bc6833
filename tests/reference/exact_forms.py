"""Exact meshes of a few cells, the forms of (PF) on them and the quadrature of Gamma_C, from their definitions.

A scene is plain data, the tables of its TOML file. Component c of node a is entry d a + c of a vector field.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from reference.exact_numbers import Exact, Root3, determinant, eliminate, exact, eye, square_root, zeros

PARTS = {2: ("left", "right", "bottom", "top"), 3: ("left", "right", "front", "back", "bottom", "top")}


@dataclass(frozen=True)
class Mesh:
    """nodes (N, d) exact, cells of d+1 nodes positively oriented, boundary facets of d nodes by part."""

    nodes: Exact
    cells: Sequence[tuple[int, ...]]
    parts: Mapping[str, Sequence[tuple[int, ...]]]

    @property
    def dim(self) -> int:
        return int(self.nodes.shape[1])

    def facet(self, nodes: Sequence[int]) -> tuple[Exact, Fraction]:
        """Outward unit normal (d,) and measure; ValueError if they are irrational."""
        x = self.nodes[list(nodes)]
        edges = x[1:] - x[0]
        area = np.array([(-1) ** c * determinant(np.delete(edges, c, axis=1)) for c in range(self.dim)])
        inside = next(set(cell) - set(nodes) for cell in self.cells if set(nodes) < set(cell))
        if area @ (self.nodes[inside.pop()] - x[0]) > 0:
            area = -area
        size = square_root(area @ area)
        return area / size, size / math.factorial(self.dim - 1)


def box(*counts: int) -> Mesh:
    """The unit square or cube in cells, each cut into d! simplices along its main diagonal (Kuhn); x runs fastest."""
    d = len(counts)
    lattice = sorted(itertools.product(*(range(c + 1) for c in counts)), key=lambda p: p[::-1])
    number = {p: i for i, p in enumerate(lattice)}
    nodes, cells = exact(lattice) / exact(counts), []
    for corner in itertools.product(*map(range, counts)):
        for order in itertools.permutations(range(d)):
            path = [tuple(x + (a in order[:i]) for a, x in enumerate(corner)) for i in range(d + 1)]
            cell = [number[p] for p in path]
            if determinant(nodes[cell[1:]] - nodes[cell[0]]) < 0:
                cell[-2:] = cell[:-3:-1]
            cells.append(tuple(cell))
    facets = sorted({f for cell in cells for f in itertools.combinations(sorted(cell), d)})
    sides = {
        part: [f for f in facets if all(lattice[i][axis] == end * counts[axis] for i in f)]
        for part, (axis, end) in zip(PARTS[d], itertools.product(range(d), (0, 1)), strict=True)
    }
    return Mesh(nodes, cells, sides)


@dataclass(frozen=True)
class Forms:
    """Matrices and loads before supports: (w, v), a, b, (theta, eta), d, m, e and k_c (theta, eta) on Gamma_C; f and q."""

    inertia: Exact  # (dN, dN), with rho
    elasticity: Exact
    viscosity: Exact
    storage: Exact  # (N, N)
    conduction: Exact
    expansion: Exact  # (dN, N)
    heating: Exact  # (N, dN)
    exchange: Exact  # (N, N)
    force: Exact  # (dN,)
    source: Exact  # (N,), with k_c theta_F


def isotropic(table: Mapping[str, Any]) -> tuple[Fraction, Fraction]:
    """(a, b) of tau -> a tr(tau) I + b tau; E and kappa as in section 5 of the paper, (lambda, mu) as Lame's."""
    if table.get("lame"):
        lam, mu = exact(table["lame"])
        return lam, 2 * mu
    if table["assumption"] != "plane_stress":
        raise ValueError("the reference knows lame and the paper's plane stress")
    E, kappa = exact([table["young"], table["poisson"]])
    return E * kappa / (1 - kappa**2), E / (1 + kappa)


def assemble(scene: Mapping[str, Any], mesh: Mesh) -> Forms:
    """Exact integrals over cells and facets of affine functions and products of two."""
    d, N, heat, contact = mesh.dim, len(mesh.nodes), scene["heat"], scene["contact"]
    conductivity = exact(heat["conductivity"])
    expansion, heating = (exact(heat[name]["tensor"]) for name in ("expansion", "heating"))
    elastic, viscous = isotropic(scene["elasticity"]), isotropic(scene["viscosity"])
    body, source = exact(scene["loads"]["body"]), exact(heat["source"])[()]
    A, B, inertia = zeros(d * N, d * N), zeros(d * N, d * N), zeros(d * N, d * N)
    M, D, J, G, E = zeros(N, N), zeros(N, N), zeros(N, N), zeros(d * N, N), zeros(N, d * N)
    f, q = zeros(d * N), zeros(N)

    def products(nodes: Sequence[int], measure: Fraction) -> Exact:
        n = len(nodes)  # int phi_a phi_b over a simplex with n corners
        return measure * (eye(n) + np.ones((n, n), int)) / (n * (n + 1))

    for cell in map(list, mesh.cells):
        x = mesh.nodes[cell]
        # column a of the solution holds the coefficients of (1, x) in the hat function of corner a
        solved = eliminate(np.hstack([zeros(d + 1, 1) + 1, x]), eye(d + 1))
        assert solved is not None, "a flat cell"
        gradients = solved[0][1:].T
        volume = abs(determinant(x[1:] - x[0])) / math.factorial(d)
        strains = []
        for a, c in itertools.product(range(d + 1), range(d)):
            g = zeros(d, d)
            g[c] = gradients[a]
            strains.append((g + g.T) / 2)
        dofs = [d * a + c for a in cell for c in range(d)]
        for (i, e), (j, h) in itertools.product(zip(dofs, strains, strict=True), repeat=2):
            for matrix, (first, second) in ((A, elastic), (B, viscous)):
                matrix[i, j] += volume * (first * np.trace(e) * np.trace(h) + second * (e * h).sum())
        for i, e in zip(dofs, strains, strict=True):
            G[i, cell] += volume / (d + 1) * (expansion * e).sum()
            E[cell, i] += volume / (d + 1) * (heating * e).sum()
        D[np.ix_(cell, cell)] += volume * gradients @ conductivity @ gradients.T
        M[np.ix_(cell, cell)] += products(cell, volume)
        f[dofs] += volume / (d + 1) * np.tile(body, d + 1)
        q[cell] += volume / (d + 1) * source
    for c in range(d):
        inertia[c::d, c::d] = exact(scene["inertia"]["density"])[()] * M
    for part, traction in scene["loads"]["traction"].items():
        for facet in mesh.parts[part]:
            f[[d * a + c for a in facet for c in range(d)]] += mesh.facet(facet)[1] / d * np.tile(exact(traction), d)
    k_c, foundation = (exact(contact["heat_exchange"][x])[()] for x in ("conductance", "foundation_temperature"))
    for facet in mesh.parts[contact["part"]]:
        J[np.ix_(facet, facet)] += k_c * products(facet, mesh.facet(facet)[1])
    return Forms(inertia, A, B, M, D, G, E, J, f, q + J @ np.full(N, foundation))


@dataclass(frozen=True)
class ContactPoint:
    shape: Exact  # (N,), values of the hat functions
    position: Exact  # (d,)
    normal: Exact  # (d,)
    weight: Fraction


def contact_points(mesh: Mesh, part: str, quadrature: str, held: Sequence[int]) -> list[ContactPoint]:
    """The vertex rule (a point for each normal of a node that is not held), or Gauss's two points on an edge."""
    d, merged, points = mesh.dim, dict[tuple[Any, ...], Any](), []
    for facet in mesh.parts[part]:
        normal, measure = mesh.facet(facet)
        if quadrature == "nodal":
            for node in set(facet) - set(held):
                key = node, *normal
                merged[key] = merged.get(key, 0) + measure / d
        elif quadrature == "gauss-2" and d == 2:
            for sign in (1, -1):
                here = Root3(3, sign, 6)  # (1 + sign / sqrt 3) / 2
                shape = zeros(len(mesh.nodes))
                shape[list(facet)] = here, 1 - here
                points.append(ContactPoint(shape, shape @ mesh.nodes, normal, measure / 2))
        else:
            raise ValueError(f"no exact points for {quadrature} and d = {d}")
    for (node, *normal), weight in merged.items():
        points.append(ContactPoint(eye(len(mesh.nodes))[node], mesh.nodes[node], np.array(normal, object), weight))
    return points
