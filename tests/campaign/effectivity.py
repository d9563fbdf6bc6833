"""Estimated errors over true ones, for every quantity and part of `--estimate`, on several scenes.

The true error is the distance over all steps of a run to a run with four times its cells along a side (three times in space) and
eight times its steps; of the part in space to one on the finer mesh alone, of the part in time to one with the shorter steps
alone. `python tests/campaign/effectivity.py` takes a few minutes on one core.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

import warmslip
from warmslip.records import tables
from warmslip.scene.scene import Scene
from warmslip.studies.companions import Companion
from warmslip.studies.error_estimate import estimate
from warmslip.studies.recording import Recording
from warmslip.studies.refinement_study import stamp

HOT = {"contact.heat_exchange.foundation_temperature": 10.0}
CORNERS = {"mesh.graded_to": ["corners"]}
SCENES: dict[str, tuple[str, dict[str, Any]]] = {
    "paper, hot": ("paper_mixed", HOT | {"mesh.n": 32, "time.steps": 32}),
    "paper, hot, graded": ("paper_mixed", HOT | CORNERS | {"mesh.n": 32, "time.steps": 16, "time.graded_to": [0.0]}),
    "paper, hot, adaptive": ("paper_mixed", HOT | {"mesh.n": 32, "time.steps": 8, "time.tolerance": 0.004}),
    "paper, cold": ("paper_mixed", {"mesh.n": 32, "time.steps": 32}),
    "heat slab": ("heat_slab", {"mesh.n": [8, 32], "time.steps": 64}),
    "heat slab, adaptive": ("heat_slab", {"mesh.n": [8, 32], "time.steps": 8, "time.tolerance": 0.004}),
    "sliding block": ("sliding_block", {"mesh.n": [16, 8], "time.steps": 128}),
    "sliding block, adaptive": ("sliding_block", {"mesh.n": [16, 8], "time.steps": 8, "time.tolerance": 0.004}),
    "quasistatic punch": ("quasistatic_punch", {"mesh.n": 32, "time.steps": 16}),
    "creep column": ("creep_column", {"mesh.n": [8, 16], "time.steps": 32}),
    "elastic drop": ("elastic_drop", {"mesh.n": 16, "time.steps": 256}),
    "block in space": ("block_3d", HOT | {"mesh.n": 8, "time.steps": 16}),
}
FINER = {2: 4, 3: 3}  # cells along a side, by dimension
SHORTER = 8  # steps
TINY = 1e-9  # of the size of a quantity: a true error that is rounding has no effectivity


def finer(scene: Scene) -> Scene:
    """The scene on a finer mesh."""
    n = [FINER[scene.mesh.dim] * count for count in scene.mesh.counts]
    return scene.override(**{"mesh.n": n if len(set(n)) > 1 else n[0]})


def shorter(scene: Scene) -> Scene:
    """The scene with shorter steps."""
    if scene.time.tolerance is not None:
        return scene.override(**{"time.tolerance": scene.time.tolerance / SHORTER**2})
    return scene.override(**{"time.steps": SHORTER * scene.time.steps})


def lines(name: str) -> list[dict[str, Any]]:
    """A line for every quantity and part of a scene."""
    scene = warmslip.load(SCENES[name][0]).override(**SCENES[name][1])
    found, _ = estimate(scene)
    references = {"space": finer(scene), "time": shorter(scene), "total": shorter(finer(scene))}
    out = []
    for part, reference in references.items():
        true = Recording(Companion(reference)).distance(Companion(scene)).values
        for quantity in found.quantities:
            known = found.total(quantity) if part == "total" else found.parts[quantity][part].error
            order = np.nan if part == "total" else found.parts[quantity][part].order
            size = found.size[quantity]
            ratio = known / true[quantity] if true[quantity] > TINY * size else np.nan
            out.append(
                {"scene": name, "quantity": quantity, "part": part, "estimated": known / size}
                | {"true": true[quantity] / size, "effectivity": ratio, "order": order}
            )
    return out


def summary(rows: list[dict[str, Any]]) -> str:
    """A table in Markdown: least, median and largest effectivity of the totals by quantity, and those outside 0.5 to 3."""
    out = [
        "| quantity | scenes | least | median | largest | outside 0.5 to 3 |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for quantity in dict.fromkeys(row["quantity"] for row in rows):
        own = [row for row in rows if (row["quantity"], row["part"]) == (quantity, "total")]
        own = sorted((row for row in own if np.isfinite(row["effectivity"])), key=lambda row: row["effectivity"])
        if own:
            values = [row["effectivity"] for row in own]
            outside = [f"{row['scene']} {row['effectivity']:.2g}" for row in own if not 0.5 <= row["effectivity"] <= 3]
            numbers = f"{values[0]:.2g} | {float(np.median(values)):.2g} | {values[-1]:.2g}"
            out.append(f"| {quantity} | {len(own)} | {numbers} | {'; '.join(outside) or '-'} |")
    return "\n".join(out)


def main() -> None:
    """Measures the scenes and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--out", type=Path, default=Path("results/tradeoff/effectivity.csv"))
    given = parser.parse_args()
    rows = []
    for name in given.scenes:
        rows += lines(name)
        print(f"{name}: done", flush=True)
    tables.write(given.out, rows, stamp(None, finer=FINER, shorter=SHORTER))
    print(summary(rows))


if __name__ == "__main__":
    main()
