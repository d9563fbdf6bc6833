"""The digits that a run states of its fields, where rounding of one field spoils another and where nothing is definite.

`python test_digits.py` checks all of it on the ranks it has.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from boxes import along, elasticity, field, scene
from ranked import Checks

from warmslip import Run

check = Checks()


def carried(d: int, speed: float, **keys: Any) -> Run:
    """A warm body under a load, on a support that moves with it: nothing but its place depends on the speed."""
    job = Run(
        scene(
            d,
            3 if d == 2 else 2,
            time={"end": 1.0, "steps": 4, **keys},
            inertia={"density": 1.0},
            elasticity=elasticity(d, 100.0, 0.3),
            heat={
                "conductivity": 1.0,
                "capacity": 1.0,
                "expansion": {"tensor": 0.1},
                "heating": {"tensor": -0.1},
            },
            supports={"displacement": {"bottom": [f"{speed}*t"] + [0.0] * (d - 1)}},
            initial={"velocity": along(d, 0.0, speed)},
            loads={"traction": {"right": ["sin(3*t)"] + [0.3] * (d - 1)}},
        )
    )
    for _ in job.steps():
        pass
    assert job.outcome == "right", job.failure
    return job


@check
def rounding_of_a_fast_motion(d: int) -> None:
    """Temperatures and stresses lose the digits that rounding of a velocity takes, and the run says how many."""
    for coupling in ("staggered", "lagged", "monolithic"):
        still = field(carried(d, 0.0, coupling=coupling), "theta")
        for speed in (1e4, 1e6, 1e8, 1e10, 1e12):
            job = carried(d, speed, coupling=coupling)
            stated, said = job.summary()["digits"], job.summary()["warnings"]
            error = np.abs(field(job, "theta") - still).max() / np.abs(still).max()
            assert error <= 10 ** (1 - stated["theta"]), (coupling, speed, error, stated)
            assert stated["theta"] <= 1 - np.log10(speed * 1e-16 / np.abs(still).max())
            for name, words in (("theta", "the temperature keeps"), ("stress", "the stress keeps")):
                assert any(words in one for one in said) == (stated[name] < 4), (name, said)


def cooling(d: int, coupling: str) -> Run:
    """A steel block rests by its weight on a foundation that cools it, without inertia: it shrinks over all points."""
    job = Run(
        scene(
            d,
            1 if d == 2 else 2,
            length=0.1,
            time={"end": 300.0 if d == 2 else 0.03, "steps": 3, "coupling": coupling},
            elasticity=elasticity(d, 2.1e11, 0.3),
            heat={"conductivity": 50.0, "capacity": 3.6e6, "expansion": {"tensor": 6.3e6}},
            loads={"body": along(d, -76518.0)},
            initial={"temperature": 20.0},
            contact={
                "part": "bottom",
                "stiffness": 1e10,
                "friction": {"coefficient": 0.3},
                "heat_exchange": {"conductance": 1e3},
            },
        )
    )
    for _ in job.steps():
        pass
    return job


@check
def a_place_that_no_force_determines(d: int) -> None:
    """Two points that slip towards each other hold a body wherever it lies between; many in the plane know where."""
    for coupling in ("staggered", "monolithic"):
        job = cooling(d, coupling)
        assert job.outcome == "right", job.failure
        np.testing.assert_allclose(job.report.normal_force, 76518.0 * 0.1**d, rtol=1e-10)
        told = job.summary()
        said = any("do not determine where the body is" in one for one in told["warnings"])
        assert said == (d == 2)
        assert told["digits"]["u"] == 0 if said else told["digits"]["u"] > 8


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
