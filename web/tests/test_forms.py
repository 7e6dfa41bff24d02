"""Forms for all fields of a request: shapes of motions, tools, payloads, frames, actions, limits, options."""

from __future__ import annotations

import copy
import json
import math
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from web.tests.browser import choose_example, opened, planned, shown_request, use_request
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

    from tests.api.conftest import RunningService

DOWN = {"kind": "rpy", "rpy": [math.pi, 0.0, 0.0]}
POSES: dict[str, Any] = {
    "robot": "ur5e",
    "waypoints": [
        {"kind": "joint", "position": [0.0, -1.4, 1.6, -1.77, -1.57, 0.0]},
        {"kind": "pose", "pose": {"position": [0.5, -0.1, 0.3], "orientation": DOWN}},
        {"kind": "pose", "pose": {"position": [0.5, 0.2, 0.3], "orientation": DOWN}},
    ],
}


@pytest.fixture
def poses(page: Page) -> Page:
    """The page with a request for an arm whose masses are known; its last waypoint is chosen."""
    show(page, POSES)
    page.locator("[data-waypoint='2']").click()
    return page


def show(page: Page, request: dict[str, Any]) -> None:
    with page.expect_response("**/v1/trajectories"):
        use_request(page, json.dumps(request))
    planned(page)


def more(page: Page, summary: str) -> Locator:
    """Open one of the forms; return it."""
    form = page.locator("details.more", has=page.get_by_text(summary, exact=True))
    if form.get_attribute("open") is None:
        form.locator("summary").first.click()
    form.locator(".more-fields").wait_for()
    return form


def fill(field: Locator, value: str) -> None:
    field.fill(value)
    field.press("Tab")


@pytest.mark.parametrize("kind", ["circle", "polyline", "spline"])
def test_a_shape_of_the_tool_is_chosen_planned_and_edited(poses: Page, kind: str) -> None:
    """It begins with a pose beside the straight line; its coordinates are written in mm."""
    page = poses
    with page.expect_response("**/v1/trajectories"):
        page.get_by_label("Motion to here").select_option(label=kind)
    assert "Certified" in planned(page)
    form = more(page, "More fields of this waypoint")
    y = form.get_by_label("y", exact=True)
    assert float(y.input_value()) == pytest.approx(50.0, abs=0.1)
    with page.expect_response("**/v1/trajectories"):
        fill(y, "60.5")
    assert "Certified" in planned(page)
    motion = shown_request(page)["waypoints"][2]["motion"]
    pose = motion["via"] if kind == "circle" else motion["poses"][0]
    assert pose["position"][1] == 0.0605


def test_corners_are_added_and_removed(poses: Page) -> None:
    page = poses
    page.get_by_label("Motion to here").select_option(label="polyline")
    form = more(page, "More fields of this waypoint")
    form.get_by_role("group", name="Poses").get_by_role("button", name="+ Another").click()
    expect(form.get_by_role("button", name="Remove Poses 1")).to_be_visible()
    assert len(shown_request(page)["waypoints"][2]["motion"]["poses"]) == 2
    form.get_by_role("button", name="Remove Poses 1").click()
    expect(form.get_by_role("button", name="Remove Poses 0")).to_have_count(0)
    assert len(shown_request(page)["waypoints"][2]["motion"]["poses"]) == 1


def test_fields_of_a_waypoint_are_given_in_units_of_people(poses: Page) -> None:
    page = poses
    form = more(page, "More fields of this waypoint")
    form.get_by_role("button", name="+ Payload", exact=True).click()
    fill(form.get_by_label("Mass (kg)"), "2.5")
    form.get_by_role("button", name="+ Center of mass", exact=True).click()
    fill(form.get_by_role("group", name="Center of mass").get_by_label("z", exact=True), "45")
    form.get_by_role("button", name="+ Tolerance region").click()
    form.get_by_role("button", name="+ Tool", exact=True).click()
    fill(form.get_by_role("group", name="Tool").get_by_label("z", exact=True), "120")
    form.get_by_role("button", name="+ Process force").click()
    form.get_by_role("button", name="+ Force", exact=True).click()
    fill(form.get_by_role("group", name="Process force").get_by_label("z", exact=True), "12")
    form.get_by_role("button", name="+ Actions").click()
    actions = form.get_by_role("group", name="Actions")
    actions.get_by_role("button", name="+ Another").click()
    fill(actions.get_by_label("Name"), "gripper")
    actions.get_by_role("button", name="+ Another").click()
    actions.get_by_label("Kind").nth(2).select_option("wait")
    fill(actions.get_by_label("Duration (s)"), "0.25")
    form.get_by_role("button", name="+ Limits").click()
    fill(form.get_by_label("TCP angular velocity (°/s)"), "45")
    asked = shown_request(page)["waypoints"][2]
    expected = {
        "payload": {"mass": 2.5, "center_of_mass": [0, 0, 0.045]},
        "free": "rotation_z",
        "tool": {"position": [0, 0, 0.12], "orientation": {"kind": "rpy", "rpy": [0, 0, 0]}},
        "process_force": {"force": [0, 0, 12]},
        "actions": [{"kind": "set_output", "name": "gripper", "value": True}, {"kind": "wait", "duration": 0.25}],
    }
    limits = asked.pop("limits")
    assert limits.pop("tcp_angular_velocity") == pytest.approx(math.pi / 4.0, rel=1e-9)
    assert limits == {}
    assert asked == POSES["waypoints"][2] | expected
    assert "Certified" in planned(page)


def test_fields_of_the_request_are_given_and_taken_away(poses: Page, service: RunningService) -> None:
    page = poses
    form = more(page, "Fields of the whole request")
    form.get_by_role("button", name="+ Frames").click()
    frames = form.get_by_role("group", name="Frames")
    fill(frames.get_by_label("Name"), "bench")
    frames.get_by_role("button", name="+ Another").click()
    fill(frames.get_by_label("x", exact=True), "400")
    form.get_by_role("button", name="+ Limits").click()
    form.get_by_role("button", name="+ Velocity", exact=True).click()
    robot = service.client.get("/v1/robots/ur5e").json()
    joint = robot["joints"][0]
    first = form.get_by_label(f"{joint['name']} (°/s)")
    assert float(first.input_value()) == pytest.approx(math.degrees(joint["velocity"]), abs=1e-3)
    fill(first, "30")
    fill(form.get_by_label("Deadline (s)"), "5")
    asked = shown_request(page)
    assert asked["frames"]["bench"]["position"] == [0.4, 0, 0]
    assert asked["limits"]["velocity"][0] == pytest.approx(math.radians(30.0), rel=1e-9)
    assert asked["limits"]["velocity"][1:] == pytest.approx([one["velocity"] for one in robot["joints"][1:]])
    assert asked["deadline"] == 5
    for name in ("Frames", "Limits"):
        form.get_by_role("button", name=f"Remove {name}").click()
    fill(form.get_by_label("Deadline (s)"), "")
    assert shown_request(page) == POSES


def test_options_of_a_back_end_stay_when_another_is_tried(poses: Page) -> None:
    page = poses
    page.get_by_label("Back end").select_option("trapezoidal")
    form = more(page, "Fields of the whole request")
    fill(form.get_by_role("group", name="Options of trapezoidal").get_by_label("Acceleration time (s)"), "0.6")
    page.get_by_label("Back end").select_option("quintic")
    expect(form.get_by_role("group", name="Options of quintic")).to_be_visible()
    page.get_by_label("Back end").select_option("trapezoidal")
    assert shown_request(page)["backend"] == {"kind": "trapezoidal", "acceleration_time": 0.6}


def label_of(name: str) -> str:
    """Return the label of a field without its unit."""
    words = {"free": "tolerance region", "ik": "inverse kinematics"}.get(name, name.replace("_", " "))
    return (words[0].upper() + words[1:]).replace("Tcp ", "TCP ")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_every_field_of_the_contract_has_a_control(browser: Browser, service: RunningService, scheme: str) -> None:
    schemas = service.client.get("/openapi.json").json()["components"]["schemas"]
    elsewhere = {
        "PlanRequest": {"robot", "waypoints", "scene", "speed_zones", "include", "picture", "backend"},
        "PoseWaypoint": {"kind", "name", "pose", "frame", "motion", "duration", "dwell", "transition", "configuration"},
    }
    summaries = {"PlanRequest": "Fields of the whole request", "PoseWaypoint": "More fields of this waypoint"}
    request = copy.deepcopy(POSES) | {"limits": {}}
    with opened(browser, f"{service.url}/", color_scheme=scheme) as page:
        planned(page)
        show(page, request)
        page.locator("[data-waypoint='2']").click()
        for schema, summary in summaries.items():
            text = more(page, summary).locator(".more-fields").inner_text()
            fields = schemas[schema]["properties"]
            names = [name for name in fields if name not in elsewhere[schema]]
            missing = [name for name in names if label_of(name) not in text]
            assert not missing, missing
            if schema == "PlanRequest":
                limits = schemas["Limits"]["properties"]
                assert not [name for name in limits if label_of(name) not in text]
        assert violations(page) == []


def test_a_goal_set_shows_the_outcomes_of_its_options_and_loses_one(page: Page) -> None:
    choose_example(page, "features/any_of_grasps")
    page.locator("[data-waypoint='1']").click()
    options = page.get_by_role("region", name="Options").get_by_role("listitem")
    expect(options).to_contain_text(["chosen, by estimate", "longer, by estimate", "by estimate", "refused: "])
    options.nth(0).get_by_role("button", name="Delete option 0").click()
    expect(options).to_have_count(3)
    expect(options.nth(0)).to_contain_text("middle part chosen, by estimate")
    options.nth(1).get_by_role("button", name="Only this").click()
    expect(options).to_have_count(1)
    assert [option["name"] for option in shown_request(page)["waypoints"][1]["options"]] == ["part in the crate"]
