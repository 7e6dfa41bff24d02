"""The processes of a running service."""

from __future__ import annotations

from contextlib import suppress

import psutil


def workers_of(service: psutil.Process) -> list[psutil.Process]:
    """Return the processes that work for a service: forked from a child of it or, in former versions, its children."""
    children = service.children()
    forked = [worker for child in children if _runs("forkserver", child) for worker in child.children()]
    return forked or [child for child in children if _runs("spawn_main", child)]


def _runs(name: str, process: psutil.Process) -> bool:
    with suppress(psutil.Error):  # it has just died
        return name in " ".join(process.cmdline())
    return False
