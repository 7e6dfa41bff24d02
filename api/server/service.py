"""What the routes work with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from api.server.pool import WorkerPool
    from api.settings import Settings
    from api.store import RobotStore


@dataclass(frozen=True)
class Service:
    """One running service.

    Attributes:
        settings: What the operator has set.
        pool: The worker processes.
        robots: The uploaded robots.
    """

    settings: Settings
    pool: WorkerPool
    robots: RobotStore
