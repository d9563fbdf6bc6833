"""How a value is quoted in a message, and how objects show themselves in a prompt and in a notebook."""

from __future__ import annotations

from html import escape
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


class Shown:
    """An object that shows a few facts about itself: on one line in a prompt, as a table in a notebook."""

    def _facts(self) -> dict[str, str]:
        """What is shown, in order: a name and a few words."""
        raise NotImplementedError

    def __repr__(self) -> str:
        facts = ", ".join(f"{name} {words}" if name else words for name, words in self._facts().items())
        return f"<{type(self).__name__}: {facts}>"

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th><td style='text-align:left'>{escape(words)}</td></tr>"
            for name, words in self._facts().items()
        )
        return f"<table><caption>{escape(type(self).__name__)}</caption>{rows}</table>"
