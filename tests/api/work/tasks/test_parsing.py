"""The body of a request is parsed once in the server, and once by each worker that has a task of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import orjson
import pytest
from pydantic import TypeAdapter

from api.contract.parts.backends import backend_schemas
from api.contract.parts.common import Schema
from api.work.execution import SUBJECTS
from tests.api.made_up_service import made_up_service
from tests.api.requests import plan_request

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

TOO_QUICK = plan_request(duration=1e-3, seed=1)
NO_FIELDS = plan_request(waypoints=[{}])
COMPARED = {name: value for name, value in plan_request().items() if name != "backend"}


@pytest.fixture(scope="module")
def client() -> Iterator[httpx.Client]:
    with made_up_service(workers=2) as sender:
        yield sender


@pytest.mark.parametrize(
    ("path", "request_body", "status", "tasks"),
    [
        ("", plan_request(), 200, 1),
        ("?format=csv", plan_request(seed=2), 200, 1),
        ("", TOO_QUICK, 422, 1),
        ("", NO_FIELDS, 422, 1),
        ("/compare", {**COMPARED, "backends": [{"kind": "cubic"}, {"kind": "quintic"}]}, 200, 2),
    ],
    ids=["plan", "table", "remedies", "schema", "comparison"],
)
def test_a_body_is_parsed_once_in_the_server_and_once_a_task(
    client: httpx.Client, monkeypatch: pytest.MonkeyPatch, path: str, request_body: Any, status: int, tasks: int
) -> None:
    body = orjson.dumps(request_body)
    parsed = 0

    def counting(parse: Any) -> Any:
        def count(*arguments: Any, **options: Any) -> Any:
            nonlocal parsed
            content = arguments[-1]
            parsed += isinstance(content, bytes) and len(content) >= len(body) - 100
            return parse(*arguments, **options)

        return count

    monkeypatch.setattr(orjson, "loads", counting(orjson.loads))
    monkeypatch.setattr(TypeAdapter, "validate_json", counting(TypeAdapter.validate_json))
    answer = client.post(f"/v1/trajectories{path}", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == status, answer.text
    if request_body is TOO_QUICK:
        assert answer.json()["remedies"]
    assert parsed == 1 + tasks


def schemas(base: type[Schema] = Schema) -> Iterator[type[Schema]]:
    for schema in base.__subclasses__():
        yield schema
        yield from schemas(schema)


def nodes(value: Any) -> Iterator[dict[str, Any]]:
    if isinstance(value, dict):
        yield value
    for child in value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ():
        yield from nodes(child)


@pytest.mark.large_only
def test_no_schema_of_a_request_needs_a_type_that_parsed_json_has_not() -> None:
    """Strict validation takes no list for a tuple or a set, and no text for a date, but in its own parser of JSON."""
    assert SUBJECTS and backend_schemas()  # all modules with schemas are loaded
    found = {schema for schema in schemas() if schema.__module__.startswith("api.")}
    assert found > {*backend_schemas().values()}
    foreign = {"tuple", "set", "frozenset", "bytes", "date", "time", "datetime", "timedelta", "decimal", "uuid", "enum"}
    for schema in found:
        schema.model_rebuild()
        kinds = {
            node["type"]
            for node in nodes(schema.__pydantic_core_schema__)
            if node.get("type") in foreign and node.get("strict") is not False
        }
        assert not kinds, schema.__name__
