"""Bounds on the size of a request, held before anything looks into it: a hostile body must not cost a worker's time."""

from __future__ import annotations

import math
import re
from typing import Any

import orjson

from api.base.errors import LONGEST_POINTER, invalid_at
from api.base.json_pointers import to_pointer

MOST_FIELDS = 64
"""The most fields of one object in a request; the schema with the most has less than 20."""

MOST_NESTED = 20
"""The most objects and lists in a waypoint or a pose of a request; one with everything has less than ten."""

MOST_BESIDES = 1000
"""The most objects and lists in the rest of a request; the joints of the longest table are 64, each with two lists."""

MOST_OBJECTS = 5000
"""The most entries of a list `objects`: the objects of the largest scene."""

MOST_OF_AN_OBJECT = 10
"""The most objects and lists in an object of a scene, itself among them; one with a pose and a shape has six."""

BYTES_OF_A_ROW = 20
"""The bytes of the largest body for each list or object that it may have: honest rows have three numbers and more."""

MOST_DEEP = 32
"""The most arrays and objects of a body that stand in one another; a request has less than 16. Parsers and serialisers
call themselves for each, and fail at some hundreds."""

BRACKETS = bytes.maketrans(b"{}", b"[]")
"""The table that makes braces brackets."""

NEITHER_BRACKETS_NOR_QUOTES = bytes(set(range(256)) - set(b'[]{}"'))
"""The bytes that say nothing of how deep a body is."""

TEXT = re.compile(rb'"[^"]*"?')
"""A string between its quotes; one that does not end goes on to the end."""

CAPPED_LISTS = frozenset({"waypoints", "poses"})
"""The lists of a request that `max_waypoints` bounds, whatever their entries are."""


def refuse_many_rows(body: bytes, max_body_bytes: int) -> None:
    """Refuse an unparsed body that may have more lists and objects than an honest one of the largest size.

    The values of a million empty rows in 3 MB would take a hundred times the memory of the body.

    Raises:
        InvalidRequest: It has too many.
    """
    most = max_body_bytes // BYTES_OF_A_ROW
    if body.count(b"[") + body.count(b"{") > most:
        raise invalid_at("", f"The body must have at most {most:,} JSON arrays and objects.")


def is_too_deep(body: bytes) -> bool:
    """Tell, before it is parsed, whether a body nests more than `MOST_DEEP` arrays and objects.

    Each pass takes the innermost ones away. Brackets in strings do not count.
    """
    if body.count(b"[") + body.count(b"{") <= MOST_DEEP:
        return False
    unescaped = body.replace(b"\\\\", b"").replace(b'\\"', b"")
    signs = unescaped.translate(BRACKETS, NEITHER_BRACKETS_NOR_QUOTES).replace(b'""', b"")
    brackets = TEXT.sub(b"", signs)
    for _ in range(MOST_DEEP):
        brackets = brackets.replace(b"[]", b"")
    return b"[]" in brackets


def parse_json(body: bytes, pointer: str | None = None) -> Any:
    """Parse the JSON of a caller, which is the whole body unless a pointer says where it stands there.

    Raises:
        InvalidRequest: It is too deep, or no JSON.
        MemoryError: The parser found no memory.
    """
    if is_too_deep(body):
        message = f"must nest at most {MOST_DEEP} arrays and objects in one another"
        raise invalid_at(pointer or "", message)
    try:
        return orjson.loads(body)
    except orjson.JSONDecodeError as error:
        if error.msg.startswith("Not enough memory"):
            raise MemoryError from None
        where = f" (line {error.lineno}, column {error.colno})" if pointer is None else ""
        message = f"not JSON: {error.msg.partition(': line')[0]}{where}"
        raise invalid_at(pointer or "", message) from None


def rows_of(duration: float, period: float) -> int:
    """Return the number of rows of a trajectory of this duration, s, at this period, s."""
    return math.ceil(duration / period) + 1


def size_faults(document: Any, max_waypoints: int, max_samples: int) -> list[dict[str, str]]:
    """Find the objects and lists of a request that are too large, as faults with JSON pointers.

    All objects are visited, and all lists but rows of numbers: the schemas bound those, and stop at the first row
    that is wrong.
    """
    faults = []
    most_nested = MOST_NESTED * max_waypoints + MOST_BESIDES
    nested = 0
    unvisited: list[tuple[tuple[str | int, ...], Any]] = [((), document)] if isinstance(document, dict | list) else []
    while unvisited:
        path, value = unvisited.pop()
        if isinstance(value, dict):
            size, most, what = len(value), MOST_FIELDS, "fields"
        else:
            size, what = len(value), "entries"
            most = max_waypoints if path and path[-1] in CAPPED_LISTS else max_samples
            if path and path[-1] == "objects":
                most = MOST_OBJECTS
                most_nested += MOST_OF_AN_OBJECT * min(size, most)
        if size > most:
            faults.append(_fault(path, f"must have at most {most} {what}; got {size}"))
            continue
        children: list[tuple[str | int, Any]] = (
            [(name, child) for name, child in value.items() if isinstance(child, dict | list)]
            if isinstance(value, dict)
            else [(i, child) for i, child in enumerate(value) if isinstance(child, dict)]
        )
        nested += len(children)
        if nested > most_nested:
            return [*faults, _fault((), f"must have at most {most_nested} nested arrays and objects")]
        unvisited += [((*path, step), child) for step, child in children]
    return faults


def _fault(path: tuple[str | int, ...], message: str) -> dict[str, str]:
    return {"pointer": to_pointer(path)[:LONGEST_POINTER], "message": message}
