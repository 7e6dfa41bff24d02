"""Requests that wait for a worker: first come, first served, unless they could not be answered in time."""

from __future__ import annotations

import asyncio
import math
import time
from typing import TYPE_CHECKING

from api.errors import Overloaded
from api.server.costs import UNKNOWN

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.messages import Reply, Task
    from api.server.costs import Cost, Kind

PRUDENCE = 1.5
"""The times by which a wait may turn out longer than expected. A shorter queue keeps the workers as busy as a long one,
and what is let into it is answered."""

LONGEST_RETRY_AFTER = 60
"""The longest time after which a caller is told to try again, s."""


class Job:
    """A request that wants a worker.

    Attributes:
        task: What the worker is to do.
        kind: What its duration is learnt by.
        cost: How long it is expected to take; None: nothing is known.
        reply: The reply, or the reason why there is none; cancelled: nobody waits for it any more.
        started: When a worker began with it, s on the monotonic clock; None: it waits.
        was_interrupted: Whether a worker was killed while it worked on it.
        begun: An event that is set when a worker begins with it.
        is_behind: Whether it stands back for all that are not.
    """

    def __init__(
        self, task: Task, kind: Kind, cost: Cost | None, hold: Callable[[int], None], is_behind: bool = False
    ) -> None:
        self.task = task
        self.kind = kind
        self.cost = cost
        self.reply: asyncio.Future[Reply] = asyncio.get_running_loop().create_future()
        self.started: float | None = None
        self.was_interrupted = False
        self.begun = asyncio.Event()
        self.is_behind = is_behind
        self._hold = hold

    @property
    def is_cheap(self) -> bool:
        """Whether it is known to be done soon."""
        return self.cost is not None and self.cost.is_cheap

    def hold(self, size: int) -> None:
        """Count the bytes of its answer.

        Raises:
            Overloaded: There is no room for them, or nobody waits for them.
        """
        if self.reply.done():
            raise Overloaded("nobody waits for the answer")
        self._hold(size)

    def remaining(self) -> float:
        """Estimate how much longer it takes once it has a worker, s; what is overdue takes as long again."""
        cost = UNKNOWN if self.cost is None else self.cost.mean
        if self.started is None:
            return cost
        elapsed = time.monotonic() - self.started
        is_overdue = elapsed > (cost if self.cost is None else self.cost.most)
        return elapsed if is_overdue else max(0.0, cost - elapsed)

    def refuse_if_late(self, wait: float) -> None:
        """Refuse the job if it may not be answered in time after a wait that is expected to take so long, s.

        Raises:
            Overloaded: With the time after which it may be tried again.
        """
        left = self.task.deadline - time.monotonic()
        cost = 0.0 if self.cost is None else self.cost.most
        if PRUDENCE * wait + cost > left:
            raise overloaded(
                f"a wait of about {wait:.1f} s and work of up to {cost:.1f} s may take longer than the "
                f"{max(0.0, left):.1f} s that the deadline leaves; try again later, or with a longer deadline",
                wait,
            )


class JobQueue:
    """The jobs that wait, in the order of their arrival."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._jobs: list[Job] = []

    @property
    def is_full(self) -> bool:
        """Whether no more may wait."""
        return len(self._jobs) >= self._capacity

    def __len__(self) -> int:
        return len(self._jobs)

    def put(self, job: Job) -> None:
        """Let a job wait.

        Raises:
            Overloaded: The queue is full.
        """
        if self.is_full:
            raise queue_is_full()
        self._jobs.append(job)

    def put_back(self, job: Job) -> None:
        """Put a job whose worker was killed ahead of all others."""
        self._jobs.insert(0, job)

    def take(self, only_cheap: bool) -> Job | None:
        """Take the job that has waited longest; those that are late by now are refused."""
        for job in [job for job in self._jobs if job.is_cheap or not only_cheap]:
            self._jobs.remove(job)
            try:
                if self._jobs:  # nobody has to wait while a hopeless one is tried in vain
                    job.refuse_if_late(0.0)
            except Overloaded as refusal:
                job.reply.set_exception(refusal)
            else:
                return job
        return None

    def discard(self, job: Job) -> None:
        """Forget a job that nobody waits for, if it waits."""
        if job in self._jobs:
            self._jobs.remove(job)

    def work(self, only_cheap: bool) -> float:
        """Add up what the jobs that wait are expected to take, s."""
        return sum(job.remaining() for job in self._jobs if job.is_cheap or not only_cheap)


def queue_is_full() -> Overloaded:
    """Make the refusal of what comes when too many wait."""
    return Overloaded("the queue is full; try again later", headers={"Retry-After": "1"})


def overloaded(message: str, wait: float) -> Overloaded:
    """Make the refusal of what cannot be done now."""
    seconds = min(max(1, math.ceil(wait)), LONGEST_RETRY_AFTER)
    return Overloaded(message, headers={"Retry-After": str(seconds)})
