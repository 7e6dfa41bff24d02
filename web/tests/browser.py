"""A page in Debian's Chromium, which fails its test on any message of the console and any request to elsewhere."""

from __future__ import annotations

import json
import re
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from playwright.sync_api import expect

from tests.locations import ROOT

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser, Page, Playwright, Response, Route

CHROMIUM = "/usr/bin/chromium"
REBOUND_NAME = "hostile.example"
"""A name that its owner has pointed at the loopback address (DNS rebinding)."""
ARGUMENTS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    f"--host-resolver-rules=MAP {REBOUND_NAME} 127.0.0.1",
]
DESKTOP = {"width": 1440, "height": 900}
PHONE = {"width": 390, "height": 844}
REFUSED = "Failed to load resource: the server responded with a status of 422"
"""Chromium's own message where the service refuses a plan, which no page can avoid."""
GRAPHICS = "GPU stall due to ReadPixels"
"""Chromium's remark on saving a picture where the processor draws."""

WELDING = "documents/welding"
GROUPS = {
    "documents": "Published works",
    "jobs": "Everyday jobs",
    "features": "What can be asked",
    "cells": "Several robots",
    "tasks": "Tasks in any order",
}
"""The groups of the menu of examples."""
TOO_SHORT = {
    "robot": "kuka_kr16_2",
    "waypoints": [
        {"kind": "joint", "position": [0.0, -1.5, 1.5, 0.0, 0.5, 0.0]},
        {"kind": "joint", "position": [1.0, -1.2, 1.2, 0.0, 0.5, 0.5], "duration": 0.5},
    ],
}

PATIENCE = 90_000
"""The timeout of waits and expectations, ms; generous, because the machine may be busy."""

FRAMES = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""Waits for two frames: the stage draws in the next one."""

CHANGED = """(least) => {
  const stage = document.querySelector('.stage canvas');
  const copy = Object.assign(document.createElement('canvas'), { width: stage.width, height: stage.height });
  const context = copy.getContext('2d');
  context.drawImage(stage, 0, 0);
  const [before, { data }] = [window.before, context.getImageData(0, 0, copy.width, copy.height)];
  const changes = before ? data.reduce((count, value, i) => count + (Math.abs(value - before[i]) > 40 ? 1 : 0), 0) : -1;
  if (changes < 0 || changes >= least) window.before = data;
  return changes;
}"""
"""Counts the colours of the stage that differ from the kept ones; stores them at first and after enough changes."""


ARM_PIXELS = """() => {
  const stage = document.querySelector('.stage canvas');
  const copy = Object.assign(document.createElement('canvas'), { width: stage.width, height: stage.height });
  const context = copy.getContext('2d');
  context.drawImage(stage, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let [count, left, top, right, bottom] = [0, Infinity, Infinity, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    const [red, green, blue, alpha] = data.slice(i, i + 4);
    if (alpha < 200 || red < 150 || red < green + 40 || green < blue + 40) continue;
    const [x, y] = [(i / 4) % copy.width, Math.floor(i / 4 / copy.width)];
    [left, top, right, bottom] = [Math.min(left, x), Math.min(top, y), Math.max(right, x), Math.max(bottom, y)];
    count += 1;
  }
  return [count, count > 0 ? Math.hypot(right - left, bottom - top) : 0];
}"""
"""Counts the pixels of the stage in the colour of an arm, and measures the diagonal of the box around them."""


def launched(playwright: Playwright) -> Browser:
    return playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)


@contextmanager
def opened(
    browser: Browser, url: str, may_fail: tuple[str, ...] = (), scripts: tuple[str, ...] = (), **options: Any
) -> Iterator[Page]:
    """Open the page; at the end, only messages of `may_fail` and no requests to other hosts are allowed.

    `scripts` run before the scripts of the page.
    """
    said: list[str] = []
    asked: set[str] = set()
    context = browser.new_context(viewport=options.pop("viewport", DESKTOP), **options)
    context.grant_permissions(["clipboard-read", "clipboard-write"])
    for script in scripts:
        context.add_init_script(script)
    context.set_default_timeout(PATIENCE)
    page = context.new_page()
    page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: said.append(f"error: {error}"))
    page.on("request", lambda request: asked.add(urlsplit(request.url).netloc))
    page.goto(url)
    try:
        yield page
    finally:
        context.close()
    expected = (REFUSED, GRAPHICS, *may_fail)
    unexpected = [text for text in said if not any(part in text for part in expected)]
    assert not unexpected, unexpected
    assert asked <= {urlsplit(url).netloc, ""}


def leave_unanswered(route: Route) -> None:
    """Hold a request as a service does that takes its time."""


def planned(page: Page) -> str:
    """Wait for a plan of the shown request; return the status text of the page."""
    page.locator(".verdict:not(.stale)").wait_for()
    verdict: str = page.locator(".verdict").inner_text()
    return verdict


def choose_example(page: Page, name: str) -> None:
    """Choose an example by its group and name, and wait for its plan: the previous one may stay until then."""
    group, _, file = name.rpartition("/")
    folder = ROOT / "examples" / ("jobs" if group == "jobs" else "")
    waypoints = json.loads((folder / f"{file}.json").read_text())["waypoints"]

    def is_its_plan(answer: Response) -> bool:
        if not (urlsplit(answer.url).path.endswith("/v1/trajectories") and answer.ok):
            return False
        asked = answer.request.post_data_json
        return asked is not None and asked["waypoints"] == waypoints

    with page.expect_response(is_its_plan):
        click_example(page, name)
    planned(page)


def click_example(page: Page, name: str) -> None:
    group, _, file = name.rpartition("/")
    page.get_by_role("button", name="Examples").click()
    menu = page.get_by_role("menu", name="Examples").get_by_role("group", name=GROUPS[group])
    menu.get_by_role("menuitem", name=file.replace("_", " "), exact=True).click()


def add_waypoint(page: Page, name: str) -> None:
    page.get_by_role("button", name="+ Add").click()
    page.get_by_role("menuitem", name=name).click()


def shown_request(page: Page) -> dict[str, Any]:
    """Return the request that the page shows."""
    page.get_by_role("tab", name="Request").click()
    request: dict[str, Any] = json.loads(page.get_by_label("The request as JSON").input_value())
    return request


def use_request(page: Page, text: str) -> None:
    page.get_by_role("tab", name="Request").click()
    page.get_by_label("The request as JSON").fill(text)
    page.get_by_role("button", name="Use this request").click()


def seconds(page: Page) -> float:
    """Return the time that is shown, s."""
    return float(page.locator("output.time").inner_text().split(" ")[0])


def plays(page: Page) -> None:
    """Wait until the time that is shown is more than a fifth of a second."""
    expect(page.locator("output.time")).to_have_text(re.compile(r"^(0\.[2-9]|[1-9])"))


@contextmanager
def addressed(page: Page) -> Iterator[None]:
    """Wait until the address has the change that is made inside: it follows a moment later."""
    page.wait_for_url("**/#r=*")
    before = page.url
    yield
    page.wait_for_url(lambda url: url != before)


def drawn(page: Page) -> None:
    """Wait until the stage shows the change, which takes longer on a busy machine."""
    page.wait_for_timeout(300)
    page.evaluate(FRAMES)


def changed_colours(page: Page) -> int:
    """Count the colours of the stage that differ from the kept ones, and keep the new; -1: none kept."""
    drawn(page)
    return int(page.evaluate(CHANGED, 0))


def wait_for_change(page: Page, least: int) -> None:
    """Wait until so many colours of the stage differ from the kept ones, then keep the new ones."""
    page.wait_for_function(f"(least) => ({CHANGED})(least) >= least", arg=least)
