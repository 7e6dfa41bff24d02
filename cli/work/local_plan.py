"""A plan request answered in this process, without a service: what `planner plan` does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import orjson
from pydantic import BaseModel, ValidationError

from api.base.errors import invalid_at, invalid_request
from api.contract.requests import PlanRequest
from api.store.contents.digests import request_hash
from api.work.answers.formats import FORMATS, Format
from api.work.answers.plans import AnswerOptions
from api.work.answers.views import report
from api.work.conversion.problems import to_backend, to_planning_problem
from planner.planning import plan
from planner.robots import Robot, load_robot

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.plans.result import Plan

R = TypeVar("R", bound=BaseModel)
"""A schema of requests."""


def read_request(text: bytes, backend: str | None = None, robot: str | None = None) -> PlanRequest:
    """Read the request in a document of POST /v1/trajectories.

    Args:
        text: The document as JSON.
        backend: The kind of back end in place of the document's, with its default options; None: the document's.
        robot: The id of the robot in place of the document's; None: the document's.

    Raises:
        InvalidRequest: With everything that is wrong with it.
    """
    changes = {} if backend is None else {"backend": {"kind": backend}}
    return read_document(PlanRequest, text, changes | ({} if robot is None else {"robot": robot}))[0]


def read_document(model: type[R], text: bytes, changes: Mapping[str, Any]) -> tuple[R, dict[str, Any]]:
    """Read a request with some fields changed.

    Args:
        model: The schema of the request.
        text: The document as JSON.
        changes: The fields that replace the document's.

    Returns:
        The request, and the changed document.

    Raises:
        InvalidRequest: With everything that is wrong with it.
    """
    try:
        document: Any = orjson.loads(text)
    except orjson.JSONDecodeError as error:
        raise invalid_at("", f"not JSON: {error}") from None
    if isinstance(document, dict):
        document |= changes
    return checked_request(model, document), document


def checked_request(model: type[R], document: Any) -> R:
    """Check a document against the schema of requests.

    Raises:
        InvalidRequest: With everything that is wrong with it.
    """
    try:
        request = model.model_validate_json(orjson.dumps(document))
    except ValidationError as error:
        raise invalid_request(error, document) from None
    if isinstance(name := getattr(request, "scene", None), str):
        raise invalid_at("/scene", f"must be the scene itself: only a service stores scenes; got {name!r}")
    return request


def plan_request(request: PlanRequest, robot: Robot | None = None) -> Plan:
    """Plan a request.

    Args:
        request: The request.
        robot: The robot; None: the one of the catalogue that the request names.

    Raises:
        PlanningError: Of the kind that says why there is none.
    """
    robot = robot or load_robot(request.robot)
    return plan(to_planning_problem(request, robot), to_backend(request.backend))


def format_of(name: str) -> Format | None:
    """Find the format that a file's name asks for by its suffix, the longest that fits; None: there is none."""
    fitting = [form for form in FORMATS.values() if name.endswith(form.suffix)]
    return max(fitting, key=lambda form: len(form.suffix), default=None)


def render(solved: Plan, request: PlanRequest, form: Format, definition: bytes | None = None) -> bytes:
    """Write the plan in that format, sampled as the request asks; in JSON with the polynomials, for `planner validate`.

    Args:
        solved: The plan.
        request: The request.
        form: The format.
        definition: The model of a robot that is not of the catalogue, as canonical JSON.
    """
    include = {*request.include, *(("polynomials",) if form is FORMATS["json"] else ())}
    options = AnswerOptions(
        request.sample_period, frozenset(include), request.repeat, request_hash(request, definition)
    )
    return form.render(solved, options)


def report_of(solved: Plan, request: PlanRequest, title: str, definition: bytes | None = None) -> bytes:
    """Write a report of the plan, one file that anyone can open.

    Args:
        solved: The plan.
        request: The request.
        title: The title of the report.
        definition: The model of a robot that is not of the catalogue, as canonical JSON.

    Raises:
        NotAcceptable: The program of reports was not built with this installation.
    """
    asked = request.model_dump(mode="json", by_alias=True, exclude_unset=True)
    return report(solved, asked, request_hash(request, definition), title)
