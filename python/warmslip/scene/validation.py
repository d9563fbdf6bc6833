"""What the tables of a scene must agree on. A sentence a problem, with its cure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from warmslip.scene import probe_checks
from warmslip.scene.contact_tables import ContactTable
from warmslip.scene.expressions import Expression
from warmslip.scene.foundation_tables import ShapeTable
from warmslip.scene.material_tables import (
    ExpansionTable,
    HeatingTable,
    HeatTable,
    IsotropicTable,
    RegionHeatTable,
    RegionTable,
)
from warmslip.scene.tables import SceneTables

SHORTEST = 1e-150  # step, time: its inverse is squared on the way


def problems(scene: SceneTables) -> list[str]:
    """Everything that is wrong between the tables of a scene."""
    return [
        *_parts(scene),
        *_sizes(scene),
        *_materials(scene),
        *_blocks(scene),
        *_regions(scene),
        *_time(scene),
        *_plane(scene),
        *probe_checks.problems(scene),
    ]


def contact_keys(scene: SceneTables) -> list[tuple[str, ContactTable]]:
    """Every contact table with its key: `contact`, or `contact.0`, `contact.1` of several."""
    several = isinstance(scene.contact, list)
    return [(f"contact.{i}" if several else "contact", c) for i, c in enumerate(scene.contacts)]


def _parts(scene: SceneTables) -> Iterator[str]:
    known = scene.mesh.parts
    held, cooled = list(scene.supports.displacement), list(scene.supports.temperature)
    named = {
        "supports.displacement": held,
        "supports.temperature": cooled,
        "supports.springs": list(scene.supports.springs or {}),
        "loads.traction": list(scene.loads.traction),
        "loads.heat_flux": list(scene.loads.heat_flux),
        **{f"{key}.part": [contact.part] for key, contact in contact_keys(scene)},
    }
    for key, parts in named.items():
        for part in parts:
            if part not in known:
                yield f"{key}: {scene.mesh.unknown(part)}"
        if len(set(parts)) < len(parts):
            yield f"{key}: a part is named twice; name each once"
    for part in scene.loads.traction:
        if part in scene.supports.clamped:
            yield f"loads.traction.{part}: the part is clamped and a traction on it does nothing; remove one of the two"
    for part in scene.loads.heat_flux:
        if part in cooled:
            yield f"loads.heat_flux.{part}: the part's temperature is given and a flux does nothing; remove one of the two"
    for key, contact in contact_keys(scene):
        if contact.stiffness is not None and contact.part in held:
            yield f"supports.displacement: '{contact.part}' is the contact part and cannot be held; remove it"
        if contact.part in cooled:
            yield f"supports.temperature: '{contact.part}' is the contact part and cannot be held; remove it"
        if sum(c.part == contact.part for c in scene.contacts) > 1 and key.endswith(".0"):
            yield f"{key}.part: '{contact.part}' has two laws; give each part one"


def _sizes(scene: SceneTables) -> Iterator[str]:
    d, body = scene.mesh.dim, scene.mesh.name
    vectors: dict[str, Any] = {
        "loads.body": scene.loads.body,
        "initial.displacement": scene.initial.displacement,
        "initial.velocity": scene.initial.velocity,
        **{f"loads.traction.{part}": value for part, value in scene.loads.traction.items()},
        **{f"supports.displacement.{part}": v for part, v in scene.supports.moved.items() if isinstance(v, list)},
        **{f"supports.points.{i}.at": point.at for i, point in enumerate(scene.supports.points or [])},
        **{
            f"supports.points.{i}.displacement": point.displacement
            for i, point in enumerate(scene.supports.points or [])
        },
        **{
            f"supports.springs.{part}.{name}": getattr(table, name)
            for part, table in (scene.supports.springs or {}).items()
            for name in ("stiffness", "damping")
            if isinstance(getattr(table, name), list)
        },
    }
    for key, value in vectors.items():
        if key.startswith("supports.") and value is not None and all(one == "free" for one in value):
            yield f"{key}: every component is free, and nothing is held; leave the support out"
        if value is not None and len(value) != d:
            yield f"{key} has {len(value)} components; a {body} needs {d}"
    yield from _foundations(scene)
    for key, heat in _heats(scene):
        for name, tensor in (
            (f"{key}.conductivity", heat.conductivity),
            (f"{key}.expansion.tensor", heat.expansion and heat.expansion.tensor),
            (f"{key}.heating.tensor", heat.heating and heat.heating.tensor),
        ):
            if not isinstance(tensor, list):
                continue
            if len(tensor) != d or any(len(row) != d for row in tensor):
                yield f"{name} must be a {d} x {d} matrix"
            elif any(tensor[i][j] != tensor[j][i] for i in range(d) for j in range(i)):
                yield f"{name} must be symmetric; set its entries [i][j] and [j][i] equal"
    for key in ("displacement", "velocity"):
        for i, value in enumerate(getattr(scene.initial, key) or []):
            if isinstance(value, str) and Expression(value).of_time:
                yield f"initial.{key}.{i}: initial data cannot depend on t; leave it out"
    if isinstance(scene.initial.temperature, str) and Expression(scene.initial.temperature).of_time:
        yield "initial.temperature: initial data cannot depend on t; leave it out"


def _foundations(scene: SceneTables) -> Iterator[str]:
    """The sizes of shapes and velocities of foundations."""
    d, body = scene.mesh.dim, scene.mesh.name
    for key, contact in contact_keys(scene):
        vectors: dict[str, Any] = {f"{key}.velocity": contact.velocity}
        if isinstance(contact.gap, ShapeTable):
            vectors |= {f"{key}.gap.{name}": getattr(contact.gap, name) for name in ("at", "normal", "axis")}
            if d == 2 and contact.gap.axis is not None:
                yield f"{key}.gap.axis: in the plane the axis is that of z; leave it out"
            if d == 3 and contact.gap.axis is None and contact.gap.spatial_axis:
                yield f"{key}.gap.axis: in space a {contact.gap.shape} needs the direction of its axis; give one"
        for name, value in vectors.items():
            if value is not None and len(value) != d:
                yield f"{name} has {len(value)} components; a {body} needs {d}"
        if contact.velocity is not None and contact.friction is None:
            yield f"{key}.velocity: nothing feels the motion of a foundation without friction; give a table friction or remove it"


def _heats(scene: SceneTables) -> list[tuple[str, HeatTable | RegionHeatTable]]:
    tables: list[tuple[str, HeatTable | RegionHeatTable | None]] = [("heat", scene.heat)]
    tables += [(f"regions.{name}.heat", region.heat) for name, region in scene.regions.items()]
    return [(key, table) for key, table in tables if table is not None]


def _materials(scene: SceneTables) -> Iterator[str]:
    d = scene.mesh.dim
    tables = [(key, getattr(scene, key)) for key in ("elasticity", "viscosity")]
    for name, region in scene.regions.items():
        tables += [(f"regions.{name}.{key}", getattr(region, key)) for key in ("elasticity", "viscosity")]
    for key, table in tables:
        if table is None:
            continue
        if d == 3 and table.assumption in ("plane_stress", "plane_strain"):
            yield f"{key}.assumption: {table.assumption} has no meaning in a {scene.mesh.name}; use solid"
        elif table.tensor is not None:
            size = d * (d + 1) // 2
            if len(table.tensor) != size:
                yield f"{key}.tensor must be a {size} x {size} matrix"
            elif _negative(table.tensor):
                yield f"{key}: the tensor must not be negative; it has a negative eigenvalue"
        else:
            lam, mu = table.pair(d)
            if mu < 0 or d * lam + 2 * mu < 0:
                yield f"{key}: the tensor must not be negative; it needs mu >= 0 and {d} lambda + 2 mu >= 0"
    yield from _couplings(scene)
    for key, heat in _heats(scene):
        k = heat.conductivity
        if not isinstance(k, list):
            k = [[k]]
        if all(len(row) == len(k) for row in k) and _negative(k):
            yield f"{key}.conductivity must not have a negative eigenvalue; heat would flow from cold to hot"


def coupling_tables(
    scene: SceneTables, region: RegionTable | None
) -> tuple[ExpansionTable | None, HeatingTable | None, float]:
    """The tables of expansion and heating that hold in the body or in a region, and the temperature without thermal stress."""
    body, own = scene.heat, region.heat if region is not None else None
    expansion, heating = (
        (getattr(own, name) if own is not None else None) or (getattr(body, name) if body is not None else None)
        for name in ("expansion", "heating")
    )
    for table in (expansion, body.expansion if body is not None else None):
        if table is not None and table.reference_temperature is not None:
            return expansion, heating, table.reference_temperature
    return expansion, heating, 0.0


def _couplings(scene: SceneTables) -> Iterator[str]:
    """What alpha needs of the elasticity, and thermodynamic heating of the expansion, in the body and in every region."""
    for name, region in [("", None), *scene.regions.items()]:
        prefix = f"regions.{name}." if region is not None else ""
        expansion, heating, reference = coupling_tables(scene, region)
        own = region.heat if region is not None else None
        if region is not None and region.elasticity is None and (own is None or not (own.expansion or own.heating)):
            continue  # said of the body
        if heating is not None and heating.thermodynamic:
            key = f"{prefix if own is not None and own.heating else ''}heat.heating.thermodynamic"
            if expansion is None:
                yield f"{key}: R = -T0 M needs an M; give a table [heat.expansion]"
            elif reference <= 0:
                yield f"{key}: R = -T0 M needs the absolute temperature T0; give heat.expansion.reference_temperature"
        if expansion is None or expansion.alpha is None:
            continue
        key = f"{prefix if own is not None and own.expansion else ''}heat.expansion.alpha"
        elasticity = (region and region.elasticity) or scene.elasticity
        if elasticity is None:
            yield f"{key}: the stress of an expansion needs an elasticity; give a table [elasticity], or tensor in its place"
        elif elasticity.tensor is not None:
            yield f"{key}: it is for an isotropic elasticity; give tensor in its place"
        elif scene.mesh.dim == 2 and elasticity.assumption is None:
            yield f"{key}: lame says nothing about z; add assumption = 'plane_strain' to it, or give young and poisson"


def _negative(matrix: list[list[float]]) -> bool:
    return float(np.linalg.eigvalsh(np.array(matrix))[0]) < -1e-12 * max(abs(x) for row in matrix for x in row)


def _stiff(table: IsotropicTable | None, d: int) -> bool:
    return table is not None and (table.tensor is not None or table.pair(d)[1] > 0)


def _blocks(scene: SceneTables) -> Iterator[str]:
    moves, heat = scene.moves, scene.heat
    inertial = scene.inertia is not None and scene.inertia.density > 0
    if not moves and heat is None and scene.inertia is None:
        yield "scene: there is neither motion nor heat; give one of inertia, elasticity, viscosity and heat"
        return
    if not moves:
        if scene.inertia is not None and heat is None:
            yield (
                "inertia.density: without inertia, viscosity and elasticity there is no momentum operator; give one of them"
            )
        needed: dict[str, Any] = {
            "loads.body": scene.loads.body,
            "loads.traction": scene.loads.traction,
            "supports.displacement": scene.supports.displacement,
            "supports.points": scene.supports.points,
            "supports.springs": scene.supports.springs,
            "initial.displacement": scene.initial.displacement,
            "initial.velocity": scene.initial.velocity,
            "heat.expansion": heat and heat.expansion,
            "heat.heating": heat and heat.heating,
            **{f"{key}.stiffness": c.stiffness for key, c in contact_keys(scene)},
        }
        for key, value in needed.items():
            if value:
                yield f"{key}: a body without elasticity, viscosity and inertia does not move; remove it or give one of them"
    elif not inertial:
        if not (_stiff(scene.elasticity, scene.mesh.dim) or _stiff(scene.viscosity, scene.mesh.dim)):
            yield (
                "inertia.density: without inertia, viscosity and elasticity there is no momentum operator; give one of them"
            )
        if not scene.supports.hold and not any(contact.stiffness for contact in scene.contacts):
            yield (
                "supports.displacement: nothing holds the body: it has no support, no inertia and no contact; "
                "clamp a part, give inertia.density > 0 or a [contact] that it rests on"
            )
    if heat is None:
        cold: dict[str, Any] = {
            "loads.heat_flux": scene.loads.heat_flux,
            "supports.temperature": scene.supports.temperature,
            "initial.temperature": scene.initial.temperature,
            **{f"{key}.heat_exchange": c.heat_exchange for key, c in contact_keys(scene)},
            **{f"{key}.friction_heating": c.friction_heating for key, c in contact_keys(scene)},
        }
        for key, value in cold.items():
            if value:
                yield f"{key}: there is no heat in this scene; remove it or give a table [heat]"
    for key, contact in contact_keys(scene):
        exchange = contact.heat_exchange
        if contact.stiffness is None:
            if exchange is None:
                yield f"{key}: the part neither touches nor exchanges heat; give a stiffness or a table heat_exchange"
            if contact.friction is not None:
                yield f"{key}.friction: friction without contact; give a stiffness or remove it"
            if contact.heats:
                yield f"{key}: heat by pressure or friction needs contact; give a stiffness or remove it"
        if contact.friction_heating is not None and contact.friction is None:
            yield f"{key}.friction_heating: heat of a friction that is not there; give a table friction or remove it"
        if contact.heats and scene.time.coupling == "monolithic" and moves:
            yield f"time.coupling: heat by pressure or friction ({key}) needs 'staggered' or 'lagged'; use one of them"
    if scene.time.coupling == "monolithic" and not (moves and heat is not None):
        yield "time.coupling: monolithic couples motion and heat, and one of them is missing; leave the key out"


def _regions(scene: SceneTables) -> Iterator[str]:
    known = scene.mesh.regions
    for name, region in scene.regions.items():
        if region.where is None and name not in known:
            has = f"the mesh has {', '.join(known)}" if known else "the mesh has none by name"
            yield f"regions.{name}: unknown region; {has}, or say `where` with a formula of x, y, z"
        if region.where is not None:
            try:
                where = Expression(region.where)
                if not where.condition:
                    yield f"regions.{name}.where: '{region.where}' is no condition; compare, as in x < 0.5"
                if where.of_time:
                    yield f"regions.{name}.where: a region cannot depend on t; leave it out"
            except ValueError as error:
                yield f"regions.{name}.where: {error}"
        for key in ("inertia", "elasticity", "viscosity", "heat"):
            if getattr(region, key) is not None and getattr(scene, key) is None:
                yield f"regions.{name}.{key}: the body has no table [{key}]; give one for the rest of it"
        if region.heat is not None and scene.heat is not None:
            for key in ("expansion", "heating"):
                if getattr(region.heat, key) is not None and getattr(scene.heat, key) is None:
                    yield f"regions.{name}.heat.{key}: the body has no table [heat.{key}]; give one for the rest of it"


def _time(scene: SceneTables) -> Iterator[str]:
    time = scene.time
    if time.graded_to and time.tolerance is not None:
        yield "time.graded_to: steps with a tolerance find such times themselves; give one of graded_to and tolerance"
    if time.halvings != type(time).model_fields["halvings"].default and not time.graded_to:
        yield "time.halvings: halvings of what? give graded_to = [0.0], or leave the key out"
    if len(set(time.graded_to)) < len(time.graded_to):
        yield "time.graded_to: a time is named twice; name each once"
    if late := [t for t in time.graded_to if t > time.end]:
        yield f"time.graded_to: {late[0]:g} is later than the end, {time.end:g}; leave it out"
        return
    shortest = scene.clock.shortest
    if shortest < SHORTEST:
        yield f"time: a step of {shortest:g} is too short to divide by; take fewer steps or a later end"
    if scene.clock.steps >= 2**31:
        yield f"time: there are {scene.clock.steps} steps, and they are counted in 32 bits; take fewer"


def _plane(scene: SceneTables) -> Iterator[str]:
    """Formulas of z where there is none."""
    if scene.mesh.dim == 3:
        return
    for key, value in formulas(scene.resolved()):
        try:
            if "z" in Expression(value).names:
                yield f"{key}: '{value}' has a z, and the body lies in the plane of x and y; leave it out"
        except ValueError:
            continue  # refused elsewhere


# tables whose texts are formulas, but for names
FORMULAS = ("loads", "supports", "initial", "contact", "heat", "regions")
NAMES = ("part", "quadrature", "assumption", "shape")


def formulas(tables: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Every formula of a resolved scene with its key."""
    for table in FORMULAS:
        yield from _texts(table, tables.get(table))


def _texts(key: str, value: Any) -> Iterator[tuple[str, str]]:
    if isinstance(value, dict):
        for name, one in value.items():
            if name not in NAMES:
                yield from _texts(f"{key}.{name}", one)
    elif isinstance(value, list) and key not in ("supports.displacement", "supports.temperature"):
        for i, one in enumerate(value):
            yield from _texts(f"{key}.{i}", one)
    elif isinstance(value, str) and not (value == "free" and key.startswith("supports.")):
        yield key, value
