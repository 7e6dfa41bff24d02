"""Web pages that may use a service without keys, identified by the headers of browsers."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from api.base.errors import MisdirectedRequest
from api.base.settings import Settings
from api.http.access.sites import Sites
from tests.api.made_up_service import made_up_service
from tests.api.operations import OPERATIONS
from tests.api.requests import plan_request

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

PLAN = "/v1/trajectories"
ELSEWHERE = "https://elsewhere.example.com"
EVERYWHERE = "0.0.0.0"  # noqa: S104 - that is what is tested
PAGE = "https://cell.example.com"
CONTAINER: dict[str, Any] = {"host": EVERYWHERE, "access": "open"}
LOOPBACK: dict[str, Any] = {"host": "127.0.0.1"}
WITH_NAME: dict[str, Any] = {"allowed_hosts": "planner.example.com, Arm.example.com"}


@pytest.fixture(scope="module")
def client() -> Iterator[httpx.Client]:
    with made_up_service(cors_origins=PAGE) as client:
        yield client


@pytest.mark.parametrize("operation", [one for one in OPERATIONS if one.request], ids=lambda one: one.id)
@pytest.mark.parametrize("media_type", [None, "", "text/plain;charset=UTF-8", "application/x-www-form-urlencoded"])
def test_a_body_that_any_page_may_send_is_no_json(client: httpx.Client, operation: Any, media_type: str | None) -> None:
    """A page sends these without asking first: `fetch` in the mode `no-cors`, a form, and `curl -d`."""
    headers = {} if media_type is None else {"Content-Type": media_type}
    path = operation.path_of("cell")
    answer = client.request(operation.method, path, content=json.dumps(plan_request()).encode(), headers=headers)
    assert (answer.status_code, answer.json()["code"]) == (415, "unsupported_media_type")
    assert answer.json()["detail"].startswith("`Content-Type` must be `application/json`")


@pytest.mark.parametrize("media_type", ["application/json", "Application/JSON; charset=utf-8", "application/plan+json"])
def test_json_by_any_of_its_names_is_read(client: httpx.Client, media_type: str) -> None:
    body = json.dumps(plan_request()).encode()
    assert client.post(PLAN, content=body, headers={"Content-Type": media_type}).status_code == 200


@pytest.mark.parametrize(
    ("settings", "host", "is_served"),
    [
        (LOOPBACK, "127.0.0.1:8000", True),
        (LOOPBACK, "localhost:8000", True),
        (LOOPBACK, "planner.localhost", True),
        (LOOPBACK, "[::1]:8000", True),
        (LOOPBACK, "LOCALHOST.", True),
        (LOOPBACK, "evil.example.com:8000", False),
        (LOOPBACK, "planner", False),
        (LOOPBACK, "127.0.0.1.evil.example.com", False),
        (LOOPBACK, "localhost.evil.example.com", False),
        (LOOPBACK, "[", False),
        (CONTAINER, "planner:8000", True),
        (CONTAINER, "planner.default.svc.cluster.local", True),
        (CONTAINER, "10.0.0.7:8000", True),
        (CONTAINER, "127.0.0.1:8000", True),
        (CONTAINER, "evil.example.com:8000", False),
        (LOOPBACK | WITH_NAME, "planner.example.com", True),
        (LOOPBACK | WITH_NAME, "arm.EXAMPLE.com:80", True),
        (LOOPBACK | WITH_NAME, "127.0.0.1:8000", True),
        (CONTAINER | WITH_NAME, "other.example.com", False),
        (CONTAINER | WITH_NAME, "planner", False),
        (CONTAINER | WITH_NAME, "10.0.0.7", True),
        ({"host": "arm.example.com", "access": "open"}, "arm.example.com", True),
        ({"host": "127.0.0.1", "access": "keys", "database_url": "postgresql://x/y"}, "planner.example.com", True),
    ],
)
def test_names_that_the_service_is_served_under(settings: dict[str, Any], host: str, is_served: bool) -> None:
    """Health checks ask an address, Prometheus and a pod's neighbours a name of their own network."""
    sites = Sites(Settings(**settings))
    scope = {"type": "http", "method": "GET", "headers": [(b"host", host.encode())]}
    if is_served:
        sites.check(scope)
        return
    with pytest.raises(MisdirectedRequest, match="PLANNER_ALLOWED_HOSTS"):
        sites.check(scope)


def test_a_request_to_another_name_reads_and_changes_nothing(client: httpx.Client) -> None:
    """By DNS rebinding, a page of any site could read, change and delete."""
    rebound = {"Host": "evil.example.com:8000", "Origin": "http://evil.example.com:8000"}
    for method, path in (("GET", "/"), ("GET", "/livez"), ("GET", "/v1/robots"), ("DELETE", "/v1/robots/x")):
        answer = client.request(method, path, headers=rebound)
        assert (answer.status_code, answer.json()["code"]) == (421, "misdirected_request")
        assert answer.headers["Content-Type"] == "application/problem+json"
        assert "evil" not in answer.text


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"Origin": ELSEWHERE}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://["}, 403),
        ({"Origin": "http://localhost:3000", "Sec-Fetch-Site": "same-site"}, 403),
        ({"Origin": PAGE, "Sec-Fetch-Site": "cross-site"}, 200),
        ({"Origin": "http://localhost:8000", "Host": "localhost:8000"}, 200),
        ({"Origin": "https://planner.example.com", "Sec-Fetch-Site": "same-origin"}, 200),
    ],
)
def test_pages_of_other_origins_compute_and_change_nothing(
    client: httpx.Client, headers: dict[str, str], status: int
) -> None:
    """The last is the service's own page behind a proxy that gives it another `Host`."""
    answer = client.post(PLAN, json=plan_request(), headers=headers)
    assert answer.status_code == status
    if status == 403:
        assert answer.json()["code"] == "foreign_origin"
        assert client.delete("/v1/robots/somebodys", headers=headers).status_code == 403


def test_every_page_may_where_the_operator_says_so() -> None:
    with made_up_service(cors_origins="*") as client:
        assert client.post(PLAN, json=plan_request(), headers={"Origin": ELSEWHERE}).status_code == 200
