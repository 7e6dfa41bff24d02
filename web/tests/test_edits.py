"""Edits on the page: the shown position is added, drafts and options stay with their waypoints."""

from __future__ import annotations

import json
import math
import re
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from tests.locations import ROOT
from web.tests.browser import (
    TOO_SHORT,
    WELDING,
    add_waypoint,
    choose_example,
    opened,
    planned,
    shown_request,
    use_request,
)
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.api.conftest import RunningService

TENTH_OF_A_DEGREE = math.radians(0.1)
"""The accuracy of the values beside the sliders, rad."""

FOCUS_AFTER_CLICK = """async (button) => {
  button.click();
  for (let i = 0; i < 10; i++) await null;
  return document.activeElement.textContent;
}"""
"""Clicks, and returns the text of the element with the focus before the browser paints or takes another key."""


def jogged(page: Page, joint: int, key: str) -> list[float]:
    """Move a joint by its slider; return the joint position that the page shows, rad or m."""
    page.get_by_role("tab", name="Robot").click()
    section = page.get_by_role("region", name="Joints by hand")
    section.get_by_role("slider").nth(joint).press(key)
    texts = section.locator("output").all_inner_texts()
    units = {"°": math.pi / 180.0, "mm": 1e-3}
    return [float(text.split()[0]) * units[text.split()[1]] for text in texts]


def pose_of(service: RunningService, robot: str, position: list[float], tool: Any = None) -> dict[str, Any]:
    answer = service.post("/v1/kinematics/forward", {"robot": robot, "positions": [position], "tool": tool})
    pose: dict[str, Any] = answer.json()["poses"][0]
    return pose


def same_pose(added: dict[str, Any], pose: dict[str, Any]) -> bool:
    """Return whether two poses are equal to the accuracy of the slider values, for an arm of 3 m."""
    quaternions = (added["orientation"]["xyzw"], pose["orientation"]["xyzw"])
    cosine = abs(sum(a * b for a, b in zip(*quaternions, strict=True)))
    return math.dist(added["position"], pose["position"]) < 0.01 and math.acos(min(1.0, cosine)) < 0.01


def test_the_pose_of_a_jogged_robot_is_added(page: Page, service: RunningService) -> None:
    """The time line stands at the first waypoint, which is elsewhere."""
    position = jogged(page, 0, "Home")
    add_waypoint(page, "Current pose")
    expect(page.locator("[data-waypoint]")).to_have_count(7)
    request = shown_request(page)
    added = request["waypoints"][1]["pose"]
    assert same_pose(added, pose_of(service, request["robot"], position))
    assert math.dist(added["position"], request["waypoints"][0]["pose"]["position"]) > 0.5


def test_the_pose_is_that_of_the_tool_in_force(page: Page, service: RunningService) -> None:
    """The waypoint that is chosen has brought another tool, which holds at the one behind it, too."""
    choose_example(page, "features/two_tools")
    page.locator("[data-waypoint='2']").click()
    position = jogged(page, 1, "ArrowRight")
    add_waypoint(page, "Current pose")
    expect(page.locator("[data-waypoint]")).to_have_count(5)
    request = shown_request(page)
    added = request["waypoints"][3]["pose"]
    tool = request["waypoints"][2]["tool"]
    assert same_pose(added, pose_of(service, request["robot"], position, tool))
    assert not same_pose(added, pose_of(service, request["robot"], position))


def test_a_pose_is_added_without_a_plan(page: Page, service: RunningService) -> None:
    use_request(page, json.dumps(TOO_SHORT))
    page.get_by_role("alert", name="Refusal").wait_for()
    page.locator("[data-waypoint='0']").click()
    position = jogged(page, 0, "End")
    add_waypoint(page, "Current pose")
    expect(page.locator("[data-waypoint]")).to_have_count(3)
    assert same_pose(shown_request(page)["waypoints"][1]["pose"], pose_of(service, "kuka_kr16_2", position))


def test_a_pose_on_a_rail_keeps_the_rail_where_it_is(browser: Browser, service: RunningService) -> None:
    body = json.loads((ROOT / "examples/robots/ur5e_on_rail.json").read_text())
    assert service.post("/v1/robots", body).status_code in (201, 409)
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        choose_example(page, "features/along_a_rail")
        joints = service.client.get("/v1/robots/ur5e_on_rail").json()["joint_names"]
        position = jogged(page, joints.index("rail"), "End")
        add_waypoint(page, "Current pose")
        expect(page.locator("[data-waypoint]")).to_have_count(5)
        added = shown_request(page)["waypoints"][1]
        assert added["external"]["rail"] == pytest.approx(position[joints.index("rail")], abs=1e-3)


def test_a_draft_belongs_to_its_request(page: Page) -> None:
    """A text with a mistake stays until it is mended, or another request is shown."""
    use_request(page, "{ a draft")
    expect(page.locator(".wrong-text")).to_be_visible()
    expect(page.get_by_label("The request as JSON")).to_have_value("{ a draft")
    choose_example(page, WELDING)
    example = json.loads((ROOT / "examples/welding.json").read_text())
    assert shown_request(page) == example
    expect(page.locator(".wrong-text")).to_have_count(0)


def backend_select(page: Page) -> Any:
    return page.get_by_label("Back end")


def test_each_back_end_keeps_its_options(page: Page) -> None:
    choose_example(page, "features/least_effort")
    before = shown_request(page)["backend"]
    assert before.keys() - {"kind"}
    backend_select(page).select_option("cubic")
    expect(page.locator(".verdict:not(.stale)")).to_contain_text("by cubic")
    backend_select(page).select_option(before["kind"])
    planned(page)
    assert shown_request(page)["backend"] == before


def test_the_options_of_one_request_do_not_reach_another(page: Page) -> None:
    choose_example(page, "features/least_effort")
    kind = shown_request(page)["backend"]["kind"]
    backend_select(page).select_option("cubic")
    planned(page)
    choose_example(page, WELDING)
    backend_select(page).select_option(kind)
    assert shown_request(page)["backend"] == {"kind": kind}


def test_back_ends_are_compared_with_their_options(page: Page) -> None:
    choose_example(page, "features/least_effort")
    backend = shown_request(page)["backend"]
    page.get_by_role("tab", name="Compare").click()
    with page.expect_request("**/v1/trajectories/compare") as sent:
        page.get_by_role("button", name="Compare all back ends").click()
    asked = json.loads(sent.value.post_data or "{}")
    assert backend in asked["backends"]
    page.locator("table.compare").wait_for()


def test_menus_act_when_an_item_is_chosen_and_not_before(page: Page) -> None:
    """Arrows move between items; Escape leaves all as it is and gives the focus back."""
    names = page.locator("[data-waypoint] strong")
    count = names.count()
    button = page.get_by_role("button", name="+ Add")
    menu = page.get_by_role("menu", name="+ Add")
    button.press("ArrowDown")
    expect(menu.get_by_role("menuitem", name="Current joint position")).to_be_focused()
    expect(button).to_have_attribute("aria-expanded", "true")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    expect(menu.get_by_role("menuitem", name="Relative move")).to_be_focused()
    assert violations(page) == []
    page.keyboard.press("Escape")
    expect(menu).to_have_count(0)
    expect(button).to_be_focused()
    expect(names).to_have_count(count)
    assert button.evaluate(FOCUS_AFTER_CLICK) == "Current joint position"
    page.keyboard.press("r")
    expect(menu.get_by_role("menuitem", name="Relative move")).to_be_focused()
    page.keyboard.press("Enter")
    expect(names).to_have_count(count + 1)
    examples = page.get_by_role("button", name="Examples")
    examples.press("ArrowUp")
    expect(page.get_by_role("menuitem").last).to_be_focused()
    page.keyboard.press("Tab")
    expect(page.get_by_role("menu")).to_have_count(0)
    expect(names).to_have_count(count + 1)
    assert re.fullmatch(r"\d+", page.locator("[data-waypoint='0'] .number").inner_text())


def test_waypoints_are_put_in_the_best_order_and_back(page: Page) -> None:
    turns = {"home": 0.0, "far": 1.2, "near": 0.3, "middle": 0.8}
    waypoints: list[dict[str, Any]] = [
        {"kind": "joint", "name": name, "position": [turn, -1.2, 1.4, -1.77, -1.57, 0.0]}
        for name, turn in turns.items()
    ]
    line = {"kind": "relative", "name": "seam", "frame": "tool", "motion": {"kind": "linear"}}
    waypoints.insert(2, line | {"move": {"kind": "cartesian", "translation": [0.0, 0.0, 0.02]}})
    use_request(page, json.dumps({"robot": "ur5e", "waypoints": waypoints}))
    names = page.locator("[data-waypoint] strong")
    given = ["home", "far", "seam", "near", "middle"]
    expect(names).to_have_text(given)
    page.get_by_role("button", name="Best order").click()
    expect(names).to_have_text(["home", "near", "far", "seam", "middle"])
    expect(page.locator(".ordering [role=status]")).to_contain_text("In the best order found")
    assert violations(page) == []
    page.get_by_role("button", name="Undo").click()
    expect(names).to_have_text(given)


def test_tasks_are_opened_in_the_order_of_the_service(page: Page, service: RunningService) -> None:
    tasks = json.loads((ROOT / "examples/tasks/drill_and_deburr.json").read_text())
    ordered = service.post("/v1/tasks/order", tasks).json()["request"]
    use_request(page, json.dumps(tasks))
    expect(page.locator("[data-waypoint]")).to_have_count(len(ordered["waypoints"]))
    planned(page)
    assert shown_request(page) == ordered
    expect(page.locator(".ordering [role=status]")).to_contain_text("In the best order found")
