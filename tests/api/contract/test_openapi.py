"""The OpenAPI document: agreement with the contract, and use by generators."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest

from api.contract.examples.request_examples import request_examples
from api.http import openapi
from api.work.answers.formats import FORMATS
from api.work.answers.views import VIEWS
from clients.document import openapi_document

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.api.conftest import RunningService

CONTRACT = {
    ("post", "/v1/trajectories"): "plan_trajectory",
    ("post", "/v1/trajectories/export"): "export_trajectory",
    ("post", "/v1/trajectories/validate"): "validate_trajectory",
    ("post", "/v1/trajectories/retime"): "retime_trajectory",
    ("post", "/v1/trajectories/stop"): "stop_trajectory",
    ("post", "/v1/trajectories/reverse"): "reverse_trajectory",
    ("post", "/v1/trajectories/max_payload"): "max_payload",
    ("post", "/v1/trajectories/slice"): "slice_trajectory",
    ("post", "/v1/trajectories/join"): "join_trajectories",
    ("post", "/v1/trajectories/resample"): "resample_trajectory",
    ("post", "/v1/cells/plan"): "plan_cell",
    ("get", "/v1/backends"): "list_backends",
    ("get", "/v1/robots"): "list_robots",
    ("get", "/v1/robots/{id}"): "get_robot",
    ("get", "/v1/robots/{id}/geometry"): "get_robot_geometry",
    ("post", "/v1/robots"): "add_robot",
    ("get", "/v1/scenes"): "list_scenes",
    ("get", "/v1/scenes/{id}"): "get_scene",
    ("post", "/v1/scenes"): "add_scene",
    ("patch", "/v1/scenes/{id}"): "change_scene",
    ("delete", "/v1/scenes/{id}"): "delete_scene",
    ("post", "/v1/scenes/{id}/roadmap"): "build_roadmap",
    ("get", "/v1/scenes/{id}/roadmap"): "list_roadmaps",
    ("delete", "/v1/scenes/{id}/roadmap"): "delete_roadmap",
    ("get", "/v1/projects"): "list_projects",
    ("get", "/v1/projects/{name}"): "get_project",
    ("put", "/v1/projects/{name}"): "put_project",
    ("delete", "/v1/projects/{name}"): "delete_project",
    ("delete", "/v1/robots/{id}"): "delete_robot",
    ("post", "/v1/kinematics/forward"): "forward_kinematics",
    ("post", "/v1/kinematics/inverse"): "inverse_kinematics",
    ("post", "/v1/kinematics/jacobian"): "jacobian",
    ("post", "/v1/kinematics/workspace"): "workspace",
    ("post", "/v1/dynamics/inverse"): "inverse_dynamics",
    ("post", "/v1/collisions/check"): "check_collisions",
    ("post", "/v1/batches"): "create_batch",
    ("get", "/v1/batches/{id}"): "get_batch",
    ("get", "/v1/batches/{id}/results"): "get_batch_results",
    ("get", "/v1/batches/{id}/events"): "stream_batch_events",
    ("delete", "/v1/batches/{id}"): "cancel_batch",
    ("get", "/livez"): "get_liveness",
    ("get", "/readyz"): "get_readiness",
    ("get", "/metrics"): "get_metrics",
    ("get", "/v1/limits"): "get_limits",
}


@pytest.fixture(scope="module")
def document(service: RunningService) -> dict[str, Any]:
    answer: dict[str, Any] = service.client.get("/openapi.json").json()
    return answer


def nodes(value: Any) -> Iterator[dict[str, Any]]:
    """Yield every object in the document."""
    if isinstance(value, dict):
        yield value
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from nodes(item)


def operations(document: dict[str, Any]) -> dict[tuple[str, str], dict[str, Any]]:
    return {(method, path): op for path, item in document["paths"].items() for method, op in item.items()}


def test_operations_have_the_ids_of_the_contract(document: dict[str, Any]) -> None:
    ids = {key: operation["operationId"] for key, operation in operations(document).items()}
    assert CONTRACT.items() <= ids.items()
    assert len(set(ids.values())) == len(ids)
    assert document["openapi"].startswith("3.1")


def test_every_reference_leads_somewhere(document: dict[str, Any]) -> None:
    """And nothing is defined that nobody refers to."""
    named = {node["$ref"] for node in nodes(document) if isinstance(node.get("$ref"), str)}
    defined = {
        f"#/components/{part}/{name}"
        for part, entries in document["components"].items()
        for name in entries
        if part != "securitySchemes"
    }
    assert named == defined


def test_links_lead_to_operations_that_take_an_id(document: dict[str, Any]) -> None:
    by_id = {operation["operationId"]: operation for operation in operations(document).values()}
    links = [link for node in nodes(document["paths"]) for link in node.get("links", {}).values()]
    assert {link["operationId"] for link in links} >= {"get_batch", "cancel_batch", "get_robot", "delete_robot"}
    for link in links:
        names = {parameter["name"] for parameter in by_id[link["operationId"]]["parameters"]}
        assert link["parameters"].keys() <= names


def test_unions_are_discriminated_by_a_required_kind(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    unions = [node for node in nodes(schemas) if "oneOf" in node]
    assert len(unions) >= 5
    for union in unions:
        assert union["discriminator"]["propertyName"] == "kind"
        for reference in union["discriminator"]["mapping"].values():
            variant = schemas[reference.rpartition("/")[2]]
            assert "kind" in variant["required"]
            assert "default" not in variant["properties"]["kind"]
            assert variant["additionalProperties"] is False
        shapes = [frozenset(schemas[v["$ref"].rpartition("/")[2]]["properties"]) for v in union["oneOf"]]
        kinds = [schemas[v["$ref"].rpartition("/")[2]]["properties"]["kind"] for v in union["oneOf"]]
        assert len(shapes) == len(kinds)
        assert all("const" in kind for kind in kinds)


def test_there_are_no_tuples_and_no_unnamed_objects(document: dict[str, Any]) -> None:
    for node in nodes(document["components"]["schemas"]):
        assert "prefixItems" not in node
    for name, schema in document["components"]["schemas"].items():
        for field in schema.get("properties", {}).values():
            assert "properties" not in field, name


def test_generators_for_typed_languages_find_what_they_need(document: dict[str, Any]) -> None:
    """Defaults that are objects become text otherwise, and numbers become single precision."""
    schemas = list(nodes(document["components"]["schemas"]))
    assert not [node for node in schemas if isinstance(node.get("default"), dict)]
    assert {node.get("format") for node in schemas if node.get("type") == "number"} == {"double"}
    groups = {tag["name"] for tag in document["tags"] if sentence(tag)}
    assert groups == {tag for operation in operations(document).values() for tag in operation["tags"]}
    problem = document["components"]["schemas"]["ProblemDocument"]["properties"]
    assert {"unreachable_waypoint", "deadline_exceeded"} <= set(problem["code"]["enum"])
    answered = {
        code.strip("`")
        for operation in operations(document).values()
        for status, response in operation["responses"].items()
        if status >= "400"
        for code in re.findall(r"`\w+`", response["description"])
    }
    assert answered <= set(problem["code"]["enum"])
    assert {"$ref", "anyOf"} & set(problem["nearest"]) and {"$ref", "anyOf"} & set(problem["place"])


def test_everything_that_a_caller_sends_is_described(document: dict[str, Any]) -> None:
    for (method, path), operation in operations(document).items():
        assert operation["summary"].endswith("."), path
        assert "`" not in operation["summary"], "Swagger UI shows a summary as plain text"
        assert sentence(operation), path
        assert ("requestBody" in operation) == (method in ("post", "patch", "put")), path
        if method in ("post", "put"):
            content = operation["requestBody"]["content"]["application/json"]
            assert content["examples"], path
            assert set(content["schema"]) == {"$ref"}
            assert {"413", "422", "500", "503", "504"} <= set(operation["responses"])
            assert "Retry-After" in operation["responses"]["503"]["headers"]
        for status, response in operation["responses"].items():
            if status >= "400" and path != "/readyz":
                assert set(response["content"]) == {"application/problem+json"}


def test_every_form_of_a_plan_is_described(document: dict[str, Any]) -> None:
    responses = document["paths"]["/v1/trajectories"]["post"]["responses"]
    assert set(responses["200"]["content"]) == {form.media_type for form in (*FORMATS.values(), *VIEWS.values())}
    (parameter,) = document["paths"]["/v1/trajectories/export"]["post"]["parameters"]
    assert (parameter["name"], parameter["required"]) == ("format", True)
    assert parameter["schema"]["enum"] == [*FORMATS, *VIEWS]


def test_generated_clients_meet_one_form_of_an_answer(document: dict[str, Any]) -> None:
    """A parameter that made the answer another than the one that they read would break them."""
    for (_, path), operation in operations(document).items():
        success = {
            content
            for status, one in operation["responses"].items()
            if status < "300"
            for content in one.get("content", ())
        }
        if "format" in {parameter["name"] for parameter in operation.get("parameters", ())}:
            assert len(success) == 1, path


UNITS = re.compile(
    r"\b(rad|m|s|Hz|kg|N|J|W|MiB|bytes|1e-9 s)\b|[Uu]nit|times as|number of|ind(ex|ices)|seed|status|share"
)
"""Words that describe a number: its unit, that it has no unit, or that it is a count."""


def numbers(schema: dict[str, Any]) -> bool:
    """Tell whether a property is a number, or an array of numbers."""
    variants = [schema, *schema.get("anyOf", ())]
    return any(
        variant.get("type") in ("number", "integer") or (variant.get("type") == "array" and numbers(variant["items"]))
        for variant in variants
    )


def rows(schema: dict[str, Any]) -> bool:
    """Tell whether a property is an array of arrays."""
    arrays = [variant for variant in (schema, *schema.get("anyOf", ())) if variant.get("type") == "array"]
    return any(array["items"].get("type") == "array" for array in arrays)


def test_every_schema_and_every_field_is_explained(document: dict[str, Any]) -> None:
    """In whole sentences that say the unit of a number and the shape of rows."""
    schemas = document["components"]["schemas"]
    assert not [name for name, schema in schemas.items() if not sentence(schema)]
    fields = {
        f"{name}.{field}": schema
        for name, owner in schemas.items()
        for field, schema in owner.get("properties", {}).items()
    }
    assert len(fields) > 300
    assert not [name for name, schema in fields.items() if not sentence(schema)]
    assert not [name for name, schema in fields.items() if numbers(schema) and not UNITS.search(schema["description"])]
    shape = re.compile(r"shape \(|rows?\b")
    assert not [name for name, schema in fields.items() if rows(schema) and not shape.search(schema["description"])]


def test_every_option_of_a_back_end_is_explained_where_back_ends_are_listed(service: RunningService) -> None:
    for backend in service.client.get("/v1/backends").json()["backends"]:
        for name, option in backend["options"].items():
            assert sentence(option), (backend["kind"], name)


def test_every_parameter_header_and_status_is_explained(document: dict[str, Any]) -> None:
    for operation in operations(document).values():
        for parameter in operation.get("parameters", ()):
            assert sentence(parameter), parameter["name"]
        for response in operation["responses"].values():
            assert response["description"]
            assert all(sentence(header) for header in response.get("headers", {}).values())


def test_what_is_not_explained_is_found() -> None:
    assert not sentence({"type": "number"})
    assert not sentence({"type": "number", "description": "rad or m"})
    assert numbers({"anyOf": [{"type": "array", "items": {"type": "number"}}, {"type": "null"}]})
    assert not numbers({"type": "array", "items": {"type": "string"}})
    assert not UNITS.search("How fast it is.")


def sentence(schema: dict[str, Any]) -> bool:
    """Tell whether a description exists that begins and ends like a sentence."""
    text = schema.get("description", "")
    return bool(re.match(r"[A-Z0`]|null|sqrt", text)) and text.endswith(".") and len(text.split()) > 1


def test_the_document_allows_as_many_waypoints_as_the_service_takes(
    service: RunningService, document: dict[str, Any]
) -> None:
    """One number: the schema said 100,000 where the service took 1,000."""
    most = service.client.get("/v1/limits").json()["max_waypoints"]
    for schema, field in (
        ("PlanRequest", "waypoints"),
        ("CompareRequest", "waypoints"),
        ("ReachabilityRequest", "waypoints"),
        ("InverseKinematicsRequest", "poses"),
    ):
        assert document["components"]["schemas"][schema]["properties"][field]["maxItems"] == most


def test_a_format_is_required_where_nothing_is_answered_without(document: dict[str, Any]) -> None:
    """The archive of a batch contains JSON if the request names no format."""
    formats = {
        operation["operationId"]: parameter.get("required", False)
        for operation in operations(document).values()
        for parameter in operation.get("parameters", ())
        if parameter["name"] == "format"
    }
    assert {name for name, is_required in formats.items() if is_required} == {"export_trajectory"}
    assert {"download_batch_results", "stream_batch_results", "get_batch_results"} < set(formats)


@pytest.mark.large_only
def test_an_operation_without_an_example_of_its_body_is_documented(monkeypatch: pytest.MonkeyPatch) -> None:
    """The new operation of docs/contributing.md, in two files, had no document: GET /openapi.json answered 500."""
    known = {name: examples for name, examples in request_examples().items() if name != "inverse_dynamics"}
    monkeypatch.setattr(openapi, "request_examples", lambda: known)
    (content,) = openapi_document.__wrapped__(1000)["paths"]["/v1/dynamics/inverse"]["post"]["requestBody"][
        "content"
    ].values()
    assert content == {"schema": {"$ref": "#/components/schemas/InverseDynamicsRequest"}}
