"""Projects of the page over HTTP: saved, opened, replaced and deleted, each key its own."""

from __future__ import annotations

import hashlib
import json
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import pytest

from api.base.api_keys import KeyRecord, digest_of, id_of, new_key
from api.contract.stored_projects import ProjectsAnswer
from api.store.database import make_engine, sqlite_url
from api.store.keys import add_key
from api.store.migrate import upgrade
from tests.api.made_up_service import made_up_service

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import httpx

PROJECTS = "/v1/projects"
ONE, OTHER = {"robot": "ur5e", "waypoints": []}, {"robot": "ur5e", "waypoints": [{"kind": "named", "name": "home"}]}


@pytest.fixture(scope="module")
def service() -> Iterator[httpx.Client]:
    with made_up_service(max_projects_per_client=3, max_projects_bytes_per_client=3000, max_body_bytes=2048) as client:
        yield client


@pytest.fixture
def client(service: httpx.Client) -> Iterator[httpx.Client]:
    """A client without projects."""
    yield service
    for one in service.get(PROJECTS).json()["projects"]:
        service.delete(f"{PROJECTS}/{one['name']}")


def put(client: httpx.Client, name: str, project: Any, **headers: str) -> httpx.Response:
    sent = {key.replace("_", "-"): value for key, value in headers.items()}
    return client.put(f"{PROJECTS}/{quote(name, safe='')}", json=project, headers=sent)


def test_a_project_is_saved_listed_opened_and_deleted(client: httpx.Client) -> None:
    text = b'{"robot":  "ur5e", "name": "Schwei\xc3\x9fen", "numbers": [1.10, 2]}'
    before = datetime.now(UTC)
    saved = client.put(
        f"{PROJECTS}/Zelle%204%2C%20gro%C3%9F", content=text, headers={"Content-Type": "application/json"}
    )
    assert (saved.status_code, saved.headers["Location"]) == (201, f"{PROJECTS}/Zelle%204%2C%20gro%C3%9F")
    digest = "sha256:" + hashlib.sha256(text).hexdigest()
    entry = saved.json()
    assert entry == {"name": "Zelle 4, groß", "changed": entry["changed"], "content": digest, "size": len(text)}
    assert abs((datetime.fromisoformat(entry["changed"]) - before).total_seconds()) < 10.0
    assert saved.headers["ETag"] == f'"{digest}"'
    found = client.get(saved.headers["Location"])
    assert (found.content, found.headers["ETag"]) == (text, saved.headers["ETag"])
    known = client.get(saved.headers["Location"], headers={"If-None-Match": found.headers["ETag"]})
    assert (known.status_code, known.content) == (304, b"")
    assert client.get(PROJECTS).json() == {"projects": [entry], "next_cursor": None}
    assert client.delete(saved.headers["Location"]).status_code == 204
    for method in ("GET", "DELETE"):
        gone = client.request(method, saved.headers["Location"])
        refusal = gone.json()
        assert (gone.status_code, refusal["code"]) == (404, "unknown_project")
        assert refusal["instance"] == saved.headers["Location"]  # a reference, and so escaped (RFC 9457, 3.1.5)


def test_projects_are_listed_in_pages_by_name(client: httpx.Client) -> None:
    for name in ("c", "a", "b"):
        put(client, name, ONE)
    first = ProjectsAnswer.model_validate_json(client.get(PROJECTS, params={"limit": 2}).content, strict=True)
    rest = client.get(PROJECTS, params={"limit": 2, "cursor": first.next_cursor or ""}).json()
    assert [one.name for one in first.projects] == ["a", "b"]
    assert [one["name"] for one in rest["projects"]] == ["c"] and rest["next_cursor"] is None


def test_two_browsers_do_not_overwrite_each_other_unseen(client: httpx.Client) -> None:
    first = put(client, "cell", ONE, If_None_Match="*")
    seen = first.headers["ETag"]
    taken = put(client, "cell", OTHER, If_None_Match="*")
    assert (taken.status_code, taken.json()["code"], taken.headers["ETag"]) == (412, "project_changed", seen)
    theirs = put(client, "cell", OTHER, If_Match=seen)
    assert theirs.status_code == 200 and theirs.headers["ETag"] != seen
    assert theirs.json()["changed"] >= first.json()["changed"]
    ours = put(client, "cell", {}, If_Match=seen)
    assert (ours.status_code, ours.headers["ETag"]) == (412, theirs.headers["ETag"])
    assert client.get(f"{PROJECTS}/cell").json() == OTHER
    weak = "W/" + theirs.headers["ETag"]  # a proxy that compresses answers makes it weak
    assert put(client, "cell", ONE, If_Match=f'"x", {weak}').status_code == 200
    again = put(client, "cell", ONE, If_Match='"x"')  # what was to be done is done
    assert (again.status_code, again.headers["ETag"]) == (200, seen)
    assert client.delete(f"{PROJECTS}/cell", headers={"If-Match": weak}).status_code == 412
    assert client.delete(f"{PROJECTS}/cell", headers={"If-Match": seen}).status_code == 204
    gone = put(client, "cell", OTHER, If_Match=seen)
    assert gone.status_code == 412 and "ETag" not in gone.headers and "any more" in gone.json()["detail"]
    assert put(client, "cell", OTHER, If_Match="*").status_code == 412
    assert put(client, "cell", OTHER).status_code == 201


def test_of_savings_at_the_same_time_one_is_first(client: httpx.Client) -> None:
    with ThreadPoolExecutor(8) as threads:
        answers = list(threads.map(lambda i: put(client, "cell", {"seed": i}, If_None_Match="*"), range(8)))
    assert sorted(answer.status_code for answer in answers) == [201] + [412] * 7
    [first] = [answer for answer in answers if answer.status_code == 201]
    assert client.get(f"{PROJECTS}/cell").headers["ETag"] == first.headers["ETag"]


@pytest.mark.parametrize(
    ("name", "content", "status", "code"),
    [
        ("cell", b"[]", 422, "invalid_request"),
        ("cell", b"{", 422, "invalid_request"),
        ("cell", b"", 422, "invalid_request"),
        ("cell", json.dumps({"a": "x" * 3000}).encode(), 413, "payload_too_large"),
        ("x" * 101, b"{}", 422, "invalid_request"),
        (".hidden", b"{}", 422, "invalid_request"),
        ("%20cell", b"{}", 422, "invalid_request"),
        ("a%2Fb", b"{}", 404, "not_found"),
    ],
)
def test_what_is_no_project_or_no_name_is_refused(
    client: httpx.Client, name: str, content: bytes, status: int, code: str
) -> None:
    answer = client.put(f"{PROJECTS}/{name}", content=content, headers={"Content-Type": "application/json"})
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert client.get(PROJECTS).json()["projects"] == []


def test_the_projects_of_a_client_are_bounded_in_number_and_bytes(client: httpx.Client) -> None:
    for name in ("a", "b", "c"):
        assert put(client, name, {"name": name}).status_code == 201
    refused = put(client, "d", {})
    assert (refused.status_code, refused.json()["code"]) == (409, "too_many_projects")
    assert put(client, "a", {"text": "x" * 1500}).status_code == 200  # in the place of its own
    assert put(client, "b", {"text": "y" * 1500}).json()["code"] == "too_many_projects"
    limits = client.get("/v1/limits").json()
    assert (limits["max_projects_per_client"], limits["max_projects_bytes_per_client"]) == (3, 3000)


def test_each_key_has_projects_of_its_own(tmp_path: Path) -> None:
    keys = {name: new_key()[1] for name in ("one", "other", "reader")}
    engine = make_engine(sqlite_url(tmp_path))
    upgrade(engine)
    with engine.begin() as connection:
        for name, key in keys.items():
            scopes = {"plan"} if name == "reader" else {"plan", "projects:write"}
            add_key(
                connection, KeyRecord(str(id_of(key)), name, digest_of(key), frozenset(scopes), None, None, 0.0, None)
            )
    engine.dispose()

    with made_up_service(access="keys", data_directory=str(tmp_path)) as client:

        def ask(key: str, method: str, path: str, project: Any = None) -> httpx.Response:
            return client.request(method, path, json=project, headers={"Authorization": f"Bearer {keys[key]}"})

        assert [ask(key, "PUT", f"{PROJECTS}/cell", {"of": key}).status_code for key in keys] == [201, 201, 403]
        for key in ("one", "other"):
            assert ask(key, "GET", f"{PROJECTS}/cell").json() == {"of": key}
            assert [one["name"] for one in ask(key, "GET", PROJECTS).json()["projects"]] == ["cell"]
        assert ask("reader", "GET", f"{PROJECTS}/cell").json()["code"] == "unknown_project"
        assert ask("reader", "GET", PROJECTS).json()["projects"] == []
        assert ask("one", "DELETE", f"{PROJECTS}/cell").status_code == 204
        assert ask("other", "GET", f"{PROJECTS}/cell").json() == {"of": "other"}
