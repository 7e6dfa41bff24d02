"""The page at / and its files, as the service sends them."""

from __future__ import annotations

import asyncio
import gzip
import re
from typing import TYPE_CHECKING

import pytest
from starlette.requests import Request
from structlog.testing import capture_logs

from api.routes import page
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path

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
    directives = dict(part.strip().split(" ", 1) for part in answer.headers["content-security-policy"].split(";"))
    assert directives["default-src"] == "'none'"
    assert directives["script-src"] == directives["style-src"] == directives["connect-src"] == "'self'"
    assert not re.findall(r'(?:src|href)="(?!\./|docs)', answer.text), "all addresses are relative, for any prefix"


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
