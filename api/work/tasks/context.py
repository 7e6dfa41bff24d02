"""What every operation does in a worker: read and bound the request, find the robot, time the stages, reply."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Literal

import orjson
from pydantic import TypeAdapter, ValidationError

from api.base.errors import UnknownScene, invalid, invalid_at, invalid_request
from api.base.size import parse_json, size_faults
from api.contract.parts.scenes import Scene
from api.contract.robots import RobotModel
from api.pool.messages import Reply
from api.store.contents.digests import sha256
from api.work.conversion.robots import to_robot
from planner.robots import load_robot

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from api.pool.messages import Caps, Task
    from planner.robots import Robot

JSON = "application/json"
"""The media type of an ordinary answer."""

CACHED_ROBOTS = 32
"""The number of uploaded robots that one worker keeps built; one takes up to some MiB with its seed table."""


TASKS: dict[str, Callable[[TaskContext], Reply]] = {}
"""The function that runs for each task, by the id of its operation."""


def task(name: str) -> Callable[[Callable[[TaskContext], Reply]], Callable[[TaskContext], Reply]]:
    """Make a function the one that a worker runs for a task.

    Args:
        name: The id of the operation.
    """

    def register(function: Callable[[TaskContext], Reply]) -> Callable[[TaskContext], Reply]:
        TASKS[name] = function
        return function

    return register


class TaskContext:
    """The context of a task in a worker: its request and its caps.

    Attributes:
        task: The request.
        caps: The bounds on a request.
        timings: The seconds that each stage took; `queue` is the wait for a worker.
    """

    def __init__(self, task: Task, caps: Caps) -> None:
        self.task = task
        self.caps = caps
        self.timings = {"queue": time.monotonic() - task.submitted}

    @property
    def arguments(self) -> Mapping[str, Any]:
        """The arguments that the server adds to the body."""
        return self.task.arguments

    @cached_property
    def document(self) -> Any:
        """The body as JSON, parsed once; it need not follow any schema, and nobody changes it.

        Raises:
            InvalidRequest: It is no JSON.
        """
        return parse_json(self.task.body)

    @contextmanager
    def stage(self, name: Literal["validate", "plan", "serialise"]) -> Iterator[None]:
        """Time the block, for the `Server-Timing` header."""
        start = time.monotonic()
        try:
            yield
        finally:
            self.timings[name] = time.monotonic() - start

    def request(self, schema: Any) -> Any:
        """Read the body as a value of its schema, within the caps of the service.

        Raises:
            InvalidRequest: It is too large, or does not follow the schema.
            UnknownScene: It names a scene that there is not.
        """
        request = in_scene(validated(schema, self.document, self.caps), self.arguments.get("scene"))
        deadline = getattr(request, "deadline", 0.0)
        if deadline > self.caps.max_deadline:
            raise invalid_at("/deadline", f"must be at most {self.caps.max_deadline:g} s; got {deadline:g} s")
        return request

    def robot(self, request: Any) -> Robot:
        """Find the robot that the request names.

        Raises:
            UnknownRobot: There is none with this id.
        """
        return robot_of(request.robot, self.arguments.get("definition"))

    def reply(self, value: Any, status: int = 200, **more: Any) -> Reply:
        """Make the reply with a value as JSON; `more` are further fields of the reply."""
        with self.stage("serialise"):
            body = to_json(value)
        return Reply(status, JSON, body, self.timings, **more)


def validated(schema: Any, document: Any, caps: Caps) -> Any:
    """Validate a parsed JSON document by a schema, once it is small enough.

    Raises:
        InvalidRequest: With everything that is wrong with it.
    """
    faults = size_faults(document, caps.max_waypoints, caps.max_samples)
    if faults:
        raise invalid(faults)
    try:
        return _adapter(schema).validate_python(document)
    except ValidationError as error:
        raise invalid_request(error, document) from None


def in_scene(request: Any, definition: bytes | None) -> Any:
    """Put the scene of a definition in the place of its id, if a request has one there.

    Raises:
        UnknownScene: There is no scene with this id.
    """
    if not isinstance(getattr(request, "scene", None), str):
        return request
    if definition is None:
        raise UnknownScene("No stored scene has this id. GET /v1/scenes lists them.")
    return request.model_copy(update={"scene": scene_of(definition)})


def scene_of(definition: bytes) -> Scene:
    """Read a scene from its definition."""
    scene: Scene = _adapter(Scene).validate_json(definition)
    return scene


def to_json(value: Any) -> bytes:
    """Write a value with numpy arrays as JSON."""
    return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)


def model_of(definition: bytes) -> Any:
    """Read the model of an added robot from its definition."""
    return _adapter(RobotModel).validate_json(definition)


def robot_of(robot_id: str, definition: bytes | None) -> Robot:
    """Find a robot of the catalogue, or the added one that has this definition.

    Raises:
        UnknownRobot: There is none with this id.
    """
    return load_robot(robot_id) if definition is None else _named(definition, robot_id)


@cache
def _adapter(schema: Any) -> TypeAdapter[Any]:
    return TypeAdapter(schema)


@lru_cache(maxsize=CACHED_ROBOTS)
def _named(definition: bytes, robot_id: str) -> Robot:
    """Find the robot under one of its ids, always the same object, so that its caches are made once."""
    return replace(_built(definition), id=robot_id)


@lru_cache(maxsize=CACHED_ROBOTS)
def _built(definition: bytes) -> Robot:
    """Make the robot of a definition. It is kept by the definition itself: no id brings back another robot's model."""
    return to_robot(model_of(definition), sha256(definition))
