"""How many solutions the steps of a scene may have, and the contact problem of a step as `uniqueness` takes it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip.model.discretisation import Discretisation
from warmslip.model.linear_pieces import POINTS, exact
from warmslip.model.uniqueness import ContactPoints, bound, shares_friction
from warmslip.scene import plausibility
from warmslip.scene.contact_tables import ContactTable
from warmslip.typing import Array


@dataclass(frozen=True)
class Finding:
    """What is known of the number of solutions of a scene's steps, whatever their loads and gaps.

    Attributes
    ----------
    coefficients
        The scene's different coefficients of friction above 0, dimensionless.
    factor
        Every step has one solution up to this number times the coefficients, dimensionless; infinite without friction.
    sharp
        Whether some load has several solutions, or none, beyond it.
    reason
        Why nothing is known, "" otherwise; `factor` is 0 then.
    shares
        Whether that is because a share of the forces changes a friction bound.
    """

    coefficients: tuple[float, ...]
    factor: float
    sharp: bool = False
    reason: str = ""
    shares: bool = False

    @property
    def most(self) -> float:
        """The largest coefficient up to which there is one solution, dimensionless."""
        return self.factor * max(self.coefficients, default=0.0)

    @property
    def several(self) -> bool:
        """Whether a step may have several solutions, as far as is known."""
        return self.factor < 1 and not self.reason


def condensed(d: Discretisation, stepper: Any) -> ContactPoints:
    """The contact points of the steps of a stepper, as its core has them.

    Raises
    ------
    ValueError
        For a body that nothing but its contact holds: its forces move it by no compliance.
    """
    compliance, motions = np.array(stepper.contact_compliance), np.asarray(stepper.contact_motions)
    if motions.shape[1:] > (0,):
        inertia = np.asarray(stepper.contact_inertia)
        if not inertia.any():
            raise ValueError("nothing but its contact holds the body")
        compliance += motions @ np.linalg.solve(inertia, motions.T)
    part, contacts = np.asarray(d.surface.contacts, dtype=int), d.scene.contacts
    rises = [math.inf if f"laws.{c.part}.compliance" in d.user_functions else steepest(c) for c in contacts]
    return ContactPoints(
        compliance=compliance,
        normals=np.asarray(d.surface.normals),
        weights=np.asarray(d.surface.weights),
        step=stepper.step,
        stiffness=np.array(rises)[part],
        friction=np.array([_coefficient(c) for c in contacts])[part],
        rubs=np.array([c.friction is not None or f"laws.{c.part}.friction" in d.user_functions for c in contacts])[
            part
        ],
    )


def posed(d: Discretisation, stepper: Any) -> tuple[ContactPoints, Array, Array]:
    """What `solutions` takes, of the step that was tried last: points, free velocity (points, d), penetration (points,).

    Raises
    ------
    ValueError
        See `condensed`.
    """
    free, motions = np.array(stepper.contact_free), np.asarray(stepper.contact_motions)
    points = condensed(d, stepper)
    if motions.shape[1:] > (0,):
        free += motions @ np.linalg.solve(np.asarray(stepper.contact_inertia), np.asarray(stepper.contact_rigid))
    return points, free.reshape(-1, d.dim), np.asarray(stepper.contact_penetration)


def steepest(contact: ContactTable) -> float:
    """The steepest rise of the pressure with the penetration, stress per length; infinite where there is none."""
    c, m, most = contact.compliance, contact.exponent, contact.pressure_limit
    if m == 1 or c == 0:
        return c
    return math.inf if most is None else m * c ** (1 / m) * most ** (1 - 1 / m)


def _coefficient(contact: ContactTable) -> float:
    return contact.friction.coefficient if contact.friction is not None and contact.compliance > 0 else 0.0


def of_scene(d: Discretisation, stepper: Any, *, enough: float = math.inf, touching: Any | None = None) -> Finding:
    """See `_find`; of the same contact laws, step size and points it is found once."""
    laws = tuple(
        (c.compliance, c.exponent, c.pressure_limit, c.friction.model_dump_json() if c.friction else "")
        for c in d.scene.contacts
    )
    key = "solutions", laws, stepper.step, enough, None if touching is None else touching.tobytes()
    return d.remember(key, lambda: _find(d, stepper, enough, touching))  # type: ignore[no-any-return]


def _find(d: Discretisation, stepper: Any, enough: float, touching: Any | None) -> Finding:
    """What is known of the steps of a stepper; `enough` as in `bound`, `touching` (points,) those that bear a force at most.

    Tresca's constant bound leaves one solution and takes no part; a limit and a regularisation change nothing. A friction that
    depends on the slip speed has none of this.
    """
    contacts = [c for c in d.scene.contacts if c.compliance > 0]
    own = [name for name in d.user_functions if name.endswith(".friction")]
    coefficients = tuple(sorted({_coefficient(c) for c in contacts} - {0.0}))
    if own or any(c.friction is not None and c.friction.speed for c in contacts if _coefficient(c)):
        return Finding(coefficients, 0.0, reason="friction depends on the slip speed")
    if not coefficients:
        return Finding((), math.inf)
    try:
        points = condensed(d, stepper)
    except ValueError as error:
        return Finding(coefficients, 0.0, reason=str(error))
    points = points.of(np.ones(len(points.weights), dtype=bool) if touching is None else touching).rubbing
    straight = all(c.linear for c in contacts) and not d.user_functions
    simple = all(
        c.friction is None or not (c.friction.limit or c.friction.regularisation or c.friction.cohesion)
        for c in contacts
    )
    shared = Finding(coefficients, 0.0, reason="its contact points share their forces in many ways", shares=True)
    if shares_friction(points):
        return shared
    if d.dim == 2 and straight and simple and len(points.weights) <= POINTS:
        try:
            return Finding(coefficients, exact(points), sharp=True)
        except np.linalg.LinAlgError:  # singular by a rounding more than `shares_friction` looks for
            return shared
    return Finding(coefficients, bound(points, enough=enough))


def line(found: Finding) -> str:
    """A finding in words, for `explain`; "" where the scene has no friction that follows the pressure."""
    if found.reason:
        return f"friction: no mu is known up to which every step has one solution, as {found.reason}"
    if not found.coefficients:
        return ""
    one = len(found.coefficients) == 1
    reach = (
        f"mu up to {plausibility.down(found.most)}"
        if one
        else f"up to {plausibility.down(found.factor)} times the coefficients of this scene"
    )
    tail = f"; this scene has {found.coefficients[0]:g}" if one else ""
    return f"friction: one solution in every step for {reach}{tail}"


def sentences(d: Discretisation, stepper: Any, stages: dict[str, int]) -> list[str]:
    """What a run says at its end where its friction is beyond the bound; `stages` counts its steps by how they were solved."""
    found = of_scene(d, stepper, enough=1.0)
    if found.shares:
        return plausibility.shares(max(found.coefficients))
    if found.reason:
        return plausibility.unknown(max(found.coefficients, default=None), found.reason)
    if not found.several:
        return []
    touching = np.asarray(stepper.status) > 0
    some = of_scene(d, stepper, touching=touching) if touching.any() and not touching.all() else None
    return plausibility.several(
        max(found.coefficients),
        found.most,
        sharp=found.sharp,
        timed=(d.scene.inertia is not None and d.scene.inertia.density > 0) or d.scene.viscosity is not None,
        now=(int(touching.sum()), plausibility.down(some.most)) if some is not None else (0, ""),
        other=sum(count for name, count in stages.items() if name not in ("none", "newton")),
        steps=sum(stages.values()),
    )
