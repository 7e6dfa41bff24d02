"""The comparison of two documents finds every breaking change, and no other change."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any

import pytest

from clients.changes import breaking_changes, may_break
from clients.document import openapi_document

if TYPE_CHECKING:
    from collections.abc import Callable

Document = dict[str, Any]


PATHS = (
    "/livez",
    "/v1/batches",
    "/v1/kinematics/jacobian",
    "/v1/robots",
    "/v1/robots/{id}",
    "/v1/trajectories",
)
"""The paths of the operations in which the cases change something."""


@pytest.fixture(scope="module")
def document() -> Document:
    whole = openapi_document(1000)
    return whole | {"paths": {path: whole["paths"][path] for path in PATHS}}


def schema(document: Document, name: str) -> Document:
    found: Document = document["components"]["schemas"][name]
    return found


def operation(document: Document, path: str, method: str = "post") -> Document:
    found: Document = document["paths"][path][method]
    return found


BREAKING: dict[str, Callable[[Document], Any]] = {
    "an operation is gone": lambda d: d["paths"].pop("/v1/kinematics/jacobian"),
    "a method is gone": lambda d: d["paths"]["/v1/robots/{id}"].pop("delete"),
    "another name": lambda d: operation(d, "/v1/trajectories").update(operationId="plan"),
    "a key is needed": lambda d: operation(d, "/v1/trajectories").update(security=[{"key": ["plan"]}]),
    "a parameter is gone": lambda d: operation(d, "/v1/robots", "get")["parameters"].pop(),
    "a parameter is required": lambda d: operation(d, "/v1/robots", "get")["parameters"][0].update(required=True),
    "a media type of requests is gone": lambda d: operation(d, "/v1/batches")["requestBody"]["content"].popitem(),
    "a media type of answers is gone": lambda d: operation(d, "/v1/trajectories")["responses"]["200"]["content"].pop(
        "text/csv"
    ),
    "a status is gone": lambda d: operation(d, "/v1/robots")["responses"].pop("201"),
    "a header is gone": lambda d: operation(d, "/v1/batches")["responses"]["202"]["headers"].pop("Location"),
    "a field of a request is gone": lambda d: schema(d, "PlanRequest")["properties"].pop("seed"),
    "a field of a request is required": lambda d: schema(d, "PlanRequest")["required"].append("limits"),
    "a field of a request has another type": lambda d: schema(d, "Pose")["properties"]["position"].update(
        type="object"
    ),
    "null is not taken": lambda d: schema(d, "PlanRequest")["properties"]["tool"]["anyOf"].pop(),
    "a smaller maximum": lambda d: schema(d, "PlanRequest")["properties"]["sample_period"].update(maximum=1.0),
    "a larger minimum": lambda d: schema(d, "BlendTransition")["properties"]["radius"].update(minimum=0.1),
    "fewer items": lambda d: schema(d, "PlanRequest")["properties"]["waypoints"].update(maxItems=10),
    "a value is not taken": lambda d: schema(d, "Include")["enum"].remove("jerk"),
    "a kind is not taken": lambda d: schema(d, "Motion")["oneOf"].pop(),
    "a field of an answer is gone": lambda d: schema(d, "PlanAnswer")["properties"].pop("duration"),
    "a field of an answer may lack": lambda d: schema(d, "PlanAnswer")["required"].remove("duration"),
    "a field of an answer has another type": lambda d: schema(d, "PlanAnswer")["properties"]["duration"].update(
        type="string"
    ),
    "a field of an answer may be null": lambda d: schema(d, "Samples")["properties"]["time"].update(
        type=["array", "null"]
    ),
}

HARMLESS: dict[str, Callable[[Document], Any]] = {
    "an operation is added": lambda d: d["paths"].update({"/v2": deepcopy(d["paths"]["/livez"])}),
    "a parameter is added": lambda d: operation(d, "/livez", "get").update(
        parameters=[{"name": "x", "in": "query", "schema": {"type": "string"}}]
    ),
    "a field of a request is added": lambda d: schema(d, "PlanRequest")["properties"].update(x={"type": "string"}),
    "a field of a request is optional now": lambda d: schema(d, "Payload")["required"].remove("mass"),
    "a larger maximum": lambda d: schema(d, "PlanRequest")["properties"]["sample_period"].update(maximum=1e9),
    "a value of requests is added": lambda d: schema(d, "Include")["enum"].append("x"),
    "a field of an answer is added": lambda d: schema(d, "PlanAnswer")["properties"].update(x={"type": "string"}),
    "a code is added": lambda d: schema(d, "ProblemDocument")["properties"]["code"]["enum"].append("x"),
    "a format is added": lambda d: operation(d, "/v1/trajectories")["responses"]["200"]["content"].update(
        {"text/x": {"schema": {"type": "string"}}}
    ),
    "a problem is gone": lambda d: operation(d, "/v1/trajectories")["responses"].pop("415"),
    "other words": lambda d: operation(d, "/v1/trajectories").update(summary="Plan."),
    "a key is possible": lambda d: operation(d, "/livez", "get").update(security=[{}, {"key": []}]),
}


@pytest.mark.large_only
def test_a_document_does_not_break_its_own_clients() -> None:
    whole = openapi_document(1000)
    assert breaking_changes(whole, deepcopy(whole)) == []


@pytest.mark.long_table
@pytest.mark.parametrize("name", BREAKING)
def test_what_breaks_clients_is_found(document: Document, name: str) -> None:
    changed = deepcopy(document)
    BREAKING[name](changed)
    assert breaking_changes(document, changed)


@pytest.mark.long_table
@pytest.mark.parametrize("name", HARMLESS)
def test_what_is_added_breaks_nobody(document: Document, name: str) -> None:
    changed = deepcopy(document)
    HARMLESS[name](changed)
    assert breaking_changes(document, changed) == []


@pytest.mark.parametrize(
    ("before", "after", "may"),
    [("0.1.0", "0.1.1", False), ("0.1.0", "0.2.0", True), ("1.2.0", "1.3.0", False), ("1.2.0", "2.0.0", True)],
)
def test_a_new_version_may_break_clients(before: str, after: str, may: bool) -> None:
    assert may_break(before, after) == may
