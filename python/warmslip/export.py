"""A stored run for other programs: a series of VTU files that ParaView opens, and its time series as CSV."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np

from warmslip.loads import Array
from warmslip.mesh_io import write_vtu
from warmslip.problem import Discretisation, discretise
from warmslip.scene import Scene, build
from warmslip.state import contact_fields
from warmslip.trajectory import Trajectory

STEPS = ("newton_iterations", "open", "stick", "slip", "max_penetration", "normal_force")


def export(
    run: str | Path, out: str | Path, *, progress: Callable[[int, int], None] | None = None
) -> tuple[int, Scene]:
    """Writes what the folder `run` of `warmslip run` holds to the folder `out`; the number of states and the scene.

    body.pvd and body_NNNN.vtu: displacement, velocity, temperature at the nodes, stress and von Mises stress of the cells;
    contact.pvd and contact_NNNN.vtu, a point each: pressure, friction traction on the body, gap, slip, status;
    series.csv: resultants and ledger of every step. Raises OSError for what is no run or cannot be written.
    """
    if not (Path(run) / "trajectory.h5").exists():
        raise ValueError(f"'{run}' holds no trajectory.h5; give the folder that `warmslip run` wrote")
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    with Trajectory(Path(run) / "trajectory.h5") as t:
        scene = build(t.scene)
        d = discretise(scene)
        _series(t, folder / "series.csv")
        times = t.time
        touching = t.series("contact") if len(d.surface.weights) and len(t.series("steps")["time"]) else {}
        files: list[tuple[float, str]] = []
        points: list[tuple[float, str]] = []
        for i, time in enumerate(times):
            u, w, theta = (None if one is None else np.asarray(one[i]) for one in (t.u, t.w, t.theta))
            write_vtu(folder / f"body_{i:04d}.vtu", d, u, w, theta)
            files.append((float(time), f"body_{i:04d}.vtu"))
            step = round(float(time) / scene.step) - 1
            if touching and step >= 0:
                _contact(folder / f"contact_{i:04d}.vtu", d, touching, step, float(time))
                points.append((float(time), f"contact_{i:04d}.vtu"))
            if progress:
                progress(i + 1, len(times))
        _pvd(folder / "body.pvd", files)
        if points:
            _pvd(folder / "contact.pvd", points)
    return len(times), scene


def _three(values: Array) -> Array:
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1]))) if values.ndim == 2 else values


def _contact(path: Path, d: Discretisation, touching: dict[str, Array], step: int, time: float) -> None:
    force, displacement, status = (touching[name][step] for name in ("force", "displacement", "status"))
    fields = contact_fields(d, force, displacement, status, time)
    x = _three(np.asarray(d.surface.positions))
    meshio.Mesh(
        x,
        [("vertex", np.arange(len(x))[:, None])],
        point_data={name: _three(values) for name, values in fields.items()},
    ).write(path)


def _pvd(path: Path, files: list[tuple[float, str]]) -> None:
    lines = [f'    <DataSet timestep="{time:.17g}" file="{name}"/>' for time, name in files]
    body = "\n".join(lines)
    path.write_text(
        f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n{body}\n  </Collection>\n</VTKFile>\n'
    )


def _series(t: Trajectory, path: Path) -> None:
    steps, ledger = t.series("steps"), t.series("ledger")
    friction = steps["friction_traction"]
    columns = {"time": steps["time"]} | {name: steps[name] for name in STEPS}
    columns |= {f"friction_{axis}": friction[:, i] for i, axis in enumerate("xyz"[: friction.shape[1]])} | ledger
    with path.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        out.writerows([f"{value:.17g}" for value in row] for row in zip(*columns.values(), strict=True))
