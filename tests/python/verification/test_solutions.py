"""Manufactured solutions with contact in the plane and in space, what must turn them red, and descriptions that are refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

import warmslip
from warmslip import Scene
from warmslip.model.meshes import make_mesh
from warmslip.records.check import Check
from warmslip.simulation.summary import summary
from warmslip.studies.error_norms import TERMS
from warmslip.verification.mms import manufactured, solutions, symbolic
from warmslip.verification.mms import orders as by_order
from warmslip.verification.mms.fields_kinked import stick_slip
from warmslip.verification.mms.fields_smooth import affine, slip, slip_by_law, stick
from warmslip.verification.mms.manufactured import derive, errors, sliding
from warmslip.verification.mms.orders import SPACE, Family, distorted, measure, order_lines, orders
from warmslip.verification.mms.solutions import COUPLINGS, lagged, setting
from warmslip.verification.mms.symbolic import ExactFields, Manufactured, T, X, Y

PAPER = warmslip.load("paper_isotropic")
COARSE = ((8, 3), (16, 3), (32, 3))


def red(lines: list[Check]) -> list[str]:
    return [f"{x.case}: {x.observed} not in [{x.low}, {x.high}]" for x in lines if not x.passed]


@pytest.mark.slow
def test_report() -> None:
    lines = solutions.report(full=False)
    assert red(lines) == []
    assert len({(x.case, x.proves) for x in lines}) == len(lines)
    assert {x.origin for x in lines} == {"manufactured", "comparison"}


# ---- what must turn exactness red -------------------------------------------------------------------------------------


def inexact(scene: Scene, solution: Manufactured) -> float:
    """Largest error of a run of `scene` over the norms at its end."""
    found, simulation = errors(scene, solution, mesh=distorted(scene))
    norms = summary(simulation)["norms"]
    return max(found[term] / norms[term] for term in TERMS)


def floating(dim: int, coupling: str = "staggered") -> Scene:
    return setting(dim, {"mesh.n": 3, "time.steps": 4}, coupling=coupling, floating=True)


def unchecked(scene: Scene, table: str, **values: Any) -> Scene:
    """The scene with values that its validation would refuse."""
    heads = table.split(".")
    parts = [scene]
    for head in heads:
        parts.append(getattr(parts[-1], head))
    new = parts.pop().model_copy(update=values)
    for part, head in zip(reversed(parts), reversed(heads), strict=True):
        new = part.model_copy(update={head: new})
    return new


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(
    ("key", "factor"),
    [
        ("contact.friction.coefficient", 1.01),
        ("contact.stiffness", 1.01),
        ("contact.heat_exchange.conductance", 1.01),
        ("heat.heating.tensor", 0.0),
        ("heat.heating.tensor", -1.0),
        ("heat.expansion.tensor", 0.99),
        ("heat.conductivity", 1.01),
        ("inertia.density", 1.01),
        ("time.end", 1.01),
    ],
)
def test_one_wrong_constant_is_seen(dim: int, key: str, factor: float) -> None:
    scene = floating(dim)
    value: Any = scene
    for head in key.split("."):
        value = getattr(value, head)
    wrong = scene.override(**{key: (factor * np.array(value)).tolist()})
    assert inexact(wrong, derive(scene, affine(scene, scene.step))) > 1e-6


@pytest.mark.parametrize("dim", [2, 3])
def test_one_wrong_sign_is_seen(dim: int) -> None:
    scene = floating(dim).override(**{"contact.gap": -5e-4})
    right = derive(scene, affine(scene, scene.step))
    assert inexact(scene, right) <= solutions.ROUND_OFF
    assert inexact(scene, replace(right, loads=replace(right.loads, gap=5e-4))) > 1e-3
    assert inexact(scene, replace(right, loads=replace(right.loads, foundation_temperature=10.1))) > 1e-3
    conductance = scene.contact.heat_exchange.conductance
    other_side = unchecked(scene, "contact.heat_exchange", conductance=-conductance)
    assert inexact(scene, derive(other_side, affine(scene, scene.step))) > 1e-2


@pytest.mark.parametrize("made_for", COUPLINGS)
@pytest.mark.parametrize("run_as", COUPLINGS)
def test_one_wrong_time_index_is_seen(made_for: str, run_as: str) -> None:
    scene = floating(2, made_for)
    error = inexact(floating(2, run_as), derive(scene, affine(scene, scene.step)))
    assert error <= solutions.ROUND_OFF if made_for == run_as else error > 1e-5


@pytest.mark.parametrize("dim", [2, 3])
def test_what_the_paper_law_alone_is_made_of(dim: int) -> None:
    """No artificial term is left, and the traction of the fields is the law's, evaluated by NumPy from their gradients."""
    scene = setting(dim)
    solution = derive(scene, slip_by_law(scene))
    loads, contact = solution.loads, scene.contact
    assert (loads.contact_traction, loads.contact_flux) == (0.0, 0.0)
    x = np.random.default_rng(2).uniform(size=(50, dim))
    x[:, -1] = 0
    for t in (0.0, 0.7):
        u, w, theta = solution.u(x, t), solution.w(x, t), solution.theta(x, t)
        gradient = solution.gradient(x, t)
        assert np.allclose(w, u, rtol=1e-13)  # all grow as exp(t)
        eps = (gradient + gradient.transpose(0, 2, 1)) / 2
        sigma = -theta[:, None, None] * np.array(scene.heat.expansion.tensor)
        for table in (scene.elasticity, scene.viscosity):
            lam, mu = table.pair(dim)
            sigma = sigma + lam * np.trace(eps, axis1=1, axis2=2)[:, None, None] * np.eye(dim) + 2 * mu * eps
        traction = -sigma[:, :, -1]
        pressure = contact.stiffness * (-u[:, -1] - loads.gap(x, t))
        direction = w[:, :-1] / np.linalg.norm(w[:, :-1], axis=1)[:, None]
        assert pressure.min() > 0.1
        assert np.allclose(traction[:, -1], pressure, rtol=1e-9)
        slope = [(solution.theta(x + 1e-6 * e, t) - solution.theta(x - 1e-6 * e, t)) / 2e-6 for e in np.eye(dim)]
        leaving = np.array(scene.heat.conductivity)[-1] @ np.array(slope)  # q . nu, nu downwards
        wall = theta - leaving / contact.heat_exchange.conductance
        assert np.abs(loads.foundation_temperature(x, t) - wall).max() <= 1e-6 * np.abs(wall).max()
        assert np.allclose(traction[:, :-1], -contact.friction.coefficient * pressure[:, None] * direction, rtol=1e-9)


# ---- what must turn orders, stick and status red ------------------------------------------------------------------------


@pytest.mark.parametrize("fields", [slip, slip_by_law], ids=["slip", "slip_by_law"])
def test_friction_one_percent_off_has_no_order(fields: solutions.Lagged, monkeypatch: pytest.MonkeyPatch) -> None:
    right, made = setting(2, {"time.steps": 3}), by_order.derive
    wrong = right.override(**{"contact.friction.coefficient": 1.01 * right.contact.friction.coefficient})
    monkeypatch.setattr(by_order, "derive", lambda scene, fields, points: made(right, fields, points))
    family = Family("x", wrong, lambda _: fields(right, right.step), COARSE, SPACE)
    assert any("w_L2" in one for one in red(orders(family)))


def test_exact_strain_without_its_half_has_no_order(monkeypatch: pytest.MonkeyPatch) -> None:
    made = by_order.derive

    def wrong(*arguments: Any) -> Manufactured:
        solution = made(*arguments)

        def gradient(x: Any, t: float) -> Any:
            exact = solution.gradient(x, t)
            shears = exact + exact.transpose(0, 2, 1)
            return np.where(np.eye(2, dtype=bool), exact, shears)

        return replace(solution, gradient=gradient)

    monkeypatch.setattr(by_order, "derive", wrong)
    assert any("u_V" in one for one in red(orders(Family("x", setting(2), lagged(slip), COARSE, SPACE))))


def test_a_slip_of_too_little_friction_is_no_stick(monkeypatch: pytest.MonkeyPatch) -> None:
    slippery = setting(2).override(**{"contact.friction.coefficient": 0.02})
    monkeypatch.setattr(solutions, "errors", lambda scene, *a, **k: errors(with_time(slippery, scene), *a, **k))
    assert not solutions.sticking(2, "nodal").passed
    assert not solutions.sticking(2, "gauss-3").passed


def with_time(scene: Scene, like: Scene) -> Scene:
    keys = {"mesh.n": like.mesh.n, "time.steps": like.time.steps, "contact.quadrature": like.contact.quadrature}
    return scene.override(**keys)


def test_the_point_of_change_depends_on_the_friction(monkeypatch: pytest.MonkeyPatch) -> None:
    strong = setting(2).override(**{"contact.friction.coefficient": 0.3})
    monkeypatch.setattr(solutions, "errors", lambda scene, *a, **k: errors(with_time(strong, scene), *a, **k))
    assert not solutions.status("stick-slip", 16).passed
    monkeypatch.setattr(solutions, "OPENING", solutions.OPENING + sp.Rational(1, 4))
    assert not solutions.status("opening", 16).passed


def test_one_quadrature_point_shows() -> None:
    assert len(red(solutions.load_quadrature(points=1))) == 2
    assert red(solutions.load_quadrature(points=2)) == []


def test_a_jump_in_the_load_wants_more_points() -> None:
    """With a slip velocity in H2 only, three points double the error of w; with one power more they are enough."""
    scene = setting(2, {"mesh.n": 16, "time.steps": 16})

    def error(power: int, points: int) -> float:
        return errors(scene, derive(scene, stick_slip(scene, power=power), points))[0]["w_L2"]

    assert error(2, 3) > 1.5 * error(2, 12)
    assert error(3, 3) == pytest.approx(error(3, 12), rel=0.05)


# ---- refusals -----------------------------------------------------------------------------------------------------------

PUSHED = -sp.Rational(1, 1000) * (1 - Y)
COLD = sp.S.Zero * X


def moved(along: Any, **values: Any) -> ExactFields:
    return ExactFields(sp.Matrix([(1 - Y) * along, PUSHED]), COLD, **{"contact_state": "slip"} | values)


@pytest.mark.parametrize(
    ("fields", "keys", "message"),
    [
        (sliding(), {"contact.gap": 0.01}, "leave contact where they should slip"),
        (stick(PAPER), {"contact.friction.coefficient": 0.02}, "beyond the cone"),
        (moved(sp.sin(4 * T)), {}, "the slip reverses at x"),
        (moved((X - sp.Rational(1, 3)) * T), {}, "the slip reverses at x"),
        (moved(T * X), {}, "the slip stops where it should go on"),
        (moved(T, contact_state="stick", friction_ratio=sp.Matrix([0, 0])), {}, "slip where they should stick"),
        (
            moved(T, contact_state="mixed", friction_ratio=sp.Matrix([sp.Rational(11, 10), 0])),
            {},
            "lies beyond the cone",
        ),
        (moved(T, contact_state="mixed", friction_ratio=sp.Matrix([-1, 0])), {}, "does not oppose the slip"),
        (slip_by_law(PAPER), {"contact.friction.coefficient": 0.21}, "the law of friction alone does not hold"),
        (replace(sliding(), theta=1 + X), {}, "theta does not vanish on 'top'"),
        (replace(moved(T), u=sp.Matrix([T, PUSHED])), {}, "u does not vanish on 'top'"),
        (slip_by_law(PAPER), {"contact.heat_exchange.conductance": 0.0}, "without stiffness and conductance"),
        (moved(T), {"contact.part": "right", "supports.temperature": ["top"]}, "touch at 'bottom'"),
    ],
)
def test_contradictions_are_refused(fields: ExactFields, keys: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message) as found:
        derive(PAPER.override(**keys), fields)
    assert "\n" not in str(found.value)


def test_a_law_without_shear_is_refused() -> None:
    soft = PAPER.override(**{"elasticity.young": 0.0, "viscosity.lame": [1.0, 0.0]})
    with pytest.raises(ValueError, match="no friction"):
        slip_by_law(soft)


def test_two_grids_are_refused() -> None:
    with pytest.raises(ValueError, match="2 grids say nothing"):
        measure(Family("x", PAPER, slip, ((4, 4), (8, 8)), SPACE))
    with pytest.raises(ValueError, match="2 grids say nothing"):
        order_lines("x", [0.5, 0.25], [1.0, 0.5], 1.0)


def test_data_of_one_step_size_are_refused_for_another() -> None:
    with pytest.raises(ValueError, match=r"steps of 0\.25"):
        measure(Family("x", setting(2), lagged(slip), ((4, 4), (8, 8), (16, 16)), SPACE))


def test_zero_is_no_order() -> None:
    (exact,) = order_lines("x", [1.0, 0.5, 0.25], [0.0, 0.0, 0.0], 2.0)
    assert exact.passed and "exactly" in exact.proves
    (some,) = order_lines("x", [1.0, 0.5, 0.25], [1e-3, 0.0, 0.0], 2.0)
    assert not some.passed
    assert not any(line.passed for line in order_lines("x", [1.0, 0.5, 0.25], [1.0, float("nan"), 0.25], 1.0))


def test_a_body_at_rest_is_exact() -> None:
    """Nothing is warm, nothing heats: errors are zero and are said to be, in place of an order."""
    still = replace(moved(0 * X, contact_state="stick", friction_ratio=sp.Matrix([0, 0])), u=sp.Matrix([0 * X, PUSHED]))
    scene = PAPER.override(**{"heat.heating.tensor": [[0.0, 0.0], [0.0, 0.0]]})
    lines = orders(Family("x", scene, lambda _: still, ((4, 2), (6, 2), (8, 2)), {"theta_L2": 2.0}))
    assert [(x.observed, x.passed) for x in lines] == [(0.0, True)]


def test_a_distorted_mesh_keeps_its_box() -> None:
    scene = setting(3, {"mesh.n": 3})
    x = np.asarray(distorted(scene).nodes)
    straight = np.asarray(make_mesh(scene).nodes)
    assert np.abs(x - straight).max() > 0.05
    for axis in range(3):
        for side in (0.0, 1.0):
            assert (x[straight[:, axis] == side, axis] == side).all()


def test_derivation_is_checked_wherever_it_is_public() -> None:
    assert manufactured.derive is derive and symbolic.derive is not derive
