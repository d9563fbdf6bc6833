"""Meshes that gmsh's own library makes, with all that its groups can be, and those that are refused with their sentences."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gmsh
import numpy as np

SIZE = 0.4


def plate() -> list[int]:
    """Two squares beside each other, x up to 2 and y up to 1: curves 1, 2 below, 4, 5 above, 7 between them."""
    geo = gmsh.model.geo
    for x, y in ((0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1)):
        geo.addPoint(x, y, 0, SIZE)
    for i in range(6):
        geo.addLine(i + 1, (i + 1) % 6 + 1)
    geo.addLine(2, 5)
    surfaces = [geo.addPlaneSurface([geo.addCurveLoop(loop)]) for loop in ([1, 7, 5, 6], [2, 3, 4, -7])]
    geo.synchronize()
    return surfaces


def block() -> list[int]:
    """Two cubes beside each other; surfaces by their places."""
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.addBox(1, 0, 0, 1, 1, 1)
    gmsh.model.occ.fragment([(3, 1)], [(3, 2)])
    gmsh.model.occ.synchronize()
    return [tag for _, tag in gmsh.model.getEntities(3)]


def side(axis: int, value: float, dim: int = 2) -> list[int]:
    """The boundary entities in the plane x_axis = value."""
    low, high = [-1.0] * 3, [3.0] * 3
    low[axis], high[axis] = value - 1e-3, value + 1e-3
    return [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*low, *high, dim)]


def group(dim: int, entities: list[int], name: str = "", tag: int = -1) -> None:
    tag = gmsh.model.addPhysicalGroup(dim, entities, tag)
    if name:
        gmsh.model.setPhysicalName(dim, tag, name)


def named(surfaces: list[int]) -> None:
    group(1, [1, 2], "bottom", 11)
    group(1, [4, 5], "top", 12)
    group(2, surfaces, "body", 13)


def plain() -> None:
    named(plate())
    gmsh.model.mesh.generate(2)


def signed() -> None:
    surfaces = plate()
    group(1, [-1, 2], "bottom")
    group(1, [-4, -5], "top")
    group(2, [-surfaces[0], surfaces[1]], "body")
    gmsh.model.mesh.generate(2)


def overlapping() -> None:
    surfaces = plate()
    named(surfaces)
    group(1, [1, 3, 4], "some")
    group(2, surfaces[:1], "left half")
    gmsh.model.mesh.generate(2)


def one_name_twice() -> None:
    surfaces = plate()
    group(1, [1], "bottom", 31)
    group(1, [2], "bottom", 32)
    group(2, surfaces, "body", 13)
    gmsh.model.mesh.generate(2)


def unnamed() -> None:
    surfaces = plate()
    group(1, [1, 2], "", 7)
    group(1, [4, 5], "", 8)
    group(2, surfaces, "", 7)
    gmsh.model.mesh.generate(2)


def unnamed_body() -> None:
    surfaces = plate()
    group(1, [1, 2], "bottom")
    group(2, surfaces)
    gmsh.model.mesh.generate(2)


def no_groups() -> None:
    plate()
    gmsh.model.mesh.generate(2)


def partitioned() -> None:
    plain()
    gmsh.model.mesh.partition(3)


def partitioned_with_ghosts() -> None:
    gmsh.option.setNumber("Mesh.PartitionCreateGhostCells", 1)
    partitioned()


def partitioned_block() -> None:
    cubes()
    gmsh.model.mesh.partition(2)


def periodic() -> None:
    surfaces = plate()
    named(surfaces)
    gmsh.model.mesh.setPeriodic(1, [3], [6], [1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
    gmsh.model.mesh.generate(2)


def separate() -> list[int]:
    """Two squares that share no point, though they touch."""
    geo, surfaces = gmsh.model.geo, []
    for x in (0, 1):
        points = [geo.addPoint(x + i, j, 0, SIZE) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
        lines = [geo.addLine(points[i], points[(i + 1) % 4]) for i in range(4)]
        surfaces.append(geo.addPlaneSurface([geo.addCurveLoop(lines)]))
    geo.synchronize()
    group(1, [1, 5], "bottom")
    group(1, [2, 8], "between")
    group(2, surfaces, "body")
    gmsh.model.mesh.generate(2)
    return surfaces


def merged() -> None:
    separate()
    gmsh.model.mesh.removeDuplicateNodes()


def coincident() -> None:
    """The bottom is there twice, and its nodes are merged."""
    geo = gmsh.model.geo
    surfaces = plate()
    for x in (0, 1, 2):
        geo.addPoint(x, 0, 0, SIZE)
    geo.addLine(7, 8, 21)
    geo.addLine(8, 9, 22)
    geo.synchronize()
    group(1, [1, 2, 21, 22], "bottom")
    group(1, [4, 5], "top")
    group(2, surfaces, "body")
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.removeDuplicateNodes()


def embedded() -> None:
    surfaces = plate()
    geo = gmsh.model.geo
    geo.addPoint(0.5, 0.5, 0, SIZE, 20)
    geo.addPoint(1.3, 0.4, 0, SIZE, 21)
    geo.addPoint(1.7, 0.6, 0, SIZE, 22)
    geo.addLine(21, 22, 30)
    geo.synchronize()
    gmsh.model.mesh.embed(0, [20], 2, surfaces[0])
    gmsh.model.mesh.embed(1, [30], 2, surfaces[1])
    named(surfaces)
    group(0, [20], "point")
    group(1, [30], "crack")
    group(1, [7], "interface")
    gmsh.model.mesh.generate(2)


def senses() -> None:
    surfaces = plate()
    named(surfaces)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.reverse([(2, surfaces[0])])


def curved() -> None:
    """A quarter of a disc, whose arc has a centre that no cell has when another corner is rounded."""
    geo = gmsh.model.geo
    for x, y in ((0, 0), (2, 0), (2, 1), (0, 1), (2, 0.5), (1.5, 1), (1.5, 0.5)):
        geo.addPoint(x, y, 0, SIZE)
    for line in ((1, 2), (2, 5), (6, 4), (4, 1)):
        geo.addLine(*line)
    geo.addCircleArc(5, 7, 6, 9)
    surface = geo.addPlaneSurface([geo.addCurveLoop([1, 2, 9, 3, 4])])
    geo.synchronize()
    group(0, [7], "centre")
    group(1, [1], "bottom")
    group(1, [9], "arc")
    group(2, [surface], "body")
    gmsh.model.mesh.generate(2)


def parametric() -> None:
    gmsh.option.setNumber("Mesh.SaveParametric", 1)
    block_of_tetrahedra()


def second_order() -> None:
    plain()
    gmsh.model.mesh.setOrder(2)


def fourth_order() -> None:
    plain()
    gmsh.model.mesh.setOrder(4)


def quadrangles() -> None:
    gmsh.option.setNumber("Mesh.RecombineAll", 1)
    plain()


def quadrangles_of_second_order(incomplete: int = 0) -> None:
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    quadrangles()
    gmsh.model.mesh.setOrder(2)


def serendipity() -> None:
    quadrangles_of_second_order(1)


def mixed() -> None:
    surfaces = plate()
    named(surfaces)
    gmsh.model.mesh.setRecombine(2, surfaces[0])
    gmsh.model.mesh.generate(2)


def sparse_numbers() -> None:
    plain()
    tags, _, _ = gmsh.model.mesh.getNodes()
    gmsh.model.mesh.renumberNodes(tags, 1000 * tags[::-1])


def lifted() -> None:
    plain()
    gmsh.model.mesh.affineTransform([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.3])


def tilted() -> None:
    plain()
    gmsh.model.mesh.affineTransform([1, 0, 0, 0, 0, 0.8, 0, 0, 0, 0.6, 1, 0])


def noisy() -> None:
    plain()
    gmsh.model.mesh.affineTransform([1, 0, 0, 0, 0, 1, 0, 0, 1e-16, -1e-16, 1, 0])


def solid_groups(volumes: list[int]) -> None:
    group(2, side(2, 0.0), "bottom", 1)
    group(2, side(2, 1.0), "top", 2)
    group(3, volumes, "body", 3)


def cubes() -> None:
    solid_groups(block())
    gmsh.model.mesh.generate(3)


def block_of_tetrahedra() -> None:
    volumes = block()
    solid_groups(volumes)
    group(2, side(0, 1.0), "interface", 4)
    group(3, volumes[:1], "left half", 5)
    group(1, [1], "edge", 6)
    gmsh.model.mesh.generate(3)


def solids_of_second_order() -> None:
    cubes()
    gmsh.model.mesh.setOrder(2)


def surface_of_a_solid() -> None:
    solid_groups(block())
    gmsh.model.removePhysicalGroups([(3, 3)])
    gmsh.model.mesh.generate(2)


def extruded(recombine: bool, layers: bool = True) -> None:
    """The plate with a thickness of 1: hexahedra of quadrangles, or prisms of triangles."""
    surfaces = plate()
    if recombine:
        for surface in surfaces:
            gmsh.model.geo.mesh.setRecombine(2, surface)
    gmsh.model.geo.extrude([(2, s) for s in surfaces], 0, 0, 1, [3], recombine=True)
    gmsh.model.geo.synchronize()
    solid_groups([1, 2])
    group(2, side(1, 0.0), "front")
    gmsh.model.mesh.generate(3)


def hexahedra() -> None:
    extruded(True)


def prisms() -> None:
    extruded(False)


def hexahedra_of_second_order() -> None:
    extruded(True)
    gmsh.model.mesh.setOrder(2)


def prisms_of_second_order() -> None:
    extruded(False)
    gmsh.model.mesh.setOrder(2)


def pyramids() -> None:
    """A cube of six pyramids around its centre."""
    corners = np.array([[i, j, k] for k in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
    faces = [[1, 2, 3, 4], [5, 6, 7, 8], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [4, 1, 5, 8]]
    gmsh.model.addDiscreteEntity(3, 1)
    gmsh.model.addDiscreteEntity(2, 1)
    gmsh.model.mesh.addNodes(3, 1, range(1, 10), [*corners.ravel(), 0.5, 0.5, 0.5])
    gmsh.model.mesh.addElementsByType(1, 7, range(1, 7), np.array([[*face, 9] for face in faces]).ravel())
    gmsh.model.mesh.addElementsByType(1, 3, range(7, 13), np.array(faces).ravel())
    group(2, [1], "all")
    group(3, [1], "body")


def two_bodies() -> None:
    for x in (0, 3):
        gmsh.model.occ.addRectangle(x, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    group(2, [1, 2], "body")
    gmsh.model.mesh.generate(2)


def curves_only() -> None:
    named(plate())
    gmsh.model.mesh.generate(1)


def empty_group() -> None:
    surfaces = plate()
    gmsh.model.addDiscreteEntity(1, 40)
    group(1, [1, 2], "bottom")
    group(1, [40], "nothing")
    group(2, surfaces, "body")
    gmsh.model.mesh.generate(2)


# what is refused, and the sentence
REFUSED: dict[str, str] = {
    "one_name_twice": "the physical group 32 of curves has no name",
    "separate": "the body is in 2 pieces, and .* nodes lie where another one does, .* merge them",
    "tilted": "its cells are a surface in space, with z from 0 to 0.6; mesh the volume",
    "surface_of_a_solid": "its cells are a surface in space, with z from 0 to 1; mesh the volume",
    "two_bodies": "the body is in 2 pieces, such as .*; mesh one body",
    "curves_only": "it holds no cells; mesh the body",
    "empty_group": "the physical group 'nothing' of curves is empty",
}
CASES: list[Callable[[], Any]] = [
    plain, signed, overlapping, one_name_twice, unnamed, unnamed_body, no_groups, partitioned, partitioned_with_ghosts,
    partitioned_block, periodic, separate, merged, coincident, embedded, senses, curved, parametric,
    second_order, fourth_order, quadrangles, quadrangles_of_second_order, serendipity, mixed, sparse_numbers, lifted, tilted,
    noisy, cubes, block_of_tetrahedra, solids_of_second_order, surface_of_a_solid, hexahedra, prisms,
    hexahedra_of_second_order, prisms_of_second_order, pyramids, two_bodies, curves_only, empty_group,
]  # fmt: skip
