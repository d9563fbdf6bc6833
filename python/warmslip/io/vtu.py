"""Fields for other programs, through meshio."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import meshio
import numpy as np

from warmslip.model.discretisation import Discretisation
from warmslip.model.materials import cell_regions
from warmslip.typing import Array

BODY = ("displacement", "velocity", "temperature", "stress", "von Mises", "region")


def three(values: Array) -> Array:
    """Vectors (n, d) with the three components that ParaView wants; other arrays as they are."""
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1]))) if values.ndim == 2 else values


def symmetric(tensors: Array, zz: Array) -> Array:
    """Symmetric tensors (n, d, d) as (n, 6) in the order XX, YY, ZZ, XY, YZ, XZ, by which ParaView names six components.

    `zz` (n,) is the component ZZ of tensors in the plane, whose YZ and XZ are 0.
    """
    if tensors.shape[1] == 3:
        return np.stack([tensors[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))], axis=1)
    none = np.zeros(len(tensors))
    return np.stack([tensors[:, 0, 0], tensors[:, 1, 1], zz, tensors[:, 0, 1], none, none], axis=1)


def write_vtu(
    path: Path,
    d: Discretisation,
    u: Array | None,
    w: Array | None,
    theta: Array | None,
    fields: Collection[str] = BODY,
) -> None:
    """One state as VTU for ParaView: those of `fields` that the scene has, at the nodes; stress, von Mises stress, region a cell.

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
    """Fields of the nodes and of the cells, as `write_vtu` has them: vectors with three components, tensors as `symmetric`.

    `region` is the number of the region of a cell in the order of the scene, 0 for the rest of the body.
    """
    nodal = {"displacement": u, "velocity": w, "temperature": theta}
    cells: dict[str, Array] = {}
    if u is not None and "stress" in fields:
        cells["stress"] = symmetric(d.stress(u, w, theta), d.stress_zz(u, w, theta))
    if u is not None and "von Mises" in fields:
        cells["von Mises"] = d.mises_of(u, w, theta)
    if d.scene.regions and "region" in fields:
        cells["region"] = d.remember("regions", lambda: cell_regions(d.scene, d.mesh))
    return {name: three(v) for name, v in nodal.items() if v is not None and name in fields}, cells
