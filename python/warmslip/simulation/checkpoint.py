"""Checkpoints: the state of a run after a step, from which the next steps come out the same to the last bit.

Two files are kept, the newest and the one before; each is written beside them and then renamed, so that a process that is
killed leaves at least one whole. What a checkpoint belongs to (scene, mesh, code, linear algebra) is written into it.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import zipfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from warmslip.records import provenance

if TYPE_CHECKING:
    from warmslip.simulation.run import Run

NAMES = ("checkpoint.npz", "checkpoint.previous.npz")  # newest first
FIELDS = ("u", "w", "theta")
PARTED = ("strained", "strained_w")  # u and w but for rigid motions, of a body without supports
ESTIMATED = ("u", "theta", "stress", "contact_force")  # fields whose errors are estimated
FUNCTIONS = "set of Python functions"
STATUSES = (0, 1, 2)  # open, stick, slip
# where laws of the user's are asked, to be told from others: penetration over the size of the body; pressure and slip speed
DEPTHS = (1e-8, 1e-6, 1e-4, 1e-3, 1e-2)
PRESSURES = [(1e-3, 0.1), (1.0, 1e-3), (1.0, 1.0), (1e3, 0.1)]


_fingerprint = cache(provenance.fingerprint)  # it reads every source, and this process has one code


def _owner(job: Run) -> dict[str, Any]:
    """What must be the same for the same next step (collective)."""
    return {
        "scene": job.scene.digest(),
        "code": _fingerprint(),
        "solver": job.stepper.solver,
        "ranks": job.comm.size,
        FUNCTIONS: [*job.discretisation.own, *_values(job, job.scene.step, job.scene.time.end)],
    }


def _values(job: Run, *times: float) -> list[str]:
    """A hash of what Python functions in the place of the scene's give at some times and places, if any (collective)."""
    if not job.discretisation.own:
        return []
    found = hashlib.sha256()
    for time in times:
        try:
            given = job.discretisation.load_vectors.at(time, job.scene.step)
        except ValueError as error:  # on every rank
            found.update(str(error).encode())
            continue
        for one in given:
            found.update(np.asarray(getattr(one, "array", one if one is not None else ())).tobytes())
    size = float(np.ptp(np.asarray(job.discretisation.mesh.nodes), axis=0).max())
    for law in job.discretisation.laws:
        for watch in law.functions:
            asked = watch.anew()
            places = [(size * r,) for r in DEPTHS] if watch is law.compliance else PRESSURES
            found.update(np.array([asked(*place) for place in places]).tobytes())
    return ["".join(job.comm.allgather(found.hexdigest()))]


def save(folder: Path, job: Run) -> None:
    """Writes the state after the last step; the stepper forgets what a resumed one cannot know (collective)."""
    stepper = job.stepper
    stepper.forget()
    fields = {name: job.discretisation.field(getattr(stepper, name)) for name in (*FIELDS, *PARTED)}
    owner, following = _owner(job), _values(job, (job.taken + 1) * job.scene.step)
    if job.comm.rank != 0:
        return
    record = {
        "owner": owner,
        "step": job.taken,
        "next": following,
        "time": float(stepper.time).hex(),
        "worst": job.worst,
        "errors": job.errors,
        "newton_max": job.newton_max,
        "stages": job.stages,
        "extents": list(stepper.extents),
        "seen": job.watch.seen,
    }
    arrays = {name: values for name, values in fields.items() if values is not None}
    arrays |= {"rigid": np.asarray(stepper.rigid)} if "strained" in arrays else {}
    arrays |= {"contact_force": np.asarray(stepper.contact_force), "status": np.asarray(stepper.status, dtype=int)}
    newest, previous = (folder / name for name in NAMES)
    written = folder / "checkpoint.part.npz"
    try:
        np.savez(written, record=np.array(json.dumps(record)), **arrays)
    except OSError:
        written.unlink(missing_ok=True)  # the disk may be full
        raise
    if newest.exists():
        os.replace(newest, previous)
    os.replace(written, newest)


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Record and arrays of a whole checkpoint, None for a torn one."""
    try:
        _honest(path)
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: np.array(file[name]) for name in file.files}
        record = json.loads(str(arrays.pop("record")))
        return (record, arrays) if isinstance(record.get("owner"), dict) else None
    except Exception:  # zip, zlib, NumPy's header and JSON each have their own words for torn bytes
        return None


def _honest(path: Path) -> None:
    """Raises ValueError when an array says that it is larger than the file: NumPy would make room for it first."""
    form: Any = np.lib.format
    with zipfile.ZipFile(path) as whole:
        for name in whole.namelist():
            with whole.open(name) as member:
                if form.read_magic(member) != (1, 0):
                    raise ValueError(f"{name} is not as NumPy writes it")
                shape, _, kind = form.read_array_header_1_0(member)
                if math.prod(shape) * kind.itemsize > path.stat().st_size:
                    raise ValueError(f"{name} ends before all that it announces")


def _fits(record: dict[str, Any], arrays: dict[str, Any], job: Run) -> bool:
    """Whether all is there that a run goes on from, in its shapes and finite: what a run of this scene would have written."""
    nodes, d = job.discretisation.mesh.nodes.shape
    points, problem = len(job.stepper.status), job.discretisation.problem
    shapes: dict[str, tuple[int, ...]] = {"contact_force": (points * d,), "status": (points,)}
    shapes |= {"u": (nodes, d), "w": (nodes, d)} if problem.moves else {}
    shapes |= {"theta": (nodes,)} if problem.conducts else {}
    if job.stepper.strained is not None:
        shapes |= dict.fromkeys(PARTED, (nodes, d)) | {"rigid": np.shape(job.stepper.rigid)}
    if any(name not in arrays or arrays[name].shape != shape for name, shape in shapes.items()):
        return False
    status = arrays["status"]
    if not (status.dtype.kind == "i" and np.isin(status, STATUSES).all()):
        return False
    if not all(arrays[name].dtype == float and np.isfinite(arrays[name]).all() for name in shapes.keys() - {"status"}):
        return False
    try:
        worst, errors = record["worst"], record["errors"]
        counts = [record["step"], record["newton_max"], *record["stages"].values()]
        return (
            math.isfinite(float.fromhex(record["time"]))
            and worst.keys() == job.worst.keys()
            and errors.keys() <= set(ESTIMATED)
            and all(type(v) is float for v in (*worst.values(), *errors.values()))
            and len(record["extents"]) == len(job.stepper.extents)
            and all(type(v) is float and 0 <= v < math.inf for v in record["extents"])
            and job.watch.fits(record["seen"])
            and all(type(count) is int and count >= 0 for count in counts)
            and 0 < record["step"] <= job.scene.time.steps
        )
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        return False


def _ended(folder: Path, job: Run) -> str:
    """What to say when the run that ended in the folder was of another scene: it would be overwritten."""
    try:
        scene = json.loads((folder / "summary.json").read_text())["stamp"]["scene_hash"]
    except (OSError, ValueError, LookupError, TypeError):
        return ""
    return "" if scene == job.scene.digest() else f"{folder / 'summary.json'} is of another scene"


def load(folder: Path, job: Run) -> int:
    """Brings a new run to the newest whole checkpoint of its own in `folder`; the step it goes on from, 0 if there is none.

    Collective. Raises ValueError when the only whole checkpoints belong to another scene, code or number of ranks.
    """
    found: tuple[dict[str, Any], dict[str, Any]] | None = None
    foreign, owner = "", _owner(job)
    if job.comm.rank == 0:
        for name in NAMES:
            whole = _read(folder / name)
            if whole is None:
                continue
            other = [key for key, value in owner.items() if whole[0]["owner"].get(key) != value]
            if not other:
                if not _fits(*whole, job):
                    continue
                found = whole
                break
            foreign = f"{folder / name} is of another {' and '.join(other)}"
        if found is None and not foreign:
            foreign = _ended(folder, job)
    found, foreign = job.comm.bcast((found, foreign), root=0)
    if found is None:
        if foreign:
            raise ValueError(f"{foreign}; run it as it was, or without --resume from the start")
        return 0
    record, arrays = found
    if record.get("next", []) != _values(job, (record["step"] + 1) * job.scene.step):
        raise ValueError(
            f"checkpoint.npz is of another {FUNCTIONS}; run it as it was, or without --resume from the start"
        )
    nodes = len(job.discretisation.mesh.nodes)
    u, w, theta = (arrays.get(name, np.zeros((nodes, 1))) for name in FIELDS)
    job.discretisation.state(job.stepper, u, w, theta, float.fromhex(record["time"]))
    if job.stepper.strained is not None:
        parted = [job.discretisation.distributed(arrays[name]) for name in PARTED]
        job.stepper.part(*parted, arrays["rigid"])
        for vector in parted:
            vector.destroy()
    job.stepper.resume(arrays["contact_force"], arrays["status"].tolist(), record["extents"])
    job.worst, job.errors = record["worst"], record["errors"]
    job.newton_max, job.stages = record["newton_max"], record["stages"]
    job.watch.seen |= record["seen"]
    return int(record["step"])
