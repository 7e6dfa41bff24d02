"""Private parts of uvicorn, h11 and Python that the service uses; a test names each missing one."""

from __future__ import annotations

import inspect
from multiprocessing import forkserver
from typing import Any

import h11
import pytest
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

from api.http.transport import connections

METHODS = (
    "connection_made",
    "connection_lost",
    "data_received",
    "eof_received",
    "handle_events",
    "send_400_response",
    "on_response_complete",
    "shutdown",
    "pause_writing",
    "resume_writing",
    "timeout_keep_alive_handler",
    "_unset_keepalive_if_required",
    "_unsupported_upgrade_warning",
)
"""The methods of uvicorn's connection that `Connection` replaces or calls."""


@pytest.mark.parametrize("name", METHODS)
def test_uvicorns_connection_has_the_methods_that_ours_replaces_or_calls(name: str) -> None:
    assert callable(getattr(H11Protocol, name, None)), (
        f"uvicorn's H11Protocol has no {name} any more, see api/http/transport/connections.py: it replaces or calls it"
    )


@pytest.mark.parametrize(
    ("of", "name"),
    [
        (H11Protocol, "conn"),
        (H11Protocol, "cycle"),
        (H11Protocol, "scope"),
        (H11Protocol, "connections"),
        (H11Protocol, "timeout_keep_alive_task"),
        (RequestResponseCycle, "disconnected"),
        (RequestResponseCycle, "message_event"),
        (RequestResponseCycle, "response_complete"),
        (RequestResponseCycle, "transport"),
        (RequestResponseCycle, "scope"),
    ],
    ids=lambda value: str(getattr(value, "__name__", value)),
)
def test_uvicorn_keeps_the_state_that_our_connection_reads(of: Any, name: str) -> None:
    assert f"self.{name} = " in inspect.getsource(of) or f"self.{name}: " in inspect.getsource(of), (
        f"uvicorn's {of.__name__} has no {name} any more: see api/http/transport/connections.py, which reads or sets it"
    )


def test_our_connection_overrides_what_uvicorn_calls_for_an_upgrade() -> None:
    assert "self._unsupported_upgrade_warning()" in inspect.getsource(H11Protocol), (
        "uvicorn no longer warns by _unsupported_upgrade_warning: look for its new name, or Java's clients fill the log"
    )


def test_an_answer_is_written_to_the_transport_of_its_cycle() -> None:
    """`Farewell` takes its place, so that a client may finish its body."""
    assert "self.transport.write(" in inspect.getsource(RequestResponseCycle), (
        "uvicorn's RequestResponseCycle no longer writes to its transport: Farewell in connections.py sees no answer"
    )
    assert {"write", "is_closing", "resume_reading", "close"} <= set(connections.Farewell.__init__.__code__.co_names)


def test_h11_says_what_has_not_been_parsed() -> None:
    parser = h11.Connection(h11.SERVER)
    parser.receive_data(b"GET /liv")
    assert parser.next_event() is h11.NEED_DATA
    assert parser.trailing_data == (b"GET /liv", False), "h11's trailing_data no longer shows an unfinished head"
    assert parser.states == {h11.CLIENT: h11.IDLE, h11.SERVER: h11.IDLE}, "h11's states have other names"


@pytest.mark.parametrize(("header", "pieces"), [("Content-Length", 1), ("Transfer-Encoding", 2)])
def test_the_head_of_an_answer_of_known_length_leaves_with_its_body(header: str, pieces: int) -> None:
    """A head without a length leaves at once: the first event of a stream may come later."""
    parser = connections.BoundedParser(h11.SERVER)
    parser.receive_data(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
    assert isinstance(parser.next_event(), h11.Request)
    headers = [(header, "2" if header == "Content-Length" else "chunked")]
    events = (h11.Response(status_code=200, headers=headers), h11.Data(data=b"ok"), h11.EndOfMessage())
    head, body, end = map(parser.send, events)
    assert sum(b"HTTP/1.1 200" in piece or b"ok" in piece for piece in (head, body)) == pieces
    assert (head + body + end).startswith(b"HTTP/1.1 200 \r\n") and b"ok" in body, (
        "h11's send no longer calls send_with_data_passthrough: see BoundedParser in connections.py"
    )


def test_python_tells_the_process_that_workers_are_forked_from() -> None:
    assert hasattr(forkserver._forkserver, "_forkserver_pid"), (
        "Python's fork server has no _forkserver_pid any more: see stop_template in api/pool/worker.py"
    )
