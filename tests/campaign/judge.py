"""One scene: run by warmslip, solved in 80 digits, and what to call the difference.

    right                      ended right, and every field is the reference's to 1e-6 of its size
    right_as_stated            ended right, and a field is not that near, but within the digits that the run states of it
    silently_wrong             ended right, and a field is not
    stopped_though_solvable    a named outcome, although doubles can hold the answer
    ill_posed_and_said         a named outcome, and one unit in the last place of the data moves the answer, or the rounding of
                               displacements the stress
    ill_posed_unsaid           ended right, not within 1e-6 nor within the digits, but nearer than the data are known
    refused                    before it started, with a reason
    crash, hang                neither
    unjudged                   the reference found no solution

Where friction is strong a step may have several solutions. The reference starts from the run's own contact forces, so that it
goes the run's way where that is one, and once more without them where the two differ.
"""

from __future__ import annotations

import itertools
import random
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from reference.extended_forms import VOIGT, isotropic
from reference.extended_numbers import big, floats, mid, zeros
from reference.extended_scheme import Scheme, State

from warmslip.scene.errors import SceneError
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene
from warmslip.simulation.summary import summary

TOLERANCE = 1e-6  # of a field, relative to its largest value in the run
HELD = 1e-9  # doubles can hold an answer that one unit in the last place of the data moves by no more
DATA = 1e3  # such units an answer may be off
SLIP = 1e-9  # of the speed; TOLERANCE of it is 1e-15, which a velocity in doubles has no better
FIELDS = ("u", "w", "theta", "force", "stress")
LEFT = ("momentum", "heat", "supports", "motion", "law")


@dataclass
class Ran:
    """What warmslip made of a scene: states of the steps it took, contact points, and the words it ended with."""

    outcome: str
    reason: str = ""
    states: list[dict[str, Any]] = field(default_factory=list)
    positions: Any = None
    normals: Any = None
    newton: list[int] = field(default_factory=list)  # iterations of each step
    digits: Any = ""
    seconds: float = 0.0


def run(scene: Scene, backend: str = "automatic") -> Ran:
    """Runs a scene, in memory. Refusals and failures become outcomes: `refused`, `crash`."""
    from warmslip.simulation.simulation import Simulation

    began = time.perf_counter()
    try:
        job = Simulation(scene, backend=backend)
    except (SceneError, ValueError) as error:
        return Ran("refused", str(error).replace("\n", " "), seconds=time.perf_counter() - began)
    ran, surface = Ran(""), job.discretisation.surface
    ran.positions, ran.normals = np.array(surface.positions), np.array(surface.normals)
    try:
        for state, report in job.steps():
            ran.newton.append(int(report.newton_iterations))
            force = np.reshape(np.array(job.stepper.contact_force), (-1, scene.mesh.dim))
            fields = {"u": state.u, "w": state.w, "theta": state.theta, "stress": state.stress, "force": force}
            ran.states.append({name: None if x is None else np.array(x) for name, x in fields.items()})
    except RuntimeError as error:
        ran.outcome, ran.reason = "crash", str(error)
        return ran
    ran.outcome = job.outcome
    if job.failure:
        ran.reason = f"step {job.failure['step']}: {job.failure['reason']}"
    ran.digits = summary(job).get("digits", "")
    ran.seconds = time.perf_counter() - began
    return ran


def stated(ran: Ran, field: str) -> float:
    """The error that the run's own digits allow a field, a digit to spare: TOLERANCE at least, and any where there is none."""
    digits = (ran.digits or {}).get({"w": "u", "force": "contact_force"}.get(field, field))
    if digits is None:
        return TOLERANCE
    return max(TOLERANCE, 10.0 ** (1 - digits)) if digits >= 1 else float("inf")


class Judge:
    """The reference of a scene and a run held against it."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.scheme = scene, Scheme(scene)
        self.moves, self.conducts = self.scheme.forms.moves, self.scheme.forms.conducts
        self.initial = self.scheme.start()
        self.ways: set[str] = set()

    def advance(self, guesses: list[Any] | None = None) -> list[State]:
        """The states of the reference, the initial one first; `guesses` are contact forces (points, d) of the first steps."""
        states = [self.initial]
        for n in range(1, self.scene.time.steps + 1):
            guess = [guesses[n - 1]] if guesses and n <= len(guesses) else []
            states.append(self.scheme.step(states[-1], n, guess))
            self.ways.add(states[-1].way)
        return states

    def another(self) -> list[State]:
        """The states without the run's forces to start from; none where no solution is found."""
        try:
            return self.advance()
        except ArithmeticError:
            return [self.initial]

    def own(self, ran: Ran) -> tuple[list[State], list[int]]:
        """The run's states in the reference's numbering, the initial one first, and the points that the run has too."""
        points = self.scheme.points
        there: dict[int, int] = {}
        for i, (x, nu) in enumerate(zip(ran.positions, ran.normals, strict=True)):
            gaps = [np.abs(p.position - x).max() + np.abs(floats(p.frame[0]) - nu).max() for p in points]
            if gaps:
                there[int(np.argmin(gaps))] = i
        states = [self.initial]
        for one in ran.states:
            force = np.zeros((len(points), self.scheme.d))
            for q, i in there.items():
                force[q] = one["force"][i]
            old = states[-1]
            states.append(
                State(
                    big(one["u"]) if self.moves else old.u,
                    big(one["w"]) if self.moves else old.w,
                    big(one["theta"]) if self.conducts else old.theta,
                    big(force),
                )
            )
        return states, sorted(there)

    def fields(self, states: list[State]) -> dict[str, list[Any]]:
        """Every field of the steps as doubles; of the contact force what the free nodes feel."""
        scheme = self.scheme
        free = [a for a in range(scheme.N) if scheme.d * a in set(scheme.free_w)]
        out: dict[str, list[Any]] = {name: [] for name in FIELDS}
        for s in states:
            if self.moves:
                out["u"].append(s.u)
                out["w"].append(s.w)
                nodal = zeros(scheme.N, scheme.d)
                for q, point in enumerate(scheme.points):
                    for node, share in zip(point.nodes, point.shape, strict=True):
                        nodal[node] = nodal[node] + share * s.force[q]
                out["force"].append(mid(nodal[free]))
                out["stress"].append(scheme.forms.stress(s.u.ravel(), s.w.ravel(), s.theta))
            if self.conducts:
                out["theta"].append(s.theta)
        return out

    def voigt(self, stress: Any) -> Any:
        """A run's stress (cells, d, d) as the reference writes it, (cells, s)."""
        return big(np.stack([stress[:, i, j] for i, j in VOIGT[self.scheme.d]], axis=1))

    def scales(self, fields: dict[str, list[Any]]) -> dict[str, float]:
        """The largest value of each field in the run; a velocity counts with the displacement, a stress with what the
        rounding of the displacements makes of it, a temperature with what that of the slip makes of the heat of friction."""
        out = {
            name: max((float(np.abs(floats(x)).max(initial=0.0)) for x in values), default=0.0)
            for name, values in fields.items()
        }
        k, forms = float(self.scheme.k), self.scheme.forms
        out["w"] = max(out["w"], 1e-6 * out["u"] / k)
        strain = max(float(np.abs(floats(b)).sum(axis=1).max()) for _, b in forms.strains)
        for table, size in ((self.scene.elasticity, out["u"]), (self.scene.viscosity, out["w"])):
            if table is not None and self.moves:
                tensor = float(np.abs(floats(isotropic(table, self.scheme.d))).max())
                out["stress"] = max(out["stress"], 1e-8 * tensor * strain * size)
        out["theta"] = max(out["theta"], self.rubbed(out["force"], out["w"]))
        return out

    def rubbed(self, force: float, w: float) -> float:
        """The temperature that one step of friction makes of SLIP of the largest speed under the largest force."""
        share = max((c.friction_heating.share for c in self.scene.contacts if c.friction_heating), default=0.0)
        if share == 0:
            return 0.0
        nodal = floats(self.scheme.forms.storage).sum(axis=1)
        return SLIP * share * force * w * float(self.scheme.k) / float(nodal.min())

    @staticmethod
    def apart(one: dict[str, list[Any]], other: dict[str, list[Any]], scales: dict[str, float]) -> dict[str, float]:
        """The largest difference of each field over the steps both have, over its scale."""
        out = {}
        for name in FIELDS:
            pairs = zip(one[name], other[name], strict=False)
            worst = max((float(np.abs(floats(a - b)).max(initial=0.0)) for a, b in pairs), default=0.0)
            scale = scales[name]
            out[name] = 0.0 if worst == 0 else worst / scale if scale > 0 else float("inf")
        return out

    def rounding(self, states: list[State], scales: dict[str, float]) -> float:
        """How far the stress moves when u, w and theta are rounded to doubles, over the largest stress; 0 where there is none."""
        if not self.moves:
            return 0.0
        forms, worst, size = self.scheme.forms, 0.0, 0.0
        for s in states[1:]:
            exact = forms.stress(s.u.ravel(), s.w.ravel(), s.theta)
            near = forms.stress(big(floats(s.u)).ravel(), big(floats(s.w)).ravel(), big(floats(s.theta)))
            worst = max(worst, float(np.abs(floats(near - exact)).max()))
            size = max(size, float(np.abs(floats(exact)).max()))
        return worst / size if size > 1e-40 * scales["stress"] else 0.0

    def spread(
        self, reference: list[State], fields: dict[str, list[Any]], scales: dict[str, float]
    ) -> dict[str, float]:
        """How far each field moves when every number of the scene is moved to one of its neighbours."""
        out = dict.fromkeys(FIELDS, 0.0)
        for seed in range(2):
            try:
                other = Judge(nudged(self.scene, seed))
                moved = other.fields(other.advance([s.force for s in reference[1:]]))
            except (ArithmeticError, SceneError):
                return dict.fromkeys(FIELDS, float("inf"))
            found = self.apart(moved, fields, scales)
            out = {name: max(out[name], found[name]) for name in FIELDS}
        return out


def nudged(scene: Scene, seed: int) -> Scene:
    """The scene with every number moved up or down by one unit in its last place; formulas and counts stay."""
    choice = random.Random(seed)

    def moved(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: one if key in ("exponent", "share") else moved(one) for key, one in value.items()}
        if isinstance(value, list):
            if value and isinstance(value[0], list):  # symmetric matrices stay so
                factor = choice.choice((1 - 2.0**-53, 1 + 2.0**-52))
                return [[float(x) * factor for x in row] for row in value]
            return [moved(one) for one in value]
        if isinstance(value, float):
            return float(np.nextafter(value, choice.choice((-np.inf, np.inf)))) if value else value
        return value

    tables = scene.resolved()
    kept = {key: tables.get(key) for key in ("output", "title")}
    friction = [c.friction for c in scene.contacts]
    out = moved(tables) | {key: value for key, value in kept.items() if value is not None}
    if any(f and f.kinetic is not None and f.kinetic >= f.coefficient for f in friction):
        out["contact"] = tables["contact"]
    return build(out)


def row_of(ran: Ran, verdict: str) -> dict[str, Any]:
    """What the run itself says, with room for the judgement."""
    row: dict[str, Any] = {"class": verdict, "outcome": ran.outcome, "reason": ran.reason, "taken": len(ran.states)}
    row |= {f"error_{name}": "" for name in FIELDS} | {f"spread_{name}": "" for name in FIELDS}
    row |= {f"left_{name}": "" for name in LEFT} | {"rounding": "", "way": "", "digits": ran.digits}
    row |= {"newton_largest": max(ran.newton, default=0), "newton_mean": sum(ran.newton) / max(1, len(ran.newton))}
    return row | {"run_seconds": ran.seconds, "judge_seconds": 0.0}


def judge(scene: Scene, ran: Ran) -> dict[str, Any]:
    """Class, errors of every field, how far the data move them, and what the run's own states leave over."""
    began = time.perf_counter()
    row = row_of(ran, ran.outcome)
    if ran.outcome in ("refused", "crash"):
        return row
    it = Judge(scene)
    own, _ = it.own(ran)
    try:
        reference = it.advance([s.force for s in own[1:]])
    except ArithmeticError as error:
        return row | {"class": "unjudged", "way": str(error), "judge_seconds": time.perf_counter() - began}
    mine, fields = it.fields(own), it.fields(reference)
    if it.moves:
        mine["stress"][1:] = [it.voigt(one["stress"]) for one in ran.states]
    scales = it.scales(fields)
    errors = it.apart(mine, fields, scales)
    clean = max(errors.values()) <= TOLERANCE
    spread: dict[str, float] = {}
    if ran.outcome != "completed" or not clean:
        if not clean:
            other = it.another()
            again = it.fields(other)
            found = it.apart(mine, again, it.scales(again))
            if len(other) > 1 and max(found.values()) < max(errors.values()):
                reference, fields, errors, scales = other, again, found, it.scales(again)
                clean = max(errors.values()) <= TOLERANCE
        spread = it.spread(reference, fields, scales)
    held = max(spread.values(), default=0.0) <= HELD
    if ran.outcome != "completed":
        row["rounding"] = it.rounding(reference, scales)
        held = held and row["rounding"] <= TOLERANCE
        row["class"] = "stopped_though_solvable" if held else "ill_posed_and_said"
    elif clean:
        row["class"] = "right"
    else:
        near = all(errors[name] <= max(TOLERANCE, DATA * spread[name]) for name in FIELDS)
        message = all(errors[name] <= stated(ran, name) for name in FIELDS)
        row["class"] = "right_as_stated" if message else "ill_posed_unsaid" if near else "silently_wrong"
    left = [it.scheme.left_over(a, b, n) for n, (a, b) in enumerate(itertools.pairwise(own), 1)]
    row |= {f"left_{name}": max((one[name] for one in left), default="") for name in LEFT}
    row |= {f"error_{name}": errors[name] for name in FIELDS} | {f"spread_{name}": v for name, v in spread.items()}
    return row | {"way": " ".join(sorted(it.ways)), "judge_seconds": time.perf_counter() - began}
