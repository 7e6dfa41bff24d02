"""One table leads from error codes to HTTP; the errors of the service, what pydantic finds among them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import ValidationError


STATUS_OF_CODE: dict[str, int] = {
    "malformed_request": 400,
    "invalid_request": 422,
    "unauthorized": 401,
    "forbidden": 403,
    "foreign_origin": 403,
    "robot_of_another": 403,
    "scene_of_another": 403,
    "not_found": 404,
    "unknown_robot": 404,
    "unknown_batch": 404,
    "unknown_scene": 404,
    "method_not_allowed": 405,
    "not_acceptable": 406,
    "request_timeout": 408,
    "robot_exists": 409,
    "catalogue_robot": 409,
    "too_many_robots": 409,
    "scene_exists": 409,
    "too_many_scenes": 409,
    "too_many_batches": 409,
    "conflict": 409,
    "payload_too_large": 413,
    "unsupported_media_type": 415,
    "misdirected_request": 421,
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
    "memory_exceeded": 422,
    "too_many_requests": 429,
    "header_too_large": 431,
    "internal_error": 500,
    "overloaded": 503,
    "database_unavailable": 503,
    "deadline_exceeded": 504,
}
"""HTTP status of each problem code."""

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

    def __init__(self, message: str, *, headers: Mapping[str, str] | None = None, **details: Any) -> None:
        super().__init__(message)
        self.message = message
        self.headers = dict(headers or {})
        self.details = details


class InvalidRequest(ServiceError):
    """The request does not follow the schema; `details["errors"]` lists the faults."""

    code = "invalid_request"
    title = "The request is not valid"


class MalformedRequest(ServiceError):
    """What arrived is not HTTP."""

    code = "malformed_request"
    title = "This is not an HTTP request"


class RequestTimeout(ServiceError):
    """The client took too long to send its request."""

    code = "request_timeout"
    title = "The request did not arrive in time"


class HeaderTooLarge(ServiceError):
    """The head of the request is larger than the service reads."""

    code = "header_too_large"
    title = "The head of the request is too large"


class TooManyRequests(ServiceError):
    """The client has more under way than the service grants one client."""

    code = "too_many_requests"
    title = "You have too much under way"


class Unauthorized(ServiceError):
    """The request has no valid key."""

    code = "unauthorized"
    title = "This needs a valid key"


class Forbidden(ServiceError):
    """The key may not do this."""

    code = "forbidden"
    title = "The key does not allow this"


class ForeignOrigin(ServiceError):
    """A web page of another origin sent the request."""

    code = "foreign_origin"
    title = "The page that sent this is of another site"


class MisdirectedRequest(ServiceError):
    """The request was sent to a name that is not the service's."""

    code = "misdirected_request"
    title = "The service has another name"


class NotFound(ServiceError):
    """Nothing is at this path."""

    code = "not_found"
    title = "There is nothing here"


class MethodNotAllowed(ServiceError):
    """The path has other methods."""

    code = "method_not_allowed"
    title = "This path does not have that method"


class NotAcceptable(ServiceError):
    """None of the requested formats exists."""

    code = "not_acceptable"
    title = "There is no such format"


class RobotExists(ServiceError):
    """Another robot has this id."""

    code = "robot_exists"
    title = "Another robot has this id"


class CatalogueRobot(ServiceError):
    """A robot of the catalogue can be neither replaced nor deleted."""

    code = "catalogue_robot"
    title = "The robot belongs to the catalogue"


class RobotOfAnother(ServiceError):
    """Another client added the robot."""

    code = "robot_of_another"
    title = "The robot belongs to another client"


class TooManyRobots(ServiceError):
    """There is no room for more added robots."""

    code = "too_many_robots"
    title = "No more robots can be added"


class UnknownScene(ServiceError):
    """There is no scene with this id."""

    code = "unknown_scene"
    title = "There is no such scene"


class SceneExists(ServiceError):
    """Another scene has this id."""

    code = "scene_exists"
    title = "Another scene has this id"


class SceneOfAnother(ServiceError):
    """Another client added the scene."""

    code = "scene_of_another"
    title = "The scene belongs to another client"


class TooManyScenes(ServiceError):
    """There is no room for more scenes."""

    code = "too_many_scenes"
    title = "No more scenes can be kept"


class UnknownBatch(ServiceError):
    """There is no batch with this id, or it has been kept for long enough."""

    code = "unknown_batch"
    title = "There is no such batch"


class TooManyBatches(ServiceError):
    """There is no room for more batches."""

    code = "too_many_batches"
    title = "No more batches can be taken"


class Conflict(ServiceError):
    """The request contradicts an earlier one."""

    code = "conflict"
    title = "The request contradicts an earlier one"


class PayloadTooLarge(ServiceError):
    """The body is larger than the service reads."""

    code = "payload_too_large"
    title = "The request body is too large"


class UnsupportedMediaType(ServiceError):
    """The body is not declared to be JSON."""

    code = "unsupported_media_type"
    title = "The request body must be JSON"


class MemoryExceeded(ServiceError):
    """A worker ran out of the memory that it may use."""

    code = "memory_exceeded"
    title = "The request needs too much memory"


class InternalError(ServiceError):
    """A fault of the service; the log has the rest."""

    code = "internal_error"
    title = "The service failed"


class Overloaded(ServiceError):
    """The queue is full."""

    code = "overloaded"
    title = "Too many requests are waiting"


class DatabaseUnavailable(ServiceError):
    """The database does not answer."""

    code = "database_unavailable"
    title = "The database cannot be reached"


class DeadlineExceeded(ServiceError):
    """The deadline of the request has passed."""

    code = "deadline_exceeded"
    title = "The deadline has passed"


def what_to_do(max_deadline: float) -> str:
    """Say what helps against a deadline that passes, where the service takes none longer than this, s."""
    return (
        f"a larger `deadline` may help (at most {max_deadline:g} s), or less to do: "
        "fewer waypoints, poses or samples, or another back end"
    )


def invalid_request(error: ValidationError, document: Any) -> InvalidRequest:
    """Write what pydantic found, as pointers into the caller's `document` and without the caller's values."""
    faults = [
        {"pointer": _pointer(fault["loc"], fault["type"], document), "message": _message(fault)}
        for fault in error.errors(include_url=False, include_input=False)[:MOST_FAULTS]
    ]
    return invalid(faults)


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
    pointer, tagged = "", False
    for i, step in enumerate(steps):
        is_there = _has(document, step)
        if isinstance(document, dict) and document.get("kind") == step and not tagged:
            tagged = True
        elif is_there or i == missing:
            pointer += "/" + str(step).replace("~", "~0").replace("/", "~1")
            document, tagged = document[step] if is_there else None, False
    return pointer[:LONGEST_POINTER]


def _has(document: Any, step: int | str) -> bool:
    """Tell whether an object or array has a child of this name."""
    if isinstance(document, dict):
        return step in document
    return isinstance(document, list) and isinstance(step, int) and step < len(document)


def _message(fault: Mapping[str, Any]) -> str:
    context = fault.get("ctx", {})
    match fault["type"]:
        case "union_tag_invalid":  # pydantic's message repeats the caller's value
            return f"unknown kind; there are: {context['expected_tags']}"
        case "union_tag_not_found":
            return "the field 'kind' is missing"
        case "extra_forbidden":
            return "unknown field"
        case "value_error":
            return str(context["error"])
        case _:
            message: str = fault["msg"]
            return message.replace(" after validation", "")
