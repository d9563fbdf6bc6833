"""Fields for other programs, through meshio."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np

from warmslip.loads import Array
from warmslip.problem import Discretisation, von_mises


def write_vtu(path: Path, d: Discretisation, u: Array, w: Array, theta: Array) -> None:
    """One state as VTU for ParaView: displacement, velocity, temperature at the nodes, stress and von Mises a cell.

    Arrays are in mesh numbering, (nodes, d) and (nodes,). Raises OSError when the file cannot be written.
    """
    stress = d.stress(u, w, theta)

    def three(values: Array) -> Array:
        return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))  # ParaView wants three components

    meshio.Mesh(
        three(np.asarray(d.mesh.nodes)),
        [("triangle" if d.dim == 2 else "tetra", np.asarray(d.mesh.cells))],
        point_data={"displacement": three(u), "velocity": three(w), "temperature": theta},
        cell_data={"stress": [stress.reshape(len(stress), -1)], "von Mises": [von_mises(stress)]},
    ).write(path)
