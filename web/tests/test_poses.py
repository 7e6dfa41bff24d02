"""Poses and tools on the page: dragged, solved, reached in one of many configurations, with the current tool."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from tests.locations import ROOT
from web.tests.browser import changed_colours, choose_example, drawn, opened, planned, use_request, wait_for_change
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Request

    from tests.api.conftest import RunningService

MARK = """() => {
  const stage = document.querySelector('.stage canvas');
  const copy = Object.assign(document.createElement('canvas'), { width: stage.width, height: stage.height });
  const context = copy.getContext('2d');
  context.drawImage(stage, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let [x, y, count] = [0, 0, 0];
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] < 230 || data[i + 1] > 40 || data[i + 2] > 40) continue;
    [x, y, count] = [x + ((i / 4) % copy.width), y + Math.floor(i / 4 / copy.width), count + 1];
  }
  const box = stage.getBoundingClientRect();
  const scale = box.width / stage.width;
  return [box.left + (scale * x) / count, box.top + (scale * y) / count];
}"""
"""The middle of the handles on the screen, by their red arrows: nothing else is as red."""


def test_a_pose_is_dragged_and_asked_about_on_the_way(page: Page) -> None:
    """The handle in the middle moves the pose along the screen."""
    page.locator("[data-waypoint='4']").click()
    page.get_by_role("slider", name="Time").press("Home")
    drawn(page)
    fields = [page.get_by_label(name, exact=True) for name in "xyz"]
    before = [float(field.input_value()) for field in fields]
    x, y = page.evaluate(MARK)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 12, y + 6, steps=6)
    expect(page.locator(".reach-note")).to_contain_text(re.compile(r"reached in \d+ way|out of reach"))
    page.mouse.up()
    expect(page.locator(".reach-note")).to_have_count(0)
    after = [float(field.input_value()) for field in fields]
    assert 1.0 < math.dist(before, after) < 500.0
    page.get_by_role("button", name="Undo").click()
    assert [float(field.input_value()) for field in fields] == before


def test_a_configuration_is_chosen_and_undone(page: Page) -> None:
    """Each solution is another joint position; the chosen one is planned, by its names."""
    page.locator("[data-waypoint='4']").click()
    when = page.locator("[data-waypoint='4'] .when")
    before = when.inner_text()
    editor = page.get_by_role("form", name="The chosen waypoint")
    editor.get_by_role("button", name="Choose the configuration").click()
    ways = editor.get_by_role("button", name=re.compile(r"^\d+ of \d+,"))
    expect(ways.first).to_be_focused()
    assert ways.count() == int(re.findall(r"of (\d+)", before)[0])
    ways.nth(1).hover()
    ways.nth(1).focus()
    page.mouse.move(5, 5)
    expect(page.locator(".reach-note.reached")).to_be_visible()
    ways.nth(1).click()
    leave = editor.get_by_role("button", name="Leave the configuration to the planner")
    expect(leave).to_be_visible()
    expect(ways).to_have_count(0)
    expect(leave).to_be_focused()
    page.get_by_role("button", name="Undo").click()
    expect(leave).to_have_count(0)
    expect(when).to_contain_text(before.splitlines()[-1])


REDUNDANT = {
    "robot": "fr3",
    "waypoints": [
        {"kind": "joint", "position": [0.1, 0.4, 0.2, -1.8, 0.3, 1.9, 0.4]},
        {
            "kind": "pose",
            "pose": {"position": [0.45, 0.1, 0.45], "orientation": {"kind": "rpy", "rpy": [3.14159265, 0.0, 0.3]}},
        },
    ],
}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_ways_of_a_redundant_robot_are_chosen_by_keys(
    browser: Browser, service: RunningService, scheme: str
) -> None:
    """The list is no higher than a part of the window and one stop of the tab key; the chosen entry is applied."""
    with opened(browser, f"{service.url}/", color_scheme=scheme) as page:
        planned(page)
        use_request(page, json.dumps(REDUNDANT))
        page.locator("[data-waypoint='1'] .when", has_text="s").wait_for()
        page.locator("[data-waypoint='1']").click()
        page.get_by_role("button", name="Choose the configuration").press("Enter")
        ways = page.get_by_role("list", name="ways to reach the pose")
        buttons = ways.get_by_role("button")
        expect(buttons.first).to_be_focused()
        expect(ways.locator("[aria-current=true]")).to_have_count(1)  # where it is planned to stand
        count = buttons.count()
        assert count > 5
        height, whole = ways.evaluate("(list) => [list.clientHeight, list.scrollHeight]")
        assert whole > height <= 230
        assert ways.locator("[tabindex='0']").count() == 1
        assert violations(page) == []
        page.keyboard.press("End")
        expect(buttons.last).to_be_focused()
        expect(buttons.last).to_be_in_viewport()
        page.keyboard.press("ArrowDown")  # there is none below
        page.keyboard.press("ArrowUp")
        expect(buttons.nth(count - 2)).to_be_focused()
        expect(page.locator(".reach-note")).to_have_text(f"reached in {count} ways")
        jointPosition = [
            float(value) for value in re.findall(r"-?[\d.]+", buttons.nth(count - 2).locator("small").inner_text())
        ]
        page.keyboard.press("Enter")
        expect(page.locator("[data-waypoint='1']")).to_be_focused()
        chosen = [float(field.input_value()) for field in page.locator(".joints input[type=number]").all()]
        assert chosen == pytest.approx(jointPosition, abs=0.06)


def test_the_robot_has_the_tool_that_is_in_force(page: Page) -> None:
    """It rests at the second waypoint from 0.750 to 0.950 s, and 10 ms later has moved by less than 0.1 mm."""
    choose_example(page, "features/two_tools")
    time = page.get_by_role("slider", name="Time")
    time.fill("0.80")
    changed_colours(page)
    time.fill("0.94")
    assert changed_colours(page) == 0
    time.fill("0.96")
    wait_for_change(page, 100)
    time.fill("0.965")
    assert changed_colours(page) < 20


def test_a_pose_is_dragged_with_the_tool_of_its_waypoint(page: Page, service: RunningService) -> None:
    request = json.loads((ROOT / "examples/two_tools.json").read_text())
    answer = service.post("/v1/trajectories", request).json()
    pose = answer["waypoints"][2]["pose"]
    gripped = request["waypoints"][2]
    request["waypoints"][2] = {
        "kind": "pose",
        "pose": pose,
        **{name: gripped[name] for name in ("name", "tool", "motion")},
    }
    use_request(page, json.dumps(request))
    expect(page.locator("[data-waypoint]")).to_have_count(4)
    assert "Certified" in planned(page)
    page.locator("[data-waypoint='2']").click()
    asked: list[Any] = []

    def keep(sent: Request) -> None:
        if sent.url.endswith("/inverse"):
            asked.append(sent.post_data_json)

    page.on("request", keep)
    page.get_by_role("button", name="Choose the configuration").click()
    page.get_by_role("list", name="to reach the pose").wait_for()
    drawn(page)
    x, y = page.evaluate(MARK)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 8, y + 4, steps=4)
    page.locator(".reach-note").wait_for()
    page.mouse.up()
    assert len(asked) >= 2
    assert all(body["tool"] == gripped["tool"] for body in asked)
