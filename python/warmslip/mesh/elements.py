"""Shapes of elements, and their division into simplices that fit together across elements."""

from __future__ import annotations

from typing import Any

import numpy as np

# dimension and number of corners
SHAPES = {
    "point": (0, 1),
    "line": (1, 2),
    "triangle": (2, 3),
    "quadrangle": (2, 4),
    "tetrahedron": (3, 4),
    "hexahedron": (3, 8),
    "prism": (3, 6),
    "pyramid": (3, 5),
}
FACES = {
    "hexahedron": ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "prism": ((0, 1, 2), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 1, 2, 3), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}
# gmsh's numbers of the elements of order 1 to 5 and how many nodes they have, corners first
GMSH: dict[int, tuple[str, int]] = {
    kind: (shape, size)
    for shape, kinds in {
        "point": {15: 1},
        "line": {1: 2, 8: 3, 26: 4, 27: 5, 28: 6},
        "triangle": {2: 3, 9: 6, 20: 9, 21: 10, 22: 12, 23: 15, 24: 15, 25: 21},
        "quadrangle": {3: 4, 10: 9, 16: 8, 36: 16, 37: 25, 38: 36, 39: 12, 40: 16, 41: 20},
        "tetrahedron": {4: 4, 11: 10, 29: 20, 30: 35, 31: 56, 32: 22, 33: 28, 137: 16},
        "hexahedron": {5: 8, 12: 27, 17: 20, 92: 64, 93: 125, 94: 216, 99: 32, 100: 44, 101: 56},
        "prism": {6: 6, 13: 18, 18: 15},
        "pyramid": {7: 5, 14: 14, 19: 13, 118: 30, 119: 55, 120: 91, 125: 21, 126: 29, 127: 37},
    }.items()
    for kind, size in kinds.items()
}


def gmsh_element(kind: int) -> tuple[str, int]:
    """Shape and number of nodes of gmsh's element type. Raises ValueError for a type that cannot be used."""
    if kind not in GMSH:
        raise ValueError(
            f"it holds elements of gmsh's type {kind}; mesh with triangles, quadrangles, tetrahedra, hexahedra, prisms or "
            "pyramids of order 5 or less"
        )
    return GMSH[kind]


def split(shape: str, corners: Any) -> Any:
    """Elements as simplices of the same dimension.

    Every face is divided from its node with the smallest number, and every solid from its own such node over the faces that do
    not touch it. Both elements at a face therefore divide it alike (Dompierre et al., Int. Meshing Roundtable 8, 1999).

    Parameters
    ----------
    shape : str
        A key of SHAPES.
    corners : array (m, k)
        Numbers of the corners.

    Returns
    -------
    array (m, children, d + 1)
        Corners of the simplices of each element, of either sense.
    """
    if shape == "quadrangle":
        return _fan(corners)
    if shape not in FACES:
        return corners[:, None]
    lowest = corners.argmin(axis=1)
    children = _children(corners[:0], 0, FACES[shape]).shape[1]
    out = np.empty((len(corners), children, 4), corners.dtype)
    for at in range(corners.shape[1]):
        here = lowest == at
        out[here] = _children(corners[here], at, FACES[shape])
    return out


def _children(corners: Any, at: int, faces: tuple[tuple[int, ...], ...]) -> Any:
    """The cones from corner `at` over the faces that do not touch it, (m, children, 4)."""
    opposite = [corners[:, face] for face in faces if at not in face]
    triangles = np.concatenate([_fan(face) if face.shape[1] == 4 else face[:, None] for face in opposite], axis=1)
    apex = np.broadcast_to(corners[:, at, None, None], (*triangles.shape[:2], 1))
    return np.concatenate([apex, triangles], axis=2)


def _fan(corners: Any) -> Any:
    """Quadrangles (m, 4) as triangles (m, 2, 3) around their corners with the smallest number."""
    turned = np.take_along_axis(corners, (corners.argmin(axis=1)[:, None] + np.arange(4)) % 4, axis=1)
    return turned[:, [[0, 1, 2], [0, 2, 3]]]
