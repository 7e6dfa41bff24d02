"""Links to the state of the page: copied, opened, and malformed."""

from __future__ import annotations

import base64
import json
import zlib
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from tests.locations import ROOT
from web.tests.browser import WELDING, addressed, choose_example, opened, planned, seconds, shown_request
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser, Page

    from tests.api.conftest import RunningService

WITHOUT_CLIPBOARD = "Object.defineProperty(navigator, 'clipboard', {value: undefined});"
"""The page as browsers show it without https."""


GO = "(fragment) => { location.hash = fragment; }"


def fragment(request: Any) -> str:
    """Pack a request as the page does: raw deflate in URL-safe base64."""
    packing = zlib.compressobj(wbits=-zlib.MAX_WBITS)
    packed = packing.compress(json.dumps(request).encode()) + packing.flush()
    return "#r=" + base64.urlsafe_b64encode(packed).decode().rstrip("=")


def unpacked(url: str) -> Any:
    packed = url.partition("#r=")[2].partition("&")[0]
    return json.loads(zlib.decompress(base64.urlsafe_b64decode(packed + "=" * (-len(packed) % 4)), -zlib.MAX_WBITS))


def test_a_link_reproduces_what_is_seen(page: Page, browser: Browser) -> None:
    with addressed(page):
        choose_example(page, WELDING)
    with addressed(page):
        page.get_by_role("slider", name="Time").press("PageUp")
    shown = planned(page), seconds(page)
    with opened(browser, page.url) as other:
        assert planned(other).split(",")[:2] == shown[0].split(",")[:2]
        assert seconds(other) == shown[1]


@pytest.mark.parametrize("scripts", [(), (WITHOUT_CLIPBOARD,)], ids=["with a clipboard", "without https"])
def test_the_link_to_what_is_shown_is_copied(
    browser: Browser, service: RunningService, scripts: tuple[str, ...]
) -> None:
    """The link belongs to the current view, even before the address has followed."""
    with opened(browser, f"{service.url}/", scripts=scripts) as page:
        planned(page)
        page.locator("[data-waypoint='1']").click()
        page.get_by_label("Duration (s)").fill("9.33")
        page.keyboard.press("Tab")
        page.get_by_role("button", name="Copy link").click()
        expect(page.get_by_role("button", name="Link copied")).to_be_visible()
        page.locator(".header").evaluate(
            """(header) => {
                const field = Object.assign(document.createElement('textarea'), {id: 'pasted'});
                header.append(field);
                field.focus();
            }"""
        )
        page.keyboard.press("Control+v")
        link = page.locator("#pasted").input_value()
        assert unpacked(link)["waypoints"][1]["duration"] == 9.33


def test_a_link_that_cannot_be_copied_is_shown_selected(browser: Browser, service: RunningService) -> None:
    scripts = (WITHOUT_CLIPBOARD, "document.execCommand = () => false;")
    with opened(browser, f"{service.url}/", scripts=scripts) as page:
        planned(page)
        page.get_by_role("button", name="Copy link").click()
        banner = page.get_by_role("alert").filter(has_text="Press Ctrl+C")
        field = banner.get_by_role("textbox", name="Link to what is shown")
        selected = field.evaluate("(field) => field.value.slice(field.selectionStart, field.selectionEnd)")
        assert unpacked(selected) == shown_request(page)
        assert violations(page) == []
        banner.get_by_role("button", name="Close").click()
        expect(banner).to_have_count(0)


SENTENCES: dict[str, Any] = {
    "/waypoints must be a list of at least 1 and at most 1000; got null": {"robot": "fr3", "waypoints": None},
    "/waypoints/0 must be an object; got null": {"robot": "fr3", "waypoints": [None]},
    "/waypoints must be a list of at least 1 and at most 1000; got []": {"robot": "fr3", "waypoints": []},
    "/robot must be the id of a robot; got nothing": {"waypoints": [{"kind": "named", "name": "home"}]},
    "the request must be an object; got [1,2]": [1, 2],
}
"""Messages of the page about malformed requests."""


def test_a_malformed_link_is_said_in_a_sentence(browser: Browser, service: RunningService) -> None:
    """At first the first example is shown instead; later the view stays."""
    banner = "The link cannot be shown"
    with opened(browser, f"{service.url}/{fragment([None])}") as page:
        expect(page.get_by_role("alert").filter(has_text=banner)).to_contain_text("the request must be an object")
        assert "25.29 s" in planned(page)
        shown = shown_request(page)
        for sentence, request in SENTENCES.items():
            page.evaluate(GO, fragment(request))
            expect(page.get_by_role("alert").filter(has_text=banner)).to_contain_text(sentence)
        whole = fragment(json.loads((ROOT / "examples/welding.json").read_text()))
        page.evaluate(GO, whole[: len(whole) // 2])
        expect(page.get_by_role("alert").filter(has_text="cut off or changed")).to_be_visible()
        assert violations(page) == []
        assert shown_request(page) == shown


def mutants() -> Iterator[Any]:
    """Yield malformed requests: a field of a waypoint, or of the whole, is something else."""
    request = json.loads((ROOT / "examples/slow_beside_a_walkway.json").read_text())
    for value in (None, [None], {"kind": "word"}, 5):
        for name in ("scene", "speed_zones", "limits"):
            yield request | {name: value}
    for name in ("position", "duration", "tool", "name", "motion", "attach"):
        yield request | {"waypoints": [request["waypoints"][0], request["waypoints"][1] | {name: [None]}]}


DEALT_WITH = """(request) => {
  const normal = (text) => JSON.stringify(JSON.parse(text));
  const said = [...document.querySelectorAll('.banner')].some(({ textContent }) => textContent.includes(' must be '));
  return said || normal(document.querySelector('#request-json').value) === normal(request);
}"""
"""Whether the page shows a request, or a sentence about it."""


def test_no_malformed_link_makes_the_page_throw(page: Page) -> None:
    """Each is shown, with a refusal by the service, or said in a sentence."""
    page.get_by_role("tab", name="Request").click()
    banner = page.locator(".banner")
    for mutant in mutants():
        if banner.count() > 0:
            banner.get_by_role("button", name="Close").click()
        page.evaluate(GO, fragment(mutant))
        page.wait_for_function(DEALT_WITH, arg=json.dumps(mutant))


def test_a_link_that_unpacks_to_very_much_is_refused(page: Page) -> None:
    """Each of its 20 kB unpacks to a thousand times as much."""
    shown = shown_request(page)
    page.evaluate(GO, fragment(shown | {"name": "x" * 20_000_000}))
    expect(page.get_by_role("alert")).to_contain_text("its request has more than 16 MB")
    assert shown_request(page) == shown
