"""Hypotheses (H1)-(H8) of the paper, with the constants of a scene."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from warmslip.model.coupling import ZERO, bounds
from warmslip.model.discretisation import Discretisation
from warmslip.model.loads import evaluate
from warmslip.typing import Array
from warmslip.verification.assumptions.constants import trace_constants
from warmslip.verification.assumptions.findings import Finding, verdict

SAMPLES = 17  # times at which data that may depend on time are looked at


def hypotheses(d: Discretisation) -> Iterator[Finding]:
    """The eight hypotheses in the paper's order."""
    material = d.problem.material
    yield _tensor("(H1)", "viscosity", "b", np.asarray(material.viscosity))
    yield _tensor("(H2)", "elasticity", "a", np.asarray(material.elasticity))
    conductivity = _conductivity(np.asarray(material.conductivity))
    yield conductivity
    yield _bounded("(H4)", "expansion M", "M_m", np.asarray(material.expansion))
    yield _bounded("(H5)", "heating R", "M_e", np.asarray(material.heating))
    yield _data(d)
    yield _law(d)
    yield from _smallness(d, conductivity["m_q"])


def _tensor(name: str, what: str, letter: str, tensor: Array) -> Finding:
    m, big = bounds(tensor)
    holds = m > ZERO * big
    if holds:
        meaning = f"The {what} resists every strain; conditions that compare with it use m_{letter}."
    elif what == "viscosity":
        meaning = (
            "Some strain rate costs no power: the motion is of the hyperbolic kind there, and neither the existence "
            "proof nor the order O(h + k) of Theorem 4.1 covers it. Steps are still solvable with inertia or elasticity."
        )
    else:
        meaning = (
            "Some strain stores no energy: nothing pulls the body back from it and creep under a lasting load goes on. "
            "The proof of Theorem 4.1 uses only the bound M_a, so its order is not endangered by this."
        )
    return Finding(
        name,
        f"{what} strongly monotone and Lipschitz: m_{letter} |e|^2 <= T e : e <= M_{letter} |e|^2, m_{letter} > 0",
        ((f"m_{letter}", m), (f"M_{letter}", big)),
        verdict(holds),
        meaning,
    )


def _conductivity(k: Array) -> Finding:
    m, big = bounds((k + k.T) / 2)
    symmetric = bool(np.array_equal(k, k.T))
    holds = symmetric and m > ZERO * big
    if holds:
        meaning = f"Heat spreads in every direction, at worst {big / m:.3g} times slower in one than in another."
    elif big == 0:
        meaning = "No heat is conducted: every point keeps what it gets, and theta need not have a gradient."
    else:
        meaning = (
            "Heat does not spread along some direction, theta is not in H1 and may jump across lines; its L2 order is then "
            "1/2 on a mesh and the paper's theorem does not apply."
        )
    values = (("m_q", m), ("M_q", big))
    return Finding("(H3)", "conductivity K symmetric, bounded and coercive, m_q > 0", values, verdict(holds), meaning)


def _bounded(name: str, what: str, constant: str, tensor: Array) -> Finding:
    size = float(np.linalg.norm(tensor))
    holds = bool(np.array_equal(tensor, tensor.T)) and np.isfinite(size)
    letter = what[-1]
    form = f"|(theta M, eps v)| <= {constant} |theta| |v|_V" if letter == "M" else f"|(R : eps v)| <= {constant} |v|_V"
    meaning = "No mechanical effect on this side." if size == 0 else f"The form is bounded by |{letter}| = {size:.4g}."
    return Finding(name, f"{what} symmetric and bounded: {form}", ((constant, size),), verdict(holds), meaning)


def _data(d: Discretisation) -> Finding:
    times = np.linspace(0.0, d.full.time.end, SAMPLES)
    x = np.asarray(d.surface.positions)
    least = min(float(evaluate(d.loads.gap, x, t, 1).min()) for t in times)
    meaning = (
        "The body does not overlap the foundation where it is undeformed."
        if least >= 0
        else f"The foundation overlaps the undeformed body by {-least:.4g}: contact pressure acts from the first step, "
        "as a press fit. The scheme takes it; the paper's hypothesis does not."
    )
    return Finding(
        "(H6)",
        "data bounded, and gap g >= 0 at the contact points",
        (("smallest g", least),),
        verdict(least >= 0),
        meaning,
    )


def _law(d: Discretisation) -> Finding:
    contact = d.full.contact
    normal, tangential = contact.stiffness, contact.stiffness * contact.friction.coefficient
    return Finding(
        "(H7)",
        "p_nu = c_nu r+ and p_tau = mu p_nu are non-negative, zero without penetration, and Lipschitz",
        (("L_nu", normal), ("L_tau", tangential)),
        "yes",
        "Always so for this law. The constants are large for a stiff foundation and enter (H8).",
    )


def _smallness(d: Discretisation, m_q: float) -> Iterator[Finding]:
    """(H8) as the proof of Theorem 3.1 would need it: m_b > (L_nu + L_tau) c_1^2 and m_q > k_c c_3^2.

    The scan prints m_b < ... and m_q > "M_c" c_3^2; the proof puts L_nu + L_tau against m_b in (3.6) and k_c c_3^2
    against m_q before (3.8), which settles sign and letter. Neither is needed: in (3.6) the displacements are time
    integrals of the velocities, which Gronwall's inequality absorbs (and m_b, a viscosity, cannot be compared with
    (L_nu + L_tau) c_1^2, a stress, without a time); and k_c theta is monotone, so (k_c theta, theta) has the good sign.
    """
    contact = d.full.contact
    m_b = bounds(np.asarray(d.problem.material.viscosity))[0]
    c_1, c_3 = trace_constants(d)
    lipschitz, k_c = contact.stiffness * (1 + contact.friction.coefficient), contact.heat_exchange.conductance
    sides = [
        ("contact", "m_b > (L_nu + L_tau) c_1^2", "m_b", m_b, "c_1", c_1, lipschitz),
        ("heat", "m_q > k_c c_3^2", "m_q", m_q, "c_3", c_3, k_c),
    ]
    why = {
        "contact": "Gronwall's inequality does the same for any stiffness, with constants that grow like its exponential: "
        "the order stays, the theorem's constant says nothing about the size of the error. Look at the measured errors.",
        "heat": "The exchange takes energy out whatever its size, so nothing is lost.",
    }
    for topic, statement, name, left, letter, trace, factor in sides:
        right = factor * trace**2 if factor else 0.0
        holds = left > right
        meaning = (
            "Satisfied, and not needed." if holds else f"Sufficient for the paper's proof, not needed. {why[topic]}"
        )
        if not holds and right < np.inf and left > 0:
            meaning = f"Missed by a factor {right / left:.3g}. {meaning}"
        values = ((name, left), (letter, trace), ("right side", right))
        yield Finding(f"(H8) {topic}", f"smallness: {statement}", values, verdict(holds), meaning)
