"""Load shedding: a request without room in the queue is refused before it is parsed, and at a bounded rate."""

from __future__ import annotations

import asyncio
import re
import time
from collections import Counter
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import unquote

import structlog
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from api.base.api_keys import id_of
from api.base.errors import Overloaded
from api.http.transport.senders import client_of
from api.pool.jobs import has_room

if TYPE_CHECKING:
    from starlette.types import Scope

    from api.base.settings import Settings
    from api.telemetry.metrics import Metrics

REFUSALS_PER_SECOND = 200.0
"""The rate above which refusals are delayed: clients that repeat a refused request at once would otherwise take the
processors that plan."""

LONGEST_DELAY = 1.0
"""The longest delay of a refusal, s: as long as its `Retry-After`."""

MOST_DELAYED = 0.9
"""The share of all connections on which refusals may wait; beyond it they leave at once, and others can connect."""

UNDELAYED = 0.1
"""The delay up to which a refusal leaves at once, s: a burst of some twenty does no harm."""

LOG_SECONDS = 1.0
"""The time between two lines of the log about refused requests, s."""

ALIVE = b'{"status":"alive"}'
"""The answer to `GET /livez` of a service that runs, however busy it is."""

LIVENESS = re.compile(rb"GET /livez HTTP/1\.1\r\n(?:[^\r\n]+\r\n)+\r\n")
"""A whole request for the liveness of the service."""

HEAD = re.compile(rb"(?:POST|PATCH) (/v1/[!-~]*) HTTP/1\.1\r\n(?:[!-9;-~]+:[^\r\n]*\r\n)+\r\n")
"""The head of a request that is refused while there is no room for it."""

LENGTH = re.compile(rb"\r\ncontent-length:[ \t]*(\d{1,12})[ \t]*(?=\r\n)", re.IGNORECASE)
KEY = re.compile(rb"\r\nauthorization:[ \t]*bearer[ \t]+(\S+)[ \t]*\r\n", re.IGNORECASE)
FORWARDED = re.compile(rb"\r\nx-forwarded-for:[ \t]*([^\r\n]*?)[ \t]*(?=\r\n)", re.IGNORECASE)
ONLY_FOR_THE_PARSER = re.compile(rb"\r\n(?:connection|transfer-encoding|expect|origin|upgrade)[ \t]*:", re.IGNORECASE)
"""Headers that only the parser understands."""

log = structlog.get_logger()


class WholeRequest(NamedTuple):
    """A request whose head and body came in one piece, as far as a refusal needs it.

    Attributes:
        path: Its path.
        head: Its head.
        client: The client that sent it.
    """

    path: str
    head: bytes
    client: str


class Place:
    """The place of a request among the requests at workers or in the queue, until `leave`."""

    def __init__(self, under_way: Counter[str], client: str) -> None:
        self._under_way = under_way
        self._client = client
        self._is_taken = True
        under_way[client] += 1

    def leave(self) -> None:
        """Give the place back; again does nothing."""
        if self._is_taken:
            self._is_taken = False
            self._under_way[self._client] -= 1
            if not self._under_way[self._client]:
                del self._under_way[self._client]


def leave_place(scope: Scope) -> None:
    """Give back the place, if any, of a request that needs no worker any more."""
    place: Place | None = scope["state"].get("place")
    if place is not None:
        place.leave()


async def _no_application(scope: Any, receive: Any, send: Any) -> None:
    """Do nothing: of the middleware only the trusted proxies are used."""


class Shedding:
    """Decides which requests are refused unparsed, and when refusals leave.

    Attributes:
        delayed: The number of refusals that wait to be sent.
    """

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self._settings = settings
        self._metrics = metrics
        self._proxies = ProxyHeadersMiddleware(_no_application, list(settings.trusted_proxies)).trusted_hosts
        self._capacity = settings.queue_size + settings.workers + settings.express_workers
        self._under_way: Counter[str] = Counter()
        self._next = 0.0
        self._unlogged = 0
        self._logged = 0.0
        self.delayed = 0

    def whole_request(self, data: bytes, peer: str) -> WholeRequest | None:
        """Return the request if these bytes are exactly one that a worker would have to work on.

        Args:
            data: The first bytes after the request before.
            peer: The address at the other end of the connection: the client's, or a proxy's.
        """
        found = HEAD.match(data)
        if found is None:
            return None
        head = found[0]
        lengths = LENGTH.findall(head)
        if len(lengths) != 1 or found.end() + int(lengths[0]) != len(data) or ONLY_FOR_THE_PARSER.search(head):
            return None
        if self._settings.asks_for_keys:
            key = KEY.search(head)
            key_id = None if key is None else id_of(key[1].decode("latin-1"))
            if key_id is None:
                return None
            client = f"key:{key_id}"
        else:
            client = client_of(self._client_address(head, peer))
        return WholeRequest(unquote(found[1].decode("ascii").partition("?")[0]), head, client)

    def _client_address(self, head: bytes, peer: str) -> str:
        """Return the address of the client, which a trusted proxy names in the head, as uvicorn does for others."""
        forwarded = FORWARDED.findall(head)
        if not forwarded or peer not in self._proxies:
            return peer
        address, _ = self._proxies.get_trusted_client_address(b", ".join(forwarded).decode("latin-1"))
        return address or peer

    def has_room(self, client: str) -> bool:
        """Tell whether a request may go on to the queue, by the rule of the queue itself."""
        return has_room(client, self._under_way, self._capacity)

    def enter(self, client: str) -> Place:
        """Take a place for a request that goes on to the queue."""
        return Place(self._under_way, client)

    def delay(self) -> float:
        """Reserve the time of the next refusal, and return the seconds until then."""
        now = time.monotonic()
        if self.delayed >= MOST_DELAYED * self._settings.max_connections:
            return 0.0
        self._next = min(max(self._next, now) + 1.0 / REFUSALS_PER_SECOND, now + LONGEST_DELAY)
        return self._next - now if self._next - now > UNDELAYED else 0.0

    async def wait(self) -> None:
        """Wait until the next refusal may be sent."""
        self.delayed += 1
        try:
            await asyncio.sleep(self.delay())
        finally:
            self.delayed -= 1

    def count(self) -> None:
        """Count a request that was refused unparsed; the log has a line with their number each second."""
        self._metrics.count_request("none", HTTPStatus.SERVICE_UNAVAILABLE, 0.0, Overloaded.code)
        self._unlogged += 1
        now = time.monotonic()
        if now - self._logged >= LOG_SECONDS:
            log.warning("requests_shed", count=self._unlogged)
            self._unlogged, self._logged = 0, now
