"""Scenes with an answer on paper, run and compared: the cases by name, each giving its lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from warmslip.records.check import Check
from warmslip.verification.exact import creep, expansion, hertz, impact, modes, patch, ringing, shear, slab, sliding

Case = Callable[[], list[Check]]

CASES: dict[str, Case] = {
    "creeping column": creep.creeping_column,
    "inertial column": ringing.inertial_column,
    "coupled uniform strain": patch.coupled_patch,
    "sliding elastic block": sliding.elastic_block,
    "sliding rigid block": sliding.rigid_block,
    "sticking patch": shear.sticking_patch,
    "slipping patch": shear.slipping_patch,
    "patch at the threshold": shear.threshold_patch,
    "Robin slab": slab.robin_slab,
    "heated column": expansion.heated_column,
    "Hertz": hertz.hertz,
    "compliant line contact": hertz.compliant,
    "Cattaneo-Mindlin": hertz.cattaneo_mindlin,
    "bar on a soft foundation": impact.soft_impact,
    "bar on a stiff foundation": impact.stiff_impact,
    "modes of backward Euler": modes.recursion,
    "longitudinal frequency": modes.frequency,
}


def lines() -> Iterator[Check]:
    """The lines of all cases, as they are computed; about ten seconds on one core, on one rank."""
    for case in CASES.values():
        yield from case()
