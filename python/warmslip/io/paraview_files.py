"""The files of a series of states for ParaView: one VTU file a state with an index, or one VTKHDF file."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Self

import meshio
import numpy as np

from warmslip.io.contact_mesh import ContactMesh
from warmslip.io.vtkhdf import VtkHdf
from warmslip.io.vtu import three
from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array

Fields = dict[str, Array]


class Series:
    """States of the body and of its contact parts, appended in the order of time; fields are those of `vtu.body_fields`.

    The series are `body`, `contact` and, where the fields of `contact` are means over facets, `contact_points`.
    """

    def __init__(self, folder: Path, d: Discretisation) -> None:
        self._folder = folder
        kinds = {2: ("triangle", "line"), 3: ("tetra", "triangle")}[d.dim]
        self._meshes = {"body": (three(np.asarray(d.mesh.nodes)), kinds[0], np.asarray(d.mesh.cells))}
        self._contact = None
        if len(places := np.asarray(d.surface.positions)):
            self._contact = ContactMesh.of(d)
            self._meshes["contact"] = (three(self._contact.points), kinds[1], self._contact.cells)
            self._meshes["contact_points"] = (three(places), "vertex", np.arange(len(places))[:, None])

    def body(self, number: int, time: float, nodal: Fields, cells: Fields) -> None:
        """Appends a state of the body."""
        self._append("body", number, time, nodal, cells)

    def contact(self, number: int, time: float, fields: Fields) -> None:
        """Appends fields of the contact points."""
        assert self._contact is not None
        self._append("contact", number, time, *self._contact.fields(fields))
        if self._contact.means is not None:
            self._append("contact_points", number, time, fields, {})

    def _append(self, name: str, number: int, time: float, points: Fields, cells: Fields) -> None:
        raise NotImplementedError

    def close(self) -> None:
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()


class VtuSeries(Series):
    """NAME_NNNN.vtu for each state of a series, and its index NAME.pvd."""

    def __init__(self, folder: Path, d: Discretisation) -> None:
        super().__init__(folder, d)
        self._files: dict[str, list[tuple[float, str]]] = {}

    def _append(self, name: str, number: int, time: float, points: Fields, cells: Fields) -> None:
        places, kind, nodes = self._meshes[name]
        file = f"{name}_{number:04d}.vtu"
        of_cells = {field: [values] for field, values in cells.items()}
        meshio.Mesh(places, [(kind, nodes)], points, of_cells).write(self._folder / file)
        self._files.setdefault(name, []).append((time, file))

    def close(self) -> None:
        """Writes the indices."""
        for name, files in self._files.items():
            _index(self._folder / f"{name}.pvd", files)


def _index(path: Path, files: list[tuple[float, str]]) -> None:
    lines = [f'    <DataSet timestep="{time:.17g}" file="{name}"/>' for time, name in files]
    body = "\n".join(lines)
    path.write_text(
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n'
        f"  <Collection>\n{body}\n  </Collection>\n</VTKFile>\n",
        encoding="utf-8",
    )


class HdfSeries(Series):
    """NAME.vtkhdf for each series."""

    def __init__(self, folder: Path, d: Discretisation) -> None:
        super().__init__(folder, d)
        self._files: dict[str, VtkHdf] = {}

    def _append(self, name: str, number: int, time: float, points: Fields, cells: Fields) -> None:
        if name not in self._files:
            places, kind, nodes = self._meshes[name]
            self._files[name] = VtkHdf(self._folder / f"{name}.vtkhdf", places, nodes, kind)
        self._files[name].append(time, points, cells)

    def close(self) -> None:
        """Closes the files."""
        for file in self._files.values():
            file.close()
