"""A series of states in one VTKHDF file, which ParaView 5.12 and later open as it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from warmslip.typing import Array

TYPES = {
    "vertex": (1, 1),
    "line": (3, 2),
    "triangle": (5, 3),
    "tetra": (10, 4),
}  # of VTK by their names in meshio, and nodes
WHOLE = "i8"


class VtkHdf:
    """Writes an unstructured grid that stays and fields that change in time.

    Parameters
    ----------
    path : Path
        The file, whose name should end in .vtkhdf.
    points : array (points, 3)
        Positions.
    cells : array (cells, nodes)
        Nodes of each cell.
    kind : str
        One of `TYPES`.

    Raises
    ------
    OSError
        When the file cannot be written.
    """

    def __init__(self, path: Path, points: Array, cells: Any, kind: str) -> None:
        self._file = h5py.File(path, "w")
        self._steps = 0
        number, nodes = TYPES[kind]
        group = self._group = self._file.create_group("VTKHDF")
        group.attrs["Version"] = np.array([2, 0], dtype=WHOLE)
        group.attrs.create("Type", np.bytes_("UnstructuredGrid"))
        group["NumberOfPoints"] = np.array([len(points)], dtype=WHOLE)
        group["NumberOfCells"] = np.array([len(cells)], dtype=WHOLE)
        group["NumberOfConnectivityIds"] = np.array([cells.size], dtype=WHOLE)
        group["Points"] = np.asarray(points, dtype=float)
        group["Connectivity"] = np.asarray(cells, dtype=WHOLE).ravel()
        group["Offsets"] = np.arange(len(cells) + 1, dtype=WHOLE) * nodes
        group["Types"] = np.full(len(cells), number, dtype="u1")
        steps = group.create_group("Steps")
        steps.attrs["NSteps"] = np.int64(0)
        self._grow(steps, "Values", np.empty(0))
        for name in ("PartOffsets", "NumberOfParts", "PointOffsets"):
            self._grow(steps, name, np.empty(0, dtype=WHOLE))
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            self._grow(steps, name, np.empty((0, 1), dtype=WHOLE))

    @staticmethod
    def _grow(group: h5py.Group, name: str, rows: Any) -> None:
        """Appends rows to a dataset, which is made when there is none."""
        if name not in group:
            group.create_dataset(
                name, data=rows, maxshape=(None, *rows.shape[1:]), chunks=(max(1, len(rows)), *rows.shape[1:])
            )
            return
        data = group[name]
        data.resize(len(data) + len(rows), axis=0)
        data[len(data) - len(rows) :] = rows

    def append(self, time: float, points: dict[str, Array], cells: dict[str, Array]) -> None:
        """Adds a state: fields of the points and of the cells, (n,) or (n, components), the same names every time."""
        steps = self._group["Steps"]
        self._grow(steps, "Values", np.array([time]))
        for name, value in (("PartOffsets", 0), ("NumberOfParts", 1), ("PointOffsets", 0)):
            self._grow(steps, name, np.array([value], dtype=WHOLE))
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            self._grow(steps, name, np.zeros((1, 1), dtype=WHOLE))
        for place, fields in (("Point", points), ("Cell", cells)):
            data, offsets = (self._group.require_group(f"{place}Data"), steps.require_group(f"{place}DataOffsets"))
            for name, values in fields.items():
                begin = len(data[name]) if name in data else 0
                self._grow(offsets, name, np.array([begin], dtype=WHOLE))
                self._grow(data, name, np.asarray(values, dtype=WHOLE if values.dtype.kind == "i" else float))
        self._steps += 1
        steps.attrs["NSteps"] = np.int64(self._steps)

    def close(self) -> None:
        """Closes the file."""
        self._file.close()
