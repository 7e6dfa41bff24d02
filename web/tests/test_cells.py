"""Cells on the page: several robots on one clock, of which one is edited."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from playwright.sync_api import expect

from tests.locations import ROOT
from web.tests.browser import click_example, opened, planned, seconds, shown_request
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

    from tests.api.conftest import RunningService

HANDOVER: dict[str, Any] = json.loads((ROOT / "examples/cell/handover.json").read_text())


def robots(page: Page) -> Locator:
    return page.get_by_role("region", name="Robots of the cell").locator(".row")


def test_a_cell_is_shown_edited_and_refused_at_the_robot_at_fault(browser: Browser, service: RunningService) -> None:
    answer = service.post("/v1/cells/plan", HANDOVER).json()
    (meeting,) = answer["meetings"]
    (wait,) = [wait for wait in answer["robots"][1]["waits"] if wait > 0]
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        click_example(page, "cells/handover")
        expect(robots(page)).to_contain_text(["no wait", f"waits {wait:.3f} s at 1"])
        assert f"{answer['duration']:.3f} s" in planned(page)
        assert shown_request(page) == HANDOVER
        page.get_by_role("button", name=f"{meeting['time']:.3f} s: go there").click()
        assert abs(seconds(page) - meeting["time"]) < 1e-3
        robots(page).nth(1).click()
        expect(page.get_by_role("heading", name="The robot right")).to_be_visible()
        expect(page.locator("[data-waypoint='1']")).to_contain_text("handover")
        assert abs(seconds(page) - meeting["time"]) < 1e-3
        page.locator("[data-waypoint='2']").click()
        page.get_by_label("Duration (s)").fill("0.1")
        page.get_by_label("Duration (s)").press("Enter")
        robots(page).nth(0).click()
        refusal = page.get_by_role("alert", name="Refusal")
        expect(refusal).to_contain_text("The robot right")
        expect(page.locator(".cell li.wrong")).to_contain_text("right")
        assert violations(page) == []
        refusal.get_by_role("button", name="Show the waypoint").click()
        expect(page.locator("#waypoints > .waypoints li.wrong [data-waypoint='2']")).to_be_visible()
        refusal.get_by_role("button", name="Apply").first.click()
        expect(robots(page).nth(1)).to_contain_text(re.compile(r"waits \d"))
        asked = shown_request(page)
        assert asked["robots"][0] == HANDOVER["robots"][0]
        assert asked["robots"][1]["waypoints"][2]["duration"] > 0.1


def test_a_cell_is_made_of_a_request_and_planned(page: Page) -> None:
    waypoints = shown_request(page)["waypoints"]
    page.get_by_role("button", name="+ Robot").click()
    page.get_by_role("menuitem", name="One like this").click()
    expect(robots(page)).to_have_count(2)
    expect(page.locator(".cell .found li")).to_contain_text(["apart or more"])
    made = shown_request(page)
    assert [robot["waypoints"] for robot in made["robots"]] == [waypoints, waypoints]
    page.get_by_role("button", name="Delete the robot").click()
    expect(robots(page)).to_have_count(0)
    planned(page)
