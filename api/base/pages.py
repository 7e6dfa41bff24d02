"""Pages of long lists: of so many entries at most, and of so many bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

PAGE_BYTES = 2**20
"""The bytes after which a page ends, so that long entries make short pages."""

MOST_ENTRIES = 1000
"""The most entries that a page may have."""

DEFAULT_ENTRIES = 100
"""The entries of a page unless the request says otherwise."""


def first_page(entries: Iterable[tuple[str, bytes]], limit: int) -> tuple[list[tuple[str, bytes]], bool]:
    """Take a page from the beginning of a list, at least one entry, and tell whether there is more.

    Args:
        entries: Each with the cursor that points behind it.
        limit: The most entries of the page.
    """
    page: list[tuple[str, bytes]] = []
    size = 0
    for cursor, entry in entries:
        size += len(entry)
        if page and (len(page) >= limit or size > PAGE_BYTES):
            return page, True
        page.append((cursor, entry))
    return page, False
