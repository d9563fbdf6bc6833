"""Data of a problem: forces, sources, gap, foundation temperature; constants, formulas or functions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from warmslip.messages import quoted
from warmslip.scene.expressions import Expression, constant
from warmslip.scene.foundation_tables import ShapeTable
from warmslip.scene.scene import Scene
from warmslip.typing import Array

# what supports hold, and its components (None: as many as axes)
SUPPORTS: dict[str, int | None] = {"displacement": None, "temperature": 1}
HEATED = "contact.heat_exchange.foundation_temperature"
ON_CONTACT = {"gap": "contact.gap", "foundation_temperature": HEATED, "foundation_velocity": "contact.velocity"}
# constants, or functions of positions (points, d) and time returning (points,) or (points, d)
Data = Any


@dataclass(frozen=True)
class Formula:
    """Formulas of a scene, one a component, as a function (x, t) -> (points, components); `of_time` says whether t is in them."""

    components: tuple[Expression, ...]

    @property
    def of_time(self) -> bool:
        return any(one.of_time for one in self.components)

    def __call__(self, x: Array, t: float) -> Array:
        return np.column_stack([one(x, t) for one in self.components])


def data(value: Any) -> Data:
    """A scene's value, a number or a formula or a list of them, as a constant or a `Formula`."""
    values = value if isinstance(value, list) else [value]
    if constant(*values):
        return np.array(values, dtype=float) if isinstance(value, list) else float(value)
    return Formula(tuple(Expression(str(v)) for v in values))


def given_displacement(held: Any) -> Data:
    """The datum of a support: of all components, 0 for those that are free, or along the normal."""
    return data([0.0 if one == "free" else one for one in held] if isinstance(held, list) else held.normal)


def of_time(data: Data, component: int | None = None) -> bool:
    """Whether the datum, or one component of it, may change with time; a function that does not say otherwise may."""
    if component is not None and isinstance(data, Formula):
        return data.components[component].of_time
    return bool(getattr(data, "of_time", callable(data)))


@dataclass(frozen=True)
class Loads:
    """Right-hand sides in the letters of the paper. Each is a constant or a function (x, t) -> array.

    A function takes positions x (points, d) and the time; it returns (points,) or (points, components). A function that does
    not depend on time may say so by an attribute `of_time = False`.

    Parameters
    ----------
    body : datum
        f0, force per volume.
    source : datum
        q0, heat per volume and time.
    traction, heat_flux : dict of datum
        fN (stress) and h (heat per area and time, into the body) by boundary part.
    displacement, temperature : dict of datum
        u_D (length) and theta_D by supported part.
    contact_traction, contact_flux : datum
        Extra traction and flux on all of Gamma_C, for manufactured solutions.
    gap, foundation_temperature : datum or list of datum
        g (length) and theta_F on Gamma_C: one for all contact parts, or one for each.
    points : int
        Quadrature points per direction for functions.

    Raises
    ------
    TypeError
        For a load that is not by part where it should be, and for a formula.
    """

    body: Data = 0.0
    source: Data = 0.0
    traction: dict[str, Data] = field(default_factory=dict)
    heat_flux: dict[str, Data] = field(default_factory=dict)
    displacement: dict[str, Data] = field(default_factory=dict)
    temperature: dict[str, Data] = field(default_factory=dict)
    contact_traction: Data = 0.0
    contact_flux: Data = 0.0
    gap: Data | list[Data] = 0.0
    foundation_temperature: Data | list[Data] = 0.0
    foundation_velocity: Data | list[Data] = 0.0
    points: int = 3

    def __post_init__(self) -> None:
        """Raises TypeError for a load that is not by part where it should be, and for a formula."""
        if isinstance(self.points, bool) or not isinstance(self.points, int) or self.points < 1:
            raise TypeError(f"loads.points: {quoted(self.points)}; give a whole number, at least 1")
        for name in ("traction", "heat_flux", "displacement", "temperature"):
            if not isinstance(value := getattr(self, name), dict):
                raise TypeError(f"loads.{name}: {quoted(value)} is no dictionary; give it by part, {{'left': ...}}")
        for name, value in vars(self).items():
            for one in value.values() if isinstance(value, dict) else value if isinstance(value, list) else [value]:
                if isinstance(one, str):
                    raise TypeError(
                        f"loads.{name}: {quoted(one)} is a text; formulas stand in the scene, give a function here"
                    )

    @classmethod
    def of(cls, scene: Scene) -> Loads:
        """The loads that a scene states."""
        contacts = scene.contacts

        def each(values: list[Data]) -> Data | list[Data]:
            return values[0] if len(values) == 1 else values or 0.0

        return cls(
            body=data(scene.loads.body) if scene.loads.body is not None else 0.0,
            source=data(scene.heat.source) if scene.heat is not None else 0.0,
            traction={part: data(value) for part, value in scene.loads.traction.items()},
            heat_flux={part: data(value) for part, value in scene.loads.heat_flux.items()},
            displacement={part: given_displacement(value) for part, value in scene.supports.moved.items()},
            temperature={part: data(value) for part, value in scene.supports.warmed.items()},
            gap=each([c.gap if isinstance(c.gap, ShapeTable) else data(c.gap) for c in contacts]),
            foundation_temperature=each(
                [data(c.heat_exchange.foundation_temperature) if c.heat_exchange else 0.0 for c in contacts]
            ),
            foundation_velocity=each([data(c.velocity) if c.velocity is not None else 0.0 for c in contacts]),
            points=scene.loads.quadrature or 3,
        )

    def on_contact(self, name: str, number: int) -> Data:
        """`gap`, `foundation_temperature` or `foundation_velocity` of one contact part."""
        value = getattr(self, name)
        return value[number] if isinstance(value, list) else value


def evaluate(data: Data, x: Array, t: float, components: int, what: str = "a load") -> Array:
    """Values of `data` at positions x (points, d), as (points, components).

    Raises ValueError when they are no numbers, not finite or misshaped, and for whatever a function in Python raises. `what` is
    what the message calls it.
    """
    value = shaped(data, x, t, components, what)
    if not np.isfinite(value).all():
        raise ValueError(f"{what} is not finite at t = {t:g}; check its expression")
    return np.ascontiguousarray(value)


def shaped(data: Data, x: Array, t: float, components: int, what: str) -> Array:
    """As `evaluate`, of numbers that need not be finite."""
    value = _numbers(data, x, t, what)
    if value.ndim < 2 and components == 1 and value.shape in ((), (len(x),)):
        value = np.broadcast_to(value, (len(x),))[:, None]
    elif value.shape == () and value:  # the same number along every axis is hardly meant
        raise ValueError(f"{what} is one number, {value:g}, where {components} are due; give one for each axis")
    elif value.shape in ((), (components,)):
        value = np.broadcast_to(value, (len(x), components))
    if value.shape != (len(x), components):
        raise ValueError(f"{what} must give shape {(len(x), components)} at {len(x)} points, got {value.shape}")
    return value


def _numbers(data: Data, x: Array, t: float, what: str) -> Array:
    """As `evaluate`, of any shape."""
    given = data
    if callable(data):
        try:
            given = data(x, t)
        except Exception as error:  # somebody else's code: without a name nobody finds it among ten loads
            why = str(error) if isinstance(data, Formula) else f"the function raised {error!r}; correct it"
            raise ValueError(f"{what} at t = {t:g}: {why}") from error
        if given is None:
            raise ValueError(f"{what} at t = {t:g}: the function gave None; let it return its values")
    if np.iscomplexobj(given):
        raise ValueError(f"{what} at t = {t:g}: {quoted(given)} is complex; give real numbers")
    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{what} at t = {t:g}: {quoted(given)} is no array of numbers; give one") from None
