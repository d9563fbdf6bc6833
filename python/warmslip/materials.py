"""From the tables of a scene to the core's values: mesh, materials by region, contact parts."""

from __future__ import annotations

from typing import Any

import numpy as np

from warmslip import _core, mesh_files
from warmslip.expressions import Expression
from warmslip.laws import Watched
from warmslip.loads import Array
from warmslip.refinement import refined
from warmslip.scene import Scene
from warmslip.tables import ContactTable, IsotropicTable, MeshTable, RegionTable

COUPLINGS = ("expansion", "heating")


def of_dim(name: str, dim: int) -> Any:
    return getattr(_core, f"{name}{dim}")


def mandel(table: IsotropicTable, dim: int) -> Array:
    """The tensor of a table in Mandel form, (3, 3) or (6, 6): lambda tr(e) I + 2 mu e, or the full one."""
    if table.tensor is not None:
        shear = np.concatenate([np.ones(dim), np.full(dim * (dim - 1) // 2, np.sqrt(2))])
        return np.asarray(np.array(table.tensor) * np.outer(shear, shear))
    lam, mu = table.pair(dim)
    tensor = 2 * mu * np.eye(dim * (dim + 1) // 2)
    tensor[:dim, :dim] += lam
    return tensor


def _matrix(value: Any, dim: int) -> Array:
    return np.array(value, dtype=float) if isinstance(value, list) else value * np.eye(dim)


def _read(table: MeshTable) -> mesh_files.MeshFile:
    return refined(mesh_files.read(str(table.file)), table.refine)


def make_mesh(scene: Scene) -> Any:
    """The scene's mesh as a `_core.Mesh2` or `_core.Mesh3`."""
    table = scene.mesh
    kind = of_dim("Mesh", table.dim)
    if table.file is not None:
        read = _read(table)
        return kind.from_lists(read.nodes, read.cells, read.parts)
    mesh = kind.box(table.counts, table.sides, getattr(_core.Diagonal, table.diagonal))
    if table.grading is None:
        return mesh
    nodes = np.array(mesh.nodes)
    for axis, (ratio, length) in enumerate(zip(table.grading, table.sides, strict=True)):
        if ratio != 1:  # a geometric row of bricks; halving them keeps meshes nested
            with np.errstate(over="ignore", invalid="ignore"):  # the mesh refuses what is not finite
                nodes[:, axis] = length * np.expm1(np.log(ratio) * nodes[:, axis] / length) / (ratio - 1)
    return kind.from_lists(nodes, mesh.cells, {name: np.array(facets) for name, facets in mesh.parts.items()})


def materials(scene: Scene, mesh: Any) -> tuple[list[Any], Any]:
    """One `_core.Material` for the body and each region, and the number of that of every cell (empty without regions)."""
    d = scene.mesh.dim

    def material(region: RegionTable | None) -> Any:
        def table(name: str) -> Any:
            return getattr(region, name, None) or getattr(scene, name)

        inertia, heat = table("inertia"), table("heat")
        coupling = {name: getattr(heat, name, None) or getattr(scene.heat, name, None) for name in COUPLINGS}
        return of_dim("Material", d)(
            density=inertia.density if inertia is not None else 0.0,
            **{
                name: mandel(table(name), d) if table(name) is not None else None
                for name in ("elasticity", "viscosity")
            },
            conductivity=_matrix(heat.conductivity, d) if heat is not None else None,
            **{name: _matrix(value.tensor, d) if value is not None else None for name, value in coupling.items()},
            capacity=heat.capacity if heat is not None else 1.0,
        )

    return [material(None), *(material(region) for region in scene.regions.values())], cell_regions(
        scene, mesh
    ).tolist()


def cell_regions(scene: Scene, mesh: Any) -> Any:
    """The number of the region of every cell, in the order of the scene, 0 for the rest: (cells,), or () without regions.

    Raises ValueError for a region without cells.
    """
    if not scene.regions:
        return np.empty(0, dtype=int)
    numbers = np.zeros(len(mesh.cells), dtype=int)
    centroids = np.asarray(mesh.nodes)[np.asarray(mesh.cells)].mean(axis=1)
    for i, (name, region) in enumerate(scene.regions.items(), start=1):
        if region.where is None:
            cells = _read(scene.mesh).regions[name]
        else:
            cells = np.flatnonzero(Expression(region.where)(centroids, 0.0))
        if len(cells) == 0:
            raise ValueError(f"regions.{name}: no cell lies in it; correct its `where`")
        numbers[cells] = i
    return numbers


def contact_part(contact: ContactTable, own: Watched | None = None) -> Any:
    """A contact table as a `_core.ContactPart`, with functions of one's `own` in the place of its laws."""
    law, friction, exchange = None, contact.friction, contact.heat_exchange
    own = own or Watched()
    if contact.stiffness is not None:
        compliance = _core.NormalCompliance(
            stiffness=contact.compliance,
            exponent=contact.exponent,
            most=np.inf if contact.pressure_limit is None else contact.pressure_limit,
            custom=own.compliance,
        )
        bound = _core.Friction(
            coefficient=friction.coefficient if friction else 0.0,
            cohesion=friction.cohesion if friction else 0.0,
            limit=np.inf if friction is None or friction.limit is None else friction.limit,
            kinetic=(friction and friction.kinetic) or 0.0,
            speed=(friction and friction.speed) or 0.0,
            regularisation=(friction and friction.regularisation) or 0.0,
            custom=own.friction,
        )
        law = _core.ContactLaw(compliance=compliance, friction=bound)
    return _core.ContactPart(
        part=contact.part,
        law=law,
        quadrature=contact.points,
        conductance=exchange.conductance if exchange else 0.0,
        per_pressure=exchange.per_pressure if exchange else 0.0,
        friction_share=contact.friction_heating.share if contact.friction_heating else 0.0,
    )
