"""Paths to fields of the library's own values: what faults and remedies are about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

FieldPath = tuple[str | int, ...]
"""Names of fields and indices from the outside in, as `("waypoints", 1, "duration")` of a `PlanningProblem`.

A path that begins with `BACK_END` leads into the back end beside the problem, one that ends in `KIND` names the type of
a value.
"""

BACK_END = "backend"
"""First step of the path to an option of a back end."""

KIND = "__class__"
"""Last step of a path to the type of a value."""

T = TypeVar("T")
"""The type of the value in which a field is changed."""


def field_name(path: FieldPath) -> str:
    """Write a path as in Python: `waypoints[1].duration`; that to the type of a value is the value's own."""
    steps = (f"[{step}]" if isinstance(step, int) else f".{step}" for step in path if step != KIND)
    return "".join(steps).removeprefix(".")


def with_field(holder: T, path: FieldPath, value: Any) -> T:
    """Return a copy of a value in which one field has another value.

    Args:
        holder: A dataclass, or a tuple; so is everything that the path leads through.
        path: The path from the holder to the field; empty: the holder itself.
        value: The new value of the field.
    """
    changed: Any = value
    if path:
        first, *rest = path
        if isinstance(holder, tuple) and isinstance(first, int):
            items = list(holder)
            items[first] = with_field(items[first], tuple(rest), value)
            changed = tuple(items)
        else:
            inner = with_field(getattr(holder, str(first)), tuple(rest), value)
            changed = replace(holder, **{str(first): inner})  # type: ignore[type-var]
    result: T = changed
    return result


def moved_path(path: FieldPath, paths: Sequence[FieldPath]) -> FieldPath:
    """Return the path to a field of a waypoint, where the waypoint with each index has another path."""
    if path[:1] == ("waypoints",) and len(path) > 1 and isinstance(path[1], int):
        return (*paths[path[1]], *path[2:])
    return path


class PickledByFields:
    """A dataclass that pickles only its fields, without cached values."""

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields by their names."""
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]
