"""Supports that hold a contact part inside a rigid foundation: refused, or the run ends at that step; depths by hand.

`python test_held_inside.py D` checks on the ranks it has.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.boxes import FAR, SIDES, along, axis_of, completed, elasticity, field, scene, turned
from support.ranked import Checks

import warmslip
from warmslip import _core, discretise
from warmslip.model.meshes import make_mesh
from warmslip.simulation.simulation import Simulation

check = Checks()


def held(d: int, part: str, by: str, inside: Any, **contact: Any) -> Any:
    """A body, pressed on `part`, whose support `by` moves towards it by `inside`."""
    axis = axis_of(d, part)
    move: list[Any] = [0.0] * d
    out = 1 if part in FAR else -1
    load = [0.0] * d
    load[axis] = 0.1 * out
    move[axis] = f"{out} * ({inside})" if isinstance(inside, str) else out * inside
    return scene(
        d,
        2,
        elasticity=elasticity(d, 1.0, 0.3),
        supports={"displacement": {by: move}},
        loads={"body": load},
        contact={"part": part, "stiffness": "rigid"} | contact,
    )


def beside(d: int, part: str) -> list[str]:
    """The parts that share an edge with a part."""
    return [by for by in SIDES[d] if axis_of(d, by) != axis_of(d, part)]


@check
def a_corner_inside_is_refused_on_every_part(d: int) -> None:
    for part in SIDES[d]:
        for by in beside(d, part):
            one = held(d, part, by, 0.02, gap=0.005)
            with pytest.raises(ValueError, match=rf"holds '{part}' 0\.015 inside its rigid .*at t = 0.*contact.gap"):
                Simulation(one)


@check
def its_cures_are_cures(d: int) -> None:
    for key, value in (("gap", 0.02), ("gap", 0.021), ("stiffness", 100.0)):
        completed(held(d, "bottom", "left", 0.02, **{"gap": 0.005} | {key: value}))
    completed(held(d, "bottom", "left", -0.02, gap=0.0))
    soft = {
        "bottom": warmslip.Law(compliance=lambda r: (100.0 * max(r, 0.0), 100.0 * (r > 0), 50.0 * max(r, 0.0) ** 2))
    }
    Simulation(held(d, "bottom", "left", 0.02, gap=0.005), laws=soft)  # the user's law takes the place of the rigid one


@check
def the_deepest_place_is_named(d: int) -> None:
    one = held(d, "bottom", "left" if d == 2 else "front", 0.02, gap="0.018 - 0.015 * x")
    x = 0.0 if d == 2 else 1.0  # the front's edge has its deepest end at x = 1
    with pytest.raises(ValueError, match=f"'bottom' {0.02 - (0.018 - 0.015 * x):.3g} inside .* at [(]{x:.4g}, 0"):
        Simulation(one)


@check
def a_run_ends_at_the_step_that_brings_it_inside(d: int) -> None:
    """Steps of 1/4: the support goes in by t/50, and the gap is 0.012 or closes by as much as the support stays."""
    for inside, gap, depth in (
        ("t / 50", 0.012, 0.003),
        (0.0, "0.012 - t / 50", 0.003),
        ("t / 50", "0.024 - t / 60", 0.0035),
    ):
        one = held(d, "bottom", "left", inside, gap=gap)
        simulation = Simulation(one)
        taken = len(list(simulation.steps()))
        assert simulation.outcome == "support_inside_foundation" and simulation.failure is not None
        assert simulation.failure["step"] == taken + 1
        assert f"holds 'bottom' {depth:.3g} inside" in simulation.failure["reason"]
        assert taken == 2
        kept, before = field(simulation, "u"), Simulation(one.override(**{"time.end": 0.5, "time.steps": 2}))
        assert len(list(before.steps())) == 2 and before.outcome == "completed"
        assert np.abs(kept - field(before, "u")).max() <= 1e-14
    completed(held(d, "bottom", "left", "t / 50", gap=0.02))


@check
def gauss_points_count_where_all_their_nodes_are_held(d: int) -> None:
    """A support that has the foot's facets at x < 1/2; of an edge alone no Gauss point is held, and its free nodes give way."""
    rule = "gauss-2" if d == 2 else "gauss-3"
    one = held(d, "bottom", "left", 0.02, gap=0.005, quadrature=rule)
    box = make_mesh(one)
    kind, parts = getattr(_core, f"Mesh{d}"), {name: np.array(facets) for name, facets in box.parts.items()}
    nodes = np.array(box.nodes)
    foot = parts["bottom"]
    parts["left"] = foot[(nodes[foot][:, :, 0] < 0.6).all(axis=1)]
    mesh = kind.from_lists(nodes, box.cells, parts)
    with pytest.raises(ValueError, match=r"holds 'bottom' 0\.015 inside"):
        discretise(one, mesh=mesh)
    completed(held(d, "bottom", "left", 0.02, gap=0.005, quadrature=rule))  # the edge alone is held


@check
def gauss_points_count_where_their_nodes_are_held_across(d: int) -> None:
    """Single nodes that are held along the normal alone: a facet of theirs cannot give way, beside free nodes it does."""
    corners = [[0.0], [0.5]] if d == 2 else [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]]
    for rule in ("gauss-1", "gauss-2"):
        for mu in (0.0, 0.3):
            friction = {"friction": {"coefficient": mu}} if mu else {}

            def body(inside: Any, places: list[list[float]], gap: float = 0.005, rule: str = rule, **more: Any) -> Any:
                held_points = [{"at": [*place, 0.0], "displacement": [*["free"] * (d - 1), inside]} for place in places]
                return scene(
                    d,
                    2,
                    elasticity=elasticity(d, 1.0, 0.3),
                    supports={"displacement": {"top": [0.0] * d}, "points": held_points},
                    contact={"part": "bottom", "stiffness": "rigid", "gap": gap, "quadrature": rule} | more,
                )

            with pytest.raises(ValueError, match=r"holds 'bottom' 0\.015 inside its rigid foundation at .* at t = 0,"):
                Simulation(body(-0.02, corners, **friction))
            simulation = Simulation(body("-0.02 * t", corners, **friction))
            assert len(list(simulation.steps())) == 1 and simulation.outcome == "support_inside_foundation"
            assert "0.005 inside its rigid foundation" in simulation.failure["reason"]  # type: ignore[index]
            completed(body("-0.02 * t", corners[:1], **friction))
            across = body("-0.02 * t", corners[:1], **friction)
            beside_it = [{"at": [*place, 0.0], "displacement": [0.0, *["free"] * (d - 1)]} for place in corners[1:]]
            points = [point.model_dump(exclude_none=True) for point in across.supports.points]
            completed(across.override(**{"supports.points": [*points, *beside_it]}))  # held along the surface alone
            completed(body("-0.02 * t", corners, gap=0.0201, **friction))


@check
def a_wall_beside_its_support(d: int) -> None:
    """A held node lies on its rigid foundation to the rounding of its normal and of the solve, and is not inside."""
    for mu in (0.0, 0.3):
        rigid = {"stiffness": "rigid", "friction": {"coefficient": mu}}
        one = scene(
            d,
            [1] * (d - 1) + [2],
            time={"steps": 1},
            elasticity=elasticity(d, 1.0, 0.3),
            supports={"displacement": ["top"]},
            loads={"body": along(d, -1e-3)},
            contact={"part": "left"} | rigid,
        )
        completed(one)
        level = completed(one.override(**{"supports.displacement": ["right"], "contact.part": "bottom"}))
        for angle in (0.3, 1.0):
            turn = np.eye(d)
            turn[np.ix_([0, -1], [0, -1])] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            again, mesh = turned(one.override(**{"supports.displacement": ["right"], "contact.part": "bottom"}), turn)
            simulation = completed(again, mesh=mesh)
            assert simulation.report.normal_force == pytest.approx(level.report.normal_force, rel=1e-9)


@check
def a_support_that_meets_its_foundation_to_one_rounding(d: int) -> None:
    """0.1 + 0.2 is more than 0.3 by 6e-17: nothing presses, and nothing is wrong."""
    for quadrature in ("nodal", "gauss-2"):
        one = scene(
            d,
            1,
            time={"steps": 1},
            elasticity=elasticity(d, 1.0, 0.3),
            supports={"displacement": {"top": along(d, "-(0.1 + 0.2)")}},
            contact={"part": "bottom", "stiffness": "rigid", "gap": 0.3, "quadrature": quadrature},
        )
        assert completed(one, digits=4.0).report.normal_force <= 1e-15


@check
def a_support_that_moves_until_it_meets_its_foundation(d: int) -> None:
    """Steps that do not add up exactly press by rounding alone, whose force has no digits and needs none."""
    for quadrature in ("nodal", "gauss-2"):
        for end, steps in ((0.3, 7), (0.7, 7), (1.0, 49), (1.0, 3)):
            one = scene(
                d,
                1,
                time={"end": end, "steps": steps},
                elasticity=elasticity(d, 1.0, 0.3),
                supports={"displacement": {"top": along(d, f"-0.1 * t / {end}")}},
                contact={"part": "bottom", "stiffness": "rigid", "gap": 0.1, "quadrature": quadrature},
            )
            assert completed(one, digits=4.0).report.normal_force <= 1e-15


test_on_one_rank, test_on_two_ranks = check.tests(__file__)


if __name__ == "__main__":
    check.main()
