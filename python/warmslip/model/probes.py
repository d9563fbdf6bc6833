"""Fields of a state at points, along lines and on parts of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip.model.arc_length import along_part
from warmslip.model.discretisation import Discretisation
from warmslip.model.point_location import cells_of, distance
from warmslip.model.state import State
from warmslip.scene import probe_checks
from warmslip.scene.probe_tables import DEFAULT_COUNT, ProbeTable
from warmslip.scene.scene import Scene
from warmslip.typing import Array

NODAL = {"displacement": "u", "velocity": "w", "temperature": "theta"}


@dataclass(frozen=True)
class Probe:
    """The places of a table [output.probes.NAME] on a mesh.

    Parameters
    ----------
    name : str
        Of the table.
    fields : tuple of str
        What is taken there, in the order of the columns.
    every : int
        Steps between two rows.
    positions : array (points, d)
        Length.
    length : array (points,) or None
        Distance along the line or the part; None of a point, and of parts in space.
    nodes : array (points, d + 1)
        Nodes of the cell that each point lies in.
    weights : array (points, d + 1)
        Barycentric coordinates there.
    cells : array (points,)
        Those cells.
    contact : array (points,) or None
        Numbers of the contact points; None elsewhere.
    """

    name: str
    fields: tuple[str, ...]
    every: int
    positions: Array
    length: Array | None
    nodes: Any
    weights: Array
    cells: Any
    contact: Any = None

    def columns(self, state: State) -> dict[str, Array]:
        """Every column with its values, (points,): places, then a column for each component of a field (collective)."""
        axes = "xyz"[: self.positions.shape[1]]
        out = {} if self.length is None else {"length": self.length}
        out |= {axis: self.positions[:, i] for i, axis in enumerate(axes)}
        for name in self.fields:
            out |= self._components(name, state, axes)
        return out

    def _components(self, name: str, state: State, axes: str) -> dict[str, Array]:
        column = name.replace(" ", "_").lower()
        if name == "stress":
            return self._stress(state, axes)
        if name == "von Mises":
            assert state.mises is not None
            return {column: state.mises[self.cells]}
        if name in NODAL:
            values = np.asarray(getattr(state, NODAL[name]))[self.nodes]
            values = np.einsum("pi,pi...->p...", self.weights, values)
        else:
            values = state.contact[name][self.contact]
        if values.ndim == 1:
            return {column: values}
        return {f"{column}_{axis}": values[:, i] for i, axis in enumerate(axes)}

    def _stress(self, state: State, axes: str) -> dict[str, Array]:
        """Components of the stress of the cells; in the plane also that along z."""
        assert state.stress is not None and state.stress_zz is not None
        values = state.stress[self.cells]
        out = {f"stress_{a}{b}": values[:, i, j] for i, a in enumerate(axes) for j, b in enumerate(axes[i:], start=i)}
        return out | {"stress_zz": state.stress_zz[self.cells]} if len(axes) == 2 else out


def probes(d: Discretisation) -> list[Probe]:
    """The probes of a scene on its mesh.

    Raises
    ------
    ValueError
        For a point outside the body, with its distance.
    """
    out = []
    contacts = np.asarray(d.surface.contacts, dtype=int)
    for name, table in (d.scene.output.probes or {}).items():
        points, length, contact = None, None, None
        if probe_checks.touches(d.scene, table.part):
            number = next(i for i, one in enumerate(d.scene.contacts) if one.part == table.part)
            contact = np.flatnonzero(contacts == number)
            points = np.asarray(d.surface.positions)[contact]
        points, length, order = _places(table, d.mesh, points)
        cells, weights = _located(f"output.probes.{name}", d.mesh, points)
        out.append(
            Probe(
                name,
                tuple(f for f in probe_checks.fields(d.scene, table) if table.fields is None or f in table.fields),
                table.every,
                points,
                length,
                np.asarray(d.mesh.cells)[cells],
                weights,
                cells,
                None if contact is None else contact[order],
            )
        )
    return out


def refuse_outside(scene: Scene, mesh: Any) -> None:
    """Raises ValueError for a probe with a point outside the body, with its distance."""
    for name, table in (scene.output.probes or {}).items():
        if table.part is None:
            _located(f"output.probes.{name}", mesh, _places(table, mesh, None)[0])


def _places(table: ProbeTable, mesh: Any, touching: Array | None) -> tuple[Array, Array | None, Any]:
    """Positions of a probe (points, d), their lengths, and of a part the order that they are in; `touching` contact points."""
    if table.at is not None:
        return np.array([table.at]), None, None
    if table.line is not None:
        first, last = np.array(table.line)
        share = np.linspace(0, 1, table.count or DEFAULT_COUNT)[:, None]
        return first + share * (last - first), share[:, 0] * float(np.linalg.norm(last - first)), None
    assert table.part is not None
    if touching is None:
        touching = np.asarray(mesh.nodes)[np.unique(np.asarray(mesh.parts[table.part]))]
    if touching.shape[1] == 3:
        return touching, None, np.arange(len(touching))
    order, length = along_part(mesh, table.part, touching)
    return touching[order], length, order


def _located(key: str, mesh: Any, points: Array) -> tuple[Any, Array]:
    nodes, cells = np.asarray(mesh.nodes), np.asarray(mesh.cells)
    cell, weights = cells_of(nodes, cells, points)
    if (cell < 0).any():
        outside = points[cell < 0]
        where = ", ".join(f"{x:.6g}" for x in outside[0])
        far = distance(nodes, cells, outside[0])
        others = f" and {len(outside) - 1} more lie" if len(outside) > 1 else " lies"
        raise ValueError(
            f"{key}: the point ({where}){others} outside the body, at a distance of {far:.3g}; correct the place"
        )
    return cell, weights
