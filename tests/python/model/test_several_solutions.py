"""What a run says where a step may have several solutions and no bound on friction is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.sensible import PRESSED, body, warnings

import warmslip


def test_where_no_bound_on_friction_is_known_the_run_says_so() -> None:
    """Friction that depends on the slip speed, and a body without inertia that nothing but its contact holds."""
    weak = body(PRESSED, contact__friction__kinetic=0.1, contact__friction__speed=0.5)
    held = body(PRESSED, supports__displacement=[], inertia=None)
    for scene, reason in (
        (weak, "friction depends on the slip speed"),
        (held, "nothing but its contact holds the body"),
    ):
        message = [one for one in warnings(scene) if "no value of a coefficient is known" in one]
        assert (
            len(message) == 1
            and reason in message[0]
            and "compare with a run in steps of half the length" in message[0]
        )
    assert not any("no value of a coefficient is known" in one for one in warnings(body(PRESSED)))


@pytest.mark.parametrize("friction", [{"coefficient": 0.3}, None])
def test_a_friction_law_of_ones_own_has_no_bound(friction: Any) -> None:
    """With and without a coefficient in the scene, which the law takes the place of."""
    scene = body(PRESSED, contact={"part": "bottom", "stiffness": 1e4} | ({"friction": friction} if friction else {}))
    law = warmslip.Law(friction=lambda p, v: (0.2 * p, 0.2 + 0 * p, 0 * v))
    done = warmslip.run(scene, laws={"bottom": law})
    message = [one for one in done.summary["warnings"] if "no value of a coefficient is known" in one]
    assert done.completed and len(message) == 1 and message[0].startswith("the friction ")


def test_a_singular_compliance_is_a_share_of_forces(monkeypatch: pytest.MonkeyPatch) -> None:
    """What `exact` cannot divide by is said like the shares that are found before."""

    def fails(points: Any) -> float:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("warmslip.model.several_solutions.exact", fails)
    assert any("share their normal forces in many ways" in one for one in warnings(body(PRESSED, mesh__n=2)))
