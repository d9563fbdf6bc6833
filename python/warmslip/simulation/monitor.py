"""What a run watches beside its balances, to say at its end what solves the equations and is hardly sensible.

A step costs a few reads of its report. Strains are looked at when the elastic energy has grown fourfold, temperatures after 1, 2,
4, 8 ... steps, and both at the end.
"""

from __future__ import annotations

import re
from functools import cached_property
from typing import Any

import numpy as np

from warmslip.model import several_solutions
from warmslip.model.discretisation import Discretisation
from warmslip.model.foresight import TIMES, before, coupled_materials, meeting, size
from warmslip.model.loads import Formula, evaluate, of_time
from warmslip.model.loads import data as read
from warmslip.scene import plausibility, plausible_data
from warmslip.scene.scene import Scene
from warmslip.simulation import growth
from warmslip.simulation.pace import Step
from warmslip.simulation.statistics import Statistics


def fits(seen: Any, other: dict[str, Any]) -> bool:
    """Whether what a checkpoint holds is what a monitor remembers, as the `other` does."""
    if not isinstance(seen, dict) or seen.keys() != other.keys():
        return False
    apart = ("low", "high", "phase", "shortest", "growth", "course")
    numbers = [value for name, value in seen.items() if name not in apart]
    numbers += [seen[name] for name in ("phase", "shortest") if seen[name] is not None]
    beyond = {"bound", "value", "count", "time"}
    for name, keys in (("low", beyond), ("high", beyond), ("growth", {"factor", "total", "begin", "end"})):
        found = seen[name]
        if not isinstance(found, dict) or (found and found.keys() != keys):
            return False
        numbers += found.values()
    return all(type(value) in (int, float) for value in numbers) and growth.fits(seen["course"])


class Monitor:
    """Of one run. `seen` is all that it remembers, plain numbers that a checkpoint keeps."""

    def __init__(self, scene: Scene, discretisation: Discretisation, stepper: Any, comm: Any) -> None:
        self._scene, self._d, self._stepper, self._comm = scene, discretisation, stepper, comm
        self._law = any(contact.stiffness is not None for contact in scene.contacts)
        inertial = scene.inertia is not None and scene.inertia.density > 0
        self._impacts = self._law and inertial
        moving = plausible_data.acts([scene.supports.given, [contact.velocity for contact in scene.contacts]])
        self._resting = scene.moves and not inertial and not moving
        self.seen: dict[str, Any] = {
            "touching": 0,
            "undetermined": 0,
            "penetration": 0.0,
            "strain": 0.0,
            "energy": 0.0,
            "looked": 0.0,
            "phase": 0 if scene.initial.velocity is not None else None,
            "shortest": None,
            "low": {},
            "high": {},
            "growth": {},
            "course": growth.start(),
            "size": 0.0,  # of the steps of the course, and the time of its start
            "since": 0.0,
        }
        scheme = scene.time.coupling
        both = coupled_materials(self._d) if scene.moves and scene.heat is not None else []
        self._coupled = [] if scheme == "monolithic" and all(one.cancels for one in both) else both
        self._heat_weight = max((one.weight for one in self._coupled), default=0.0)
        self._driven = bool(self._coupled) and self._d.load_vectors.of_time
        self._given: list[float] = []  # norms of the data of the last step

    def step(self, report: Any, step: Step, data: Any) -> None:
        """After a step with its data (collective when it looks at a field)."""
        seen = self.seen
        seen["undetermined"] += report.undetermined
        if self._law:
            touching = report.stick + report.slip
            if touching > seen["touching"]:
                seen["touching"] = touching
            if report.max_penetration > seen["penetration"]:
                seen["penetration"] = report.max_penetration
            if self._impacts:
                self._phase(touching)
        if self._coupled:
            self._growth(report.balances, step, data)
        if step.number & (step.number - 1) == 0:
            self._temperatures()
        energy = report.balances.elastic
        if energy > 4 * seen["energy"] and step.time - seen["looked"] >= self._scene.time.end / 4:
            seen["energy"], seen["looked"] = energy, step.time
            self._strain()

    def _growth(self, balances: Any, step: Step, data: Any) -> None:
        """Looks for a climb of the energy of what a step changes, which is backward Euler's own dissipation.

        Without a change of data that energy falls in every step that does not grow, for R = -c M by theorem. It changes with the
        size of the step, and a climb is one of equal steps.
        """
        if step.size != self.seen["size"]:
            self.seen |= {"course": growth.start(), "size": step.size, "since": step.time - step.size}
        heat = self._heat_weight * balances.heat_damping
        square = balances.inertia_damping + balances.elastic_damping + heat
        row = [growth.log(square), *self._changes(data)]
        if not growth.add(self.seen["course"], row) or not heat >= growth.HOT * square:
            return
        found = growth.climb(self.seen["course"])
        if found and found["total"] >= self.seen["growth"].get("total", 0.0):
            since = self.seen["since"]
            self.seen["growth"] = found | {name: since + found[name] * step.size for name in ("begin", "end")}

    def _changes(self, data: Any) -> list[float]:
        """Logarithms of the squares of how much the norms of the data changed, none where all are constant."""
        if not self._driven:
            return []
        given = [
            0.0 if one is None else float(one.norm() if hasattr(one, "norm") else np.linalg.norm(one)) for one in data
        ]
        before, self._given = self._given or given, given
        return [growth.log((now - last) ** 2) for now, last in zip(given, before, strict=True)]

    def fed(self) -> list[str]:
        """The warning about a growth."""
        scene = self._scene
        limits = [one.limit(scene.time.coupling) for one in self._coupled if one.cancels]
        itself = any(one.drives_itself(size(self._d)) for one in self._coupled if not one.cancels)
        cancels = len(limits) == len(self._coupled)
        return plausibility.grown(self.seen["growth"], cancels=cancels, itself=itself, limit=min(limits, default=0.0))

    def reason(self, given: str) -> str:
        """Why a step was rejected, where it is a growth that lasted until then: not what its numbers made of the step."""
        found = self.seen["growth"]
        lasted = bool(found) and found["end"] >= 0.8 * self._stepper.time
        return f"{self.fed()[0]}; in the end {re.split('[:;]', given)[0]}" if lasted else given

    def _phase(self, touching: int) -> None:
        """Counts the steps of a contact that began after an open step; None while one lasts that was there from the start."""
        seen = self.seen
        if not touching:
            if seen["phase"]:
                seen["shortest"] = min(seen["phase"], seen["shortest"] or seen["phase"])
            seen["phase"] = 0
        elif seen["phase"] is not None:
            seen["phase"] += 1

    def _strain(self) -> None:
        u = self._d.field(self._stepper.u)
        if u is not None:
            self.seen["strain"] = max(self.seen["strain"], self._d.largest_strain(u))

    @cached_property
    def _allowed(self) -> tuple[float, float]:
        """Least and most temperature that initial, support and foundation data allow; infinite where sources know no bound."""
        d, scene = self._d, self._scene
        if scene.heat is None:
            return -np.inf, np.inf
        loads, end, x = d.loads, scene.time.end, np.asarray(d.mesh.nodes)
        values = [evaluate(read(scene.initial.temperature), x, 0.0, 1)]
        prescribed = [(part, loads.temperature.get(part, 0.0)) for part in scene.supports.temperature]
        conducting = [
            (contact.part, loads.on_contact("foundation_temperature", i))
            for i, contact in enumerate(scene.contacts)
            if contact.heat_exchange is not None
        ]
        for part, value in prescribed + conducting:
            if callable(value) and not isinstance(value, Formula):
                return -np.inf, np.inf
            places = x[np.unique(d.mesh.parts[part])]
            try:
                for t in np.linspace(0, end, TIMES + 1) if of_time(value) else (0.0,):
                    values.append(evaluate(value, places, float(t), 1))
            except ValueError:  # between the steps a formula may have a pole
                return -np.inf, np.inf
        sources = [loads.source, *loads.heat_flux.values(), loads.contact_flux]
        signs = {0.0 if callable(one) else float(np.sign(one)) for one in sources if callable(one) or np.any(one)}
        both = any(callable(one) for one in sources) or any(m.heating is not None for m in d.problem.materials)
        makes = any(c.friction_heating is not None for c in scene.contacts)
        low, high = min(v.min() for v in values), max(v.max() for v in values)
        return (
            -np.inf if both or -1.0 in signs else float(low),
            np.inf if both or makes or 1.0 in signs else float(high),
        )

    def _temperatures(self) -> None:
        theta = self._stepper.theta
        if theta is None or (low_high := self._allowed) == (-np.inf, np.inf):
            return
        low, high = low_high
        values = theta.array_r
        least, most = theta.min()[1], theta.max()[1]
        spread = (high - low) if np.isfinite(high - low) else max(abs(least), abs(most))
        band = max(
            plausibility.BEYOND * spread, 1e-10 * max(abs(least), abs(most))
        )  # of equal data the rounding is no spread
        for name, out, value, bound in (
            ("low", least < low - band, least, low),
            ("high", most > high + band, most, high),
        ):
            before = self.seen[name]
            if not out or (before and abs(value - bound) <= abs(before["value"] - bound)):
                continue
            count = np.sum(values < low - band) if name == "low" else np.sum(values > high + band)
            self.seen[name] = {
                "bound": bound,
                "value": float(value),
                "count": int(self._comm.allreduce(int(count))),
                "time": float(self._stepper.time),
            }

    def sentences(self, begun: bool, statistics: Statistics) -> list[str]:
        """Warnings about the run as it stands, `begun` once a step was taken (collective)."""
        if not begun:
            return before(self._d)
        self._strain()
        self._temperatures()
        seen, heat = self.seen, self._scene.heat
        out = [*before(self._d), *self.fed(), *self._digits(statistics), *plausibility.strained(seen["strain"])]
        if self._resting:
            u = self._d.field(self._stepper.u)
            out += plausibility.carried(float(np.linalg.norm(u, axis=1).max()), size(self._d))
        if self._law:
            out += self._contact(statistics.stages)
        nodes = len(self._d.mesh.nodes)
        lumped = heat is not None and heat.capacity_matrix == "lumped"
        cure = "take longer steps or heat.capacity_matrix = 'lumped'"
        if lumped:
            cure = "the mesh has obtuse angles, or the conductivity is not isotropic: refine it there"
        return out + plausibility.beyond(seen["low"], seen["high"], nodes, cure)

    def _digits(self, statistics: Statistics) -> list[str]:
        if self.seen["undetermined"]:
            return [plausibility.UNDETERMINED]
        return plausibility.rounded(statistics.trusted(self._stepper.extents))

    def _contact(self, stages: dict[str, int]) -> list[str]:
        d, stepper, seen = self._d, self._stepper, self.seen
        u = d.field(stepper.u)
        moved = np.reshape(stepper.contact_displacement, (-1, d.dim))
        gap = d.load_vectors.on_points("gap", float(stepper.time))
        normals, weights = np.asarray(d.surface.normals), np.asarray(d.surface.weights)
        inwards = np.sum(moved * normals, axis=1)
        deformation = float(np.linalg.norm(u - u.mean(axis=0), axis=1).max())
        out = plausibility.sunk(seen["penetration"], size(d), deformation)
        ahead = (gap - inwards)[meeting(d, float(stepper.time))]
        out += plausibility.touched(seen["touching"], len(weights), float(ahead.min()) if len(ahead) else np.inf)
        touching, of_part = np.asarray(stepper.status) > 0, np.asarray(d.surface.contacts, dtype=int)
        slip = np.linalg.norm(moved - inwards[:, None] * normals, axis=1)
        for i in np.unique(of_part):
            here = (of_part == i) & touching
            if here.any() and np.ptp(gap[of_part == i]) > 1e-12 * size(d):
                facet = float(weights[of_part == i].max()) ** (1 / (d.dim - 1))
                out += plausibility.slid(d.scene.contacts[i].part, float(slip[here].max()), facet)
        return out + plausibility.impact(seen["shortest"]) + self._several(stages)

    def _several(self, stages: dict[str, int]) -> list[str]:
        """Whether steps may have several solutions; the same on every rank (collective)."""
        here = several_solutions.sentences(self._d, self._stepper, stages) if self._comm.rank == 0 else None
        return list(self._comm.bcast(here, root=0))
