"""An archive of results that is sent while it is made: no part of the service holds the whole."""

from __future__ import annotations

import asyncio
import pickle
from typing import TYPE_CHECKING
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from api.pool.messages import Reply

WRITTEN = (1980, 1, 1, 0, 0, 0)
"""The date of all files in an archive: equal results make equal bytes."""


class _Outlet:
    """Takes what an archive writes, without a way back; `taken` gives it once."""

    def __init__(self) -> None:
        self._held = bytearray()

    def write(self, data: bytes) -> int:
        """Take more."""
        self._held += data
        return len(data)

    def flush(self) -> None:
        """Do nothing: writes go to memory."""

    def taken(self) -> bytes:
        """Return the bytes written since the last call."""
        data = bytes(self._held)
        self._held.clear()
        return data


async def zipped(replies: AsyncIterator[Reply]) -> AsyncIterator[bytes]:
    """Make an archive of the files that workers wrote, piece by piece; threads compress, not the event loop."""
    outlet = _Outlet()
    archive = ZipFile(outlet, "w", ZIP_DEFLATED)  # type: ignore[call-overload]  # it asks for no more

    def add(files: bytes) -> None:
        for name, content in pickle.loads(files):  # noqa: S301 - from our own process
            archive.writestr(ZipInfo(name, WRITTEN), content, ZIP_DEFLATED)

    async for reply in replies:
        await asyncio.to_thread(add, reply.body)
        yield outlet.taken()
    archive.close()
    yield outlet.taken()
