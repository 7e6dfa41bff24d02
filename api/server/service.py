"""What the routes work with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from api.batches.engine import Engine
    from api.database.database import Database
    from api.server.pool import WorkerPool
    from api.settings import Settings


@dataclass(frozen=True)
class Service:
    """One running service.

    Attributes:
        settings: What the operator has set.
        pool: The worker processes.
        database: What outlives a request: robots and batches.
        engine: What works on batches.
    """

    settings: Settings
    pool: WorkerPool
    database: Database
    engine: Engine
