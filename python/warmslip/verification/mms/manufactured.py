"""Manufactured solutions with contact: fields that are what they claim to be, and runs measured against them.

`slipping` is the one that the workflow runs. On the unit square with the supports of the paper's problem, u and theta vanish
where they must, the body penetrates the foundation everywhere on the bottom (u_nu > g) and slides in one direction, so the
data are smooth and O(h+k) is owed. What the contact law does not give is prescribed as an extra traction and an extra flux
(symbolic.py). Numbers are dimensionless, as in the paper.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import sympy as sp

from warmslip.model.discretisation import discretise
from warmslip.scene.full import FullScene
from warmslip.simulation.simulation import Simulation
from warmslip.studies import rates
from warmslip.studies.error_norms import TERMS, ExactErrors, Largest
from warmslip.typing import Array
from warmslip.verification.mms import symbolic
from warmslip.verification.mms.symbolic import ExactFields, Manufactured, T, X, Y

ROUNDING = 1e-10  # of scale: no contradiction, only floating point
TIMES = 11  # at which a description is checked


def derive(scene: FullScene, fields: ExactFields, points: int = 3) -> Manufactured:
    """The loads under which `fields` solve the scene's problem, for fields that are what they claim to be.

    They are checked on a grid of places and times. Raises ValueError, one sentence with the place, when they do not vanish on
    the scene's supports, when they leave contact, stop, reverse or slip against their claim, when the friction traction leaves
    the cone or does not oppose the slip, and when the law alone does not hold for fields that are said to obey it.
    """
    solution = symbolic.derive(scene, fields, points)
    times = np.linspace(0, scene.time.end, TIMES)
    supports = scene.supports
    for name, field, parts in (
        ("u", solution.u, supports.displacement),
        ("theta", solution.theta, supports.temperature),
    ):
        for part in parts:
            if any(np.abs(field(_places(scene, part), t)).max() > ROUNDING for t in times):
                raise ValueError(f"{name} does not vanish on '{part}', where the scene holds it; change one of the two")
    x = _places(scene, scene.contact.part)
    for what, place, t in _contradictions(scene, fields, solution, x, times):
        raise ValueError(f"{what} at x = {place.tolist()}, t = {t:g}; change the fields or the scene's data")
    return solution


def _places(scene: FullScene, part: str) -> Array:
    """A grid of positions on a part of the box, (points, d)."""
    place = scene.mesh.parts.index(part)
    along = [np.linspace(0, side, 101 if scene.mesh.dim == 2 else 21) for side in scene.mesh.sides]
    along[place // 2] = along[place // 2][[-(place % 2)]]
    return np.stack([c.ravel() for c in np.meshgrid(*along, indexing="ij")], axis=1)


def _contradictions(
    scene: FullScene, fields: ExactFields, solution: Manufactured, x: Array, times: Array
) -> Iterator[tuple[str, Array, float]]:
    """What is wrong on the contact part, and where and when first."""
    touch, state = solution.touch, fields.contact_state
    load = max(np.abs(touch.pressure(x, t)).max() for t in times)
    fast = max(np.abs(solution.w(x, t)).max() for t in times)
    before: Array | None = None
    for t in times:
        with np.errstate(invalid="ignore", divide="ignore"):  # where nothing slips, slip has no direction
            p, bound, friction, slip, extra = (
                f(x, t) for f in (touch.pressure, touch.bound, touch.friction, touch.slip, touch.extra)
            )
        speed, force = np.linalg.norm(slip, axis=1), np.linalg.norm(friction, axis=1)
        misfit = np.linalg.norm(friction * speed[:, None] - bound[:, None] * slip, axis=1)
        faults = []
        if state != "mixed":
            faults.append((~(p > ROUNDING * load), f"the fields leave contact where they should {state}"))
        if state == "slip":
            faults.append((~(speed > ROUNDING * fast), "the slip stops where it should go on"))
            reverses = _turned(slip) if before is None else _turned(slip) | (np.sum(slip * before, axis=1) <= 0)
            faults.append((reverses, "the slip reverses"))
        if state == "stick":
            faults.append((speed > ROUNDING * fast, "the fields slip where they should stick"))
            faults.append((~(force < bound), "the friction traction of sticking lies beyond the cone"))
        faults.append((~(force <= bound + ROUNDING * load), "the friction traction lies beyond the cone"))
        faults.append((~(misfit <= ROUNDING * load * fast), "the friction traction does not oppose the slip"))
        if fields.satisfies_contact_law:
            faults.append((~(np.abs(extra).max(axis=1) <= ROUNDING * load), "the law of friction alone does not hold"))
        for where, what in faults:
            if where.any():
                yield what, x[np.argmax(where)], t
        before = slip


def _turned(slip: Array) -> Array:
    """Where the slip (points, d) of a grid of places points against that of a neighbour, (points,)."""
    dim = slip.shape[1]
    grid = slip.reshape(*[round(len(slip) ** (1 / (dim - 1)))] * (dim - 1), dim)
    found = np.zeros(grid.shape[:-1], dtype=bool)
    for axis in range(dim - 1):
        along = np.moveaxis(grid, axis, 0)
        np.moveaxis(found, axis, 0)[1:] |= np.sum(along[1:] * along[:-1], axis=-1) <= 0
    return np.asarray(found.ravel())


def sliding() -> ExactFields:
    """The fields of `slipping`."""
    # u_y < 0 on y = 0 presses the body into the foundation; u_x grows in time, so w_x > 0 there
    u = sp.Matrix(
        [
            sp.Rational(1, 10) * (1 - Y**2) * (1 + sp.sin(sp.pi * X) / 2) * sp.exp(T),
            -sp.Rational(1, 1000) * (1 - Y) * (2 + sp.cos(sp.pi * X)) * (1 + T / 2),
        ]
    )
    # theta moves fast, so that the errors in time are seen beside those in space
    theta = sp.sin(sp.pi * X) * (1 - Y) * (1 + Y / 2) * (2 + sp.sin(6 * T))
    return ExactFields(u, theta, contact_state="slip")


def slipping(scene: FullScene) -> Manufactured:
    """Full slip to the right with a varying pressure, for a 2D scene clamped at the top and cooled at top, left and right.

    Raises ValueError when the scene's supports are not those, or when the fields would leave contact or reverse the slip.
    """
    if (
        scene.mesh.dim != 2
        or scene.supports.displacement != ["top"]
        or set(scene.supports.temperature) != {"top", "left", "right"}
    ):
        raise ValueError(
            "the manufactured solution is for a square clamped at the top and cooled at top, left and right"
        )
    return derive(scene, sliding())


def errors(
    scene: FullScene, solution: Manufactured, *, mesh: Any = None, watch: Callable[[Simulation], None] | None = None
) -> tuple[dict[str, float], Simulation]:
    """Largest errors over all times of a run with the manufactured data, and the run.

    `mesh` replaces the scene's structured one; `watch` sees the run after every step. Raises RuntimeError when a step is not
    right.
    """
    simulation = Simulation(scene, discretisation=discretise(scene, loads=solution.loads, mesh=mesh))
    d = simulation.discretisation
    nodes = np.asarray(d.mesh.nodes)
    d.restart(simulation.stepper, solution.u(nodes, 0.0), solution.w(nodes, 0.0), solution.theta(nodes, 0.0), 0.0)
    measure = ExactErrors(d, w=solution.w, theta=solution.theta, gradient=solution.gradient)
    largest = Largest()
    for _ in simulation.steps():
        largest.add(measure.of(simulation.stepper))
        if watch:
            watch(simulation)
    if simulation.outcome != "completed":
        raise RuntimeError(
            f"the manufactured run with n = {scene.mesh.n}, steps = {scene.time.steps} ended: {simulation.outcome}"
        )
    return largest.values, simulation


def grid(path: str, levels: list[int]) -> list[tuple[int, int]]:
    """(1/h, steps) along `h=k`, or along `k=h^2` starting from three quarters of the mesh, with as many steps as cells."""
    if path == "h=k":
        return [(n, n) for n in levels]
    coarse = [3 * n // 4 for n in levels]
    return [(n, coarse[0] * (n // coarse[0]) ** 2) for n in coarse]


def table(scene: FullScene, couplings: list[str], levels: list[int], path: str) -> list[dict[str, Any]]:
    """Errors and orders along one path for each coupling; `levels` are 1/h, each twice the one before.

    Raises ValueError for fewer than three levels, or others than 4, 8, 16 .. times a number.
    """
    if len(levels) < 3:
        raise ValueError(f"{len(levels)} levels say nothing about an order; give at least three")
    if levels[0] % 4 or any(b != 2 * a for a, b in itertools.pairwise(levels)):
        raise ValueError(f"levels {levels} must start with a multiple of 4 and double, as 8,16,32")
    out = []
    for coupling in couplings:
        before: dict[str, float] | None = None
        for n, steps in grid(path, levels):
            one = scene.override(**{"mesh.n": n, "time.steps": steps, "time.coupling": coupling})
            found, simulation = errors(one, slipping(one))
            line = {"path": path, "coupling": coupling, "n": n, "steps": steps, "h": 1 / n, "k": one.step}
            line |= {f"e_{t}": found[t] for t in TERMS}
            line |= {f"order_{t}": rates.observed(before[t], found[t]) if before else float("nan") for t in TERMS}
            line |= {"slip": simulation.report.slip, "stick": simulation.report.stick, "open": simulation.report.open}
            line |= {f"residual_{name}": value for name, value in simulation.statistics.residuals.items()}
            out.append(line)
            before = found
    return out
