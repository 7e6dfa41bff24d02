"""A small cache of what takes long to build."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")
"""The type of what is kept."""


class LastUsed(Generic[T]):
    """A cache of what was last used, bounded by its number."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.kept: dict[Any, T] = {}

    def get(self, key: Any, build: Callable[[], T]) -> T:
        """Get the value of a key, built if it is not there."""
        value = self.kept.pop(key) if key in self.kept else build()
        self.kept[key] = value
        if len(self.kept) > self.most:
            del self.kept[next(iter(self.kept))]
        return value
