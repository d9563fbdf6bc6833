"""Writing a run to disk while it goes on: states, contact points, step reports and the balances, in one HDF5 file."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from warmslip._core import Balances
from warmslip.io.part_series import DATASETS, PartSeries
from warmslip.mesh import files
from warmslip.model.discretisation import Discretisation
from warmslip.typing import Array

REPORT = ("newton_iterations", "open", "stick", "slip", "max_penetration", "normal_force")
BALANCES = tuple(Balances.terms)
# held back before it is written: bytes, seconds
MAX_BUFFER_BYTES, MAX_BUFFER_SECONDS = 2**25, 1.0
SPARE = 2**19  # bytes that are kept free for closing the file: HDF5 does not survive a full disk


class Ballast:
    """Room on the disk of a run, held by a file that is given up when the disk is full."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "room.part"
        self._take(self._path, SPARE)

    def _take(self, path: Path, size: int) -> None:
        try:
            with path.open("wb") as file:
                os.posix_fallocate(file.fileno(), 0, size)
        except OSError as error:
            self.release()
            raise OSError(error.errno, error.strerror, str(path.parent)) from None

    def refuse(self, size: int) -> None:
        """Raises OSError when `size` bytes more have no room."""
        trial = self._path.with_suffix(".trial")
        try:
            self._take(trial, size)
        finally:
            trial.unlink(missing_ok=True)

    def release(self) -> None:
        self._path.unlink(missing_ok=True)


def step_numbers(states: Array, steps: Array) -> Any:
    """The numbers of the steps at whose ends (`steps`, times) the times of `states` (n,) are; 0 for the start."""
    return np.searchsorted(steps, states) + (states > 0)


class TrajectoryWriter:
    """Appends steps as they come and flushes them every second, so that a run that is killed is readable to its last second.

    States are stored every `output.every` steps; the last good one always, also when a step raised. Gathering is
    collective, rank 0 alone writes; without a path nothing is written.
    """

    def __init__(
        self, path: Path | None, discretisation: Discretisation, stepper: Any, comm: Any, *, keep: int = 0
    ) -> None:
        """`keep` steps of the file that is there are kept, of a run that is resumed."""
        self._d, self._stepper, self._taken = discretisation, stepper, keep
        self._file: h5py.File | None = None
        self._full = False
        self._writing, self._stored = path is not None, -1
        self._alone = comm.size == 1
        self._rows: dict[str, list[Array]] = {}
        self._held, self._written = 0, time.monotonic()
        self._fields = [name for name in ("u", "w", "theta") if getattr(stepper, name) is not None]
        self._parts = PartSeries(discretisation) if path is not None else None
        if path is None or comm.rank != 0:
            return
        d, points = discretisation.dim, len(discretisation.surface.weights)
        nodes = len(discretisation.mesh.nodes)
        earlier = path.with_suffix(".earlier.h5")
        if not keep:
            earlier.unlink(missing_ok=True)
        elif not earlier.exists():  # else a resumed run was killed while it copied
            os.replace(path, earlier)
        self._ballast = Ballast(path.parent)
        if _is_open(path):
            raise ValueError(f"{path} is open in this program; close its Trajectory, or choose another folder")
        path.unlink(missing_ok=True)  # another program that reads it keeps the file it has
        file = self._file = h5py.File(path, "w", libver="latest")
        file.attrs["scene"] = json.dumps(discretisation.scene.resolved())
        file.attrs["digest"] = discretisation.scene.digest()
        file.attrs["functions"] = json.dumps(discretisation.user_functions)
        file["mesh/nodes"] = discretisation.mesh.nodes
        file["mesh/cells"] = discretisation.mesh.cells
        for name, facets in discretisation.mesh.parts.items():
            file[f"mesh/parts/{name}"] = facets
        if discretisation.scene.mesh.file is not None:  # so that the results can be read elsewhere
            stored = np.frombuffer(files.find(discretisation.scene.mesh.file).read_bytes(), dtype="u1")
            file.create_dataset("mesh/file", data=stored, compression="gzip", compression_opts=1)
        file["contact/positions"] = discretisation.surface.positions
        file["contact/normals"] = discretisation.surface.normals
        file["contact/weights"] = discretisation.surface.weights
        file["contact/part"] = np.array(discretisation.surface.contacts, dtype="i4")

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
        for name in BALANCES:
            table(f"balances/{name}")
        if points:
            table("contact/force", points, d)
            table("contact/displacement", points, d)
            table("contact/status", points, dtype="i1")
            table("contact/gap", points)
        assert self._parts is not None
        self._parts.create(file, table)
        if keep:
            self._copy(earlier, keep)
        file.swmr_mode = True  # readable to the last flush, also when the process is killed

    def _append(self, name: str, value: Any) -> None:
        row = np.array(value)
        self._rows.setdefault(name, []).append(row)
        self._held += row.nbytes

    def write(self) -> None:
        """Writes what is held back and flushes it."""
        if self._file is None or self._full:
            return
        self._full = True
        self._ballast.refuse(2 * self._held + SPARE)
        self._full = False
        for name, rows in self._rows.items():
            dataset = self._file[name]
            dataset.resize(len(dataset) + len(rows), axis=0)
            dataset[-len(rows) :] = rows
        self._file.flush()
        self._rows, self._held, self._written = {}, 0, time.monotonic()

    def _state(self) -> None:
        stepper = self._stepper
        self._stored = self._taken
        fields = {name: self._d.field(getattr(stepper, name)) for name in self._fields}
        if self._file is None:
            return
        self._append("states/time", stepper.time)
        for name, values in fields.items():
            self._append(f"states/{name}", values)

    def _copy(self, earlier: Path, keep: int) -> None:
        """Takes over the first `keep` steps and the states up to them."""
        assert self._file is not None
        # a killed writer leaves its mark, which this way of reading looks past
        with h5py.File(earlier, "r", libver="latest", swmr=True) as file:
            reached = step_numbers(np.asarray(file["states/time"]), np.asarray(file["steps/time"]))
            # the last one of a run that was stopped, which no cadence asked for, goes
            stopped = reached[-1] % json.loads(file.attrs["scene"])["output"]["every"]
            due = np.flatnonzero((reached <= keep) & ((reached < reached[-1]) | (stopped == 0)))
            self._stored = int(reached[due][-1]) if len(due) else -1
            for name in self._file["states"]:
                self._take(file, f"states/{name}", due)
            for group in ("steps", "balances"):
                for name in self._file[group]:
                    self._take(file, f"{group}/{name}", np.arange(keep))
            contact = [f"contact/{name}" for name in ("force", "displacement", "status", "gap")]
            for name in (*contact, *DATASETS):
                if name in self._file:
                    self._take(file, name, np.arange(keep))
        earlier.unlink()

    def _take(self, file: Any, name: str, rows: Any) -> None:
        assert self._file is not None
        if len(file[name]) < len(rows):
            raise ValueError(
                f"the trajectory ends before the checkpoint ({name}); run from the start, without --resume"
            )
        self._file[name].resize(len(rows), axis=0)
        self._file[name][:] = file[name][rows]

    def step(self, report: Any, taken: int) -> None:
        """Appends the report, the balances and the contact points of the step just taken, and its state when due (collective)."""
        stepper, scene = self._stepper, self._d.scene
        self._taken = taken
        gap = self._d.load_vectors.on_points("gap", stepper.time) if self._writing else None
        parts = list(self._parts.row(stepper)) if self._parts is not None else []
        if self._file is not None:
            self._append("steps/time", stepper.time)
            for name in REPORT:
                self._append(f"steps/{name}", getattr(report, name))
            self._append("steps/friction_traction", report.friction_traction)
            for name in BALANCES:
                self._append(f"balances/{name}", getattr(report.balances, name))
            for name, values in parts:
                self._append(name, values)
            if len(self._d.surface.weights):
                shape = (-1, self._d.dim)
                self._append("contact/force", np.reshape(stepper.contact_force, shape))
                self._append("contact/displacement", np.reshape(stepper.contact_displacement, shape))
                self._append("contact/status", stepper.status)
                self._append("contact/gap", gap)
        if self._writing and taken % scene.output.every == 0:
            self._state()
        if self._held > MAX_BUFFER_BYTES or time.monotonic() - self._written > MAX_BUFFER_SECONDS:
            self.write()

    def __enter__(self) -> Self:
        if self._writing and self._taken == 0:
            self._state()
            self.write()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        # after an error on one of many ranks the others are elsewhere, and gathering would wait for them
        if self._writing and not self._full and (kind is None or self._alone):
            if self._stored != self._taken:
                self._state()
            self.write()
            mises = self._d.mises(self._stepper) if self._d.problem.moves else None
            if self._file is not None and mises is not None:
                path = self._file.filename
                self._file.close()
                self._file = h5py.File(path, "r+")
                self._file["fields/mises"] = mises
        if self._file is not None:
            self.write()
            self._ballast.release()
            self._file.close()


def _is_open(path: Path) -> bool:
    """Whether this program has a file open, to read or to write."""
    names = [h5py.h5f.get_name(one) for one in h5py.h5f.get_obj_ids(types=h5py.h5f.OBJ_FILE)]
    return path.exists() and any(os.path.exists(name) and os.path.samefile(name, path) for name in names)
