"""Fields with a status change that moves along the contact part: between open and closed, and between stick and slip.

The friction traction has a kink there, so that loads are smooth on either side only. Both are for the supports of the paper's
problem, in the plane or, the same across the second tangent, in space. Numbers are dimensionless.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from warmslip.scene.full import FullScene
from warmslip.verification.mms import symbolic
from warmslip.verification.mms.fields_smooth import HALF, TENTH, THOUSANDTH, cooled_walls
from warmslip.verification.mms.symbolic import ExactFields, T, X

# open for x < OPENING(t), closed beyond: between nodes of every grid at almost all times, and never at rest
OPENING = sp.Rational(3, 10) + T / 2
# stick for x < STICKING(t), slip beyond
SPEED = sp.Rational(2, 5)
STICKING = sp.Rational(1, 4) + SPEED * T


def _ramp(distance: Any, power: int) -> Any:
    return symbolic.when(distance > 0, distance**power)


def opening(scene: FullScene, lag: float = 0.0) -> ExactFields:
    """Slip to the right; the penetration is proportional to x - OPENING(t), so that the pressure has a kink there.

    u, w and theta are smooth and the traction is Lipschitz: quadrature errors at the kink are O(h^2) and of changing
    sign, and all orders of smooth data are owed. That of w on k = h^2 comes late, 1.4, 1.9, 2.0 from n = 8 on.
    """
    *tangents, n = symbolic.axes(scene.mesh.dim)
    u = [TENTH * (1 - n**2) * (1 + X / 2 * (1 - X / 2)) * sp.exp(T), *([sp.S.Zero] * (len(tangents) - 1))]
    down = -(1 - n) * (sp.nsimplify(scene.contact.gap, rational=True) + 3 * THOUSANDTH * (X - OPENING) * (1 + X / 4))
    ratio = sp.Matrix([1] + [0] * (scene.mesh.dim - 1))
    return ExactFields(
        sp.Matrix([*u, down]), TENTH * cooled_walls(scene) * (2 + sp.sin(6 * T)), "mixed", friction_ratio=ratio, lag=lag
    )


def stick_slip(scene: FullScene, lag: float = 0.0, power: int = 3) -> ExactFields:
    """Pressed everywhere; the slip is the ramp (x - STICKING)_+^power, the friction mu p (1 - (STICKING - x)_+).

    With power = 3 the body force is Lipschitz across x = STICKING(t) and the orders of smooth data are owed. With power
    = 2 it has a jump, for div A eps(w) has: w is in H2 still, but three Gauss points do not see where in a cell the jump
    is, and the error of the load is up to twice that of the method in w.
    """
    *tangents, n = symbolic.axes(scene.mesh.dim)
    start = X - STICKING.subs(T, 0)
    # over a step, what slipped at its beginning has moved
    edge = STICKING.subs(T, T - sp.nsimplify(lag, rational=True))
    slid = (_ramp(start, power + 1) - _ramp(X - STICKING, power + 1)) / ((power + 1) * SPEED)
    inside = n * (1 - n) * (1 + X / 2) * sp.sin(2 * T) * TENTH
    u = [HALF * (1 - n**2) * slid + inside, *([sp.S.Zero] * (len(tangents) - 1))]
    down = -THOUSANDTH * (1 - n) * (2 + sp.cos(sp.pi * X / 2)) * (1 + T / 2)
    ratio = sp.Matrix([1 - _ramp(edge - X, 1)] + [0] * (scene.mesh.dim - 1))
    theta = TENTH * cooled_walls(scene) * (2 + sp.sin(6 * T))
    return ExactFields(sp.Matrix([*u, down]), theta, "mixed", friction_ratio=ratio, lag=lag)
