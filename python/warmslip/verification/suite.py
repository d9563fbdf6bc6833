"""The topics of the verification report by name: what each runs, and the tables it leaves beside its lines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from warmslip.records import tables
from warmslip.records.check import Check
from warmslip.scene.full import full_model
from warmslip.scene.reader import load
from warmslip.verification import graded_study, invariances, uncertainty
from warmslip.verification.assumptions import runs
from warmslip.verification.exact import cases
from warmslip.verification.mms import solutions
from warmslip.verification.theory import error_bound, existence

Topic = Callable[[Path], list[Check]]

HOT = {"contact.heat_exchange.foundation_temperature": 10.0}
READINGS = ("printed", "mixed", "isotropic", "consistent")


def exact_answers(folder: Path) -> list[Check]:
    """Bodies whose answer can be written down."""
    return list(cases.lines())


def manufactured(folder: Path) -> list[Check]:
    """Fields chosen first, data derived from them: slip, stick, moving kinks, affine fields; the plane and space."""
    return solutions.report(full=True)


def invariance(folder: Path) -> list[Check]:
    """Identities of every step, and changes that must not change the answer, on the paper's data sets and a block."""
    out = []
    for reading in READINGS:
        for coupling in ("staggered", "monolithic"):
            keys = {"mesh.n": 12, "time.steps": 12, "time.coupling": coupling}
            out += invariances.lines(
                f"{reading}, {coupling}", full_model(load(f"paper_{reading}")).override(**HOT, **keys)
            )
    block = full_model(load("block_3d")).override(**{"mesh.n": 3, "time.steps": 4})
    return out + invariances.lines("block in space", block)


def assumptions(folder: Path) -> list[Check]:
    """What the audit of the paper's data sets claims, put to runs; no order of |w|_L2, as none can be seen on these grids."""
    return [line for reading in READINGS for line in runs.lines(reading)]


def convergence(folder: Path) -> list[Check]:
    """Figure 5, done right: the paper's problem on graded and on uniform grids, the reference's own error taken off."""
    scene = full_model(load("paper_mixed")).override(**HOT)
    studies = {
        "graded": graded_study.unbiased(graded_study.study(scene, graded_study.GRADED, [32, 64, 128, 256], 512), 512),
        "uniform": graded_study.unbiased(graded_study.study(scene, graded_study.UNIFORM, [16, 32, 64, 128], 256), 256),
    }
    tables.write(
        folder / "graded_table.csv", [{"grids": name, **row} for name, rows in studies.items() for row in rows]
    )
    return graded_study.lines("paper_mixed, theta_F = 10", scene, studies["graded"], studies["uniform"])


def value_and_uncertainty(folder: Path) -> list[Check]:
    """Numbers without an exact value, from the studies of the paper: value +- uncertainty, put to the test."""
    studies = sorted(Path("results/paper/studies").glob("*_staggered.csv"))
    tables.write(folder / "uncertainty_table.csv", [row for path in studies for row in uncertainty.table(path)])
    return [line for path in studies for line in uncertainty.lines(path)]


def theory(folder: Path) -> list[Check]:
    """The existence proof run as an algorithm, and the error bound of the theorem term by term."""
    return [*existence.lines(), *error_bound.lines()]


TOPICS: dict[str, Topic] = {
    "exact_answers": exact_answers,
    "manufactured": manufactured,
    "invariance": invariance,
    "theory": theory,
    "assumptions": assumptions,
    "uncertainty": value_and_uncertainty,
    "convergence": convergence,
}
