"""The same physics in other units has the same answer: bodies on Gauss points, each point's own force included.

`python test_units.py D` checks on the ranks it has.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from support.boxes import along, completed, elasticity, field, forces_of, scene
from support.ranked import Checks

from warmslip.model.meshes import make_mesh
from warmslip.scene.reader import load

check = Checks()


class Units:
    """Factors of length, time and mass."""

    def __init__(self, length: float = 1.0, time: float = 1.0, mass: float = 1.0) -> None:
        self.length, self.time = length, time
        self.speed, self.density = length / time, mass / length**3
        self.stress, self.force = mass / (length * time**2), mass * length / time**2
        self.field = {"u": length, "w": self.speed, "force": self.force}


OTHERS = (Units(12.7, 0.0321, 4.56), Units(1e3, 1.0, 1e-3))


def history(one: Any, units: Units, d: int) -> list[dict[str, Any]]:
    """Every step's u and w in mesh numbering and the forces of the contact points, in units of 1."""
    found: list[dict[str, Any]] = []

    def keep(simulation: Any, report: Any) -> None:
        force = forces_of(simulation) / (units.force if d == 3 else units.force / units.length)
        found.append({name: field(simulation, name) / units.field[name] for name in ("u", "w")} | {"force": force})

    completed(one, each=keep)
    return found


def agree(d: int, make: Callable[[Units], Any], apart: float) -> None:
    """All fields of all steps, within `apart` of their largest value in the run."""
    first = history(make(Units()), Units(), d)
    for units in OTHERS:
        other = history(make(units), units, d)
        for name in first[0]:
            size = max(np.abs(step[name]).max() for step in first)
            worst = max(np.abs(a[name] - b[name]).max() for a, b in zip(first, other, strict=True))
            assert worst <= apart * size, (name, worst / size)


def stopping(d: int, quadrature: str, stiffness: Any) -> Callable[[Units], Any]:
    """Steel slides on a foundation until friction has stopped it; 25 steps."""

    def make(units: Units) -> Any:
        hard = stiffness if isinstance(stiffness, str) else stiffness * units.stress / units.length
        return scene(
            d,
            [4, 2] if d == 2 else [2, 2, 1],
            length=0.1 * units.length,
            time={"end": 0.5 * units.time, "steps": 25},
            inertia={"density": 7850.0 * units.density},
            elasticity=elasticity(d, 2.1e11 * units.stress, 0.3),
            loads={"body": along(d, -77000.0 * units.stress / units.length)},
            initial={"velocity": along(d, 0.0, units.speed)},
            contact={
                "part": "bottom",
                "stiffness": hard,
                "quadrature": quadrature,
                "friction": {"coefficient": 0.3},
            },
        )

    return make


@check
def a_block_that_comes_to_rest_on_gauss_points(d: int) -> None:
    for quadrature in ("gauss-1", "gauss-2", "gauss-3") if d == 2 else ("gauss-1", "gauss-2"):
        for stiffness in (2.1e15, 2.1e13):
            agree(d, stopping(d, quadrature, stiffness), 2e-11)
    if d == 2:
        agree(d, stopping(d, "gauss-1", "rigid"), 2e-11)


def shaken(d: int) -> Callable[[Units], Any]:
    """Held at its top, on a rigid foundation with a constant friction bound that its points come to again and again."""

    def make(units: Units) -> Any:
        t = f"(t / {units.time!r})"
        push = along(d, f"-{0.1 * units.stress!r} * abs(sin(9.8 * {t}))", f"{0.1 * units.stress!r} * sin(14 * {t})")
        return scene(
            d,
            2,
            length=units.length,
            time={"end": 2.24 * units.time, "steps": 100},
            inertia={"density": 50.0 * units.density},
            elasticity=elasticity(d, 1e5 * units.stress, 0.1),
            supports={"displacement": ["top"]},
            loads={"traction": {"right": push}},
            contact={
                "part": "bottom",
                "gap": 2e-7 * units.length,
                "stiffness": "rigid",
                "quadrature": "gauss-2",
                "friction": {"cohesion": 0.03 * units.stress},
            },
        )

    return make


@check
def points_near_all_their_bounds(d: int) -> None:
    agree(d, shaken(d), 1e-10)


def pressed(d: int, friction: float) -> Callable[[Units], Any]:
    """Pressed onto a wavy rigid foundation and dragged along it."""

    def make(units: Units) -> Any:
        t, x = f"(t / {units.time!r})", f"(x / {units.length!r})"
        rub = {"friction": {"coefficient": friction}} if friction else {}
        return scene(
            d,
            4 if d == 2 else 2,
            length=units.length,
            time={"end": units.time, "steps": 20},
            elasticity=elasticity(d, 100.0 * units.stress, 0.3),
            supports={
                "displacement": {"top": along(d, f"-{0.02 * units.length!r} * {t}", f"{0.1 * units.length!r} * {t}")}
            },
            contact={
                "part": "bottom",
                "gap": f"{0.01 * units.length!r} * sin(8 * {x} + 3 * {t})**2",
                "stiffness": "rigid",
                "quadrature": "gauss-2",
            }
            | rub,
        )

    return make


@check
def points_on_a_wavy_foundation(d: int) -> None:
    for friction in (0.0, 0.2)[: 2 if d == 2 else 1]:  # in space points that slip keep the share they have
        agree(d, pressed(d, friction), 1e-10)


@check
def a_block_that_slides_on_a_rigid_foundation(d: int) -> None:
    """Its points share their pressures: whichever way Newton's method came, the least are stored."""
    if d == 3:
        return
    one = load("sliding_block").override(**{"contact.quadrature": "gauss-2", "contact.stiffness": "rigid"})

    def forces(scale: float) -> Any:
        found: list[Any] = []
        completed(
            one.override(**{"mesh.lengths": [scale, scale]}),
            each=lambda simulation, _: found.append(forces_of(simulation)),
        )
        return np.array(found)

    first = forces(1.0)
    for scale in (1 + 1e-15, 1 - 1e-14):
        assert np.abs(forces(scale) - first).max() <= 1e-6 * np.abs(first).max()


@check
def a_block_far_from_the_origin(d: int) -> None:
    """Gauss points are found where rounded positions say, with the interpolation of the rule."""
    one = scene(
        d,
        2,
        inertia={"density": 1.0},
        elasticity=elasticity(d, 1.0, 0.3),
        loads={"body": along(d, -1e-3, 3e-4)},
        contact={"part": "bottom", "stiffness": 100.0, "quadrature": "gauss-2", "friction": {"coefficient": 0.3}},
    )
    near = make_mesh(one)
    parts = {name: np.array(facets) for name, facets in near.parts.items()}

    def forces(offset: float) -> Any:
        mesh = type(near).from_lists(np.array(near.nodes) + offset, near.cells, parts)
        return forces_of(completed(one, mesh=mesh))

    there = forces(0.0)
    for offset in (2.0**20, 2.0**30):  # every node is there to the last bit
        assert np.abs(forces(offset) - there).max() <= 1e-13 * np.abs(there).max()


@check
def a_dashpot_beside_springs(d: int) -> None:
    """Springs along the last axis and a weak dashpot: neither hides the other, whatever the unit of time is."""
    ends = []
    for unit in (1.0, 1e-4, 1e4, 1e10):
        one = scene(
            d,
            2,
            time={"end": 1.0 / unit, "steps": 2},
            inertia={"density": 1.0},
            elasticity=elasticity(d, unit**2, 0.3),
            supports={"springs": {"top": {"stiffness": along(d, 0.03 * unit**2), "damping": 6.5e-5 * unit}}},
            loads={"body": along(d, -2e-3 * unit**2, 1e-3 * unit**2)},
        )
        ends.append(field(completed(one), "u"))
    for other in ends[1:]:
        assert np.abs(other - ends[0]).max() <= 1e-13 * np.abs(ends[0]).max()


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
