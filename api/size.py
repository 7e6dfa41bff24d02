"""Bounds on the size of a request, held before anything looks into it: a hostile body must not cost a worker's time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from api.errors import LONGEST_POINTER

if TYPE_CHECKING:
    from api.workers.messages import Caps

MOST_FIELDS = 64
"""The most fields of one object in a request; the schema with the most has less than 20."""

MOST_NESTED = 20
"""The most objects and lists in a waypoint or a pose of a request; one with everything has less than ten."""

MOST_BESIDES = 1000
"""The most objects and lists in the rest of a request; the joints of the longest table are 64, each with two lists."""

BYTES_OF_A_ROW = 20
"""The bytes of the largest body for each list or object that it may have: honest rows have three numbers and more."""

CAPPED_LISTS = frozenset({"waypoints", "poses"})
"""The lists of a request that `max_waypoints` bounds, whatever their entries are."""


def has_too_many_rows(body: bytes, max_body_bytes: int) -> bool:
    """Tell, before it is parsed, whether a body may have more lists and objects than honest ones of the largest size.

    The values of a million empty rows in 3 MB would take a hundred times the memory of the body.
    """
    return body.count(b"[") + body.count(b"{") > max_body_bytes // BYTES_OF_A_ROW


def rows_of(duration: float, period: float) -> int:
    """Return the number of rows of a trajectory of this duration, s, at this period, s."""
    return math.ceil(duration / period) + 1


def size_faults(document: Any, caps: Caps) -> list[dict[str, str]]:
    """Find the objects and lists of a request that are too large, as faults with JSON pointers.

    All objects are visited, and all lists but rows of numbers: the schemas bound those, and stop at the first row
    that is wrong.
    """
    faults = []
    most_nested = MOST_NESTED * caps.max_waypoints + MOST_BESIDES
    nested = 0
    unvisited: list[tuple[tuple[str | int, ...], Any]] = [((), document)] if isinstance(document, dict | list) else []
    while unvisited:
        path, value = unvisited.pop()
        if isinstance(value, dict):
            size, most, what = len(value), MOST_FIELDS, "fields"
        else:
            size, what = len(value), "entries"
            most = caps.max_waypoints if path and path[-1] in CAPPED_LISTS else caps.max_samples
        if size > most:
            faults.append(_fault(path, f"{size} {what} are more than the {most} that it may have"))
            continue
        children: list[tuple[str | int, Any]] = (
            [(name, child) for name, child in value.items() if isinstance(child, dict | list)]
            if isinstance(value, dict)
            else [(i, child) for i, child in enumerate(value) if isinstance(child, dict)]
        )
        nested += len(children)
        if nested > most_nested:
            return [*faults, _fault((), f"it has more than {most_nested} objects and lists in it")]
        unvisited += [((*path, step), child) for step, child in children]
    return faults


def _fault(path: tuple[str | int, ...], message: str) -> dict[str, str]:
    pointer = "".join("/" + str(step).replace("~", "~0").replace("/", "~1") for step in path)
    return {"pointer": pointer[:LONGEST_POINTER], "message": message}
