"""How a value is quoted in a message."""

from __future__ import annotations

from types import FunctionType
from typing import Any


def quoted(value: Any) -> str:
    """The text by which a message repeats a value; of a long one the beginning."""
    if isinstance(value, FunctionType):  # whose address tells nothing
        return f"the function {value.__name__}"
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, a table in a table in a ...
        return "what was given"
    return text if len(text) <= 200 else f"{text[:200]}..."
