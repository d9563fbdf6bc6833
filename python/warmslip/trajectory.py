"""A run on disk: states, contact points, step reports and the ledger of every step, in one HDF5 file."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from warmslip import _core
from warmslip.loads import Array
from warmslip.problem import Discretisation, discretise
from warmslip.scene import build

REPORT = ("newton_iterations", "open", "stick", "slip", "max_penetration", "normal_force")
LEDGER = tuple(_core.Ledger.terms)
CONTACT = {"force": ("f", "axes"), "displacement": ("f", "axes"), "status": ("i",), "gap": ("f",)}
THE_FILE = "give the trajectory.h5 that `warmslip run` wrote"
DENSEST = 1000  # bytes from a byte of a file that somebody compressed
# held back before it is written: bytes, seconds
LARGEST, LONGEST = 2**25, 1.0


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
        self._writing, self._stored = path is not None, -1
        self._alone = comm.size == 1
        self._rows: dict[str, list[Array]] = {}
        self._held, self._written = 0, time.monotonic()
        self._fields = [name for name in ("u", "w", "theta") if getattr(stepper, name) is not None]
        if path is None or comm.rank != 0:
            return
        d, points = discretisation.dim, len(discretisation.surface.weights)
        nodes = len(discretisation.mesh.nodes)
        earlier = path.with_suffix(".earlier.h5")
        if not keep:
            earlier.unlink(missing_ok=True)
        elif not earlier.exists():  # else a resumed run was killed while it copied
            os.replace(path, earlier)
        file = self._file = h5py.File(path, "w", libver="latest")
        file.attrs["scene"] = json.dumps(discretisation.scene.resolved())
        file.attrs["digest"] = discretisation.scene.digest()
        file.attrs["functions"] = json.dumps(discretisation.own)
        file["mesh/nodes"] = discretisation.mesh.nodes
        file["mesh/cells"] = discretisation.mesh.cells
        for name, facets in discretisation.mesh.parts.items():
            file[f"mesh/parts/{name}"] = facets
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
        for name in LEDGER:
            table(f"ledger/{name}")
        if points:
            table("contact/force", points, d)
            table("contact/displacement", points, d)
            table("contact/status", points, dtype="i1")
            table("contact/gap", points)
        if keep:
            self._copy(earlier, keep)
            self._stored = keep if keep % discretisation.scene.output.every == 0 else -1
        file.swmr_mode = True  # readable to the last flush, also when the process is killed

    def _append(self, name: str, value: Any) -> None:
        row = np.array(value)
        self._rows.setdefault(name, []).append(row)
        self._held += row.nbytes

    def write(self) -> None:
        """Writes what is held back and flushes it."""
        if self._file is None:
            return
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
            every = self._d.scene.output.every
            reached = np.rint(np.asarray(file["states/time"]) / self._d.scene.step).astype(int)
            due = np.flatnonzero(
                (reached <= keep) & (reached % every == 0)
            )  # not the last one of a run that was stopped
            for name in self._file["states"]:
                self._take(file, f"states/{name}", due)
            for group in ("steps", "ledger"):
                for name in self._file[group]:
                    self._take(file, f"{group}/{name}", np.arange(keep))
            for name in ("force", "displacement", "status", "gap"):
                if f"contact/{name}" in self._file:
                    self._take(file, f"contact/{name}", np.arange(keep))
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
        """Appends the report, the ledger and the contact points of the step just taken, and its state when due (collective)."""
        stepper, scene = self._stepper, self._d.scene
        self._taken = taken
        gap = self._d.load_vectors.on_points("gap", stepper.time) if self._writing else None
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
                self._append("contact/gap", gap)
        if self._writing and taken % scene.output.every == 0:
            self._state()
        if self._held > LARGEST or time.monotonic() - self._written > LONGEST:
            self.write()

    def __enter__(self) -> Self:
        if self._writing and self._taken == 0:
            self._state()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        # after an error on one of many ranks the others are elsewhere, and gathering would wait for them
        if self._writing and (kind is None or self._alone):
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
            self._file.close()


def _check(file: h5py.File) -> None:
    """Raises ValueError with what is missing or misshapen. A run that was killed may have more rows of one than of another."""
    nodes, d = _shape(file, "mesh/nodes", "f", None, None)
    cells = _shape(file, "mesh/cells", "i", None, d + 1)[0]
    if d not in (2, 3) or not cells or not 0 <= np.min(file["mesh/cells"]) <= np.max(file["mesh/cells"]) < nodes:
        raise ValueError("mesh/cells names nodes that are not there")
    _shape(file, "states/time", "f", None)
    for name, shape in {"u": (nodes, d), "w": (nodes, d), "theta": (nodes,)}.items():
        if name in file["states"]:
            _shape(file, f"states/{name}", "f", None, *shape)
    points = _shape(file, "contact/weights", "f", None)[0]
    for name, (kind, *more) in CONTACT.items():
        if points or name in file["contact"]:
            _shape(file, f"contact/{name}", kind, None, points, *([d] if more else []))
    _shape(file, "steps/time", "f", None)
    for group in ("steps", "ledger"):
        for name in file[group]:
            _shape(file, f"{group}/{name}", "f", None, *([d] if name == "friction_traction" else []))


def _shape(file: h5py.File, name: str, kind: str, *shape: int | None) -> tuple[int, ...]:
    """The shape of a dataset of a kind of numbers, None standing for any length. Raises ValueError when it has another."""
    data = file.get(name)
    if not isinstance(data, h5py.Dataset) or data.dtype.kind != kind:
        raise ValueError(f"{name} is missing or does not hold numbers of the kind it should")
    if len(data.shape) != len(shape) or any(n not in (m, None) for m, n in zip(data.shape, shape, strict=True)):
        raise ValueError(f"{name} has shape {data.shape}")
    if data.nbytes > DENSEST * file.id.get_filesize():
        raise ValueError(f"{name} has more numbers than the file can hold")
    return tuple(data.shape)


class Trajectory:
    """Read access to a run: lazy datasets (`u`, `w`, `theta`, `time`), the `series` of every step, `contact` points.

    A field that the scene does not have is None.
    """

    def __init__(self, path: str | Path) -> None:
        """Raises OSError when the file cannot be opened, ValueError when it is no trajectory or a damaged one."""
        self.path = Path(path)
        if not self.path.is_file():
            inside = self.path / "trajectory.h5"
            cure = f"give '{inside}'" if inside.is_file() else THE_FILE
            raise FileNotFoundError(f"'{path}' is no file; {cure}")
        try:
            try:
                self._file = h5py.File(self.path, "r")
            except OSError:  # a run that was killed, or is still going on, leaves its writer's mark
                self._file = h5py.File(self.path, "r", libver="latest", swmr=True)
        except OSError as error:
            if error.errno is not None:  # of the system: rights, a disk
                raise
            raise ValueError(f"'{path}' is damaged or no trajectory ({error}); {THE_FILE}") from None
        try:
            self.scene: dict[str, Any] = json.loads(self._file.attrs["scene"])
            _check(self._file)
            self._steps, self._states = self._whole()
        except Exception as error:  # HDF5's own errors come as KeyError, RuntimeError, OSError and more
            self._file.close()
            raise ValueError(f"'{path}' is damaged or no trajectory ({error}); {THE_FILE}") from None

    def _whole(self) -> tuple[int, int]:
        """Steps, and states of them, of which everything is there: a run that was killed may lack the last row of some series."""
        file = self._file
        series = [data for group in ("steps", "ledger") for data in file[group].values()]
        series += [file[f"contact/{name}"] for name in CONTACT if name in file["contact"]]
        steps = min(len(data) for data in series)
        states = min(len(data) for data in file["states"].values())
        last = file["steps/time"][steps - 1] if steps else 0.0
        return steps, int(np.sum(np.asarray(file["states/time"][:states]) <= last * (1 + 1e-12)))

    @property
    def _read(self) -> h5py.File:
        """The file while it is open. Raises ValueError afterwards, when HDF5 itself would find that there are no fields."""
        if not self._file:
            raise ValueError(f"{self.path} is closed; read it inside its `with` block, or open it again")
        return self._file

    def _state(self, name: str) -> Any:
        """A field of the whole states: the dataset itself if it has no others."""
        data = self._read.get(f"states/{name}")
        return data if data is None or len(data) == self._states else data[: self._states]

    @property
    def nodes(self) -> Array:
        """Positions, (nodes, d)."""
        return np.asarray(self._read["mesh/nodes"])

    @property
    def cells(self) -> Any:
        """Nodes of every cell, (cells, d+1)."""
        return np.asarray(self._read["mesh/cells"])

    @property
    def time(self) -> Array:
        """Times of the stored states, (states,)."""
        return np.asarray(self._state("time"))

    @property
    def u(self) -> Any:
        """Displacement, (states, nodes, d), read when indexed."""
        return self._state("u")

    @property
    def w(self) -> Any:
        """Velocity, (states, nodes, d)."""
        return self._state("w")

    @property
    def theta(self) -> Any:
        """Temperature, (states, nodes)."""
        return self._state("theta")

    def contact(self, name: str, step: int) -> Any:
        """`force`, `displacement`, `status` or `gap` of the contact points in a step, counted from 0. Raises IndexError."""
        if not -self._steps <= step < self._steps:
            raise IndexError(f"there are {self._steps} steps, and none with the number {step}")
        return self._read[f"contact/{name}"][step % self._steps]

    def discretisation(self) -> Discretisation:
        """The scene assembled again on this process, with the loads and laws that it states.

        Raises ValueError when that is not the mesh of the run, as its file has changed since.
        """
        from mpi4py import MPI

        scene = build(self.scene)
        if scene.mesh.file is not None and scene.digest() != self._read.attrs.get("digest"):
            raise ValueError(
                f"{self.path}: mesh file '{scene.mesh.file}' has changed since the run; put it back as it was"
            )
        found = discretise(scene, comm=MPI.COMM_SELF)
        if not (np.array_equal(found.mesh.nodes, self.nodes) and np.array_equal(found.mesh.cells, self.cells)):
            raise ValueError(f"{self.path}: it was run on another mesh than its scene gives; read it through Python")
        return found

    @property
    def functions(self) -> list[str]:
        """What Python functions took the place of the scene's: `loads`, `laws.PART.compliance` ..."""
        return list(json.loads(self._read.attrs.get("functions", "[]")))

    def series(self, group: str) -> dict[str, Array]:
        """Every dataset of `steps`, `ledger` or `contact` as arrays."""
        fixed = () if group in ("steps", "ledger") else ("positions", "normals", "weights", "part")
        return {
            name: np.asarray(data if name in fixed else data[: self._steps]) for name, data in self._read[group].items()
        }

    def xarray(self) -> Any:
        """The stored states as an `xarray.Dataset` (time, node, axis), with positions x, y, z as coordinates of the nodes.

        Raises RuntimeError when xarray is not installed.
        """
        try:
            import xarray
        except ImportError:
            raise RuntimeError("xarray is not installed; pip install xarray") from None
        axes = list("xyz"[: self.nodes.shape[1]])
        fields = {"u": ("time", "node", "axis"), "w": ("time", "node", "axis"), "theta": ("time", "node")}
        return xarray.Dataset(
            {
                name: (dims, np.asarray(getattr(self, name)))
                for name, dims in fields.items()
                if getattr(self, name) is not None
            },
            {"time": self.time, "axis": axes, **{a: ("node", self.nodes[:, i]) for i, a in enumerate(axes)}},
            {"title": self.scene.get("title", "")},
        )

    def close(self) -> None:
        """Closes the file; a `with` block does."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
