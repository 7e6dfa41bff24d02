"""Requests that wait for a worker: the clients take turns, and what could not be answered in time is refused."""

from __future__ import annotations

import asyncio
import math
import time
from collections import Counter
from typing import TYPE_CHECKING

from api.base.errors import Overloaded
from api.pool.costs import UNKNOWN

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.pool.costs import Cost, Kind
    from api.pool.messages import Reply, Task

PRUDENCE = 1.5
"""The times by which a wait may turn out longer than expected. A shorter queue keeps the workers as busy as a long one,
and the jobs in it are answered."""

LONGEST_RETRY_AFTER = 60
"""The longest `Retry-After`, s."""


class Job:
    """A request that wants a worker.

    Attributes:
        task: The task of the worker.
        kind: The kind by which its duration is learnt.
        cost: The expected duration; None: nothing is known.
        reply: The reply, or the reason why there is none; cancelled: nobody waits for it any more.
        started: When a worker began with it, s on the monotonic clock; None: it waits.
        was_interrupted: Whether a worker was killed while it worked on it.
        begun: An event that is set when a worker begins with it.
        is_behind: Whether it stands back for all that are not.
        is_ahead: Whether it goes ahead of all that are not, since its worker was killed.
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
        self.is_ahead = False
        self._hold = hold

    @property
    def is_wanted(self) -> bool:
        """Whether somebody waits for it, and not only a batch."""
        return not self.is_behind and not self.reply.done()

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
        """Estimate the rest of its duration at a worker, s; an overdue job takes as long again."""
        cost = UNKNOWN if self.cost is None else self.cost.mean
        if self.started is None:
            return cost
        elapsed = time.monotonic() - self.started
        is_overdue = elapsed > (cost if self.cost is None else self.cost.most)
        return elapsed if is_overdue else max(0.0, cost - elapsed)

    def is_late(self, wait: float, work: float | None = None) -> bool:
        """Tell whether it may miss its deadline after an estimated wait, s, with its estimated or other work, s."""
        return PRUDENCE * wait + (self._most_work() if work is None else work) > self._time_left()

    def refusal(self, wait: float) -> Overloaded:
        """Make the refusal of a job that may miss its deadline, with the time to retry."""
        seconds, left = _retry_after(wait), max(0.0, self._time_left())
        return Overloaded(
            f"Not started: the estimated wait of {wait:.1f} s plus up to {self._most_work():.1f} s of work may exceed "
            f"the {left:.1f} s left before the deadline. Retry after {seconds} s or raise `deadline`.",
            headers={"Retry-After": str(seconds)},
        )

    def _most_work(self) -> float:
        return 0.0 if self.cost is None else self.cost.most

    def _time_left(self) -> float:
        return self.task.deadline - time.monotonic()


class JobQueue:
    """The jobs that wait: the clients take turns, and each one's jobs come in the order of their arrival."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._jobs: list[Job] = []
        self._turns: dict[str, int] = {}
        self._turn = 0

    def __len__(self) -> int:
        return len(self._jobs)

    def has_room(self, client: str) -> bool:
        """Tell whether a job of a client may wait."""
        return has_room(client, self._waiting(), self._capacity)

    def put(self, job: Job) -> None:
        """Let a job wait. A full queue refuses the last job of the client with the most jobs.

        Raises:
            Overloaded: The queue is full, and no client has more of it than this one.
        """
        if not self.has_room(job.task.client):
            raise queue_is_full()
        if len(self._jobs) >= self._capacity:
            ((most, _),) = self._waiting().most_common(1)
            last = next(other for other in reversed(self._jobs) if other.task.client == most)
            self._jobs.remove(last)
            if not last.reply.done():
                last.reply.set_exception(queue_is_full())
        self._jobs.append(job)

    def put_back(self, job: Job) -> None:
        """Put a job whose worker was killed ahead of all others."""
        job.is_ahead = True
        self._jobs.insert(0, job)

    def take(self, only_cheap: bool) -> Job | None:
        """Take the next job, and refuse late ones."""
        for _, job in self._in_turn(only_cheap):
            self._jobs.remove(job)
            if self._jobs and job.is_late(0.0):  # nobody has to wait while a hopeless one is tried in vain
                job.reply.set_exception(job.refusal(0.0))
                continue
            self._turn += 1
            self._turns[job.task.client] = self._turn
            return job
        if not self._jobs:
            self._turns.clear()
        return None

    def discard(self, job: Job) -> None:
        """Forget a job that nobody waits for, if it waits."""
        if job in self._jobs:
            self._jobs.remove(job)

    def work(self, only_cheap: bool, client: str) -> float:
        """Add up the expected durations of the jobs before a new one of a client, s."""
        own = sum(job.task.client == client for job in self._jobs if job.is_cheap or not only_cheap)
        return sum(job.remaining() for round_, job in self._in_turn(only_cheap) if round_ <= own)

    def _waiting(self) -> Counter[str]:
        """Count the jobs of each client."""
        return Counter(job.task.client for job in self._jobs)

    def _in_turn(self, only_cheap: bool) -> list[tuple[int, Job]]:
        """Order the jobs as they are taken, each with the number of earlier jobs of its client.

        Jobs that were put back are first. Else each client has one job a round, the longest waiting client first.
        """
        seen: Counter[str] = Counter()
        found = []
        for job in self._jobs:
            if job.is_cheap or not only_cheap:
                found.append((seen[job.task.client], job))
                seen[job.task.client] += not job.is_ahead
        return sorted(
            found,
            key=lambda entry: (not entry[1].is_ahead, entry[0], self._turns.get(entry[1].task.client, 0)),
        )


def has_room(client: str, counts: Counter[str], capacity: int) -> bool:
    """Tell whether a client may take a place: one is free, or another client has two more.

    Args:
        client: The client.
        counts: The places that each client has.
        capacity: The number of places.
    """
    return counts.total() < capacity or max(counts.values(), default=0) > counts[client] + 1


def queue_is_full() -> Overloaded:
    """Make the refusal of a request when too many wait."""
    return Overloaded("The queue is full. Retry after 1 s.", headers={"Retry-After": "1"})


def _retry_after(wait: float) -> int:
    """Choose the `Retry-After` of a job that would wait so long, s."""
    return min(max(1, math.ceil(wait)), LONGEST_RETRY_AFTER)
