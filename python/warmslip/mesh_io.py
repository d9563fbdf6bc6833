"""Fields for other programs, through meshio."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np

from warmslip.loads import Array
from warmslip.problem import Discretisation, von_mises


def write_vtu(path: Path, d: Discretisation, u: Array | None, w: Array | None, theta: Array | None) -> None:
    """One state as VTU for ParaView: displacement, velocity, temperature at the nodes, stress and von Mises a cell.

    Arrays are in mesh numbering, (nodes, d) and (nodes,); None for a field the scene does not have. Raises OSError when the file
    cannot be written.
    """
    stress = d.stress(u, w, theta)

    def three(values: Array | None) -> Array | None:
        return (
            None if values is None else np.pad(values, ((0, 0), (0, 3 - values.shape[1])))
        )  # ParaView wants three components

    fields = {"displacement": three(u), "velocity": three(w), "temperature": theta}
    meshio.Mesh(
        three(np.asarray(d.mesh.nodes)),
        [("triangle" if d.dim == 2 else "tetra", np.asarray(d.mesh.cells))],
        point_data={name: values for name, values in fields.items() if values is not None},
        cell_data={"stress": [stress.reshape(len(stress), -1)], "von Mises": [von_mises(stress)]}
        if u is not None
        else {},
    ).write(path)
