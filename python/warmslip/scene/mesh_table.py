"""The table [mesh] of a scene."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from warmslip.mesh import files
from warmslip.scene.types import Count, Positive, Table

PARTS = {"square": ("left", "right", "bottom", "top"), "cube": ("left", "right", "front", "back", "bottom", "top")}


class MeshTable(Table):
    """A structured box, `n` cells per side (or one number an axis), each cut along `diagonal`; or a gmsh `file`.

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
    file: str | None = None
    """A gmsh file with physical names, beside the scene file; takes the place of all other keys here but refine."""
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
    def regions(self) -> tuple[str, ...]:
        """Names of the regions of a mesh file."""
        return tuple(files.read(self.file).regions) if self.file is not None else ()

    @property
    def counts(self) -> list[int]:
        return [self.n] * self.dim if isinstance(self.n, int) else self.n

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
                key for key in fields if key not in ("file", "refine") and getattr(self, key) != fields[key].default
            ]
            if given:
                raise ValueError(f"a mesh from a file has no {', '.join(given)}; remove that, or the file")
            files.read(self.file)  # refuses
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
        if self.dim == 3 and self.diagonal == "crisscross":
            raise ValueError("diagonal 'crisscross' exists for shape 'square' only; use 'right' or 'left'")
        return self
