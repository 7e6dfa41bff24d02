"""The requests that are measured: joint waypoints of the repaired refuelling arm; ten are sampled to 500 rows."""

from __future__ import annotations

import random

import orjson

ROBOT, JOINTS, WAYPOINTS, ROWS, SAMPLE_PERIOD = "ngv_refuelling_arm", 6, 10, 500, 0.01
VARIANTS = 32
"""Different requests, so that nothing can be answered from memory."""

SPREAD = 0.1
"""rad, of the waypoints about the middle of every joint: small enough for the limits at the requested durations."""


def bodies(middle: list[float], seed: int = 0, waypoints: int = WAYPOINTS) -> list[bytes]:
    """Return the request bodies with so many waypoints each, about the joint position `middle`."""
    rng = random.Random(seed)  # noqa: S311 - no secret
    duration = (ROWS - 1) * SAMPLE_PERIOD / (WAYPOINTS - 1)
    requests = []
    for _ in range(VARIANTS):
        positions = [[q + rng.uniform(-SPREAD, SPREAD) for q in middle] for _ in range(waypoints)]
        path = [{"kind": "joint", "position": position, "duration": duration} for position in positions]
        del path[0]["duration"]
        request = {"robot": ROBOT, "waypoints": path, "backend": {"kind": "cubic"}, "sample_period": SAMPLE_PERIOD}
        requests.append(orjson.dumps(request))
    return requests


def http_request(body: bytes) -> bytes:
    """Return the bytes of a plan request, on a kept connection, for an answer that is computed anew."""
    head = (
        "POST /v1/trajectories HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        f"Cache-Control: no-cache\r\nContent-Length: {len(body)}\r\n\r\n"
    )
    return head.encode() + body


def http_get(path: str) -> bytes:
    """Return a request without a body as it goes over the wire."""
    return f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()
