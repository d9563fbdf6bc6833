"""A state of a run as arrays in mesh numbering, and what its contact points feel under the usual names."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from warmslip.messages import Shown
from warmslip.model.contact_output import ContactFields, PartPoints, chosen_part, contact_fields_on
from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array


class StressFields(Shown):
    """Stresses of a state that has `discretisation`, `time` and `_straining`: u, w (nodes, d) and theta (nodes,), or None."""

    discretisation: Discretisation
    step: int
    time: float

    @property
    def _straining(self) -> tuple[Any, Any, Any]:
        raise NotImplementedError

    def _facts(self) -> dict[str, str]:
        problem, points = self.discretisation.problem, len(self.discretisation.surface.weights)
        fields = ["displacement", "velocity"] * problem.moves + ["temperature"] * problem.conducts
        contact = {"contact points": str(points)} if points else {}
        return {"step": str(self.step), "t =": f"{self.time:g}", "fields": ", ".join(fields)} | contact

    @cached_property
    def stress(self) -> Array | None:
        """Cauchy stress (2.1) of the cells, (cells, d, d); None when nothing moves."""
        return self._found(self.discretisation.stress)

    @cached_property
    def stress_zz(self) -> Array | None:
        """Stress of the cells along z, (cells,), of a body in the plane: 0 in plane stress. None when nothing moves."""
        return self._found(self.discretisation.stress_zz)

    @cached_property
    def mises(self) -> Array | None:
        """Von Mises stress of the cells, (cells,); it counts the stress along z."""
        return self._found(self.discretisation.mises_of)

    @property
    def nodal_stress(self) -> Array | None:
        """Cauchy stress at the nodes, the mean of the cells around each, (nodes, d, d); see `Discretisation.nodal`."""
        return None if self.stress is None else self.discretisation.nodal(self.stress)

    def _found(self, of: Callable[..., Array]) -> Array | None:
        return of(*self._straining) if self.discretisation.problem.moves else None


class State(StressFields):
    """What a stepper holds after a step.

    Arrays are gathered when they are first read, on all ranks together (collective).

    Raises
    ------
    RuntimeError
        When a field is first read after the next step.
    """

    def __init__(self, discretisation: Discretisation, stepper: Any, step: int) -> None:
        self.discretisation, self._stepper, self.step = discretisation, stepper, step
        self.time = float(stepper.time)

    def _now(self) -> Any:
        if self._stepper.time != self.time:
            raise RuntimeError(f"the state of step {self.step} was not read before the next step; read it in the loop")
        return self._stepper

    @cached_property
    def u(self) -> Any:
        """Displacement, length, (nodes, d); None when nothing moves."""
        return self.discretisation.field(self._now().u)

    @cached_property
    def w(self) -> Any:
        """Velocity, (nodes, d); None when nothing moves."""
        return self.discretisation.field(self._now().w)

    @cached_property
    def theta(self) -> Any:
        """Temperature, (nodes,); None without heat."""
        return self.discretisation.field(self._now().theta)

    @cached_property
    def _straining(self) -> tuple[Any, Any, Any]:
        return self.discretisation.straining(self._now())

    @cached_property
    def contact(self) -> dict[str, Array]:
        """See `contact_fields`."""
        now, shape = self._now(), (-1, self.discretisation.dim)
        force, moved = np.reshape(now.contact_force, shape), np.reshape(now.contact_displacement, shape)
        gap = self.discretisation.load_vectors.on_points("gap", self.time)
        return contact_fields(self.discretisation, force, moved, now.status, gap)

    def contact_on(self, part: str | None = None) -> ContactFields:
        """Contact fields of a part, ordered along it (collective).

        Parameters
        ----------
        part : str, optional
            Name of a contact part; not needed where there is only one.

        Returns
        -------
        ContactFields
            Arc length, pressure, friction traction and its bound, slip, gap, status, temperature.

        Raises
        ------
        ValueError
            For a part without contact points.
        """
        d, now = self.discretisation, self._now()
        points, shape = part_points(d, part), (-1, d.dim)
        return contact_fields_on(
            points,
            d.law(points.part),
            time=self.time,
            force=np.reshape(now.contact_force, shape),
            displacement=np.reshape(now.contact_displacement, shape),
            status=np.asarray(now.status),
            gap=d.load_vectors.on_points("gap", self.time),
            speed=points.speed(points.nodal(self.w) - d.load_vectors.drive(self.time)[points.number]),
            temperature=None if self.theta is None else points.nodal(self.theta),
        )


def part_points(d: Discretisation, part: str | None) -> PartPoints:
    """The contact points of a part, of the only one for None. Raises ValueError for a part without contact points."""
    numbers = np.asarray(d.surface.contacts, dtype=int)
    names = [contact.part for contact in d.scene.contacts]
    name = chosen_part(part, [names[i] for i in np.unique(numbers)])

    def find() -> PartPoints:
        surface, mesh = d.surface, d.mesh
        x, normals, weights = (np.asarray(one) for one in (surface.positions, surface.normals, surface.weights))
        on = numbers == names.index(name)
        return PartPoints.of(name, np.asarray(mesh.nodes), np.asarray(mesh.parts[name]), x, normals, weights, on)

    return d.remember(("points", name), find)  # type: ignore[no-any-return]


def contact_fields(d: Discretisation, force: Array, displacement: Array, status: Any, gap: Array) -> dict[str, Array]:
    """Pressure and friction traction on the body (stress), gap g - u_nu and slip u_tau (length), status, at the points.

    `force` of the body on the foundation and `displacement` are (points, d), `status` 0 open, 1 stick, 2 slip, `gap` g (points,).
    The points are those of `discretisation.surface`.
    """
    normals, weights = np.asarray(d.surface.normals), np.asarray(d.surface.weights)
    normal_force, inwards = np.sum(force * normals, axis=1), np.sum(displacement * normals, axis=1)
    return {
        "pressure": normal_force / weights,
        "friction traction": -(force - normal_force[:, None] * normals) / weights[:, None],
        "gap": gap - inwards,
        "slip": displacement - inwards[:, None] * normals,
        "status": np.asarray(status, dtype=float),
    }


def largest_values(d: Discretisation, stepper: Any) -> dict[str, float]:
    """The largest displacement (length), von Mises stress, temperature and contact pressure of a stepper's state, of the fields
    that there are; also the lowest temperature. Collective."""
    found: dict[str, float] = {}
    if stepper.u is not None:
        found["displacement"] = float(np.linalg.norm(d.field(stepper.u), axis=1).max())
        found["von_mises"] = float(d.mises(stepper).max())
    if stepper.theta is not None:
        theta = d.field(stepper.theta)
        found |= {"temperature": float(theta.max()), "lowest_temperature": float(theta.min())}
    if len(d.surface.weights):
        force = np.reshape(stepper.contact_force, (-1, d.dim))
        found["pressure"] = float(_mean_pressure(d.surface, force).max())
    return found


def _mean_pressure(surface: Any, force: Array) -> Array:
    """The contact pressure of every point, (points,), stress; of points at one place their mean. `force` is (points, d).

    A node of a curved part has a point for the normal of each of its facets, and how they share its pressure is a matter of the
    mesh. At an edge (20 degrees and more) they stay apart.
    """
    normals, weights = np.asarray(surface.normals), np.asarray(surface.weights)
    pressing = np.sum(force * normals, axis=1)
    places = np.column_stack([np.asarray(surface.contacts, dtype=float), np.asarray(surface.positions)])
    number = np.unique(places, axis=0, return_inverse=True)[1].ravel()
    middle = np.array([np.bincount(number, weights * part) for part in normals.T]).T
    middle /= np.linalg.norm(middle, axis=1)[:, None]
    edge = np.sum(normals * middle[number], axis=1) < np.cos(np.radians(20))
    apart = np.isin(number, number[edge])
    mean = np.bincount(number, pressing) / np.bincount(number, weights)
    return np.where(apart, pressing / weights, mean[number])


def resultants(d: Discretisation, force: Array) -> dict[str, Array]:
    """Normal force and friction force on the body of every contact part: `normal_force PART` and `friction_x PART` ...

    `force` is (steps, points, d); each result (steps,).
    """
    normals, of_part = np.asarray(d.surface.normals), np.asarray(d.surface.contacts, dtype=int)
    pressing = np.sum(force * normals, axis=2)
    friction = -(force - pressing[..., None] * normals)
    found: dict[str, Array] = {}
    for number in np.unique(of_part):
        part, on = d.scene.contacts[number].part, of_part == number
        found[f"normal_force {part}"] = pressing[:, on].sum(axis=1)
        for axis in range(d.dim):
            found[f"friction_{'xyz'[axis]} {part}"] = friction[:, on, axis].sum(axis=1)
    return found
