"""Errors, of the library and of the service, become problem documents (RFC 9457); no planning problems."""

from __future__ import annotations

from dataclasses import asdict
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

import orjson

from api.base.errors import MOST_FAULTS, STATUS_OF_CODE, ServiceError
from planner.errors import ClearanceUnproved, Collision, InvalidProblem, InvalidRobotModel, NoPathFound
from planner.fields import KIND

if TYPE_CHECKING:
    from planner.errors import PlanningError, Remedy
    from planner.fields import FieldPath

MEDIA_TYPE = "application/problem+json"
"""The media type of problem documents (RFC 9457)."""


def problem_document(error: PlanningError | ServiceError, instance: str) -> tuple[int, bytes]:
    """Give the HTTP status and the problem document of an error; `instance` is the path of the request."""
    status = STATUS_OF_CODE.get(error.code, HTTPStatus.UNPROCESSABLE_ENTITY)
    document = {
        "type": f"urn:trajectory-planner:problem:{error.code}",
        "title": error.title,
        "status": int(status),
        "detail": _detail(error),
        "instance": instance,
        "code": error.code,
        **(error.details if isinstance(error, ServiceError) else _planning_fields(error)),
    }
    return status, orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY)


def _planning_fields(error: PlanningError) -> dict[str, Any]:
    names = ("waypoint", "segment", "joint", "value", "limit", "time")
    document: dict[str, Any] = {name: getattr(error, name) for name in names if getattr(error, name) is not None}
    if isinstance(error, Collision | ClearanceUnproved):
        document["pair"] = error.pair
    if isinstance(error, Collision):
        document |= {"depth": error.depth, "position": error.position}
        document |= {} if error.point is None else {"point": error.point}
    if isinstance(error, NoPathFound):
        document["checks"] = error.checks
        document |= {"enclosed_by": error.enclosed_by} if error.enclosed_by else {}
    if error.remedies:
        document["remedies"] = list(map(_remedy, error.remedies))
    if error.hints:
        document["hints"] = list(map(_remedy, error.hints))
    if isinstance(error, InvalidProblem):
        document["errors"] = [
            {"pointer": pointer_of(fault.field), "message": fault.message} for fault in error.faults[:MOST_FAULTS]
        ]
    if isinstance(error, InvalidRobotModel):
        document["findings"] = [asdict(finding) for finding in error.findings[:MOST_FAULTS]]
    if error.nearest is not None:
        from api.work.answers.values import nearest_answer

        document["nearest"] = nearest_answer(error.nearest)
    if error.path_point is not None:
        from api.work.answers.values import path_point_answer

        document["place"] = path_point_answer(error.path_point)
    return document


def _remedy(remedy: Remedy) -> dict[str, Any]:
    from api.work.answers.values import value_answer

    return {
        "change": pointer_of(remedy.field),
        "value": value_answer(remedy.value),
        "explanation": remedy.explanation,
    }


def _detail(error: PlanningError | ServiceError) -> str:
    if isinstance(error, InvalidProblem):
        return "; ".join(f"{pointer_of(fault.field)}: {fault.message}" for fault in error.faults)
    return error.message


NAMES = {"inverse_kinematics": "ik", KIND: "kind"}
"""The steps of a library's field path that a request calls by another name."""


def pointer_of(field: FieldPath) -> str:
    """Write the JSON pointer (RFC 6901) into the request to a field of the library's values."""
    return "".join(f"/{NAMES.get(str(step), step)}" for step in field)
