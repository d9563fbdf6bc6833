"""A slab between ice and a foundation that exchanges heat: theta = 0 at y = H, K theta_y = k_c (theta - theta_F) at y = 0.

H. S. Carslaw & J. C. Jaeger, Conduction of Heat in Solids, 1959, section 3.11: theta = rest + sum of c_m sin(b_m (H - y))
exp(-K b_m^2 t) with K b cos(b H) + k_c sin(b H) = 0. The exchange does not depend on the contact pressure.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from warmslip.records.check import Check, below, near, order
from warmslip.scene.full import FullScene
from warmslip.simulation.simulation import Simulation
from warmslip.studies.error_norms import ExactErrors
from warmslip.studies.rates import least_squares
from warmslip.typing import Array
from warmslip.verification.exact import fixtures

HEIGHT, CONDUCTIVITY, EXCHANGE, FOUNDATION, END = 1.5, 0.8, 2.0, 10.0, 0.4
# the slope of theta at rest: K B = k_c (theta_F - B H)
SLOPE = EXCHANGE * FOUNDATION / (CONDUCTIVITY + EXCHANGE * HEIGHT)
MODES = 40  # the last one has decayed below 1e-20 at END, in 8 steps too


def series(y: Array, t: float, steps: int | None = None) -> Array:
    """theta (points,) at heights `y` (points,) and time `t` > 0, from theta(0) = 0.

    With `steps`, what as many steps of backward Euler make of every mode.
    """

    def condition(b: float) -> float:
        return float(CONDUCTIVITY * b * np.cos(b * HEIGHT) + EXCHANGE * np.sin(b * HEIGHT))

    # one root in each half-open interval ((m - 1/2) pi, m pi]
    b = np.array(
        [brentq(condition, (m - 0.5) * np.pi / HEIGHT, m * np.pi / HEIGHT, xtol=1e-14) for m in range(1, MODES + 1)]
    )
    moment = np.sin(b * HEIGHT) / b**2 - HEIGHT * np.cos(b * HEIGHT) / b  # int_0^H z sin(b z) dz
    norm = HEIGHT / 2 - np.sin(2 * b * HEIGHT) / (4 * b)
    rate = CONDUCTIVITY * b**2
    decay = np.exp(-rate * t) if steps is None else (1 + rate * t / steps) ** -steps
    z = HEIGHT - y
    return np.asarray(SLOPE * z - np.sin(z[:, None] * b) @ (SLOPE * moment / norm * decay))


def _scene(n: int, end: float, steps: int) -> FullScene:
    return fixtures.blank(
        mesh__n=[max(1, n // 4), n],
        mesh__lengths=[HEIGHT / 4, HEIGHT],
        time__end=end,
        time__steps=steps,
        inertia__density=1.0,
        # along x it conducts differently: an exchanged index shows
        heat__conductivity=[[3.0, 0.0], [0.0, CONDUCTIVITY]],
        supports__temperature=["top"],
        contact__heat_exchange__conductance=EXCHANGE,
        contact__heat_exchange__foundation_temperature=FOUNDATION,
    )


def _march(n: int, end: float, steps: int) -> Simulation:
    simulation = fixtures.run(_scene(n, end, steps))
    for _ in fixtures.steps(simulation):
        pass
    return simulation


def _error(n: int, steps: int, *, euler: bool) -> float:
    """L2 distance at END to the series, or to backward Euler's, relative to theta."""
    simulation = _march(n, END, steps)
    d = simulation.discretisation
    measure = ExactErrors(
        d,
        w=lambda x, t: 0 * x,
        theta=lambda x, t: series(x[:, 1], t, steps if euler else None),
        gradient=lambda x, t: np.zeros((len(x), 2, 2)),
    )
    return measure.of(simulation.stepper)["theta_L2"] / float(d.norms.l2(simulation.stepper.theta))


def robin_slab() -> list[Check]:
    """Warming from 0 towards the steady state: first order in k, second in h; the steady state is linear, so exact."""
    n, counts = 48, [8, 16, 32]
    in_time = [_error(n, steps, euler=False) for steps in counts]
    meshes = [8, 16, 32]
    in_space = [_error(m, 8, euler=True) for m in meshes]
    p_time, _ = least_squares([1 / s for s in counts], in_time)
    p_space, _ = least_squares([1 / m for m in meshes], in_space)
    y = (np.arange(400) + 0.5) * HEIGHT / 400
    exact = series(y, END)
    damped = float(np.linalg.norm(series(y, END, counts[-1]) - exact) / np.linalg.norm(exact))
    # a step solves -K theta_yy + theta/k = ...: Galerkin's error lies between that of the L2 projection, h^2/sqrt(720)
    # |theta_yy|, and that of Ritz's, in one dimension the interpolant's, h^2/sqrt(120); K theta_yy is the last difference in time
    bend = np.linalg.norm(series(y, END, 8) - series(y, END * 7 / 8, 7)) / (CONDUCTIVITY * END / 8)
    ritz = float((HEIGHT / meshes[-1]) ** 2 / np.sqrt(120) * bend / np.linalg.norm(series(y, END, 8)))
    best = ritz / np.sqrt(6)
    long = _march(6, 1e9, 3)
    y, theta = fixtures.nodes(long)[:, 1], fixtures.fields(long)[2]
    foot = theta[fixtures.on(long, "bottom")].mean()
    fine = f"Robin slab, n = {n}, {counts[-1]} steps"
    space = f"Robin slab, 8 steps, n = {meshes[-1]}"
    rest = "Robin slab, at rest"
    return [
        order(fine, "theta at the end is O(k)", "analytic", 1.0, p_time),
        near(fine, "the error is that of backward Euler in every mode", "analytic", damped, in_time[-1], 0.03),
        order(space, "distance to backward Euler's series is O(h^2)", "analytic", 2.0, p_space),
        Check(
            space,
            "it is between the best P1 function's and the interpolant's",
            "analytic",
            ritz,
            in_space[-1],
            best,
            ritz,
        ),
        # of theta at 0, one part in 1e8 is left after a step of 1e9/3: three of them end at rest
        below(rest, "theta is linear", "analytic", fixtures.worst(theta, SLOPE * (HEIGHT - y)), fixtures.ROUND_OFF),
        near(
            rest,
            "flux in is flux out",
            "analytic",
            CONDUCTIVITY * SLOPE,
            EXCHANGE * (FOUNDATION - foot),
            fixtures.ROUND_OFF,
        ),
    ]
