"""What the points of a contact part feel, ordered along the part: the fields that are plotted and compared."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warmslip.mesh.part_points import arc_length, located
from warmslip.messages import Shown
from warmslip.typing import Array


@dataclass(frozen=True)
class PartPoints:
    """The contact points of one part in their order along it; in space in the order of the run.

    `number` (points,) are their places among all contact points. In the plane `tangents` (points, 2) are orthogonal to the
    normals and point where the arc length grows.
    """

    part: str
    number: Any
    positions: Array
    normals: Array
    weights: Array
    arc_length: Array | None
    tangents: Array | None
    nodes: Any  # of the facet of each point, (points, d)
    shares: Array  # values of their hat functions at the point, (points, d)

    @classmethod
    def of(
        cls, part: str, mesh_nodes: Array, facets: Any, positions: Array, normals: Array, weights: Array, on: Any
    ) -> PartPoints:
        """Those points of a surface, (points,), of which `on` says that they lie on the part."""
        number = np.flatnonzero(on)
        length = tangents = None
        if mesh_nodes.shape[1] == 2:
            length, onwards = arc_length(mesh_nodes, facets, positions[number])
            order = np.argsort(length, kind="stable")
            number, length, onwards = number[order], length[order], onwards[order]
            turned = np.stack([-normals[number][:, 1], normals[number][:, 0]], axis=1)
            tangents = turned * np.where(np.sum(turned * onwards, axis=1) < 0, -1.0, 1.0)[:, None]
        facet, shares = located(mesh_nodes, facets, positions[number])
        return cls(
            part, number, positions[number], normals[number], weights[number], length, tangents, facets[facet], shares
        )

    def nodal(self, values: Array) -> Array:
        """A nodal field at the points: (nodes,) gives (points,), (nodes, d) gives (points, d)."""
        return np.asarray(np.einsum("pk,pk...->p...", self.shares, values[self.nodes]))

    def along(self, vectors: Array) -> Array:
        """Tangential parts of vectors (..., points, d): in the plane the component along the part, (..., points)."""
        if self.tangents is not None:
            return np.asarray(np.sum(vectors * self.tangents, axis=-1))
        inwards = np.sum(vectors * self.normals, axis=-1, keepdims=True)
        return np.asarray(vectors - inwards * self.normals)

    def speed(self, velocities: Array) -> Array:
        """Slip speeds of velocities (..., points, d), (..., points)."""
        tangential = self.along(velocities)
        return np.abs(tangential) if self.tangents is not None else np.asarray(np.linalg.norm(tangential, axis=-1))


@dataclass(frozen=True, repr=False)
class ContactFields(Shown):
    """Contact fields of one part at one time, or of all steps: then a first axis (steps,) comes before (points,).

    In the plane the points are ordered by their arc length, and `traction` and `slip` are components along the part, positive
    where the arc length grows. In space they are vectors, and the points keep the order of the run.

    Attributes
    ----------
    part : str
        Name of the part.
    time : float or array (steps,)
        Time.
    positions : array (points, d)
        Positions before deformation, length.
    arc_length : array (points,) or None
        Length along the part before deformation, from its end with the smallest x; None in space.
    weights : array (points,)
        Length or area that a point stands for.
    pressure : array (points,)
        Contact pressure, stress.
    traction : array (points,) or (points, d)
        Friction traction on the body, stress.
    slip : array (points,) or (points, d)
        Tangential displacement, length.
    gap : array (points,)
        Gap g - u_nu, length; a penetration is negative.
    status : array (points,) of int
        0 open, 1 stick, 2 slip.
    friction_bound : array (points,) or None
        Bound of the friction traction, stress; None where the law is a Python function that is not known.
    temperature : array (points,) or None
        Temperature of the body, nan in steps whose state is not stored; None without heat.
    """

    part: str
    time: Any
    positions: Array
    arc_length: Array | None
    weights: Array
    pressure: Array
    traction: Array
    slip: Array
    gap: Array
    status: Any
    friction_bound: Array | None
    temperature: Array | None

    def at(self, step: int) -> ContactFields:
        """The fields of one step of a history, counted from 0."""
        names = ("time", "pressure", "traction", "slip", "gap", "status", "friction_bound", "temperature")
        whole = {name: getattr(self, name) for name in names}
        values: dict[str, Any] = {name: None if one is None else one[step] for name, one in whole.items()}
        return replace(self, **values)

    @property
    def normal_force(self) -> Any:
        """Integral of the pressure over the part, force: a number, or (steps,)."""
        return self.pressure @ self.weights

    @property
    def friction_force(self) -> Any:
        """Integral of the friction traction on the body, force: a number or (steps,), in space (d,) or (steps, d)."""
        if self.arc_length is not None:
            return self.traction @ self.weights
        return np.einsum("...pd,p->...d", self.traction, self.weights)

    def _facts(self) -> dict[str, str]:
        times = np.atleast_1d(self.time)
        when = f"{times[0]:g}" if len(times) == 1 else f"{times[0]:g} to {times[-1]:g}, {len(times)} steps"
        counts = (
            f"{100 * float(np.mean(self.status == i)):.0f} % {name}" for i, name in enumerate(("open", "stick", "slip"))
        )
        return {
            "": f"part '{self.part}'",
            "t =": when,
            "points": f"{len(self.weights)} ({', '.join(counts)})",
            "largest pressure": f"{float(self.pressure.max()):.3g}",
        }


def bounds(law: Any, pressure: Array, speed: Array) -> Array:
    """The friction bound of a contact law of the core at pressures and slip speeds of the same shape."""
    friction = law.friction
    values = [
        friction.bound(p, v)
        for p, v in zip(np.maximum(pressure, 0).ravel().tolist(), speed.ravel().tolist(), strict=True)
    ]
    return np.array(values, dtype=float).reshape(pressure.shape)


def contact_fields_on(
    points: PartPoints,
    law: Any,
    *,
    time: Any,
    force: Array,
    displacement: Array,
    status: Any,
    gap: Array,
    speed: Array,
    temperature: Array | None,
) -> ContactFields:
    """Contact fields of arrays of all contact points: `force`, `displacement` (..., all points, d), `status`, `gap` without d.

    `speed` and `temperature` are those of the points of the part, (..., points); `law` of the core is None where it is not known.
    """
    here = points.number
    force, displacement = force[..., here, :], displacement[..., here, :]
    pressure = np.sum(force * points.normals, axis=-1) / points.weights
    weights = points.weights if points.tangents is not None else points.weights[:, None]
    return ContactFields(
        part=points.part,
        time=time,
        positions=points.positions,
        arc_length=points.arc_length,
        weights=points.weights,
        pressure=pressure,
        traction=-points.along(force) / weights,
        slip=points.along(displacement),
        gap=gap[..., here] - np.sum(displacement * points.normals, axis=-1),
        status=np.asarray(status)[..., here].astype(int),
        friction_bound=None if law is None else bounds(law, pressure, speed),
        temperature=temperature,
    )


def chosen_part(part: str | None, touching: list[str]) -> str:
    """The name of a contact part: that of the only one for None. Raises ValueError for a part without contact points."""
    known = ", ".join(f"'{name}'" for name in touching)
    if part is None and len(touching) == 1:
        return touching[0]
    if not touching:
        raise ValueError("no part of the scene touches a foundation; give a [contact] table with a stiffness")
    if part is None:
        raise ValueError(f"part: the scene has several contact parts; give one of {known}")
    if part not in touching:
        raise ValueError(f"part: no contact points lie on {part!r}; give one of {known}")
    return part
