"""The OpenAPI 3.1 document, from the operations and the schemas. A worker makes it, as it knows the back ends."""

from __future__ import annotations

from functools import cache
from http import HTTPStatus
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import orjson
from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

from api.answers.views import VIEWS
from api.errors import STATUS_OF_CODE
from api.operations import OPERATIONS
from api.pages import DEFAULT_ENTRIES, MOST_ENTRIES
from api.problem_documents import MEDIA_TYPE
from api.schemas.problem_documents import ProblemDocument
from api.schemas.ros import RosJointTrajectory
from api.size import CAPPED_LISTS
from api.tasks.operation import ACCESS_CODES, CONNECTION_CODES
from api.version import service_version
from planner.export import FORMATS

if TYPE_CHECKING:
    from pydantic.json_schema import JsonSchemaValue
    from pydantic_core.core_schema import FloatSchema, TaggedUnionSchema, WithDefaultSchema

    from api.pool.messages import Reply
    from api.tasks.operation import Operation
    from api.tasks.work import Work

TITLE = "Trajectory planner"
"""The name of the service in its documentation."""

DESCRIPTION = (
    "Waypoints in, certified joint trajectory out. SI units everywhere; joint arrays follow `joint_names`. "
    "Who sends the `ETag` of an answer back in `If-None-Match` gets 304 where it would be the same."
)
"""What the service does, in the words of its documentation."""

KEYS = {
    "key": {
        "type": "http",
        "scheme": "bearer",
        "description": "An API key, where the service asks for one; every operation says which scope its key needs.",
    }
}
"""How clients identify themselves. A service on a loopback address asks nobody to, so no operation requires it."""

NEEDS = " Where keys are asked for, the key needs the scope `{operation.scope}`."
"""What the description of an operation ends with."""

RATE_HEADERS = {
    "RateLimit-Limit": "The most requests in a minute.",
    "RateLimit-Remaining": "The requests that are left now.",
    "RateLimit-Reset": "All requests are back after that long, s.",
}
"""The headers that say how much a key may still ask, where keys are asked for."""

LINES = "application/x-ndjson"
"""The media type of newline-delimited JSON."""

REFERENCE = "#/components/schemas/{model}"
"""Where a schema is in the document."""

PROBLEM_EXAMPLE = "#/components/examples/{code}"
"""Where the example of a problem document is in the document."""

TAGS = {
    "trajectories": "Plans, and certificates of trajectories of any origin.",
    "kinematics": "Poses of the tool, joint positions that reach them, and what lies between the two.",
    "dynamics": "Joint torques.",
    "collisions": "How near robots come to themselves and to what is around them, for certain.",
    "batches": "Thousands of plan requests at once, worked on behind all others.",
    "robots": "The robots of the catalogue, and your own.",
    "scenes": "What stands around your robots, kept for requests that name it.",
    "service": "What the service is and how it does.",
}
"""The groups of operations in the documentation, and what each is about."""

ONE_OF = {"batches": "batch"}
"""What one of a group is called, where that is not its name without the s."""

FORMAT_SCHEMAS = {"ros2": RosJointTrajectory}
"""The schemas of the JSON forms of a plan besides `json`; the others are text."""


def get_openapi(work: Work) -> Reply:
    """Answer GET /openapi.json."""
    with work.stage("plan"):
        document = openapi_document(work.caps.max_waypoints)
    return work.reply(document)


@cache
def openapi_document(max_waypoints: int) -> dict[str, Any]:
    """Make the document, once in a process.

    Args:
        max_waypoints: The largest number of waypoints or poses that the service takes in one request.
    """
    paths: dict[str, dict[str, Any]] = {}
    for operation in OPERATIONS:
        paths.setdefault(operation.path, {})[operation.method.lower()] = _entry(operation)
    return {
        "openapi": "3.1.0",
        "info": {
            "title": TITLE,
            "description": DESCRIPTION,
            "contact": {"name": TITLE},
            "license": {"name": "MIT", "identifier": "MIT"},
            "version": service_version(),
        },
        "servers": [{"url": "/", "description": "The service that this document comes from."}],
        "tags": [{"name": name, "description": description} for name, description in TAGS.items()],
        "paths": paths,
        "components": {
            "schemas": _components(max_waypoints),
            "examples": {
                code: {"summary": document["title"], "value": document}
                for code, document in examples()["problems"].items()
                if any(code in _codes(operation) for operation in OPERATIONS)
            },
            "securitySchemes": KEYS,
        },
    }


@cache
def examples() -> dict[str, Any]:
    """Read the examples of what the service answers, which tests hold against its answers.

    Returns:
        `answers`, by operation, status and name, where a name is that of the request; and `problems`, by code.
    """
    read: dict[str, Any] = orjson.loads(files("api").joinpath("openapi_examples.json").read_bytes())
    return read


def _entry(operation: Operation) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "tags": [operation.tag],
        "summary": operation.summary,
        "description": operation.description + ("" if operation.scope is None else NEEDS.format(operation=operation)),
        "operationId": operation.id,
        "security": [{}] if operation.scope is None else [{}, {"key": []}],
        "responses": {str(status): response for status, response in _responses(operation).items()},
    }
    parameters = _parameters(operation)
    if parameters:
        entry["parameters"] = parameters
    if operation.request is not None:
        content = {
            "schema": _reference(operation.request),
            "examples": {name: {"value": value} for name, value in operation.examples.items()},
        }
        forms: dict[str, Any] = {"application/json": content}
        if operation.lines:
            forms[LINES] = {"schema": {"type": "string", "format": "binary"}}
        entry["requestBody"] = {"required": True, "content": forms}
    return entry


def _responses(operation: Operation) -> dict[int, dict[str, Any]]:
    """Describe what an operation answers, by status."""
    responses: dict[int, dict[str, Any]] = {operation.status: _success(operation, operation.status)}
    for status, meaning in operation.also.items():
        responses[status] = _success(operation, status) | {"description": meaning}
    if operation.shared:
        tag = {"ETag": {"description": "What `If-None-Match` may quote.", "schema": {"type": "string"}}}
        responses[operation.status].setdefault("headers", {}).update(tag)
        responses[HTTPStatus.NOT_MODIFIED] = {"description": "The answer is the one that `If-None-Match` quotes."}
    by_status: dict[int, list[str]] = {}
    for code in _codes(operation):
        by_status.setdefault(STATUS_OF_CODE[code], []).append(code)
    for status, codes in sorted(by_status.items()):
        description = f"{HTTPStatus(status).phrase}: " + ", ".join(f"`{code}`" for code in codes)
        content = {
            "schema": _reference(ProblemDocument),
            "examples": {code: {"$ref": PROBLEM_EXAMPLE.format(code=code)} for code in codes},
        }
        responses[status] = {"description": description, "content": {MEDIA_TYPE: content}}
        if {"overloaded", "too_many_requests"} & set(codes):
            seconds = {"description": "Wait that long, s.", "schema": {"type": "integer"}}
            responses[status]["headers"] = {"Retry-After": seconds}
        if status == HTTPStatus.TOO_MANY_REQUESTS and operation.scope is not None:
            responses[status]["headers"] |= {
                name: {"description": meaning, "schema": {"type": "integer"}} for name, meaning in RATE_HEADERS.items()
            }
    return responses


def _codes(operation: Operation) -> tuple[str, ...]:
    """List the codes of the problem documents that may be the answer of an operation, each once."""
    access_codes = () if operation.scope is None else ACCESS_CODES
    return tuple(dict.fromkeys((*CONNECTION_CODES, *access_codes, *operation.codes)))


def _success(operation: Operation, status: int) -> dict[str, Any]:
    if operation.answer is None:
        return {"description": "Done."}
    named = examples()["answers"].get(operation.id, {}).get(str(status), {})
    content: dict[str, Any] = {
        operation.media_type: {
            "schema": _schema_of_answer(operation),
            "examples": {name: {"value": value} for name, value in named.items()},
        }
    }
    for media_type in operation.also_as:
        content[media_type] = _schema_of_text_or_bytes(media_type)
    if operation.formats:
        for name, form in FORMATS.items():
            if name in FORMAT_SCHEMAS:
                content[form.media_type] = {"schema": _reference(FORMAT_SCHEMAS[name])}
            elif name != "json":
                content[form.media_type] = _schema_of_text_or_bytes(form.media_type)
        for view in VIEWS.values():
            content[view.media_type] = _schema_of_text_or_bytes(view.media_type)
    response: dict[str, Any] = {"description": "Success.", "content": content}
    if operation.leads_to:
        parameters = {"id": "$response.body#/id"}
        response["links"] = {name: {"operationId": name, "parameters": parameters} for name in operation.leads_to}
    if operation.status in {HTTPStatus.CREATED, HTTPStatus.ACCEPTED}:
        response["headers"] = {"Location": {"description": "Where it is.", "schema": {"type": "string"}}}
    if operation.file:
        name_of_file = {"description": "The name of the file.", "schema": {"type": "string"}}
        response["headers"] = {"Content-Disposition": name_of_file}
    return response


def _schema_of_text_or_bytes(media_type: str) -> dict[str, Any]:
    binary = {} if media_type.startswith("text/") else {"format": "binary"}
    return {"schema": {"type": "string"} | binary}


def _schema_of_answer(operation: Operation) -> dict[str, Any]:
    if operation.file:
        return {"type": "string", "format": "binary"}
    return _reference(operation.answer) if operation.media_type == "application/json" else {"type": "string"}


def _parameters(operation: Operation) -> list[dict[str, Any]]:
    parameters: list[dict[str, Any]] = []
    if "{id}" in operation.path:
        parameters.append(
            {
                "name": "id",
                "in": "path",
                "required": True,
                "description": f"Id of a {ONE_OF.get(operation.tag, operation.tag.removesuffix('s'))}.",
                "schema": {"type": "string", "minLength": 1},
            }
        )
    if operation.pages:
        limit = {"type": "integer", "minimum": 1, "maximum": MOST_ENTRIES, "default": DEFAULT_ENTRIES}
        parameters += [
            {"name": "limit", "in": "query", "description": "Most entries of the page.", "schema": limit},
            {
                "name": "cursor",
                "in": "query",
                "description": "The `next_cursor` of the page before; omitted: the first page.",
                "schema": {"type": "string"},
            },
        ]
    if operation.file or operation.formats_of_plans:
        is_one_plan = operation.request is not None  # which people may want to look at
        names = [*FORMATS, *VIEWS] if is_one_plan else list(FORMATS)
        parameters.append(
            {
                "name": "format",
                "in": "query",
                **({"required": True} if is_one_plan else {}),
                "description": "Form of the file." if is_one_plan else "Form of the plans; omitted: `json`.",
                "schema": {"type": "string", "enum": names, "title": "PlanFormat"},
            }
        )
    parameters += [
        {"name": name, "in": "header", "description": description, "schema": {"type": "string"}}
        for name, description in operation.headers.items()
    ]
    return parameters


def _reference(schema: Any) -> dict[str, Any]:
    return {"$ref": REFERENCE.format(model=schema.__name__)}


class _Schemas(GenerateJsonSchema):
    """JSON schemas from which generators for typed languages make code that compiles."""

    def float_schema(self, schema: FloatSchema) -> JsonSchemaValue:
        """Say that a number has double precision: generators take single precision otherwise."""
        return super().float_schema(schema) | {"format": "double"}

    def default_schema(self, schema: WithDefaultSchema) -> JsonSchemaValue:
        """Leave out a default that is an object, which generators write as text; descriptions say what it is."""
        made = super().default_schema(schema)
        if isinstance(made.get("default"), dict):
            del made["default"]
        return made

    def tagged_union_schema(self, schema: TaggedUnionSchema) -> JsonSchemaValue:
        """Say `anyOf` where no field tells the kinds apart, as with a scene and its id: generators ask for one else."""
        made = super().tagged_union_schema(schema)
        return made if "discriminator" in made or "oneOf" not in made else {"anyOf": made.pop("oneOf")} | made


def _components(max_waypoints: int) -> dict[str, Any]:
    """Collect every schema that the operations name, and those that these name.

    Lists are as long as the service takes, and the codes of problems are those that there are.
    """
    roots: list[Any] = [ProblemDocument, *FORMAT_SCHEMAS.values()]
    roots += [op.request for op in OPERATIONS if op.request is not None]
    roots += [op.answer for op in OPERATIONS if op.answer is not None and not op.file]
    inputs: Any = [(schema.__name__, "validation", TypeAdapter(schema)) for schema in roots]
    _, definitions = TypeAdapter.json_schemas(inputs, ref_template=REFERENCE, schema_generator=_Schemas)
    schemas = dict(sorted(definitions["$defs"].items()))
    for name in {operation.request.__name__ for operation in OPERATIONS if operation.request is not None}:
        for field in CAPPED_LISTS & schemas[name].get("properties", {}).keys():
            schemas[name]["properties"][field]["maxItems"] = max_waypoints
    schemas[ProblemDocument.__name__]["properties"]["code"]["enum"] = sorted(STATUS_OF_CODE)
    return schemas
