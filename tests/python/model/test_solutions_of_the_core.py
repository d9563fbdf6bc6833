"""Steps that may have several solutions: what the core finds of them, and what a run and `explain` say.

`python test_solutions_of_the_core.py` checks on the ranks it has that a run says how much friction leaves one solution.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.pieces import scaled, turned_piece
from support.processes import child_environment

import warmslip
from warmslip import Scene
from warmslip.model import several_solutions
from warmslip.model.discretisation import discretise
from warmslip.model.linear_pieces import exact, solutions
from warmslip.model.uniqueness import bound
from warmslip.report import cost
from warmslip.scene import plausibility
from warmslip.scene.reader import build, load
from warmslip.simulation.simulation import Simulation
from warmslip.simulation.summary import summary

Array = Any


def step_from(scene: Scene, starts: list[Array], force: Array | None, penetration: Array | None) -> list[Array]:
    """Contact forces (points, d) of one step of the core from other forces of the step before, (points, d).

    The foundation is rigid: it stores no energy, and the balances close from any forces.
    """
    d = discretise(scene)
    out = []
    for start in starts:
        stepper = d.stepper()
        stepper.resume(start.ravel(), [1] * len(start), [0.0] * 18, 0)
        loads = list(d.load_vectors.at(scene.step, scene.step))
        if force is not None:
            vector = d.layout.vector(d.dim)
            d.layout.distribute(force.ravel(), vector)
            loads[0], loads[2] = vector, -penetration
        report = stepper.advance(*loads)
        assert report.outcome.name == "completed", report.reason
        out.append(np.reshape(stepper.contact_force, (-1, d.dim)))
    return out


@pytest.mark.parametrize("d", [2, 3])
def test_the_core_finds_the_one_solution_from_any_forces(d: int) -> None:
    scene = load("quasistatic_punch" if d == 2 else "block_3d").override(
        **{"mesh.n": 4, "time.steps": 4, "contact.stiffness": "rigid"}
    )
    simulation = Simulation(scene)
    factor = several_solutions.of_scene(simulation.discretisation, simulation.stepper).factor
    assert factor > 1
    scene = scene.override(**{"contact.friction.coefficient": 0.98 * factor * scene.contacts[0].friction.coefficient})
    rng, n = np.random.default_rng(d), len(simulation.discretisation.surface.weights)
    starts = [10 ** rng.uniform(-3, 2) * rng.normal(size=(n, d)) for _ in range(12)]
    forces = step_from(scene, starts, None, None)
    largest = np.abs(forces[0]).max()
    assert largest > 0
    assert max(np.abs(one - forces[0]).max() for one in forces) < 1e-9 * largest


PUNCH: dict[str, Any] = {"mesh.n": 4, "supports.displacement": ["top"], "contact.stiffness": "rigid"}


def test_the_core_finds_two_solutions_beyond_it() -> None:
    """A load on the contact nodes of a small body that is made to have several solutions: the core finds those it starts near."""
    scene = load("quasistatic_punch").override(**PUNCH)
    simulation = Simulation(scene)
    rough = scaled(several_solutions.condensed(simulation.discretisation, simulation.stepper), 1 / 0.3)
    factor = 1.2 * exact(rough)
    rough, scene = scaled(rough, factor), scene.override(**{"contact.friction.coefficient": factor})
    asked = turned_piece(rough)
    assert asked is not None
    free, penetration = asked
    known = solutions(rough, free, penetration)
    assert len(known) >= 2
    d = discretise(scene)
    nodes, places = np.asarray(d.mesh.nodes), np.asarray(d.surface.positions)
    force = np.zeros_like(nodes)
    at = [int(np.argmin(np.linalg.norm(nodes - one, axis=1))) for one in places]
    force[at] = np.linalg.solve(rough.compliance, free.ravel()).reshape(-1, 2)
    forces = step_from(scene, [one.force for one in known], force, penetration)
    size = max(np.abs(one.force).max() for one in known)
    reached = {min(range(len(known)), key=lambda i, f=f: np.abs(known[i].force - f).max()) for f in forces}
    assert all(min(np.abs(one.force - f).max() for one in known) < 1e-9 * size for f in forces)
    assert len(reached) >= 2


def test_the_points_of_a_step_are_those_the_core_had() -> None:
    """`several_solutions.posed` and `solutions` give the forces of the run, of a body with a support and of one that flies."""
    drop = build(
        {
            "mesh": {"shape": "square", "n": 3},
            "time": {"end": 0.3, "steps": 30},
            "inertia": {"density": 1.0},
            "elasticity": {"lame": [10.0, 50.0]},
            "initial": {"velocity": [0.4, -1.0]},
            "contact": {"part": "bottom", "stiffness": 2e3, "gap": 0.02, "friction": {"coefficient": 0.3}},
        }
    )
    for scene in (drop, load("quasistatic_punch").override(**{"mesh.n": 5, "time.steps": 8})):
        simulation, touched = Simulation(scene), 0
        for _, report in simulation.steps():
            touched += report.stick + report.slip
            points, free, penetration = several_solutions.posed(simulation.discretisation, simulation.stepper)
            (one,) = solutions(points, free, penetration)
            force = np.reshape(simulation.stepper.contact_force, (-1, 2))
            assert np.abs(one.force - force).max() <= 1e-8 * np.abs(force).max()
            if np.abs(force).max() > 1e-6:
                assert [status > 0 for status in one.status] == [status > 0 for status in simulation.stepper.status]
        assert touched > 10


def rough_and_smooth() -> tuple[list[str], list[str]]:
    """Warnings of a scene whose friction is far beyond the bound and of one below it (collective)."""
    out = []
    for mu in (1.5, 0.2):
        scene = load("quasistatic_punch").override(**{"mesh.n": 6, "time.steps": 8, "contact.friction.coefficient": mu})
        out.append([one for one in warmslip.run(scene).summary["warnings"] if "one solution" in one])
    return out[0], out[1]


def test_a_run_says_that_a_step_may_have_several() -> None:
    (output,), none = rough_and_smooth()
    assert not none
    assert output.startswith("the friction coefficient is 1.5, and every step has one solution up to 0.")
    assert "Newton's method takes the one it reaches from the forces of the step before" in output
    assert "another start" not in output
    told_of_starts = plausibility.several(2.0, 1.09, sharp=False, timed=True, now=(3, "1.4"), other=2, steps=9)[0]
    assert "surely has one solution up to 1 only (1.4 if the 3 points" in told_of_starts
    assert "(from another start in 2 of 9 steps); take shorter steps," in told_of_starts
    assert output.endswith(
        "take a softer foundation or a smaller coefficient"
    )  # no inertia: shorter steps would not help


def test_explain_says_how_much_friction_leaves_one() -> None:
    scene = load("paper_mixed").override(**{"mesh.n": 8, "time.steps": 8})
    (message,) = [one for one in cost.measured(scene).every_step if "one solution" in one]
    simulation = Simulation(scene)
    most = bound(
        replace(several_solutions.condensed(simulation.discretisation, simulation.stepper), friction=np.ones(9))
    )
    assert message.startswith("friction: one solution in every step for mu up to ")
    stated = float(message.removeprefix("friction: one solution in every step for mu up to ").split(";")[0])
    assert 0.9 * most <= stated <= most
    assert message.endswith("this scene has 0.2")
    for keys, words in (
        ({"contact.friction": {"cohesion": 1.0}}, []),
        ({"contact.friction": {"coefficient": 0.5, "kinetic": 0.2, "speed": 1.0}}, ["depends on the slip speed"]),
        ({"contact.stiffness": "rigid", "contact.quadrature": "gauss-2"}, ["share their forces in many ways"]),
    ):
        output = [one for one in cost.measured(scene.override(**keys)).every_step if "one solution" in one]
        assert len(output) == len(words)
        assert all(word in one for word, one in zip(words, output, strict=True))


def test_a_run_ends_where_parts_meet_at_a_held_corner() -> None:
    contact = [{"part": "bottom", "stiffness": 1.0}, {"part": "left", "stiffness": 1.0, "quadrature": "gauss-2"}]
    contact[1]["friction"] = {"coefficient": 1.0}
    scene = build(
        {
            "mesh": {"n": [3, 1]},
            "time": {},
            "elasticity": {"lame": [1.0, 1.0]},
            "supports": {"points": [{"at": [0.0, 0.0]}], "displacement": {"top": ["free", 0.0]}},
            "contact": contact,
        }
    )
    simulation = Simulation(scene)
    assert list(simulation.steps()) and all(np.isfinite(one) for one in simulation.statistics.residuals.values())
    assert not [one for one in summary(simulation)["warnings"] if "nan" in one]


@pytest.mark.mpi
def test_two_ranks_say_the_same() -> None:
    command = ["mpirun", "-n", "2", sys.executable, str(Path(__file__).resolve())]
    result = subprocess.run(
        command, env=child_environment(), text=True, capture_output=True, timeout=300, check=False, cwd=Path.cwd()
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.count(str(rough_and_smooth())) == 2, result.stdout


if __name__ == "__main__":
    print(rough_and_smooth(), flush=True)
