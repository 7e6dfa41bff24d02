"""The OpenAPI document on the documentation site, opened as a file."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from playwright.sync_api import expect

from docs.tools.openapi import site_files

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser


def test_the_interface_is_shown_from_the_file_system_without_a_network(browser: Browser, tmp_path: Path) -> None:
    contents = site_files()
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
    paths = json.loads(contents["openapi.json"])["paths"]
    operations = sum(method in {"get", "post", "put", "patch", "delete"} for item in paths.values() for method in item)
    page = browser.new_page()
    requested: list[str] = []
    page.on("request", lambda request: requested.append(request.url))
    page.goto((tmp_path / "index.html").as_uri())
    expect(page.locator(".opblock")).to_have_count(operations)
    page.get_by_role("button", name="POST /v1/trajectories Plan a certified").click()
    expect(page.locator(".body-param__example")).to_contain_text("ngv_refuelling_arm")
    page.locator(".opblock-body").get_by_role("tab", name="Schema").first.click()
    expect(page.locator(".opblock-body")).to_contain_text("waypoints")
    expect(page.locator(".errors-wrapper")).to_have_count(0)
    expect(page.get_by_role("button", name="Try it out")).to_have_count(0)
    assert all(url.startswith(("file:", "data:")) for url in requested)
    page.close()
