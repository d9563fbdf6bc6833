"""Every data set, foundation temperature and coupling against the independent SciPy scheme, step by step."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from reference import scipy_scheme

import warmslip
from warmslip import Trajectory

N = STEPS = 8
CASES = list(itertools.product(scipy_scheme.READINGS, (0.0, 10.0), scipy_scheme.COUPLINGS))
FIELDS = ("u", "w", "theta")


def scene(reading: str, foundation: float, coupling: str) -> warmslip.Scene:
    return warmslip.load(f"paper_{reading}").override(
        **{
            "mesh.n": N,
            "time.steps": STEPS,
            "time.coupling": coupling,
            "contact.heat_exchange.foundation_temperature": foundation,
        }
    )


@pytest.mark.parametrize(("reading", "foundation", "coupling"), CASES)
def test_case(tmp_path: Path, reading: str, foundation: float, coupling: str) -> None:
    theirs = scipy_scheme.simulate(reading, foundation, N, STEPS, coupling)
    ours = warmslip.run(scene(reading, foundation, coupling), out=tmp_path)
    assert ours.outcome == "completed"
    with Trajectory(tmp_path / "trajectory.h5") as t:
        for name in FIELDS:
            expected = getattr(theirs, name)
            assert np.abs(getattr(t, name)[:] - expected).max() <= 1e-11 * np.abs(expected).max(), name
        contact, steps = t.series("contact"), t.series("steps")
    # the same pressure, friction and status at every contact point of every step
    order = np.argsort(contact["positions"][:, 0])
    force = contact["force"][:, order] / contact["weights"][order][:, None]
    scale = np.abs(theirs.pressure).max()
    assert np.abs(-force[..., 1] - theirs.pressure[1:]).max() <= 1e-10 * scale
    assert np.abs(force[..., 0] - theirs.friction[1:]).max() <= 1e-10 * scale
    slip = np.abs(theirs.friction[1:]) >= 0.2 * theirs.pressure[1:] * (1 - 1e-9)
    status = np.where(theirs.pressure[1:] == 0, 0, np.where(slip, 2, 1))
    np.testing.assert_array_equal(contact["status"][:, order], status)
    for number, name in enumerate(("open", "stick", "slip")):
        np.testing.assert_array_equal(steps[name], (status == number).sum(axis=1))
    norms = scipy_scheme.norms(N, theirs.u[-1], theirs.w[-1], theirs.theta[-1])
    assert ours.summary["norms"] == pytest.approx(norms, rel=1e-11)
    weights = scipy_scheme.edge_weights(N)
    assert ours.summary["contact"]["normal_force"] == pytest.approx(weights @ theirs.pressure[-1], rel=1e-10)
    assert ours.summary["contact"]["tangential_force"] == pytest.approx(abs(weights @ theirs.friction[-1]), rel=1e-10)


def test_the_cases_differ_and_meet_every_status(tmp_path: Path) -> None:
    """Otherwise the comparison above would compare little."""
    ends, statuses = set(), set()
    for number, case in enumerate(CASES):
        ours = warmslip.run(scene(*case), out=tmp_path / str(number))
        ends.add(round(ours.summary["norms"]["u_V"], 12))
        with Trajectory(tmp_path / str(number) / "trajectory.h5") as t:
            statuses |= set(np.unique(t.series("contact")["status"]).tolist())
    assert len(ends) == len(CASES)
    assert statuses == {0, 1, 2}


@pytest.mark.parametrize(
    ("mu", "c_nu", "k_c", "rho"), [(0.0, 1e4, 1.0, 1.0), (2.0, 1e6, 0.0, 1.0), (0.5, 10.0, 1e3, 0.0)]
)
def test_other_constants(mu: float, c_nu: float, k_c: float, rho: float) -> None:
    theirs = scipy_scheme.simulate("isotropic", 10.0, N, STEPS, mu=mu, c_nu=c_nu, k_c=k_c, rho=rho, keep="final")
    ours = warmslip.run(
        scene("isotropic", 10.0, "staggered").override(
            **{
                "contact.friction.coefficient": mu,
                "contact.stiffness": c_nu,
                "contact.heat_exchange.conductance": k_c,
                "inertia.density": rho,
            }
        )
    )
    assert ours.outcome == "completed"
    assert ours.summary["norms"] == pytest.approx(
        scipy_scheme.norms(N, theirs.u[-1], theirs.w[-1], theirs.theta[-1]), rel=1e-10
    )
