"""A scene before it runs, as something to draw."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip.figures.scene import SceneSketch
from warmslip.io.drawn import surface
from warmslip.mesh.part_points import arc_length
from warmslip.model.discretisation import Discretisation, discretise
from warmslip.model.loads import data, evaluate
from warmslip.scene.roles import roles
from warmslip.scene.scene import Scene


def sketch(scene: Scene) -> SceneSketch:
    """The parts of a scene with what happens on them, on one process.

    Raises
    ------
    ValueError
        For what a run would refuse.
    """
    from mpi4py import MPI

    d = discretise(scene, comm=MPI.COMM_SELF)
    nodes, cells = np.asarray(d.mesh.nodes), np.asarray(d.mesh.cells)
    facets = {part: np.asarray(found) for part, found in d.mesh.parts.items()}
    tractions = []
    for part, value in scene.loads.traction.items():
        places = nodes[facets[part]].mean(axis=1)
        tractions.append((places, evaluate(data(value), places, scene.time.end, d.dim, f"loads.traction.{part}")))
    return SceneSketch(
        nodes=nodes,
        triangles=cells if d.dim == 2 else surface(cells)[0],
        parts=facets,
        roles=roles(scene),
        tractions=tractions,
        foundations=_foundations(d) if d.dim == 2 else [],
        points=np.array([point.at for point in scene.supports.points or []]).reshape(-1, d.dim),
    )


def _foundations(d: Discretisation) -> list[Any]:
    """Where the foundation is at t = 0, by contact part: points (n, 2) along the part."""
    of_part, out = np.asarray(d.surface.contacts, dtype=int), []
    x, normals, gap = (
        np.asarray(d.surface.positions),
        np.asarray(d.surface.normals),
        d.load_vectors.on_points("gap", 0.0),
    )
    for i in np.unique(of_part):
        on = of_part == i
        length, _ = arc_length(np.asarray(d.mesh.nodes), np.asarray(d.mesh.parts[d.scene.contacts[i].part]), x[on])
        out.append((x[on] + gap[on, None] * normals[on])[np.argsort(length, kind="stable")])
    return out
