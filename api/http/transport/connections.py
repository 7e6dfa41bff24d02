"""uvicorn's connections with bounds on their number, the size of heads and the time of clients."""

from __future__ import annotations

from collections import Counter
from http import HTTPStatus
from typing import TYPE_CHECKING, ClassVar

import h11
import structlog
from typing_extensions import override
from uvicorn.protocols.http.h11_impl import H11Protocol

from api.base.content_policies import security_headers
from api.base.errors import HeaderTooLarge, MalformedRequest, Overloaded, RequestTimeout, TooManyRequests
from api.base.problem_documents import MEDIA_TYPE, problem_document
from api.http.transport.senders import client_of, request_id
from api.http.transport.shedding import ALIVE, LIVENESS
from api.pool.jobs import queue_is_full

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Mapping, Sequence

    from api.base.errors import ServiceError
    from api.base.settings import Settings
    from api.http.transport.shedding import Place, Shedding, WholeRequest
    from api.telemetry.metrics import Metrics

LINGER = 1.0
"""The time for which a connection stays after a refusal, s: closing it while the client still writes would throw the
refusal away."""

DRAIN_BODIES = 1.0
"""The time that a body under way has to arrive once the service begins to stop, s; most take a hundredth of it."""

MOST_PIECES = 16_384
"""The most pieces in which a body may come: each takes microseconds of the server, even a single byte. The largest body
has 256 bytes in each."""

PROBE_SECONDS = 0.2
"""The time between two looks whether a client that sends no more still waits for its answer, s."""

RETRY_AFTER = {"Retry-After": "1"}
"""The header with the time after which to retry, s, where too many requests or connections are there."""

SURPLUS = 16
"""The connections beyond the bound that may still request `/livez`: an orchestrator must not kill a busy service."""

log = structlog.get_logger()


def bounded_connections(settings: Settings, metrics: Metrics, shedding: Shedding) -> type[Connection]:
    """Make the class of the connections of one service; it is what uvicorn's `http` takes."""
    members = {"settings": settings, "metrics": metrics, "shedding": shedding, "clients": Counter()}
    return type("Connection", (Connection,), members)


class BoundedParser(h11.Connection):
    """h11's state of a connection, which takes a body in so many pieces at most.

    The head of an answer of known length leaves with the first bytes of its body: one packet wakes the client once.
    """

    _pieces = 0
    _head: Sequence[bytes] = ()

    @override
    def next_event(self) -> h11.Event | type[h11.NEED_DATA] | type[h11.PAUSED]:
        """Give the next event, or raise RemoteProtocolError."""
        event = super().next_event()
        if isinstance(event, h11.Request):
            self._pieces = 0
            if {b"content-length", b"transfer-encoding"} <= {name for name, _ in event.headers}:
                raise h11.RemoteProtocolError("two servers may not agree where the request ends (RFC 9112, 6.1)")
        self._pieces += isinstance(event, h11.Data)
        if self._pieces > MOST_PIECES:
            raise h11.RemoteProtocolError("the body comes in too many pieces")
        return event

    @override
    def send_with_data_passthrough(self, event: h11.Event) -> list[bytes] | None:
        """Give the bytes to write for an event, which `send` joins."""
        pieces = super().send_with_data_passthrough(event)
        if pieces is None:
            return None
        if isinstance(event, h11.Response) and any(name == b"content-length" for name, _ in event.headers):
            self._head = pieces
            return []
        head, self._head = self._head, ()
        return [*head, *pieces]


class Farewell:
    """The transport that uvicorn writes an answer to; before it closes, it reads the rest of the request."""

    def __init__(self, connection: Connection) -> None:
        self.write = connection.transport.write
        self.is_closing = connection.transport.is_closing
        self.resume_reading = connection.transport.resume_reading
        self.close = connection.end


class Connection(H11Protocol):
    """One connection. Whatever it is refused for, the client gets a problem document, and the connection ends.

    Attributes:
        settings: The settings of the operator.
        metrics: What counts refusals.
        shedding: What decides which requests are refused unparsed.
        clients: The number of connections of each client.
    """

    settings: ClassVar[Settings]
    metrics: ClassVar[Metrics]
    shedding: ClassVar[Shedding]
    clients: ClassVar[Counter[str]]

    @override
    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Count the connection, and refuse it if there are too many."""
        super().connection_made(transport)
        self.conn = BoundedParser(h11.SERVER, self.settings.max_header_bytes)
        self._reading: object = None
        self._refused = False
        self._is_surplus = False
        self._place: Place | None = None
        self._refusing: asyncio.Task[None] | None = None
        self._read_timer: asyncio.TimerHandle | None = None
        self._write_timer: asyncio.TimerHandle | None = None
        self._probe_timer: asyncio.TimerHandle | None = None
        self._is_half_closed = False
        self._peer = self.client[0] if self.client else ""
        self._name = client_of(self._peer)
        self.clients[self._name] += 1
        if len(self.connections) > self.settings.max_connections + SURPLUS:
            self._refuse(too_many_connections(), linger=0.0)
        elif len(self.connections) > self.settings.max_connections:
            self._is_surplus = True
            self._read_timer = self.loop.call_later(LINGER, self._refuse, too_many_connections(), 0.0)
        elif self.clients[self._name] > self.settings.max_connections_per_client:
            self._refuse(
                TooManyRequests("This client has too many connections. Retry after 1 s.", headers=RETRY_AFTER),
                linger=0.0,
            )
        else:
            self._watch_reading()

    @override
    def connection_lost(self, exc: Exception | None) -> None:
        """Count the connection no longer."""
        super().connection_lost(exc)
        self._leave_place()
        if self._refusing is not None:
            self._refusing.cancel()
        for timer in (self._read_timer, self._write_timer, self._probe_timer):
            _cancel(timer)
        self.clients[self._name] -= 1
        if not self.clients[self._name]:
            del self.clients[self._name]

    @override
    def data_received(self, data: bytes) -> None:
        """Take data in pieces: a head is seen to be too large before it is parsed."""
        if self._is_surplus:
            self._answer_liveness_only(data)
            return
        request = self.shedding.whole_request(data, self._peer) if self._is_between_requests else None
        if request is not None and not self.shedding.has_room(request.client):
            self._shed(request)
            return
        size = self.settings.max_header_bytes
        for start in range(0, len(data), size):
            if not self._refused:
                super().data_received(data[start : start + size])
        if request is not None and self.cycle is not None and not self._refused:
            self._place = self.cycle.scope["state"]["place"] = self.shedding.enter(request.client)

    @property
    def _is_between_requests(self) -> bool:
        """Whether the next byte begins a request that may be answered at once."""
        is_idle = self.conn.their_state is h11.IDLE and self.conn.our_state is h11.IDLE
        is_answered = self.cycle is None or self.cycle.response_complete
        return is_idle and is_answered and not self._refused and not self.conn.trailing_data[0]

    def _leave_place(self) -> None:
        if self._place is not None:
            self._place.leave()

    def _answer_liveness_only(self, data: bytes) -> None:
        """Answer a surplus connection that requests the liveness, and refuse every other."""
        if self._refused:
            return
        if LIVENESS.fullmatch(data) is None:
            self._refuse(too_many_connections(), linger=0.0)
            return
        self._refused = True
        _cancel(self._read_timer)
        self.transport.write(_raw_answer(HTTPStatus.OK, "application/json", ALIVE, {"Connection": "close"}))
        self.transport.close()

    def _shed(self, request: WholeRequest) -> None:
        """Refuse a request that was not parsed, now or as soon as refusals may be sent; the connection goes on."""
        self._unset_keepalive_if_required()
        _cancel(self._read_timer)
        self.transport.pause_reading()
        self._refusing = self.loop.create_task(self._send_shed(request))

    async def _send_shed(self, request: WholeRequest) -> None:
        await self.shedding.wait()
        self._refusing = None
        self.shedding.count()
        if self.transport.is_closing():
            return
        refusal = queue_is_full()
        status, document = problem_document(refusal, request.path)
        given = (line.partition(b":") for line in request.head.split(b"\r\n")[1:])
        id_ = request_id((name.lower(), value.strip()) for name, _, value in given)
        headers = {**refusal.headers, "X-Request-ID": id_, "Server-Timing": "total;dur=0.000"}
        self.transport.write(_raw_answer(status, MEDIA_TYPE, document, headers))
        self.timeout_keep_alive_task = self.loop.call_later(self.timeout_keep_alive, self.timeout_keep_alive_handler)
        self.transport.resume_reading()

    @override
    def handle_events(self) -> None:
        """Handle the bytes that arrived, and watch the time of the rest."""
        super().handle_events()
        if self.cycle is not None:
            self.cycle.transport = Farewell(self)  # type: ignore[assignment]  # before the application has begun
        if not self._refused:
            self._watch_reading()

    def _watch_reading(self) -> None:
        """Start the time within which the client must send the rest of a head or a body that has begun."""
        state = self.conn.their_state
        is_idle = state is h11.IDLE and self.cycle is not None and not self.conn.trailing_data[0]
        reading = None if is_idle else (state, self.cycle)  # uvicorn itself ends connections that are idle for long
        if reading is not None and reading == self._reading:
            return
        self._reading = reading
        _cancel(self._read_timer)
        if state is h11.SEND_BODY:
            self._read_timer = self.loop.call_later(self.settings.body_timeout, self._give_up_reading)
        elif state is h11.IDLE and not is_idle:
            self._read_timer = self.loop.call_later(self.settings.header_timeout, self._give_up_reading)

    def _give_up_reading(self) -> None:
        if self.conn.their_state is h11.IDLE and not self.conn.trailing_data[0]:  # nothing has been asked
            self.transport.close()
            return
        part = "body" if self.conn.their_state is h11.SEND_BODY else "head"
        self._refuse(RequestTimeout(f"The {part} of the request did not arrive in time."))

    @override
    def send_400_response(self, msg: str) -> None:
        """Refuse what cannot be parsed."""
        if len(self.conn.trailing_data[0]) > self.settings.max_header_bytes:
            most = self.settings.max_header_bytes
            self._refuse(HeaderTooLarge(f"The head of a request must have at most {most} bytes."))
        else:
            self._refuse(MalformedRequest("The request must follow HTTP/1.1."))

    def _refuse(self, error: ServiceError, linger: float = LINGER) -> None:
        """Send a problem document in place of the application's answer, and end the connection."""
        self._refused = True
        _cancel(self._read_timer)
        log.info("connection_refused", code=error.code, client=self._name)
        self.metrics.count_refused_connection(error.code)
        under_way = self.cycle is not None and not self.cycle.response_complete
        if under_way:  # the application is waiting for the body
            self.cycle.disconnected = True
            self.cycle.message_event.set()
        if self.conn.our_state not in (h11.IDLE, h11.SEND_RESPONSE):  # there is an answer already
            self.transport.abort()
            return
        status, document = problem_document(error, self.scope["path"] if under_way else "")
        self.transport.write(_raw_answer(status, MEDIA_TYPE, document, {"Connection": "close", **error.headers}))
        if linger:
            self._linger(linger)
        else:
            self.transport.close()

    @override
    def eof_received(self) -> bool:  # type: ignore[override]
        """Answer the complete request of a client that sends no more; refuse an incomplete one.

        A client that has gone looks the same: only a write to it shows that.
        """
        is_first, self._is_half_closed = not self._is_half_closed, True
        under_way = self.cycle is not None and not self.cycle.response_complete
        is_cut = self.conn.their_state is h11.SEND_BODY or (not under_way and self.conn.trailing_data[0] != b"")
        if self._refused:
            return False
        if is_cut and self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            self._refuse(MalformedRequest("The request ended before it was complete."), linger=0.0)
        elif under_way and is_first:
            self._probe()
        return under_way and not self._refused

    def _probe(self) -> None:
        """Write bytes that a waiting client skips, which end the connection of one that has gone."""
        if self.transport.is_closing() or self.cycle.response_complete or self.scope["http_version"] == "1.0":
            return
        if self.conn.our_state is h11.SEND_RESPONSE:
            self.transport.write(b"HTTP/1.1 100 Continue\r\n\r\n")
        self._probe_timer = self.loop.call_later(PROBE_SECONDS, self._probe)

    def end(self) -> None:
        """End the connection after an answer. A client that writes first and reads then may finish its body."""
        if self.conn.their_state is h11.SEND_BODY and not self._is_half_closed:
            self._refused = True
            self._linger(self.settings.body_timeout)
        else:
            self.transport.close()

    def _linger(self, seconds: float) -> None:
        """Read on without a look at it, until the client ends the connection or the time is over."""
        _cancel(self._read_timer)
        self.transport.write_eof()
        self.transport.resume_reading()
        self._read_timer = self.loop.call_later(seconds, self.transport.abort)

    @override
    def shutdown(self) -> None:
        """Finish the requests under way; an incomplete body gets a short time."""
        super().shutdown()
        if self.cycle is not None:
            self.cycle.scope["state"]["stopping"] = True  # for answers that would not end by themselves
        if self.conn.their_state is h11.SEND_BODY and not self._refused:
            _cancel(self._read_timer)
            stopping = Overloaded("The service is stopping. Retry after 1 s.", headers=RETRY_AFTER)
            self._read_timer = self.loop.call_later(DRAIN_BODIES, self._refuse, stopping)

    @override
    def pause_writing(self) -> None:
        """Start the time within which the client must take the written bytes."""
        super().pause_writing()
        self._watch_writing()

    @override
    def resume_writing(self) -> None:
        """Stop that time: the client has taken it."""
        super().resume_writing()
        _cancel(self._write_timer)

    @override
    def on_response_complete(self) -> None:
        """Go on with the next request; the last bytes of an answer must be taken in time, too."""
        super().on_response_complete()
        self._leave_place()
        if self._refused:
            self._unset_keepalive_if_required()  # there is no next one
        elif self._is_half_closed and self.cycle.response_complete:
            self.transport.close()
        self._watch_writing()

    def _watch_writing(self) -> None:
        _cancel(self._write_timer)
        if self.transport.get_write_buffer_size():
            self._write_timer = self.loop.call_later(self.settings.write_timeout, self._give_up_writing)

    def _give_up_writing(self) -> None:
        if self.transport.get_write_buffer_size():
            log.info("connection_refused", code="write_timeout", client=self._name)
            self.metrics.count_refused_connection("write_timeout")
            self.transport.abort()

    @override
    def _unsupported_upgrade_warning(self) -> None:
        """Say nothing: Java's client and `curl --http2` offer an upgrade with every request, and do well without."""


def too_many_connections() -> Overloaded:
    """Make the refusal of a connection beyond their bound."""
    return Overloaded("The service has too many connections. Retry after 1 s.", headers=RETRY_AFTER)


def _raw_answer(status: int, media_type: str, body: bytes, headers: Mapping[str, str]) -> bytes:
    """Write an answer that no application makes."""
    length = {"Content-Type": media_type, "Content-Length": str(len(body))}
    fields = {**length, **security_headers(media_type), **headers}
    lines = [f"HTTP/1.1 {status} {HTTPStatus(status).phrase}", *(f"{name}: {text}" for name, text in fields.items())]
    return "\r\n".join([*lines, "\r\n"]).encode() + body


def _cancel(timer: asyncio.TimerHandle | None) -> None:
    if timer is not None:
        timer.cancel()
