"""From exact fields to the data that produce them, by sympy, for d = 2 and 3.

Put into the balance laws, any fields u, w = du/dt, theta give the sources and the tractions and heat fluxes of every part:

    f0 = rho dw/dt - div sigma,     sigma = A eps(w) + F eps(u) - theta M,     q0 = dtheta/dt + div q - R : eps(w)

The contact part (y = 0, in space z = 0) has a law of its own, p = p_nu(u_nu - g) and |lambda| <= mu p, and there are two ways
to obey it. What the law does not give can be prescribed as an extra traction and an extra flux,

    sigma nu + p nu + lambda = g_C,        k_c (theta - theta_F) - q.nu = h_C

or, by the paper's law alone, the fields are made such that g_C = 0 and h_C = 0 with

    g = u_nu + sigma_nu/c_nu,              theta_F = theta - q.nu/k_c

All numbers are dimensionless, as in the paper.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import sympy as sp

from warmslip.model.loads import Loads
from warmslip.model.materials import mandel
from warmslip.scene.full import FullScene
from warmslip.scene.mesh_table import PARTS
from warmslip.typing import Array

X, Y, Z, T = sp.symbols("x y z t", real=True)
# row and column of the Mandel components
PAIRS = {2: [(0, 0), (1, 1), (0, 1)], 3: [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]}

Function = Callable[[Array, float], Array]


@dataclass(frozen=True)
class ExactFields:
    """Exact fields in the symbols x, y[, z], t and what they do on the contact part; matrices are (d, 1).

    `contact_state` is what holds on all of the contact part at all times; "mixed" claims nothing beyond the law.
    `friction_ratio` is the friction traction lambda over its bound mu p; without it lambda is mu p w_tau/|w_tau|, or -sigma_tau
    for a state of "stick" under the paper's law alone, `satisfies_contact_law`.

    With `lag` = k > 0 the data are those of backward Euler with step k: d/dt is the difference over the last step, and what
    the coupling reads from the step before is taken from there. u and theta are then its exact solution at every step, up to
    errors in space.
    """

    u: Any
    theta: Any
    contact_state: Literal["slip", "stick", "mixed"]
    friction_ratio: Any = None
    satisfies_contact_law: bool = False
    lag: float = 0.0

    def before(self, field: Any) -> Any:
        """A field one lag ago."""
        return field.subs(T, T - sp.nsimplify(self.lag, rational=True)) if self.lag else field

    def rate(self, field: Any) -> Any:
        """The time derivative, or the difference over the lag."""
        return (field - self.before(field)) / sp.nsimplify(self.lag, rational=True) if self.lag else field.diff(T)

    @property
    def w(self) -> Any:
        return self.rate(self.u)


@dataclass(frozen=True)
class ContactData:
    """What happens on the contact part: p, mu p, lambda, w_tau and the extra traction g_C; (points,) and (points, d)."""

    pressure: Function
    bound: Function
    friction: Function
    slip: Function
    extra: Function


@dataclass(frozen=True)
class Manufactured:
    """Exact fields (functions of positions and time), the loads that produce them, and what they do on the contact part."""

    u: Function
    w: Function
    theta: Function
    gradient: Function
    loads: Loads
    touch: ContactData


def axes(dim: int) -> tuple[Any, ...]:
    """The symbols of the coordinates; the last one is normal to the contact part."""
    return (X, Y, Z)[:dim]


def function(expression: Any, dim: int) -> Function:
    """A sympy scalar or matrix as a function of positions (points, dim) and time; axes of length one are dropped."""
    shape = expression.shape if isinstance(expression, sp.MatrixBase) else ()
    compiled = sp.lambdify((*axes(dim), T), list(expression) if shape else [expression], "numpy", cse=True)
    columns = tuple(s for s in shape if s != 1)

    def value(x: Array, t: float) -> Array:
        values = [np.broadcast_to(np.asarray(v, dtype=float), (len(x),)) for v in compiled(*x.T, t)]
        return np.stack(values, axis=1).reshape((len(x), *columns)) if shape else np.array(values[0])

    return value


def when(condition: Any, value: Any) -> Any:
    """`value` where `condition` holds, else 0; to be differentiated branch by branch."""
    return sp.Piecewise((value, condition), (0, True))


def normal(part: str, dim: int) -> Any:
    """The outward unit normal of a part of the box, (d, 1)."""
    place = PARTS["square" if dim == 2 else "cube"].index(part)
    return sp.Matrix([(2 * (place % 2) - 1) * int(axis == place // 2) for axis in range(dim)])


def strain(v: Any) -> Any:
    """(grad v + grad v^T)/2, (d, d)."""
    gradient = v.jacobian(axes(len(v)))
    return (gradient + gradient.T) / 2


def stress(scene: FullScene, u: Any, w: Any, theta: Any) -> Any:
    """sigma of (2.1), (d, d), of fields (d, 1), (d, 1) and a scalar."""
    dim, root = len(u), sp.sqrt(2)
    sigma = -theta * sp.Matrix(scene.heat.expansion.tensor)
    for table, v in ((scene.viscosity, w), (scene.elasticity, u)):
        eps = strain(v)
        m = sp.Matrix([eps[i, j] * (1 if i == j else root) for i, j in PAIRS[dim]])
        tensor = [sp.nsimplify(float(c), rational=True) for c in mandel(table, dim).ravel()]
        for (i, j), s in zip(PAIRS[dim], sp.Matrix(len(m), len(m), tensor) * m, strict=True):
            for row, column in {(i, j), (j, i)}:
                sigma[row, column] += s if i == j else s / root
    return sigma


def read(scene: FullScene, fields: ExactFields) -> tuple[Any, Any]:
    """The temperature that the momentum balance reads and the velocity that the heat balance reads, by the coupling."""
    coupling = scene.time.coupling
    theta = fields.theta if coupling == "monolithic" else fields.before(fields.theta)
    return theta, fields.before(fields.w) if coupling == "lagged" else fields.w


def derive(scene: FullScene, fields: ExactFields, points: int = 3) -> Manufactured:
    """The loads under which `fields` solve the scene's problem; load quadrature has `points` points a direction.

    Whether the fields are what they claim to be is for `manufactured.derive` to say. Raises ValueError for a contact part
    other than the bottom, and when the law alone is to hold without stiffness or conductance.
    """
    dim, contact, exchange = scene.mesh.dim, scene.contact, scene.contact.heat_exchange
    if contact.part != "bottom":
        raise ValueError(f"manufactured fields touch at 'bottom', not at '{contact.part}'; change contact.part")
    if fields.satisfies_contact_law and not (contact.stiffness and exchange.conductance):
        raise ValueError("no gap and no foundation temperature act without stiffness and conductance; set both")
    x, nu, u, w, theta = axes(dim), normal(contact.part, dim), fields.u, fields.w, fields.theta
    theta_read, w_read = read(scene, fields)
    sigma = stress(scene, u, w, theta_read)
    q = -sp.Matrix(scene.heat.conductivity) * sp.Matrix([theta.diff(s) for s in x])
    work = sum(sp.Matrix(scene.heat.heating.tensor).multiply_elementwise(strain(w_read)))
    divergence = sp.Matrix([sum(sigma[i, j].diff(s) for j, s in enumerate(x)) for i in range(dim)])

    def on_contact(expression: Any) -> Function:
        return function(expression.subs(x[-1], 0), dim)

    law: dict[str, Any]
    if fields.satisfies_contact_law:
        pressure = -(nu.T * sigma * nu)[0]
        law = {
            "gap": on_contact(u.dot(nu) - pressure / contact.stiffness),
            "foundation_temperature": on_contact(theta - q.dot(nu) / exchange.conductance),
        }
    else:
        penetration = u.dot(nu) - contact.gap
        pressure = contact.stiffness * when(penetration > 0, penetration)
        law = {"gap": contact.gap, "foundation_temperature": exchange.foundation_temperature}
    bound, slip = contact.friction.coefficient * pressure, w - w.dot(nu) * nu
    if fields.friction_ratio is not None:
        friction = bound * fields.friction_ratio
    elif fields.contact_state == "stick":
        friction = nu.dot(sigma * nu) * nu - sigma * nu
    else:
        friction = bound * slip / sp.sqrt(slip.dot(slip))
    extra = sigma * nu + pressure * nu + friction
    touch = ContactData(*map(on_contact, (pressure, bound, friction, slip, extra)))
    if not fields.satisfies_contact_law:
        flux = exchange.conductance * (theta - exchange.foundation_temperature) - q.dot(nu)
        law |= {"contact_traction": touch.extra, "contact_flux": on_contact(flux)}

    sides = [part for part in scene.mesh.parts if part != contact.part]
    held, cooled = scene.supports.displacement, scene.supports.temperature
    loads = Loads(
        body=function(scene.inertia.density * fields.rate(w) - divergence, dim),
        source=function(fields.rate(theta) + sum(q[j].diff(s) for j, s in enumerate(x)) - work, dim),
        traction={part: function(sigma * normal(part, dim), dim) for part in sides if part not in held},
        heat_flux={part: function(-q.dot(normal(part, dim)), dim) for part in sides if part not in cooled},
        points=points,
        **law,
    )
    gradient = function(u.jacobian(x), dim)
    return Manufactured(function(u, dim), function(w, dim), function(theta, dim), gradient, loads, touch)
