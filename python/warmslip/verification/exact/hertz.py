"""A line contact on the half-plane: Hertz, what a compliant foundation makes of him, and Cattaneo-Mindlin's partial slip.

K. L. Johnson, Contact Mechanics, 1985, 4.2(c) and 7.2(a). Half-widths are measured by second moments, which a mesh resolves
better than it does an edge: the ellipse sqrt(1 - x^2/a^2) has <x^2> = a^2/4.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from warmslip.records.check import Check, Origin, below, near, order
from warmslip.studies.rates import least_squares
from warmslip.typing import Array
from warmslip.verification.exact import fixtures
from warmslip.verification.exact.halfplane import FORCE, PEAK, Foot, HalfPlane

STIFF = 1e4  # p_0/c_nu is 3e-4 of the depth a^2/(2R) of the indentation or less
SETTLE = 20  # steps until the block lies still


def _width(x: Array, traction: Array, weight: Array) -> float:
    """Half-width of an elliptic traction with these values (points,)."""
    return float(2 * np.sqrt(weight @ (traction * x**2) / (weight @ traction)))


def _pressed(body: HalfPlane) -> tuple[Foot, Array, float]:
    """The foot under P at rest, u (nodes, 2), and the largest velocity that is left, of what falls by a in a step."""
    simulation = body.simulation(SETTLE, lambda t: 0.0)
    for _ in fixtures.steps(simulation):
        pass
    u, w, _ = fixtures.fields(simulation)
    return Foot.of(simulation), u, float(np.abs(w).max() * body.step)


def _ellipse(x: Array, half: float) -> Array:
    return np.asarray(half * np.sqrt(np.maximum(1 - (x / half) ** 2, 0)))


def _distance(foot: Foot, traction: Array, exact: Array) -> float:
    """Relative L2 distance of two tractions (points,)."""
    return float(np.sqrt(foot.weight @ (traction - exact) ** 2 / (foot.weight @ exact**2)))


def hertz() -> list[Check]:
    """a = sqrt(4 P R/(pi E*)), p_0 = 2 P/(pi a): what the mesh, the size of the block and the compliance cost."""
    lines, misses = [], {}
    for cells, size, band in ((4, 8.0, 1e-2), (8, 8.0, 5e-3), (16, 4.0, 5e-3), (16, 8.0, 1e-3)):
        foot, moving = _pressed(HalfPlane(1.0, size, cells, STIFF))[::2]
        miss = _distance(foot, foot.pressure, PEAK * foot.average(lambda x: _ellipse(x, 1.0)))
        misses[cells, size] = miss
        name = f"Hertz, a/h = {cells}, L/a = {size:g}"
        lines += [
            near(name, "half-width", "analytic", 1.0, _width(foot.x, foot.pressure, foot.weight), band),
            near(name, "peak pressure", "analytic", PEAK, float(foot.pressure.max()), band),
            near(name, "the foundation carries P", "analytic", FORCE, float(foot.weight @ foot.pressure), 1e-5),
            below(name, "the block lies still", "analytic", moving, 1e-6),
        ]
    meshes = [4, 8, 16]
    p, _ = least_squares([1 / n for n in meshes], [misses[n, 8.0] for n in meshes])
    # the pressure ends like a square root, which is in H^s for s < 1
    return [*lines, order("Hertz, L/a = 8", "pressure in L2 is O(h)", "analytic", 1.0, p)]


def winkler(body: HalfPlane, cells: int = 300, half: float = 1.5) -> tuple[Array, Array]:
    """Cell centres on [-half, half] and pressures of the exact half-plane on the parabola with normal compliance.

    p/c_nu - 2/(pi E*) int p(s) ln|x - s| ds = d - x^2/(2R) where p > 0, int p = P, by piecewise constant pressures; cells that
    would pull are left out one after another from the outside.
    """
    edge = np.linspace(-half, half, cells + 1)
    x = (edge[1:] + edge[:-1]) / 2
    offset = x[:, None] - edge
    primitive = offset * (np.log(np.abs(offset)) - 1)
    kernel = np.eye(cells) / body.stiffness - 2 / (np.pi * body.modulus) * (primitive[:, :-1] - primitive[:, 1:])
    gap, h = x**2 / (2 * body.radius), edge[1] - edge[0]
    touching = np.ones(cells, dtype=bool)
    while True:
        n = int(touching.sum())
        system = np.block(
            [[kernel[np.ix_(touching, touching)], -np.ones((n, 1))], [h * np.ones((1, n)), np.zeros((1, 1))]]
        )
        solution = np.linalg.solve(system, np.append(-gap[touching], FORCE))[:-1]
        if (solution >= 0).all():
            break
        touching[np.flatnonzero(touching)[solution < 0]] = False
    pressure = np.zeros(cells)
    pressure[touching] = solution
    return x, pressure


def compliant() -> list[Check]:
    """A foundation as soft as the body: Hertz is wrong by a tenth, the half-plane's integral equation is not."""
    body = HalfPlane(1.0, 8.0, 16, stiffness=10.0)
    x, exact = winkler(body)
    foot, _, _ = _pressed(body)
    wide, peak = _width(x, exact, np.ones(len(x))), float(exact.max())
    name = "line contact, c_nu a/E* = 3.75"
    how: Origin = "independent code"
    return [
        near(name, "second moment of the pressure", how, wide, _width(foot.x, foot.pressure, foot.weight), 2e-3),
        near(name, "peak pressure", how, peak, float(foot.pressure.max()), 2e-3),
        below(
            name,
            "pressure, of the peak",
            how,
            fixtures.worst(foot.pressure, np.interp(foot.x, x, exact), peak),
            5e-3,
        ),
        Check(
            name,
            "the compliance is felt: Hertz's peak is missed",
            how,
            peak,
            float(foot.pressure.max()),
            0.5 * PEAK,
            0.95 * PEAK,
        ),
    ]


def _partial_slip(c: float, x: Array) -> Array:
    return _ellipse(x, 1.0) - _ellipse(x, c)


def cattaneo_mindlin() -> list[Check]:
    """Q < mu P after P: q = mu p_0 (sqrt(1 - x^2/a^2) - c/a sqrt(1 - x^2/c^2)), stick for |x| < c = a sqrt(1 - Q/(mu P)).

    Friction is switched on when the block lies still, for Hertz's pressure is that without friction. The theory neglects that
    shear moves the surface up and down, mu/(lambda + 2 mu) of what it moves it along: lambda = 18 leaves 1/20, squared.
    """
    friction, steps, full, lines = 0.2, 10, 0.8, []
    for cells, band in ((8, 0.03), (16, 0.01)):
        body = HalfPlane(18.0, 8.0, cells, STIFF, friction)
        _, u, _ = _pressed(HalfPlane(18.0, 8.0, cells, STIFF))
        limit, duration = friction * FORCE, steps * body.step

        def load(t: float, limit: float = limit, duration: float = duration) -> float:
            return full * limit * t / duration

        simulation = body.simulation(steps, load)
        fixtures.start(simulation, u=u)
        for n, _ in enumerate(fixtures.steps(simulation), 1):
            if n not in (6, 8, 10):
                continue
            foot, q = Foot.of(simulation), load(simulation.stepper.time)
            c = float(np.sqrt(1 - q / limit))
            short = friction * foot.pressure - foot.shear
            exact = foot.average(partial(_partial_slip, c))
            miss = _distance(foot, foot.shear, friction * PEAK * exact)
            stuck = float(np.abs(foot.x[foot.status == 1]).max())
            name = f"Cattaneo-Mindlin, a/h = {cells}, Q = {q / limit:.2f} mu P"
            lines += [
                near(name, "stick half-width, by moments", "analytic", c, _width(foot.x, short, foot.weight), band),
                Check(name, "the last point that sticks", "analytic", c, stuck, c - 1.5 / cells, c + 0.5 / cells),
                below(name, "shear traction, relative in L2", "analytic", miss, 0.8 / cells),
                near(name, "friction carries Q", "analytic", q, float(foot.weight @ foot.shear), 3e-3),
            ]
    return lines
