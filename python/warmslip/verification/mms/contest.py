"""What accuracy costs on a smooth solution: the methods of `studies.tradeoff` against exact fields instead of a fine run.

The paper's body slides everywhere and is pressed everywhere (`manufactured.slipping`): no corner is singular, no layer starts,
and the errors are those of the scheme alone.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable

import numpy as np

from warmslip.model.discretisation import discretise
from warmslip.records.tables import Row
from warmslip.scene.full import FullScene, full_model
from warmslip.scene.reader import load
from warmslip.simulation.simulation import Simulation
from warmslip.studies.companions import Companion, Distance
from warmslip.studies.error_norms import TERMS, ExactErrors
from warmslip.studies.recording import seconds
from warmslip.studies.tradeoff import COMPLETED, KNOBS, METHODS, Keys, row
from warmslip.verification.mms.manufactured import slipping
from warmslip.verification.mms.symbolic import Manufactured

SCENE = "paper_mixed"
LEVELS = (8, 16, 32, 64)


def companion(scene: FullScene, solution: Manufactured) -> Companion:
    """A run of a scene with manufactured data, at its start."""
    d = discretise(scene, loads=solution.loads)
    simulation = Simulation(scene, discretisation=d)
    nodes = np.asarray(d.mesh.nodes)
    d.restart(simulation.stepper, solution.u(nodes, 0.0), solution.w(nodes, 0.0), solution.theta(nodes, 0.0), 0.0)
    return Companion(scene, simulation)


def distance(run: Companion, solution: Manufactured) -> tuple[Distance, dict[str, float]]:
    """Advances a run to its end: its largest errors and norms. Raises RuntimeError when it is rejected."""
    measure = ExactErrors(run.simulation.discretisation, w=solution.w, theta=solution.theta, gradient=solution.gradient)
    found, size = Distance(), dict.fromkeys(Distance().values, 0.0)
    while run.next_time < np.inf:
        run.advance()
        found.add(dict.fromkeys(found.values, 0.0) | measure.of(run.simulation.stepper))
        norms = run.norms()
        size |= {name: max(size[name], norms[name]) for name in TERMS}
    return found, size


def run(levels: tuple[int, ...] = LEVELS, say: Callable[[str], None] = lambda _: None) -> list[Row]:
    """A row for every method and level, as `tradeoff.run`, without functionals and reference."""
    whole = full_model(load(SCENE))
    solution = slipping(whole)
    rows = []
    for method, keys_of in METHODS.items():
        for n in levels if method not in KNOBS else ():  # the solution is that of the scene's own law
            keys = keys_of(n, n)
            try:
                scene = whole.override(**keys)
                one = companion(scene, solution)
            except ValueError as why:  # a mesh that cannot be graded
                say(f"{method}, n = {n}: {why}")
                continue
            errors, size = distance(one, solution)
            spent = seconds(one, lambda scene=scene: companion(scene, solution))  # type: ignore[misc]
            more = {"outcome": COMPLETED, "setting": _typed(keys), "from_ours": 0.0}
            rows.append(row(method, n, one, errors, size, spent) | more)
    return rows


def _typed(keys: Keys) -> str:
    return " ".join(f"--set {shlex.quote(f'{key}={value}')}" for key, value in keys.items())
