"""Measures the costs of the page and writes them into docs/page.md: `python -m web.tests.figures`."""

from __future__ import annotations

import json
import os
import re
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

from playwright.sync_api import expect, sync_playwright

from tests.api.conftest import running_service
from tests.locations import ROOT
from web.tests.browser import WELDING, choose_example, launched, opened, planned, use_request
from web.tests.test_conditions import FRAMES_DRAWN, bundle, long_request, violations

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Browser, CDPSession, Page

PAGE = ROOT / "docs/page.md"
SECTION = re.compile(r"(?<=\n## What it costs\n\n).*?(?=\n## )", re.DOTALL)
LOADS = 5
BLOCKING = 50.0  # ms: what a task takes longer is time in which nothing is answered

LOADED = """() => new Promise((done) => {
  const found = {lcp: 0, blocked: 0, shift: 0};
  const watch = (type, hear) => {
    new PerformanceObserver((list) => list.getEntries().forEach(hear)).observe({type, buffered: true});
  };
  watch('largest-contentful-paint', (entry) => { found.lcp = entry.startTime; });
  watch('longtask', (entry) => { found.blocked += Math.max(0, entry.duration - 50); });
  watch('layout-shift', (entry) => { if (!entry.hadRecentInput) found.shift += entry.value; });
  setTimeout(() => {
    const files = [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')];
    found.paint = performance.getEntriesByName('first-contentful-paint')[0].startTime;
    found.requests = files.length;
    found.bytes = files.reduce((sum, file) => sum + file.transferSize, 0);
    done(found);
  }, 500);
})"""
"""The figures of a load that has come to its end."""


class Interaction(NamedTuple):
    """What somebody does with the page."""

    what: str
    wall: float  # s, until it is seen
    busy: float  # s, of these the page's own process is at work


def loads(browser: Browser, url: str) -> dict[str, float]:
    """Load the page some times, each in a fresh profile; return the median of each figure."""
    found: list[dict[str, float]] = []
    for _ in range(LOADS):
        with opened(browser, url) as page:
            began = perf_counter()
            page.reload()
            planned(page)
            shown = 1e3 * (perf_counter() - began)
        with opened(browser, url) as page:
            planned(page)
            found.append(page.evaluate(LOADED) | {"planned": shown})
    return {name: median(one[name] for one in found) for name in found[0]}


def metric(client: CDPSession, name: str) -> float:
    metrics = client.send("Performance.getMetrics")["metrics"]
    return float(next(one["value"] for one in metrics if one["name"] == name))


def interactions(page: Page) -> tuple[list[Interaction], float]:
    """Do the heavy actions; return their times, longest first, and ms of scripting in a frame while playing."""
    planned(page)
    client = page.context.new_cdp_session(page)
    client.send("Performance.enable")
    done: list[Interaction] = []

    def timed(what: str, act: Callable[[], object]) -> None:
        busy, began = metric(client, "TaskDuration"), perf_counter()
        act()
        page.evaluate("() => new Promise((seen) => requestAnimationFrame(() => requestAnimationFrame(seen)))")
        done.append(Interaction(what, perf_counter() - began, metric(client, "TaskDuration") - busy))

    def compare() -> None:
        page.get_by_role("button", name="Compare all back ends").click()
        page.locator("table.compare").wait_for(timeout=60_000)

    def workspace() -> None:
        page.get_by_label("Show where the tool can be").check()
        page.get_by_role("region", name="Workspace").get_by_role("table").wait_for()

    def long_one() -> None:
        use_request(page, json.dumps(long_request()))
        expect(page.locator(".verdict:not(.stale)")).to_contain_text("299.0", timeout=60_000)

    def undo() -> None:
        page.get_by_role("button", name="Undo").click()
        expect(page.locator(".verdict:not(.stale)")).not_to_contain_text("299.0")

    timed("another example, with another robot", lambda: choose_example(page, WELDING))
    page.get_by_role("tab", name="Compare").click()
    timed("all back ends are compared, their paths drawn", compare)
    page.get_by_role("tab", name="Robot").click()
    timed("8000 points where the tool can be are shown", workspace)
    page.get_by_label("Show where the tool can be").uncheck()
    timed("300 waypoints are taken over, planned and drawn", long_one)
    page.get_by_role("tab", name="Certificate").click()
    page.get_by_role("button", name="Play").click()
    before = metric(client, "ScriptDuration")
    frames = int(page.evaluate(FRAMES_DRAWN))
    scripting = 1e3 * (metric(client, "ScriptDuration") - before) / frames
    page.get_by_role("button", name="Pause").click()
    timed("that is undone", undo)
    return sorted(done, key=lambda one: -one.busy), scripting


def section(browser: Browser, url: str) -> str:
    """Measure, and write the section of the page."""
    load = os.getloadavg()[0]
    loaded = loads(browser, url)
    with opened(browser, url) as page:
        heaviest, scripting = interactions(page)
    wrong = 0
    for scheme in ("light", "dark"):
        with opened(browser, url, color_scheme=scheme) as page:
            planned(page)
            wrong += len(violations(page))
    without, whole = bundle()
    rows = [
        ("first view (first contentful paint)", f"{loaded['paint']:.0f} ms"),
        ("largest contentful paint", f"{loaded['lcp']:.0f} ms"),
        ("the first plan is shown", f"{loaded['planned']:.0f} ms"),
        (f"total blocking time (the part of each task above {BLOCKING:g} ms)", f"{loaded['blocked']:.0f} ms"),
        ("cumulative layout shift", f"{loaded['shift']:.3f}"),
        (
            "requests, bytes on the wire until the plan is shown",
            f"{loaded['requests']:.0f}, {loaded['bytes'] / 1e3:.0f} kB",
        ),
        ("scripts and styles, gzip, without three and with it", f"{without / 1e3:.0f} kB, {whole / 1e3:.0f} kB"),
        ("scripting in a frame, playing 300 waypoints in 20,000 samples", f"{scripting:.2f} ms"),
        ("what axe finds (light and dark)", f"{wrong} violations"),
    ]
    lines = [
        f"Medians of {LOADS} loads, each in a fresh profile. Service and browser share {os.cpu_count()} processors",
        f"(no graphics card) with other work on the machine, whose load was {load:.1f} before.",
        "",
    ]
    lines += ["| | |", "|---|---|", *(f"| {what} | {figure} |" for what, figure in rows), ""]
    lines += [
        "The three interactions that keep the page's process busiest:",
        "",
        "| | until it is seen | busy |",
        "|---|---|---|",
    ]
    lines += [f"| {one.what} | {one.wall:.2f} s | {one.busy:.2f} s |" for one in heaviest[:3]]
    return "\n".join([*lines, "", "`python -m web.tests.figures` measures all of it.", ""])


def main() -> None:
    with (
        tempfile.TemporaryDirectory() as folder,
        running_service(Path(folder) / "log.jsonl") as service,
        sync_playwright() as playwright,
    ):
        written = section(launched(playwright), f"{service.url}/")
    print(written)
    PAGE.write_text(SECTION.sub(lambda _: written, PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
