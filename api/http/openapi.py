"""The OpenAPI 3.1 document: FastAPI's, from the routes, with schemas from a worker and the recorded examples."""

from __future__ import annotations

from http import HTTPStatus
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import orjson
from fastapi.openapi.utils import get_openapi

from api.base.codings import IDENTITY
from api.base.version import service_version
from api.contract.examples.request_examples import request_examples
from api.http.described import JSON
from api.http.replies import get_reply, respond, respond_with_json

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fastapi import Request, Response
    from starlette.routing import BaseRoute

TITLE = "Trajectory planner"
"""The name of the service in its documentation."""

DESCRIPTION = (
    "Waypoints in, certified joint trajectory out. SI units everywhere; joint arrays follow `joint_names`. "
    "`GET` with the `ETag` of an answer in `If-None-Match` returns 304 where the answer would be the same."
)
"""The description of the service in its documentation."""

GUIDE = f"""# {TITLE}

> {DESCRIPTION}

A refusal is a problem document (RFC 9457). Each of its `remedies` is a change that the service has tried: `change` is a
JSON pointer into the request, `value` is the new value. Every answer with a plan has a certificate: no enforced limit
is exceeded at any time.

## Documents

- [OpenAPI document](/openapi.json): all requests and answers, with examples
- [Documentation of the HTTP interface](/docs): the same for people

## Operations

"""
"""The start of /llms.txt, before the operations."""

NEEDS = " Where the service requires keys, the key needs the scope `{scope}`."
"""The last sentence of the description of an operation that needs a key."""

TAGS = {
    "trajectories": "Plans, and certificates of trajectories of any origin.",
    "kinematics": "Forward and inverse kinematics, and the reachability of poses.",
    "dynamics": "Joint torques.",
    "collisions": "Proved clearances of robots from themselves and from their scene.",
    "batches": "Thousands of plan requests at once, in the background.",
    "robots": "The robots of the catalogue, and your own.",
    "scenes": "Scenes around your robots, stored for requests that name them.",
    "projects": "Projects of the page, saved for its next visit and for other browsers.",
    "service": "Version, health and metrics of the service.",
}
"""The groups of operations in the documentation, and what each is about."""


async def document_of(request: Request) -> Response:
    """Answer with the document of the service; a worker makes the schemas once."""
    state = request.app.state
    if not hasattr(state, "openapi"):
        described = described_by_fastapi(request.app.routes)
        reply = await get_reply(request, "get_schemas", coding=IDENTITY, **schema_names(described))
        if reply.status != HTTPStatus.OK:
            return respond(reply)
        state.openapi = orjson.dumps(completed(described, orjson.loads(reply.body)))
    return await respond_with_json(request, state.openapi, {})


def guide_of(request: Request) -> str:
    """Return the operations with their summaries as Markdown, for language models."""
    state = request.app.state
    if not hasattr(state, "guide"):
        paths = described_by_fastapi(request.app.routes)["paths"]
        operations = ((path, method, each) for path, methods in paths.items() for method, each in methods.items())
        lines = (f"- [{method.upper()} {path}](/openapi.json): {each['summary']}" for path, method, each in operations)
        state.guide = GUIDE + "\n".join(lines) + "\n"
    guide: str = state.guide
    return guide


def described_by_fastapi(routes: Sequence[BaseRoute]) -> dict[str, Any]:
    """Have FastAPI describe the routes; the schemas that they name are left to a worker."""
    document = get_openapi(
        title=TITLE,
        version=service_version(),
        description=DESCRIPTION,
        routes=routes,
        tags=[{"name": name, "description": description} for name, description in TAGS.items()],
        servers=[{"url": "/", "description": "The service that this document comes from."}],
        contact={"name": TITLE},
        license_info={"name": "MIT", "identifier": "MIT"},
    )
    for operation in _operations(document):
        if JSON in operation["responses"].get("422", {}).get("content", {}):
            del operation["responses"]["422"]  # FastAPI's own, of a path whose only parameter cannot be invalid
    return document


def schema_names(document: Mapping[str, Any]) -> dict[str, Any]:
    """List the names of the schemas of requests and of answers, in the order of the document."""
    requests: dict[str, None] = {}
    answers: dict[str, None] = {}
    for operation in _operations(document):
        requests |= _named(operation.get("requestBody", {}))
        for response in operation["responses"].values():
            answers |= _named(response)
    return {"requests": list(requests), "answers": list(answers)}


def completed(document: dict[str, Any], parts: Mapping[str, Any]) -> dict[str, Any]:
    """Complete the document of FastAPI with the schemas, forms and examples.

    Args:
        document: FastAPI's document of the routes.
        parts: The parts that only a worker knows: `schemas`, `forms` of answers and `formats` of plans.
    """
    bodies, shown = request_examples(), examples()
    for operation in _operations(document):
        name = operation["operationId"]
        _say_who_may(operation)
        for parameter in operation.get("parameters", ()):
            for said in ("title", "description"):  # the name and the description of the parameter say the same
                parameter["schema"].pop(said, None)
            if not parameter["required"]:
                del parameter["required"]
            if parameter["name"] == "format":
                formats = parts["formats"].get(name, parts["formats"]["batches"])
                parameter["schema"] |= {"enum": formats, "title": "PlanFormat"}
        if name in bodies:
            content = operation["requestBody"]["content"][JSON]
            content["examples"] = {key: {"value": value} for key, value in bodies[name].items()}
        for status, response in operation["responses"].items():
            if status >= "300" and status not in shown["answers"].get(name, {}):
                continue
            for content in response.get("content", {}).values():
                named = shown["answers"].get(name, {}).get(status, {})
                content["examples"] = {key: {"value": value} for key, value in named.items()}
            further = parts["forms"].get(name, {}) if status == "200" else {}
            response.get("content", {}).update({media: {"schema": schema} for media, schema in further.items()})
    codes = {code for operation in _operations(document) for code in _codes(operation)}
    document["components"] = {
        "schemas": parts["schemas"],
        "examples": {
            code: {"summary": problem["title"], "value": problem}
            for code, problem in shown["problems"].items()
            if code in codes
        },
        "securitySchemes": document["components"]["securitySchemes"],
    }
    return document


def examples() -> dict[str, Any]:
    """Read the examples of answers, which tests compare with the answers of the service.

    Returns:
        `answers`, by operation, status and name, where a name is that of the request; and `problems`, by code.
    """
    read: dict[str, Any] = orjson.loads(files("api.contract.examples").joinpath("openapi_examples.json").read_bytes())
    return read


def _say_who_may(operation: dict[str, Any]) -> None:
    """Say which scope a key needs; no operation requires a key, as not every service asks for one."""
    required = [scope for scheme in operation.get("security", ()) for scope in scheme["key"]]
    operation["security"] = [{}, {"key": []}] if required else [{}]
    operation["description"] += "".join(NEEDS.format(scope=scope) for scope in required)


def _operations(document: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    for path in document["paths"].values():
        yield from path.values()


def _named(part: Mapping[str, Any]) -> dict[str, None]:
    """Collect the names of the schemas of a body or an answer."""
    schemas = (content["schema"] for content in part.get("content", {}).values())
    return {schema["$ref"].rpartition("/")[2]: None for schema in schemas if "$ref" in schema}


def _codes(operation: Mapping[str, Any]) -> Iterator[str]:
    """List the codes of the problem documents that may be the answer."""
    for status, response in operation["responses"].items():
        if status >= "400":
            for content in response["content"].values():
                yield from content.get("examples", ())
