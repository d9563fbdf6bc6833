"""Steps that have a solution end with it: bodies at which Newton's method alone gives up, each against an answer of its own."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.optimize import fsolve
from support.boxes import along, completed, elasticity, forces_of, scene

from warmslip.simulation.simulation import Simulation


class Posed:
    """What the law reads in the last step of a run: compliance, free velocities, penetrations, normals, weights, forces."""

    def __init__(self, simulation: Simulation) -> None:
        surface, stepper = simulation.discretisation.surface, simulation.stepper
        self.k = simulation.discretisation.scene.step
        self.C, self.free = np.array(stepper.contact_compliance), np.array(stepper.contact_free)
        self.penetration = np.asarray(stepper.contact_penetration)
        self.normals, self.weights = np.asarray(surface.normals), np.asarray(surface.weights)
        self.force = forces_of(simulation)

    def velocity(self, force: Any) -> Any:
        """Velocities of the points under their forces, both (points, d)."""
        return (self.free - self.C @ force.ravel()).reshape(self.normals.shape)

    def split(self, vectors: Any) -> tuple[Any, Any]:
        """Normal components (points) and tangential parts (points, d)."""
        across = (vectors * self.normals).sum(axis=1)
        return across, vectors - across[:, None] * self.normals

    def depth(self, force: Any) -> Any:
        return self.penetration + self.k * self.split(self.velocity(force))[0]


def frozen_thresholds(posed: Posed, stiffness: float, mu: float) -> Any:
    """Coulomb's law by a fixed point on the friction bounds, each step solved by projected gradients with restarts."""
    flexible = 1 / (posed.weights * stiffness)
    rate = 1 / (posed.k * np.linalg.eigvalsh(posed.C)[-1] + flexible.max())
    force = np.zeros_like(posed.normals)
    bounds = np.zeros(len(posed.weights))
    for _ in range(40):
        ahead, inertia = force.copy(), 1.0
        for _ in range(20000):
            pressing, _ = posed.split(ahead)
            slope = -posed.k * posed.velocity(ahead) - posed.penetration[:, None] * posed.normals
            slope += (flexible * pressing)[:, None] * posed.normals
            across, tangential = posed.split(ahead - rate * slope)
            size = np.linalg.norm(tangential, axis=1)
            tangential *= np.minimum(1, bounds / np.maximum(size, 1e-300))[:, None]
            after = np.maximum(across, 0)[:, None] * posed.normals + tangential
            if ((ahead - after) * (after - force)).sum() > 0:
                inertia = 1.0
            stronger = (1 + np.sqrt(1 + 4 * inertia**2)) / 2
            ahead = after + (inertia - 1) / stronger * (after - force)
            change, force, inertia = np.abs(after - force).max(), after, stronger
            if change <= 1e-14 * np.abs(after).max():
                break
        wanted = mu * np.maximum(posed.split(force)[0], 0)
        if np.abs(wanted - bounds).max() <= 1e-9 * wanted.max():
            return force
        bounds = bounds + 0.7 * (wanted - bounds)
    raise AssertionError("the fixed point does not converge")


def test_stiff_foundation_in_space() -> None:
    """54 Gauss points, a foundation 5e5 times as stiff as the body, strong friction."""
    simulation = completed(
        scene(
            3,
            [3, 3, 1],
            time={"steps": 1},
            elasticity=elasticity(3, 1.0, 0.2),
            supports={"displacement": ["left"]},
            loads={"body": along(3, -0.0004)},
            contact={
                "part": "bottom",
                "stiffness": 5e5,
                "gap": "6.7e-5 * (x - 0.5)**2",
                "quadrature": "gauss-2",
                "friction": {"coefficient": 1.0},
            },
        )
    )
    posed = Posed(simulation)
    found = posed.velocity(posed.force)
    expected = posed.velocity(frozen_thresholds(posed, 5e5, 1.0))
    assert np.abs(found - expected).max() <= 1e-7 * np.abs(posed.free).max()


@pytest.mark.parametrize(("d", "n", "points"), [(3, 2, "gauss-3"), (2, 5, "gauss-3")])
def test_rigid_foundation_with_a_curved_gap(d: int, n: int, points: str) -> None:
    """A convex quadratic programme: pressures, depths and their products decide alone whether its solution was found."""
    simulation = completed(
        scene(
            d,
            [n] * (d - 1) + [1],
            time={"steps": 1},
            elasticity=elasticity(d, 1.0, 0.25),
            supports={"displacement": ["top"]},
            loads={"body": along(d, -0.02)},
            contact={"part": "bottom", "stiffness": "rigid", "quadrature": points, "gap": "1e-4 * (x - 0.5)**2"},
        )
    )
    posed = Posed(simulation)
    pressing, friction = posed.split(posed.force)
    depth, reach = posed.depth(posed.force), np.abs(posed.free).max()
    assert pressing.min() >= 0 and np.abs(friction).max() <= 1e-15 * pressing.max()
    assert depth.max() <= 1e-12 * reach and np.abs(depth[pressing > 1e-12 * pressing.max()]).max() <= 1e-12 * reach


def test_friction_that_weakens_by_slip() -> None:
    """Two points, one at rest and one that slips, found by trying all statuses."""
    simulation = completed(
        scene(
            2,
            [1, 3],
            time={"steps": 1},
            elasticity={"young": 1.0, "poisson": 0.3, "assumption": "plane_stress"},
            supports={"displacement": ["top"]},
            loads={"traction": {"left": [0.0, -0.0008]}},
            contact={
                "part": "bottom",
                "stiffness": 1.0,
                "friction": {"coefficient": 1.0, "kinetic": 0.8, "speed": 0.003},
            },
        ).override(**{"mesh.lengths": [1.0, 20.0]})
    )
    posed, answers = Posed(simulation), []

    def law(statuses: tuple[str, ...], unknown: Any) -> Any:
        force = unknown.reshape(2, 2)
        w, pressing, out = posed.velocity(force), -force[:, 1], []
        for i, status in enumerate(statuses):
            mu = 0.8 + 0.2 * np.exp(-abs(w[i, 0]) / 0.003)
            out.append(pressing[i] - (0 if status == "open" else posed.weights[i] * posed.depth(force)[i]))
            drag = {"+": mu, "-": -mu}.get(status, 0.0) * pressing[i]
            out.append(w[i, 0] if status == "stick" else force[i, 0] - drag)
        return np.array(out)

    def possible(statuses: tuple[str, ...], force: Any) -> bool:
        w, pressing, depth = posed.velocity(force), -force[:, 1], posed.depth(force)
        return all(
            {
                "open": depth[i] <= 0,
                "stick": pressing[i] >= abs(force[i, 0]),
                "+": pressing[i] >= 0 and w[i, 0] > 0,
                "-": pressing[i] >= 0 and w[i, 0] < 0,
            }[status]
            for i, status in enumerate(statuses)
        )

    for statuses in product(("open", "stick", "+", "-"), repeat=2):
        for seed in range(20):
            start = 0.01 * np.random.default_rng(seed).normal(size=4)
            force, info, _, _ = fsolve(lambda z, s=statuses: law(s, z), start, full_output=True, xtol=1e-14)
            if np.abs(info["fvec"]).max() <= 1e-12 and possible(statuses, force.reshape(2, 2)):
                answers.append(force.reshape(2, 2))
    assert answers and np.ptp(answers, axis=0).max() <= 1e-9 * np.abs(answers).max()  # one alone
    assert np.abs(posed.force - answers[0]).max() <= 1e-9 * np.abs(answers[0]).max()


def test_sharp_regularisation_at_gauss_points() -> None:
    """Three points on two nodes, whose shares friction regularised at 1e-8 of the velocities decides."""
    simulation = completed(
        scene(
            2,
            1,
            time={"end": 6e-5, "steps": 2},
            elasticity=elasticity(2, 1.0, 0.2),
            supports={"displacement": {"top": [0.0, "-0.0015 * min(1, t / 3e-5)"]}},
            contact={
                "part": "bottom",
                "stiffness": 40.0,
                "quadrature": "gauss-3",
                "friction": {"coefficient": 2.0, "regularisation": 2e-6},
            },
        )
    )
    assert set(simulation.statistics.stages) == {"newton"}
    posed = Posed(simulation)
    pressing, friction = posed.split(posed.force)
    w = posed.split(posed.velocity(posed.force))[1][:, 0]
    assert pressing == pytest.approx(40 * posed.weights * np.maximum(posed.depth(posed.force), 0), rel=1e-9)
    # the slip that each point's friction belongs to is linear along the edge
    part = friction[:, 0] / (2 * pressing)
    slip = 2e-6 * part / np.sqrt(1 - part**2)
    assert slip == pytest.approx(w, abs=1e-11 * np.abs(posed.free).max())
