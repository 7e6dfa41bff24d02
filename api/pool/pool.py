"""The pool of worker processes: bounded, warmed up, with deadlines that are kept by killing."""

from __future__ import annotations

import asyncio
import signal
import time
from collections import Counter, deque
from typing import TYPE_CHECKING

import structlog

from api.base.errors import DeadlineExceeded, InternalError, MemoryExceeded, Overloaded, what_to_do
from api.pool.costs import Costs
from api.pool.jobs import Job, JobQueue
from api.pool.messages import Caps
from api.pool.worker import Worker, start_template, stop_template

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.base.settings import Settings
    from api.pool.costs import Kind
    from api.pool.messages import Reply, Task
    from api.pool.worker_process import Entry

NO_MEMORY_FOR_A_LIBRARY = 127
"""The exit code of a process whose C library finds no memory for the thread-local data of a library that it loads."""

TEMPLATE_KILLED = 255
"""The exit code that Python's fork server leaves for all of its children when it ends itself."""

KILLED_FROM_OUTSIDE = (-signal.SIGKILL, -signal.SIGTERM, TEMPLATE_KILLED)
"""The exit codes of a worker that somebody else killed, such as the kernel for want of memory: its work is
repeated once. Work that crashes its worker would crash the next one, too."""

RESPAWN_DELAY = 1.0
"""The time before a worker that could not even start is started again, s; short, yet no busy loop."""

GRACE = 0.2
"""The time that a worker has to finish a task that nobody waits for, s. Most plans take less, and a killed worker loses
its caches. Without it, requests with short deadlines, or that hang up, would have one worker after the other killed."""

log = structlog.get_logger()


class WorkerPool:
    """Runs tasks in worker processes, one at a time each, all from the event loop, which never waits for one.

    Each worker has a channel of its own, so that one can be killed at any moment without harm to the others. A worker
    that overruns a deadline is killed, and one whose task ended in an unexpected error. Each that ends is replaced. (A
    pool whose workers share a queue, as pebble's, breaks as a whole when one dies while idle.) They are forked from a
    warm process, so that another one is there at once. They are never forked from this process: they would inherit
    its sockets and signal handlers.

    A worker that becomes free takes the next job; clients take turns. Express workers take only work that is known to
    be cheap: it does not wait for what takes long, however much of that there is. What cannot be answered in time, as
    far as the times of former requests tell, is refused at once instead of wasting a worker's time. What runs behind
    requests, batches, gets a worker that none of them wants, and never the last one where there are several.

    Attributes:
        ended: The number of workers that have ended.
        most_behind: The most workers that do what runs behind requests.
    """

    def __init__(self, settings: Settings, entry: Entry) -> None:
        self._entry = entry
        self._max_tasks = settings.worker_max_tasks
        self._caps = Caps(
            max_deadline=settings.max_deadline,
            max_waypoints=settings.max_waypoints,
            max_samples=settings.max_samples,
            memory_mib=settings.worker_memory_mib,
            log_level=settings.log_level,
            niceness=settings.worker_niceness,
        )
        self._costs = Costs()
        self._queue = JobQueue(settings.queue_size)
        self._behind: deque[Job] = deque()
        self.most_behind = min(settings.batch_workers or max(1, settings.workers - 1), settings.workers)
        self.ended = 0
        self._been_ready = False
        self._keepers: list[asyncio.Task[None]] = []
        start_template(entry.template)
        lanes = [False] * settings.workers + [True] * settings.express_workers
        self._workers = [Worker(self._caps, entry, only_cheap) for only_cheap in lanes]

    def attach(self) -> None:
        """Look after the workers from the running event loop."""
        self._keepers = [asyncio.create_task(self._keep(place)) for place in range(self.size)]

    async def detach(self) -> None:
        """Look after the workers no longer."""
        for keeper in self._keepers:
            keeper.cancel()
        await asyncio.gather(*self._keepers, return_exceptions=True)

    def stop(self) -> None:
        """End all workers, and the process that they are forked from."""
        for worker in self._workers:
            worker.stop()
        stop_template()

    @property
    def size(self) -> int:
        """The number of workers that there are to be."""
        return len(self._workers)

    @property
    def warm_workers(self) -> int:
        """The number of workers that are ready for tasks and alive."""
        return sum(worker.warm and worker.alive for worker in self._workers)

    @property
    def ready(self) -> bool:
        """Whether all workers have been warm, and at least one is.

        One that was killed or recycled is back within a second: no reason to send the others' requests away.
        """
        warm = self.warm_workers
        self._been_ready = self._been_ready or warm == self.size
        return self._been_ready and warm > 0

    def states(self) -> Counter[tuple[str, str]]:
        """Count the workers by their lane, `all` or `express`, and by their state: `starting`, `idle` or `busy`."""
        return Counter(("express" if worker.only_cheap else "all", _state(worker)) for worker in self._workers)

    def waiting(self) -> dict[str, int]:
        """Count what waits for a worker, of requests and of what runs behind them."""
        return {"requests": len(self._queue), "batches": len(self._behind)}

    def is_full(self, client: str) -> bool:
        """Tell whether nothing of a client can be taken on, whatever it is."""
        return not self._queue.has_room(client) and not any(map(_is_idle, self._workers))

    async def run(self, task: Task, kind: Kind, hold: Callable[[int], None]) -> Reply:
        """Run a task in a worker. Cancelling it takes the task away from the worker.

        Args:
            task: The task.
            kind: The kind by which its duration is estimated.
            hold: A function that counts the bytes of the answer before they are read; it may raise Overloaded.

        Raises:
            Overloaded: There is no room for the request or its answer, or no time for it before its deadline.
            DeadlineExceeded: No reply came in time; the worker, if one had begun, is killed.
            MemoryExceeded: The worker died because there was no memory left for it.
            InternalError: The worker died of the task.
        """
        late = DeadlineExceeded(f"The deadline passed before the answer. {what_to_do(self._caps.max_deadline)}")
        if time.monotonic() >= task.deadline:
            raise late
        job = Job(task, kind, self._costs.expected(kind, task.client), hold)
        self._admit(job)
        try:
            async with asyncio.timeout(task.deadline - time.monotonic()):
                return await job.reply
        except TimeoutError:
            raise late from None
        finally:
            self._leave(job)

    async def run_behind(self, task: Task, kind: Kind, seconds: float) -> Reply:
        """Run a task when no request wants the worker. Cancelling it takes the task away from the worker.

        Args:
            task: The task, whose own deadline does not count: it may have to wait.
            kind: The kind by which its duration is estimated.
            seconds: The time that it may take once it has a worker, s.

        Raises:
            DeadlineExceeded, MemoryExceeded, InternalError: See `run`.
        """
        job = Job(task, kind, self._costs.expected(kind), _count_nothing, is_behind=True)
        self._behind.append(job)
        self._hand_out_what_is_behind()
        try:
            await job.begun.wait()
            async with asyncio.timeout(seconds):
                return await job.reply
        except TimeoutError:
            hint = what_to_do(self._caps.max_deadline)
            raise DeadlineExceeded(f"The deadline passed before the answer. {hint}") from None
        finally:
            self._leave(job)

    def _hand_out_what_is_behind(self) -> None:
        """Give jobs that stand back to workers that nobody else wants."""
        for worker in [worker for worker in self._workers if _is_idle(worker)]:
            job = self._take_from_behind(worker)
            if job is not None:
                _hand_over(job, worker)

    def _take_from_behind(self, worker: Worker) -> Job | None:
        """Take the first of the jobs that stand back, if this worker may do one."""
        lane = [other for other in self._workers if not other.only_cheap]
        busy = sum(other.job is not None and other.job.is_behind for other in lane)
        alive = sum(other.warm and other.alive for other in lane)
        left_to_requests = len(lane) - self.most_behind  # a worker that is being replaced is missing to them, too
        if worker.only_cheap or not self._behind or busy >= alive - left_to_requests:
            return None
        return self._behind.popleft()

    def _admit(self, job: Job) -> None:
        """Give a job to an idle worker, express ones first, or let it wait.

        A job that an idle worker can do is never refused, and no job of a client that is alone here. Now and then a
        job is taken that only its own estimate would refuse: the estimate may be wrong.

        Raises:
            Overloaded: It would wait too long, or there is no room.
        """
        idle = next((worker for worker in reversed(self._workers) if _is_idle(worker) and worker.takes(job)), None)
        if idle is not None:
            _hand_over(job, idle)
            return
        others = [worker.job for worker in self._workers if worker.job is not None and worker.takes(job)]
        if len(self._queue) or any(other.is_wanted for other in others):
            wait = self._expected_wait(job)
            if job.is_late(wait):
                if not self._is_trial(job, wait):
                    raise job.refusal(wait)
                job.cost = None
        self._queue.put(job)

    def _is_trial(self, job: Job, wait: float) -> bool:
        """Tell whether a job tries an estimate that would refuse it without any wait; the wait must be short."""
        if not job.is_late(0.0) or job.is_late(2.0 * wait, work=0.0):
            return False
        return self._costs.claim_trial(job.kind, job.task.client, time.monotonic())

    def _expected_wait(self, job: Job) -> float:
        """Estimate the wait of a job, s: the work ahead of it, shared by the workers that do it."""
        waits = []
        for only_cheap in {worker.only_cheap for worker in self._workers if worker.takes(job)}:
            lane = [worker for worker in self._workers if worker.only_cheap == only_cheap]
            at_work = (worker.job for worker in lane if worker.job is not None)
            under_way = sum(other.remaining() for other in at_work if not other.reply.done())
            waits.append((under_way + self._queue.work(only_cheap, job.task.client)) / len(lane))
        return min(waits)

    def _leave(self, job: Job) -> None:
        """Take care of a job that its caller does not wait for any more, with or without a reply."""
        self._queue.discard(job)
        if job in self._behind:
            self._behind.remove(job)
        for worker in self._workers:
            if worker.job is job:
                asyncio.get_running_loop().call_later(GRACE, _kill_if_still_at, worker, job)

    async def _keep(self, place: int) -> None:
        """Keep a place in the pool filled: let its worker work, and put another there when it has ended."""
        while True:
            worker = self._workers[place]
            await worker.get_ready()
            if worker.warm:
                while (job := await self._next_job(worker)) is not None:
                    await self._work_on(job, worker)
                worker.kill()
            await worker.ended.wait()
            log.info("worker_ended", pid=worker.pid, exit_code=worker.exit_code, tasks=worker.tasks)
            self.ended += 1
            if not worker.warm:
                await asyncio.sleep(RESPAWN_DELAY)
            self._workers[place] = Worker(self._caps, self._entry, worker.only_cheap)

    async def _next_job(self, worker: Worker) -> Job | None:
        """Wait for the next job of a worker; None: it has ended, or has done enough."""
        worker.job = None
        if not worker.alive or worker.tasks >= self._max_tasks:
            self._hand_out_what_is_behind()
            return None
        worker.job = self._queue.take(worker.only_cheap) or self._take_from_behind(worker)
        if worker.job is None:
            worker.offer = asyncio.get_running_loop().create_future()
            worker.job = await worker.offer
        return worker.job

    async def _work_on(self, job: Job, worker: Worker) -> None:
        """Let a worker do a job, and pass on its reply."""
        if job.reply.done():  # nobody waits for it any more
            return
        if not worker.alive:
            self._repeat(job, worker)
            return
        started = job.started = time.monotonic()
        job.begun.set()
        is_bound = True
        try:
            reply = await worker.run(job.task, job.hold)
        except Overloaded as refusal:
            _fail(job, refusal)
        except (EOFError, OSError):
            await worker.ended.wait()
            if worker.exit_code in KILLED_FROM_OUTSIDE and not job.was_interrupted:
                job.was_interrupted = True
                self._repeat(job, worker)
            elif worker.exit_code == NO_MEMORY_FOR_A_LIBRARY:
                _fail(job, MemoryExceeded())
            else:
                _fail(job, InternalError())
        else:
            is_bound = reply.code is not None
            if not job.reply.done():
                job.reply.set_result(reply)
            if not reply.worker_is_fit:
                worker.kill()
                await worker.ended.wait()
        self._costs.learn(job.kind, time.monotonic() - started, job.task.client, is_bound)

    def _repeat(self, job: Job, dead: Worker) -> None:
        """Let another worker do the job of one that died, before all jobs that wait."""
        dead.job = job.started = None
        idle = [worker for worker in self._workers if _is_idle(worker) and worker.takes(job)]
        if job.reply.done():
            return
        if idle:
            _hand_over(job, idle[0])
        else:
            self._queue.put_back(job)


def _is_idle(worker: Worker) -> bool:
    return worker.alive and worker.offer is not None and not worker.offer.done()


def _state(worker: Worker) -> str:
    if not worker.warm or worker.ended.is_set():
        return "starting"
    return "idle" if worker.job is None else "busy"


def _hand_over(job: Job, worker: Worker) -> None:
    assert worker.offer is not None  # noqa: S101 - it is idle
    worker.job = job
    worker.offer.set_result(job)


def _count_nothing(_size: int) -> None:
    """Hold no bytes: a saved plan is small, and goes into the database."""


def _fail(job: Job, error: Exception) -> None:
    if not job.reply.done():
        job.reply.set_exception(error)


def _kill_if_still_at(worker: Worker, job: Job) -> None:
    if worker.job is job:
        worker.kill()
