"""Observed orders of a family of manufactured runs, as lines of the report, with all that keeps them from flattering.

Orders are least-squares slopes over at least three grids; beside each stands how far the errors are from a straight line, since
a slope through a curve means nothing. Bands are those of the verification notes, section 6. Numbers are dimensionless.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from warmslip.model.meshes import make_mesh
from warmslip.records import check
from warmslip.records.check import Check
from warmslip.scene.full import FullScene
from warmslip.simulation.simulation import Simulation
from warmslip.studies import rates
from warmslip.verification.mms.manufactured import derive, errors
from warmslip.verification.mms.symbolic import ExactFields, Manufactured

# orders owed on smooth data, by what is refined
SPACE = {"u_V": 1.0, "w_L2": 2.0, "theta_L2": 2.0}
TIME = {"u_V": 1.0, "w_L2": 1.0, "theta_L2": 1.0}
MISFIT = 0.05  # root mean square of log(error) about the fitted line


@dataclass(frozen=True)
class Family:
    """Fields on a sequence of grids (1/h, steps), the orders they are owed, by error term, and in what: h or k.

    `points` of load quadrature a direction.
    """

    case: str
    scene: FullScene
    fields: Callable[[FullScene], ExactFields]
    grids: Sequence[tuple[int, int]]
    owed: dict[str, float]
    refined: Literal["h", "k"] = "h"
    points: int = 3

    @property
    def scenes(self) -> list[FullScene]:
        return [self.scene.override(**{"mesh.n": n, "time.steps": steps}) for n, steps in self.grids]


def measure(
    family: Family, watch: Callable[[Simulation], None] | None = None
) -> tuple[list[dict[str, float]], Manufactured]:
    """Largest errors over time on every grid of the family, and the solution, which is derived once.

    Raises ValueError for fewer than three grids, and for data of the discrete scheme, which belong to one step size, on
    grids of several; see `manufactured.derive` for fields that contradict themselves.
    """
    if len(family.grids) < 3:
        raise ValueError(f"{family.case}: {len(family.grids)} grids say nothing about an order; give at least three")
    scenes = family.scenes
    fields = family.fields(scenes[0])
    if fields.lag and any(not np.isclose(scene.step, fields.lag, rtol=1e-12) for scene in scenes):
        raise ValueError(f"{family.case}: the data are those of steps of {fields.lag:g}; keep the number of steps")
    solution = derive(scenes[0], fields, family.points)
    return [errors(scene, solution, watch=watch)[0] for scene in scenes], solution


def order_lines(case: str, sizes: Sequence[float], found: Sequence[float], owed: float) -> list[Check]:
    """Order and straightness of errors `found` over mesh or step `sizes`; errors of zero are exact and have no order.

    Raises ValueError for fewer than three sizes.
    """
    if len(sizes) < 3:
        raise ValueError(f"{case}: {len(sizes)} grids say nothing about an order; give at least three")
    if not all(error != 0 for error in found):
        return [check.below(case, "reproduced exactly, no order to speak of", "manufactured", max(found), 0.0)]
    slope, misfit = rates.least_squares(sizes, found)
    return [
        check.order(case, f"error decreases with order {owed:g}", "manufactured", owed, slope),
        check.below(case, "the order is one of a straight line", "manufactured", misfit, MISFIT),
    ]


def orders(family: Family) -> list[Check]:
    """Lines for every term that the family is owed an order of."""
    found, _ = measure(family)
    sizes = [1 / scene.mesh.counts[0] if family.refined == "h" else scene.step for scene in family.scenes]
    return [
        one
        for term, owed in family.owed.items()
        for one in order_lines(f"{family.case}, {term}", sizes, [e[term] for e in found], owed)
    ]


def distorted(scene: FullScene, amount: float = 0.2, seed: int = 1) -> Any:
    """The scene's mesh with its nodes moved by up to `amount` of a grid cell a direction, the faces of the box kept flat."""
    mesh = make_mesh(scene)
    x = np.asarray(mesh.nodes)
    sides = np.array(scene.mesh.sides)
    free = (x > 1e-9 * sides) & (x < (1 - 1e-9) * sides)
    shift = amount * sides / np.array(scene.mesh.counts) * np.random.default_rng(seed).uniform(-1, 1, x.shape)
    return type(mesh).from_lists(x + free * shift, np.asarray(mesh.cells), dict(mesh.parts))
