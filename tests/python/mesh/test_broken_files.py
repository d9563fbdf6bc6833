"""Files that are broken, or hold what cannot be used, are refused with their true fault and its cure."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from support.folders import TESTS

from warmslip.mesh import files, gmsh
from warmslip.mesh.conversion import convert
from warmslip.mesh.elements import FACES, SHAPES, split
from warmslip.mesh.facets import row_codes
from warmslip.mesh.raw import MAX_GROUPS

FOLDER = TESTS / "fuzz" / "corpus" / "mesh"
NEW, OLD = "unused_interface_41", "two_groups_22"


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        (NEW, "4.1 0 8", "4.0 0 8", "its format is MSH 4.0; save it as MSH 4.1 or 2.2$"),
        (NEW, "4.1 0 8", "1 0 8", "its format is MSH 1; save it as MSH 4.1 or 2.2$"),
        (NEW, "4.1 0 8", "4.1 0 4", "its header is '4.1 0 4'; save the mesh again$"),
        (NEW, "4.1 0 8", "4.1 1 8", "another order of bytes; save it as text$"),
        (NEW, "4.1 0 8", "mesh", "does not begin with a version; save the mesh again$"),
        (NEW, '1 12 "top"', '1 12 "t"op"', "a line of .PhysicalNames is '1 12 \"t\"op\"'; give the group a name without quotes$"),
        (NEW, '1 12 "top"\n', "", "announces another number of names than the 3 it holds"),
        (NEW, "$EndNodes", "", r"\$Nodes ... \$EndNodes is missing; save the mesh again$"),
        (NEW, "$Elements\n", "$Nodes\n0 0 0 0\n$EndNodes\n$Elements\n", "there are two sections .Nodes; save each mesh"),
        (NEW, "15 56 1 56", "14 56 1 56", "a section holds more than it announces"),
        (NEW, "15 56 1 56", "16 56 1 56", "a section ends before all that it announces"),
        (NEW, "\n2 1 2 42\n", "\n2 1 34 42\n", "it holds elements of gmsh's type 34; mesh with .* of order 5 or less$"),
        (NEW, "\n1 0 0\n0 3", "\n1e120 0 0\n0 3", "its coordinates reach 1e.120, .*; take another unit of length$"),
        (NEW, "\n1 0 0\n0 3", "\nnan 0 0\n0 3", "a node has a coordinate that is not finite; repair the mesh$"),
        (OLD, "\n2 1 0 0\n", "\n1 1 0 0\n", "two nodes have the number 1; renumber the nodes$"),
        (OLD, "\n2 1 0 0\n", "\n2.5e300 1 0 0\n", "a number that counts or names is not a whole one"),
        (OLD, "\n2 1 0 0\n", "\n77 1 0 0\n", "an element names node 2, which the file does not hold; save the mesh again$"),
        (OLD, "$Nodes", "$ParametricNodes\n0\n$EndParametricNodes\n$Nodes", "parameters; save it with Mesh.SaveParametric = 0$"),
    ],
    ids=[
        "4.0", "1", "4 bytes", "bytes", "no version", "name", "names", "no end", "two sections", "more", "less", "polygon", "far",
        "nowhere", "one number", "number", "no node", "parameters",
    ],
)  # fmt: skip
def test_the_fault_and_its_cure(file: str, old: str, new: str, words: str, tmp_path: Path) -> None:
    text = (FOLDER / f"{file}.msh").read_text()
    assert text.count(old) == 1
    (tmp_path / "mesh.msh").write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=words):
        files.read(str(tmp_path / "mesh.msh"))


def test_more_groups_than_an_entity_may_have() -> None:
    """Memberships stay in proportion to the file."""
    text = (FOLDER / f"{NEW}.msh").read_text()
    groups = " ".join(map(str, range(100, 101 + MAX_GROUPS)))
    many = text.replace("2 1 0 0 2 0 0 1 11 2", f"2 1 0 0 2 0 0 {MAX_GROUPS + 1} {groups} 2")
    assert many != text
    with pytest.raises(ValueError, match="an entity is in 65 physical groups; put it into 64 at most"):
        gmsh.parse(many.encode())


@pytest.mark.parametrize("file", [NEW, OLD])
def test_a_sign_of_a_group_is_no_other_group(file: str) -> None:
    text = (FOLDER / f"{file}.msh").read_text()
    plain = convert(gmsh.parse(text.encode()), "")
    signed = convert(gmsh.parse(text.replace(" 2 11 2 ", " 2 -11 2 ").replace(" 1 11 2 ", " 1 -11 2 ").encode()), "")
    assert np.array_equal(plain.parts["bottom"], signed.parts["bottom"])


def rows(count: int) -> bytes:
    """A strip of triangles, of which each is followed by one of its edges."""
    nodes = [f"{2 * i + j + 1} {i} {j} 0" for i in range(count + 1) for j in (0, 1)]
    elements = []
    for i in range(count):
        a, b, c, d = 2 * i + 1, 2 * i + 3, 2 * i + 4, 2 * i + 2
        for kind, group, corners in ((2, 2, (a, b, c)), (1, 1, (a, b)), (2, 2, (a, c, d)), (1, 3, (d, c))):
            elements.append(f"{len(elements) + 1} {kind} 2 {group} {group} {' '.join(map(str, corners))}")
    tables = [f"$Nodes\n{len(nodes)}", *nodes, f"$EndNodes\n$Elements\n{len(elements)}", *elements, "$EndElements"]
    return "\n".join(["$MeshFormat\n2.2 0 8\n$EndMeshFormat", *tables, ""]).encode()


def test_time_is_in_proportion_to_the_file_when_no_two_rows_are_alike() -> None:
    def seconds(count: int) -> float:
        data = rows(count)
        begin = time.process_time()
        raw = gmsh.parse(data)
        elapsed = time.process_time() - begin
        assert [len(convert(raw, "").parts[name]) for name in ("1", "3")] == [count, count]
        return elapsed

    seconds(10)
    few, many = min(seconds(1000) for _ in range(3)), min(seconds(8000) for _ in range(2))
    assert many < 24 * few  # 64 if it were quadratic


@pytest.mark.parametrize("shape", ["quadrangle", *FACES])
def test_elements_at_a_face_divide_it_alike(shape: str) -> None:
    """Whatever the numbers of the corners are: simplices fill the element, and each face is divided around its smallest node."""
    corners = {
        "quadrangle": [[0, 0], [1, 0], [1, 1], [0, 1]],
        "hexahedron": [[i, j, k] for k in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))],
        "prism": [[i, j, k] for k in (0, 1) for i, j in ((0, 0), (1, 0), (0, 1))],
        "pyramid": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]],
    }[shape]
    volume = {"quadrangle": 1.0, "hexahedron": 1.0, "prism": 0.5, "pyramid": 1 / 3}[shape]
    generator = np.random.default_rng(1)
    for _ in range(60):
        numbers = generator.permutation(100)[: len(corners)]
        x = np.zeros((100, len(corners[0])))
        x[numbers] = corners
        (children,) = split(shape, numbers[None])
        sizes = np.abs(np.linalg.det(x[children[:, 1:]] - x[children[:, :1]])) / (2 if shape == "quadrangle" else 6)
        assert sizes.min() > 1e-3 and sizes.sum() == pytest.approx(volume)
        triangles = (
            {frozenset(np.delete(child, i).tolist()) for child in children for i in range(4)}
            if len(x[0]) == 3
            else set()
        )
        for face in FACES.get(shape, ()):
            if len(face) == 4:
                assert {
                    frozenset(half) for half in split("quadrangle", numbers[None, list(face)])[0].tolist()
                } <= triangles


def test_codes_of_rows_of_large_numbers_are_those_of_their_nodes() -> None:
    """Beyond 2^63 for three nodes of 2^31."""
    generator = np.random.default_rng(2)
    rows = generator.integers(2**31 - 50, 2**31, (500, 4))
    shuffled = generator.permuted(rows, axis=1)
    assert np.array_equal(
        row_codes(np.concatenate([rows, shuffled]))[:500], row_codes(np.concatenate([rows, shuffled]))[500:]
    )
    different = {tuple(sorted(row)) for row in rows.tolist()}
    assert len(np.unique(row_codes(rows))) == len(different)


def test_shapes_have_the_corners_of_their_faces() -> None:
    for shape, faces in FACES.items():
        assert {corner for face in faces for corner in face} == set(range(SHAPES[shape][1]))


def quadrangle(corners: list[list[float]], numbers: list[int]) -> bytes:
    """A file of one quadrangle, whose corners have numbers of nodes."""
    nodes = "\n".join(f"{i} {x} {y} 0" for i, (x, y) in sorted(zip(numbers, corners, strict=True)))
    tables = f"$Nodes\n4\n{nodes}\n$EndNodes\n$Elements\n1\n1 3 0 {' '.join(map(str, numbers))}\n$EndElements\n"
    return f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{tables}".encode()


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("tip", [[0.2, 0.2], [0.5, 0.5]], ids=["concave", "three corners in line"])
def test_a_quadrangle_is_divided_along_the_diagonal_inside(tip: list[float], turn: int) -> None:
    """The one that ends at the corner of 180 degrees or more."""
    mesh = convert(gmsh.parse(quadrangle([[0.0, 0], [1, 0], tip, [0, 1]], [1 + (i + turn) % 4 for i in range(4)])), "")
    sizes = np.linalg.det(mesh.nodes[mesh.cells[:, 1:]] - mesh.nodes[mesh.cells[:, :1]]) / 2
    assert sizes == pytest.approx([tip[0] / 2, tip[0] / 2])


def test_a_quadrangle_that_crosses_itself_is_refused() -> None:
    with pytest.raises(ValueError, match=r"two cells overlap|is flat"):
        convert(gmsh.parse(quadrangle([[0.0, 0], [1, 0], [0, 1], [1, 1.5]], [1, 2, 3, 4])), "")


@pytest.mark.parametrize("gap", [0.0, 1e-15])
def test_nodes_at_one_place_are_to_be_merged(gap: float) -> None:
    """A ring that is not closed: the body is in one piece."""
    angles = np.append(np.linspace(0, 2 * np.pi, 13)[:-1], gap)
    nodes = [(r * np.cos(a), r * np.sin(a)) for a in angles for r in (1, 2)]
    cells = [(2 * i + 1, 2 * i + 2, 2 * i + 4, 2 * i + 3) for i in range(12)]
    tables = [
        f"$Nodes\n{len(nodes)}",
        *(f"{i} {x!r} {y!r} 0" for i, (x, y) in enumerate(np.array(nodes).tolist(), 1)),
        "$EndNodes",
    ]
    tables += [
        "$Elements\n12",
        *(f"{i} 3 0 {a} {b} {c} {d}" for i, (a, b, c, d) in enumerate(cells, 1)),
        "$EndElements\n",
    ]
    data = "\n".join(["$MeshFormat\n2.2 0 8\n$EndMeshFormat", *tables]).encode()
    with pytest.raises(
        ValueError, match=r"^4 nodes lie where another one does, such as 1 and 25 at \(1, 0\); merge them"
    ):
        convert(gmsh.parse(data), "")


def test_a_cell_over_others_is_refused() -> None:
    """It shares no facet with them, and would add its mass and stiffness to theirs."""
    nodes = [(x, y) for y in range(4) for x in range(4)]
    cells = [
        triangle
        for y in range(3)
        for x in range(3)
        for i in (1 + x + 4 * y,)
        for triangle in ((i, i + 1, i + 5), (i, i + 5, i + 4))
    ]
    for several, sound in ((cells, True), ([*cells, (1, 4, 16)], False)):
        tables = ["$Nodes", "16", *(f"{i} {x} {y} 0" for i, (x, y) in enumerate(nodes, 1)), "$EndNodes", "$Elements"]
        tables += [str(len(several)), *(f"{i} 2 0 {a} {b} {c}" for i, (a, b, c) in enumerate(several, 1))]
        data = "\n".join(["$MeshFormat\n2.2 0 8\n$EndMeshFormat", *tables, "$EndElements\n"]).encode()
        if sound:
            assert len(convert(gmsh.parse(data), "").cells) == 18
        else:
            with pytest.raises(
                ValueError, match="cells overlap: the node 7 lies inside the cell of the nodes 1, 4, 16"
            ):
                convert(gmsh.parse(data), "")
