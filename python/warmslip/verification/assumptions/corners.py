"""Singular exponents at the corners of a plane body: u ~ r^L, theta ~ r^L with the conditions on the two sides.

Plane elasticity: M. L. Williams, J. Appl. Mech. 19, 1952, in the form of A. Roessle, J. Elasticity 60, 2000. The tensor
that counts is that of the highest time derivative in play: the viscosity where there is one. A contact side is a
traction side here: the compliance and bounded friction are lower order. Lengths and angles (radians) as in the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warmslip.model.discretisation import Discretisation
from warmslip.scene.full import FullScene

MAX_EXPONENT = 2.0  # exponents beyond it do not limit P1 elements


@dataclass(frozen=True)
class Corner:
    """A boundary node where the direction or the condition changes; exponents are capped at MAX_EXPONENT, nan if undefined."""

    point: tuple[float, float]
    angle: float  # of the body, radians
    conditions: tuple[str, str]  # of u on the two sides: clamped, traction or contact
    exponent_u: float
    exponent_theta: float


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


def thermal_exponent(conductivity: Any, sides: NDArray[np.float64], angle: float, cooled: tuple[bool, bool]) -> float:
    """pi / a for equal conditions and pi / (2 a) for a cooled and a free (or exchanging) side; a is the opening where K is
    the identity. `sides` (2, 2): directions of the two sides. nan for a singular K."""
    k = np.array(conductivity, dtype=float)
    values, vectors = np.linalg.eigh(k)
    if values.min() <= 1e-12 * values.max():
        return float("nan")
    first, second = sides @ (vectors / np.sqrt(values)) @ vectors.T
    opening = float(np.arctan2(first[0] * second[1] - first[1] * second[0], first @ second)) % (2 * np.pi)
    # the same turn as in the body, which may pass pi
    opening = opening if (opening > np.pi) == (angle > np.pi) or abs(opening - np.pi) < 1e-9 else 2 * np.pi - opening
    return float(min(MAX_EXPONENT, np.pi / opening if cooled[0] == cooled[1] else np.pi / (2 * opening)))


def leading_lame(scene: FullScene) -> tuple[float, float]:
    """(lambda, mu) of the viscosity, or of the elasticity where there is no viscosity."""
    viscosity = scene.viscosity.pair(scene.mesh.dim)
    return viscosity if viscosity[1] > 0 else scene.elasticity.pair(scene.mesh.dim)


def corner_exponents(discretisation: Discretisation) -> list[Corner]:
    """All corners of a plane body, in mesh numbering. Raises ValueError for d = 3, where edges take the place of corners."""
    if discretisation.dim != 2:
        raise ValueError("corner exponents are for plane bodies; in space edges and vertices have their own")
    scene, nodes = discretisation.full, np.asarray(discretisation.mesh.nodes)
    at: dict[int, list[tuple[str, int]]] = {}
    for part, facets in discretisation.mesh.parts.items():
        for a, b in np.asarray(facets).tolist():
            at.setdefault(a, []).append((part, b))
            at.setdefault(b, []).append((part, a))
    angles = _openings(np.asarray(discretisation.mesh.cells), nodes, set(at))
    out = []
    for node, sides in sorted(at.items()):
        if len(sides) != 2:
            continue
        parts = sides[0][0], sides[1][0]
        clamped = tuple(part in scene.supports.displacement for part in parts)
        cooled = tuple(part in scene.supports.temperature for part in parts)
        angle = angles[node]
        if abs(angle - np.pi) < 1e-9 and clamped[0] == clamped[1] and cooled[0] == cooled[1]:
            continue
        directions = nodes[[sides[0][1], sides[1][1]]] - nodes[node]
        names = tuple(
            "clamped" if c else "contact" if part == scene.contact.part else "traction"
            for part, c in zip(parts, clamped, strict=True)
        )
        lam, mu = leading_lame(scene)
        u = elastic_exponent(lam, mu, angle, (clamped[0], clamped[1])) if mu > 0 else float("nan")
        theta = thermal_exponent(scene.heat.conductivity, directions, angle, (cooled[0], cooled[1]))
        x, y = nodes[node].tolist()
        out.append(Corner((x, y), angle, (names[0], names[1]), u, theta))
    return out


def _openings(cells: NDArray[np.int32], nodes: NDArray[np.float64], wanted: set[int]) -> dict[int, float]:
    """Sum of the cells' angles at the wanted nodes."""
    out = dict.fromkeys(wanted, 0.0)
    for i in range(3):
        a, b, c = (nodes[cells[:, (i + j) % 3]] for j in range(3))
        p, q = b - a, c - a
        turn = np.arctan2(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0], np.sum(p * q, axis=1))
        mine = np.isin(cells[:, i], list(wanted))
        for node, angle in zip(cells[mine, i].tolist(), turn[mine].tolist(), strict=True):
            out[node] += angle
    return out
