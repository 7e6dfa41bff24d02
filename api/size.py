"""Bounds on the size of a request, held before anything looks into it: a hostile body must not cost a worker's time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from api.errors import LONGEST_POINTER

if TYPE_CHECKING:
    from api.messages import Caps

MOST_FIELDS = 64
"""The most fields of one object in a request; the schema with the most has less than 20."""

MOST_OBJECTS = 100_000
"""The most objects in one request; a waypoint has less than ten, and 1000 waypoints are the usual cap."""

CAPPED_LISTS = frozenset({"waypoints", "poses"})
"""The lists of a request that `max_waypoints` bounds, whatever their entries are."""


def size_faults(document: Any, caps: Caps) -> list[dict[str, str]]:
    """The objects and lists of a request that are too large, as faults with JSON pointers.

    All objects are visited, and all lists but rows of numbers: the schemas bound those, and stop at the first row
    that is wrong.
    """
    faults = []
    unvisited: list[tuple[tuple[str | int, ...], Any]] = [((), document)]
    visited = 0
    while unvisited:
        path, value = unvisited.pop()
        visited += 1
        if visited + len(unvisited) > MOST_OBJECTS:
            return [_fault((), f"more than {MOST_OBJECTS} objects")]
        if isinstance(value, dict):
            size, most, what = len(value), MOST_FIELDS, "fields of an object"
            children: list[tuple[str | int, Any]] = [
                (name, child) for name, child in value.items() if isinstance(child, dict | list)
            ]
        else:
            children = [(i, child) for i, child in enumerate(value) if isinstance(child, dict)]
            few = bool(children) or path[-1] in CAPPED_LISTS
            size, most, what = len(value), caps.max_waypoints if few else caps.max_samples, "of a request"
        if size > most:
            faults.append(_fault(path, f"{size} are more than the {most} {what}"))
        else:
            unvisited += [((*path, step), child) for step, child in children]
    return faults


def _fault(path: tuple[str | int, ...], message: str) -> dict[str, str]:
    pointer = "".join("/" + str(step).replace("~", "~0").replace("/", "~1") for step in path)
    return {"pointer": pointer[:LONGEST_POINTER], "message": message}
