"""Public names have numpydoc sections that name every parameter."""

from __future__ import annotations

import inspect
import re

import pytest

import warmslip

SECTIONS = ("Parameters", "Attributes", "Returns", "Raises")


@pytest.mark.parametrize("name", warmslip.__all__)
def test_a_public_name_says_what_it_takes_and_raises(name: str) -> None:
    thing = getattr(warmslip, name)
    text = inspect.getdoc(thing) or ""
    found = re.findall(r"^(\w+)\n-+$", text, re.MULTILINE)
    if inspect.isfunction(thing):
        assert {"Parameters", "Returns", "Raises"} <= set(found)
        for parameter in inspect.signature(thing).parameters:
            assert re.search(rf"^{parameter} : ", text, re.MULTILINE), f"{name} does not document '{parameter}'"
    elif not issubclass(thing, Exception) and name not in (
        "Scene",
        "Discretisation",
    ):  # their fields are documented one by one
        assert set(found) & set(SECTIONS), f"{name} has no section"
