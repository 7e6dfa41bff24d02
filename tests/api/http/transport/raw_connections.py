"""Connections on which tests write invalid HTTP."""

from __future__ import annotations

import json
import socket
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import httpx

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

PATIENCE = 20.0
"""Timeout of a test for an event that takes half a second on an idle machine, s."""


def connect(service: RunningService, sent: bytes = b"", source: str = "127.0.0.1") -> socket.socket:
    port = httpx.URL(service.url).port
    assert port is not None
    client = socket.create_connection(("127.0.0.1", port), PATIENCE, (source, 0))
    with suppress(ConnectionError):  # refused at once
        client.sendall(sent)
    return client


def received(client: socket.socket) -> bytes:
    """Receive all bytes until the service closes the connection."""
    parts = []
    with client, suppress(ConnectionError):
        while part := client.recv(65536):
            parts.append(part)
    return b"".join(parts)


def problem(answer: bytes) -> dict[str, Any]:
    """Return the problem document of a raw answer."""
    head, _, body = answer.partition(b"\r\n\r\n")
    assert b"application/problem+json" in head.lower()
    assert b"connection: close" in head.lower()
    document: dict[str, Any] = json.loads(body)
    assert int(head.split()[1]) == document["status"]
    assert document["type"].endswith(document["code"])
    return document
