"""The page under conditions: for everyone, in the dark, on a phone, behind a proxy, on a slow network, fast."""

from __future__ import annotations

import json
import re
import threading
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import combinations
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from playwright.sync_api import expect
from typing_extensions import override

from tests.locations import ROOT
from web.tests.browser import (
    FRAMES,
    PHONE,
    TOO_SHORT,
    WELDING,
    choose_example,
    click_example,
    drawn,
    leave_unanswered,
    opened,
    planned,
    plays,
    use_request,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from playwright.sync_api import Browser, Page, Route

    from tests.api.conftest import RunningService

AXE = (ROOT / "web/node_modules/axe-core/axe.min.js").read_text(encoding="utf-8")
MOST_BYTES = 350_000, 600_000  # compressed, without three and with it


FIRST_VIEW_SEEN = """() => new Promise((seen) => {
  const look = (list) => list.getEntriesByName("first-contentful-paint").forEach((paint) => seen(paint.startTime));
  new PerformanceObserver(look).observe({type: "paint", buffered: true});
})"""
"""Waits for the first view, and gives when it came, ms: a busy machine may show it after the plan has come."""

FRAMES_DRAWN = """() => new Promise((enough) => {
  const began = performance.now();
  let frames = 0;
  const next = () => {
    frames += 1;
    if (frames >= 20 && performance.now() > began + 3000) enough(frames);
    else requestAnimationFrame(next);
  };
  requestAnimationFrame(next);
  setTimeout(() => enough(frames), 60000);
})"""
"""Counts frames for 3 s, and on a busy machine until there are twenty."""


CHANGES_A_FRAME = """() => new Promise((done) => {
  let [frames, changes] = [0, 0];
  const watch = new MutationObserver((seen) => { changes += seen.length; });
  watch.observe(document.body, {subtree: true, childList: true, attributes: true, characterData: true});
  const next = () => {
    frames += 1;
    if (frames < 10) requestAnimationFrame(next);
    else { watch.disconnect(); done(changes / frames); }
  };
  requestAnimationFrame(next);
})"""
"""Counts the changes of the document in a frame, in the mean of ten."""


def violations(page: Page) -> list[str]:
    page.evaluate(AXE)
    found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")["violations"]
    return [f"{rule['id']}: {[node['html'][:120] for node in rule['nodes']]}" for rule in found]


def long_request() -> dict[str, Any]:
    """Return 300 waypoints with 6 joints in about 20,000 samples."""
    positions = [[0.5 * ((i * j) % 7 - 3) / 3 for j in range(1, 7)] for i in range(300)]
    first, *rest = ({"kind": "joint", "position": position} for position in positions)
    waypoints = [first, *(waypoint | {"duration": 1.0} for waypoint in rest)]
    return {"robot": "ngv_refuelling_arm", "waypoints": waypoints, "sample_period": 0.015}


def bundle() -> tuple[int, int]:
    """Return the bytes of the page's files, compressed, without the files of three and with them."""
    files = {file.name: file.stat().st_size for file in (ROOT / "api/built_page/assets").glob("*.gz")}
    three = sum(size for name, size in files.items() if name.startswith(("stage-", "objects-", "three")))
    return sum(files.values()) - three, sum(files.values())


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_violation(browser: Browser, service: RunningService, scheme: str) -> None:
    with opened(browser, f"{service.url}/", color_scheme=scheme) as page:
        planned(page)
        page.locator(".plot canvas").first.wait_for()
        assert violations(page) == []
        for tab in ("Compare", "Exports", "Request", "Robot"):
            page.get_by_role("tab", name=tab).click()
            assert violations(page) == []
        use_request(page, json.dumps(TOO_SHORT))
        page.get_by_role("alert", name="Refusal").wait_for()
        assert violations(page) == []
        page.get_by_role("tab", name="Certificate").click()
        choose_example(page, "features/around_a_wall")
        assert violations(page) == []


def test_a_phone_shows_all_without_scrolling_sideways(browser: Browser, service: RunningService) -> None:
    with opened(browser, f"{service.url}/", viewport=PHONE, has_touch=True) as page:
        planned(page)
        for selector in (".stage canvas", ".timeline", ".plots", "#waypoints", ".result"):
            box = page.locator(selector).first.bounding_box()
            assert box is not None
            assert 0.0 <= box["x"] <= box["x"] + box["width"] <= PHONE["width"]
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        assert violations(page) == []
        choose_example(page, "features/slow_beside_a_walkway")
        nearest, colours = (page.locator(f".stage .{name}").bounding_box() for name in ("nearest-note", "colour-key"))
        assert nearest is not None
        assert colours is not None
        assert nearest["y"] + nearest["height"] <= colours["y"]
        assert 0.0 <= nearest["x"] <= nearest["x"] + nearest["width"] <= PHONE["width"]


def test_the_notes_of_the_stage_do_not_cover_each_other_in_german(browser: Browser, service: RunningService) -> None:
    with opened(browser, f"{service.url}/", viewport={"width": 1360, "height": 850}) as page:
        planned(page)
        click_example(page, "cells/handover")
        expect(page.get_by_role("heading", name="Robots of the cell")).to_be_visible()
        page.get_by_role("button", name="Deutsch").click()  # at once, and so before the example is in the address
        expect(page.locator(".nearest-note")).to_contain_text("am nächsten")
        nearest, colours = (page.locator(f".stage .{name}").bounding_box() for name in ("nearest-note", "colour-key"))
        assert nearest is not None
        assert colours is not None
        assert nearest["y"] + nearest["height"] <= colours["y"] or colours["x"] + colours["width"] <= nearest["x"]


EXTENTS = """() => ['#waypoints', '.middle', '.result'].map((selector) => {
  const parts = [...document.querySelectorAll(`${selector}, ${selector} *`)];
  const boxes = parts.map((part) => part.getBoundingClientRect()).filter((box) => box.width > 1 && box.height > 1);
  const ends = (side, most) => most(...boxes.map((box) => box[side]));
  return [ends('left', Math.min), ends('top', Math.min), ends('right', Math.max), ends('bottom', Math.max)];
})"""
"""The left, top, right and bottom ends of the waypoints, the motion and the result, with all that is in them."""


def test_no_part_lies_over_another_at_any_width(browser: Browser, service: RunningService) -> None:
    """From 1200 px on the parts scroll by themselves, beside each other; below, they stand as high as they are."""
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        for width in (390, 760, 1099, 1199, 1200, 1600):
            page.set_viewport_size({"width": width, "height": 800})
            page.locator(".plot canvas").first.wait_for()
            drawn(page)
            extents = page.evaluate(EXTENTS)
            for first, second in combinations(extents, 2):
                beside = first[2] <= second[0] + 1.0 or second[2] <= first[0] + 1.0
                above = first[3] <= second[1] + 1.0 or second[3] <= first[1] + 1.0
                assert beside or above, (width, extents)
            assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.fixture
def behind_a_proxy(service: RunningService) -> Iterator[str]:
    """The service under a prefix, as a proxy shows it."""

    class Proxy(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.forward()

        def do_POST(self) -> None:
            self.forward()

        def forward(self) -> None:
            assert self.path.startswith("/planner/"), self.path
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            headers = {"Content-Type": self.headers.get("Content-Type", "application/json")}
            url = f"{service.url}{self.path.removeprefix('/planner')}"
            answer = httpx.request(self.command, url, content=body, headers=headers, trust_env=False, timeout=60.0)
            self.send_response(answer.status_code)
            for name in ("content-type", "content-security-policy"):
                if name in answer.headers:
                    self.send_header(name, answer.headers[name])
            self.send_header("Content-Length", str(len(answer.content)))
            with suppress(ConnectionError):  # the page has given up a request for a newer one
                self.end_headers()
                self.wfile.write(answer.content)

        @override
        def log_message(self, format: str, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Proxy)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/planner/"
    server.shutdown()
    server.server_close()


def test_it_works_under_a_prefix(browser: Browser, behind_a_proxy: str) -> None:
    with opened(browser, behind_a_proxy) as page:
        assert "25.29 s" in planned(page)
        choose_example(page, WELDING)


def test_on_a_slow_network_the_last_edit_wins(page: Page) -> None:
    def slowly(route: Route) -> None:
        page.wait_for_timeout(1000)
        route.continue_()

    page.route("**/v1/trajectories", slowly)
    page.locator("[data-waypoint='1']").click()
    for duration in ("10", "12"):
        page.get_by_label("Duration (s)").fill(duration)
        page.keyboard.press("Tab")
        page.wait_for_timeout(400)
    expect(page.locator(".verdict:not(.stale)")).to_contain_text("29.96 s")  # 25.29 - 7.33 + 12


def test_the_theme_is_switched_and_kept(browser: Browser, service: RunningService) -> None:
    """The system decides at first; a choice stays when the page is loaded again."""
    with opened(browser, f"{service.url}/", color_scheme="light") as page:
        planned(page)
        page.locator(".plot canvas").first.wait_for()
        light = brightness(page)
        page.get_by_role("button", name="Dark or light").click()
        dark = brightness(page)
        assert dark < 80.0 < 175.0 < light
        assert violations(page) == []
        page.reload()
        planned(page)
        assert brightness(page) == dark
        page.get_by_role("button", name="Dark or light").click()
        assert brightness(page) == light


def brightness(page: Page) -> float:
    """Return the mean of red, green and blue of the background."""
    colour = page.evaluate("getComputedStyle(document.body).backgroundColor")
    red, green, blue = (float(value) for value in re.findall(r"[\d.]+", colour)[:3])
    return (red + green + blue) / 3.0


def test_the_first_key_leads_past_the_header(page: Page) -> None:
    page.wait_for_url("**/#r=*")
    address = page.url
    page.keyboard.press("Tab")
    link = page.get_by_role("link", name="Skip to the waypoints")
    expect(link).to_be_focused()
    expect(link).to_be_in_viewport()
    page.keyboard.press("Enter")
    expect(page.locator("#waypoints")).to_be_focused()
    page.keyboard.press("Tab")
    expect(page.get_by_role("button", name="+ Add")).to_be_focused()
    assert page.url == address  # it holds the request


def test_the_first_view_waits_for_no_answer(browser: Browser, service: RunningService) -> None:
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        page.route("**/v1/**", leave_unanswered)
        page.reload()
        assert page.evaluate(FIRST_VIEW_SEEN) > 0.0
        expect(page.get_by_role("heading", name="Trajectory planner")).to_be_visible()
        expect(page.locator("[data-waypoint]")).to_have_count(6)
        expect(page.locator(".stage canvas")).to_be_visible()


def test_playing_leaves_the_lists_as_they_are(browser: Browser, service: RunningService) -> None:
    """A frame changes the time and the sliders, not one row for each of 300 waypoints."""
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        use_request(page, json.dumps(long_request()))
        expect(page.locator("[data-waypoint]")).to_have_count(300)
        expect(page.locator(".verdict:not(.stale)")).to_contain_text("299.0")
        page.get_by_role("button", name="Play").click()
        for tab in ("Certificate", "Robot"):
            page.get_by_role("tab", name=tab).click()
            page.evaluate(FRAMES)
            assert 1.0 <= page.evaluate(CHANGES_A_FRAME) < 60.0, tab


def test_a_report_opens_from_disk_and_plays(browser: Browser, service: RunningService, tmp_path: Path) -> None:
    request = json.loads((ROOT / "examples/welding.json").read_text())
    report = tmp_path / "report.html"
    report.write_bytes(service.post("/v1/trajectories?format=html", request).content)
    with opened(browser, report.as_uri()) as page:
        expect(page.locator(".verdict")).to_contain_text("Every enforced limit is kept")
        expect(page.locator(".wide-table tbody tr")).to_have_count(11)
        page.get_by_role("button", name="Play").click()
        plays(page)
        assert violations(page) == []
        for button, part in (("Whole window", ".stage"), ("Enlarge plots", ".plots")):
            page.get_by_role("button", name=button).click()
            box = page.locator(part).bounding_box()
            assert box is not None
            assert (box["x"], box["width"]) == (0.0, page.evaluate("innerWidth"))
            page.keyboard.press("Escape")
        page.set_viewport_size({"width": 390, "height": 800})
        expect(page.locator("html")).to_have_js_property("scrollWidth", 390)  # once the plots are drawn anew


@pytest.mark.parametrize("takes", [True, False])
def test_a_report_shows_what_is_carried(browser: Browser, service: RunningService, tmp_path: Path, takes: bool) -> None:
    """The arm ends at its start, so that only the object put down changes the picture."""
    request = json.loads((ROOT / "examples/pick_and_place_dates.json").read_text())
    text = service.post("/v1/trajectories?format=html", request).text
    if not takes:
        text = text.replace('"attach":[{"id":"date"}]', '"attach":[]').replace('"detach":["date"]', '"detach":[]')
    report = tmp_path / "report.html"
    report.write_text(text)
    with opened(browser, report.as_uri()) as page:
        pictures = []
        for key in ("Home", "End"):
            page.get_by_role("slider", name="Time").press(key)
            drawn(page)
            pictures.append(page.evaluate("document.querySelector('.stage canvas').toDataURL()"))
    assert (pictures[0] != pictures[1]) == takes


def test_the_page_is_small() -> None:
    without, whole = bundle()
    print(f"{without} bytes compressed without three, {whole} with it")
    assert 0 < without < MOST_BYTES[0]
    assert without < whole < MOST_BYTES[1]


def test_the_first_view_loads_nothing_of_three() -> None:
    """Static imports of the entry come with the first view; later loads do not."""
    built = ROOT / "api/built_page"
    waiting = re.findall(r'<script[^>]* src="\./(assets/[^"]+)"', (built / "index.html").read_text())
    assert len(waiting) == 1
    loaded: set[str] = set()
    while waiting:
        name = waiting.pop()
        text = (built / name).read_text()
        assert "isMatrix4" not in text, name
        loaded.add(name)
        imported = {f"assets/{file}" for file in re.findall(r'(?:from|import)"\./([^"]+)"', text)}
        waiting += imported - loaded
    others = (built / "assets").glob("*.js")
    assert any("isMatrix4" in file.read_text() for file in others)  # it is a name of three that minifying leaves
