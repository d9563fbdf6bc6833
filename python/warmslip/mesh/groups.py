"""Physical groups by their names: boundary parts, regions, and groups that are neither."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from warmslip.mesh.raw import Raw

KIND = ("points", "curves", "surfaces", "volumes")


def named(raw: Raw, dim: int, groups: dict[int, Any]) -> tuple[dict[str, Any], list[str]]:
    """The groups of a dimension by name; without any name, by number.

    Parameters
    ----------
    raw : Raw
        What the file holds.
    dim : int
        Dimension of the groups.
    groups : dict of arrays
        Members of each group by its number.

    Returns
    -------
    members : dict of arrays
        Members of each name, those of groups of one name together.
    remarks : list of str
        A sentence for each name of several groups.

    Raises
    ------
    ValueError
        For a name without members, or a group without a name beside others with one.
    """
    numbers: dict[str, dict[int, None]] = {}
    for of, tag, name in raw.names:
        if of == dim:
            numbers.setdefault(name, {})[tag] = None
    if not numbers:
        return {str(tag): members for tag, members in groups.items()}, []
    if lost := sorted(set(groups).difference(*numbers.values())):
        raise ValueError(
            f"the physical group {lost[0]} of {KIND[dim]} has no name, and {_some(numbers)}; gmsh keeps one of two groups "
            "of the same name and leaves the other without: name every group, and each differently"
        )
    out = {}
    for name, tags in numbers.items():
        there = [groups[tag] for tag in tags if tag in groups]
        if not there:
            raise ValueError(
                f"the physical group '{name}' of {KIND[dim]} is empty; remove it, or give it entities that are meshed"
            )
        out[name] = there[0] if len(there) == 1 else np.unique(np.concatenate(there))
    joined = [(name, tags) for name, tags in numbers.items() if len(tags) > 1]
    return out, [
        f"the groups {', '.join(map(str, tags))} of {KIND[dim]} are all called '{name}' and taken as one"
        for name, tags in joined
    ]


def _some(names: Iterable[str]) -> str:
    first, *rest = [f"'{name}'" for name in names]
    return f"{first} and {len(rest)} more have" if rest else f"{first} has"


def lower(raw: Raw, dim: int) -> dict[str, str]:
    """Why the named groups of dimensions below that of facets are no parts, by name."""
    facets = KIND[dim - 1]
    return {name: f"is a group of {KIND[of]}, and parts are {facets}" for of, _, name in raw.names if of < dim - 1}


def boundary_parts(groups: dict[str, Any], facets: Any, cells_of: Any) -> tuple[dict[str, Any], dict[str, str]]:
    """Groups of facets on the boundary, (f, d) by name, and of the others why they are no parts.

    cells_of (facets,) is how many cells each facet has: 1 on the boundary, 2 inside, 0 elsewhere.
    """
    parts, others = {}, {}
    for name, members in groups.items():
        cells, total = cells_of[members], len(members)
        if (cells == 1).all():
            parts[name] = facets[members]
        elif (inner := int((cells == 2).sum())) > 0:
            others[name] = f"has {inner} of its {total} facets inside the body"
        else:
            others[name] = f"has {int((cells == 0).sum())} of {total} facets that are no side of any cell"
    return parts, others
