"""What the data of a scene say before any run is hardly sensible: each with its number and its cure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from warmslip.mesh import files
from warmslip.scene.expressions import constant
from warmslip.scene.material_tables import IsotropicTable
from warmslip.scene.scene import Scene
from warmslip.scene.validation import contact_keys, coupling_tables

FRICTION = 2.0
KELVIN = 250.0, 400.0  # what data look like that count from absolute zero
LOCKING = 0.45
# tip displacement of a cantilever, 5 long and 4 cells high, over that of beam theory: the docs have the whole table
CANTILEVER = {2: (0.62, 0.30, 0.084, 0.051), 3: (0.59, 0.29, 0.077, 0.042)}
RATIOS = (0.45, 0.49, 0.499, 0.4999)
GROWS = (
    "rounding may then grow from step to step, and the digits are those of single steps; compare with a run whose mesh.lengths "
    "differ by 1e-12"
)


def of_mesh(scene: Scene) -> list[str]:
    """What the reader of a mesh file changed, and regions of the file that share cells."""
    if scene.mesh.file is None:
        return []
    mesh = files.read(scene.mesh.file)
    out = [f"mesh.file: {remark}" for remark in mesh.remarks]
    before = np.zeros(len(mesh.cells), bool)
    for name, region in scene.regions.items():
        if region.where is None:
            own = mesh.regions[name]
            if count := int(before[own].sum()):
                out.append(
                    f"regions.{name}: it has {count} cells of the mesh file in common with regions before it, and replaces them"
                )
            before[own] = True
    return out


def of_scene(scene: Scene) -> list[str]:
    """What the tables alone say before a run."""
    return [*defaults(scene), *_idle(scene), *_rough(scene), *_absolute(scene), *_locking(scene)]


def defaults(scene: Scene) -> Iterator[str]:
    """Density and capacity that are 1 because the scene does not give them."""
    tables: list[tuple[str, Any, str]] = [("inertia", scene.inertia, "density"), ("heat", scene.heat, "capacity")]
    tables += [(f"regions.{name}.inertia", region.inertia, "density") for name, region in scene.regions.items()]
    for key, table, what in tables:
        if table is not None and what not in table.model_fields_set:
            yield f"the {what} is 1 because [{key}] gives none; write {key}.{what}"


def _numbers(scene: Scene) -> list[tuple[str, Any]]:
    """Temperatures that a scene gives or holds, with their keys."""
    if scene.heat is None:
        return []
    out: list[tuple[str, Any]] = [("initial.temperature", scene.initial.temperature)]
    if isinstance(scene.supports.temperature, dict):
        out += [(f"supports.temperature.{part}", value) for part, value in scene.supports.temperature.items()]
    else:
        out += [(f"supports.temperature.{part}", 0.0) for part in scene.supports.temperature]
    for key, contact in contact_keys(scene):
        exchange = contact.heat_exchange
        if exchange is not None and (exchange.conductance or exchange.per_pressure):
            out.append((f"{key}.heat_exchange.foundation_temperature", exchange.foundation_temperature))
    return out


def acts(value: Any) -> bool:
    """Whether a datum, or one of several, is a formula or not zero."""
    if isinstance(value, dict | list):
        return any(map(acts, value.values() if isinstance(value, dict) else value))
    return isinstance(value, str) or (value is not None and value != 0)


def _idle(scene: Scene) -> Iterator[str]:
    """A scene in which nothing happens."""
    loads, initial = scene.loads, scene.initial
    forces = [
        loads.body,
        loads.traction,
        loads.heat_flux,
        initial.displacement,
        initial.velocity,
        initial.run,
        scene.supports.given,
    ]
    gaps = [c.gap for c in scene.contacts if c.stiffness and (not isinstance(c.gap, float | int) or c.gap < 0)]
    belts = [c.velocity for c in scene.contacts]
    if acts(forces) or acts(belts) or gaps or (scene.heat is not None and acts(scene.heat.source)):
        return
    temperatures = [value for _, value in _numbers(scene)]
    if scene.heat is not None and scene.heat.expansion is not None and scene.moves:
        temperatures.append(scene.heat.expansion.reference_temperature)
    if constant(*temperatures) and len(set(temperatures)) <= 1:
        yield (
            "nothing acts: there is no load, no initial motion, no support that moves, no difference of temperature and no gap "
            "below 0, and the answer is that nothing happens; give one of them"
        )


def _rough(scene: Scene) -> Iterator[str]:
    """More friction than dry solids have, and friction that feeds what makes it."""
    inertial = scene.inertia is not None and scene.inertia.density > 0
    expands = scene.heat is not None and scene.heat.expansion is not None and scene.moves
    for key, contact in contact_keys(scene):
        friction, heating = contact.friction, contact.friction_heating
        if friction is None:
            continue
        if friction.coefficient > FRICTION:
            yield (
                f"the friction coefficient of '{contact.part}' is {friction.coefficient:g}: dry solids have 0.1 to 1, and above "
                f"{FRICTION:g} a step may have several answers; check {key}.friction.coefficient"
            )
        if inertial and friction.kinetic is not None and friction.kinetic < friction.coefficient:
            yield (
                f"the friction coefficient of '{contact.part}' falls from {friction.coefficient:g} to {friction.kinetic:g} over "
                f"a slip speed of {friction.speed:g}, which may feed vibrations: {GROWS}"
            )
        if expands and heating is not None and heating.share > 0 and friction.coefficient > 0:
            yield (
                f"the friction of '{contact.part}', {friction.coefficient:g}, heats a body that expands and then presses "
                f"harder: {GROWS}"
            )


def _absolute(scene: Scene) -> Iterator[str]:
    """Data that look as if they counted from absolute zero, and what does not go with them."""
    given = [value for key, value in _numbers(scene) if value != 0 or key != "initial.temperature"]
    looks = bool(given) and constant(*given) and all(KELVIN[0] <= float(value) <= KELVIN[1] for value in given)
    if scene.heat is None or not looks:
        return
    least, most = min(map(float, given)), max(map(float, given))
    data = f"all temperatures lie between {least:g} and {most:g}" if most > least else f"all temperatures are {least:g}"
    expansion, heating, reference = coupling_tables(scene, None)
    if expansion is not None and reference == 0 and scene.moves:
        yield (
            f"{data}, which looks absolute, and the body is free of stress at 0: it expands as if warmed by {most:g}; give "
            "heat.expansion.reference_temperature"
        )
    if expansion is None or heating is None or heating.tensor is None or expansion.tensor is None:
        return
    absolute = reference or (least + most) / 2
    m, r = (
        np.array(v) if isinstance(v, list) else v * np.eye(scene.mesh.dim) for v in (expansion.tensor, heating.tensor)
    )
    if not np.any(m) or abs((ratio := float((m * r).sum() / (m * m).sum())) + absolute) <= 0.2 * absolute:
        return
    what = "warms a stretched body" if ratio > 0 else "is that of a heat equation divided by the temperature"
    yield (
        f"{data}, which looks absolute, and R is {ratio:.3g} M, which {what}: thermodynamics has R = -{absolute:g} M; write "
        "heat.heating = { thermodynamic = true }"
    )


def _locking(scene: Scene) -> Iterator[str]:
    """P1 elements that cannot deform without a change of volume."""
    if scene.mesh.file is None and scene.mesh.diagonal == "crisscross":
        return
    d = scene.mesh.dim
    tables: list[tuple[str, IsotropicTable | None]] = [("elasticity", scene.elasticity)]
    tables += [(f"regions.{name}.elasticity", region.elasticity) for name, region in scene.regions.items()]
    for key, table in tables:
        if table is None or table.tensor is not None or table.assumption == "plane_stress":
            continue
        lam, mu = table.pair(d)
        ratio = lam / (2 * (lam + mu)) if lam + mu > 0 else 0.0
        if ratio >= LOCKING:
            part = np.interp(
                -np.log10(0.5 - min(ratio, RATIOS[-1])), [-np.log10(0.5 - r) for r in RATIOS], CANTILEVER[d]
            )
            cure = (
                "mesh.diagonal = 'crisscross', which does not lock"
                if d == 2 and scene.mesh.file is None
                else "a finer mesh"
            )
            yield (
                f"{key} has a Poisson's ratio of {ratio:.5g}, at which linear elements lock: a cantilever of 4 cells in height "
                f"has {part:.2g} of its deflection; take {cure}, or a smaller ratio"
            )
