"""A run read from disk: lazy states, contact points, step reports and the balances of every step, from one HDF5 file."""

from __future__ import annotations

import json
import tempfile
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np

from warmslip.io import part_series
from warmslip.io.stored_contact import StoredContact, refuse_no_time
from warmslip.io.stored_state import StoredState
from warmslip.io.trajectory_writer import BALANCES, REPORT, step_numbers
from warmslip.mesh import files
from warmslip.messages import Shown, quoted
from warmslip.model.contact_output import ContactFields
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.scene.reader import build
from warmslip.scene.scene import Scene
from warmslip.typing import Array

CONTACT = {"force": ("f", "axes"), "displacement": ("f", "axes"), "status": ("i",), "gap": ("f",)}
THE_FILE = "give the trajectory.h5 that `warmslip run` wrote"
MAX_COMPRESSION = 1000  # bytes from a byte of a file that somebody compressed


LATER = {"foundation_work"}  # terms that files of earlier versions lack


def _opened(path: Path) -> h5py.File:
    """A file for reading, without a lock, or a run could not close what somebody reads. Raises OSError."""
    try:
        return h5py.File(path, "r", locking=False)
    except OSError:  # a run that was killed, or is still going on, leaves its writer's mark
        try:
            return h5py.File(path, "r", libver="latest", swmr=True, locking=False)
        except OSError:  # a run that has just ended took it away
            return h5py.File(path, "r", locking=False)


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
    for name, kind, size in (("positions", "f", (points, d)), ("normals", "f", (points, d)), ("part", "i", (points,))):
        _shape(file, f"contact/{name}", kind, *size)
    tables = json.loads(file.attrs["scene"]).get("contact") or []
    if points and not 0 <= np.min(file["contact/part"]) <= np.max(file["contact/part"]) < len(np.atleast_1d(tables)):
        raise ValueError("contact/part names contact tables that are not there")
    for name, (kind, *more) in CONTACT.items():
        if points or name in file["contact"]:
            _shape(file, f"contact/{name}", kind, None, points, *([d] if more else []))
    _shape(file, "steps/time", "f", None)
    for group, names in (("steps", REPORT), ("balances", BALANCES)):
        for name in {*file[group], *names} - (LATER - set(file[group])):
            _shape(file, f"{group}/{name}", "f", None, *([d] if name == "friction_traction" else []))
    part_series.check(file, _shape)


def _shape(file: h5py.File, name: str, kind: str, *shape: int | None) -> tuple[int, ...]:
    """The shape of a dataset of a kind of numbers, None standing for any length. Raises ValueError when it has another."""
    data = file.get(name)
    if not isinstance(data, h5py.Dataset) or data.dtype.kind != kind:
        raise ValueError(f"{name} is missing or does not hold numbers of the kind it should")
    if len(data.shape) != len(shape) or any(n not in (m, None) for m, n in zip(data.shape, shape, strict=True)):
        raise ValueError(f"{name} has shape {data.shape}")
    if data.nbytes > MAX_COMPRESSION * file.id.get_filesize():
        raise ValueError(f"{name} has more numbers than the file can hold")
    return tuple(data.shape)


def state_number(times: Array, time: float | None) -> int:
    """The stored state nearest to a time, the last one for None. Raises ValueError for a time beyond the run."""
    refuse_no_time(time)
    if time is None:
        return len(times) - 1
    if not times[0] - 1e-9 <= time <= times[-1] * (1 + 1e-9):
        raise ValueError(f"the run has states from t = {times[0]:g} to {times[-1]:g}, not at {time:g}")
    return int(np.abs(times - time).argmin())


class Trajectory(Shown):
    """Read access to a stored run.

    Fields are read when they are indexed; a field that the scene does not have is None. Use it in a `with` block.

    Parameters
    ----------
    path : str or Path
        The file trajectory.h5 of a run.

    Raises
    ------
    OSError
        When the file cannot be opened.
    ValueError
        When it is no trajectory, or a damaged one.
    """

    def __init__(self, path: str | Path) -> None:
        """Raises OSError when the file cannot be opened, ValueError when it is no trajectory or a damaged one."""
        self.path = Path(path)
        self._folder: tempfile.TemporaryDirectory[str] | None = None  # of a mesh file that is gone
        if not self.path.is_file():
            inside = self.path / "trajectory.h5"
            cure = f"give '{inside}'" if inside.is_file() else THE_FILE
            raise FileNotFoundError(f"'{path}' is no file; {cure}")
        try:
            self._file = _opened(self.path)
        except OSError as error:
            if error.errno is not None:  # of the system: rights, a disk
                raise
            raise ValueError(f"'{path}' is damaged or no trajectory ({error}); {THE_FILE}") from None
        try:
            self.scene: dict[str, Any] = json.loads(self._file.attrs["scene"])
            _check(self._file)
            self._steps, self._states = self._whole()
            if not self._states:
                raise ValueError("there is no whole state in it yet")
        except Exception as error:  # HDF5's own errors come as KeyError, RuntimeError, OSError and more
            self._file.close()
            raise ValueError(f"'{path}' is damaged or no trajectory ({error}); {THE_FILE}") from None

    def _facts(self) -> dict[str, str]:
        facts = {"": quoted(self.scene.get("title", "")), "file": str(self.path)}
        if not self._file:
            return facts | {"state": "closed"}
        there = [name for name in ("u", "w", "theta") if f"states/{name}" in self._file]
        points = len(self._file["contact/weights"])
        return facts | {
            "steps": str(self._steps),
            "states": f"{self._states} to t = {self.time[-1]:g}",
            "fields": ", ".join(there),
            "contact points": str(points),
        }

    def _whole(self) -> tuple[int, int]:
        """Steps, and states of them, of which everything is there: a run that was killed may lack the last row of some series."""
        file = self._file
        series = [data for group in ("steps", "balances") for data in file[group].values()]
        series += [file[f"contact/{name}"] for name in CONTACT if name in file["contact"]]
        series += [file[name] for name in part_series.DATASETS if name in file]
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

    def step_of(self, state: int) -> int:
        """The step at whose end a stored state is, counted from 0 as in `contact`; -1 for the start."""
        times = self._read["steps/time"][: self._steps]
        return int(step_numbers(self.time[[state]], times)[0]) - 1

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

    @cached_property
    def _stored_contact(self) -> StoredContact:
        return StoredContact(self._file, self.scene, self._steps, self._states, set(self.functions))

    def contact_on(self, part: str | None = None, time: float | None = None) -> ContactFields:
        """Contact fields of a part at the end of a step, ordered along it.

        Parameters
        ----------
        part : str, optional
            Name of a contact part; not needed where there is only one.
        time : float, optional
            The nearest step is taken; the last one by default.

        Returns
        -------
        ContactFields
            Arc length, pressure, friction traction and its bound, slip, gap, status; temperature where the state is stored.

        Raises
        ------
        ValueError
            For a part without contact points, a run without steps, and a time beyond the run.
        """
        self._read  # noqa: B018  it refuses once the file is closed
        return self._stored_contact.near(part, time)

    def contact_history(self, part: str | None = None) -> ContactFields:
        """Contact fields of a part at the ends of all steps, as `contact_on`: arrays (steps, points).

        Raises ValueError for a part without contact points and a run without steps.
        """
        self._read  # noqa: B018
        return self._stored_contact.history(part)

    @property
    def contact_parts(self) -> list[str]:
        """Names of the parts that have contact points."""
        self._read  # noqa: B018
        return list(self._stored_contact.points)

    def discretisation(self) -> Discretisation:
        """The scene assembled again on this process, with the loads and laws that it states.

        A mesh file is that of the run, also where it is gone or has changed since. Raises ValueError when that is not the mesh of
        the run.
        """
        from mpi4py import MPI

        found = discretise(self.built_scene(), comm=MPI.COMM_SELF)
        if not (np.array_equal(found.mesh.nodes, self.nodes) and np.array_equal(found.mesh.cells, self.cells)):
            raise ValueError(f"{self.path}: it was run on another mesh than its scene gives; read it through Python")
        return found

    def built_scene(self) -> Scene:
        """The scene of the run. A mesh file that is gone or has changed is written anew from what the trajectory holds."""
        name, stored = self.scene["mesh"].get("file"), self._read.get("mesh/file")
        if name is None or stored is None:
            return build(self.scene)
        content = np.asarray(stored).tobytes()
        if not (path := files.find(name)).is_file() or path.read_bytes() != content:
            if self._folder is None:
                self._folder = tempfile.TemporaryDirectory(prefix="warmslip-")
            path = Path(self._folder.name) / Path(name).name
            path.write_bytes(content)
        return build(self.scene | {"mesh": self.scene["mesh"] | {"file": str(path)}})

    @property
    def functions(self) -> list[str]:
        """What Python functions took the place of the scene's: `loads`, `laws.PART.compliance` ..."""
        return list(json.loads(self._read.attrs.get("functions", "[]")))

    def series(self, group: str) -> dict[str, Array]:
        """Every dataset of `steps`, `balances`, `contact`, `reactions` or `heat_flows` as arrays. Raises ValueError."""
        if not isinstance(self._read.get(group), h5py.Group):
            raise ValueError(
                f"the trajectory has no series {quoted(group)}; give steps, balances, contact, reactions or heat_flows"
            )
        fixed = ("positions", "normals", "weights", "part") if group == "contact" else ()
        return {
            name: np.asarray(data if name in fixed else data[: self._steps]) for name, data in self._read[group].items()
        }

    def state(self, time: float | None = None) -> StoredState:
        """The stored state nearest to a time, the last one by default: u, w, theta, stresses, contact fields.

        The scene is assembled once for all states, with the loads and laws that it states. Raises ValueError for a time beyond
        the run, and as `discretisation`.
        """
        number = state_number(self.time, time)
        u, w, theta = (None if one is None else np.asarray(one[number]) for one in (self.u, self.w, self.theta))
        return StoredState(
            self._assembled,
            self._stored_contact,
            step=self.step_of(number) + 1,
            time=float(self.time[number]),
            fields=(u, w, theta),
        )

    @cached_property
    def _assembled(self) -> Discretisation:
        return self.discretisation()

    @property
    def reactions(self) -> dict[str, dict[str, Array]]:
        """By support, in every step: `force` on the body, (steps, d), and `moment` about the origin, (steps, 1 or 3).

        Empty without supports, and for files of earlier versions. Where supports meet, see `model.reactions.Reactions`.
        """
        found = part_series.names(self._read, "reactions")
        series = {what: self._read[f"reactions/{what}"][: self._steps] for what in ("force", "moment") if found}
        return {name: {what: values[:, i] for what, values in series.items()} for i, name in enumerate(found)}

    @property
    def heat_flows(self) -> dict[str, Array]:
        """Heat per time into the body in every step, (steps,): `exchange PART`, `friction PART`, `support PART`."""
        found = part_series.names(self._read, "heat_flows")
        return {name: self._read["heat_flows/flow"][: self._steps, i] for i, name in enumerate(found)}

    def xarray(self) -> Any:
        """The run as an `xarray.Dataset`: states, contact fields of every step, and the series of steps and balances.

        The states u, w, theta are over time, node and axis, with positions x, y, z as coordinates of the nodes. The contact
        fields, `contact_pressure` and so on, are over step and point, in the order of `contact_history`, with part and arc length
        as coordinates of the points. The series are over step, the balances with the prefix `balance_`; `step` is the time at the
        end of each.

        Raises RuntimeError when xarray is not installed.
        """
        from warmslip.io.dataset import dataset

        return dataset(self)

    def close(self) -> None:
        """Closes the file; a `with` block does."""
        self._file.close()
        if self._folder is not None:
            self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
