"""Teaching by hand: arm and numbers follow sliders, fields and handles, and nothing jumps afterwards."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from web.tests.browser import add_waypoint, drawn, planned, seconds, use_request, wait_for_change
from web.tests.test_edits import jogged
from web.tests.test_poses import MARK

if TYPE_CHECKING:
    from playwright.sync_api import Page

JOINTS = {
    "robot": "kuka_kr16_2",
    "waypoints": [
        {"kind": "joint", "position": [0.0, -1.5, 1.5, 0.0, 0.5, 0.0]},
        {"kind": "joint", "position": [0.6, -1.2, 1.2, 0.0, 0.5, 0.5]},
        {"kind": "joint", "position": [1.0, -1.4, 1.3, 0.2, 0.6, 0.1]},
    ],
}

WATCHED = """() => {
  const outputs = [...document.querySelectorAll('.sliders output')];
  window.seen = [];
  const watch = new MutationObserver(() => window.seen.push(outputs.map((output) => output.textContent)));
  for (const output of outputs) watch.observe(output, {subtree: true, childList: true, characterData: true});
}"""
"""Keeps every joint position that the page shows from now on."""


def shown_position(page: Page) -> list[float]:
    """Return the joint position of the arm, as the sliders of the robot tab show it, degrees."""
    return [float(text.split()[0]) for text in page.locator(".sliders output").all_inner_texts()]


def stands_at(page: Page, waypoint: int) -> None:
    """Check that the time is the arrival at a waypoint of the shown plan."""
    shown = page.locator(f"[data-waypoint='{waypoint}'] .when").inner_text()
    arrival = re.match(r"[\d.]+", shown)
    assert arrival, shown
    assert seconds(page) == pytest.approx(float(arrival[0]), abs=6e-3)


def with_joints(page: Page) -> None:
    use_request(page, json.dumps(JOINTS))
    expect(page.locator("[data-waypoint]")).to_have_count(3)
    expect(page.locator("[data-waypoint='2'] .when")).to_contain_text("s")
    page.get_by_role("tab", name="Robot").click()


def test_arm_and_numbers_follow_a_slider(page: Page) -> None:
    with_joints(page)
    page.locator("[data-waypoint='1']").click()
    expect(page.locator("[data-waypoint='1']")).to_have_attribute("aria-current", "true")
    editor = page.get_by_role("form", name="The chosen waypoint")
    slider, number = editor.get_by_role("slider").first, editor.get_by_role("spinbutton").first
    before = shown_position(page)
    assert before[0] == pytest.approx(float(number.input_value()), abs=0.06)
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    assert box is not None
    page.evaluate("window.before = null")
    wait_for_change(page, -1)
    page.mouse.move(box["x"] + 0.55 * box["width"], box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + box["height"] / 2, steps=5)
    held = float(number.input_value())
    assert abs(held - before[0]) > 30.0
    assert shown_position(page)[0] == pytest.approx(held, abs=0.06)
    wait_for_change(page, 1000)
    page.mouse.up()
    expect(page.locator(".verdict.stale")).to_have_count(0)
    planned(page)
    stands_at(page, 1)
    assert shown_position(page) == pytest.approx([held, *before[1:]], abs=0.06)


def test_the_arm_follows_a_number_that_is_typed(page: Page) -> None:
    page.get_by_role("tab", name="Robot").click()
    page.locator("[data-waypoint='2']").click()
    before = shown_position(page)
    field = page.get_by_label("z", exact=True)
    value = float(field.input_value())
    field.click()
    page.keyboard.press("Control+a")
    page.keyboard.type(f"{value + 31.25:.2f}")
    expect(page.locator(".reach-note")).to_be_visible()
    assert field.input_value() == f"{value + 31.25:.2f}"
    while_typing = shown_position(page)
    assert while_typing != before
    with page.expect_response("**/v1/trajectories"):
        page.keyboard.press("Tab")
    planned(page)
    expect(page.locator(".reach-note")).to_have_count(0)
    stands_at(page, 2)


def test_arm_and_numbers_follow_the_handles(page: Page) -> None:
    page.get_by_role("tab", name="Robot").click()
    page.locator("[data-waypoint='4']").click()
    drawn(page)
    fields = [page.get_by_label(name, exact=True) for name in "xyz"]
    numbers, position = [field.input_value() for field in fields], shown_position(page)
    x, y = page.evaluate(MARK)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 10, y + 5, steps=5)
    expect(page.locator(".reach-note")).to_contain_text(re.compile(r"reached in \d+ way"))
    assert [field.input_value() for field in fields] != numbers
    assert shown_position(page) != position
    page.mouse.up()
    expect(page.locator(".reach-note")).to_have_count(0)


def test_nothing_jumps_when_a_position_is_added(page: Page) -> None:
    """From the jogged position to the plan with the new waypoint, the arm stands still."""
    with_joints(page)
    page.locator("[data-waypoint='1']").click()
    jogged(page, 1, "PageUp")
    position = shown_position(page)
    page.evaluate(WATCHED)
    add_waypoint(page, "Current joint position")
    expect(page.locator("[data-waypoint]")).to_have_count(4)
    expect(page.locator("[data-waypoint='3'] .when")).to_contain_text("s")
    planned(page)
    drawn(page)
    assert shown_position(page) == position
    seen = page.evaluate("window.seen")
    assert all([float(text.split()[0]) for text in row] == position for row in seen)
    stands_at(page, 2)


def test_the_time_stands_at_the_chosen_waypoint_until_a_person_seeks(page: Page) -> None:
    with_joints(page)
    page.locator("[data-waypoint='1']").click()
    page.get_by_label("Back end").select_option("quintic")
    expect(page.locator(".verdict:not(.stale)")).to_contain_text("by quintic")
    stands_at(page, 1)
    page.get_by_role("slider", name="Time").fill("0.25")
    page.get_by_label("Back end").select_option("trapezoidal")
    expect(page.locator(".verdict:not(.stale)")).to_contain_text("by trapezoidal")
    assert seconds(page) == 0.25
