"""The stage and the verdict on screens of all sizes."""

from __future__ import annotations

import json
import re

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.api.conftest import RunningService
from web.tests.browser import (
    ARM_PIXELS,
    TOO_SHORT,
    WELDING,
    choose_example,
    drawn,
    leave_unanswered,
    opened,
    planned,
    use_request,
)
from web.tests.test_conditions import violations

PATH_PIXELS_AT_EDGE = """() => {
  const stage = document.querySelector('.stage canvas');
  const copy = Object.assign(document.createElement('canvas'), { width: stage.width, height: stage.height });
  const context = copy.getContext('2d');
  context.drawImage(stage, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  const isVivid = (i) => Math.max(...data.slice(i, i + 3)) - Math.min(...data.slice(i, i + 3)) > 90;
  let count = 0;
  for (let x = 0; x < copy.width; x += 1) {
    for (const y of [0, copy.height - 1]) count += isVivid(4 * (y * copy.width + x)) ? 1 : 0;
  }
  for (let y = 0; y < copy.height; y += 1) {
    for (const x of [0, copy.width - 1]) count += isVivid(4 * (y * copy.width + x)) ? 1 : 0;
  }
  return count;
}"""
"""Counts the pixels at the edge of the stage that have the vivid colours of arm and path; the ground is grey."""


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (820, "dark"), (1280, "light"), (1440, "dark")])
def test_stage_and_plots_fill_the_window_and_shrink_again(
    browser: Browser, service: RunningService, width: int, scheme: str
) -> None:
    with opened(browser, f"{service.url}/", viewport={"width": width, "height": 844}, color_scheme=scheme) as page:
        planned(page)
        stage, timeline = page.locator(".stage"), page.get_by_role("region", name="Time line")
        before = stage.bounding_box()
        page.get_by_role("button", name="Whole window").click()
        drawn(page)
        whole, line = stage.bounding_box(), timeline.bounding_box()
        assert before is not None
        assert whole is not None
        assert line is not None
        assert whole["width"] == width
        assert whole["height"] + line["height"] == pytest.approx(844, abs=60)
        assert whole["width"] * whole["height"] > before["width"] * before["height"]
        page.wait_for_function(f"() => ({ARM_PIXELS})()[0] > 500")
        assert violations(page) == []
        page.keyboard.press("Escape")
        drawn(page)
        assert stage.bounding_box() == before
        page.get_by_role("button", name="Enlarge plots").click()
        expect(stage).to_be_hidden()
        plots = [plot.bounding_box() for plot in page.locator(".plot canvas").all()]
        assert len(plots) == 2
        assert all(plot is not None and 190 < plot["height"] < 844 for plot in plots)
        assert violations(page) == []
        page.keyboard.press("Escape")
        drawn(page)
        after = stage.bounding_box()
        assert after is not None
        assert (after["width"], after["height"]) == (before["width"], before["height"])


def test_a_plan_that_takes_long_is_cancelled(page: Page) -> None:
    planned(page)
    page.route("**/v1/trajectories", leave_unanswered)
    page.get_by_role("button", name="Plan", exact=True).click()
    expect(page.locator(".verdict")).to_have_class(re.compile("stale"))
    cancel = page.get_by_role("button", name="Cancel planning")
    expect(page.locator(".waiting")).to_contain_text("Planning for 2 s")
    assert violations(page) == []
    with page.expect_event("requestfailed") as failed:
        cancel.click()
    assert failed.value.url.endswith("/v1/trajectories")
    expect(cancel).to_have_count(0)
    expect(page.locator("p[role=status]")).to_have_text("Planning cancelled")
    page.unroute("**/v1/trajectories")
    page.get_by_role("button", name="Plan", exact=True).click()
    assert "Certified" in planned(page)


HEIGHTS = """
window.heights = [];
const look = () => {
  const stage = document.querySelector('.stage');
  if (stage && document.querySelector('.verdict')) window.heights.push(stage.offsetHeight);
  requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""
"""Notes the height of the stage in each frame from the verdict on."""


@pytest.mark.parametrize("width", [390, 820, 1280])
def test_the_stage_keeps_its_height_once_the_verdict_is_shown(
    browser: Browser, service: RunningService, width: int
) -> None:
    with opened(browser, f"{service.url}/", scripts=(HEIGHTS,), viewport={"width": width, "height": 844}) as page:
        planned(page)
        page.locator(".plot canvas").first.wait_for()
        page.wait_for_function("() => window.heights.length > 20")
        assert len(set(page.evaluate("window.heights"))) == 1


def test_a_long_form_does_not_stretch_the_stage_beside_it(browser: Browser, service: RunningService) -> None:
    with opened(browser, f"{service.url}/", viewport={"width": 820, "height": 844}) as page:
        planned(page)
        page.get_by_text("Fields of the whole request").click()
        page.locator(".more-fields").wait_for()
        assert page.locator("#waypoints").evaluate("it => it.offsetHeight") > 844
        assert page.locator(".stage").evaluate("it => it.offsetHeight") < 0.5 * 844


@pytest.mark.parametrize("width", [390, 820])
def test_a_narrow_screen_shows_the_verdict_first(browser: Browser, service: RunningService, width: int) -> None:
    """The line above the stage leads to the result."""
    with opened(browser, f"{service.url}/", viewport={"width": width, "height": 844}) as page:
        planned(page)
        line = page.locator(".verdict-line")
        expect(line).to_have_text("✓ Certified, 25.29 s")
        expect(line).to_be_in_viewport(ratio=1.0)
        expect(page.locator(".verdict")).not_to_be_in_viewport()
        line.click()
        expect(page.locator(".verdict")).to_be_in_viewport()
        use_request(page, json.dumps(TOO_SHORT))
        page.get_by_role("alert", name="Refusal").wait_for()
        expect(line).to_contain_text("✕")
        assert violations(page) == []


def test_a_path_that_leaves_the_view_is_framed(browser: Browser, service: RunningService) -> None:
    """The second path is a metre longer than the first, to which the view was fitted; the arm stays in view, too."""
    position = [0.0, -0.3, 2.2, 0.0, 0.5, 0.0]
    near = {"kind": "joint", "position": position}
    short = {"robot": "kuka_kr16_2", "waypoints": [near, near | {"position": [0.1, *position[1:]]}]}
    far = [[turn, -0.1, 0.0, 0.0, 0.0, 0.0] for turn in (0.0, 1.5, 3.0, -1.5)]
    wide = {"robot": "kuka_kr16_2", "waypoints": [near, *(near | {"position": one} for one in far)]}
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        for request in (short, wide):
            use_request(page, json.dumps(request))
            expect(page.locator("[data-waypoint]")).to_have_count(len(request["waypoints"]))
            expect(page.locator("[data-waypoint='1'] .when")).to_contain_text("s")
            planned(page)
            drawn(page)
            assert page.evaluate(ARM_PIXELS)[0] > 500
            assert page.evaluate(PATH_PIXELS_AT_EDGE) == 0
        choose_example(page, WELDING)
        for waypoint in (4, 9):
            page.locator(f"[data-waypoint='{waypoint}']").click()
            drawn(page)
            assert page.evaluate(ARM_PIXELS)[0] > 500
            assert page.evaluate(PATH_PIXELS_AT_EDGE) == 0
