"""What the theory assumes, computed on a scene: what holds, what does not, by how much, and what follows.

An audit never stops a run. It needs the mesh and the operators and takes no time step. One rank.
"""

from __future__ import annotations

from collections.abc import Iterator

from mpi4py import MPI

from warmslip.model.corners import Corner
from warmslip.model.corners import corners as corners_of
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.scene.full import FullScene
from warmslip.verification.assumptions.coupling import coupling
from warmslip.verification.assumptions.findings import Finding, verdict
from warmslip.verification.assumptions.friction import friction
from warmslip.verification.assumptions.hypotheses import hypotheses
from warmslip.verification.assumptions.initial_data import start

TOPICS = (hypotheses, coupling, friction, start)
REGULAR = 1.0  # the exponent from which on a corner does not slow P1 elements


def audit(scene: FullScene) -> list[Finding]:
    """All findings on a scene; raises ValueError for a scene that cannot be discretised."""
    return examine(discretise(scene, comm=MPI.COMM_SELF))


def examine(d: Discretisation) -> list[Finding]:
    """All findings on a discretisation of one rank, which may have its own mesh and loads."""
    return [*(finding for topic in TOPICS for finding in topic(d)), *corners(d)]


def corners(d: Discretisation) -> Iterator[Finding]:
    """One finding a corner: the order in h that its singularity leaves on uniform meshes."""
    if d.dim != 2:
        meaning = "Edges and vertices of a body in space have exponents of their own, which are not computed."
        yield Finding("corners", "no corner slows convergence", (), "not needed", meaning)
        return
    for corner in corners_of(d.scene, d.mesh):
        yield _corner(corner)


def _corner(corner: Corner) -> Finding:
    x, y = corner.point
    values = (
        ("angle", corner.angle),
        ("exponent of u", corner.exponent_u),
        ("exponent of theta", corner.exponent_theta),
    )
    slow = [
        (field, exponent)
        for field, exponent in (("u", corner.exponent_u), ("theta", corner.exponent_theta))
        if not exponent >= REGULAR
    ]
    known = [f"|{'u|_V' if f == 'u' else 'grad theta|'} is O(h^{e:.3f})" for f, e in slow if e == e]
    unknown = [f"{f} has no exponent, its operator degenerates" for f, e in slow if e != e]
    meaning = "The fields are smooth enough here for O(h) on any mesh."
    if slow:
        meaning = "; ".join([*known, *unknown]) + "."
    if known:
        worst = min(e for _, e in slow if e == e)
        meaning += (
            f" On uniform meshes only; cells of size r^{1 - worst:.3f} at distance r from the corner restore O(h)."
        )
    return Finding(
        f"corner ({x:g}, {y:g})",
        f"r^L with L >= 1 between sides {corner.conditions[0]} and {corner.conditions[1]}",
        values,
        verdict(not slow),
        meaning,
    )
