"""A stored run for other programs: a series of VTU files that ParaView opens, and its time series as CSV."""

from __future__ import annotations

import difflib
import logging
import re
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

import numpy as np

from warmslip.io.contact_mesh import GEOMETRY, geometry
from warmslip.io.paraview_files import HdfSeries, VtuSeries
from warmslip.io.part_series import write_table
from warmslip.io.trajectory import Trajectory, state_number
from warmslip.io.vtu import BODY, body_fields, three
from warmslip.model.discretisation import Discretisation
from warmslip.model.state import contact_fields, resultants
from warmslip.records import tables
from warmslip.typing import Array

log = logging.getLogger(__name__)

OWN = re.compile(r"(body|contact|contact_points)(_\d{4,}\.vtu|\.pvd|\.vtkhdf)")  # the files of a series
STEPS = ("newton_iterations", "open", "stick", "slip", "max_penetration", "normal_force")
CONTACT = ("pressure", "friction traction", "gap", "slip", "status", *GEOMETRY)
FIELDS = (*BODY, *CONTACT)
FORMS = ("vtu", "vtkhdf")


def opened(run: str | Path) -> Trajectory:
    """The trajectory in the folder of a run. Raises ValueError when there is none."""
    path = Path(run) / "trajectory.h5"
    if not path.exists():
        raise ValueError(f"'{run}' holds no trajectory.h5; give the folder that `warmslip run` wrote")
    return Trajectory(path)


def contact_at(t: Trajectory, d: Discretisation, number: int) -> dict[str, Array]:
    """Contact fields of a stored state, see `contact_fields`, displacement and `geometry` of the points; empty without points."""
    step = t.step_of(number)
    if step < 0 or not len(d.surface.weights):
        return {}
    force, moved, status, gap = (
        np.asarray(t.contact(name, step)) for name in ("force", "displacement", "status", "gap")
    )
    return contact_fields(d, force, moved, status, gap) | {"displacement": moved} | geometry(d)


def export(
    run: str | Path,
    out: str | Path,
    *,
    fields: Collection[str] = FIELDS,
    times: Sequence[float] | None = None,
    form: str = "vtu",
    progress: Callable[[int, int], None] | None = None,
    warn: Callable[[str], None] = log.warning,
) -> int:
    """Writes a stored run for ParaView and as tables. The files of an earlier series in `out` are removed.

    Parameters
    ----------
    run : str or Path
        The folder of `warmslip run`.
    out : str or Path
        The folder to write. With `form` "vtu": body.pvd with body_NNNN.vtu (displacement, velocity, temperature at the nodes;
        stress, von Mises stress and region of the cells), contact.pvd with contact_NNNN.vtu (the contact parts as lines or
        triangles: pressure, friction traction on the body, gap, slip, status, normal, arc length in the plane, number of the
        contact table). With "vtkhdf": all states in body.vtkhdf and contact.vtkhdf. With Gauss quadrature the fields of contact
        are means over facets, and contact_points has the contact points. In addition
        series.csv (resultants, also of every contact part, and balances of every step), and reactions.csv (force and moment
        of every support, resultants of the contact parts and heat flows of every step), where there are any.
    fields : collection of str
        The fields that are written; all by default.
    times : sequence of float, optional
        The stored states nearest to these times; all by default.
    form : str
        "vtu" or "vtkhdf".
    progress : function, optional
        Called with the numbers of states that are written and that there are.
    warn : function
        Called with a sentence for a chosen field that the run does not have, and for a time at which no state is stored.

    Returns
    -------
    int
        The number of states.

    Raises
    ------
    ValueError
        For what is no run, an unknown field or form, fields none of which the run has, or a time beyond the run.
    OSError
        When a file cannot be written.
    """
    if isinstance(fields, str) or isinstance(times, str | float | int):
        name, given = ("fields", fields) if isinstance(fields, str) else ("times", times)
        raise TypeError(f"{name}: {given!r} is no list; write [{given!r}]")
    if form not in FORMS:
        raise ValueError(f"there is no form '{form}'; give {' or '.join(FORMS)}")
    for name in fields:
        if name not in FIELDS:
            near = difflib.get_close_matches(name, FIELDS, 1)
            raise ValueError(
                f"there is no field '{name}'; "
                + (f"did you mean '{near[0]}'?" if near else f"give one of {', '.join(FIELDS)}")
            )
    folder = Path(out)
    with opened(run) as t:
        d = t.discretisation()
        chosen = range(len(t.time)) if times is None else sorted({state_number(t.time, time) for time in times})
        if set(fields) != set(FIELDS):  # all that there are
            fields = _there(t, d, fields, warn)
        for time in times or []:
            taken = float(t.time[state_number(t.time, time)])
            if abs(taken - time) > 1e-9 * d.scene.time.end:
                warn(f"no state is stored at t = {time:g}; the nearest, at t = {taken:g}, is taken")
        folder.mkdir(parents=True, exist_ok=True)
        for earlier in folder.iterdir():
            if OWN.fullmatch(earlier.name):
                earlier.unlink()
        _series(t, d, folder / "series.csv")
        write_table(t, d, folder / "reactions.csv")
        with (HdfSeries if form == "vtkhdf" else VtuSeries)(folder, d) as series:
            for done, i in enumerate(chosen, start=1):
                if set(fields) & set(BODY):
                    u, w, theta = (None if one is None else np.asarray(one[i]) for one in (t.u, t.w, t.theta))
                    series.body(i, float(t.time[i]), *body_fields(d, u, w, theta, fields))
                touching = {name: three(v) for name, v in contact_at(t, d, i).items() if name in fields}
                if touching:
                    series.contact(i, float(t.time[i]), touching)
                if progress:
                    progress(done, len(chosen))
    return len(chosen)


def _there(t: Trajectory, d: Discretisation, fields: Collection[str], warn: Callable[[str], None]) -> list[str]:
    """The fields that the run has; says which it does not have. Raises ValueError when it has none of them."""
    there = {
        **dict.fromkeys(("displacement", "velocity", "stress", "von Mises"), t.u is not None),
        "temperature": t.theta is not None,
        "region": len(d.scene.regions) > 0,
        **dict.fromkeys(CONTACT, len(d.surface.weights) > 0),
    }
    there["arc length"] &= d.dim == 2
    missing = [name for name in fields if not there[name]]
    has = ", ".join(name for name in FIELDS if there[name])
    if missing and len(missing) == len(fields):
        raise ValueError(f"the run has no {', '.join(missing)}; choose from {has}")
    for name in missing:
        warn(f"the run has no {name}, which is left out; it has {has}")
    return [name for name in fields if there[name]]


def _series(t: Trajectory, d: Discretisation, path: Path) -> None:
    steps, balances = t.series("steps"), t.series("balances")
    friction = steps["friction_traction"]
    columns = {"time": steps["time"]} | {name: steps[name] for name in STEPS}
    columns |= {f"friction_{axis}": friction[:, i] for i, axis in enumerate("xyz"[: friction.shape[1]])}
    if len(d.surface.weights):
        columns |= resultants(d, t.series("contact")["force"])
    columns |= balances
    tables.write(
        path, (dict(zip(columns, map(float, row), strict=True)) for row in zip(*columns.values(), strict=True))
    )
