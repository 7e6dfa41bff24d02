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
    """One running service."""

    settings: Settings
    pool: WorkerPool
    robots: RobotStore
