"""Pages of other sites in the browser of somebody who runs a service without keys: they read and change nothing."""

from __future__ import annotations

import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import pytest
from typing_extensions import override

from tests.api.requests import dh_robot, plan_request
from web.tests.browser import REBOUND_NAME

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser

    from tests.api.conftest import RunningService

SEND = """async (calls) => {
  const told = [];
  for (const [path, options] of calls) {
    const blob = options.body === undefined ? {} : { body: new Blob([options.body]) };
    try {
      const answer = await fetch(path, { ...options, ...blob });
      told.push([answer.type, answer.status]);
    } catch (error) {
      told.push(['error', 0]);
    }
  }
  return told;
}"""
"""Sends requests as a hostile page does; a Blob without a type has no `Content-Type`."""

ROBOT = dh_robot(id="from_a_hostile_page")


@pytest.fixture
def hostile_site() -> Iterator[str]:
    """A web site with an empty page."""

    class Site(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.send_header("Content-Length", "0")
            self.end_headers()

        @override
        def log_message(self, format: str, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Site)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://localhost:{server.server_port}/"
    server.shutdown()
    server.server_close()


def kept(service: RunningService) -> dict[str, Any]:
    return {
        name: service.client.get(f"/v1/{name}", params={"limit": 1000}).json()
        for name in ("robots", "scenes", "batches")
    }


def sent_from(browser: Browser, site: str, calls: list[tuple[str, dict[str, Any]]]) -> list[Any]:
    page = browser.new_page(bypass_csp=True)  # an attacker's page has no policy, whatever the service's answers have
    try:
        page.goto(site)
        told: list[Any] = page.evaluate(SEND, calls)
        return told
    finally:
        page.close()


@pytest.mark.parametrize("media_type", [None, "text/plain", "application/json"])
def test_a_page_of_another_site_cannot_post(
    browser: Browser, hostile_site: str, service: RunningService, media_type: str | None
) -> None:
    """It added a robot, a scene and a batch; the service took a body without `Content-Type` for JSON."""
    before = kept(service)
    headers = {} if media_type is None else {"headers": {"Content-Type": media_type}}
    bodies = {
        "robots": ROBOT,
        "scenes": {"id": "from_a_hostile_page", "objects": []},
        "batches": {"requests": [plan_request()]},
    }
    posts: list[tuple[str, dict[str, Any]]] = [
        (f"{service.url}/v1/{name}", {"method": "POST", "mode": "no-cors", "body": json.dumps(body), **headers})
        for name, body in bodies.items()
    ]
    told = sent_from(browser, hostile_site, posts)
    assert [kind for kind, _ in told] == ["opaque"] * 3  # the requests were sent, but their answers cannot be read
    assert kept(service) == before


def test_a_page_whose_name_leads_to_the_service_reads_and_changes_nothing(
    browser: Browser, service: RunningService
) -> None:
    """It looks like a page of the service's own: nothing in the browser keeps it from reading and deleting."""
    site = f"http://{REBOUND_NAME}:{urlsplit(service.url).port}"
    service.post("/v1/robots", ROBOT | {"id": "kept"}).raise_for_status()
    before = kept(service)
    json_headers = {"headers": {"Content-Type": "application/json"}}
    calls: list[tuple[str, dict[str, Any]]] = [
        ("/v1/robots", {}),
        ("/v1/robots", {"method": "POST", "body": json.dumps(ROBOT), **json_headers}),
        ("/v1/robots/kept", {"method": "DELETE"}),
    ]
    told = sent_from(browser, f"{site}/livez", calls)
    assert told == [["basic", 421]] * 3
    assert kept(service) == before
    assert service.client.delete("/v1/robots/kept").status_code == 204
