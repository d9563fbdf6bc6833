"""A stored run as an `xarray.Dataset`."""

from __future__ import annotations

from typing import Any

import numpy as np

Variables = dict[str, tuple[tuple[str, ...], Any]]
FIELDS = {"u": ("time", "node", "axis"), "w": ("time", "node", "axis"), "theta": ("time", "node")}
CONTACT = ("pressure", "traction", "slip", "gap", "status", "friction_bound")


def dataset(t: Any) -> Any:
    """The dataset of a trajectory, see `Trajectory.xarray`. Raises RuntimeError when xarray is not installed."""
    try:
        import xarray
    except ImportError:
        raise RuntimeError("xarray is not installed; pip install xarray") from None
    axes = list("xyz"[: t.nodes.shape[1]])
    steps, balances = t.series("steps"), t.series("balances")
    variables: Variables = {
        name: (dims, np.asarray(getattr(t, name))) for name, dims in FIELDS.items() if getattr(t, name) is not None
    }
    coordinates: Variables = {
        "time": (("time",), t.time),
        "step": (("step",), steps.pop("time")),
        "axis": (("axis",), axes),
        **{name: (("node",), t.nodes[:, i]) for i, name in enumerate(axes)},
    }
    for name, values in steps.items():
        variables[name] = (("step",) if values.ndim == 1 else ("step", "axis"), values)
    variables |= {f"balance_{name}": (("step",), values) for name, values in balances.items()}
    if t.contact_parts and len(coordinates["step"][1]):
        _contact(t, variables, coordinates)
    return xarray.Dataset(variables, coordinates, {"title": t.scene.get("title", "")})


def _contact(t: Any, variables: Variables, coordinates: Variables) -> None:
    """Adds the contact fields of all parts, one after the other."""
    parts = [t.contact_history(name) for name in t.contact_parts]
    names = [[part.part] * len(part.weights) for part in parts]
    coordinates["part"] = (("point",), np.concatenate(names))
    if parts[0].arc_length is not None:
        coordinates["arc_length"] = (("point",), np.concatenate([part.arc_length for part in parts]))
    for name in CONTACT:
        values = [getattr(part, name) for part in parts]
        if all(one is not None for one in values):
            dims = ("step", "point", "axis")[: values[0].ndim]
            variables[f"contact_{name}"] = (dims, np.concatenate(values, axis=1))
    variables["contact_weight"] = (("point",), np.concatenate([part.weights for part in parts]))
