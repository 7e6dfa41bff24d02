"""What the routes work with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from api.settings import Settings
    from api.store import RobotStore
    from api.workers import WorkerPool


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
