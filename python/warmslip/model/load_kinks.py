"""Formulas of loads with a kink inside cells, which quadrature with few points integrates roughly."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from warmslip._core import simplex_rule
from warmslip.model.discretisation import Discretisation
from warmslip.model.loads import HEATED, Data, Formula, of_time
from warmslip.scene import plausibility
from warmslip.scene.kinks import switches
from warmslip.typing import Array

TIMES = 16  # at which formulas that depend on time are looked at
MANY = 512  # simplices that are integrated anew, of those that a kink crosses
FINE = {1: 24, 2: 16, 3: 10}  # points per direction that are taken as exact, by the dimension of the simplex
LEAST = 1e-3  # of a load, which is worth a sentence


def load_kinks(d: Discretisation) -> list[str]:
    """A sentence for each load whose formula has a kink inside cells or facets that changes the load."""
    out = []
    for key, part, formula in _formulas(d):
        inside = [s for one in formula.components for s in switches(one.text) if s.argument.names & {"x", "y", "z"}]
        if not inside:
            continue
        corners = np.asarray(d.mesh.nodes)[np.asarray(d.mesh.cells if part is None else d.mesh.parts[part])]
        times = np.linspace(0, d.scene.time.end, TIMES + 1) if of_time(formula) else np.zeros(1)
        crossed = [np.logical_or.reduce([switch.inside(corners, float(t)) for switch in inside]) for t in times]
        count = max(int(one.sum()) for one in crossed)
        if not count:
            continue
        found = [
            _missed(formula, corners, one, float(t), d.loads.points) for one, t in zip(crossed, times, strict=True)
        ]
        missed, largest = np.max(found, axis=0)
        change = float(missed / largest) if largest > 0 else 0.0
        if change > LEAST:
            what = "cells" if part is None else "facets"
            out.append(plausibility.kinked(key, count, len(corners), what, d.loads.points, change))
    return out


def _formulas(d: Discretisation) -> Iterator[tuple[str, str | None, Formula]]:
    """Every formula that is integrated over the body or a part, with its key and its part."""
    loads, scene = d.loads, d.scene
    given: list[tuple[str, str | None, Data]] = [("loads.body", None, loads.body), ("heat.source", None, loads.source)]
    given += [(f"loads.traction.{part}", part, data) for part, data in loads.traction.items()]
    given += [(f"loads.heat_flux.{part}", part, data) for part, data in loads.heat_flux.items()]
    lumped = scene.heat is not None and scene.heat.capacity_matrix == "lumped"  # taken at the vertices
    for i, contact in enumerate(scene.contacts):
        if contact.heat_exchange is not None and contact.heat_exchange.conductance > 0 and not lumped:
            given.append((HEATED, contact.part, loads.on_contact("foundation_temperature", i)))
    yield from ((key, part, data) for key, part, data in given if isinstance(data, Formula))


def _missed(formula: Formula, corners: Array, crossed: Array, t: float, points: int) -> tuple[float, float]:
    """What many quadrature points in the place of `points` change in the simplices that are `crossed`, and the whole load.

    Sums of sizes over simplices and components, not finite where the formula is not.
    """
    size, at = _measures(corners)[:, None], np.flatnonzero(crossed)
    some = at[np.linspace(0, len(at) - 1, min(MANY, len(at))).astype(int)]
    share = len(at) / max(1, len(some))
    try:
        rest = np.abs(_means(formula, corners[~crossed], t, 1)) * size[~crossed]
        few, many = (_means(formula, corners[some], t, n) for n in (points, FINE[corners.shape[1] - 1]))
    except ValueError:
        return 0.0, 0.0  # the run will stop there
    off, there = (share * float((np.abs(one) * size[some]).sum()) for one in (many - few, many))
    load = float(rest.sum()) + there
    return (off, load) if np.isfinite(off) and np.isfinite(load) else (0.0, 0.0)


def _means(formula: Formula, corners: Array, t: float, points: int) -> Array:
    """Means over simplices by quadrature, (n, components)."""
    barycentric, weights = simplex_rule(corners.shape[1] - 1, points)
    x = np.einsum("qi,nid->nqd", barycentric, corners)
    values = formula(x.reshape(-1, x.shape[2]), t)
    return np.asarray(np.einsum("q,nqc->nc", weights, values.reshape(len(corners), len(weights), -1)))


def _measures(corners: Array) -> Array:
    """Areas or volumes of simplices but for a factor that is the same for all, (n,)."""
    edges = corners[:, 1:] - corners[:, :1]
    return np.asarray(np.sqrt(np.maximum(np.linalg.det(edges @ np.swapaxes(edges, 1, 2)), 0)))
