"""Answers that leave as fast as the client takes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import Response
from typing_extensions import override

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from starlette.types import Receive, Scope, Send

PIECE = 2**20
"""The bytes of an answer that are written at once: `write_timeout` is the time that the client has for as many."""


SHORT = 2**16
"""The bytes of an answer that is sent at once: no more than the connection takes before it waits for its client."""


class Answer(Response):
    """An answer whose body is sent in pieces, each when the client has taken the one before.

    The last piece of a long one is empty: the answer is done, and its bytes are released, when the client has taken all
    others.
    """

    def __init__(
        self, parts: Sequence[bytes], status: int, media_type: str, headers: Mapping[str, str] | None = None
    ) -> None:
        self._length = sum(map(len, parts))
        super().__init__(None, status, {**(headers or {}), "Content-Length": str(self._length)}, media_type)
        self._parts = parts

    @override
    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the ASGI specification."""
        await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
        last = b""
        if scope["method"] != "HEAD" and self._length <= SHORT:
            last = b"".join(self._parts)
        elif scope["method"] != "HEAD":
            for piece in self._pieces():
                await send({"type": "http.response.body", "body": piece, "more_body": True})
        await send({"type": "http.response.body", "body": last})

    def _pieces(self) -> Iterator[bytes]:
        for part in self._parts:
            if len(part) <= PIECE:
                yield part
            else:
                yield from (part[start : start + PIECE] for start in range(0, len(part), PIECE))
