"""The table [mesh] of a scene."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from warmslip.mesh import files
from warmslip.scene.types import Count, Positive, Table, Vector, _word

PARTS = {"square": ("left", "right", "bottom", "top"), "cube": ("left", "right", "front", "back", "bottom", "top")}


COARSEST = 4  # cells along an axis of the mesh that is refined towards its graded places, at least


class GradedTable(Table):
    """A place towards which cells shrink, and how strongly."""

    at: Annotated[Annotated[str, Tag("word")] | Annotated[Vector, Tag("number")], Discriminator(_word)]
    """`corners`, the name of a part, or the coordinates of a node of the coarsest mesh."""
    exponent: Annotated[float, Field(strict=True, gt=0.05, lt=1, allow_inf_nan=False)] | None = None
    """The solution behaves there like its distance to this power; found from the scene at corners, elsewhere 0.5 unless given."""


def _kind(value: Any) -> str:
    return "table" if isinstance(value, dict | GradedTable) else _word(value)


class MeshTable(Table):
    """A structured box, `n` cells per side (or one number an axis), each cut along `diagonal`; or a mesh `file`.

    `grading` is the size of cells at the far end of an axis over that at the near one, one number an axis: cells grow in
    geometric progression, and the last of n is grading^((n - 1)/n) times the first.
    """

    shape: Literal["square", "cube"] | None = None
    """Body of a structured mesh; square unless there is a file. Parts: left, right, bottom, top, and front, back of a cube."""
    n: Count | list[Count] = 32
    """Cells per side, or one number an axis."""
    lengths: list[Positive] | None = None
    """Sides, length; 1 along every axis unless given."""
    grading: list[Positive] | None = None
    """Size of cells at the far end of an axis over that at the near one, which twice the cells keep; the last of n cells is
    grading^((n - 1)/n) times the first. One number an axis; 1 unless given."""
    diagonal: Literal["right", "left", "crisscross"] = "right"
    """How a grid cell is cut: from (0,0) to (1,1), the other way, or both (square only)."""
    graded_to: list[
        Annotated[
            Annotated[str, Tag("word")] | Annotated[Vector, Tag("number")] | Annotated[GradedTable, Tag("table")],
            Discriminator(_kind),
        ]
    ] = []
    """Places towards which cells shrink, with as many cells as before: "corners", where the exponents of the solution come from
    supports and materials (in space these are edges), names of parts, points, or tables { at = "top", exponent = 0.75 }. The mesh
    is halved from the coarsest one that n allows, with four cells along an axis or more; a file needs refine."""
    file: str | None = None
    """A mesh file beside the scene file: gmsh (MSH 4.1 or 2.2), or .vtu, .inp, .med, .exo, .bdf. Its physical groups or cell sets
    are the parts and regions. Takes the place of all other keys here but refine and graded_to."""
    refine: Annotated[int, Field(ge=0, le=6, strict=True)] = 0
    """How many times the cells of a file are halved."""

    @property
    def dim(self) -> int:
        if self.file is not None:
            return files.read(self.file).dim
        return 3 if self.shape == "cube" else 2

    @property
    def name(self) -> str:
        """What messages call the body."""
        return f"mesh '{self.file}'" if self.file is not None else self.shape or "square"

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the boundary parts."""
        if self.file is not None:
            return tuple(files.read(self.file).parts)
        return PARTS[self.shape or "square"]

    @property
    def no_parts(self) -> dict[str, str]:
        """Named groups of a mesh file that are no boundary parts, and why."""
        return files.read(self.file).no_parts if self.file is not None else {}

    def unknown(self, part: str) -> str:
        """A sentence on a name that is no boundary part, with the names that are."""
        has = ", ".join(self.parts) or "no named part; give its facets physical names"
        if part in self.no_parts:
            return f"'{part}' is no boundary part: it {self.no_parts[part]}; a {self.name} has {has}"
        return f"unknown boundary part '{part}'; a {self.name} has {has}"

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the regions of a mesh file."""
        return tuple(files.read(self.file).regions) if self.file is not None else ()

    @property
    def counts(self) -> list[int]:
        return [self.n] * self.dim if isinstance(self.n, int) else self.n

    @property
    def gradings(self) -> list[GradedTable]:
        """The graded places, each as a table."""
        return [one if isinstance(one, GradedTable) else GradedTable(at=one) for one in self.graded_to]

    @property
    def halvings(self) -> int:
        """How often the coarsest mesh is refined to give this one."""
        if self.file is not None:
            return self.refine
        counts, times = self.counts, 0
        while all(count % 2 == 0 and count >= 2 * COARSEST for count in counts):
            counts, times = [count // 2 for count in counts], times + 1
        return times

    @property
    def level(self) -> int:
        """1/h: cells along the first axis, or how often the edges of a file are cut."""
        return 2**self.refine if self.file is not None else self.counts[0]

    @property
    def sides(self) -> list[float]:
        return self.lengths or [1.0] * self.dim

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        if self.file is not None:
            fields = type(self).model_fields
            given = [
                key
                for key in fields
                if key not in ("file", "refine", "graded_to") and getattr(self, key) != fields[key].default
            ]
            if given:
                raise ValueError(f"a mesh from a file has no {', '.join(given)}; remove that, or the file")
            files.read(self.file)  # refuses
            self._graded()
            return self
        if self.refine:
            raise ValueError("refine is for a mesh from a file; give a larger n")
        body = self.shape or "square"
        for key in ("n", "lengths", "grading"):
            value = getattr(self, key)
            if isinstance(value, list) and len(value) != self.dim:
                raise ValueError(f"{key} has {len(value)} entries but a {body} has {self.dim} axes; give {self.dim}")
        if math.prod(n + 1 for n in self.counts) > 10**8:
            raise ValueError(
                "n gives more than 100 million nodes, which 32-bit numbering cannot hold; use a coarser mesh"
            )
        self._graded()
        if self.dim == 3 and self.diagonal == "crisscross":
            raise ValueError("diagonal 'crisscross' exists for shape 'square' only; use 'right' or 'left'")
        return self

    def _graded(self) -> None:
        """Raises ValueError for places that are not there, or a mesh that cannot be halved."""
        if not self.graded_to:
            return
        if any(ratio != 1 for ratio in self.grading or []):
            raise ValueError("graded_to and grading both set the sizes of cells; give one of them")
        for one in self.gradings:
            if isinstance(one.at, str) and one.at != "corners" and one.at not in self.parts:
                known = ", ".join(["corners", *self.parts])
                if one.at in self.no_parts:
                    why = f"'{one.at}' is no boundary part: it {self.no_parts[one.at]}"
                else:
                    why = f"there is no part '{one.at}'"
                raise ValueError(f"graded_to: {why}; a {self.name} has {known}, or give a point")
            if isinstance(one.at, list) and len(one.at) != self.dim:
                raise ValueError(f"graded_to: the point {one.at} needs {self.dim} coordinates")
        if self.halvings == 0 and self.file is not None:
            raise ValueError("graded_to needs a mesh that is refined; give refine = 1 or more")
        if self.halvings == 0:
            near = [max(2 * COARSEST, 8 * math.ceil(count / 8)) for count in self.counts]
            n = str(near[0] if len(set(near)) == 1 else near)
            raise ValueError(
                f"graded_to needs an n that can be halved to {COARSEST} or more along every axis; give n = {n}, say"
            )
