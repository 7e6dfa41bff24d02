"""A Dask cluster of machines with a core each, for measurements: for root each has a network of its own."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

NETWORK = "10.213"
"""The first half of the addresses of the machines, of a range for private use."""


class Machine(NamedTuple):
    """A machine of the cluster, made of a core and a network namespace.

    Attributes:
        scheduler: The address at which it reaches the scheduler.
        prefix: The words before a command that runs there.
    """

    scheduler: str
    prefix: list[str]


def has_namespaces() -> bool:
    """Tell whether machines can have networks of their own: root and `ip` make them."""
    return os.geteuid() == 0 and shutil.which("ip") is not None


@contextmanager
def cluster(folder: Path, machines: int) -> Iterator[str]:
    """Start a scheduler, and machines with one core and one planning process each; yield the scheduler's address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    host = "0.0.0.0" if has_namespaces() else "127.0.0.1"  # noqa: S104 - machines reach it over networks of their own
    scheduler = ["distributed.cli.dask_scheduler", "--host", host, "--port", str(port), "--no-dashboard"]
    with ExitStack() as stack:
        log = stack.enter_context((folder / "cluster.log").open("wb"))
        commands = [[sys.executable, "-m", *scheduler]]
        for k in range(machines):
            machine = stack.enter_context(_machine(k))
            worker = ["cli", "worker", f"tcp://{machine.scheduler}:{port}", "--workers", "1"]
            commands.append([*machine.prefix, sys.executable, "-m", *worker])
        processes = [subprocess.Popen(command, stdout=log, stderr=log) for command in commands]
        try:
            yield f"tcp://127.0.0.1:{port}"
        finally:
            for process in reversed(processes):
                process.terminate()
                process.wait(20.0)


@contextmanager
def _machine(number: int) -> Iterator[Machine]:
    """Make a machine of a core and, where possible, a network namespace joined to this machine's."""
    cores = sorted(os.sched_getaffinity(0))
    pinned = ["taskset", "--cpu-list", str(cores[number % len(cores)])]
    if not has_namespaces():
        yield Machine("127.0.0.1", pinned)
        return
    name, here, there = f"planner-{os.getpid()}-{number}", f"{NETWORK}.{number}.1", f"{NETWORK}.{number}.2"
    outside, inside = f"pl{os.getpid() % 10**6}h{number}", f"pl{os.getpid() % 10**6}m{number}"
    _ip("netns", "add", name)
    try:
        _ip("link", "add", outside, "type", "veth", "peer", "name", inside, "netns", name)
        _ip("address", "add", f"{here}/30", "dev", outside)
        _ip("link", "set", outside, "up")
        _ip("-n", name, "address", "add", f"{there}/30", "dev", inside)
        for device in (inside, "lo"):
            _ip("-n", name, "link", "set", device, "up")
        yield Machine(here, ["ip", "netns", "exec", name, *pinned])
    finally:
        _ip("netns", "delete", name)  # and the cable with it


def _ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)
