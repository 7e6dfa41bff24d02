"""Tools made from the operations of the OpenAPI document that compute or read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

COMPUTING_TAGS = frozenset({"trajectories", "kinematics", "dynamics", "collisions"})
"""The subjects whose operations compute, and change nothing in the service."""

READING = frozenset({"list_robots", "get_robot", "list_scenes", "get_scene", "get_limits"})
"""Other operations that an agent needs to write requests."""

REFERENCE = "#/components/schemas/"
"""The start of references to schemas in an OpenAPI document."""

DEFINITION = "#/$defs/"
"""The start of such references in a JSON Schema of its own."""


@dataclass(frozen=True)
class OperationTool:
    """An operation of the service as a tool.

    Attributes:
        name: The id of the operation.
        title: Its summary.
        description: Its description, for the agent.
        method: The HTTP method.
        path: The path, with names in braces.
        places: Where each parameter goes, by name: `path` or `query`.
        media_types: The media types of its answers; the first one is the default.
        input_schema: The JSON Schema of the arguments: parameters by name, `body`, and `accept` for a choice of forms.
    """

    name: str
    title: str
    description: str
    method: str
    path: str
    places: Mapping[str, str]
    media_types: tuple[str, ...]
    input_schema: Mapping[str, Any]


def tools_of(document: Mapping[str, Any]) -> dict[str, OperationTool]:
    """Return the tools, by name, for the operations of an OpenAPI document that compute or read."""
    schemas = document["components"]["schemas"]
    operations = (
        (method, path, operation)
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
        if COMPUTING_TAGS & set(operation["tags"]) or operation["operationId"] in READING
    )
    tools = (_tool(method, path, operation, schemas) for method, path, operation in operations)
    return {tool.name: tool for tool in tools}


def _tool(method: str, path: str, operation: Mapping[str, Any], schemas: Mapping[str, Any]) -> OperationTool:
    properties: dict[str, Any] = {}
    required, places = [], {}
    for parameter in operation.get("parameters", []):
        if parameter["in"] == "header":
            continue
        name = parameter["name"]
        places[name] = parameter["in"]
        properties[name] = {**parameter["schema"], "description": parameter.get("description", "")}
        if parameter.get("required"):
            required.append(name)
    if "requestBody" in operation:
        properties["body"] = operation["requestBody"]["content"]["application/json"]["schema"]
        required.append("body")
    media_types = tuple(operation["responses"]["200"]["content"])
    if len(media_types) > 1:
        properties["accept"] = {
            "type": "string",
            "enum": list(media_types),
            "default": media_types[0],
            "description": "The media type of the answer.",
        }
    schema = {"type": "object", "properties": properties, "required": required, "additionalProperties": False}
    used = set(_used(schema, schemas, set()))
    definitions = {name: schemas[name] for name in sorted(used)}
    return OperationTool(
        name=operation["operationId"],
        title=operation["summary"],
        description=operation.get("description") or operation["summary"],
        method=method.upper(),
        path=path,
        places=places,
        media_types=media_types,
        input_schema=_relocated(schema | ({"$defs": definitions} if definitions else {})),
    )


def _used(part: Any, schemas: Mapping[str, Any], seen: set[str]) -> Iterator[str]:
    """Yield the names of all schemas to which a part of a schema refers, each once."""
    if isinstance(part, dict):
        reference = part.get("$ref")
        if isinstance(reference, str) and (name := reference.removeprefix(REFERENCE)) not in seen:
            seen.add(name)
            yield name
            yield from _used(schemas[name], schemas, seen)
        for value in part.values():
            yield from _used(value, schemas, seen)
    elif isinstance(part, list):
        for value in part:
            yield from _used(value, schemas, seen)


def _relocated(part: Any) -> Any:
    """Return a part of a schema whose references lead to `$defs`."""
    if isinstance(part, dict):
        return {key: _relocated(value) for key, value in part.items()}
    if isinstance(part, list):
        return [_relocated(value) for value in part]
    return part.replace(REFERENCE, DEFINITION) if isinstance(part, str) and part.startswith(REFERENCE) else part
