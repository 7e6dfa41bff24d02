"""Requests beyond the queue's capacity: refused unparsed, at a bounded rate, with liveness still answered."""

from __future__ import annotations

import asyncio
import json
import socket
from contextlib import ExitStack, suppress
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from api.base.api_keys import new_key
from api.base.settings import Settings
from api.http.access.access import client_by_address
from api.http.transport import shedding as shedding_module
from api.http.transport.shedding import LONGEST_DELAY, REFUSALS_PER_SECOND, UNDELAYED, Shedding
from api.telemetry.metrics import Metrics
from tests.api.conftest import running_service, wait_until
from tests.api.http.transport.raw_connections import connect, problem, received
from tests.api.requests import plan_request

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from tests.api.conftest import RunningService

HEAD = b"POST /v1/trajectories HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
LIVEZ = b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"


def request(body: bytes, headers: bytes = b"", head: bytes = HEAD) -> bytes:
    return head + headers + b"Content-Length: %d\r\n\r\n" % len(body) + body


@pytest.fixture(scope="module")
def busy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """A service with three places for requests, all taken by stopped workers."""
    settings: dict[str, Any] = {"workers": 2, "express_workers": 0, "queue_size": 1, "max_connections": 8}
    with running_service(tmp_path_factory.mktemp("busy") / "log.jsonl", **settings) as service, ExitStack() as stack:
        for worker in service.workers():
            worker.suspend()
            stack.callback(worker.resume)
        for period in (0.01, 0.02, 0.03):  # three different requests
            body = json.dumps(plan_request(sample_period=period, deadline=60)).encode()
            stack.enter_context(connect(service, request(body)))
        wait_until(lambda: '\nplanner_queue_jobs{lane="requests"} 1.0\n' in service.client.get("/metrics").text)
        yield service
        service.client.close()
        assert "Traceback" not in service.log.read_text()


def answer_of(client: socket.socket) -> tuple[bytes, bytes]:
    """Read one answer on a connection that stays open."""
    answer = b""
    while b"\r\n\r\n" not in answer:
        part = client.recv(65536)
        assert part, answer
        answer += part
    head, _, body = answer.partition(b"\r\n\r\n")
    length = int(head.lower().partition(b"content-length: ")[2].partition(b"\r\n")[0])
    while len(body) < length:
        body += client.recv(65536)
    return head, body


def test_a_refusal_before_parsing_has_everything_that_an_answer_has(busy: RunningService) -> None:
    with connect(busy, request(b"{}", b"X-Request-ID: mine-1\r\n")) as client:
        head, body = answer_of(client)
        client.sendall(LIVEZ)
        head_of_second, _ = answer_of(client)
    document = json.loads(body)
    assert head.startswith(b"HTTP/1.1 503 ")
    assert head_of_second.startswith(b"HTTP/1.1 200 ")
    assert (document["code"], document["status"], document["instance"]) == ("overloaded", 503, "/v1/trajectories")
    headers = httpx.Headers([tuple(line.split(b": ", 1)) for line in head.split(b"\r\n")[1:]])  # type: ignore[misc]
    assert headers["Content-Type"] == "application/problem+json"
    assert headers["Retry-After"] == "1"
    assert headers["X-Request-ID"] == "mine-1"
    parsed = busy.client.post("/v1/trajectories", json={}, headers={"Connection": "close"})  # goes to the parser
    assert parsed.status_code == 503
    assert set(parsed.headers) - {"date", "connection"} <= set(headers)
    same = ("Content-Security-Policy", "X-Content-Type-Options", "Content-Type", "Retry-After")
    assert {name: headers[name] for name in same} == {name: parsed.headers[name] for name in same}


def test_refused_requests_are_counted_and_logged(busy: RunningService) -> None:
    def refused() -> float:
        lines = busy.client.get("/metrics").text.splitlines()
        found = [
            line for line in lines if line.startswith('planner_refusals_total{code="overloaded",operation="none"}')
        ]
        return float(found[0].split()[-1]) if found else 0.0

    before = refused()
    with connect(busy, request(b"{}")) as client:
        answer_of(client)
    assert refused() == before + 1.0
    assert "requests_shed" in busy.log.read_text()


@pytest.mark.large_only
def test_the_liveness_is_answered_beyond_the_bound_of_connections(busy: RunningService) -> None:
    with ExitStack() as stack:
        for number in range(8):
            stack.enter_context(connect(busy, b"GET", f"127.0.0.{2 + number}"))
        alive = received(connect(busy, LIVEZ, "127.0.0.20"))
        assert alive.startswith(b"HTTP/1.1 200 ")
        assert alive.endswith(b'{"status":"alive"}')
        for sent in (b"", b"GET /v1/robots HTTP/1.1\r\nHost: localhost\r\n\r\n", LIVEZ[:-2]):
            assert problem(received(connect(busy, sent, "127.0.0.21")))["code"] == "overloaded"


def test_a_client_that_hangs_up_before_its_refusal_leaves_nothing(busy: RunningService) -> None:
    for _ in range(5):
        with suppress(ConnectionError), connect(busy, request(b"{}")):
            pass
    with connect(busy, request(b"{}")) as client:
        assert answer_of(client)[0].startswith(b"HTTP/1.1 503 ")


@pytest.mark.parametrize(
    "data",
    [
        request(b"{}")[:-1],
        request(b"{}") + b"G",
        request(b"{}", b"Content-Length: 2\r\n"),
        request(b"{}", b"content-length: 3\r\nX: y\r\n"),
        request(b"{}", b"Content-Length : 3\r\n"),
        request(b"{}", b"Transfer-Encoding: chunked\r\n"),
        request(b"{}", b"Expect: 100-continue\r\n"),
        request(b"{}", b"Connection: close\r\n"),
        request(b"{}", b"Origin: http://localhost\r\n"),
        request(b"{}", head=HEAD.replace(b"1.1", b"1.0")),
        request(b"{}", head=HEAD.replace(b"POST", b"GET")),
        request(b"{}", head=HEAD.replace(b"/v1", b"/v1 /v1")),
        request(b"{}", head=HEAD.replace(b"\r\nHost", b"\nHost")),
        request(b"{}", b" folded: x\r\n"),
        request(b"{}", b"no colon\r\n"),
        b"",
        b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n",
    ],
)
def test_what_only_the_parser_understands_is_left_to_it(data: bytes) -> None:
    assert Shedding(Settings(), Metrics()).whole_request(data, "client") is None


def test_the_client_is_that_of_the_key(tmp_path: Path) -> None:
    with_keys = Shedding(Settings(access="keys", data_directory=tmp_path), Metrics())
    key_id, key = new_key()
    for word in (b"Bearer", b"bearer"):
        found = with_keys.whole_request(request(b"{}", b"authorization: %s %s\r\n" % (word, key.encode())), "address")
        assert found is not None
        assert found.client == f"key:{key_id}"
    assert with_keys.whole_request(request(b"{}"), "address") is None  # the answer is 401
    by_address = Shedding(Settings(), Metrics()).whole_request(request(b"{}"), "address")
    assert by_address is not None
    assert (by_address.client, by_address.path) == ("address", "/v1/trajectories")


@pytest.mark.parametrize(
    ("peer", "headers", "client"),
    [
        ("10.0.0.1", b"", "10.0.0.1"),
        ("10.0.0.1", b"X-Forwarded-For: 192.0.2.7\r\n", "192.0.2.7"),
        ("10.0.0.1", b"x-forwarded-for:192.0.2.7:4711\r\n", "192.0.2.7"),
        ("10.0.0.1", b"X-Forwarded-For: 198.51.100.1, 192.0.2.7, 10.0.0.2\r\n", "192.0.2.7"),
        ("10.0.0.1", b"X-Forwarded-For: 198.51.100.1\r\nX-Forwarded-For: 192.0.2.7\r\n", "192.0.2.7"),
        ("10.0.0.1", b"X-Forwarded-For: 2001:db8::1\r\n", "2001:db8::/64"),
        ("10.0.0.1", b"X-Forwarded-For: 10.0.0.2\r\n", "10.0.0.2"),
        ("192.0.2.9", b"X-Forwarded-For: 192.0.2.7\r\n", "192.0.2.9"),
    ],
)
def test_the_client_behind_a_trusted_proxy_is_the_one_that_the_parser_finds(
    peer: str, headers: bytes, client: str
) -> None:
    """The expected client is the last address of the header that is no trusted proxy (RFC 7239, 7.4)."""
    shedding = Shedding(Settings(trusted_proxies="10.0.0.0/8"), Metrics())
    found = shedding.whole_request(request(b"{}", headers), peer)
    assert found is not None
    assert found.client == client
    assert by_the_parser(peer, headers) == client


def by_the_parser(peer: str, headers: bytes) -> str:
    """Return the client of a request that is parsed: uvicorn's middleware puts it into the scope."""
    found: list[str] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        found.append(client_by_address(scope).name)

    lines = [line.partition(b":") for line in headers.split(b"\r\n")[:-1]]
    named = [(name.lower(), value.strip()) for name, _, value in lines]
    scope: Any = {"type": "http", "client": (peer, 1), "headers": named}
    asyncio.run(ProxyHeadersMiddleware(app, ["10.0.0.0/8"])(scope, None, None))  # type: ignore[arg-type]
    return found[0]


@pytest.mark.large_only
def test_one_client_behind_a_proxy_leaves_room_for_another(tmp_path: Path) -> None:
    """Each of the client's requests is refused unparsed; earlier versions parsed the requests of every client."""
    settings: dict[str, Any] = {"workers": 2, "express_workers": 0, "queue_size": 2, "trusted_proxies": "127.0.0.1"}
    with running_service(tmp_path / "log.jsonl", **settings) as service, ExitStack() as stack:
        for worker in service.workers():
            worker.suspend()
            stack.callback(worker.resume)
        greedy, modest = b"X-Forwarded-For: 192.0.2.1\r\n", b"X-Forwarded-For: 192.0.2.2\r\n"
        for period in (0.01, 0.02, 0.03, 0.04):
            body = json.dumps(plan_request(sample_period=period, deadline=60)).encode()
            stack.enter_context(connect(service, request(body, greedy)))
        wait_until(lambda: '\nplanner_queue_jobs{lane="requests"} 2.0\n' in service.client.get("/metrics").text)
        with connect(service, request(b"{}", greedy)) as refused:
            assert answer_of(refused)[0].startswith(b"HTTP/1.1 503 ")
        assert "requests_shed" in service.log.read_text()
        body = json.dumps(plan_request(sample_period=0.05, deadline=60)).encode()
        client = stack.enter_context(connect(service, request(body, modest)))
        for worker in service.workers():
            worker.resume()
        assert answer_of(client)[0].startswith(b"HTTP/1.1 200 ")


def test_a_client_with_little_under_way_takes_the_place_of_one_with_much() -> None:
    shedding = Shedding(Settings(queue_size=2, workers=1, express_workers=1), Metrics())
    places = [shedding.enter("greedy") for _ in range(4)]
    assert not shedding.has_room("greedy")
    assert shedding.has_room("modest")
    places[0].leave()
    places[0].leave()
    assert shedding.has_room("greedy")
    shedding.enter("greedy")
    assert not shedding.has_room("greedy")


def test_refusals_leave_at_a_bounded_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clients that repeat a refused request at once took the processors that plan: 31 % of the answers were left."""
    now = 100.0
    monkeypatch.setattr(shedding_module, "time", SimpleNamespace(monotonic=lambda: now))
    shedding = Shedding(Settings(max_connections=1000), Metrics())
    delays = [shedding.delay() for _ in range(1000)]
    assert delays[0] == 0.0
    assert sum(delay == 0.0 for delay in delays) <= UNDELAYED * REFUSALS_PER_SECOND + 1
    assert delays == sorted(delays)
    assert delays[-1] == pytest.approx(LONGEST_DELAY)
    now += 10.0
    assert shedding.delay() == 0.0
    shedding.delayed = 900
    assert [shedding.delay() for _ in range(500)] == [0.0] * 500  # connections are scarcer


def test_a_refusal_whose_client_has_gone_waits_no_longer() -> None:
    async def numbers_of_waiting() -> list[int]:
        shedding = Shedding(Settings(), Metrics())
        for _ in range(1000):  # so that the next refusal has to wait
            shedding.delay()
        waiting = asyncio.create_task(shedding.wait())
        await asyncio.sleep(0)
        found = [shedding.delayed]
        waiting.cancel()
        await asyncio.gather(waiting, return_exceptions=True)
        return [*found, shedding.delayed]

    assert asyncio.run(numbers_of_waiting()) == [1, 0]
