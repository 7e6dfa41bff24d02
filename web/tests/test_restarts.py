"""The page while its service is restarted: between two plans, in the middle of one, and of a batch that is heard."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.api.batches.long_batches import slow_requests
from tests.locations import ROOT
from web.tests.browser import WELDING, click_example, opened, planned, use_request
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from playwright.sync_api import Browser, Locator, Page, Route

    from tests.api.conftest import RunningService

AWAY = ("net::ERR_", "status of 503")
"""What Chromium says by itself of a service that is not there, or not yet ready."""
ITEMS = 12


@pytest.fixture
def start_again(
    start_service: Callable[..., RunningService], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., RunningService]:
    """Start a service where another one was."""

    def start(before: RunningService, **settings: object) -> RunningService:
        port = int(before.url.rpartition(":")[2])
        monkeypatch.setattr("tests.api.conftest.free_port", lambda: port)
        return start_service(**settings)

    return start


def end(service: RunningService) -> None:
    service.process.terminate()
    service.process.wait(60.0)


def edit_duration(page: Page) -> None:
    page.locator("[data-waypoint='1']").click()
    page.get_by_label("Duration (s)").fill("9.33")
    page.keyboard.press("Tab")


def plan(page: Page) -> None:
    page.get_by_role("button", name="Plan", exact=True).click()


def test_it_goes_on_by_itself(
    browser: Browser, start_service: Callable[..., RunningService], start_again: Callable[..., RunningService]
) -> None:
    """An edit while the service is away is planned when it is back, and another robot is described then."""
    first = start_service(workers=1)
    with opened(browser, f"{first.url}/", may_fail=AWAY) as page:
        planned(page)
        end(first)
        edit_duration(page)
        banner = page.get_by_role("alert").filter(has_text="goes on when the service is back")
        expect(banner).to_be_visible()
        assert violations(page) == []
        second = start_again(first, workers=1)
        expect(page.locator(".verdict:not(.stale)")).to_contain_text("27.29 s")
        expect(banner).to_have_count(0)
        end(second)
        click_example(page, WELDING)
        expect(banner).to_be_visible()
        use_request(page, (ROOT / "examples/welding.json").read_text())
        expect(page.locator(".stage-failed")).to_contain_text("welding_arm")
        start_again(first, workers=1)
        expect(page.locator("[data-waypoint]")).to_have_count(11)
        assert "by quintic" in planned(page)


def test_a_request_that_is_never_answered_is_sent_again_once(browser: Browser, service: RunningService) -> None:
    """It may be what ends the service."""
    with opened(browser, f"{service.url}/", may_fail=AWAY) as page:
        planned(page)
        sent: list[Route] = []

        def fail(route: Route) -> None:
            sent.append(route)
            route.abort("connectionreset")

        page.route("**/v1/trajectories", fail)
        edit_duration(page)
        expect(page.get_by_role("alert").filter(has_text="press Plan to send the request once more")).to_be_visible()
        assert len(sent) == 2
        page.unroute("**/v1/trajectories")
        plan(page)
        expect(page.get_by_role("alert", name="Refusal")).to_have_count(0)
        assert "27.29 s" in planned(page)


def test_it_plans_again(
    browser: Browser, start_service: Callable[..., RunningService], start_again: Callable[..., RunningService]
) -> None:
    first = start_service(workers=1)
    with opened(browser, f"{first.url}/", may_fail=AWAY) as page:
        planned(page)
        end(first)
        plan(page)
        expect(page.get_by_role("alert", name="Refusal")).to_contain_text("does not answer")
        start_again(first, workers=1)
        plan(page)
        assert "25.29 s" in planned(page)


def test_a_plan_that_was_under_way_is_asked_for_again(
    browser: Browser, start_service: Callable[..., RunningService], start_again: Callable[..., RunningService]
) -> None:
    """The request stays, and is sent again once: it may have ended the service."""
    asked = json.loads((ROOT / "examples/around_a_wall.json").read_text())
    asked["waypoints"][1]["motion"] |= {"optimise": "duration", "time_budget": 5.0}
    first = start_service(workers=1)
    with opened(browser, f"{first.url}/", may_fail=AWAY) as page:
        planned(page)
        with page.expect_request(lambda request: "time_budget" in (request.post_data or "")):
            use_request(page, json.dumps(asked))
        first.process.kill()
        first.process.wait(30.0)
        expect(page.get_by_role("alert", name="Refusal")).to_contain_text("does not answer")
        expect(page.get_by_role("button", name="Plan", exact=True)).to_be_enabled()
        start_again(first, workers=1)
        assert json.loads(page.get_by_label("The request as JSON").input_value()) == asked
        plan(page)
        planned(page)
        expect(page.get_by_role("alert", name="Refusal")).to_have_count(0)
        expect(page.locator("[data-waypoint='1']")).to_contain_text("right of it")


def batch_under_way(page: Page) -> Locator:
    """Send a batch, and wait for its first results; the rest takes seconds, even for a slow page."""
    planned(page)
    use_request(page, json.dumps(slow_requests(1)[0]))
    planned(page)
    page.get_by_role("tab", name="Batch").click()
    page.get_by_role("combobox", name="Field").fill("/backend/kind")
    page.get_by_role("textbox", name="Values").fill("cubic, min_effort")
    page.get_by_role("button", name="Another field").click()
    page.get_by_role("combobox", name="Field").nth(1).fill("/waypoints/1/position/0")
    ends = ", ".join(f"{0.5 + 0.01 * k:.2f}" for k in range(ITEMS // 2))
    page.get_by_role("textbox", name="Values").nth(1).fill(ends)
    page.get_by_role("button", name=f"Plan {ITEMS} requests").click()
    batch = page.get_by_role("region", name="The batch", exact=True)
    expect(batch.get_by_role("status")).to_have_text(re.compile(r"^[1-9]\d* planned"))
    return batch


def test_a_batch_is_heard_on(
    browser: Browser,
    start_service: Callable[..., RunningService],
    start_again: Callable[..., RunningService],
    tmp_path: Path,
) -> None:
    settings = {"workers": 1, "data_directory": tmp_path / "data"}
    first = start_service(**settings)
    with opened(browser, f"{first.url}/", may_fail=AWAY) as page:
        batch = batch_under_way(page)
        end(first)
        expect(batch).not_to_contain_text("Completed")
        start_again(first, **settings)
        expect(batch).to_contain_text("Completed", timeout=120_000)
        expect(batch.get_by_role("status")).to_have_text(f"{ITEMS} planned, 0 refused of {ITEMS}")


def test_a_batch_that_was_not_kept_is_said(
    browser: Browser, start_service: Callable[..., RunningService], start_again: Callable[..., RunningService]
) -> None:
    """Without a directory for its data the service that comes back does not know it."""
    first = start_service(workers=1)
    with opened(browser, f"{first.url}/", may_fail=(*AWAY, "status of 404")) as page:
        batch = batch_under_way(page)
        first.process.kill()
        first.process.wait(30.0)
        batch.get_by_role("button", name="Cancel").click()
        expect(page.get_by_role("alert", name="The batch was refused")).to_contain_text("does not answer")
        start_again(first, workers=1)
        expect(page.get_by_role("alert", name="The batch was refused")).to_contain_text("GET /v1/batches lists")
        expect(batch).to_have_count(0)
