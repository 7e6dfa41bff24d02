"""Named projects, which the browser keeps."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from playwright.sync_api import expect

from web.tests.browser import TOO_SHORT, planned, shown_request, use_request
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page


FILL = """() => {
  for (let power = 22; power >= 0; power -= 1) {
    try {
      while (true) localStorage.setItem(`fill${localStorage.length}`, 'x'.repeat(2 ** power));
    } catch {}
  }
}"""
"""Leaves no room in the storage of the browser."""


def save(page: Page, name: str) -> Locator:
    section = page.get_by_role("region", name="Projects in this browser")
    section.get_by_label("Name of the project").click()
    page.keyboard.press("Control+a")
    page.keyboard.type(name)
    page.keyboard.press("Enter")
    return section


def test_projects_are_saved_opened_and_deleted_by_name(page: Page) -> None:
    first = shown_request(page)
    save(page, "refuelling")
    use_request(page, json.dumps(TOO_SHORT))
    expect(page.locator("[data-waypoint]")).to_have_count(2)
    section = save(page, "too short")
    expect(section.get_by_role("listitem")).to_have_count(2)
    assert violations(page) == []
    page.reload()
    page.get_by_role("tab", name="Request").click()
    section.get_by_role("button", name="refuelling", exact=True).click()
    expect(page.locator("[data-waypoint]")).to_have_count(6)
    assert shown_request(page) == first
    section.get_by_role("button", name="Delete refuelling").click()
    expect(section.get_by_role("listitem")).to_have_text(["too short✕"])
    page.reload()
    page.get_by_role("tab", name="Request").click()
    expect(section.get_by_role("listitem")).to_have_text(["too short✕"])


def test_a_browser_without_room_says_so(page: Page) -> None:
    """As after another page of the same origin has filled the storage."""
    page.evaluate(FILL)
    page.get_by_role("tab", name="Request").click()
    section = save(page, "refuelling")
    expect(section.get_by_role("alert")).to_contain_text("no room")
    expect(section.get_by_role("listitem")).to_have_count(0)


def test_a_project_that_another_tab_has_changed_is_not_overwritten(page: Page) -> None:
    """The page offers both ways out; a project of the other tab under another name stays."""
    first = shown_request(page)
    save(page, "refuelling")
    other = page.context.new_page()
    other.goto(page.url.split("#")[0])
    planned(other)
    use_request(other, json.dumps(TOO_SHORT))
    expect(other.locator("[data-waypoint]")).to_have_count(2)
    save(other, "short")
    theirs = save(other, "refuelling")
    theirs.get_by_role("button", name="Overwrite it").click()
    expect(theirs.get_by_role("alert")).to_have_count(0)
    section = page.get_by_role("region", name="Projects in this browser")
    expect(section.get_by_role("listitem")).to_have_text(["refuelling✕", "short✕"])
    page.locator("[data-waypoint='1']").click()
    page.get_by_role("button", name="Duplicate").click()
    page.get_by_role("tab", name="Request").click()
    section = save(page, "refuelling")
    expect(section.get_by_role("alert")).to_contain_text("was changed elsewhere")
    assert violations(page) == []
    section.get_by_role("button", name="Open the other version").click()
    expect(page.locator("[data-waypoint]")).to_have_count(2)
    expect(section.get_by_role("alert")).to_have_count(0)
    expect(section.get_by_role("listitem")).to_have_text(["refuelling✕", "short✕"])
    save(page, "refuelling")
    expect(section.get_by_role("alert")).to_have_count(0)
    assert len(first["waypoints"]) != 2
