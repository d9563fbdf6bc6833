"""The scenes of the library against what their files state: laws of motion, closed forms, Hertz."""

from __future__ import annotations

import numpy as np
import pytest

import warmslip


def test_the_thrown_block_stops_where_coulomb_says() -> None:
    """V^2/(2 mu g) on, with half of its energy in it as heat but for what damping takes."""
    result = warmslip.run(warmslip.load("sliding_block"))
    assert result.u[:, 0].mean() == pytest.approx(1 / (2 * 0.2 * 10), rel=2e-2)
    assert np.abs(result.w[:, 0]).max() < 1e-4


def test_the_dropped_block_jumps_up_again() -> None:
    """Without friction and viscosity nearly all of its speed comes back."""
    result = warmslip.run(warmslip.load("elastic_drop"))
    assert 0.9 < result.w[:, 1].mean() < 1


def test_the_column_creeps_as_its_two_exponentials_say() -> None:
    """The final contact force is that of its file; the touch is where the Kelvin-Voigt column reaches the gap."""
    simulation = warmslip.Simulation(warmslip.load("creep_column"))
    force = [report.normal_force for _, report in simulation.steps()]
    young, height, stiffness, gap, traction = 3.0, 2.0, 7.0, 0.3, 1.2
    final = stiffness * (height * (traction + stiffness * gap) / (young + stiffness * height) - gap)
    assert final == pytest.approx(0.618, abs=5e-4)  # as its file states
    assert force[-1] == pytest.approx(final, rel=1e-11)
    touch = -0.5 * np.log(1 - gap / height / (traction / young))
    assert simulation.scene.step * np.count_nonzero(np.array(force) == 0) == pytest.approx(touch, abs=0.05)


@pytest.mark.parametrize(("gap", "within"), [("(x - 6)**2 / 8", 1e-2), (None, 2e-2)])
def test_the_cylinder_presses_as_hertz_says(gap: str | None, within: float) -> None:
    """From a block of finite size: peak pressure and half-width belong to the force within a hundredth for Hertz's parabola. The
    circle of the scene is steeper at the edge of the contact."""
    scene = warmslip.load("hertz")
    simulation = warmslip.Simulation(scene.override(**{"contact.gap": gap}) if gap else scene)
    for state, report in simulation.steps():
        pressure, force = state.contact["pressure"], report.normal_force
    peak = np.sqrt(force / (1 - 0.3**2) / (np.pi * 4.0))
    x, weights = (
        np.asarray(simulation.discretisation.surface.positions)[:, 0] - 6,
        np.asarray(simulation.discretisation.surface.weights),
    )
    width = 2 * np.sqrt((weights * pressure) @ x**2 / force)
    assert pressure.max() == pytest.approx(peak, rel=within)
    assert width == pytest.approx(2 * force / (np.pi * peak), rel=within)


def test_half_the_cylinder_is_the_whole_one() -> None:
    """Half of Hertz's block on a symmetry plane, with friction: the whole block to 1e-12."""
    whole = warmslip.load("hertz").override(**{"mesh.n": [48, 24], "contact.friction": {"coefficient": 0.3}})
    half = whole.override(
        **{
            "mesh.n": [24, 24],
            "mesh.lengths": [6.0, 6.0],
            "contact.gap.at": [0.0, -4.0],
            "supports.displacement": {"top": [0.0, "-0.25 * t"], "left": [0.0, "free"]},
        }
    )
    ends = []
    for scene, shift in ((whole, 6.0), (half, 0.0)):
        simulation = warmslip.Simulation(scene)
        for _, report in simulation.steps():
            force = report.normal_force
        x = np.asarray(simulation.discretisation.mesh.nodes) - [shift, 0.0]
        u = np.asarray(simulation.discretisation.field(simulation.stepper.u))
        right = x[:, 0] >= -1e-12
        order = np.lexsort(np.round(x[right].T, 9))
        ends.append((u[right][order], force))
    assert ends[1][1] == pytest.approx(ends[0][1] / 2, rel=1e-12)
    assert np.abs(ends[0][0] - ends[1][0]).max() <= 1e-12 * np.abs(ends[0][0]).max()


def test_the_quarter_sphere_presses_as_hertz_says() -> None:
    simulation = warmslip.Simulation(warmslip.load("quarter_sphere"))
    for state, report in simulation.steps():
        pressure, force = state.contact["pressure"], 4 * report.normal_force
    modulus, radius = 1 / (1 - 0.3**2), 2.0
    peak = (6 * force * modulus**2 / (np.pi**3 * radius**2)) ** (1 / 3)
    assert pressure.max() == pytest.approx(peak, rel=2e-2)
    x, weights = (
        np.asarray(simulation.discretisation.surface.positions),
        np.asarray(simulation.discretisation.surface.weights),
    )
    contact_radius = np.sqrt(2.5 * 4 * (weights * pressure) @ (x[:, :2] ** 2).sum(axis=1) / force)
    assert contact_radius == pytest.approx((3 * force * radius / (4 * modulus)) ** (1 / 3), rel=4e-2)


def test_the_belt_takes_the_block_along() -> None:
    """The block gains mu g while it slips, and moves with the belt when it sticks."""
    simulation = warmslip.Simulation(warmslip.load("belt"))
    speeds = []
    for state, report in simulation.steps():
        speeds.append((state.time, float(state.w[:, 0].mean()), report.stick))
    slipping = [(t, speed) for t, speed, stick in speeds if 0.2 < t < 0.6]
    assert max(abs(speed - 0.6 * t) for t, speed in slipping) < 1e-3
    assert speeds[-1][2] > 15
    assert speeds[-1][1] == pytest.approx(0.4, rel=2e-2)


def test_the_drum_drags_the_shoe_with_its_friction() -> None:
    simulation = warmslip.Simulation(warmslip.load("drum"))
    for _, report in simulation.steps():
        last = report
    assert last.open > 0 and last.stick == 0
    assert last.friction_traction[0] == pytest.approx(-0.3 * last.normal_force, rel=1e-12)
    reactions = simulation.discretisation.field(simulation.stepper.reactions)
    assert reactions.sum(axis=0) == pytest.approx([0.3 * last.normal_force, -last.normal_force], rel=1e-10)
    assert last.balances.foundation_work == pytest.approx(last.balances.friction, rel=1e-10)


def test_the_waves_shake_the_body_and_do_not_drag_it() -> None:
    simulation = warmslip.Simulation(warmslip.load("wavy_road"))
    touching = []
    for state, report in simulation.steps():
        assert np.abs(state.contact["friction traction"]).max() == 0
        touching.append(report.stick + report.slip)
    assert min(touching[10:]) > 0 and max(touching[10:]) < len(state.contact["gap"])  # always in part
