"""A stored run to look at: figures, an animation, and one page with everything that is known of it."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import tomli_w

from warmslip.figures import run as drawings
from warmslip.figures import style
from warmslip.figures.error import error as error_bars
from warmslip.figures.run import Array, Body
from warmslip.io.paraview import contact_at, opened, state_number
from warmslip.io.part_series import columns
from warmslip.io.trajectory import Trajectory
from warmslip.model.arc_length import arc_length
from warmslip.model.discretisation import Discretisation
from warmslip.model.state import resultants
from warmslip.scene import plan
from warmslip.scene.reader import build

ENERGIES = ("kinetic", "elastic", "contact")
LOSSES = ("viscous", "friction")
HEATS = ("conducted", "exchanged", "supplied", "heating", "friction_heating")
RESIDUALS = ("energy_residual", "heat_residual", "force_residual", "law_residual")
FRAMES = 40


def view(
    run: str | Path,
    out: str | Path,
    *,
    at: float | None = None,
    animate: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Draws what the folder `run` of `warmslip run` holds into `out`: the files written.

    body.png (deformed, a panel a field) and contact.png at the stored state nearest to time `at` (default: the last one),
    history.png, animation.gif of at most 40 states, and report.html, one page with all of it that needs no other file. Raises
    ValueError for what holds no run, OSError for what cannot be written.
    """
    folder = Path(out)
    with opened(run) as t, style.applied():
        d, functions = t.discretisation(), t.functions
        folder.mkdir(parents=True, exist_ok=True)
        here = state_number(t, at)
        found: dict[str, tuple[Any, str]] = {}
        last = body(t, d, here)
        factor = magnification(t, d)
        if last.fields:
            found["body"] = drawings.bodies(last, factor)
        if parts := _parts(t, d, here):
            found["contact"] = drawings.contact(parts, last.time)
        if len(t.series("steps")["time"]):
            found["history"] = drawings.history(t.series("steps")["time"], _history(t, d))
        if (Path(run) / "error.csv").exists():
            found["error"] = error_bars([Path(run) / "error.csv"])
        files = []
        for name, (figure, caption) in found.items():
            style.save(figure, caption, folder / f"{name}.png")
            files.append(folder / f"{name}.png")
        if animate and last.fields and len(t.time) > 1:
            chosen = np.unique(np.linspace(0, len(t.time) - 1, min(FRAMES, len(t.time))).round().astype(int))
            name = next(n for n in ("temperature", "von Mises stress", "displacement") if n in last.fields)
            states = [body(t, d, int(i)) for i in chosen]
            drawings.animation(states, name, factor, folder / "animation.gif", progress)
            (folder / "animation.rst").write_text(f"{name} on the deformed body, {len(chosen)} states.\n")
            files.append(folder / "animation.gif")
    page = folder / "report.html"
    page.write_text(_page(Path(run), t.scene, functions, files))
    return [*files, page]


def body(t: Trajectory, d: Discretisation, number: int) -> Body:
    """A stored state as something to draw; a body in space by its surface."""
    u, w, theta = (None if one is None else np.asarray(one[number]) for one in (t.u, t.w, t.theta))
    nodes, cells = np.asarray(d.mesh.nodes), np.asarray(d.mesh.cells)
    triangles, of_cell = (cells, np.arange(len(cells))) if d.dim == 2 else _surface(cells)
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


def _surface(cells: Any) -> tuple[Any, Any]:
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


def _parts(t: Trajectory, d: Discretisation, number: int) -> dict[str, dict[str, Array]]:
    """Contact fields by part, with a position; vectors as their component along the part, or in space their length."""
    touching = contact_at(t, d, number)
    if not touching:
        return {}
    x, normals = np.asarray(d.surface.positions), np.asarray(d.surface.normals)
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    of_part, found = np.asarray(d.surface.contacts, dtype=int), {}
    for part in np.unique(of_part):
        on = of_part == part
        fields = {}
        for name in ("pressure", "friction traction", "gap", "slip", "status"):
            values = touching[name][on]
            if values.ndim == 2:
                values = np.sum(values * tangents[on], axis=1) if d.dim == 2 else np.linalg.norm(values, axis=1)
            fields[name] = values
        name = d.scene.contacts[part].part
        if d.dim == 2:
            position = arc_length(np.asarray(d.mesh.nodes), np.asarray(d.mesh.parts[name]), x[on])
            order = np.argsort(position, kind="stable")
            fields = {key: values[order] for key, values in fields.items()} | {"position": position[order]}
        else:
            flat = np.argsort(-np.ptp(x[on], axis=0), kind="stable")[:2]
            fields["position"] = x[on][:, np.sort(flat)]
        found[name] = fields
    return found


def _history(t: Trajectory, d: Discretisation) -> dict[str, dict[str, Array]]:
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


def _page(run: Path, scene: dict[str, Any], functions: list[str], files: list[Path]) -> str:
    """The report; a run that was killed has no summary."""
    summary_file = run / "summary.json"
    summary = json.loads(summary_file.read_text()) if summary_file.exists() else None
    images = [
        (base64.b64encode(path.read_bytes()).decode(), path.suffix[1:], path.with_suffix(".rst").read_text())
        for path in files
    ]
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("warmslip.report", "templates"), autoescape=True, undefined=jinja2.StrictUndefined
    )
    return environment.get_template("report.html").render(
        scene=scene,
        functions=functions,
        summary=summary,
        images=images,
        plan=plan.text(plan.plan(build(scene))),
        toml=tomli_w.dumps(scene),
    )
