"""Manufactured solutions with contact, in the plane and in space, as lines of the report: what is solved, and how fast.

Round-off first: affine fields under every coupling, and sticking points that must not move. Then orders. Data of the discrete
scheme (`lag`) leave errors in space alone, at any step size; fields affine in space leave errors in time alone, on any mesh; on
smooth fields both are seen together along h = k and k ~ h^2. Numbers are dimensionless.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from warmslip.records import check
from warmslip.records.check import Check
from warmslip.scene.full import FullScene, full_model
from warmslip.scene.reader import load
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary
from warmslip.studies.error_norms import TERMS
from warmslip.verification.mms import symbolic
from warmslip.verification.mms.fields_kinked import OPENING, STICKING, opening, stick_slip
from warmslip.verification.mms.fields_smooth import affine, slip, slip_by_law, stick
from warmslip.verification.mms.manufactured import derive, errors, sliding
from warmslip.verification.mms.orders import SPACE, TIME, Family, distorted, orders
from warmslip.verification.mms.symbolic import ExactFields

COUPLINGS = ("staggered", "lagged", "monolithic")
ROUND_OFF = 1e-11  # of scale, after a few steps
STUCK = 1e-12  # slip velocity of a sticking point over the largest velocity
STATUS_WIDTH = 2.0  # mesh sizes within which a status may differ from the exact one

DOUBLED, FINER = ((8, 8), (16, 16), (32, 32)), ((16, 16), (32, 32), (64, 64))
FINER_IN_SPACE = ((16, 3), (32, 3), (64, 3))
SQUARED = ((8, 16), (16, 64), (32, 256))
Lagged = Callable[[FullScene, float], ExactFields]


def setting(
    dim: int, values: Mapping[str, Any] | None = None, *, coupling: str = "staggered", floating: bool = False
) -> FullScene:
    """The paper's scene or the block with full tensors K, M and R and other `values`; `floating` takes all supports away."""
    tensor = (np.eye(dim) + 0.2 * np.ones((dim, dim))).tolist()
    keys: dict[str, Any] = {
        "time.coupling": coupling,
        "heat.conductivity": tensor,
        "heat.expansion.tensor": (0.5 * np.array(tensor)).tolist(),
        "heat.heating.tensor": (-1.5 * np.array(tensor)).tolist(),
        "contact.heat_exchange.foundation_temperature": 10.0,
    }
    if floating:
        keys |= {"supports.displacement": [], "supports.temperature": []}
    return full_model(load("paper_isotropic" if dim == 2 else "block_3d")).override(**keys | dict(values or {}))


def lagged(fields: Lagged) -> Callable[[FullScene], ExactFields]:
    """Fields with data of the discrete scheme at the scene's step."""
    return lambda scene: fields(scene, scene.step)


def exactness(dim: int, coupling: str) -> Check:
    """Affine fields on a distorted mesh: the largest error at any step over the field's norm at the end."""
    scene = setting(dim, {"mesh.n": 5 if dim == 2 else 3, "time.steps": 5}, coupling=coupling, floating=True)
    found, simulation = errors(scene, derive(scene, affine(scene, scene.step)), mesh=distorted(scene))
    norms = summary(simulation)["norms"]
    return check.below(
        f"affine fields on a distorted mesh, {dim}D, {coupling}",
        "every term of both balances and of the contact law has its factor, sign and time index",
        "manufactured",
        max(found[term] / norms[term] for term in TERMS),
        ROUND_OFF,
    )


def sticking(dim: int, quadrature: str) -> Check:
    """The largest tangential velocity of a contact node at any step, over the largest velocity anywhere."""
    scene = setting(dim, {"mesh.n": 8 if dim == 2 else 4, "time.steps": 8, "contact.quadrature": quadrature})
    worst, max_speed = 0.0, 0.0

    def watch(simulation: Simulation) -> None:
        nonlocal worst, max_speed
        w = simulation.discretisation.field(simulation.stepper.w)
        touching = np.unique(simulation.discretisation.mesh.parts[scene.contact.part])
        worst = max(worst, float(np.abs(w[touching, :-1]).max()))
        max_speed = max(max_speed, float(np.abs(w).max()))
        # with more points than nodes sticking points share a force as they please, some up to their bounds
        if quadrature == "nodal" and simulation.report.stick != len(simulation.discretisation.surface.weights):
            worst = np.inf

    errors(scene, derive(scene, stick(scene)), watch=watch)
    return check.below(
        f"stick by the law alone, {dim}D, {quadrature}",
        "sticking points do not move, at any step",
        "manufactured",
        worst / max_speed,
        STUCK,
    )


def status(name: str, n: int) -> Check:
    """How far from the exact point of change, in mesh sizes and at any step, a contact point has another status."""
    fields, change, before, beyond = {
        "opening": (opening, OPENING, 0, 2),
        "stick-slip": (stick_slip, STICKING, 1, 2),
    }[name]
    scene = setting(2, {"mesh.n": n, "time.steps": n})
    place = symbolic.function(change, 2)
    worst = 0.0

    def watch(simulation: Simulation) -> None:
        nonlocal worst
        x = np.asarray(simulation.discretisation.surface.positions)
        distance = x[:, 0] - place(x, simulation.stepper.time)
        wrong = np.asarray(simulation.stepper.status) != np.where(distance < 0, before, beyond)
        worst = max(worst, float(np.abs(distance[wrong]).max(initial=0)) * n)

    errors(scene, derive(scene, fields(scene), points=6), watch=watch)
    return check.below(
        f"status of the {name} solution, n = {n}",
        "the point of change is where it should be",
        "manufactured",
        worst,
        STATUS_WIDTH,
    )


def load_quadrature(points: int = 3, n: int = 16) -> list[Check]:
    """Errors with the load quadrature in use against those with eight points a direction, on the slip solution."""
    scene = setting(2, {"mesh.n": n, "time.steps": 4})
    few, many = (errors(scene, derive(scene, slip(scene, scene.step), points))[0] for points in (points, 8))
    return [
        check.near(
            f"slip, n = {n}, {term} with {points} points of load quadrature",
            "the loads' quadrature does not show in the error",
            "comparison",
            many[term],
            few[term],
            1e-3,
        )
        for term in TERMS
    ]


def families(full: bool = True) -> Iterator[Family]:
    """Every family of runs; without `full` those that cost seconds."""
    smooth: dict[str, Lagged] = {"slip": slip, "slip by the law": slip_by_law, "stick by the law": stick}
    space = ((8, 3), (16, 3), (32, 3), (64, 3)) if full else ((8, 3), (16, 3), (32, 3))
    half = {"time.end": 0.5}
    time = ((3, 16), (3, 32), (3, 64), (3, 128))
    for coupling in COUPLINGS if full else COUPLINGS[:1]:
        flat = setting(2, coupling=coupling)
        floating = setting(2, half, coupling=coupling, floating=True)
        yield Family(f"affine fields, 2D, {coupling}, time", floating, affine, time, TIME, "k")
        for name, fields in smooth.items():
            yield Family(f"{name}, 2D, {coupling}, space", flat, lagged(fields), space, SPACE)
        if full:
            paper = full_model(load("paper_isotropic", [f"time.coupling={coupling}"]))
            # monolithic, the error of w in time is small beside that in space on the coarsest grid
            sizes = FINER if coupling == "monolithic" else DOUBLED
            case = f"slip with the paper's data, 2D, {coupling}, h = k"
            yield Family(case, paper, lambda _: sliding(), sizes, TIME)
            yield Family(f"slip by the law, 2D, {coupling}, k ~ h^2", flat, slip_by_law, SQUARED, SPACE)
            yield Family(f"stick by the law, 2D, {coupling}, k ~ h^2", flat, stick, SQUARED, SPACE)
    flat, cube = setting(2), setting(3)
    cubes = ((4, 2), (6, 2), (8, 2), (10, 2))
    yield Family("opening point, 2D, space", flat, lagged(opening), FINER_IN_SPACE, SPACE)
    yield Family("stick-slip point, 2D, space", flat, lagged(stick_slip), FINER_IN_SPACE, SPACE)
    yield Family("slip, 3D, space", cube, lagged(slip), cubes, SPACE)
    if full:
        yield Family("stick by the law, 2D, h = k", flat, stick, FINER, TIME)
        yield Family("opening point, 2D, h = k", flat, opening, FINER, TIME)
        yield Family("opening point, 2D, k ~ h^2", flat, opening, ((16, 16), (32, 64), (64, 256)), SPACE)
        yield Family("stick-slip point, 2D, h = k", flat, stick_slip, FINER, TIME, points=4)
        yield Family("affine fields, 3D, time", setting(3, half, floating=True), affine, time, TIME, "k")
        yield Family("stick by the law, 3D, space", cube, lagged(stick), cubes, SPACE)
        yield Family("slip by the law, 3D, space", cube, lagged(slip_by_law), ((8, 2), (12, 2), (16, 2)), SPACE)
        yield Family("slip, 3D, k ~ h^2", setting(3, half), slip, ((6, 9), (8, 16), (10, 25)), SPACE)


def report(full: bool = True) -> list[Check]:
    """All lines: two to three minutes of one core, without `full` half a minute."""
    lines = [exactness(dim, coupling) for dim in (2, 3) for coupling in COUPLINGS]
    lines += [sticking(dim, quadrature) for dim in (2, 3) for quadrature in ("nodal", "gauss-3")]
    lines += [status(name, n) for name in ("opening", "stick-slip") for n in ((16, 32) if full else (16,))]
    lines += load_quadrature()
    return lines + [one for family in families(full) for one in orders(family)]
