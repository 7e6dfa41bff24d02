"""Clients that send too much, too slowly or not at all, or do not read: other clients are served meanwhile."""

from __future__ import annotations

import json
import resource
import socket
import time
import urllib.error
import urllib.request
import uuid
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any

import httpx
import pytest

from api.base.byte_budget import Traffic
from api.base.errors import Overloaded
from api.base.settings import Settings
from api.http.transport.senders import client_of
from api.process import within_open_files
from tests.api.conftest import running_service, wait_until
from tests.api.http.transport.raw_connections import PATIENCE, connect, problem, received
from tests.api.requests import joint, plan_request

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.api.conftest import RunningService

SETTINGS: dict[str, Any] = {
    "workers": 1,
    "max_connections": 12,
    "max_connections_per_client": 6,
    "max_header_bytes": 4096,
    "header_timeout": 0.4,
    "body_timeout": 0.4,
    "write_timeout": 0.8,
    "max_bytes_in_flight": 2**24,
    "keep_alive_timeout": 1,
    "trusted_proxies": "::1, 127.0.0.0/8",
}
PLAN = "/v1/trajectories"
HEAD = b"POST /v1/trajectories HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


@pytest.fixture(scope="module")
def wary(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """A service with short timeouts and few connections."""
    with running_service(tmp_path_factory.mktemp("wary") / "log.jsonl", **SETTINGS) as service:
        yield service
        service.client.close()
        assert "Traceback" not in service.log.read_text()


@pytest.fixture(autouse=True)
def _only_the_connections_of_the_test(wary: RunningService) -> None:
    """Replace the shared client, whose idle connections would count for a second."""
    wary.client.close()
    wary.client = httpx.Client(base_url=wary.url, timeout=60.0, trust_env=False)


def test_a_header_without_end_is_refused_at_once(wary: RunningService) -> None:
    """120 MB of it held every client for 15 s."""
    client = connect(wary, b"GET /livez HTTP/1.1\r\nX: ")
    client.sendall(b"a" * 2**23)
    refusal = problem(received(client))
    assert (refusal["code"], refusal["status"]) == ("header_too_large", 431)
    assert wary.client.get("/livez").status_code == 200


@pytest.mark.parametrize("lines", [b"X: %s\r\n" % (b"a" * 100_000), b"a: b\r\n" * 20_000], ids=["long", "many"])
def test_a_head_that_comes_at_once_is_bounded(wary: RunningService, lines: bytes) -> None:
    refusal = problem(received(connect(wary, b"GET /livez HTTP/1.1\r\nHost: localhost\r\n" + lines + b"\r\n")))
    assert refusal["code"] == "header_too_large"


@pytest.mark.parametrize(
    ("sent", "part"),
    [
        (b"GET /livez HT", "head"),
        (HEAD, "head"),
        (HEAD + b"Content-Length: 100\r\n\r\n{", "body"),
        (HEAD + b"Transfer-Encoding: chunked\r\n\r\n5\r\n{", "body"),
        (b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\nGET ", "head"),
    ],
    ids=["line", "head", "body", "chunk", "second head"],
)
def test_what_is_not_sent_to_its_end_is_given_up(wary: RunningService, sent: bytes, part: str) -> None:
    """Each held a connection for a minute, without a count."""
    answer = received(connect(wary, sent))
    refusal = problem(answer[answer.rindex(b"HTTP/1.1 ") :])
    assert (refusal["code"], refusal["status"]) == ("request_timeout", 408)
    assert f"The {part} of the request" in refusal["detail"]


def test_a_body_that_comes_in_drops_is_given_up(wary: RunningService) -> None:
    client = connect(wary, HEAD + b"Content-Length: 1000\r\n\r\n")
    client.settimeout(0.05)
    answer = b""
    while not answer:
        client.sendall(b" ")
        with suppress(TimeoutError):
            answer = client.recv(65536)
    client.settimeout(PATIENCE)
    assert problem(answer + received(client))["code"] == "request_timeout"


def test_a_body_that_nobody_asked_for_does_not_hold_its_connection(wary: RunningService) -> None:
    """The answer is there before the body has come: what of it is still missing is not waited for."""
    answer = received(connect(wary, b"GET /livez HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{"))
    assert answer.startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize(
    ("headers", "status"), [({"Content-Type": "application/json"}, 413), ({}, 415)], ids=["too large", "no JSON"]
)
def test_a_client_that_writes_first_and_reads_then_gets_its_refusal(
    service: RunningService, headers: dict[str, str], status: int
) -> None:
    """urllib and others got a broken pipe: the connection ended while they were still sending."""
    body = b" " * 16 * 2**20
    request = urllib.request.Request(f"{service.url}{PLAN}", body, headers)  # noqa: S310 - to a service of the tests
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with pytest.raises(urllib.error.HTTPError) as refused:
        opener.open(request, timeout=PATIENCE)
    with refused.value:
        assert (refused.value.code, json.load(refused.value)["status"]) == (status, status)


def test_a_refused_client_that_never_stops_sending_is_cut_off(wary: RunningService) -> None:
    client = connect(wary, HEAD + b"Connection: close\r\nContent-Length: 99999999999\r\n\r\n")
    with pytest.raises(ConnectionError), client:
        while True:
            client.sendall(b" " * 2**16)


@pytest.mark.parametrize(
    "sent",
    [
        b"GET /liv",
        HEAD,
        HEAD + b"Content-Length: 100\r\n\r\n{",
        HEAD + b"Content-Length: 1000000\r\n\r\n" + b" " * 300_000,
        HEAD + b"Transfer-Encoding: chunked\r\n\r\n5\r\n{",
    ],
    ids=["line", "head", "body", "large body", "chunk"],
)
def test_a_request_that_the_client_ends_in_the_middle_is_refused(wary: RunningService, sent: bytes) -> None:
    client = connect(wary, sent)
    client.shutdown(socket.SHUT_WR)
    refusal = problem(received(client))
    assert (refusal["code"], refusal["status"]) == ("malformed_request", 400)
    assert wary.client.get("/livez").status_code == 200


def test_a_connection_that_the_client_half_closes_without_a_request_ends(wary: RunningService) -> None:
    client = connect(wary)
    client.shutdown(socket.SHUT_WR)
    assert received(client) == b""


@pytest.mark.parametrize("pipelined", [1, 2])
def test_a_client_that_half_closes_after_its_request_is_answered(wary: RunningService, pipelined: int) -> None:
    """The service mistook the client for a closed one, aborted its plan and closed the connection unanswered."""
    body = json.dumps(plan_request(waypoints=POSITIONS, sample_period=2e-3)).encode()
    client = connect(wary, (HEAD + b"Content-Length: %d\r\n\r\n" % len(body) + body) * pipelined)
    client.shutdown(socket.SHUT_WR)
    answer = received(client).replace(b"HTTP/1.1 100 Continue\r\n\r\n", b"")
    assert answer.count(b"HTTP/1.1 200 ") == pipelined
    assert answer.count(b'"certificate"') == pipelined


def test_idle_connections_are_closed(wary: RunningService) -> None:
    assert received(connect(wary)) == b""
    assert received(connect(wary, b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n")).startswith(b"HTTP/1.1 200")


@pytest.mark.parametrize(
    "sent",
    [
        b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n",
        b"GET /livez HTTP/1.1\r\n\r\n",
        b"nonsense\r\n\r\n",
        HEAD + b"Content-Length: x\r\n\r\n",
        HEAD + b"Content-Length: 3\r\nContent-Length: 4\r\n\r\n{}",
        HEAD + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n",
        HEAD + b"Content-Length: 2\r\nTransfer-Encoding: chunked\r\n\r\n2\r\n{}\r\n0\r\n\r\n",
        HEAD + b"Transfer-Encoding: chunked\r\n\r\n" + b"1\r\n \r\n" * 20_000,
    ],
    ids=["TLS", "no host", "no method", "length", "two lengths", "chunk", "length and chunks", "pieces"],
)
def test_what_is_not_http_is_told_so_in_a_problem_document(wary: RunningService, sent: bytes) -> None:
    refusal = problem(received(connect(wary, sent)))
    assert (refusal["code"], refusal["status"]) == ("malformed_request", 400)


@pytest.mark.parametrize("upgrade", [b"h2c", b"websocket"])
def test_a_request_that_offers_an_upgrade_keeps_its_body(wary: RunningService, upgrade: bytes) -> None:
    """As Java's standard client sends all its requests, and `curl --http2`."""
    body = json.dumps(plan_request()).encode()
    offer = b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: %s\r\nHTTP2-Settings: AAEAAEAAAAIAAAAA\r\n" % upgrade
    sent = HEAD + offer + b"Content-Length: %d\r\n\r\n" % len(body) + body
    goes_on = b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    assert received(connect(wary, sent + goes_on)).count(b"HTTP/1.1 200 ") == 2


def test_connections_of_one_client_and_of_all_are_counted(wary: RunningService) -> None:
    """300 half-open connections blocked a service that may have 256 open files."""
    with ExitStack() as stack:
        for _ in range(6):
            stack.enter_context(connect(wary, b"GET", "127.0.0.2"))
        seventh = problem(received(connect(wary, b"", "127.0.0.2")))
        assert (seventh["code"], seventh["status"]) == ("too_many_requests", 429)
        alive = b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
        other = received(connect(wary, alive, "127.0.0.3"))
        assert other.startswith(b"HTTP/1.1 200")
        for _ in range(6):
            stack.enter_context(connect(wary, b"GET", "127.0.0.4"))
        answer = received(connect(wary, b"", "127.0.0.5"))
        assert (problem(answer)["code"], problem(answer)["status"]) == ("overloaded", 503)
        assert b"Retry-After: 1\r\n" in answer
    wait_until(lambda: httpx.get(f"{wary.url}/livez", trust_env=False).status_code == 200)


POSITIONS = [joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5, duration=20.0)]
LARGE = plan_request(waypoints=POSITIONS, sample_period=5e-4)
"""A request whose answer has 8 MB."""


def ask_for_much(service: RunningService) -> socket.socket:
    """Return a client with a small buffer of its own, to which 8 MB are being sent."""
    body = json.dumps(LARGE).encode()
    client = connect(service)
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
    client.sendall(HEAD + b"Connection: close\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
    return client


def test_an_answer_that_nobody_reads_is_given_up(wary: RunningService) -> None:
    """Each of them stayed in the memory of the server, for good."""
    client = ask_for_much(wary)
    wait_until(lambda: "write_timeout" in wary.log.read_text(), PATIENCE)
    answer = received(client)
    length = int(answer.lower().partition(b"content-length: ")[2].partition(b"\r\n")[0])
    assert len(answer) < length
    assert wary.client.get("/livez").status_code == 200


def test_answers_that_nobody_reads_fill_no_more_than_their_room(wary: RunningService) -> None:
    """24 connections of 400 bytes each made the server hold 1.8 GB."""
    with ask_for_much(wary) as client:
        client.recv(1)  # the answer is there
        refused = wary.post(PLAN, LARGE)
        assert (refused.status_code, refused.json()["code"]) == (503, "overloaded")
        assert int(refused.headers["Retry-After"]) > 0
        assert wary.post(PLAN, plan_request()).status_code == 200
    wait_until(lambda: wary.post(PLAN, LARGE).status_code == 200, PATIENCE)


def test_the_bytes_of_requests_are_counted_until_they_are_done() -> None:
    traffic = Traffic(10)
    first, second = traffic.share("a"), traffic.share("b")
    first.hold(4)
    second.hold(3)
    with pytest.raises(Overloaded):
        first.hold(1)
    second.release()
    second.release()
    first.hold(1)
    assert traffic.held == 5


def test_no_client_holds_more_bytes_than_it_leaves_to_others() -> None:
    """Six slow readers caused the refusal of all other requests for a quarter of an hour: 294 of 294."""
    traffic, room = Traffic(1200), []
    for client in "abc":
        shares = [traffic.share(client) for _ in range(1200)]
        for share in shares:
            with suppress(Overloaded):
                share.hold(1)
        room.append(traffic.held)
    assert room == [600, 900, 1050]  # each time half of what the others have left
    late = traffic.share("late")
    late.hold(75)
    late.release()
    assert traffic.held == 1050


def test_an_answer_that_is_read_slowly_but_steadily_arrives(wary: RunningService) -> None:
    """The answer takes longer than the time limit for one MiB, which applies to each MiB."""
    client = ask_for_much(wary)
    answer = bytearray()
    with client:
        while part := client.recv(2**17):
            answer += part
            time.sleep(0.015)
    head, _, document = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 200")
    assert json.loads(document)["certificate"]["satisfied"]


@pytest.mark.parametrize(
    ("limits", "asked", "connections"),
    [
        ((1024, 4096), (1100, 4096), 1024),  # the process asks for more open files
        ((128, 256), (256, 256), 180),  # it is not given as many as it needs
        ((2000, 4096), None, 1024),
        ((-1, -1), None, 1024),
        ((1024, -1), (1100, -1), 1024),
        ((16, 16), None, 1),
    ],
)
def test_there_are_no_more_connections_than_open_files(
    monkeypatch: pytest.MonkeyPatch, limits: tuple[int, int], asked: tuple[int, int] | None, connections: int
) -> None:
    """With 256 open files, 300 half-open connections shut everybody out."""
    calls = []
    monkeypatch.setattr(resource, "getrlimit", lambda _: limits)
    monkeypatch.setattr(resource, "setrlimit", lambda _, new: calls.append(new))
    settings = within_open_files(Settings(workers=2, express_workers=1, max_connections=1024))
    assert settings.max_connections == connections
    assert [call for call in calls if call != limits] == ([] if asked is None else [asked])


def test_clients_are_told_apart_by_what_they_cannot_choose() -> None:
    assert client_of("192.0.2.1") == client_of("::ffff:192.0.2.1") != client_of("192.0.2.2")
    assert client_of("2001:db8::1") == client_of("2001:db8::ffff:1") != client_of("2001:db8:0:1::1")
    assert client_of("") == ""


def client_in_the_log(service: RunningService, forwarded_for: str) -> str:
    request_id = uuid.uuid4().hex
    service.client.get("/livez", headers={"X-Forwarded-For": forwarded_for, "X-Request-ID": request_id})
    client: str = service.line_of(request_id)["client"]
    return client


def test_nobody_chooses_the_address_that_is_counted(service: RunningService) -> None:
    """The service trusted the header of every local program, so that one program could pose as many clients."""
    assert client_in_the_log(service, "203.0.113.7") == "127.0.0.1"


@pytest.mark.parametrize("sent_by_the_client", ["", "198.51.100.1, "])
def test_a_trusted_proxy_names_the_client(wary: RunningService, sent_by_the_client: str) -> None:
    """The proxy appends its client's address; the client itself may have written all earlier addresses."""
    assert client_in_the_log(wary, f"{sent_by_the_client}203.0.113.7") == "203.0.113.7"
