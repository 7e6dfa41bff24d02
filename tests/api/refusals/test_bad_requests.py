"""Every bad request gets a problem that names the fault and its place, and leaves the service unchanged."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from tests.api.conftest import WORKER_MEMORY_MIB
from tests.api.operations import OPERATIONS
from tests.api.refusals.bad_requests import BAD_REQUESTS, PLAN, Bad
from tests.api.requests import plan_request

if TYPE_CHECKING:
    from tests.api.conftest import RunningService
    from tests.api.operations import Operation

STATUS = {"unknown_robot": 404, "catalogue_robot": 409}
JSON = {"Content-Type": "application/json"}


def test_the_table_is_long_and_its_names_are_unique() -> None:
    assert len({bad.name for bad in BAD_REQUESTS}) == len(BAD_REQUESTS) >= 60


@pytest.mark.parametrize("bad", BAD_REQUESTS, ids=lambda bad: bad.name)
def test_bad_request(service: RunningService, bad: Bad) -> None:
    body = bad.body if isinstance(bad.body, bytes) else json.dumps(bad.body).encode()
    before = {worker.pid for worker in service.workers()}

    answer = service.client.post(bad.path, content=body, headers=JSON)

    assert answer.headers["Content-Type"] == "application/problem+json"
    problem = answer.json()
    assert (problem["code"], answer.status_code) == (bad.code, STATUS.get(bad.code, 422)), problem
    assert problem["status"] == answer.status_code
    assert problem["instance"] == bad.path
    if bad.pointer is not None:
        assert bad.pointer in [fault["pointer"] for fault in problem["errors"]], problem
    if bad.finding is not None:
        assert bad.finding in {found["code"] for found in problem["findings"] if found["severity"] == "error"}, problem
    assert len(answer.content) < 20_000
    # Alive, the same workers, none of them over its cap.
    assert service.post(PLAN, plan_request()).status_code == 200
    workers = service.workers()
    assert {worker.pid for worker in workers} == before
    assert max(worker.memory_info().rss for worker in workers) < WORKER_MEMORY_MIB * 2**20


def test_the_body_is_never_echoed(service: RunningService) -> None:
    mark = "qzjxv"
    bodies = [
        plan_request(robot=f"{mark} "),
        plan_request(backend={"kind": mark}),
        plan_request(waypoints=mark),
        plan_request(seed=mark),
        plan_request(include=[mark]),
        {"kind": "urdf", "id": "uploaded", "urdf": f'<robot name="{mark}"><link name="a"/>'},
        {"kind": mark},
    ]
    for body in bodies:
        for path in (PLAN, "/v1/robots"):
            answer = service.post(path, body)
            assert answer.status_code == 422
            assert mark not in answer.text
    assert mark not in service.log.read_text()


def test_other_media_types_are_refused(service: RunningService) -> None:
    for media_type in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data", "application/xml"):
        answer = service.client.post(PLAN, content=b"{}", headers={"Content-Type": media_type})
        assert (answer.status_code, answer.json()["code"]) == (415, "unsupported_media_type")


@pytest.mark.parametrize("chunked", [False, True], ids=["declared", "chunked"])
def test_a_huge_body_is_refused(service: RunningService, chunked: bool) -> None:
    size = service.client.get("/v1/limits").json()["max_body_bytes"] + 1
    content = iter([b" " * size]) if chunked else b" " * size
    answer = service.client.post(PLAN, content=content, headers=JSON)
    assert (answer.status_code, answer.json()["code"]) == (413, "payload_too_large")
    assert service.post(PLAN, plan_request()).status_code == 200


@pytest.mark.parametrize(
    ("path", "field", "row"),
    [("/v1/kinematics/forward", "positions", b"[]"), ("/v1/dynamics/inverse", "positions", b"{}"), (PLAN, "x", b"[1]")],
)
def test_a_million_empty_rows_are_refused_before_they_are_parsed(
    service: RunningService, path: str, field: str, row: bytes
) -> None:
    """They took 5 to 10 s of a worker, and more memory than it may have."""
    content = b'{"robot": "three_dof_arm", "%s": [%s]}' % (field.encode(), b",".join([row] * 1_000_000))
    answer = service.client.post(path, content=content, headers=JSON)
    assert (answer.status_code, answer.json()["code"]) == (422, "invalid_request")
    assert "queue" not in answer.headers["Server-Timing"]  # no worker has seen it


@pytest.mark.parametrize("operation", [one for one in OPERATIONS if one.request], ids=lambda one: one.id)
def test_a_body_that_nests_too_deep_costs_no_worker(service: RunningService, operation: Operation) -> None:
    """The smallest that ended a worker had 621 bytes; one of 2 kB failed in the server."""
    before = {worker.pid for worker in service.workers()}
    path = operation.path_of("cell")
    deep = "[" * 300 + "]" * 300
    bodies = [f'{{"{name}":{deep}}}' for name in ("a", "backend", "robot", "scene", "grid", "requests")]
    bodies += [
        f'{{"backend":{{"kind":{deep}}}}}',
        f'{{"requests":[{{"a":{deep}}}]}}',
        f'{{"grid":{{"template":{deep}}}}}',
    ]
    sent = [(body, JSON) for body in bodies]
    if operation.lines:
        sent += [(f'{{"a":{deep}}}\n', {"Content-Type": "application/x-ndjson"})]
    for body, headers in sent:
        answer = service.client.request(operation.method, path, content=body, headers=headers)
        assert (answer.status_code, answer.json()["code"]) == (422, "invalid_request")
        assert "in one another" in answer.json()["detail"]
    assert {worker.pid for worker in service.workers()} == before


def test_unknown_paths_and_methods_are_problems(service: RunningService) -> None:
    for method, path, status, code in (
        ("GET", "/assets/none.js", 404, "not_found"),
        ("GET", "/v1/robot", 404, "not_found"),
        ("GET", "/v1/robots/", 404, "not_found"),
        ("GET", "/v1/robots/nobody", 404, "unknown_robot"),
        ("GET", "/v1/robots/..%2f..%2fetc%2fpasswd", 404, "not_found"),
        ("DELETE", "/v1/robots/nobody", 404, "unknown_robot"),
        ("DELETE", "/v1/robots/three_dof_arm", 409, "catalogue_robot"),
        ("GET", "/docs/../../settings.py", 404, "not_found"),
        ("GET", PLAN, 405, "method_not_allowed"),
        ("PATCH", "/v1/robots", 405, "method_not_allowed"),
    ):
        answer = service.client.request(method, path)
        assert answer.headers["Content-Type"] == "application/problem+json"
        assert (answer.status_code, answer.json()["code"]) == (status, code), path
    assert service.client.patch("/v1/robots").headers["Allow"] == "GET, HEAD, POST"
