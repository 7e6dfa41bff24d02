"""The parts of the service that routes use."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from api.base.settings import Settings
    from api.batches.arrival import Intake
    from api.batches.engine import Engine
    from api.batches.looks import Looks
    from api.http.access.access import Access
    from api.http.shared_answers import SharedAnswers
    from api.http.transport.shedding import Shedding
    from api.pool.pool import WorkerPool
    from api.store.database import Database
    from api.telemetry.metrics import Metrics


@dataclass(frozen=True)
class Service:
    """One running service.

    Attributes:
        settings: The settings of the operator.
        pool: The worker processes.
        database: What outlives a request: robots and batches.
        engine: What works on batches.
        intake: What takes batches in.
        access: What lets requests in.
        metrics: The counters and measurements.
        answers: Answers that equal requests share.
        looks: The states of batches, shared by all their followers.
        shedding: What refuses requests that there is no room for.
        catalogue: Robots of the catalogue that requests have named. Only workers have the catalogue. A robot for which
            they need no definition is in it. No added robot can have its id, so the database is not read for it.
    """

    settings: Settings
    pool: WorkerPool
    database: Database
    engine: Engine
    intake: Intake
    access: Access
    metrics: Metrics
    answers: SharedAnswers
    looks: Looks
    shedding: Shedding
    catalogue: set[str] = field(default_factory=set)
