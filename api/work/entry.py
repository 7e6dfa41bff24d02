"""The entry of workers, for their pool. Light to import: the server does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from api.pool.worker_process import Entry

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.pool.messages import Caps, Reply, Task


def load() -> Callable[[Task, Caps], Reply]:
    """Import the function that executes a task, with all of the robotics."""
    from api.work.execution import execute

    return execute


ENTRY = Entry("api.work.template", load)
"""The entry of workers of the service and of the machines of a cluster."""
