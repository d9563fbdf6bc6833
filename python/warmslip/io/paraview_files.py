"""The files of a series of states for ParaView: one VTU file a state with an index, or one VTKHDF file."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any, Self

import meshio
import numpy as np

from warmslip.io.vtkhdf import TETRA, TRIANGLE, VERTEX, VtkHdf
from warmslip.io.vtu import three
from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array


class Series:
    """States of the body and of its contact points, appended in the order of time; fields are those of `vtu.body_fields`."""

    def __init__(self, folder: Path, d: Discretisation) -> None:
        self._folder, self._points = folder, three(np.asarray(d.surface.positions))
        self._nodes, self._cells, self._dim = three(np.asarray(d.mesh.nodes)), np.asarray(d.mesh.cells), d.dim

    def body(self, number: int, time: float, nodal: dict[str, Array], cells: dict[str, Array]) -> None:
        raise NotImplementedError

    def contact(self, number: int, time: float, fields: dict[str, Array]) -> None:
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
    """body_NNNN.vtu, contact_NNNN.vtu, and the index of each, body.pvd and contact.pvd."""

    def __init__(self, folder: Path, d: Discretisation) -> None:
        super().__init__(folder, d)
        self._files: dict[str, list[tuple[float, str]]] = {"body": [], "contact": []}

    def body(self, number: int, time: float, nodal: dict[str, Array], cells: dict[str, Array]) -> None:
        blocks = [("triangle" if self._dim == 2 else "tetra", self._cells)]
        mesh = meshio.Mesh(self._nodes, blocks, nodal, {name: [values] for name, values in cells.items()})
        self._write("body", number, time, mesh)

    def contact(self, number: int, time: float, fields: dict[str, Array]) -> None:
        blocks = [("vertex", np.arange(len(self._points))[:, None])]
        self._write("contact", number, time, meshio.Mesh(self._points, blocks, fields))

    def _write(self, name: str, number: int, time: float, mesh: Any) -> None:
        file = f"{name}_{number:04d}.vtu"
        mesh.write(self._folder / file)
        self._files[name].append((time, file))

    def close(self) -> None:
        for name, files in self._files.items():
            if files:
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
    """body.vtkhdf and contact.vtkhdf."""

    def __init__(self, folder: Path, d: Discretisation) -> None:
        super().__init__(folder, d)
        self._files: dict[str, VtkHdf] = {}

    def body(self, number: int, time: float, nodal: dict[str, Array], cells: dict[str, Array]) -> None:
        if "body" not in self._files:
            kind = TRIANGLE if self._dim == 2 else TETRA
            self._files["body"] = VtkHdf(self._folder / "body.vtkhdf", self._nodes, self._cells, kind)
        self._files["body"].append(time, nodal, cells)

    def contact(self, number: int, time: float, fields: dict[str, Array]) -> None:
        if "contact" not in self._files:
            vertices = np.arange(len(self._points))[:, None]
            self._files["contact"] = VtkHdf(self._folder / "contact.vtkhdf", self._points, vertices, VERTEX)
        self._files["contact"].append(time, fields, {})

    def close(self) -> None:
        for file in self._files.values():
            file.close()
