"""What solves its equations and is hardly sensible: numbers in, sentences out, each with its number and its cure.

`plausible_data` has what the data alone say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

STRAIN, SUNK, POINTS, IMPACT, BEYOND = 0.2, 0.01, 4, 20, 1e-3


def several(
    coefficient: float, most: float, *, sharp: bool, timed: bool, now: tuple[int, str], other: int, steps: int
) -> list[str]:
    """Of the largest friction coefficient and the largest up to which every step has one solution, beyond which some step has
    several if it is `sharp`. `timed`: shorter steps help. `now`: how many points touch at the end and the bound of these alone;
    `other` of the `steps` found their solution from another start.
    """
    known = "" if sharp else " surely"
    rule = "Newton's method takes the one it reaches from the forces of the step before"
    rule += f" (from another start in {other} of {steps} steps)" if other else ""
    points, alone = now
    touch = f" ({alone} if the {points} points that touch at the end stay the only ones)" if points else ""
    cure = "shorter steps, a softer foundation" if timed else "a softer foundation"
    return [
        f"the friction coefficient is {coefficient:g}, and every step{known} has one solution up to {down(most)} only{touch}: a "
        f"step may have several, of which {rule}; take {cure} or a smaller coefficient"
    ]


def unknown(coefficient: float | None, reason: str) -> list[str]:
    """Of the largest friction coefficient, None for a law of one's own alone, where no bound on it is known."""
    size = (
        "the friction is a law of your own" if coefficient is None else f"the friction coefficient is {coefficient:g}"
    )
    return [
        f"{size}, and no value of a coefficient is known up to which every step has one solution, as "
        f"{reason}: a step may have several, of which Newton's method takes the one it reaches from the forces of the "
        "step before; compare with a run in steps of half the length"
    ]


def shares(coefficient: float) -> list[str]:
    """Of the largest friction coefficient, where points with friction share their normal forces."""
    return [
        f"the friction coefficient is {coefficient:g} where contact points share their normal forces in many ways, as more "
        "points than nodes do on a rigid foundation and two parts at a corner: a step may have several solutions, of which "
        "Newton's method takes the one it reaches from the forces of the step before, and the digits are those of the sums of "
        "these forces at the nodes, not of single ones; take a finite contact.stiffness there"
    ]


def down(value: float) -> str:
    """Two digits of a positive number, rounded down."""
    if not 0 < value < math.inf:
        return f"{value:g}"
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.floor(value / unit * (1 + 1e-12)) * unit:.2g}"


def inside(part: str, start: float, later: float, size: float) -> list[str]:
    """Of the least gap at the start and later on, length."""
    if start < 0:
        return [
            f"the gap of '{part}' is {start:.3g} at its nearest point at t = 0: the body starts inside the foundation; start "
            "with a gap of 0 or more, or give an initial displacement that fits"
        ]
    if later < -0.1 * size:
        return [
            f"the gap of '{part}' falls to {later:.3g}, {-100 * later / size:.2g} % of the body's size: the foundation moves "
            "into where the body was; check contact.gap"
        ]
    return []


def kinked(key: str, count: int, of: int, what: str, points: int, change: float) -> str:
    """Of a formula with a kink inside `count` of the cells or facets, and the share of the load that its quadrature misses."""
    return (
        f"the formula of {key} has a kink or a jump inside {count} of {of} {what}, and a quadrature of {points} points per "
        f"direction misses {100 * change:.2g} % of the load: let {what} end there, or raise loads.quadrature"
    )


def heat_start(
    part: str, *, jump: float, share: float, step: float, sensible: float, layer: float, lumped: bool
) -> list[str]:
    """Of a `jump` of temperature at the start on a part, whose `share` reaches the first cell before it is resolved.

    `sensible` is the least step that a consistent capacity stands, `layer` the time in which the jump leaves the first cell.
    """
    if step < sensible and share > 0.01 and not lumped:
        return [
            f"temperatures start with a jump of {jump:.3g} on '{part}', and a step of {step:.3g} is shorter than the mesh "
            f"resolves there: temperatures overshoot their data; take steps of {sensible:.2g} or longer, a finer mesh there, or "
            "heat.capacity_matrix = 'lumped'"
        ]
    if step > 10 * layer and share > 0.01:
        return [
            f"temperatures start with a jump of {jump:.3g} on '{part}', and a step of {step:.3g} is {step / layer:.2g} times the "
            f"{layer:.2g} in which it leaves the first cell: the first steps are a sketch; take steps of {10 * layer:.2g} or "
            "less where they matter"
        ]
    return []


def strained(strain: float) -> list[str]:
    """Of the largest principal strain, dimensionless."""
    if not strain > STRAIN:
        return []
    return [
        f"the largest strain is {100 * strain:.3g} %: the theory is one of small strains, good to a few %; lower the loads or "
        "stiffen the body"
    ]


def sunk(penetration: float, size: float, deformation: float) -> list[str]:
    """Of the largest penetration, the body's size and how far its points move against each other, lengths."""
    cure = "raise contact.stiffness"
    if penetration > SUNK * size:
        return [
            f"the body sinks into the foundation by {penetration:.3g}, {100 * penetration / size:.2g} % of its size; {cure}"
        ]
    if penetration > 0.1 * SUNK * size and penetration > 10 * deformation:
        return [
            f"the body sinks into the foundation by {penetration:.3g} and deforms by {deformation:.2g} only: the "
            f"foundation is the softer of the two; {cure}"
        ]
    return []


def warm_corner(first: str, last: str, one: float, other: float, place: Sequence[float], t: float) -> str:
    """Of two parts, in the order of the scene, that prescribe different temperatures at a common node."""
    at = ", ".join(f"{x:.4g}" for x in place)
    return (
        f"'{first}' and '{last}' prescribe the temperatures {one:.4g} and {other:.4g} at their common node at ({at}), "
        f"t = {t:.3g}: that of '{last}', the last one in the scene, is taken; blend the two near the corner if that matters"
    )


def starts_at_zero(run: str, field: str) -> str:
    """A field that a scene has, and the run whose state it begins with has not."""
    return f"the run in '{run}' has no {field}, which is taken as 0 at the start; begin with a run that has one"


def carried(moved: float, size: float) -> list[str]:
    """Of the largest displacement of a body without inertia whose supports and foundation rest, and its size, lengths."""
    if moved <= size:
        return []
    return [
        f"the body moves by {moved:.3g}, {moved / size:.2g} times its size: hardly anything holds it; check its supports, "
        "springs and loads"
    ]


def touched(most: int, points: int, nearest: float) -> list[str]:
    """Of how many contact points touch at most at any time, of how many there are, and how far the nearest is at the end,
    infinity where the normals of all miss the foundation."""
    if points == 0 or most >= POINTS:
        return []
    if most == 0 and nearest == np.inf:
        return ["nothing ever touches: no normal of the part meets the foundation; check contact.gap"]
    if most == 0:
        return [
            f"nothing ever touches: the nearest point ends {nearest:.3g} away; lower contact.gap, or load the body towards it"
        ]
    return [
        f"at most {most} of {points} contact points ever touch: pressures depend on the mesh; refine it there so that "
        f"{POINTS} or more do"
    ]


SMALL = {  # fields that end no run when they have few digits: what they are small beside, and what to do
    "contact_force": (
        "the contact force",
        "it is a small rest of larger forces; press the body harder where it matters",
    ),
    "u": ("u", "rounding of the forces and temperatures makes displacements of its size; take it for zero"),
    "theta": (
        "the temperature",
        "rounding of the motion makes temperatures of its size, by straining or by friction; take it for zero, or "
        "describe the motion beside a support that moves",
    ),
    "stress": (
        "the stress",
        "rounding of the displacement makes stresses of its size; take it for zero, or describe the motion beside a "
        "support that moves",
    ),
}


UNDETERMINED = (
    "the forces do not determine where the body is: a small change of the loads has no definite answer, as where all "
    "points that touch slip and nothing else holds the body; what is found solves the equations, and so do others: "
    "give the body inertia, or hold it"
)


def rounded(errors: dict[str, float]) -> list[str]:
    """Of the estimated relative errors of fields, dimensionless."""
    return [
        f"{field} keeps {max(0, int(-np.log10(min(error, 1.0))))} of its digits, fewer than the four of other fields: {why}"
        for (field, why), error in ((SMALL[name], error) for name, error in errors.items())
        if error > 1e-4
    ]


def slid(part: str, slip: float, facet: float) -> list[str]:
    """Of the longest slip on a part whose gap varies in space, and the size of its facets, lengths."""
    if slip <= facet:
        return []
    return [
        f"points of '{part}' slip by {slip:.3g}, {slip / facet:.2g} facets, and each keeps the gap of its first place; "
        "let the foundation move in the formula of the gap instead, or keep the slip below a facet"
    ]


def impact(shortest: int | None) -> list[str]:
    """Of the fewest steps of a contact that began and ended."""
    if shortest is None or shortest >= IMPACT:
        return []
    return [
        f"an impact lasts {shortest} steps: its force and rebound are damped by the steps; take {IMPACT / shortest:.2g} times as "
        f"many, so that it lasts {IMPACT}"
    ]


def feeds(step: float, limit: float) -> str:
    """Of a staggered step too long for a coupling R = -c M, which below `limit` stands any mesh."""
    cure = "take time.coupling = 'monolithic', which stands any" + (
        f", or steps below {limit:.3g}" if limit > 0 else ""
    )
    return (
        f"a step of {step:.3g} is longer than staggered steps stand with this coupling: temperature and motion may grow from "
        f"step to step; {cure}"
    )


def drives_itself() -> str:
    """Of a coupling whose F - sym(M x R) is negative for some strain."""
    return (
        "heat.heating warms what heat.expansion stretches by more than the elasticity holds: some strain drives itself, in the "
        "equations as in the run, whatever the step; thermodynamics has R = -T0 M, write "
        "heat.heating = { thermodynamic = true }"
    )


def grown(found: dict[str, float], *, cancels: bool, itself: bool, limit: float) -> list[str]:
    """Of a growth, `factor` a step and `total` from time `begin` to `end`, that nothing drives; empty for none.

    `cancels` is R = -c M, stable up to the step `limit`; `itself` says that some strain drives itself.
    """
    if not found:
        return []
    if cancels:
        cure = "take time.coupling = 'monolithic', with which nothing grows"
        cure += f", or steps below {limit:.3g}" if limit > 0 else ""
    elif itself:
        cure = (
            "so do the equations, whose heat.heating warms a strain by more than the elasticity holds, and no step is short "
            "enough; thermodynamics has R = -T0 M, write heat.heating = { thermodynamic = true }"
        )
    else:
        cure = (
            "the equations themselves may grow, as heat.heating is no negative multiple of heat.expansion: a growth over "
            "time that half the step keeps is theirs; thermodynamics has R = -T0 M, write heat.heating = { thermodynamic = true }"
        )
    return [
        f"the coupling feeds the run: what a step changes of temperature and motion grows by a factor of {found['factor']:.4g} "
        f"a step, {found['total']:.2g} in all from t = {found['begin']:.3g} to {found['end']:.3g}, although nothing drives it; "
        f"{cure}"
    ]


def beyond(low: dict[str, float], high: dict[str, float], nodes: int, cure: str) -> list[str]:
    """Of temperatures below and above what the data allow: `bound`, `value` farthest from it, `count`, `time`; empty for none."""
    out = []
    for found, below, least in ((low, "below", "least"), (high, "above", "most")):
        if found:
            out.append(
                f"{found['count']:g} of {nodes} temperatures lie {below} {found['bound']:.4g}, the {least} that the data allow: "
                f"{found['value']:.4g} at t = {found['time']:.3g}; {cure}"
            )
    return out
