"""From the tables of a scene to the core's values: materials by region, contact parts."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from warmslip._core import ContactLaw, ContactPart, Friction, NormalCompliance
from warmslip.mesh import files
from warmslip.mesh.refinement import refined
from warmslip.model.contact_laws import CheckedLaw
from warmslip.scene.contact_tables import ContactTable
from warmslip.scene.expressions import Expression
from warmslip.scene.material_tables import IsotropicTable, RegionTable
from warmslip.scene.mesh_table import MeshTable
from warmslip.scene.scene import Scene
from warmslip.scene.validation import coupling_tables
from warmslip.typing import Array


def of_dim(name: str, dim: int) -> Any:
    """The compiled class or function of a dimension: `Mesh` and 2 give `Mesh2`."""
    return getattr(importlib.import_module("warmslip._core"), f"{name}{dim}")


def mandel(table: IsotropicTable, dim: int) -> Array:
    """The tensor of a table in Mandel form, (3, 3) or (6, 6): lambda tr(e) I + 2 mu e, or the full one."""
    if table.tensor is not None:
        shear = np.concatenate([np.ones(dim), np.full(dim * (dim - 1) // 2, np.sqrt(2))])
        return np.asarray(np.array(table.tensor) * np.outer(shear, shear))
    lam, mu = table.pair(dim)
    tensor = 2 * mu * np.eye(dim * (dim + 1) // 2)
    tensor[:dim, :dim] += lam
    return tensor


def out_of_plane(
    elasticity: IsotropicTable | None, viscosity: IsotropicTable | None, expansion: Array | None
) -> tuple[float, float, float]:
    """What tr eps(u), tr eps(w) and minus the warming are multiplied by in sigma_zz: all 0 unless in plane strain.

    A Lame pair without an assumption follows the other tensor. M_zz is taken to be the mean of M_xx and M_yy, which is M where it
    is a number. Of a full tensor sigma_zz is not known, and 0.
    """
    tables = [table for table in (elasticity, viscosity) if table is not None]
    if not any(table.strained for table in tables) or any(table.tensor is not None for table in tables):
        return 0.0, 0.0, 0.0
    lam = [
        table.pair(2)[0] if table is not None and table.assumption != "plane_stress" else 0.0
        for table in (elasticity, viscosity)
    ]
    return lam[0], lam[1], float(np.trace(expansion)) / 2 if expansion is not None else 0.0


def couplings(scene: Scene, region: RegionTable | None) -> tuple[Array | None, Array | None, float]:
    """M and R of the body or of a region, (d, d), and the temperature without thermal stress; None for what is absent."""
    d = scene.mesh.dim
    expansion, heating, reference = coupling_tables(scene, region)
    stress: Array | None = None
    if expansion is not None and expansion.alpha is not None:
        elasticity = (region and region.elasticity) or scene.elasticity
        assert elasticity is not None
        stress = expansion.alpha * elasticity.per_expansion(d) * np.eye(d)
    elif expansion is not None:
        stress = _matrix(expansion.tensor, d)
    if heating is None:
        return stress, None, reference
    if heating.thermodynamic:
        assert stress is not None
        return stress, -reference * stress, reference
    return stress, _matrix(heating.tensor, d), reference


def _matrix(value: Any, dim: int) -> Array:
    return np.array(value, dtype=float) if isinstance(value, list) else value * np.eye(dim)


def _read(table: MeshTable) -> files.MeshFile:
    return refined(files.read(str(table.file)), table.refine)


def materials(scene: Scene, mesh: Any) -> tuple[list[Any], Any]:
    """One `_core.Material` for the body and each region, and the number of that of every cell (empty without regions)."""
    d = scene.mesh.dim

    def material(region: RegionTable | None) -> Any:
        def table(name: str) -> Any:
            return getattr(region, name, None) or getattr(scene, name)

        inertia, heat = table("inertia"), table("heat")
        expansion, heating, reference = couplings(scene, region)
        zz = out_of_plane(table("elasticity"), table("viscosity"), expansion)
        return of_dim("Material", d)(
            density=inertia.density if inertia is not None else 0.0,
            **{
                name: mandel(table(name), d) if table(name) is not None else None
                for name in ("elasticity", "viscosity")
            },
            conductivity=_matrix(heat.conductivity, d) if heat is not None else None,
            expansion=expansion,
            heating=heating,
            capacity=getattr(heat, "capacity", None) or (scene.heat.capacity if scene.heat is not None else 1.0),
            reference=reference,
            out_of_plane=zz if d == 2 else (0.0, 0.0, 0.0),
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


def contact_part(contact: ContactTable, own: CheckedLaw | None = None) -> Any:
    """A contact table as a `_core.ContactPart`, with functions of one's `own` in the place of its laws."""
    law, friction, exchange = None, contact.friction, contact.heat_exchange
    own = own or CheckedLaw()
    if contact.stiffness is not None:
        compliance = NormalCompliance(
            stiffness=contact.compliance,
            exponent=contact.exponent,
            pressure_limit=np.inf if contact.pressure_limit is None else contact.pressure_limit,
            custom=own.compliance,
        )
        bound = Friction(
            coefficient=friction.coefficient if friction else 0.0,
            cohesion=friction.cohesion if friction else 0.0,
            limit=np.inf if friction is None or friction.limit is None else friction.limit,
            kinetic=(friction and friction.kinetic) or 0.0,
            speed=(friction and friction.speed) or 0.0,
            regularisation=(friction and friction.regularisation) or 0.0,
            custom=own.friction,
        )
        law = ContactLaw(compliance=compliance, friction=bound)
    return ContactPart(
        part=contact.part,
        law=law,
        quadrature=contact.points,
        conductance=exchange.conductance if exchange else 0.0,
        per_pressure=exchange.per_pressure if exchange else 0.0,
        share=contact.friction_heating.share if contact.friction_heating else 0.0,
    )
