"""`unshare --net ... python -m tests.api.isolated`: all operations of the service without a network.

Prints the statuses of its answers as JSON, and what else there is to see.
"""

from __future__ import annotations

import fcntl
import json
import re
import socket
import struct
import tempfile
from pathlib import Path
from typing import Any
from urllib.parse import urljoin

from tests.api.conftest import RunningService, running_service, wait_until
from tests.api.requests import plan_request

GET_FLAGS, SET_FLAGS, IS_UP = 0x8913, 0x8914, 1
"""From `linux/sockios.h` and `linux/if.h`."""


def bring_up_loopback() -> None:
    with socket.socket() as device:
        request = struct.pack("16sH14s", b"lo", 0, b"")
        (flags,) = struct.unpack_from("16xH", fcntl.ioctl(device, GET_FLAGS, request))
        fcntl.ioctl(device, SET_FLAGS, struct.pack("16sH14s", b"lo", flags | IS_UP, b""))


def visit(service: RunningService) -> dict[str, Any]:
    """Plan, send a batch and read it, and load the documentation with every file that it names."""
    plan = service.post("/v1/trajectories", plan_request())
    made = service.post("/v1/batches", {"requests": [plan_request(seed=seed) for seed in range(5)]})
    location = made.headers["Location"]
    wait_until(lambda: service.client.get(location).json()["status"] == "completed")
    results = service.client.get(f"{location}/results").json()["results"]
    pages = {path: service.client.get(path) for path in ("/docs", "/openapi.json", "/")}
    files = {file for page in ("/docs", "/") for file in re.findall(r'(?:src|href)="([^"#]+)"', pages[page].text)}
    return {
        "interfaces": [name for _, name in socket.if_nameindex()],
        "plan": plan.status_code,
        "batch": [result["status"] for result in results],
        "same": results[0]["trajectory"] == plan.json(),
        "pages": {path: page.status_code for path, page in pages.items()},
        "elsewhere": sorted(file for file in files if "//" in file),
        "files": {file: service.client.get(urljoin("/", file)).status_code for file in files if "//" not in file},
    }


if __name__ == "__main__":
    bring_up_loopback()
    with tempfile.TemporaryDirectory() as folder, running_service(Path(folder) / "log.jsonl") as running:
        print(json.dumps(visit(running)))
