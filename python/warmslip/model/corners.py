"""Where the solution of a scene is singular: u ~ r^L, theta ~ r^L at corners of a plane body and edges of one in space.

Plane elasticity: M. L. Williams, J. Appl. Mech. 19, 1952, in the form of A. Roessle, J. Elasticity 60, 2000. The tensor
that counts is that of the highest time derivative in play: the viscosity where there is one. A contact side is a
traction side here, as a compliance is of lower order; on a rigid foundation it is a clamped one too, as its points may
stick, and the smaller exponent counts. Across an edge in space the displacement is in plane
strain, and its component along the edge behaves like a temperature. Lengths and angles (radians) as in the mesh.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warmslip.model.materials import mandel
from warmslip.scene.expressions import Expression
from warmslip.scene.material_tables import IsotropicTable
from warmslip.scene.scene import Scene
from warmslip.typing import Array

MAX_EXPONENT = 2.0  # exponents beyond it do not limit P1 elements
TURN = np.pi / 6  # a boundary that turns less is taken to be a curved one that the mesh approximates


@dataclass(frozen=True)
class Corner:
    """A place where the boundary turns or its condition changes: a node of a plane body, an edge (2 nodes) of one in space.

    Exponents are capped at MAX_EXPONENT, nan if undefined or if the field does not exist.
    """

    nodes: tuple[int, ...]
    point: tuple[float, ...]  # the middle of an edge
    angle: float  # of the body, radians
    conditions: tuple[str, str]  # of u on the two sides: clamped, traction or contact
    exponent_u: float
    exponent_theta: float

    @property
    def exponent(self) -> float:
        """The smaller one of those that are defined; MAX_EXPONENT where none is."""
        return min((one for one in (self.exponent_u, self.exponent_theta) if one == one), default=MAX_EXPONENT)


def elastic_exponent(lam: float, mu: float, angle: float, clamped: tuple[bool, bool]) -> float:
    """Smallest positive real part of L, at most MAX_EXPONENT, for the plane Lame pair (lam, mu). Raises ValueError for mu <= 0.

    clamped-clamped  sin^2(L a) = L^2 sin^2(a) / c^2;  free-free  sin^2(L a) = L^2 sin^2(a), its rotation L = 1 excluded;
    clamped-free     sin^2(L a) = (c + 1)^2 / (4 c) - L^2 sin^2(a) / c;  c = (lam + 3 mu) / (lam + mu).
    """
    if mu <= 0:
        raise ValueError(f"singular exponents need a positive shear modulus, got {mu:g}")
    c = (lam + 3 * mu) / (lam + mu)
    slope, constant = {0: (1.0, 0.0), 1: (-1 / c, (c + 1) ** 2 / (4 * c)), 2: (1 / c**2, 0.0)}[sum(clamped)]

    def f(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return np.asarray(np.sin(z * angle) ** 2 - constant - slope * z**2 * np.sin(angle) ** 2)

    def slope_of(z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return np.asarray(angle * np.sin(2 * z * angle) - 2 * slope * z * np.sin(angle) ** 2)

    real, imaginary = np.meshgrid(np.linspace(0.05, MAX_EXPONENT, 79), np.linspace(0, 2, 21))
    z = (real + 1j * imaginary).ravel()
    with np.errstate(all="ignore"):
        for _ in range(60):  # Newton from every start at once
            z = z - f(z) / slope_of(z)
        found = z[np.isfinite(z) & (np.abs(f(z)) < 1e-10) & (z.real > 1e-3) & (z.real < MAX_EXPONENT)]
    if not any(clamped):  # a rigid rotation is no singularity; a double root there is met slowly by Newton
        found = found[np.abs(found - 1) > 1e-4]
    return float(found.real.min()) if len(found) else MAX_EXPONENT


def scalar_exponent(opening: float, fixed: tuple[bool, bool]) -> float:
    """pi/a for equal conditions on the two sides of an opening a (radians), pi/(2 a) for different ones; at most MAX_EXPONENT."""
    return float(min(MAX_EXPONENT, np.pi / opening if fixed[0] == fixed[1] else np.pi / (2 * opening)))


def thermal_exponent(conductivity: Any, sides: Array, angle: float, cooled: tuple[bool, bool]) -> float:
    """`scalar_exponent` of the opening where K is the identity; nan for a singular K. `sides` (2, 2): their directions."""
    k = np.array(conductivity, dtype=float)
    values, vectors = np.linalg.eigh(k)
    if values.min() <= 1e-12 * values.max():
        return float("nan")
    first, second = sides @ (vectors / np.sqrt(values)) @ vectors.T
    opening = float(np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second)) % (2 * np.pi)
    # the same turn as in the body, which may pass pi
    opening = opening if (opening > np.pi) == (angle > np.pi) or abs(opening - np.pi) < 1e-9 else 2 * np.pi - opening
    return scalar_exponent(opening, cooled)


def lame(table: IsotropicTable, dim: int) -> tuple[float, float]:
    """(lambda, mu) of a table; of a full tensor those of the nearest isotropic one."""
    if table.tensor is None:
        return table.pair(dim)
    tensor = mandel(table, dim)
    swelling = float(tensor[:dim, :dim].sum()) / dim
    mu = (float(np.trace(tensor)) - swelling) / (2 * (len(tensor) - 1))
    return (swelling - 2 * mu) / dim, mu


def leading_lame(scene: Scene, region: Any = None) -> tuple[float, float]:
    """(lambda, mu) of the viscosity, or of the elasticity where there is none, of the body or of a region; zeros for neither."""
    for name in ("viscosity", "elasticity"):
        table = getattr(region, name, None) or getattr(scene, name)
        if table is not None and (pair := lame(table, scene.mesh.dim))[1] > 0:
            return pair
    return 0.0, 0.0


def corners(scene: Scene, mesh: Any) -> list[Corner]:
    """All corners of a plane body, or edges of one in space, on a mesh (`nodes`, `cells`, `parts`) of the scene.

    Corners of interfaces between materials, vertices in space, the ends of the contact zone and corners of parts that are held in
    some directions or on springs have exponents of their own, which are not looked for.
    """
    d = scene.mesh.dim
    nodes, cells = np.asarray(mesh.nodes), np.asarray(mesh.cells)
    facets, owners = _boundary(cells)
    named = {tuple(sorted(facet)): name for name, part in mesh.parts.items() for facet in np.asarray(part).tolist()}
    names = [named.get(tuple(sorted(facet)), "") for facet in facets.tolist()]
    around: dict[tuple[int, ...], list[int]] = {}
    for i, facet in enumerate(facets.tolist()):
        for ridge in itertools.combinations(sorted(facet), d - 1):
            around.setdefault(ridge, []).append(i)
    openings = _openings(cells, nodes, set(around))
    held, cooled_parts = set(scene.supports.clamped), set(scene.supports.temperature)
    guided = set(scene.supports.guided) | set(scene.supports.springs or {})
    touching = {contact.part for contact in scene.contacts}
    rigid = {contact.part for contact in scene.contacts if contact.rigid}
    elastic: dict[Any, float] = {}
    out = []
    for ridge, sides in sorted(around.items()):
        if len(sides) != 2:
            continue
        parts = names[sides[0]], names[sides[1]]
        clamped, cooled = (tuple(part in those for part in parts) for those in (held, cooled_parts))
        angle = openings[ridge]
        changes = clamped[0] != clamped[1] or cooled[0] != cooled[1]
        if abs(angle - np.pi) < TURN and not changes:
            continue
        region = _region(scene, mesh, int(owners[sides[0]]))
        lam, mu = leading_lame(scene, region)
        u = float("nan")
        if scene.moves and mu > 0 and not guided.intersection(parts):
            stuck = tuple(c or part in rigid for c, part in zip(clamped, parts, strict=True))
            for fixed in {clamped, stuck}:
                key = round(angle, 6), fixed, lam, mu
                if key not in elastic:
                    elastic[key] = elastic_exponent(lam, mu, angle, (fixed[0], fixed[1]))
                found = elastic[key] if d == 2 else min(elastic[key], scalar_exponent(angle, (fixed[0], fixed[1])))
                u = min(u, found) if u == u else found
        words = tuple(
            "clamped" if c else "contact" if part in touching else "traction"
            for part, c in zip(parts, clamped, strict=True)
        )
        place = nodes[list(ridge)].mean(axis=0)
        theta = _theta(scene, region, nodes, ridge, facets[sides], angle, (cooled[0], cooled[1]))
        out.append(Corner(ridge, tuple(place.tolist()), angle, (words[0], words[1]), u, theta))
    return out


def _theta(
    scene: Scene,
    region: Any,
    nodes: Array,
    ridge: tuple[int, ...],
    facets: Any,
    angle: float,
    cooled: tuple[bool, bool],
) -> float:
    if scene.heat is None:
        return float("nan")
    heat = getattr(region, "heat", None)
    given = heat.conductivity if heat is not None else scene.heat.conductivity
    if not isinstance(given, list):
        return scalar_exponent(angle, cooled) if np.any(np.asarray(given)) else float("nan")
    ends = [next(node for node in facet if node not in ridge) for facet in facets.tolist()]
    sides, k = nodes[ends] - nodes[ridge[0]], np.array(given, dtype=float)
    if len(ridge) == 2:  # across the edge: nothing changes along it
        along = nodes[ridge[1]] - nodes[ridge[0]]
        across = np.linalg.svd(along[None, :])[2][1:]
        k, sides = across @ k @ across.T, sides @ across.T
        turn = sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0]
        if (turn < 0) != (angle > np.pi):  # the first side to the second through the body
            sides = sides[::-1]
    return thermal_exponent(k, sides, angle, cooled)


def _region(scene: Scene, mesh: Any, cell: int) -> Any:
    """The region of a cell, None for the rest of the body."""
    found = None
    place = np.asarray(mesh.nodes)[np.asarray(mesh.cells)[cell]].mean(axis=0)[None, :]
    for name, region in scene.regions.items():
        inside = (
            bool(Expression(region.where)(place, 0.0)[0])
            if region.where is not None
            else cell in set(np.asarray(getattr(mesh, "regions", {}).get(name, ())).tolist())
        )
        found = region if inside else found
    return found


def _boundary(cells: Any) -> tuple[Any, Any]:
    """Facets of one cell only, (facets, d), and the cell of each."""
    size = cells.shape[1]
    columns = [[i for i in range(size) if i != left] for left in range(size)]
    every = np.concatenate([cells[:, column] for column in columns])
    owner = np.tile(np.arange(len(cells)), size)
    _, first, count = np.unique(np.sort(every, axis=1), axis=0, return_index=True, return_counts=True)
    alone = first[count == 1]
    return every[alone], owner[alone]


def _openings(cells: Any, nodes: Array, wanted: set[tuple[int, ...]]) -> dict[tuple[int, ...], float]:
    """Sum of the cells' angles at the wanted nodes (plane), or about the wanted edges (space)."""
    size = cells.shape[1]
    out = dict.fromkeys(wanted, 0.0)
    for at in itertools.combinations(range(size), size - 2):
        others = [i for i in range(size) if i not in at]
        origin = nodes[cells[:, at[0]]]
        p, q = (nodes[cells[:, i]] - origin for i in others)
        if len(at) == 2:
            axis = nodes[cells[:, at[1]]] - origin
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            p, q = (v - np.sum(v * axis, axis=1, keepdims=True) * axis for v in (p, q))
        cosine = np.sum(p * q, axis=1) / (np.linalg.norm(p, axis=1) * np.linalg.norm(q, axis=1))
        angles = np.arccos(np.clip(cosine, -1, 1))
        for ridge, angle in zip(np.sort(cells[:, list(at)], axis=1).tolist(), angles.tolist(), strict=True):
            if (key := tuple(ridge)) in out:
                out[key] += angle
    return out
