"""Lightweight HTTP clients, so that the service is measured.

One blocking connection for latencies; and, as a program of its own, several concurrent ones for throughput:
`python -m benchmarks.service.clients PORT CONNECTIONS SECONDS BODIES` prints their figures as JSON. BODIES is a file
with one request body a line.
"""

from __future__ import annotations

import asyncio
import socket
import sys
import time
from functools import partial
from pathlib import Path
from typing import cast

import orjson
import uvloop
from typing_extensions import override

from benchmarks.service.workload import http_request

HOST = "127.0.0.1"
BUFFER_SIZE = 1 << 20


class Connection:
    """One connection, one request at a time."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection((HOST, port))
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._buffer = memoryview(bytearray(BUFFER_SIZE))

    def send(self, request: bytes) -> tuple[float, bytes, int]:
        """Send a request and read all of its response.

        Returns:
            Seconds until the last byte, the response's head, and the length of its body.
        """
        start = time.perf_counter()
        self._socket.sendall(request)
        filled, needed = 0, None
        while needed is None or filled < needed:
            received = self._socket.recv_into(self._buffer[filled:])
            if received == 0:
                raise ConnectionError("the service closed the connection")
            filled += received
            if needed is None:
                needed = response_length(self._buffer[:filled])
        seconds = time.perf_counter() - start
        head = bytes(self._buffer[:HEAD_LIMIT]).partition(b"\r\n\r\n")[0]
        return seconds, head, needed - len(head) - 4

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


HEAD_LIMIT = 4096


def response_length(received: memoryview) -> int | None:
    """Return length of the whole response in bytes; None while its head is not complete."""
    head, end, _ = bytes(received[:HEAD_LIMIT]).lower().partition(b"\r\n\r\n")
    if not end:
        return None
    return len(head) + 4 + int(head.partition(b"content-length: ")[2].partition(b"\r\n")[0])


class LoadConnection(asyncio.BufferedProtocol):
    """Sends the next request as soon as the response to the last one is complete."""

    transport: asyncio.Transport

    def __init__(self, requests: list[bytes], first: int, latencies: list[float]) -> None:
        self._requests, self._next, self._latencies = requests, first, latencies
        self._buffer = memoryview(bytearray(BUFFER_SIZE))
        self._filled, self._sent = 0, 0.0
        self._needed: int | None = None
        self.failures = 0
        self.closed = asyncio.get_running_loop().create_future()
        self.stopping = False

    @override
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast("asyncio.Transport", transport)
        self._send()

    @override
    def get_buffer(self, sizehint: int) -> memoryview:
        return self._buffer[self._filled :]

    @override
    def buffer_updated(self, nbytes: int) -> None:
        self._filled += nbytes
        if self._needed is None:
            self._needed = response_length(self._buffer[: self._filled])
        if self._needed is not None and self._filled >= self._needed:
            self._latencies.append(time.perf_counter() - self._sent)
            self.failures += bytes(self._buffer[9:12]) != b"200"
            if self.stopping:
                self.transport.close()
            else:
                self._send()

    @override
    def connection_lost(self, exc: Exception | None) -> None:
        self.closed.set_result(None)

    def _send(self) -> None:
        self._filled, self._needed = 0, None
        self._sent = time.perf_counter()
        self.transport.write(self._requests[self._next % len(self._requests)])
        self._next += 1


async def load(port: int, connections: int, seconds: float, requests: list[bytes]) -> dict[str, float]:
    """Keep `connections` requests in flight for a time; return the client's figures and processor time."""
    latencies: list[float] = []
    loop = asyncio.get_running_loop()
    protocols = []
    start, cpu = time.perf_counter(), time.process_time()
    for i in range(connections):
        connect = loop.create_connection(partial(LoadConnection, requests, i, latencies), HOST, port)
        protocols.append((await connect)[1])
    await asyncio.sleep(seconds)
    for protocol in protocols:
        protocol.stopping = True
    await asyncio.gather(*(protocol.closed for protocol in protocols))
    elapsed = time.perf_counter() - start
    cpu = time.process_time() - cpu
    latencies.sort()
    return {
        "connections": connections,
        "requests": len(latencies),
        "failures": sum(protocol.failures for protocol in protocols),
        "seconds": elapsed,
        "requests_per_second": len(latencies) / elapsed,
        "latency_median": latencies[len(latencies) // 2],
        "latency_p99": latencies[int(len(latencies) * 0.99)],
        "latency_worst": latencies[-1],
        "client_cpu": cpu / len(latencies),
    }


def main() -> None:
    port, connections, seconds, file = sys.argv[1:]
    requests = [http_request(body) for body in Path(file).read_bytes().splitlines()]
    result = uvloop.run(load(int(port), int(connections), float(seconds), requests))
    sys.stdout.write(orjson.dumps(result).decode())


if __name__ == "__main__":
    main()
