"""The contact fields of a stored run, by part and step."""

from __future__ import annotations

from functools import cached_property
from numbers import Real
from typing import Any

import numpy as np

from warmslip.messages import quoted
from warmslip.model.contact_output import ContactFields, PartPoints, chosen_part, contact_fields_on
from warmslip.model.loads import data, evaluate
from warmslip.model.materials import contact_part
from warmslip.scene.contact_tables import ContactTable
from warmslip.typing import Array

SAME_TIME = 1e-9  # relative to the end of the run


def refuse_no_time(time: Any) -> None:
    """Raises ValueError for what is neither a number nor None, the last time."""
    if time is not None and (isinstance(time, bool) or not isinstance(time, Real)):
        raise ValueError(f"time = {quoted(time)} is no number; give a time, or leave it out for the last one")


class StoredContact:
    """The group `contact` of a trajectory: of `steps` steps, whose first `states` states are whole.

    `functions` are the names of what Python functions took the place of, as in `Trajectory.functions`.
    """

    def __init__(self, file: Any, scene: dict[str, Any], steps: int, states: int, functions: set[str]) -> None:
        self._file, self._states, self._functions = file, states, functions
        given = scene.get("contact") or []
        tables = given if isinstance(given, list) else [given]
        self._tables = [ContactTable.model_validate(one) for one in tables]
        self._times = np.asarray(file["steps/time"][:steps])

    @cached_property
    def points(self) -> dict[str, PartPoints]:
        """The contact points of each part that has some."""
        group, found = self._file["contact"], {}
        of_part, nodes = np.asarray(group["part"]), np.asarray(self._file["mesh/nodes"])
        x, normals, weights = (np.asarray(group[name]) for name in ("positions", "normals", "weights"))
        for i in np.unique(of_part):
            name = self._tables[i].part
            facets = np.asarray(self._file[f"mesh/parts/{name}"])
            found[name] = PartPoints.of(name, nodes, facets, x, normals, weights, of_part == i)
        return found

    def near(self, part: str | None, time: float | None) -> ContactFields:
        """The fields in the step nearest to a time, in the last one for None. Raises ValueError."""
        last = self._last()
        refuse_no_time(time)
        if time is not None and not 0 <= time <= last * (1 + SAME_TIME):
            raise ValueError(f"the run has steps to t = {last:g}, not at {time:g}")
        step = len(self._times) - 1 if time is None else int(np.abs(self._times - time).argmin())
        return self._fields(part, slice(step, step + 1)).at(0)

    def history(self, part: str | None) -> ContactFields:
        """The fields in all steps. Raises ValueError."""
        self._last()
        return self._fields(part, slice(0, len(self._times)))

    def _last(self) -> float:
        if not len(self._times):
            raise ValueError("the run has taken no step, and has no contact fields yet")
        return float(self._times[-1])

    def _fields(self, part: str | None, steps: slice) -> ContactFields:
        name = chosen_part(part, list(self.points))
        points, (table,) = self.points[name], (one for one in self._tables if one.part == name)
        own = f"laws.{name}.friction" in self._functions
        group = self._file["contact"]
        force, displacement, status, gap = (group[key][steps] for key in ("force", "displacement", "status", "gap"))
        times = self._times[steps]
        return contact_fields_on(
            points,
            None if own else contact_part(table).law,
            time=times,
            force=force,
            displacement=displacement,
            status=status,
            gap=gap,
            speed=points.speed(self._velocities(points, displacement, steps) - _drive(table, points, times)),
            temperature=self._temperatures(points, times),
        )

    def _velocities(self, points: PartPoints, displacement: Array, steps: slice) -> Array:
        """Velocities of the points of a part in some steps, those of backward Euler, (steps, points, d)."""
        if steps.start:
            before, since = (
                self._file["contact/displacement"][steps.start - 1][points.number],
                self._times[steps.start - 1],
            )
        else:
            before, since = points.nodal(self._file["states/u"][0]), 0.0
        moved = np.diff(displacement[:, points.number], axis=0, prepend=before[None])
        return np.asarray(moved / np.diff(self._times[steps], prepend=since)[:, None, None])

    def _temperatures(self, points: PartPoints, times: Array) -> Array | None:
        """Temperatures of the points of a part, (steps, points); nan where no state is stored, None without heat."""
        if "states/theta" not in self._file:
            return None
        stored, found = self._file["states/time"][: self._states], np.full((len(times), len(points.number)), np.nan)
        for row, time in enumerate(times):
            state = int(np.abs(stored - time).argmin())
            if abs(stored[state] - time) <= SAME_TIME * stored[-1]:
                found[row] = points.nodal(self._file["states/theta"][state])
        return found


def _drive(table: ContactTable, points: PartPoints, times: Array) -> Array:
    """Velocities of the foundation at the points of a part, (steps, points, d)."""
    shape = points.positions.shape
    if table.velocity is None:
        return np.zeros((len(times), *shape))
    return np.array([evaluate(data(table.velocity), points.positions, float(t), shape[1]) for t in times])
