"""Makes the pictures of docs/page.md: `python -m web.tests.pictures`."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from tests.api.conftest import running_service
from tests.locations import ROOT
from web.tests.browser import (
    PHONE,
    TOO_SHORT,
    WELDING,
    choose_example,
    click_example,
    launched,
    opened,
    planned,
    use_request,
)

FOLDER = ROOT / "docs/images/page"
VIEW = {"width": 1360, "height": 850}
QUALITIES = (72, 66, 60, 54, 48)  # of JPEG: the first that makes a picture small enough is taken
MOST_BYTES = 145_000


def main() -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory() as folder,
        running_service(Path(folder) / "log.jsonl") as service,
        sync_playwright() as playwright,
    ):
        browser = launched(playwright)

        def take(name: str, what: str) -> None:
            page.locator("h1").click()
            page.wait_for_timeout(1000)
            taken = (page.screenshot(type="jpeg", quality=quality) for quality in QUALITIES)
            picture = next(picture for picture in taken if len(picture) <= MOST_BYTES)
            (FOLDER / f"{name}.jpg").write_bytes(picture)
            print(f"{name}: {what}, {len(picture)} bytes")

        with opened(browser, f"{service.url}/", viewport=VIEW) as page:
            choose_example(page, WELDING)
            page.locator("[data-waypoint='4']").click()
            take("light", "the welding example")
            use_request(page, json.dumps(TOO_SHORT))
            page.get_by_role("alert", name="Refusal").wait_for()
            take("refusal", "a duration that is too short")
            page.get_by_role("tab", name="Certificate").click()
            choose_example(page, "features/around_a_wall")
            page.locator(".nearest-note").click()
            take("scene", "a way around a wall, where it comes nearest")
            choose_example(page, "features/slow_beside_a_walkway")
            page.get_by_role("button", name="Tool speed", exact=True).click()
            page.get_by_role("button", name="Position", exact=True).click()
            page.locator(".certificate tbody tr", has_text="Speed nearer than").last.get_by_role("button").click()
            page.get_by_role("button", name="Add a zone").scroll_into_view_if_needed()
            take("zones", "slow beside a walkway")
        with opened(browser, f"{service.url}/", viewport=VIEW) as page:
            choose_example(page, "features/pick_and_place")
            page.get_by_role("tab", name="Batch").click()
            page.get_by_role("textbox", name="Values").fill(", ".join(f"{0.3 + 0.02 * k:.2f}" for k in range(37)))
            page.get_by_role("button", name="Another field").click()
            page.get_by_role("combobox", name="Field").nth(1).fill("/backend/kind")
            page.get_by_role("textbox", name="Values").nth(1).fill("cubic, quintic, trapezoidal, ruckig, wrong")
            page.get_by_role("button", name="Plan 185 requests").click()
            page.locator(".batch-head", has_text="Completed").wait_for(timeout=60_000)
            take("batch", "185 requests")
            location = f"/v1/batches/{page.locator('.batch-head code').inner_text()}"
            report = Path(folder) / "report.html"
            report.write_bytes(service.client.get(f"{location}/report").content)
        with opened(browser, report.as_uri(), viewport=VIEW) as page:
            page.locator(".worst").first.wait_for()
            take("batch_report", "the report of these")
        with opened(browser, f"{service.url}/", viewport=VIEW, color_scheme="dark") as page:
            choose_example(page, "features/pick_and_place")
            page.get_by_role("tab", name="Compare").click()
            page.get_by_role("button", name="Compare all back ends").click()
            page.locator("table.compare").wait_for(timeout=60_000)
            page.get_by_label("in % of the limits").check()
            page.get_by_role("slider", name="Time").press("PageUp")
            take("compare", "all back ends on one job, in the dark")
        with opened(browser, f"{service.url}/", viewport=VIEW) as page:
            choose_example(page, "features/pick_and_place")
            page.get_by_role("tab", name="Robot").click()
            page.get_by_label("Show where the tool can be").check()
            page.get_by_role("region", name="Workspace").get_by_role("table").wait_for()
            take("workspace", "where the tool can be")
        with opened(browser, f"{service.url}/", viewport=VIEW) as page:
            planned(page)
            click_example(page, "cells/handover")
            page.locator(".cell .row").nth(1).wait_for()
            planned(page)
            page.get_by_role("slider", name="Time").press("PageUp")
            take("cell", "two robots that hand over a bar")
        with opened(browser, f"{service.url}/", viewport=PHONE) as page:
            planned(page)
            take("phone", "a phone")


main()
