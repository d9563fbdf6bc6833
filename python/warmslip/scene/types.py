"""The types of which the tables of a scene are made."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from warmslip.messages import quoted
from warmslip.scene.expressions import Value, finite

Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=2**31 - 1, strict=True)]  # steps and cells are counted in 32 bits
Vector = Annotated[list[Finite], Field(min_length=2, max_length=3)]
Matrix = Annotated[list[Vector], Field(min_length=2, max_length=3)]
Values = Annotated[list[Value], Field(min_length=2, max_length=3)]


def _number_or_matrix(value: Any) -> Any:
    if isinstance(value, list):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not finite(value):
        raise ValueError(f"{quoted(value)} is neither a finite number nor a matrix; give one")
    return value


def _listed(value: Any) -> str:
    return "one" if isinstance(value, dict) else "several"


def _word(value: Any) -> str:
    return "word" if isinstance(value, str) else "number"


# c stands for c times the identity
Tensor = Annotated[Matrix | float, BeforeValidator(_number_or_matrix)]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"a scene does not change; scene.override with '{name}' among its keys makes another one")
