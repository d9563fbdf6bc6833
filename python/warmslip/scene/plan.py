"""What a scene will do before it runs: fields, operators, solver, cost, what could be left out, what is missing or odd."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from warmslip.mesh import files, measures
from warmslip.messages import Shown
from warmslip.scene import plausible_data
from warmslip.scene.contact_tables import ContactTable
from warmslip.scene.expressions import constant
from warmslip.scene.material_tables import ExpansionTable, HeatingTable
from warmslip.scene.roles import held_along
from warmslip.scene.scene import Scene
from warmslip.scene.validation import contact_keys, coupling_tables


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """What `explain` prints. Sentences name the keys of the scene; `removable` are keys whose removal changes no number."""

    mesh: list[str]  # sizes of a mesh file, its parts and regions
    fields: list[str]
    operators: list[str]
    every_step: list[str]
    removable: dict[str, str] = field(default_factory=dict)
    kept: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    suspicious: list[str] = field(default_factory=list)  # what is there, can be meant, and often is not
    assumed: list[str] = field(default_factory=list)  # what is not said and taken for granted
    warnings: list[str] = field(default_factory=list)  # what will solve its equations and is hardly sensible
    solver: str = ""
    setup_seconds: float = 0.0  # wall time on this machine and these ranks
    step_seconds: float = 0.0
    output_seconds: float = 0.0  # opening and closing files, checkpoints
    seconds: float = 0.0
    memory_bytes: float = 0.0

    def _facts(self) -> dict[str, str]:
        counts = {
            "operators": self.operators,
            "could be left out": list(self.removable),
            "not in the scene": self.missing,
            "worth a second look": [*self.suspicious, *self.warnings],
        }
        cost = {"cost": f"{self.seconds:.2g} s"} if self.seconds > 0 else {}
        return {"fields": "; ".join(self.fields)} | {name: str(len(rows)) for name, rows in counts.items()} | cost

    def __str__(self) -> str:
        return text(self)


def _zero(value: Any) -> bool:
    """Whether a datum is there and zero everywhere."""
    if isinstance(value, list):
        return all(_zero(one) for one in value)
    if isinstance(value, dict):
        return all(_zero(one) for one in value.values())
    return not isinstance(value, str) and value == 0


def removable(scene: Scene) -> dict[str, str]:
    """Keys that can be left out without changing the answer, with the reason: key, why."""
    out: dict[str, str] = {}
    if scene.inertia is not None and scene.inertia.density == 0:
        out["inertia"] = "the density is 0"
    for name in ("elasticity", "viscosity"):
        table = getattr(scene, name)
        if table is not None and any(_zero(one) for one in (table.lame, table.young, table.tensor) if one is not None):
            out[name] = "the tensor is 0"
    if scene.loads.body is not None and _zero(scene.loads.body):
        out["loads.body"] = "the force is 0"
    out |= {f"loads.traction.{part}": "the force is 0" for part, v in scene.loads.traction.items() if _zero(v)}
    out |= {f"loads.heat_flux.{part}": "the flux is 0" for part, v in scene.loads.heat_flux.items() if _zero(v)}
    if isinstance(scene.contact, ContactTable):
        out |= _of_contact(scene.contact)
    if scene.heat is not None:
        for name in ("expansion", "heating"):
            table = getattr(scene.heat, name)
            if table is not None and _no_effect(table):
                out[f"heat.{name}"] = "the tensor is 0"
        heated = scene.heat.heating is not None and "heat.heating" not in out
        if not heated and _stays_cold(scene):
            out["heat"] = "nothing warms the body: the temperature stays 0"
    return out


def _no_effect(coupling: ExpansionTable | HeatingTable) -> bool:
    """Whether M or R is 0, as far as its own table says."""
    given = [coupling.tensor, getattr(coupling, "alpha", None)]
    return any(one is not None and _zero(one) for one in given)


def _of_contact(contact: ContactTable) -> dict[str, str]:
    out = {}
    friction, exchange = contact.friction, contact.heat_exchange
    if friction is not None and friction.coefficient == 0 and friction.cohesion == 0:
        out["contact.friction"] = "the bound is 0"
    if exchange is not None and exchange.conductance == 0 and exchange.per_pressure == 0:
        out["contact.heat_exchange"] = "no heat is conducted"
    if contact.friction_heating is not None and (contact.friction_heating.share == 0 or "contact.friction" in out):
        out["contact.friction_heating"] = "no heat is made"
    if contact.stiffness == 0 and (friction is None or friction.cohesion == 0) and exchange is None:
        out = {"contact": "the foundation does not press back"}
    return out


def _stays_cold(scene: Scene) -> bool:
    assert scene.heat is not None
    exchanges = [c.heat_exchange for c in scene.contacts if c.heat_exchange is not None]
    makes = any(c.friction_heating is not None and c.friction_heating.share > 0 for c in scene.contacts)
    data = [
        scene.heat.source,
        scene.initial.temperature,
        *scene.loads.heat_flux.values(),
        *scene.supports.warmed.values(),
        *(e.foundation_temperature for e in exchanges),
    ]
    touches = all(c.stiffness is not None for c in scene.contacts)  # a part that only exchanges heat would be left
    return constant(*data) and _zero(data) and not makes and touches and scene.moves


def pruned(scene: Scene) -> Scene:
    """The scene without what `removable` names."""
    gone: dict[str, Any] = dict.fromkeys(removable(scene))
    if "heat" in gone:  # and what speaks of it
        gone |= dict.fromkeys(("supports.temperature", "initial.temperature", "loads.heat_flux"))
        for key, _ in contact_keys(scene):
            gone |= dict.fromkeys((f"{key}.heat_exchange", f"{key}.friction_heating"))
        gone |= {"time.coupling": "staggered"}
        gone = {key: value for key, value in gone.items() if not key.startswith(("heat.", "loads.heat_flux."))}
    if "contact" in gone:
        gone = {key: value for key, value in gone.items() if not key.startswith("contact.")}
    return scene.override(**gone) if gone else scene


def plan(scene: Scene) -> Plan:
    """Everything but the cost; no compiled code runs."""
    moves, heat, d = scene.moves, scene.heat, scene.mesh.dim
    touching = [c for c in scene.contacts if c.stiffness is not None]
    inertial = scene.inertia is not None and scene.inertia.density > 0
    fields = [f"displacement u and velocity w, {d} components a node"] if moves else []
    fields += ["temperature theta"] if heat else []
    present = {
        "rho M, inertia": inertial,
        "A, elasticity": scene.elasticity is not None,
        "B, viscosity": scene.viscosity is not None,
        "M and D, storage and conduction of heat": heat is not None,
        "G, thermal stress": heat is not None and heat.expansion is not None,
        "E, heat of straining": heat is not None and heat.heating is not None,
        "J, heat exchange": any(
            c.heat_exchange is not None and c.heat_exchange.conductance > 0 for c in scene.contacts
        ),
    }
    both = moves and heat is not None
    coupled = both and scene.time.coupling == "monolithic"
    steps = _clock(scene)
    if coupled:
        steps.append("one substitution with the factor of both fields")
    else:
        motion = {"rho M/k": inertial, "B": scene.viscosity is not None, "k A": scene.elasticity is not None}
        warmth = {"M/k": True, "D": True, "J": present["J, heat exchange"]}
        for there, sums in ((moves, motion), (heat is not None, warmth)):
            steps += (
                [f"one substitution with the factor of {' + '.join(k for k, v in sums.items() if v)}"] if there else []
            )
    if touching:
        kind = "semismooth Newton on the contact points"
        kept = d == 2 and all(_piecewise_linear(c) for c in touching)
        steps.append(f"{kind}, its factor {'kept while statuses stay' if kept else 'computed in every iteration'}")
        steps += [
            f"regularised friction on '{c.part}': a point under half its bound creeps at {c.friction.creep(0.5):.3g}"
            for c in touching
            if c.friction is not None and c.friction.regularisation
        ]
    steps += [
        f"friction on '{c.part}' along the slip relative to its moving foundation" for c in touching if c.velocity
    ]
    steps += _heat_by_contact(touching)
    fields += _supports(scene)
    return Plan(
        mesh=measures.lines(files.read(scene.mesh.file)) if scene.mesh.file is not None else [],
        fields=fields,
        operators=[f"{name}: constant, assembled once" for name, there in present.items() if there],
        every_step=steps,
        removable=removable(scene),
        kept=_kept(scene),
        missing=_missing(scene),
        suspicious=_suspicious(scene),
        assumed=_assumed(scene),
        warnings=[*plausible_data.of_mesh(scene), *plausible_data.of_scene(scene)],
    )


def _clock(scene: Scene) -> list[str]:
    """The steps, where they are not equal."""
    clock, time = scene.clock, scene.time
    if time.tolerance is not None:
        return [f"steps of {scene.step:.3g} or shorter, each with an estimated error below {time.tolerance:g}"]
    if not time.graded_to:
        return []
    towards = ", ".join(f"{t:g}" for t in time.graded_to)
    return [
        f"{clock.steps} steps of {clock.shortest:.3g} to {clock.longest:.3g}, graded to t = {towards}: "
        f"{len(clock.sizes)} factorizations of each operator"
    ]


def _supports(scene: Scene) -> list[str]:
    """What is held, in all directions or in some, and what is on springs."""
    table, d = scene.supports, scene.mesh.dim
    out = [f"'{part}' is held in all directions" for part in table.clamped]
    out += [f"'{part}' is held {held_along(table.moved[part], d)}" for part in table.guided]
    for point in table.points or []:
        place = ", ".join(f"{x:g}" for x in point.at)
        out.append(f"the node nearest to ({place}) is held {held_along(point.displacement or [0.0] * d, d)}")
    out += [f"'{part}' is on springs or dashpots" for part in table.springs or {}]
    return out


def _heat_by_contact(touching: list[ContactTable]) -> list[str]:
    """What is solved on the contact nodes, as it is not the same in every step."""
    out = []
    for c in touching:
        exchange = c.heat_exchange
        if exchange is not None and exchange.per_pressure:
            conductance = f"{exchange.conductance:g} + {exchange.per_pressure:g} times the pressure"
            out.append(f"heat exchange on '{c.part}' at its contact nodes, with the conductance {conductance}")
        if c.friction_heating is not None and c.friction_heating.share:
            out.append(f"heat of friction on '{c.part}', of which {c.friction_heating.share:g} goes into the body")
    return out


def _piecewise_linear(c: ContactTable) -> bool:
    f = c.friction
    straight = f is None or not (f.speed or f.limit or f.regularisation)
    return c.linear and straight


def _kept(scene: Scene) -> list[str]:
    out = []
    gone = removable(scene)
    for c in scene.contacts:
        if c.stiffness and "contact" not in gone:
            out.append(f"contact on '{c.part}': whether it touches is known only by running")
    if scene.heat is not None and "heat" not in gone and (scene.heat.expansion is None or "heat.expansion" in gone):
        out.append("heat: the motion does not feel it, but its temperature is asked for")
    return out


def _missing(scene: Scene) -> list[str]:
    out = []
    if scene.moves and not scene.contacts:
        out.append("no contact: the problem is linear")
    for c in scene.contacts:
        if c.stiffness is not None and c.friction is None:
            out.append(f"no friction on '{c.part}': it slides freely")
        if scene.heat is not None and c.heat_exchange is None:
            out.append(f"no heat exchange on '{c.part}': the foundation is insulated")
    if scene.moves and scene.elasticity is None:
        out.append("no elasticity: the body keeps no shape")
    if scene.moves and scene.viscosity is None:
        out.append("no viscosity: only backward Euler damps the motion, the more the longer the step")
    if scene.moves and scene.inertia is None:
        out.append("no inertia: every step is in equilibrium")
    leads = any(c.heat_exchange is not None for c in scene.contacts)
    if scene.heat is not None and not scene.supports.temperature and not leads:
        out.append("no support holds a temperature and no foundation takes heat: what is supplied stays in the body")
    return out


def _assumed(scene: Scene) -> list[str]:
    """What holds although no key says so."""
    out = []
    for c in scene.contacts:
        exchange = c.heat_exchange
        if exchange is not None and exchange.conductance and c.stiffness is not None:
            more = "; per_pressure acts only where it touches" if exchange.per_pressure else ""
            out.append(
                f"heat is exchanged on '{c.part}' also across an open gap, with the conductance {exchange.conductance:g}{more}"
            )
        elif exchange is not None and exchange.per_pressure:
            out.append(f"heat is exchanged on '{c.part}' only where it touches")
    for name, region in [("the body", None), *((f"region '{name}'", region) for name, region in scene.regions.items())]:
        tables = [(region and getattr(region, key)) or getattr(scene, key) for key in ("elasticity", "viscosity")]
        given = [table for table in tables if table is not None]
        if scene.mesh.dim == 2 and any(table.strained for table in given):
            expansion, *_ = coupling_tables(scene, region)
            if any(table.tensor is not None for table in given):
                out.append(
                    f"{name} is in plane strain with a full tensor, which does not tell the stress along z: it is taken as 0"
                )
            elif expansion is not None and isinstance(expansion.tensor, list):
                out.append(f"{name} is in plane strain: along z its expansion is taken as the mean of M_xx and M_yy")
        elif scene.mesh.dim == 2 and given and any(table.assumption is None for table in given):
            out.append(f"{name} has no stress along z: no assumption says plane_strain")
        own = region.heat if region is not None else None
        if own is not None and own.capacity is None and scene.heat is not None:
            out.append(f"{name} has the capacity of the body, {scene.heat.capacity:g}")
    return out


def _suspicious(scene: Scene) -> list[str]:
    out = []
    for c in scene.contacts:
        if isinstance(c.gap, float) and c.gap < 0:
            out.append(f"the gap of '{c.part}' is negative: the body starts inside the foundation")
        if c.stiffness is not None and c.part in scene.loads.traction and not _zero(scene.loads.traction[c.part]):
            out.append(
                f"a traction pulls or presses on '{c.part}', which is also a contact part: it acts besides the contact force"
            )
        if c.friction is not None and c.friction.cohesion:
            out.append(f"friction on '{c.part}' has a cohesion, which acts also where there is no pressure")
    moved = scene.initial.velocity is not None and not _zero(scene.initial.velocity)
    if moved and scene.moves and scene.inertia is None:
        out.append("the initial velocity moves nothing: there is no inertia")
    return out


def text(found: Plan) -> str:
    """The plan in lines for a terminal."""

    def block(title: str, lines: list[str]) -> list[str]:
        return [title, *(f"  {line}" for line in lines)] if lines else []

    out = [
        *block("mesh", found.mesh),
        *block("fields", found.fields),
        *block("operators", found.operators),
        *block("every step", found.every_step),
        *block("solver", [found.solver] if found.solver else []),
        *block(
            "could be left out without changing a number", [f"{key}: {why}" for key, why in found.removable.items()]
        ),
        *block("stays", found.kept),
        *block("not in this scene", found.missing),
        *block("taken for granted", found.assumed),
        *block("there, and worth a second look", found.suspicious),
        *block("would solve its equations, and is hardly sensible", found.warnings),
    ]
    if found.seconds == found.seconds and found.seconds > 0:
        out += block(
            "cost here",
            [
                f"{found.seconds:.2g} s: {found.setup_seconds:.2g} s to set up, {1e3 * found.step_seconds:.3g} ms a step with "
                f"its output, {found.output_seconds:.2g} s for files and checkpoints",
                f"{found.memory_bytes / 1e9:.2g} GB of memory a process",
            ],
        )
    return "\n".join(out)
