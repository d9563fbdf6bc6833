"""Fields of a state at points, along lines and on parts of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip.model.discretisation import Discretisation
from warmslip.model.probe_places import average, inside, places
from warmslip.model.state import State
from warmslip.scene import probe_checks
from warmslip.scene.scene import Scene
from warmslip.typing import Array

NODAL = {"displacement": "u", "velocity": "w", "temperature": "theta"}
FORCES = ("pressure", "friction traction", "status")  # of a step: the state that a run begins with has none


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
    average : sparse array (points, cells)
        Means over the cells that a point lies in, several on edges and at nodes, by their volumes.
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
    average: Any
    contact: Any = None

    def columns(self, state: State) -> dict[str, Array]:
        """Every column with its values, (points,): places, then a column for each component of a field (collective).

        Pressure, friction traction and status of the state that a run begins with are nan.
        """
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
            return {column: self.average @ state.mises}
        if name in NODAL:
            values = np.asarray(getattr(state, NODAL[name]))[self.nodes]
            values = np.einsum("pi,pi...->p...", self.weights, values)
        else:
            values = state.contact[name][self.contact]
            if state.step == 0 and name in FORCES:
                values = np.full_like(values, np.nan)
        if values.ndim == 1:
            return {column: values}
        return {f"{column}_{axis}": values[:, i] for i, axis in enumerate(axes)}

    def _stress(self, state: State, axes: str) -> dict[str, Array]:
        """Components of the stress of the cells; in the plane also that along z."""
        assert state.stress is not None and state.stress_zz is not None
        cells = len(state.stress)
        values = (self.average @ state.stress.reshape(cells, -1)).reshape(-1, len(axes), len(axes))
        out = {f"stress_{a}{b}": values[:, i, j] for i, a in enumerate(axes) for j, b in enumerate(axes[i:], start=i)}
        return out | {"stress_zz": self.average @ state.stress_zz} if len(axes) == 2 else out


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
        points, length, order = places(table, d.mesh, points)
        cells, weights = inside(f"output.probes.{name}", d.mesh, points)
        out.append(
            Probe(
                name,
                tuple(f for f in probe_checks.fields(d.scene, table) if table.fields is None or f in table.fields),
                table.every,
                points,
                length,
                np.asarray(d.mesh.cells)[cells],
                weights,
                average(d.mesh, cells, weights),
                None if contact is None else contact[order],
            )
        )
    return out


def refuse_outside(scene: Scene, mesh: Any) -> None:
    """Raises ValueError for a probe with a point outside the body, with its distance."""
    for name, table in (scene.output.probes or {}).items():
        if table.part is None:
            inside(f"output.probes.{name}", mesh, places(table, mesh, None)[0])
