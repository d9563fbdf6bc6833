"""A run on disk: states, contact points, step reports and the ledger of every step, in one HDF5 file."""

from __future__ import annotations

import json
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from warmslip import _core
from warmslip.loads import Array
from warmslip.problem import Discretisation

REPORT = ("newton_iterations", "open", "stick", "slip", "max_penetration", "normal_force")
LEDGER = tuple(_core.Ledger.terms)


class TrajectoryWriter:
    """Appends steps as they come and flushes each, so that an interrupted run is readable to its last step.

    States are stored every `output.every` steps; the last good one always, also when a step raised. Gathering is
    collective, rank 0 alone writes; without a path nothing is written.
    """

    def __init__(self, path: Path | None, discretisation: Discretisation, stepper: Any, comm: Any) -> None:
        self._d, self._stepper = discretisation, stepper
        self._file: h5py.File | None = None
        self._writing, self._stored = path is not None, -1
        self._alone = comm.size == 1
        self._fields = [name for name in ("u", "w", "theta") if getattr(stepper, name) is not None]
        if path is None or comm.rank != 0:
            return
        d, points = discretisation.dim, len(discretisation.surface.weights)
        nodes = len(discretisation.mesh.nodes)
        file = self._file = h5py.File(path, "w")
        file.attrs["scene"] = json.dumps(discretisation.scene.resolved())
        file["mesh/nodes"] = discretisation.mesh.nodes
        file["mesh/cells"] = discretisation.mesh.cells
        for name, facets in discretisation.mesh.parts.items():
            file[f"mesh/parts/{name}"] = facets
        file["contact/positions"] = discretisation.surface.positions
        file["contact/normals"] = discretisation.surface.normals
        file["contact/weights"] = discretisation.surface.weights

        def table(name: str, *shape: int, dtype: str = "f8") -> None:
            file.create_dataset(
                name, (0, *shape), dtype, maxshape=(None, *shape), chunks=(1 if shape else 1024, *shape)
            )

        table("states/time")
        shapes = {"u": (nodes, d), "w": (nodes, d), "theta": (nodes,)}
        for name in self._fields:
            table(f"states/{name}", *shapes[name])
        table("steps/time")
        for name in REPORT:
            table(f"steps/{name}")
        table("steps/friction_traction", d)
        for name in LEDGER:
            table(f"ledger/{name}")
        if points:
            table("contact/force", points, d)
            table("contact/displacement", points, d)
            table("contact/status", points, dtype="i1")

    def _append(self, name: str, value: Any) -> None:
        assert self._file is not None
        dataset = self._file[name]
        dataset.resize(len(dataset) + 1, axis=0)
        dataset[-1] = value

    def _state(self) -> None:
        stepper = self._stepper
        self._stored = stepper.cost.steps
        fields = {name: self._d.field(getattr(stepper, name)) for name in self._fields}
        if self._file is None:
            return
        self._append("states/time", stepper.time)
        for name, values in fields.items():
            self._append(f"states/{name}", values)
        self._file.flush()

    def step(self, report: Any) -> None:
        """Appends the report, the ledger and the contact points of the step just taken, and its state when due (collective)."""
        stepper, scene = self._stepper, self._d.scene
        if self._file is not None:
            self._append("steps/time", stepper.time)
            for name in REPORT:
                self._append(f"steps/{name}", getattr(report, name))
            self._append("steps/friction_traction", report.friction_traction)
            for name in LEDGER:
                self._append(f"ledger/{name}", getattr(report.ledger, name))
            if len(self._d.surface.weights):
                shape = (-1, self._d.dim)
                self._append("contact/force", np.reshape(stepper.contact_force, shape))
                self._append("contact/displacement", np.reshape(stepper.contact_displacement, shape))
                self._append("contact/status", stepper.status)
            self._file.flush()
        if self._writing and stepper.cost.steps % scene.output.every == 0:
            self._state()

    def __enter__(self) -> Self:
        if self._writing:
            self._state()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        # after an error on one of many ranks the others are elsewhere, and gathering would wait for them
        if self._writing and (kind is None or self._alone):
            if self._stored != self._stepper.cost.steps:
                self._state()
            mises = self._d.mises(self._stepper) if self._d.problem.moves else None
            if self._file is not None and mises is not None:
                self._file["fields/mises"] = mises
        if self._file is not None:
            self._file.close()


class Trajectory:
    """Read access to a run: lazy datasets (`u`, `w`, `theta`, `time`), `ledger`, `contact`, `steps`.

    A field that the scene does not have is None.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._file = h5py.File(self.path, "r")
        self.scene: dict[str, Any] = json.loads(self._file.attrs["scene"])

    @property
    def nodes(self) -> Array:
        return np.asarray(self._file["mesh/nodes"])

    @property
    def cells(self) -> Any:
        return np.asarray(self._file["mesh/cells"])

    @property
    def time(self) -> Array:
        """Times of the stored states, (states,)."""
        return np.asarray(self._file["states/time"])

    @property
    def u(self) -> Any:
        """Displacement, (states, nodes, d), read when indexed."""
        return self._file.get("states/u")

    @property
    def w(self) -> Any:
        """Velocity, (states, nodes, d)."""
        return self._file.get("states/w")

    @property
    def theta(self) -> Any:
        """Temperature, (states, nodes)."""
        return self._file.get("states/theta")

    def series(self, group: str) -> dict[str, Array]:
        """Every dataset of `steps`, `ledger` or `contact` as arrays."""
        return {name: np.asarray(data) for name, data in self._file[group].items()}

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
