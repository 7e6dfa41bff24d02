"""A small cache of what takes long to build."""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Any, Generic, TypeVar

import numpy as np

T = TypeVar("T")
"""The type of the kept values."""


class LastUsed(Generic[T]):
    """A cache of the last used values, bounded by their memory; a value beyond the bound is not kept.

    Attributes:
        kept: The values and their sizes by their keys, the last used last.
    """

    def __init__(self, most_bytes: int, size_of: Callable[[T], int]) -> None:
        self.most_bytes, self.size_of = most_bytes, size_of
        self.kept: dict[Any, tuple[T, int]] = {}
        self._lock = Lock()

    def get(self, key: Any, build: Callable[[], T]) -> T:
        """Get the value of a key, built if it is not there."""
        with self._lock:
            known = self.kept.pop(key, None)
            if known is not None:
                self.kept[key] = known
                return known[0]
        value = build()
        with self._lock:
            self.kept[key] = value, self.size_of(value)
            total = sum(size for _, size in self.kept.values())
            while total > self.most_bytes:
                total -= self.kept.pop(next(iter(self.kept)))[1]
        return value


def bytes_of_arrays(value: object) -> int:
    """Return the bytes of the arrays among the attributes of a value, in lists, too."""
    parts = [part for own in vars(value).values() for part in (own if isinstance(own, list) else [own])]
    return sum(part.nbytes for part in parts if isinstance(part, np.ndarray))
