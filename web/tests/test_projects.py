"""Named projects, which the browser or the service keeps."""

from __future__ import annotations

import json
from contextlib import ExitStack
from typing import TYPE_CHECKING
from urllib.parse import quote

import pytest
from playwright.sync_api import expect

from tests.api.conftest import wait_until
from web.tests.browser import TOO_SHORT, opened, planned, shown_request, use_request
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Browser, Locator, Page

    from tests.api.conftest import RunningService

IN_BROWSER, ON_SERVICE = "Projects in this browser", "Projects on the service"

FILL = """() => {
  for (let power = 22; power >= 0; power -= 1) {
    try {
      while (true) localStorage.setItem(`fill${localStorage.length}`, 'x'.repeat(2 ** power));
    } catch {}
  }
}"""
"""Leaves no room in the storage of the browser."""


def save(page: Page, name: str, where: str = IN_BROWSER) -> Locator:
    section = page.get_by_role("region", name=where)
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


@pytest.fixture
def open_anywhere(browser: Browser, service: RunningService) -> Iterator[Callable[[], tuple[Page, Locator]]]:
    """A function that opens the page in a browser profile of its own, with its projects of the service."""
    with ExitStack() as stack:

        def open_page() -> tuple[Page, Locator]:
            page = stack.enter_context(opened(browser, f"{service.url}/", may_fail=("status of 412", "status of 404")))
            planned(page)
            page.get_by_role("tab", name="Request").click()
            return page, page.get_by_role("region", name=ON_SERVICE)

        yield open_page
    for one in service.client.get("/v1/projects").json()["projects"]:
        service.client.delete(f"/v1/projects/{one['name']}")


def test_a_project_on_the_service_is_opened_and_deleted_in_another_browser(
    open_anywhere: Callable[[], tuple[Page, Locator]], service: RunningService
) -> None:
    page, section = open_anywhere()
    first = shown_request(page)
    save(page, "Zelle 4: groß & neu?", ON_SERVICE)
    expect(section.get_by_role("listitem")).to_have_text(["Zelle 4: groß & neu?✕"])
    expect(page.get_by_role("region", name=IN_BROWSER).get_by_role("listitem")).to_have_count(0)
    [kept] = service.client.get("/v1/projects").json()["projects"]
    assert service.client.get(f"/v1/projects/{quote(kept['name'])}").json() == first
    save(page, "a/b", ON_SERVICE)
    assert section.get_by_label("Name of the project").evaluate("field => field.validity.patternMismatch")
    other, theirs = open_anywhere()
    use_request(other, json.dumps(TOO_SHORT))
    expect(other.locator("[data-waypoint]")).to_have_count(2)
    theirs.get_by_role("button", name=kept["name"], exact=True).click()
    expect(other.locator("[data-waypoint]")).to_have_count(6)
    assert shown_request(other) == first
    theirs.get_by_role("button", name=f"Delete {kept['name']}").click()
    expect(theirs.get_by_role("listitem")).to_have_count(0)
    section.get_by_role("button", name=kept["name"], exact=True).click()
    expect(section.get_by_role("alert")).to_contain_text("No project has this name")
    expect(section.get_by_role("listitem")).to_have_count(0)
    assert violations(page) == []


def test_two_browsers_do_not_overwrite_each_other_on_the_service(
    open_anywhere: Callable[[], tuple[Page, Locator]], service: RunningService
) -> None:
    page, section = open_anywhere()
    first = shown_request(page)
    save(page, "cell", ON_SERVICE)
    expect(section.get_by_role("listitem")).to_have_text(["cell✕"])
    other, theirs = open_anywhere()
    use_request(other, json.dumps(TOO_SHORT))
    expect(other.locator("[data-waypoint]")).to_have_count(2)
    save(other, "cell", ON_SERVICE)
    expect(theirs.get_by_role("alert")).to_contain_text("was changed elsewhere")
    assert service.client.get("/v1/projects/cell").json() == first
    theirs.get_by_role("button", name="Overwrite it").click()
    expect(theirs.get_by_role("alert")).to_have_count(0)
    assert service.client.get("/v1/projects/cell").json() == TOO_SHORT
    page.locator("[data-waypoint='1']").click()
    page.get_by_role("button", name="Duplicate").click()
    expect(page.locator("[data-waypoint]")).to_have_count(7)
    page.get_by_role("tab", name="Request").click()
    save(page, "cell", ON_SERVICE)
    expect(section.get_by_role("alert")).to_contain_text("was changed elsewhere")
    section.get_by_role("button", name="Open the other version").click()
    expect(page.locator("[data-waypoint]")).to_have_count(2)
    expect(section.get_by_role("alert")).to_have_count(0)
    service.client.delete("/v1/projects/cell")
    save(page, "cell", ON_SERVICE)  # it comes back
    wait_until(lambda: service.client.get("/v1/projects/cell").status_code == 200)
    page.wait_for_load_state("networkidle")
    expect(section.get_by_role("alert")).to_have_count(0)
    service.client.put("/v1/projects/cell", json={"no": "request"})
    section.get_by_role("button", name="cell", exact=True).click()
    expect(section.get_by_role("alert")).to_contain_text("This is no request")
    section.get_by_role("button", name="Delete cell").click()
    expect(section.get_by_role("alert")).to_contain_text("another state")  # than the listed one
    section.get_by_role("button", name="Delete cell").click()
    expect(section.get_by_role("listitem")).to_have_count(0)
