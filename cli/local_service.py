"""A service of one's own for a while: for the demo, the benchmark and whoever tries the HTTP interface out."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

import httpx

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

HOST = "127.0.0.1"
"""The address that the service listens on: nobody else can reach it."""

START_TIMEOUT = 60.0
"""The time that the service may take until it is ready, s; a cold file system takes a third of it."""

STOP_TIMEOUT = 20.0
"""The time that the service has to end by itself after SIGTERM, s; then it is killed."""

POLL_PERIOD = 0.02
"""The time between two looks whether the service is ready, s."""


class ServiceDidNotStart(Exception):
    """The service ended, or was not ready in time."""


@contextmanager
def local_service(
    log: Path, workers: int | None = None, checkout: Path | None = None, settings: Mapping[str, str] | None = None
) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Run the real service on a free port until the block ends.

    Args:
        log: The file that its log goes to.
        workers: The number of its workers, without one more for cheap requests; None: as the settings say.
        checkout: The folder of the version that is to run, absolute; None: the one that runs this.
        settings: Environment variables that it has besides.

    Yields:
        Its base URL, and its process.

    Raises:
        ServiceDidNotStart: With the last lines of its log.
    """
    is_older = checkout is not None and not (checkout / "cli").is_dir()  # its command line is a folder of `api/`
    command = [sys.executable, "-m", "api.cli" if is_older else "cli", "serve", "--host", HOST, "--port", "0"]
    if workers is not None:
        command += ["--workers", str(workers)]
    environment = os.environ | dict(settings or {})
    if checkout is not None:
        environment["PYTHONPATH"] = str(checkout)
    if workers is not None:
        environment["PLANNER_EXPRESS_WORKERS"] = "0"
    with log.open("wb") as sink:
        process = subprocess.Popen(  # noqa: S603 - no caller's text in it
            command, stdout=sink, stderr=subprocess.STDOUT, cwd=checkout, env=environment
        )
    try:
        deadline = time.monotonic() + START_TIMEOUT
        url = _address(log, deadline, process)
        if url is None or not _wait_until_ready(url, deadline, process):
            tail = "\n".join(log.read_text(errors="replace").splitlines()[-5:])
            raise ServiceDidNotStart(f"The service did not start. Its log ends with:\n{tail}")
        yield url, process
    finally:
        process.terminate()
        try:
            process.wait(STOP_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _address(log: Path, deadline: float, process: subprocess.Popen[bytes]) -> str | None:
    """Read the URL of a service from its log; None: it ended, or took too long."""
    while time.monotonic() < deadline and process.poll() is None:
        if found := re.search(rf"running on (http://{re.escape(HOST)}:\d+)", log.read_text(errors="replace")):
            return found[1]
        time.sleep(POLL_PERIOD)
    return None


def announce_when_ready(host: str, port: int) -> None:
    """Say on stderr, for whoever sits at the terminal, when the service that is starting is ready, and where."""
    local = HOST if host in {"0.0.0.0", "::"} else host  # noqa: S104 - compared, not listened on
    url = f"http://[{local}]:{port}" if ":" in local else f"http://{local}:{port}"

    def announce() -> None:
        if _wait_until_ready(url, time.monotonic() + START_TIMEOUT):
            sys.stderr.write(f"\n  planner is ready at {url}/   (interactive documentation: {url}/docs)\n")
            sys.stderr.write("  Ctrl+C stops it\n\n")

    threading.Thread(target=announce, daemon=True).start()


def _wait_until_ready(url: str, deadline: float, process: subprocess.Popen[bytes] | None = None) -> bool:
    """Wait; tell whether the service gets ready before the deadline (monotonic clock) and before its process ends."""
    with httpx.Client(base_url=url) as client:
        while time.monotonic() < deadline and (process is None or process.poll() is None):
            try:
                if client.get("/readyz").is_success:
                    return True
            except httpx.TransportError:
                pass  # not listening yet
            time.sleep(POLL_PERIOD)
    return False
