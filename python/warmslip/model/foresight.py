"""What is hardly sensible before the first step, as far as mesh and data say it."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from warmslip.model.coupling import Coupled, coupled
from warmslip.model.discretisation import Discretisation
from warmslip.model.foundation import ShapeGap
from warmslip.model.initial import missing_fields
from warmslip.model.load_kinks import load_kinks
from warmslip.model.loads import Formula, evaluate, of_time
from warmslip.model.loads import data as read
from warmslip.model.materials import cell_regions
from warmslip.scene import plausibility, plausible_data
from warmslip.typing import Array

TIMES = 16  # at which data that depend on time are looked at


def before(d: Discretisation) -> list[str]:
    """All warnings before the first step. Nothing of functions in Python, which are not asked without need."""
    found = plausible_data.of_mesh(d.scene)
    found += [] if "loads" in d.user_functions else plausible_data.of_scene(d.scene)
    for warnings in (_gaps, load_kinks, _starts, _warm_corners, _missing, _coupling):
        with suppress(ArithmeticError):  # of data whose squares are no numbers nothing can be said
            found += warnings(d)
    return found


def _missing(d: Discretisation) -> list[str]:
    """Fields that the run which the scene begins with does not have."""
    names = d.remember("missing", lambda: missing_fields(d.scene))
    return [plausibility.starts_at_zero(str(d.scene.initial.run), name) for name in names]


def _warm_corners(d: Discretisation) -> list[str]:
    """Prescribed temperatures of two parts that differ where the parts meet, a pair of parts each."""
    return list(d.remember("warm corners", lambda: [] if "loads" in d.user_functions else _contradictions(d)))


def _contradictions(d: Discretisation) -> list[str]:
    """A sentence for each pair, at the time and the node where the two are furthest apart."""
    parts = list(d.scene.supports.temperature) if d.scene.heat is not None else []
    worst: dict[tuple[str, str], tuple[float, str]] = {}
    for t in np.linspace(0, d.scene.time.end, TIMES + 1) if len(parts) > 1 else ():
        try:
            given = d.load_vectors.temperature(float(t))
        except ValueError:  # between the steps a formula may have a pole
            continue
        size = max(float(np.abs(values).max(initial=0.0)) for _, values in given)
        for i, (nodes, values) in enumerate(given):
            for j, (others, other_values) in enumerate(given[:i]):
                common, here, there = np.intersect1d(nodes, others, return_indices=True)
                apart = np.abs(values[here] - other_values[there])
                pair = parts[j], parts[i]
                if len(common) and apart.max() > max(1e-9 * size, worst.get(pair, (0.0, ""))[0]):
                    k = int(apart.argmax())
                    both = float(other_values[there[k]]), float(values[here[k]])
                    place = np.asarray(d.mesh.nodes)[common[k]]
                    worst[pair] = float(apart[k]), plausibility.warm_corner(*pair, *both, place, float(t))
    return [text for _, text in worst.values()]


def _coupling(d: Discretisation) -> list[str]:
    """A coupling that makes motion and temperature grow, where the tensors alone say so."""
    scheme, step = d.scene.time.coupling, d.scene.step  # the longest
    found = coupled_materials(d)
    finest = d.remember("finest", lambda: _finest(d)) if found else 0.0
    limits = [one.limit(scheme) for one in found if one.cancels and scheme == "staggered" and one.feeds(step, finest)]
    out = [plausibility.feeds(step, min(limits))] if limits else []
    itself = any(one.drives_itself(size(d)) for one in found if not one.cancels)
    return [*out, plausibility.drives_itself()] if itself else out


def coupled_materials(d: Discretisation) -> list[Coupled]:
    """The materials whose motion and heat act on each other."""
    return list(d.remember("coupled", lambda: coupled(d.problem.materials)))


def _finest(d: Discretisation) -> float:
    """Square of the largest wave number that the mesh resolves, 1/area."""
    return (np.pi * float(np.linalg.norm(gradients(_corners(d)), axis=-1).max())) ** 2


def _gaps(d: Discretisation) -> list[str]:
    out = []
    of_part = np.asarray(d.surface.contacts, dtype=int)
    for i in np.unique(of_part):
        gap = d.load_vectors.on_contact("gap", int(i))
        if not isinstance(gap, Formula | ShapeGap):
            continue
        places = np.asarray(d.surface.positions)[of_part == i]
        times = np.linspace(0, d.scene.time.end, TIMES + 1) if of_time(gap) else np.zeros(1)
        try:
            least = [float(evaluate(gap, places, float(t), 1).min()) for t in times]
        except ValueError:
            continue  # it has a pole; at a step the run says so
        out += plausibility.inside(d.scene.contacts[i].part, least[0], min(least), size(d))
    return out


def meeting(d: Discretisation, t: float) -> Any:
    """Whether the normal of a contact point meets the foundation at time t, (points,)."""
    of_part, places = np.asarray(d.surface.contacts, dtype=int), np.asarray(d.surface.positions)
    out = np.ones(len(of_part), dtype=bool)
    for i in np.unique(of_part):
        gap = d.load_vectors.on_contact("gap", int(i))
        if isinstance(gap, ShapeGap):
            out[of_part == i] = gap.meets(places[of_part == i], t)
    return out


def _starts(d: Discretisation) -> list[str]:
    """Jumps between the initial temperature and that of supports and foundations."""
    scene = d.scene
    if scene.heat is None:
        return []
    step, out = scene.clock.shortest, []
    lumped = scene.heat.capacity_matrix == "lumped"
    parts: list[tuple[str, Any, float]] = [
        (part, d.loads.temperature.get(part, 0.0), np.inf) for part in scene.supports.temperature
    ]
    for i, contact in enumerate(scene.contacts):
        exchange = contact.heat_exchange
        if exchange is not None and exchange.conductance > 0:
            parts.append((contact.part, d.loads.on_contact("foundation_temperature", i), exchange.conductance))
    for part, given, conductance in parts:
        if callable(given) and not isinstance(given, Formula):
            continue
        x = np.asarray(d.mesh.nodes)[np.unique(d.mesh.parts[part])]
        try:
            start = evaluate(read(scene.initial.temperature), x, 0.0, 1)
            jump = float(np.abs(evaluate(given, x, 0.0, 1) - start).max())
        except ValueError:
            continue
        if jump == 0:
            continue
        height, capacity, conductivity = d.remember(("first cell", part), partial(_first_cell, d, part))
        if height == 0 or conductivity == 0:
            continue
        sensible = capacity * height**2 / (6 * conductivity)
        within = min(scene.time.end, sensible)  # after it a layer is as wide as a cell
        share = min(1.0, 2 * conductance * within / (capacity * height))
        layer = max(6 * sensible, capacity * conductivity / conductance**2)
        layer = min(layer, capacity * size(d) ** 2 / conductivity)
        out += plausibility.heat_start(
            part, jump=jump, share=share, step=step, sensible=sensible, layer=layer, lumped=lumped
        )
    return out


def size(d: Discretisation) -> float:
    """Longest side of the body's box, length."""
    return float(d.remember("size", lambda: np.ptp(np.asarray(d.mesh.nodes), axis=0).max()))


def _corners(d: Discretisation) -> Array:
    corners: Array = np.asarray(d.mesh.nodes)[np.asarray(d.mesh.cells)]
    return corners


def gradients(corners: Array) -> Array:
    """Gradients of the barycentric coordinates of simplices with `corners` (cells, d+1, d), (cells, d+1, d), 1/length."""
    inner = np.swapaxes(np.linalg.inv(corners[:, 1:] - corners[:, :1]), 1, 2)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


def _first_cell(d: Discretisation, part: str) -> tuple[float, float, float]:
    """Height above a part, length, capacity and conductivity of the cell there that takes longest to warm; 0 without one."""
    cells, nodes = np.asarray(d.mesh.cells), np.unique(d.mesh.parts[part])
    on = np.isin(cells, nodes)
    at = np.flatnonzero(on.sum(axis=1) == d.dim)
    if not len(at):
        return 0.0, 1.0, 0.0
    slopes = gradients(_corners(d)[at])
    height = 1 / np.linalg.norm(slopes[~on[at]], axis=1)
    of_cell = cell_regions(d.scene, d.mesh)
    regions = of_cell[at] if len(of_cell) else np.zeros(len(at), dtype=int)
    materials = d.problem.materials
    capacity = np.array([m.capacity for m in materials])[regions]
    conductivity = np.array([np.trace(np.asarray(m.conductivity)) / d.dim for m in materials])[regions]
    with np.errstate(divide="ignore"):
        slowest = int(np.argmax(capacity * height**2 / conductivity))
    return float(height[slowest]), float(capacity[slowest]), float(conductivity[slowest])
