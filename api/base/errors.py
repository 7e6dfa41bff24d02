"""Refusals of the service with their codes and HTTP statuses, and the faults that pydantic finds."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, ClassVar

from typing_extensions import override

from api.base.json_pointers import to_pointer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import ValidationError


STATUS_OF_CODE: dict[str, int] = {
    "unknown_robot": 404,
    "invalid_robot_model": 422,
    "unreachable_waypoint": 422,
    "configuration_change": 422,
    "singular_path": 422,
    "joint_position_limit": 422,
    "missing_dynamics": 422,
    "payload_exceeded": 422,
    "unsupported_format": 422,
    "infeasible_duration": 422,
    "limits_unsatisfiable": 422,
    "start_in_collision": 422,
    "collision": 422,
    "clearance_unproved": 422,
    "no_path_found": 422,
}
"""HTTP status of each problem code: of the planner here, of the service by its kinds of refusals below."""

MOST_FAULTS = 50
"""The most faults that one problem document lists."""

LONGEST_POINTER = 200
"""The most characters of a pointer that are repeated to a caller, who may have made up the names of fields in it."""


class ServiceError(Exception):
    """A request that the service, not the planner, refuses.

    Attributes:
        message: For the caller.
        headers: To send with the answer.
        details: Further fields of the problem document.
    """

    code: ClassVar[str]
    title: ClassVar[str]

    @override
    def __init_subclass__(cls, *, code: str, status: int, title: str) -> None:
        """Name a kind of refusal by its code, for programs, and its title, for people."""
        cls.code, cls.title = code, title
        STATUS_OF_CODE[code] = status

    def __init__(self, message: str, *, headers: Mapping[str, str] | None = None, **details: Any) -> None:
        super().__init__(message)
        self.message = message
        self.headers = dict(headers or {})
        self.details = details


class InvalidRequest(ServiceError, code="invalid_request", status=422, title="The request is not valid"):
    """The request does not follow the schema; `details["errors"]` lists the faults."""


class MalformedRequest(ServiceError, code="malformed_request", status=400, title="This is not an HTTP request"):
    """What arrived is not HTTP."""


class RequestTimeout(ServiceError, code="request_timeout", status=408, title="The request did not arrive in time"):
    """The client took too long to send its request."""


class HeaderTooLarge(ServiceError, code="header_too_large", status=431, title="The head of the request is too large"):
    """The head of the request is larger than the service reads."""


class TooManyRequests(ServiceError, code="too_many_requests", status=429, title="You have too much under way"):
    """The client has more under way than the service grants one client."""


class Unauthorized(ServiceError, code="unauthorized", status=401, title="This needs a valid key"):
    """The request has no valid key."""


class Forbidden(ServiceError, code="forbidden", status=403, title="The key does not allow this"):
    """The key may not do this."""


class ForeignOrigin(
    ServiceError, code="foreign_origin", status=403, title="The page that sent this is of another site"
):
    """A web page of another origin sent the request."""


class MisdirectedRequest(ServiceError, code="misdirected_request", status=421, title="The service has another name"):
    """The request was sent to a name that is not the service's."""


class NotFound(ServiceError, code="not_found", status=404, title="There is nothing here"):
    """Nothing is at this path."""


class MethodNotAllowed(
    ServiceError, code="method_not_allowed", status=405, title="This path does not have that method"
):
    """The path has other methods."""


class NotAcceptable(ServiceError, code="not_acceptable", status=406, title="There is no such format"):
    """None of the requested formats exists."""


class RobotExists(ServiceError, code="robot_exists", status=409, title="Another robot has this id"):
    """Another robot has this id."""


class CatalogueRobot(ServiceError, code="catalogue_robot", status=409, title="The robot belongs to the catalogue"):
    """A robot of the catalogue can be neither replaced nor deleted."""


class RobotOfAnother(ServiceError, code="robot_of_another", status=403, title="The robot belongs to another client"):
    """Another client added the robot."""


class TooManyRobots(ServiceError, code="too_many_robots", status=409, title="No more robots can be added"):
    """There is no room for more added robots."""


class UnknownScene(ServiceError, code="unknown_scene", status=404, title="There is no such scene"):
    """There is no scene with this id."""


class SceneExists(ServiceError, code="scene_exists", status=409, title="Another scene has this id"):
    """Another scene has this id."""


class SceneOfAnother(ServiceError, code="scene_of_another", status=403, title="The scene belongs to another client"):
    """Another client added the scene."""


class TooManyScenes(ServiceError, code="too_many_scenes", status=409, title="No more scenes can be kept"):
    """There is no room for more scenes."""


class UnknownRoadmap(ServiceError, code="unknown_roadmap", status=404, title="There is no such roadmap"):
    """The scene has no roadmap of this robot."""


class TooManyRoadmaps(
    ServiceError, code="too_many_roadmaps", status=409, title="The scene has no room for the roadmap"
):
    """The scene has as many roadmaps, or bytes of roadmaps, as it may have."""


class UnknownProject(ServiceError, code="unknown_project", status=404, title="There is no such project"):
    """There is no project with this name."""


class ProjectChanged(ServiceError, code="project_changed", status=412, title="The project was changed elsewhere"):
    """The project is not in the state that the request expects."""


class ProjectOfAnother(
    ServiceError, code="project_of_another", status=403, title="The project belongs to another client"
):
    """Another client saved the project."""


class TooManyProjects(ServiceError, code="too_many_projects", status=409, title="No more projects can be kept"):
    """There is no room for more projects."""


class UnknownBatch(ServiceError, code="unknown_batch", status=404, title="There is no such batch"):
    """There is no batch with this id, or it has been kept for long enough."""


class TooManyBatches(ServiceError, code="too_many_batches", status=409, title="No more batches can be taken"):
    """There is no room for more batches."""


class Conflict(ServiceError, code="conflict", status=409, title="The request contradicts an earlier one"):
    """The request contradicts an earlier one."""


class PayloadTooLarge(ServiceError, code="payload_too_large", status=413, title="The request body is too large"):
    """The body is larger than the service reads."""


class UnsupportedMediaType(
    ServiceError, code="unsupported_media_type", status=415, title="The request body must be JSON"
):
    """The body is not declared to be JSON."""


class MemoryExceeded(ServiceError, code="memory_exceeded", status=422, title="The request needs too much memory"):
    """A worker ran out of the memory that it may use."""

    def __init__(
        self, message: str = "The request needs more memory than a worker may use. Send a smaller one."
    ) -> None:
        super().__init__(message)


class InternalError(ServiceError, code="internal_error", status=500, title="The service failed"):
    """A fault of the service; the log has the rest."""

    def __init__(self, message: str = "Internal error. Please report it with the log.") -> None:
        super().__init__(message)


class Overloaded(ServiceError, code="overloaded", status=503, title="Too many requests are waiting"):
    """The queue is full."""


class DatabaseUnavailable(
    ServiceError, code="database_unavailable", status=503, title="The database cannot be reached"
):
    """The database does not answer."""


class DeadlineExceeded(ServiceError, code="deadline_exceeded", status=504, title="The deadline has passed"):
    """The deadline of the request has passed."""


def what_to_do(max_deadline: float) -> str:
    """Say what helps against a deadline that passes, where the service takes none longer than this, s."""
    return (
        f"Raise `deadline` (at most {max_deadline:g} s), send fewer waypoints, poses or samples, or choose "
        "another back end."
    )


def invalid_request(error: ValidationError, document: Any) -> InvalidRequest:
    """Write what pydantic found, as pointers into the caller's `document` and without the caller's values."""
    faults = [
        {"pointer": _pointer(fault["loc"], fault["type"], document), "message": message_of(fault)}
        for fault in error.errors(include_url=False, include_input=False)[:MOST_FAULTS]
    ]
    return invalid(faults)


def invalid_at(pointer: str, message: str) -> InvalidRequest:
    """Make the error with one fault, at a JSON pointer into the request; empty: the request as a whole."""
    return invalid([{"pointer": pointer, "message": message}])


def invalid(faults: list[dict[str, str]]) -> InvalidRequest:
    """Make the error with these faults; its message is the first of them."""
    first = f"{faults[0]['pointer']}: {faults[0]['message']}".removeprefix(": ")
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return InvalidRequest(first + more, errors=faults)


OF_THE_KIND = ("union_tag_invalid", "union_tag_not_found")
"""Errors that pydantic locates at the object, and a reader at its field `kind`."""


def _pointer(location: tuple[int | str, ...], error: str, document: Any) -> str:
    """Write the JSON pointer of a pydantic location, which names members of unions besides the keys of the data."""
    steps = (*location, "kind") if error in OF_THE_KIND else location
    missing = len(steps) - 1 if error in ("missing", *OF_THE_KIND) else None
    place: list[str | int] = []
    tagged = False
    for i, step in enumerate(steps):
        is_there = _has(document, step)
        if isinstance(document, dict) and document.get("kind") == step and not tagged:
            tagged = True
        elif is_there or i == missing:
            place.append(step)
            document, tagged = document[step] if is_there else None, False
    return to_pointer(place)[:LONGEST_POINTER]


def _has(document: Any, step: int | str) -> bool:
    """Tell whether an object or array has a child of this name."""
    if isinstance(document, dict):
        return step in document
    return isinstance(document, list) and isinstance(step, int) and step < len(document)


PYDANTIC_SUBJECT = re.compile("^[A-Z][a-z]+ should ")
"""The beginning of messages of pydantic: `Input should `, `List should `, ..."""


def message_of(fault: Mapping[str, Any]) -> str:
    """Say which condition of a field pydantic found violated, without the caller's value."""
    match fault["type"]:
        case "union_tag_invalid":  # pydantic's message repeats the caller's value
            return f"must be one of {fault['ctx']['expected_tags']}"
        case "missing" | "union_tag_not_found":
            return "must be given"
        case "extra_forbidden":
            return "unknown field. Remove it, or check its spelling."
        case "value_error":
            return str(fault["ctx"]["error"])
        case _:
            message: str = fault["msg"].replace(" after validation, not ", "; got ")
            return PYDANTIC_SUBJECT.sub("must ", message)
