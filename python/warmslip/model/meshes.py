"""The mesh of a scene: a box, a file, or either refined towards its graded places."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip._core import Diagonal
from warmslip.mesh import files
from warmslip.mesh.refinement import Grading, fraction, refined
from warmslip.model.corners import corners
from warmslip.model.materials import of_dim
from warmslip.scene.mesh_table import GradedTable, MeshTable
from warmslip.scene.scene import Scene

ELSEWHERE = 0.5  # exponent of a part or a point for which none is given


def coarsest(table: MeshTable) -> files.MeshFile:
    """The mesh that is refined to give a graded one."""
    if table.file is not None:
        return files.read(table.file)
    counts = [count // 2**table.halvings for count in table.counts]
    box = of_dim("Mesh", table.dim).box(counts, table.sides, getattr(Diagonal, table.diagonal))
    parts = {name: np.array(facets) for name, facets in box.parts.items()}
    return files.MeshFile(table.dim, np.array(box.nodes), np.array(box.cells), parts, {}, "")


def gradings(scene: Scene, mesh: Any) -> list[Grading]:
    """The graded places of a scene on its coarsest mesh.

    Raises
    ------
    ValueError
        For a point that is no node of the mesh, or corners of which none is singular.
    """
    out: list[Grading] = []
    for one in scene.mesh.gradings:
        if one.at == "corners":
            out += _corners(scene, mesh, one)
        elif isinstance(one.at, str):
            out.append(Grading(np.asarray(mesh.parts[one.at]), fraction(one.exponent or ELSEWHERE)))
        else:
            out.append(_point(scene, mesh, one))
    return out


def _corners(scene: Scene, mesh: Any, given: GradedTable) -> list[Grading]:
    places: dict[float, list[tuple[int, ...]]] = {}
    for corner in corners(scene, mesh):
        exponent = corner.exponent if given.exponent is None else given.exponent
        if exponent < 1:
            places.setdefault(exponent, []).append(corner.nodes)
    if not places and len(scene.mesh.gradings) == 1:
        raise ValueError(
            "mesh.graded_to: the solution is not singular at any corner; leave the key out, or name a place"
        )
    return [Grading(np.array(nodes), fraction(exponent)) for exponent, nodes in places.items()]


def _point(scene: Scene, mesh: Any, given: GradedTable) -> Grading:
    nodes = np.asarray(mesh.nodes)
    away = np.linalg.norm(nodes - np.array(given.at), axis=1)
    nearest = int(away.argmin())
    if away[nearest] > 1e-9 * np.ptp(nodes, axis=0).max():
        near = ", ".join(f"{x:.6g}" for x in nodes[nearest])
        raise ValueError(f"mesh.graded_to: {given.at} is no node of the coarsest mesh; the nearest one is [{near}]")
    found = [c.exponent for c in corners(scene, mesh) if c.nodes == (nearest,) and c.exponent < 1]
    exponent = given.exponent or min(found, default=ELSEWHERE)
    return Grading(np.array([[nearest]]), fraction(exponent))


def make_mesh(scene: Scene) -> Any:
    """The scene's mesh as a `_core.Mesh2` or `_core.Mesh3`."""
    table = scene.mesh
    kind = of_dim("Mesh", table.dim)
    if table.file is not None or table.graded_to:
        found = refined(start := coarsest(table), table.halvings, gradings(scene, start))
        return kind.from_lists(found.nodes, found.cells, found.parts)
    mesh = kind.box(table.counts, table.sides, getattr(Diagonal, table.diagonal))
    if table.grading is None:
        return mesh
    nodes = np.array(mesh.nodes)
    for axis, (ratio, length) in enumerate(zip(table.grading, table.sides, strict=True)):
        if ratio != 1:  # a geometric row of cells, of which twice as many have all its nodes
            with np.errstate(over="ignore", invalid="ignore"):  # the mesh refuses what is not finite
                nodes[:, axis] = length * np.expm1(np.log(ratio) * nodes[:, axis] / length) / (ratio - 1)
    return kind.from_lists(nodes, mesh.cells, {name: np.array(facets) for name, facets in mesh.parts.items()})
