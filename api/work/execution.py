"""The execution of a task in a worker: its operation runs, and every outcome becomes a reply."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import orjson

from api.base import errors
from api.base.codings import NAMES, Coding, compress
from api.base.logs import where_from
from api.base.problem_documents import MEDIA_TYPE
from api.contract.examples.request_examples import request_examples
from api.contract.parts.common import Schema
from api.pool.messages import Reply, Task
from api.store.items import CHUNK_BYTES, CHUNK_SECONDS, PLAN_ITEMS, decompressed
from api.work.answers.problem_documents import problem_document
from api.work.tasks import (
    batch_reports,
    cells,
    collisions,
    dynamics,
    kinematics,
    openapi,
    path_files,
    robots,
    scenes,
    task_orders,
    trajectories,
    trajectory_operations,
)
from api.work.tasks.batches import item_steps
from api.work.tasks.context import TASKS, TaskContext, task
from planner.backends import BACKENDS
from planner.errors import PlanningError
from planner.robots import load_robot

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterator

    from api.pool.messages import Caps


SUBJECTS = (
    trajectories,
    trajectory_operations,
    task_orders,
    cells,
    path_files,
    batch_reports,
    robots,
    scenes,
    collisions,
    kinematics,
    dynamics,
    openapi,
)
"""The modules whose functions are registered as tasks, besides `batches` and this one."""


class Attempt:
    """A task that is done step by step, between the steps of others.

    Attributes:
        context: The context of the task.
        reply: The reply, once there is one: after the last step, or where it was refused in one.
    """

    def __init__(self, task: Task, caps: Caps, steps: Callable[[TaskContext], Generator[None, None, Reply]]) -> None:
        self.context = TaskContext(task, caps)
        self.reply: Reply | None = None
        self._steps = steps(self.context)

    def advance(self) -> None:
        """Do the next step, if there is one left."""
        if self.reply is not None:
            return
        try:
            next(self._steps)
        except StopIteration as end:
            self.reply = end.value
        except (PlanningError, errors.ServiceError) as refusal:
            self.reply = _refused(refusal, self.context)


@task(PLAN_ITEMS)
def plan_items(context: TaskContext) -> Reply:
    """Plan requests of a batch, the argument `items`, each as if alone, into a list of replies.

    All are read, then all are planned, then all are written. So code and data of a step stay in the processor's caches:
    changing between the steps with every request costs a tenth of a plan.

    The replies are fewer than the requests where these are large, or take longer than a chunk should. An unexpected
    error ends them all: it may come from the memory that the others take.
    """
    end = time.monotonic() + CHUNK_SECONDS
    under_way = _read(context, end)
    for until in (end, math.inf):
        for count, attempt in enumerate(under_way, 1):
            attempt.advance()
            if time.monotonic() > until:
                del under_way[count:]
                break
    replies = [attempt.reply for attempt in under_way]
    return Reply(200, "application/octet-stream", b"", result=replies)


def _read(context: TaskContext, end: float) -> list[Attempt]:
    """Read requests up to a time, s on the monotonic clock, or a number of bytes; at least one."""
    under_way: list[Attempt] = []
    size = 0
    for body, arguments in context.arguments["items"]:
        attempt = Attempt(replace(context.task, body=decompressed(body), arguments=arguments), context.caps, item_steps)
        size += len(attempt.context.task.body) + len(arguments.get("scene", b""))
        if under_way and (size > CHUNK_BYTES or time.monotonic() > end):
            break
        attempt.advance()
        under_way.append(attempt)
    return under_way


WARM_UP_ROBOT = "kuka_kr16_l6_2"
"""The robot that is planned for before any request; it has inertias, which one back end asks for."""

ARGUMENTS = {"format": "json", "accept": "*/*", "index": 0}
"""The arguments with which examples are run before any request."""


def execute(task: Task, caps: Caps) -> Reply:
    """Run one task; whatever happens, a reply comes back."""
    context = TaskContext(task, caps)
    try:
        if time.monotonic() >= task.deadline:
            hint = errors.what_to_do(caps.max_deadline)
            raise errors.DeadlineExceeded(f"The deadline passed while the request waited for a worker. {hint}")
        reply = _compressed(TASKS[task.operation](context), context)
    except (PlanningError, errors.ServiceError) as refusal:
        reply = _refused(refusal, context)
    except Exception as error:  # noqa: BLE001 - the boundary of the process: nothing may leave it but a reply
        if wants_memory(error):
            reply = _refused(errors.MemoryExceeded(), context)
        else:
            reply = _refused(errors.InternalError(), context)
            reply = replace(reply, failure=where_from(error))
        reply = replace(reply, worker_is_fit=False)
    return reply if reply.timings is context.timings else replace(reply, timings=context.timings)


def _compressed(reply: Reply, context: TaskContext) -> Reply:
    """Compress the body of a reply as the client takes it; that belongs to writing it."""
    start = time.monotonic()
    body = compress(reply.body, context.task.coding)
    if body is None:
        return reply
    context.timings["serialise"] = context.timings.get("serialise", 0.0) + time.monotonic() - start
    return replace(reply, body=body, headers={**reply.headers, "Content-Encoding": context.task.coding.name})


def _refused(refusal: PlanningError | errors.ServiceError, context: TaskContext) -> Reply:
    """Make a refusal the reply."""
    status, body = problem_document(refusal, context.task.instance)
    return Reply(status, MEDIA_TYPE, body, context.timings, code=refusal.code)


def wants_memory(error: BaseException) -> bool:
    """Tell whether an error, or one that led to it, says that no memory was left."""
    causes = [error]
    while (cause := causes[-1].__cause__ or causes[-1].__context__) is not None:
        causes.append(cause)
    return any(isinstance(cause, MemoryError) or "bad_alloc" in str(cause) for cause in causes)


def warm_up(caps: Caps) -> None:
    """Plan once with every back end and run an example of every operation: no request pays for first-time work.

    Schemas are built in the order of their definition: one that is part of several is built once. Searches end after
    one iteration, as further ones repeat its work.
    """
    for schema in _schemas_of(Schema):
        schema.model_rebuild()
    middle = load_robot(WARM_UP_ROBOT).middle
    waypoints = [{"kind": "joint", "position": (middle + step).tolist()} for step in (0.0, 0.01, 0.03)]
    waypoints[1]["transition"] = {"kind": "through"}
    for kind, backend in BACKENDS.items():
        options = {"iterations": 1} if hasattr(backend, "iterations") else {}
        request = {"robot": WARM_UP_ROBOT, "waypoints": waypoints, "backend": {"kind": kind, **options}}
        _execute_example("plan_trajectory", request, caps)
    for name in NAMES:
        compress(b"", Coding(name, 0))
    for operation, examples in request_examples().items():
        if operation in TASKS:  # the server alone saves projects
            _execute_example(operation, next(iter(examples.values())), caps)


def _schemas_of(base: type[Schema]) -> Iterator[type[Schema]]:
    for schema in base.__subclasses__():
        yield schema
        yield from _schemas_of(schema)


def _execute_example(operation: str, request: Any, caps: Caps) -> None:
    TASKS[operation](TaskContext(Task(operation, "", 0.0, math.inf, orjson.dumps(request), ARGUMENTS), caps))
