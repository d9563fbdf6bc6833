"""Reactions of supports and heat flows of parts over time: what a trajectory stores of them, and the table of both."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from warmslip.model.discretisation import Discretisation
from warmslip.model.heat_flows import HeatFlows
from warmslip.model.reactions import Reactions
from warmslip.model.state import resultants
from warmslip.records import tables
from warmslip.typing import Array

# datasets of every step, absent where a run has no support and no heat flow, and from files of earlier versions
DATASETS = ("reactions/force", "reactions/moment", "heat_flows/flow")


class PartSeries:
    """What a writer stores of every step."""

    def __init__(self, d: Discretisation) -> None:
        self._reactions, self._heat, self._dim = Reactions(d), HeatFlows(d), d.dim

    def create(self, file: h5py.File, table: Callable[..., None]) -> None:
        """Creates the datasets by `table`, a function of name and shape of a row."""
        supports, flows = self._reactions.names, self._heat.names
        if supports:
            table("reactions/force", len(supports), self._dim)
            table("reactions/moment", len(supports), self._reactions.moments)
            file["reactions"].attrs["names"] = json.dumps(supports)
        if flows:
            table("heat_flows/flow", len(flows))
            file["heat_flows"].attrs["names"] = json.dumps(flows)

    def row(self, stepper: Any) -> Iterator[tuple[str, Array]]:
        """Name and values of every dataset for the step taken last (collective)."""
        if self._reactions.names:
            yield from zip(DATASETS[:2], self._reactions.of(stepper), strict=True)
        if self._heat.names:
            yield DATASETS[2], self._heat.of(stepper)


def check(file: h5py.File, shape: Callable[..., object]) -> None:
    """Raises ValueError where a file holds other things than `PartSeries` writes; `shape` checks one dataset."""
    d = file["mesh/nodes"].shape[1]
    sizes = dict(zip(DATASETS, ((d,), (1 if d == 2 else 3,), ()), strict=True))
    for name in DATASETS:
        group = name.split("/")[0]
        if group in file:
            shape(file, name, "f", None, len(names(file, group)), *sizes[name])


def names(file: h5py.File, group: str) -> list[str]:
    """The names of supports or flows of a group; none without it. Raises ValueError."""
    if group not in file:
        return []
    found = json.loads(file[group].attrs.get("names", "null"))
    if not isinstance(found, list) or not found or not all(isinstance(one, str) for one in found):
        raise ValueError(f"{group} does not name what it holds")
    return found


def columns(found: dict[str, dict[str, Array]], flows: dict[str, Array]) -> dict[str, Array]:
    """Columns of a table, (steps,) each: `force_x NAME` ..., `moment_z NAME` ..., `heat exchange NAME` ..."""
    out: dict[str, Array] = {}
    for name, support in found.items():
        for what, values in support.items():
            axes = "z" if values.shape[1] == 1 else "xyz"[: values.shape[1]]
            out |= {f"{what}_{axis} {name}": values[:, i] for i, axis in enumerate(axes)}
    return out | {f"heat {name}": values for name, values in flows.items()}


def write_table(t: Any, d: Discretisation, path: Path) -> bool:
    """Writes reactions, resultants of the contact parts and heat flows of a trajectory as CSV, if there are any and steps."""
    force = t.series("contact").get("force")
    series = columns(t.reactions, t.heat_flows)
    series |= resultants(d, force) if force is not None and len(d.surface.weights) else {}
    time = t.series("steps")["time"]
    if not series or not len(time):
        path.unlink(missing_ok=True)
        return False
    rows = np.column_stack([time, *series.values()]).tolist()
    tables.write(path, (dict(zip(["time", *series], row, strict=True)) for row in rows))
    return True


def last(d: Discretisation, stepper: Any) -> dict[str, Any]:
    """Reactions and heat flows of the step that a stepper evaluated last, as plain numbers (collective)."""
    reactions, heat = Reactions(d), HeatFlows(d)
    force, moment = reactions.of(stepper)
    return {
        "reactions": {
            name: {"force": force[i].tolist(), "moment": moment[i].tolist()} for i, name in enumerate(reactions.names)
        },
        "heat_flows": dict(zip(heat.names, heat.of(stepper).tolist(), strict=True)),
    }
