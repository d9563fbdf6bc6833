"""Fields for other programs, through meshio."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array

BODY = ("displacement", "velocity", "temperature", "stress", "von Mises")


def three(values: Array) -> Array:
    """Vectors (n, d) with the three components that ParaView wants; other arrays as they are."""
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1]))) if values.ndim == 2 else values


def write_vtu(
    path: Path,
    d: Discretisation,
    u: Array | None,
    w: Array | None,
    theta: Array | None,
    fields: Collection[str] = BODY,
) -> None:
    """One state as VTU for ParaView: those of `fields` that the scene has, at the nodes, stress and von Mises stress a cell.

    With the stress of a body in plane strain goes `stress zz`, that along z.

    Arrays are in mesh numbering, (nodes, d) and (nodes,); None for a field the scene does not have. Raises OSError when the file
    cannot be written.
    """
    nodal: dict[str, Any] = {"displacement": u, "velocity": w, "temperature": theta}
    cells: dict[str, Any] = {}
    if u is not None:
        stress = d.stress(u, w, theta)
        cells = {"stress": [stress.reshape(len(stress), -1)], "von Mises": [d.mises_of(u, w, theta)]}
        if "stress" in fields and any(any(m.out_of_plane) for m in d.problem.materials):
            cells["stress zz"] = [d.stress_zz(u, w, theta)]
    meshio.Mesh(
        three(np.asarray(d.mesh.nodes)),
        [("triangle" if d.dim == 2 else "tetra", np.asarray(d.mesh.cells))],
        point_data={name: three(v) for name, v in nodal.items() if v is not None and name in fields},
        cell_data={name: v for name, v in cells.items() if name in (*fields, "stress zz")},
    ).write(path)
