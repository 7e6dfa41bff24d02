"""Batches on the page: a request is sent as a grid and seen while it is planned, with its failures; or opened by id."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from playwright.sync_api import expect
from typer.testing import CliRunner

from cli import app
from tests.api.conftest import wait_until
from tests.locations import ROOT
from web.tests.browser import DESKTOP, PHONE, opened, planned, plays
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import pytest
    from playwright.sync_api import Browser, Page

    from tests.api.conftest import RunningService


def test_a_request_is_sent_as_a_grid_and_seen_by_another(page: Page, browser: Browser, service: RunningService) -> None:
    """At a tenth and a fifth of the velocity the arm is not there in the times that the example asks for."""
    page.get_by_role("tab", name="Batch").click()
    page.get_by_role("textbox", name="Values").fill("0.05, 0.1, 0.5, 1")
    page.get_by_role("button", name="Another field").click()
    page.get_by_role("combobox", name="Field").nth(1).fill("/backend/kind")
    expect(page.get_by_role("button", name="Values are not readable")).to_be_disabled()
    page.get_by_role("textbox", name="Values").nth(1).fill("cubic, quintic")
    page.get_by_role("button", name="Plan 8 requests").click()
    batch = page.get_by_role("region", name="The batch", exact=True)
    expect(batch).to_contain_text("Completed")
    told = service.client.get(f"/v1/batches/{batch.locator('code').first.inner_text()}").json()
    expect(batch.get_by_role("status")).to_have_text(
        f"{told['counts']['planned']} planned, {told['counts']['refused']} refused of 8"
    )
    assert told["counts"]["planned"] > 0 < told["counts"]["refused"]
    bars = batch.locator(".histogram rect").all()
    assert [float(bar.get_attribute("height") or 0.0) > 0.0 for bar in bars] == [
        count > 0 for count in told["summary"]["duration"]["histogram"]
    ]
    expect(batch.locator(".failures li")).to_have_count(len(told["summary"]["refusals"]))
    expect(batch.locator(".failures small").first).to_contain_text("request ")
    link = batch.get_by_role("link", name="Report").get_attribute("href")
    assert link == f"{service.url}/v1/batches/{told['id']}/report"
    assert violations(page) == []
    with opened(browser, f"{service.url}/") as other:
        planned(other)
        other.get_by_role("tab", name="Batch").click()
        other.get_by_role("combobox", name="A batch by its id").fill(told["id"])
        other.get_by_role("button", name="Open").click()
        expect(other.get_by_role("region", name="The batch", exact=True)).to_contain_text("Completed")


def test_what_is_no_batch_is_said(browser: Browser, service: RunningService) -> None:
    with opened(browser, f"{service.url}/", may_fail=("status of 404",)) as page:
        planned(page)
        page.get_by_role("tab", name="Batch").click()
        page.get_by_role("combobox", name="A batch by its id").fill("nonsense")
        page.get_by_role("button", name="Open").click()
        expect(page.get_by_role("alert", name="The batch was refused")).to_contain_text("GET /v1/batches lists")


def test_files_of_a_batch_are_saved_where_keys_are_asked_for(
    browser: Browser,
    start_service: Callable[..., RunningService],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    """A link sends no key: it saved the refusal under the name of the file."""
    monkeypatch.setenv("PLANNER_DATA_DIRECTORY", str(tmp_path))
    key = CliRunner().invoke(app, ["keys", "create", "page"]).stdout.strip()
    service = start_service(access="keys", workers=1)
    with opened(browser, f"{service.url}/", may_fail=("status of 401",)) as page:
        page.get_by_label("API key").fill(key)
        page.get_by_role("button", name="Use key").click()
        planned(page)
        page.get_by_role("tab", name="Batch").click()
        page.get_by_role("textbox", name="Values").fill("0.9, 1")
        page.get_by_role("button", name="Plan 2 requests").click()
        expect(page.get_by_role("region", name="The batch", exact=True)).to_contain_text("Completed")
        for name, start in (("Report", b"<!DOCTYPE html>"), ("All results as zip", b"PK")):
            with page.expect_download() as download:
                page.get_by_role("link", name=name).click()
            download.value.save_as(tmp_path / "saved")
            assert (tmp_path / "saved").read_bytes().startswith(start)


def test_a_report_opens_from_disk_and_shows_the_worst_plans(
    browser: Browser, service: RunningService, tmp_path: Path
) -> None:
    example = json.loads((ROOT / "examples/batches/speeds_and_back_ends.json").read_text())
    example["grid"]["vary"][1]["values"].append({"kind": "wrong"})
    location = service.post("/v1/batches", example).headers["Location"]
    wait_until(lambda: bool(service.client.get(location).json()["ended"]))
    told = service.client.get(location).json()
    file = tmp_path / "report.html"
    file.write_bytes(service.client.get(f"{location}/report").content)
    for viewport in (DESKTOP, PHONE):
        with opened(browser, file.as_uri(), viewport=viewport) as page:
            tiles = page.locator(".tiles dd").all_inner_texts()
            assert tiles[:3] == [str(told["counts"][name]) for name in ("total", "planned", "refused")]
            expect(page.locator(".histogram")).to_have_count(3)
            expect(page.locator(".refusals tbody tr")).to_have_count(1)
            worst = page.locator(".worst button")
            expect(page.locator(".small-graph polyline")).to_have_count(6 * worst.count())
            expect(page.locator(".worst button[aria-pressed=true] strong").first).to_have_text("Request 0")
            last = worst.last.locator("strong").inner_text()
            worst.last.click()
            expect(page.locator(".chosen-plan h2").first).to_have_text(last)
            page.get_by_role("button", name="Play").click()
            plays(page)
            assert violations(page) == []
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_a_field_that_the_request_has_no_place_for_is_said(page: Page) -> None:
    page.get_by_role("tab", name="Batch").click()
    page.get_by_role("combobox", name="Field").fill("/robot/x")
    expect(page.get_by_role("alert")).to_have_text("The request has no place for /robot/x.")
    expect(page.get_by_role("button", name="Plan 4 requests")).to_be_disabled()
    page.get_by_role("combobox", name="Field").fill("/limits/velocity_scale")
    expect(page.get_by_role("button", name="Plan 4 requests")).to_be_enabled()
