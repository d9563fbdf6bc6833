"""The data of every step as load vectors, values at the contact points and on the supports."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from warmslip._core import LoadQuadrature2, LoadQuadrature3
from warmslip.model.foundation import ShapeGap
from warmslip.model.loads import HEATED, ON_CONTACT, SUPPORTS, Data, Formula, Loads, evaluate, of_time, shaped
from warmslip.model.supports import Supports
from warmslip.scene.foundation_tables import ShapeTable
from warmslip.scene.scene import Scene
from warmslip.typing import Array


def _refuse_unused(scene: Scene, loads: Loads) -> None:
    """Raises ValueError for data that no field, support or contact part of the scene would take."""
    touches = any(contact.stiffness is not None for contact in scene.contacts)
    for names, there, table in (
        (("source", "heat_flux", "contact_flux", "foundation_temperature"), scene.heat is not None, "[heat]"),
        (("body", "traction", "contact_traction"), scene.moves, "[elasticity], [viscosity] or [inertia]"),
        (("gap", "foundation_velocity"), touches, "[contact] with a stiffness"),
    ):
        for name in names:
            if not there and _acts(getattr(loads, name)):
                raise ValueError(
                    f"loads.{name}: the scene has no {table}, nothing would take it; add the table or leave it out"
                )
    for name in SUPPORTS:
        held = getattr(scene.supports, name)
        for part in getattr(loads, name):
            if part not in held:
                known = ", ".join(held) or "none is"
                raise ValueError(
                    f"loads.{name}: '{part}' is not held ({known}); name it in the scene's supports.{name} too"
                )
    for name in ON_CONTACT:
        values = getattr(loads, name)
        if isinstance(values, list) and len(values) != len(scene.contacts):
            raise ValueError(
                f"loads.{name}: a list of {len(values)}; give one for each of {len(scene.contacts)} contact parts"
            )


class StepData(NamedTuple):
    """What one step is given: load vectors (f, v) and (q, eta), the gap (points), velocity and temperature of the supports
    where those are not zero, theta_F (points) where the conductance depends on the pressure, the velocity of the foundation
    (d points) where it moves along; None or empty what is absent."""

    force: Any
    heat: Any
    gap: Array
    support_velocity: Any
    support_temperature: Any
    foundation: Array
    foundation_velocity: Array


class LoadVectors:
    """The data of every step; what does not depend on time is assembled once.

    `reference`, m(reference temperature, v) or None, is taken off the forces. `rules` are quadrature rules by part and number of
    points, of the same layout, to which those that lack are added.
    """

    def __init__(
        self,
        scene: Scene,
        loads: Loads,
        supports: Supports,
        mesh: Any,
        layout: Any,
        surface: Any,
        comm: Any,
        reference: Any = None,
        rules: dict[tuple[str | None, int], Any] | None = None,
    ) -> None:
        dim = scene.mesh.dim
        _refuse_unused(scene, loads)
        self._surface, self._loads, self._comm, self._dim = surface, loads, comm, dim
        self._nodes, self._layout, self._step = np.asarray(mesh.nodes), layout, scene.step
        self.supports = supports
        self._cooled = {part: np.unique(mesh.parts[part]) for part in scene.supports.temperature}
        moves, conducts = scene.moves, scene.heat is not None
        quadrature = LoadQuadrature2 if dim == 2 else LoadQuadrature3
        self.rules = rules = {} if rules is None else rules

        lumped = scene.heat is not None and scene.heat.capacity_matrix == "lumped"

        def rule(part: str | None, data: Data, what: str) -> Any:
            # a constant times a P1 function is integrated exactly by one point; what a lumped conductance leads in is
            # taken at the vertices as what it leads out, 0
            key = part, 0 if lumped and what == HEATED else loads.points if callable(data) else 1
            if key not in rules:
                rules[key] = quadrature(layout, *key)
            return rules[key]

        contacts = [(c.part, c.heat_exchange.conductance if c.heat_exchange else 0.0) for c in scene.contacts]
        heated = [_times(k_c, loads.on_contact("foundation_temperature", i)) for i, (_, k_c) in enumerate(contacts)]
        terms = [
            (True, None, loads.body, "loads.body"),
            *((True, part, data, f"loads.traction.{part}") for part, data in loads.traction.items()),
            *((True, part, loads.contact_traction, "contact_traction") for part, _ in contacts),
            (False, None, loads.source, "heat.source"),
            *((False, part, data, f"loads.heat_flux.{part}") for part, data in loads.heat_flux.items()),
            *((False, part, data, HEATED) for (part, _), data in zip(contacts, heated, strict=True)),
            *((False, part, loads.contact_flux, "contact_flux") for part, _ in contacts),
        ]
        self._constant: tuple[Any, Any] = (
            layout.vector(dim) if moves else None,
            layout.vector(1) if conducts else None,
        )
        self._moving: list[tuple[bool, Any, Data, str]] = []
        for mechanical, part, data, what in terms:
            if not (moves if mechanical else conducts):
                continue
            if of_time(data):
                self._moving.append((mechanical, rule(part, data, what), data, what))
            elif callable(data) or np.any(data):
                self._add(self._constant, mechanical, rule(part, data, what), data, 0.0, what)
        if reference is not None:
            self._constant[0].axpy(-1.0, reference)
        moving = [any(mechanical == motion for mechanical, *_ in self._moving) for motion in (True, False)]
        self._present = layout.vector(dim) if moving[0] else None, layout.vector(1) if moving[1] else None
        # a support that stays where it is has no velocity; one at zero has no temperature
        self._velocity = layout.vector(dim) if moves and supports.of_time else None
        warm = conducts and any(callable(v) or np.any(v) for v in loads.temperature.values())
        self._temperature = layout.vector(1) if warm else None
        self._warmed = False
        touching = [i for i, c in enumerate(scene.contacts) if c.stiffness is not None]
        self._points = {i: np.flatnonzero(np.asarray(surface.contacts, int) == i) for i in touching}
        self._reactive = conducts and any(c.heats for c in scene.contacts)
        driven = [loads.on_contact("foundation_velocity", i) for i in touching]
        self._drives = any(callable(one) or np.any(one) for one in driven)
        self._kept: dict[str, Array] = {}
        self._try(scene.clock.step(1)[0])
        for t in (0.0, 0.5 * scene.time.end, scene.time.end) if supports.meet else ():
            self.displacement(t)

    @property
    def of_time(self) -> bool:
        """Whether any datum changes in time."""
        given = [*self._loads.temperature.values()]
        given += [self._loads.on_contact(name, i) for i in self._points for name in ON_CONTACT]
        return bool(self._moving) or self.supports.of_time or any(map(of_time, given))

    def _try(self, t: float) -> None:
        """Calls the functions in Python of the first step: one that is wrong is refused here, and not the outcome of a run."""
        for mechanical, rule, data, what in self._moving:
            if not isinstance(data, Formula):
                self._together(data, rule.positions, t, self._dim if mechanical else 1, what, shaped)
        for i, points in self._points.items() if self._reactive else ():
            data = self._loads.on_contact("foundation_temperature", i)
            if callable(data) and not isinstance(data, Formula):
                self._together(data, np.asarray(self._surface.positions)[points], t, 1, HEATED, shaped)

    def _add(self, pair: tuple[Any, Any], mechanical: bool, rule: Any, data: Data, t: float, what: str) -> None:
        vector = rule.load(self._together(data, rule.positions, t, self._dim if mechanical else 1, what))
        (pair[0] if mechanical else pair[1]).axpy(1.0, vector)
        vector.destroy()  # petsc4py would only mark it for a later collection

    def _together(
        self, data: Data, x: Array, t: float, components: int, what: str, read: Callable[..., Array] = evaluate
    ) -> Array:
        """`read` on every rank's own places; when it fails on one, all raise ValueError and none waits for the others."""
        if self._comm.size == 1:
            return read(data, x, t, components, what)
        values, error = np.empty((0, components)), ""
        try:
            values = read(data, x, t, components, what)
        except Exception as own:
            # kept as words: what its trace holds would be destroyed later on this rank than on the others, which then wait
            error = str(own) or repr(own)
        errors = [other for other in self._comm.allgather(error) if other]
        if errors:
            raise ValueError(errors[0])
        return values

    def on_points(self, name: str, t: float) -> Array:
        """`gap` or `foundation_temperature` at the contact points at time t, (points,)."""
        return self._on_points(name, t, 1)[:, 0]

    def _on_points(self, name: str, t: float, components: int) -> Array:
        if name in self._kept:
            return self._kept[name]
        x = np.asarray(self._surface.positions)
        out, moving = np.zeros((len(x), components)), False
        for i, points in self._points.items():
            value = self.on_contact(name, i)
            out[points] = self._together(value, x[points], t, components, ON_CONTACT[name])
            moving = moving or of_time(value)
        if not moving:
            self._kept[name] = out
        return out

    def on_contact(self, name: str, number: int) -> Data:
        """The datum of a contact part at its points; the gap to a shape is that along their normals."""
        value = self._loads.on_contact(name, number)
        if isinstance(value, ShapeTable):
            return ShapeGap(value, np.asarray(self._surface.normals)[self._points[number]])
        return value

    def displacement(self, t: float) -> Array:
        """The given displacement of the nodes of `supports` at time t, (n, d), length; zero in free directions."""
        return self.supports.displacement(t, self._together)

    def temperature(self, t: float) -> list[tuple[Any, Array]]:
        """The given temperature at time t, part by part: nodes (n,) and values (n,)."""
        return [
            (
                nodes,
                self._together(
                    self._loads.temperature.get(part, 0.0), self._nodes[nodes], t, 1, f"supports.temperature.{part}"
                )[:, 0],
            )
            for part, nodes in self._cooled.items()
        ]

    def _support_velocity(self, t: float, step: float, begin: float) -> Any:
        if self._velocity is None:
            return None
        values = np.zeros((len(self._nodes), self._dim))
        values[self.supports.nodes] = (self.displacement(t) - self.displacement(begin)) / step
        self._layout.distribute(values.ravel(), self._velocity)
        return self._velocity

    def _support_temperature(self, t: float) -> Any:
        if self._temperature is None or self._warmed:
            return self._temperature
        values = np.zeros(len(self._nodes))
        for nodes, now in self.temperature(t):
            values[nodes] = now
        self._layout.distribute(values, self._temperature)
        self._warmed = not any(map(of_time, self._loads.temperature.values()))
        return self._temperature

    def at(self, t: float, step: float | None = None, begin: float | None = None) -> StepData:
        """The data of the step of size `step` (default: the scene's) that ends at time t, valid until the next call.

        `begin` is the time at which the step before it ended: t - step up to rounding, which decides where a support jumps. The
        vectors must not be changed.
        """
        step = step or self._step
        begin = t - step if begin is None else begin
        pair: list[Any] = list(self._constant)
        for i, present in enumerate(self._present):
            if present is not None:
                self._constant[i].copy(present)
                pair[i] = present
        for mechanical, rule, data, what in self._moving:
            self._add((pair[0], pair[1]), mechanical, rule, data, t, what)
        foundation = self.on_points("foundation_temperature", t) if self._reactive else np.empty(0)
        velocity, temperature = self._support_velocity(t, step, begin), self._support_temperature(t)
        drive = self.drive(t).ravel() if self._drives else np.empty(0)
        return StepData(pair[0], pair[1], self.on_points("gap", t), velocity, temperature, foundation, drive)

    def drive(self, t: float) -> Array:
        """The velocity of the foundation at the contact points at time t, (points, d)."""
        return self._on_points("foundation_velocity", t, self._dim)


def _acts(data: Any) -> bool:
    """Whether a datum, or one of several, is a function or not zero."""
    if isinstance(data, dict | list | tuple):
        return any(_acts(one) for one in (data.values() if isinstance(data, dict) else data))
    return callable(data) or isinstance(data, ShapeTable) or bool(np.any(np.asarray(data, dtype=float) != 0))


def _times(factor: float, data: Data) -> Data:
    """The datum times a constant."""
    if not callable(data):
        return factor * data
    if factor == 0:
        return 0.0

    def product(x: Array, t: float) -> Array | None:
        value = data(x, t)
        return None if value is None else np.asarray(factor * np.asarray(value))

    product.of_time = of_time(data)  # type: ignore[attr-defined]
    return product
