"""Smooth fields on the unit square and cube with full slip or full stick: what the theorem's orders are owed to.

All press the body into the foundation and vanish on the top; `supports` says where else. The last coordinate, n below, is normal
to the contact part n = 0. Amplitudes are chosen for materials of the size of the paper's; whether they fit others is checked
when the data are derived. Numbers are dimensionless.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import sympy as sp

from warmslip.scene.full import FullScene
from warmslip.verification.mms import symbolic
from warmslip.verification.mms.symbolic import ExactFields, T, X, Y

HALF, TENTH, THOUSANDTH = sp.Rational(1, 2), sp.Rational(1, 10), sp.Rational(1, 1000)


def cooled_walls(scene: FullScene) -> Any:
    """A temperature that is zero everywhere but inside and on the contact part."""
    *tangents, n = symbolic.axes(scene.mesh.dim)
    return sp.prod([sp.sin(sp.pi * s) for s in tangents]) * (1 - n) * (1 + n / 2)


def waves(scene: FullScene) -> Any:
    """A pressure profile between 2 and 5/2 on the contact part, gentle enough for coarse meshes."""
    tangents = symbolic.axes(scene.mesh.dim)[:-1]
    return 2 + sum(sp.cos(sp.pi * s / 2) for s in tangents) / (2 * len(tangents))


def slip(scene: FullScene, lag: float = 0.0) -> ExactFields:
    """Slip everywhere; in space its direction turns along the surface and in time. Supports as in the paper's problem."""
    n = symbolic.axes(scene.mesh.dim)[-1]
    along = [
        (1 + X / 2 * (1 - X / 2)) * sp.exp(T),
        (1 + Y / 4) * sp.sin(2 * T),
    ][: scene.mesh.dim - 1]
    u = [TENTH * (1 - n**2) * s for s in along]
    down = -THOUSANDTH * (1 - n) * waves(scene) * (1 + T / 2)
    return ExactFields(sp.Matrix([*u, down]), TENTH * cooled_walls(scene) * (2 + sp.sin(6 * T)), "slip", lag=lag)


def slip_by_law(scene: FullScene, lag: float = 0.0) -> ExactFields:
    """Slip under the paper's law alone: all fields grow as exp(t), and sigma_tau = -mu p w_tau/|w_tau| holds on n = 0.

    The tangential part a(1 - n^2) + b n (1 - n) has the slip a, and b is what sigma_tau lacks without it: b changes neither the
    slip nor sigma_nu on n = 0, only the shear strain. In space the direction of a turns along the surface. Raises ValueError
    for a material without shear stiffness.
    """
    dim = scene.mesh.dim
    n, grow = symbolic.axes(dim)[-1], sp.exp(T)
    direction = [1] if dim == 2 else [sp.cos((X * Y + 1) / 2), sp.sin((X * Y + 1) / 2)]
    down = -2 * TENTH**2 * (1 - n) * (1 + 3 * n) * waves(scene)
    u = sp.Matrix([*(TENTH / 2 * (1 + X / 2 * (1 - X / 2)) * c * (1 - n**2) for c in direction), down])
    plain = ExactFields(u * grow, TENTH * cooled_walls(scene) * grow, "slip", satisfies_contact_law=True, lag=lag)
    sigma = symbolic.stress(scene, plain.u, plain.w, symbolic.read(scene, plain)[0]).subs({n: 0, T: 0})
    viscous, elastic = (
        sp.nsimplify(table.pair(dim)[1], rational=True) for table in (scene.viscosity, scene.elasticity)
    )
    shear = (viscous * plain.rate(grow) + elastic * grow).subs(T, 0)
    if shear == 0:
        raise ValueError("a material without shear stiffness passes no friction on; set viscosity or elasticity")
    # nu = -e_n: the traction's tangential part is -sigma_in, the pressure -sigma_nn
    bound = -sp.nsimplify(scene.contact.friction.coefficient, rational=True) * sigma[-1, -1]
    b = [(bound * c - sigma[i, -1]) / shear for i, c in enumerate(direction)]
    return replace(plain, u=plain.u + sp.Matrix([*(c * n * (1 - n) for c in b), 0]) * grow)


def stick(scene: FullScene, lag: float = 0.0) -> ExactFields:
    """Stick under the paper's law alone: the tangential displacement of the contact part is frozen, the body above it moves."""
    dim = scene.mesh.dim
    *tangents, n = symbolic.axes(dim)
    frozen = [TENTH**2 * (1 - n**2) * sp.cos(sp.pi * s / 2) for s in tangents]
    moving = [TENTH * n**2 * (1 - n) * (1 + s * (1 - s / 2)) * sp.sin(2 * T) for s in tangents]
    profile = 2 + sp.cos(sp.pi * X / 2) / 4
    down = -(TENTH**2) * (1 - n) * (1 + 3 * n) * profile * (1 + T + T**2 / 4)
    u = sp.Matrix([*(f + m for f, m in zip(frozen, moving, strict=True)), down])
    return ExactFields(
        u, TENTH * cooled_walls(scene) * (2 + sp.sin(3 * T)), "stick", satisfies_contact_law=True, lag=lag
    )


def affine(scene: FullScene, lag: float = 0.0) -> ExactFields:
    """Affine in space, anything in time, with a constant pressure and direction of slip: P1 elements make no error in space.

    With `lag` = k the discrete solution is the exact one to round-off on any mesh; without, its error is that of backward
    Euler. For a floating body, no supports.
    """
    dim = scene.mesh.dim
    *tangents, n = symbolic.axes(dim)
    stretch = 1 + (sum(tangents) / 5 + 2 * n / 5)
    # all of one direction on n = 0, which turns in time when there are two tangents
    u = [
        TENTH * stretch * grow + TENTH**2 * n * sp.cos(T + i)
        for i, grow in enumerate([sp.exp(T), sp.sin(2 * T)][: dim - 1])
    ]
    down = -THOUSANDTH * (1 + T / 2 + sp.sin(3 * T) / 4) + TENTH**2 * n * sp.exp(-T)
    theta = 3 + sp.sin(6 * T) + sum((i + 1) * s for i, s in enumerate([*tangents, n])) * sp.cos(T)
    return ExactFields(sp.Matrix([*u, down]), theta, "slip", lag=lag)
