"""JSON pointers (RFC 6901): written, read, and followed to a value that another one replaces."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

INDEX = re.compile("0|[1-9][0-9]{0,8}")
"""An index of an array in a JSON pointer."""


class NothingThere(Exception):
    """A pointer leads to nothing."""


def to_pointer(steps: Iterable[str | int]) -> str:
    """Write the pointer to a place in a document."""
    return "".join("/" + str(step).replace("~", "~0").replace("/", "~1") for step in steps)


def steps_of(pointer: str) -> list[str]:
    """Take a pointer apart."""
    return [step.replace("~1", "/").replace("~0", "~") for step in pointer.split("/")[1:]]


def changed(document: Any, pointer: str, value: Any) -> Any:
    """Return a document with another value at a pointer; it shares all other parts with the given one.

    Objects on the way that the document leaves out are made.

    Raises:
        NothingThere: A step leads to no field of an object and to no entry of an array.
    """
    return _changed(document, steps_of(pointer), value)


def _changed(document: Any, steps: list[str], value: Any) -> Any:
    if not steps:
        return value
    key: Any = _key_of(document, steps[0])
    own = document[key] if isinstance(document, list) else document.get(key)
    if own is None and isinstance(document, dict):
        own = {}
    copied = document.copy()
    copied[key] = _changed(own, steps[1:], value)
    return copied


def _key_of(document: Any, step: str) -> str | int:
    """Read a step of a pointer as a name or an index; `-1` and `00` are no indices.

    Raises:
        NothingThere: It can be neither.
    """
    if isinstance(document, dict):
        return step
    if isinstance(document, list) and INDEX.fullmatch(step) and int(step) < len(document):
        return int(step)
    raise NothingThere
