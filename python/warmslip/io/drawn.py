"""A stored run as what the figures draw: a state, the contact parts, the time series."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from warmslip.figures import run as drawings
from warmslip.figures.contact import ContactLine
from warmslip.figures.run import Body
from warmslip.io.paraview import contact_at
from warmslip.io.part_series import columns
from warmslip.io.trajectory import Trajectory
from warmslip.model.discretisation import Discretisation
from warmslip.model.state import resultants
from warmslip.typing import Array

ENERGIES = ("kinetic", "elastic", "contact")
LOSSES = ("viscous", "friction")
HEATS = ("conducted", "exchanged", "supplied", "heating", "friction_heating")
RESIDUALS = ("energy_residual", "heat_residual", "force_residual", "law_residual")


def body(t: Trajectory, d: Discretisation, number: int) -> Body:
    """A stored state as something to draw; a body in space by its surface."""
    u, w, theta = (None if one is None else np.asarray(one[number]) for one in (t.u, t.w, t.theta))
    nodes, cells = np.asarray(d.mesh.nodes), np.asarray(d.mesh.cells)
    triangles, of_cell = (cells, np.arange(len(cells))) if d.dim == 2 else surface(cells)
    fields: dict[str, Array] = {}
    if u is not None:
        fields |= {
            "displacement": np.linalg.norm(u, axis=1),
            "von Mises stress": d.mises_of(u, w, theta)[of_cell],
        }
    if theta is not None:
        fields["temperature"] = theta
    touching = contact_at(t, d, number)
    points = np.asarray(d.surface.positions) if touching else np.empty((0, d.dim))
    return Body(
        time=float(t.time[number]),
        nodes=nodes,
        triangles=triangles,
        u=np.zeros_like(nodes) if u is None else u,
        fields=fields,
        points=points,
        moved=touching["displacement"] if touching else points,
        status=touching["status"] if touching else np.empty(0),
    )


def surface(cells: Any) -> tuple[Any, Any]:
    """Facets of tetrahedra that belong to one alone, and to which: (facets, 3), (facets,)."""
    facets = np.concatenate([np.delete(cells, i, axis=1) for i in range(4)])
    _, first, count = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True)
    alone = first[count == 1]
    return facets[alone], alone % len(cells)


def magnification(t: Trajectory, d: Discretisation) -> float:
    """Factor by which displacements are drawn, the same for all states; dimensionless."""
    if t.u is None:
        return 1.0
    largest = max(float(np.abs(np.asarray(t.u[i])).max()) for i in range(len(t.time)))
    return drawings.magnification(largest, float(np.ptp(np.asarray(d.mesh.nodes), axis=0).min()))


def parts(t: Trajectory, number: int) -> dict[str, dict[str, Array]]:
    """Contact fields by part, with a position; vectors as their component along the part, or in space their length."""
    found: dict[str, dict[str, Array]] = {}
    if t.step_of(number) < 0:
        return found
    for name in t.contact_parts:
        at = t.contact_on(name, float(t.time[number]))
        vectors = {"friction traction": at.traction, "slip": at.slip}
        if at.arc_length is None:
            vectors = {key: np.linalg.norm(values, axis=1) for key, values in vectors.items()}
            flat = np.argsort(-np.ptp(at.positions, axis=0), kind="stable")[:2]
        position = at.positions[:, np.sort(flat)] if at.arc_length is None else at.arc_length
        found[name] = {"pressure": at.pressure, "gap": at.gap, "status": at.status, "position": position} | vectors
    return found


def line(t: Trajectory, part: str | None = None) -> ContactLine:
    """A contact part in all steps as something to draw. Raises ValueError for a body in space, and as `contact_history`."""
    at = t.contact_history(part)
    if at.arc_length is None:
        raise ValueError(
            "the contact of a body in space is no line; draw it with `warmslip view`, or open it in ParaView"
        )
    return ContactLine(
        part=at.part,
        time=at.time,
        arc_length=at.arc_length,
        weights=at.weights,
        pressure=at.pressure,
        traction=at.traction,
        slip=at.slip,
        status=at.status,
        bound=at.friction_bound,
        temperature=at.temperature,
    )


def lines(path: Path, *, told: bool = False) -> list[ContactLine]:
    """Every contact part of a stored run, given by its file or its folder, which is `told`. Raises ValueError, OSError."""
    file = path / "trajectory.h5" if path.is_dir() else path
    with Trajectory(file) as t:
        if not t.contact_parts:
            raise ValueError("the run has no contact points")
        return [replace(line(t, part), run=file.resolve().parent.name if told else "") for part in t.contact_parts]


def history(t: Trajectory, d: Discretisation) -> dict[str, dict[str, Array]]:
    """The time series of a run in groups."""
    steps, balances = t.series("steps"), t.series("balances")

    def chosen(names: tuple[str, ...], total: bool = False) -> dict[str, Array]:
        kept = {
            name.removesuffix("_residual").replace("_", " "): balances[name] for name in names if balances[name].any()
        }
        return {name: np.cumsum(values) for name, values in kept.items()} if total else kept

    panels: dict[str, dict[str, Array]] = {}
    if len(d.surface.weights):
        forces = resultants(d, t.series("contact")["force"])
        largest = max(float(np.abs(values).max()) for values in forces.values())
        panels["contact forces"] = {
            name.replace("_", " "): values for name, values in forces.items() if np.abs(values).max() > 1e-12 * largest
        }
        panels["contact points"] = {name: steps[name] for name in ("open", "stick", "slip")}
    panels |= _of_parts(t)
    panels["energy"] = chosen(ENERGIES)
    panels["work lost since the start"] = chosen(LOSSES, total=True)
    panels["heat since the start, tested with the temperature"] = chosen(HEATS, total=True)
    panels["residuals"] = chosen(RESIDUALS)
    return {title: series for title, series in panels.items() if series}


def _of_parts(t: Trajectory) -> dict[str, dict[str, Array]]:
    """Forces of the supports and heat flows of the parts, those that are not 0."""
    series = columns(t.reactions, t.heat_flows)
    panels = {}
    for title, start in (("forces of supports", "force_"), ("heat into the body, per time", "heat ")):
        lines = {name.removeprefix(start): values for name, values in series.items() if name.startswith(start)}
        largest = max((float(np.abs(values).max(initial=0.0)) for values in lines.values()), default=0.0)
        panels[title] = {name: v for name, v in lines.items() if np.abs(v).max(initial=0.0) > 1e-12 * largest}
    return panels
