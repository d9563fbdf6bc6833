"""Fields for other programs, through meshio."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

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
    nodal, cells = body_fields(d, u, w, theta, fields)
    meshio.Mesh(
        three(np.asarray(d.mesh.nodes)),
        [("triangle" if d.dim == 2 else "tetra", np.asarray(d.mesh.cells))],
        point_data=nodal,
        cell_data={name: [values] for name, values in cells.items()},
    ).write(path)


def body_fields(
    d: Discretisation, u: Array | None, w: Array | None, theta: Array | None, fields: Collection[str]
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Fields of the nodes and of the cells, as `write_vtu` has them: vectors with three components, tensors in rows."""
    nodal = {"displacement": u, "velocity": w, "temperature": theta}
    cells: dict[str, Array] = {}
    if u is not None and "stress" in fields:
        stress = d.stress(u, w, theta)
        cells["stress"] = stress.reshape(len(stress), -1)
    if u is not None and "von Mises" in fields:
        cells["von Mises"] = d.mises_of(u, w, theta)
    if u is not None and "stress" in fields and any(any(m.out_of_plane) for m in d.problem.materials):
        cells["stress zz"] = d.stress_zz(u, w, theta)
    return {name: three(v) for name, v in nodal.items() if v is not None and name in fields}, cells
