"""What a worker does with a task: run its operation and turn whatever happens into a reply."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import orjson

from api import errors
from api.batches.items import CHUNK_SECONDS, PLAN_ITEM, PLAN_ITEMS
from api.failures import where_from
from api.messages import Reply, Task
from api.openapi import get_openapi
from api.operations import OPERATIONS
from api.tasks.batches import plan_item
from api.tasks.work import Work
from planner.errors import PlanningError

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.messages import Caps


def plan_items(work: Work) -> Reply:
    """Plan requests of a batch one after the other; the result is a list of replies.

    They are fewer than the requests, the argument `items`, where one left the worker unfit for the next, or where they
    took longer than those that are planned together should.
    """
    end = time.monotonic() + CHUNK_SECONDS
    replies: list[Reply] = []
    for body, arguments in work.arguments["items"]:
        replies.append(execute(replace(work.task, operation=PLAN_ITEM, body=body, arguments=arguments), work.caps))
        if not replies[-1].worker_is_fit or time.monotonic() > end:
            break
    return Reply(200, "application/octet-stream", b"", result=replies, worker_is_fit=replies[-1].worker_is_fit)


RUN: dict[str, Callable[[Work], Reply]] = {
    "get_openapi": get_openapi,
    PLAN_ITEMS: plan_items,
    PLAN_ITEM: plan_item,
    **{operation.id: operation.run for operation in OPERATIONS if operation.run is not None},
}
"""The function that runs for each operation id."""

WARM_UP_ROBOT = "kuka_kr16_l6_2"
"""The robot that is planned for before any request; it has inertias, which one back end asks for."""

ARGUMENTS = {"format": "json", "accept": "*/*", "index": 0}
"""The arguments with which examples are run before any request."""


def execute(task: Task, caps: Caps) -> Reply:
    """Run one task; whatever happens, a reply comes back."""
    started = time.monotonic()
    queue = {"queue": started - task.submitted}
    failure, fit = None, True
    work = Work(task, caps)
    try:
        if started >= task.deadline:
            hint = errors.what_to_do(caps.max_deadline)
            raise errors.DeadlineExceeded(f"the deadline passed while the request waited for a worker; {hint}")
        reply = RUN[task.operation](work)
        return replace(reply, timings=queue | dict(reply.timings))
    except (PlanningError, errors.ServiceError) as error:
        refusal: PlanningError | errors.ServiceError = error
    except Exception as error:  # noqa: BLE001 - the boundary of the process: nothing may leave it but a reply
        fit = False
        if wants_memory(error):
            refusal = errors.MemoryExceeded("the request needs more memory than a worker may use")
        else:
            refusal = errors.InternalError("the service failed on this request")
            failure = where_from(error)
    status, body = errors.problem_document(refusal, task.instance)
    timings = queue | work.timings
    return Reply(status, errors.MEDIA_TYPE, body, timings, code=refusal.code, failure=failure, worker_is_fit=fit)


def wants_memory(error: BaseException) -> bool:
    """Tell whether an error, or one that led to it, says that no memory was left, in Python's words or in C++'s."""
    causes = [error]
    while (cause := causes[-1].__cause__ or causes[-1].__context__) is not None:
        causes.append(cause)
    return any(isinstance(cause, MemoryError) or "bad_alloc" in str(cause) for cause in causes)


def warm_up(caps: Caps) -> None:
    """Plan once with every back end and run an example of every operation: no request pays for first-time work."""
    from planner.backends import BACKENDS
    from planner.robots import load_robot

    middle = load_robot(WARM_UP_ROBOT).middle
    waypoints = [{"kind": "joint", "position": (middle + step).tolist()} for step in (0.0, 0.01, 0.03)]
    waypoints[1]["transition"] = {"kind": "through"}  # straight lines alone would not load the package toppra
    for kind in BACKENDS:
        _run("plan_trajectory", {"robot": WARM_UP_ROBOT, "waypoints": waypoints, "backend": {"kind": kind}}, caps)
    for operation in OPERATIONS:
        for example in [*operation.examples.values()][:1]:
            _run(operation.id, example, caps)


def _run(operation: str, request: Any, caps: Caps) -> None:
    RUN[operation](Work(Task(operation, "", 0.0, math.inf, orjson.dumps(request), ARGUMENTS), caps))
