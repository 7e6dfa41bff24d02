"""Scenes on the page: collision-free solutions of a pose, better detours, speeds near objects."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from tests.locations import ROOT
from web.tests.browser import choose_example, drawn, opened, planned, shown_request, use_request
from web.tests.test_conditions import violations
from web.tests.test_poses import MARK

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.api.conftest import RunningService

INVERSE: dict[str, Any] = json.loads((ROOT / "examples/kinematics/inverse.json").read_text())
BALL = {
    "id": "ball",
    "shape": {"kind": "sphere", "radius": 0.15},
    "pose": {"position": INVERSE["poses"][0]["position"]},
}
TO_A_POSE = {
    "robot": INVERSE["robot"],
    "waypoints": [
        {"kind": "joint", "position": INVERSE["reference"]},
        {"kind": "pose", "pose": INVERSE["poses"][0]},
    ],
}
"""Two of four ways to this pose are free of the table, which is where the arm starts, so that there is no plan."""


def test_free_ways_come_first_and_the_others_say_what_is_in_the_way(browser: Browser, service: RunningService) -> None:
    """The check of collisions finds the same joint positions free."""
    found = service.post("/v1/kinematics/inverse", INVERSE).json()["results"][0]["solutions"]
    checks = service.post(
        "/v1/collisions/check",
        {"robot": INVERSE["robot"], "scene": INVERSE["scene"], "positions": [one["position"] for one in found]},
    ).json()["results"]
    free = sum(check["free"] for check in checks)
    assert 0 < free < len(found)
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        use_request(page, json.dumps(TO_A_POSE | {"scene": INVERSE["scene"]}))
        page.get_by_role("alert", name="Refusal").wait_for()
        page.locator("[data-waypoint='1']").click()
        page.get_by_role("button", name="Choose the configuration").press("Enter")
        ways = page.get_by_role("list", name=f"{len(found)} ways to reach the pose, {free} of them free")
        buttons = ways.get_by_role("button")
        expect(buttons).to_have_count(len(found))
        expect(page.locator(".reach-note.reached")).to_have_text(f"reached in {len(found)} ways, {free} of them free")
        said = [button.locator(".hindered").all_inner_texts() for button in buttons.all()]
        assert [text == [] for text in said] == [True] * free + [False] * (len(found) - free)
        pairs = {frozenset(check["collision"]["pair"]) for check in checks if not check["free"]}
        assert {frozenset(re.split(" and |: ", text)[:2]) for (text,) in filter(None, said)} == pairs
        page.keyboard.press("End")
        expect(page.locator(".reach-note.hindered strong")).to_have_text(said[-1][0])
        assert violations(page) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_pose_that_only_collides_is_shown_as_such_while_it_is_dragged(
    browser: Browser, service: RunningService, scheme: str
) -> None:
    """There is no plan: the ball is around the tool, wherever the arm comes from."""
    with opened(browser, f"{service.url}/", color_scheme=scheme) as page:
        planned(page)
        use_request(page, json.dumps(TO_A_POSE | {"scene": {"objects": [BALL]}}))
        page.get_by_role("alert", name="Refusal").wait_for()
        page.locator("[data-waypoint='1']").click()
        drawn(page)
        x, y = page.evaluate(MARK)
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 4, y + 2, steps=4)
        note = page.locator(".reach-note.hindered")
        expect(note).to_contain_text("none of them free")
        expect(note.locator("strong")).to_contain_text(re.compile(r"ball.*mm too near"))
        assert violations(page) == []
        page.mouse.up()
        expect(note).to_have_count(0)


def test_a_detour_is_improved_for_the_given_time(page: Page) -> None:
    choose_example(page, "features/around_a_wall")
    page.locator("[data-waypoint='1']").click()
    budget = page.get_by_label("For at most (s)")
    expect(budget).to_have_count(0)
    page.get_by_label("Made better by").select_option("duration")
    budget.fill("1")
    page.keyboard.press("Tab")
    gain = page.locator(".gain")
    expect(gain).to_contain_text("Made better by time")
    planned(page)
    expect(gain).to_contain_text("Made better by time")
    first, last = (float(text) for text in re.findall(r"[\d.]+", gain.inner_text())[:2])
    assert last <= first
    assert violations(page) == []
    motion = shown_request(page)["waypoints"][1]["motion"]
    assert (motion["kind"], motion["optimise"], motion["time_budget"]) == ("free", "duration", 1)
    page.get_by_label("Made better by").select_option("")
    expect(budget).to_have_count(0)
    motion = shown_request(page)["waypoints"][1]["motion"]
    assert not motion.keys() & {"optimise", "time_budget"}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_speed_zones_are_asked_and_seen(browser: Browser, service: RunningService, scheme: str) -> None:
    example = json.loads((ROOT / "examples/slow_beside_a_walkway.json").read_text())
    zones = service.post("/v1/trajectories", example).json()["certificate"]["speed_zones"]
    with opened(browser, f"{service.url}/", color_scheme=scheme) as page:
        choose_example(page, "features/slow_beside_a_walkway")
        rows = page.locator(".certificate tbody tr", has_text="Speed nearer than")
        expect(rows).to_have_count(len(zones))
        for row, zone in zip(rows.all(), zones, strict=True):
            expect(row).to_contain_text(f"{1000 * zone['clearance']:g} mm")
            expect(row).to_contain_text("to walkway")
            expect(row).to_contain_text(f"{1000 * zone['peak']:.3g} / {1000 * zone['limit']:g} mm/s")
            expect(row).to_contain_text(f"{zone['intervals'][0][0]:.2f} to {zone['intervals'][0][1]:.2f} s")
            expect(row).to_contain_text(f"fastest: {zone['link']}")
            expect(row.locator(".exceeded")).to_have_count(0)
        expect(page.locator(".track .slow")).to_have_count(3)  # the narrow zone parts the wide one
        page.get_by_role("button", name="Tool speed", exact=True).click()
        section = page.get_by_role("region", name="Slow near objects")
        section.get_by_text("to walkway").first.click()
        expect(section.get_by_role("checkbox", name="walkway")).to_be_checked()
        assert violations(page) == []
        section.get_by_role("button", name="Delete zone 0").press("Enter")
        expect(rows).to_have_count(1)
        section.get_by_role("button", name="Add a zone").press("Enter")
        expect(rows).to_have_count(2)
        second = section.get_by_role("group", name="Zone 1")
        second.get_by_label("Speed up to (mm/s)").fill("300")
        page.keyboard.press("Tab")
        expect(rows.nth(1)).to_contain_text("/ 300 mm/s")
        asked = shown_request(page)["speed_zones"]
        assert asked == [
            example["speed_zones"][1],
            {"clearance": 0.15, "speed": 0.3, "objects": ["walkway"]},
        ]


@pytest.mark.parametrize("margin", [0.0, 0.2])
def test_the_verdict_on_estimated_shapes_is_an_estimate(
    browser: Browser, service: RunningService, margin: float
) -> None:
    """It advises the margin that the certificate has as its uncertainty."""
    request = {
        "robot": "ur5e",
        "waypoints": [
            {"kind": "joint", "position": [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]},
            {"kind": "joint", "position": [0.3, -1.5, 1.5, -1.5, -1.5, 0.0]},
        ],
        "scene": {"objects": [BALL | {"pose": {"position": [1.2, 1.2, 0.0]}}], "margin": margin},
    }
    answer = service.post("/v1/trajectories", request).json()
    clearance = answer["certificate"]["clearance"]["scene"]
    assert clearance["shapes"] == "estimate"
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        use_request(page, json.dumps(request))
        estimate = page.locator(".verdict .estimate")
        expect(estimate).to_contain_text("Estimate:")
        [told] = re.findall(r"([\d.]+) mm", estimate.inner_text())[:1]
        parts = [part for part in answer["certificate"]["clearance"].values() if part]
        assert min(abs(float(told) / 1000 - part["uncertainty"]) for part in parts) < 1.1e-4
        page.get_by_role("tab", name="Certificate").click()
        expect(page.locator(".certificate .estimate").first).to_contain_text("estimated shapes")
        assert violations(page) == []


def test_a_ride_says_when_it_meets_the_part_and_when_to_begin_at_the_latest(page: Page) -> None:
    answer = page.expect_response("**/v1/trajectories")
    with answer as planned_ride:
        use_request(page, (ROOT / "examples/pick_from_a_running_belt.json").read_text())
    ride = planned_ride.value.json()["rides"][0]
    said = f"Meets part at {ride['arrival']:.3f} s. The program may begin until {ride['latest_start']:.3f} s."
    expect(page.get_by_role("region", name="Result")).to_contain_text(said)
    expect(page.locator("[data-waypoint='1'] .when")).to_have_text(re.compile(r"^[\d.]+ s$"))
