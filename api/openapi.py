"""The OpenAPI 3.1 document, from the table of operations and the schemas."""

from __future__ import annotations

from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from fastapi.openapi.utils import get_openapi
from pydantic import TypeAdapter

from api.errors import MEDIA_TYPE, STATUS_OF_CODE
from api.operations import OPERATIONS
from api.schemas.answers import RosJointTrajectory
from api.schemas.problems import Problem
from planner.export import FORMATS

if TYPE_CHECKING:
    from fastapi import FastAPI

    from api.operations import Operation

REFERENCE = "#/components/schemas/{model}"
FORMAT_SCHEMAS = {"ros2": RosJointTrajectory}
"""Schemas of the JSON forms of a plan besides `json`; the others are text."""


def build_openapi(app: FastAPI) -> dict[str, Any]:
    """The document; made once, then kept by the app."""
    if app.openapi_schema is None:
        document = get_openapi(
            title=app.title,
            version=app.version,
            description=app.description,
            license_info=app.license_info,
            routes=app.routes,
        )
        document["components"] = {"schemas": _components()}
        app.openapi_schema = document
    return app.openapi_schema


def responses_of(operation: Operation) -> dict[int | str, dict[str, Any]]:
    """Documentation of what an operation answers."""
    responses: dict[int | str, dict[str, Any]] = {operation.status: _success(operation)}
    for status, meaning in operation.also.items():
        responses[status] = _success(operation) | {"description": meaning}
    by_status: dict[int, list[str]] = {}
    for code in operation.problems:
        by_status.setdefault(STATUS_OF_CODE[code], []).append(code)
    for status, codes in sorted(by_status.items()):
        description = f"{HTTPStatus(status).phrase}: " + ", ".join(f"`{code}`" for code in codes)
        responses[status] = {"description": description, "content": {MEDIA_TYPE: {"schema": _reference(Problem)}}}
        if "overloaded" in codes:
            seconds = {"description": "Wait that long, s.", "schema": {"type": "integer"}}
            responses[status]["headers"] = {"Retry-After": seconds}
    return responses


def extra_of(operation: Operation) -> dict[str, Any]:
    """Documentation of what an operation takes."""
    extra: dict[str, Any] = {}
    parameters = []
    if "{id}" in operation.path:
        parameters.append(
            {
                "name": "id",
                "in": "path",
                "required": True,
                "description": "Id of a robot.",
                "schema": {"type": "string", "minLength": 1},
            }
        )
    if operation.formats:
        parameters.append(
            {
                "name": "format",
                "in": "query",
                "description": "Form of the answer; goes before the Accept header.",
                "schema": {"type": "string", "enum": list(FORMATS), "title": "PlanFormat"},
            }
        )
    if parameters:
        extra["parameters"] = parameters
    if operation.request is not None:
        content = {
            "schema": _reference(operation.request),
            "examples": {name: {"value": value} for name, value in operation.examples.items()},
        }
        extra["requestBody"] = {"required": True, "content": {"application/json": content}}
    return extra


def _success(operation: Operation) -> dict[str, Any]:
    if operation.answer is None:
        return {"description": "Done."}
    content = {"application/json": {"schema": _reference(operation.answer)}}
    if operation.formats:
        for name, form in FORMATS.items():
            if name in FORMAT_SCHEMAS:
                content[form.media_type] = {"schema": _reference(FORMAT_SCHEMAS[name])}
            elif name != "json":
                content[form.media_type] = {"schema": {"type": "string"}}
    response: dict[str, Any] = {"description": "Success.", "content": content}
    if operation.status == 201:
        location = {"description": "Where it is.", "schema": {"type": "string"}}
        response["headers"] = {"Location": location}
    return response


def _reference(schema: Any) -> dict[str, Any]:
    return {"$ref": REFERENCE.format(model=schema.__name__)}


def _components() -> dict[str, Any]:
    """Every schema that the operations name, and those that these name in turn."""
    roots: list[Any] = [Problem, *FORMAT_SCHEMAS.values()]
    roots += [schema for op in OPERATIONS for schema in (op.request, op.answer) if schema is not None]
    inputs: Any = [(schema.__name__, "validation", TypeAdapter(schema)) for schema in roots]
    _, definitions = TypeAdapter.json_schemas(inputs, ref_template=REFERENCE)
    return dict(sorted(definitions["$defs"].items()))
