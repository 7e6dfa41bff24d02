"""Answers that are the same for all who ask the same: computed once for those who ask at once, and kept for a while."""

from __future__ import annotations

import asyncio
import hashlib
import time
from collections import OrderedDict
from dataclasses import dataclass, replace
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from api.base.codings import IDENTITY
from api.base.errors import DeadlineExceeded, Overloaded
from api.base.version import service_version
from api.http.transport.senders import has_key

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from api.base.byte_budget import Traffic
    from api.base.codings import Coding
    from api.pool.messages import Reply
    from api.telemetry.metrics import Metrics

LARGEST_SHARE = 8
"""The share of the room that one answer may take, as its divisor: a large one must not push out all others."""

OVERHEAD = 2048
"""The bytes that an answer takes besides its body, about: its tag, its headers and the objects that hold them."""


@dataclass
class Flight:
    """An answer that is being computed, and the number of requests that wait for it."""

    work: asyncio.Task[Reply]
    waiting: int = 0


class SharedAnswers:
    """The answers of operations whose answer follows from the request, the robot and the version alone.

    The tag of a request is made from everything that its answer follows from. That is the bytes of the body and the
    arguments that the server adds, as the definition of an added robot. So no client gets an answer for another robot
    of the same id. Two keys share no answer: a quick answer would reveal that another client sent the same request.

    Args:
        traffic: The bytes that the server holds.
        most_bytes: The most bytes of answers that are kept.
        metrics: What counts the answers that needed no computing.
    """

    def __init__(self, traffic: Traffic, most_bytes: int, metrics: Metrics) -> None:
        self._traffic = traffic
        self._most_bytes = most_bytes
        self._metrics = metrics
        self._version = service_version().encode()
        self._under_way: dict[str, Flight] = {}
        self._kept: OrderedDict[str, Reply] = OrderedDict()
        self.bytes_kept = 0

    def tag(self, operation: str, body: bytes, arguments: Mapping[str, Any], coding: Coding = IDENTITY) -> str:
        """Make the entity tag of an answer: a weak one, as machines may round the last digit differently.

        Each coding has its own: a client that cannot read an answer gets it neither kept nor joined.
        """
        digest = hashlib.sha256()
        named = [value if isinstance(value, bytes) else repr(value).encode() for _, value in sorted(arguments.items())]
        names = repr(sorted(arguments)).encode()
        for part in (self._version, operation.encode(), repr(coding).encode(), names, *named, body):
            digest.update(len(part).to_bytes(8))
            digest.update(part)
        return f'W/"{digest.hexdigest()}"'

    async def answer(
        self, tag: str, deadline: float, client: str, compute: Callable[[Callable[[int], None]], Awaitable[Reply]]
    ) -> Reply:
        """Give the answer with a tag: a kept one, one under way, or one that is computed now.

        Who hangs up while others wait takes nothing from them. Where a request that is being computed is refused for
        want of time or room, the requests that wait for it start again.

        Args:
            tag: The tag.
            deadline: When the answer must be there, s on the monotonic clock.
            client: The client whose bytes the answer counts as while it is computed.
            compute: What computes it, given what counts the bytes of the answer; it keeps the deadline.

        Raises:
            ServiceError: What `compute` raises.
        """
        tag = _shared_by(tag, client)
        while (flight := self._under_way.get(tag)) is not None and time.monotonic() < deadline:
            try:
                async with asyncio.timeout(deadline - time.monotonic()):
                    reply = await self._await(tag, flight)
            except (Overloaded, DeadlineExceeded, TimeoutError):
                continue
            self._metrics.count_shared("joined")
            return reply
        if tag in self._kept:
            self._kept.move_to_end(tag)
            self._metrics.count_shared("kept")
            return self._kept[tag]
        flight = self._under_way[tag] = Flight(asyncio.create_task(self._compute(tag, client, compute)))
        flight.work.add_done_callback(lambda _: self._forget(tag, flight))
        return await self._await(tag, flight)

    def is_under_way(self, tag: str, client: str = "") -> bool:
        """Tell whether the answer with a tag is being computed for a client; no name: for clients without a key."""
        return _shared_by(tag, client) in self._under_way

    async def _await(self, tag: str, flight: Flight) -> Reply:
        """Wait for an answer that is being computed; the last one who leaves gives it up."""
        flight.waiting += 1
        try:
            return await asyncio.shield(flight.work)
        finally:
            flight.waiting -= 1
            if flight.waiting == 0:
                flight.work.cancel()
                self._forget(tag, flight)

    def _forget(self, tag: str, flight: Flight) -> None:
        """Let nobody else wait for an answer that has been computed or given up."""
        if self._under_way.get(tag) is flight:
            del self._under_way[tag]

    async def _compute(
        self, tag: str, client: str, compute: Callable[[Callable[[int], None]], Awaitable[Reply]]
    ) -> Reply:
        share = self._traffic.share(client)
        try:
            reply = await compute(share.hold)
        finally:
            share.release()
        if reply.status == HTTPStatus.OK:
            self._keep(tag, reply)
        return reply

    def _keep(self, tag: str, reply: Reply) -> None:
        """Keep an answer, without the times that it took; the least recently used make room."""
        size = len(reply.body) + OVERHEAD
        if size * LARGEST_SHARE > self._most_bytes or tag in self._kept:
            return
        self._kept[tag] = replace(reply, timings={})
        self.bytes_kept += size
        while self.bytes_kept > self._most_bytes:
            _, oldest = self._kept.popitem(last=False)
            self.bytes_kept -= len(oldest.body) + OVERHEAD


def _shared_by(tag: str, client: str) -> str:
    """Name an answer and those who share it: one key, or all clients without."""
    return f"{tag} {client}" if has_key(client) else tag
