"""The bytes of bodies and answers that the server holds, and answers that leave as fast as the client takes them."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from fastapi import Response

from api.errors import Overloaded

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from starlette.types import Receive, Scope, Send

PIECE = 2**20
"""The bytes of an answer that are written at once: `write_timeout` is the time that the client has for as many."""


class Traffic:
    """The bytes of the bodies and answers of all requests under way, up to a bound.

    No client may hold more than what it leaves free (the dynamic threshold of Choudhury and Hahne for shared buffers):
    one alone gets half of the room, each of three a quarter, and there is always room for one that comes.

    Attributes:
        held: The bytes of all clients.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._of_client: Counter[str] = Counter()
        self.held = 0

    def share(self, client: str) -> Share:
        """Open the account of one request of a client."""
        return Share(self, client)

    def hold(self, client: str, size: int) -> None:
        """Count more bytes of a client, or (negative) fewer.

        Raises:
            Overloaded: There is no room for them.
        """
        free = self._most - self.held - size
        if size > 0 and self._of_client[client] + size > free:
            raise Overloaded(
                "The service holds too many bytes of requests and answers, and yours are as many as it can hold of one "
                "client now. Read the answers that are under way, or try again later.",
                headers={"Retry-After": "1"},
            )
        self.held += size
        self._of_client[client] += size
        if not self._of_client[client]:
            del self._of_client[client]


class Share:
    """The bytes of one request and its answer.

    Attributes:
        client: The client that they count for; it may change only while nothing is held.
    """

    def __init__(self, traffic: Traffic, client: str) -> None:
        self._traffic = traffic
        self._held = 0
        self.client = client

    def hold(self, size: int) -> None:
        """Count more bytes, until `release`; see `Traffic.hold`."""
        self._traffic.hold(self.client, size)
        self._held += size

    def release(self) -> None:
        """Count them no longer."""
        self._traffic.hold(self.client, -self._held)
        self._held = 0


class Answer(Response):
    """An answer whose body is sent in pieces, each when the client has taken the one before.

    The last piece is empty: the answer is done, and its bytes are released, when the client has taken all others.
    """

    def __init__(
        self, parts: Sequence[bytes], status: int, media_type: str, headers: Mapping[str, str] | None = None
    ) -> None:
        length = {"Content-Length": str(sum(map(len, parts)))}
        super().__init__(None, status, {**(headers or {}), **length}, media_type)
        self._parts = parts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the ASGI specification."""
        await send({"type": "http.response.start", "status": self.status_code, "headers": self.raw_headers})
        if scope["method"] != "HEAD":
            for piece in self._pieces():
                await send({"type": "http.response.body", "body": piece, "more_body": True})
        await send({"type": "http.response.body", "body": b""})

    def _pieces(self) -> Iterator[bytes]:
        for part in self._parts:
            if len(part) <= PIECE:
                yield part
            else:
                yield from (part[start : start + PIECE] for start in range(0, len(part), PIECE))
