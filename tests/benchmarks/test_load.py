"""The benchmark of overload, on a service that is made up: it refuses every other costly request."""

from __future__ import annotations

import asyncio
import io
from contextlib import redirect_stdout
from typing import TYPE_CHECKING, Any

import pytest

from benchmarks.machine import machine
from benchmarks.service import load, load_report
from benchmarks.service.workload import http_request

if TYPE_CHECKING:
    from asyncio import StreamReader, StreamWriter

SECONDS, WORK = 0.3, 0.01
CLOSING = 0.1
"""s, after which both ends of the connections are closed."""


async def refuse_every_other(reader: StreamReader, writer: StreamWriter) -> None:
    refuses = False
    while not reader.at_eof():
        try:
            head = await reader.readuntil(b"\r\n\r\n")
        except asyncio.IncompleteReadError:
            break
        length = int(head.lower().partition(b"content-length: ")[2].partition(b"\r\n")[0] or 0)
        is_costly = b"costly" in await reader.readexactly(length)
        refuses = is_costly and not refuses
        if refuses:
            writer.write(b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 2\r\nRetry-After: 1\r\n\r\n{}")
        else:
            await asyncio.sleep(WORK)
            writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}")
    writer.close()


@pytest.mark.large_only
def test_what_becomes_of_arrivals_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(load, "RATES", (1.0,))
    monkeypatch.setattr(load, "CHEAP_RATE", 100.0)
    monkeypatch.setattr(load, "RETRYING", (3,))

    async def measure() -> dict[str, Any]:
        async with await asyncio.start_server(refuse_every_other, load.HOST, 0) as server:
            port = server.sockets[0].getsockname()[1]
            figures = await load._measure(port, [http_request(b"cheap")], [http_request(b"costly")], SECONDS)
            await asyncio.sleep(CLOSING)
            return figures

    figures = {"machine": machine(), "seconds": SECONDS, **asyncio.run(measure())}
    costly, cheap = figures["loads"]
    for row in (costly, cheap):
        assert row["asked"] == row["answered"] + row["refused"] > 0
        assert row["refused_without_retry_after"] == 0
        assert row["latency"]["median"] >= WORK
        assert row["goodput"] == pytest.approx(row["answered_in_time"] / SECONDS / row["capacity"])
    assert cheap["refused"] == 0
    assert costly["refused"] > 0
    (retrying,) = figures["retrying"]
    assert retrying["connections"] == 3
    assert retrying["goodput"] > 0.0
    assert (retrying["refused"], retrying["otherwise"]) == (0, 0)
    assert retrying["liveness"]["answered"] == retrying["liveness"]["asked"] > 0
    with redirect_stdout(io.StringIO()) as out:
        load_report.print_json(figures)
        load_report.print_table(figures)
    assert out.getvalue().count("min_effort") == 2


def test_connections_that_are_refused_are_no_answers() -> None:
    async def close(reader: StreamReader, writer: StreamWriter) -> None:
        writer.close()

    async def send() -> tuple[int, bool]:
        async with await asyncio.start_server(close, load.HOST, 0) as server:
            sent = await load.Clients(server.sockets[0].getsockname()[1]).send(http_request(b""))
            await asyncio.sleep(CLOSING)
            return sent

    assert asyncio.run(send()) == (0, False)
