"""The page at / and its files, as the service sends them."""

from __future__ import annotations

import asyncio
import base64
import gzip
import hashlib
import re
from typing import TYPE_CHECKING

import pytest
from starlette.requests import Request
from structlog.testing import capture_logs

from api.http.routers import page
from tests.api.requests import plan_request
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

    import httpx

    from tests.api.conftest import RunningService

built = pytest.mark.skipif(not (ROOT / "api/built_page/index.html").is_file(), reason="the page is not built")


def test_the_style_is_in_short_files_that_are_all_used() -> None:
    """The linter holds the same for the page's code."""
    lines = {file.name: len(file.read_text().splitlines()) for file in (ROOT / "web/src/style").iterdir()}
    assert max(lines.values()) <= 300
    programs = [(ROOT / "web/src" / name).read_text() for name in ("main.tsx", "report/main.tsx")]
    assert {name for text in programs for name in re.findall(r"style/(\w+\.css)", text)} == set(lines)


@built
def test_the_document_lets_nothing_in_from_elsewhere(service: RunningService) -> None:
    answer = service.client.get("/")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.headers["cache-control"] == "no-cache"
    policy = directives(answer)
    assert policy["default-src"] == "'none'"
    assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == "'self'"
    assert not re.findall(r'(?:src|href)="(?!\./|docs)', answer.text), "all addresses are relative, for any prefix"


def directives(answer: httpx.Response) -> dict[str, str]:
    return dict(part.strip().split(" ", 1) for part in answer.headers["content-security-policy"].split(";"))


@pytest.mark.parametrize("path", ["/v1/robots", "/v1/trajectories?format=svg", "/openapi.json", "/metrics", "/nothing"])
def test_an_answer_without_a_program_runs_none(service: RunningService, path: str) -> None:
    """A browser that opens a picture runs the scripts in it, in the name of the service."""
    answer = service.post(path, plan_request()) if "svg" in path else service.client.get(path)
    assert ("svg" in path) == (answer.headers["content-type"] == "image/svg+xml")
    assert directives(answer) == {"default-src": "'none'", "style-src": "'unsafe-inline'"}


def test_a_renewed_answer_keeps_its_policy(service: RunningService) -> None:
    """A browser replaces its stored headers with the headers of a 304."""
    picture = "/v1/robots/three_dof_arm/geometry?format=svg"
    first = service.client.get(picture)
    again = service.client.get(picture, headers={"If-None-Match": first.headers["etag"]})
    assert (first.status_code, again.status_code) == (200, 304)
    assert "content-security-policy" not in again.headers


@built
def test_a_report_has_one_policy(service: RunningService) -> None:
    answer = service.post("/v1/trajectories", plan_request(), headers={"Accept": "text/html"})
    assert f'content="{answer.headers["content-security-policy"]}"' in answer.text
    assert directives(answer)["default-src"] == "'none'"
    assert "connect-src" not in directives(answer)


def test_the_documentation_runs_its_own_scripts_alone(service: RunningService) -> None:
    answer = service.client.get("/docs")
    [script] = re.findall(r"<script>(.*?)</script>", answer.text, flags=re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert directives(answer)["script-src"] == f"'self' 'sha256-{digest}'"
    assert directives(answer)["default-src"] == "'none'"
    assert directives(answer)["connect-src"] == "'self'"


@built
def test_the_files_may_be_kept_forever(service: RunningService) -> None:
    names = re.findall(r'(?:src|href)="\./(assets/[^"]+)"', service.client.get("/").text)
    assert {name.rpartition(".")[2] for name in names} >= {"js", "css", "svg"}
    for name in names:
        answer = service.client.get(f"/{name}")
        assert answer.status_code == 200
        assert "immutable" in answer.headers["cache-control"]
        assert answer.headers["content-encoding"] == "gzip"
        plain = service.client.get(f"/{name}", headers={"Accept-Encoding": "identity"})
        assert "content-encoding" not in plain.headers
        assert plain.content == answer.content == (ROOT / "api/built_page" / name).read_bytes()
        assert plain.content == gzip.decompress((ROOT / "api/built_page" / f"{name}.gz").read_bytes())


@pytest.mark.parametrize("name", ["none.js", "..%2Findex.html", "%2e%2e%2fbuilt_from.txt", "index.html"])
def test_there_are_no_other_files(service: RunningService, name: str) -> None:
    assert service.client.get(f"/assets/{name}").status_code == 404


def test_who_asks_for_json_gets_a_problem(service: RunningService) -> None:
    answer = service.client.get("/", headers={"Accept": "application/json"})
    assert answer.status_code == 404
    assert answer.json()["code"] == "not_found"


def test_a_page_that_was_not_built_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "built_page", lambda: tmp_path)
    (tmp_path / "not_built.txt").write_text("npm error network")
    with capture_logs() as logged:
        page.warn_if_not_built()
    assert [(line["event"], line["reason"]) for line in logged] == [("page_not_built", "npm error network")]
    answer = asyncio.run(page.page(Request({"type": "http", "headers": []})))
    assert answer.status_code == 200
    assert b"was not built" in answer.body
