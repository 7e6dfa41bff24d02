"""Problem documents of planning problems, in the words of the request."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from api.base import problem_documents
from api.base.errors import MOST_FAULTS, ServiceError
from api.base.json_pointers import to_pointer
from api.work.answers.values import choice_answer, nearest_answer, path_point_answer, value_answer
from planner.errors import ClearanceUnproved, Collision, InvalidProblem, InvalidRobotModel, NoPathFound

if TYPE_CHECKING:
    from planner import FieldPath
    from planner.errors import PlanningError, Remedy


def problem_document(error: PlanningError | ServiceError, instance: str) -> tuple[int, bytes]:
    """Give the HTTP status and the problem document of an error; `instance` is the path of the request."""
    if isinstance(error, ServiceError):
        return problem_documents.problem_document(error, instance)
    return problem_documents.write_problem(error, _detail(error), _planning_fields(error), instance)


def _planning_fields(error: PlanningError) -> dict[str, Any]:
    names = ("robot", "waypoint", "segment", "joint", "value", "limit", "time")
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
    if error.choices:
        document["choices"] = list(map(choice_answer, error.choices))
    if error.hints:
        document["hints"] = list(map(_remedy, error.hints))
    if isinstance(error, InvalidProblem):
        document["errors"] = [
            {"pointer": pointer_of(fault.field), "message": fault.message} for fault in error.faults[:MOST_FAULTS]
        ]
    if isinstance(error, InvalidRobotModel):
        document["findings"] = [asdict(finding) for finding in error.findings[:MOST_FAULTS]]
    if error.nearest is not None:
        document["nearest"] = nearest_answer(error.nearest)
    if error.path_point is not None:
        document["place"] = path_point_answer(error.path_point)
    return document


def _remedy(remedy: Remedy) -> dict[str, Any]:
    return {
        "change": pointer_of(remedy.field),
        "value": value_answer(remedy.value),
        "explanation": remedy.explanation,
    }


def _detail(error: PlanningError) -> str:
    if isinstance(error, InvalidProblem):
        return "; ".join(f"{pointer_of(fault.field)}: {fault.message}" for fault in error.faults)
    return error.message


NAMES = {"inverse_kinematics": "ik", "__class__": "kind"}
"""The steps of a library's field path that a request calls by another name."""


def pointer_of(field: FieldPath) -> str:
    """Write the JSON pointer (RFC 6901) into the request to a field of the library's values."""
    return to_pointer(NAMES.get(str(step), step) for step in field)
