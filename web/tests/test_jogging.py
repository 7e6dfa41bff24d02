"""Jogging of the tool along the axes of frames, with its pose, reach and collisions."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from playwright.sync_api import expect
from scipy.spatial.transform import Rotation

from tests.locations import ROOT
from web.tests.browser import drawn, opened, planned, use_request
from web.tests.test_conditions import violations
from web.tests.test_edits import pose_of
from web.tests.test_poses import MARK
from web.tests.test_teaching import JOINTS, shown_position

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.api.conftest import RunningService

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
TURNED = Rotation.from_euler("xyz", [0.4, -0.7, 1.1])
WORK = {
    "position": [0.4, -0.2, 0.3],
    "orientation": {"kind": "quaternion", "xyzw": TURNED.as_quat().tolist()},
}
"""A work object in the world, whose axes are none of the base's."""


def readout(page: Page) -> list[float]:
    """Return x, y, z in mm and roll, pitch, yaw in degrees."""
    return [float(text.split()[0]) for text in page.locator(".jog output").all_inner_texts()]


def tool(page: Page, service: RunningService) -> tuple[np.ndarray, Rotation]:
    """Return where the service has the tool at the shown joint position, in mm, and how it is turned."""
    pose = pose_of(service, "kuka_kr16_2", [math.radians(value) for value in shown_position(page)])
    return 1000.0 * np.array(pose["position"]), Rotation.from_quat(pose["orientation"]["xyzw"])


def step(page: Page, name: str) -> None:
    """Press a step button, and wait until the arm has followed."""
    before = page.locator(".sliders").inner_text()
    page.get_by_role("button", name=name, exact=True).click()
    page.wait_for_function("(before) => document.querySelector('.sliders').innerText !== before", arg=before)
    drawn(page)


@pytest.fixture
def jogging(page: Page) -> Page:
    request = json.loads(json.dumps(JOINTS)) | {"frames": {"bench": WORK}}
    use_request(page, json.dumps(request))
    expect(page.locator("[data-waypoint='2'] .when")).to_contain_text("s")
    page.get_by_role("tab", name="Robot").click()
    page.locator("[data-waypoint='1']").click()
    page.get_by_label("Step (mm)").select_option("50")
    page.get_by_label("Turn (°)").select_option("15")
    return page


@pytest.mark.parametrize(
    ("frame", "turn"), [("base", Rotation.identity()), ("tool", None), ("bench", TURNED)], ids=["base", "tool", "bench"]
)
def test_the_tool_moves_along_and_about_the_axes_of_a_frame(
    jogging: Page, service: RunningService, frame: str, turn: Rotation | None
) -> None:
    """Sliders show tenths of a degree, so that the service's pose of them is within some millimetres."""
    jogging.get_by_label("Along the axes of").last.select_option(frame)
    for axis, name in enumerate(AXES[:3]):
        before, turned = tool(jogging, service)
        step(jogging, f"More {name}")
        after, still = tool(jogging, service)
        moved = (turn or turned).apply(after - before, inverse=True)
        assert moved == pytest.approx(50.0 * np.eye(3)[axis], abs=6.0), name
        assert (turned.inv() * still).magnitude() < 0.01
    for axis, name in enumerate(AXES[3:]):
        before, turned = tool(jogging, service)
        step(jogging, f"Less {name}")
        after, now = tool(jogging, service)
        about = (now * turned.inv()).as_rotvec(degrees=True)
        assert (turn or turned).apply(about, inverse=True) == pytest.approx(-15.0 * np.eye(3)[axis], abs=0.7), name
        assert after == pytest.approx(before, abs=6.0)


@pytest.mark.parametrize(("frame", "expected"), [("base", None), ("bench", TURNED)], ids=["base", "bench"])
def test_the_pose_of_the_tool_is_read_in_the_frame(
    jogging: Page, service: RunningService, frame: str, expected: Rotation | None
) -> None:
    jogging.get_by_label("Along the axes of").last.select_option(frame)
    at, turned = tool(jogging, service)
    if expected is not None:
        at = expected.apply(at - 1000.0 * np.array(WORK["position"]), inverse=True)
        turned = expected.inv() * turned
    shown = readout(jogging)
    assert shown[:3] == pytest.approx(at, abs=6.0)
    assert (Rotation.from_euler("xyz", shown[3:], degrees=True).inv() * turned).magnitude() < 0.01


def test_steps_in_quick_succession_add_up(jogging: Page) -> None:
    jogging.get_by_label("Step (mm)").select_option("10")
    before = readout(jogging)
    for _ in range(4):
        jogging.get_by_role("button", name="More z", exact=True).click()
    expect(jogging.locator(".jog output").nth(2)).to_have_text(f"{before[2] + 40.0:.1f} mm")


def test_a_step_out_of_reach_says_so_and_leaves_the_arm(jogging: Page) -> None:
    note = jogging.locator(".reach-note.missed")
    for _ in range(60):
        jogging.get_by_role("button", name="More z", exact=True).click()
        drawn(jogging)
        if note.count():
            break
    expect(note).to_contain_text("out of reach")
    page = jogging
    page.get_by_role("slider", name="Time").press("Home")
    expect(page.locator(".reach-note")).to_have_count(0)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_what_is_in_the_way_is_said_while_joints_are_jogged(
    browser: Browser, service: RunningService, scheme: str
) -> None:
    """The wall stands straight ahead, and the first joint turns the arm into it and out again."""
    request: dict[str, Any] = json.loads((ROOT / "examples/around_a_wall.json").read_text())
    with opened(browser, f"{service.url}/", color_scheme=scheme) as page:
        planned(page)
        use_request(page, json.dumps(request))
        expect(page.locator("[data-waypoint]")).to_have_count(len(request["waypoints"]))
        planned(page)
        page.get_by_role("tab", name="Robot").click()
        slider = page.get_by_role("region", name="Joints by hand").get_by_role("slider").first
        note = page.locator(".reach-note.hindered")
        slider.fill("0")
        expect(note).to_contain_text("too near")
        assert violations(page) == []
        slider.fill("45")
        expect(note).to_have_count(0)


def test_handles_snap_to_steps_and_take_the_axes_of_the_tool(page: Page) -> None:
    """The handle in the middle moves the pose along the screen, in all three coordinates."""
    page.locator("[data-waypoint='4']").click()
    snap = page.get_by_role("button", name="Snap")
    snap.click()
    expect(snap).to_have_attribute("aria-pressed", "true")
    drawn(page)
    fields = [page.get_by_label(name, exact=True) for name in "xyz"]
    before = [float(field.input_value()) for field in fields]
    x, y = page.evaluate(MARK)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 14, y + 7, steps=5)
    page.mouse.up()
    after = [float(field.input_value()) for field in fields]
    assert after != before
    assert all(abs(value / 10.0 - round(value / 10.0)) < 1e-3 for value in after), after
    page.get_by_label("yaw", exact=True).fill("30")
    page.keyboard.press("Tab")
    drawn(page)
    planned(page)
    before_picture = page.evaluate("document.querySelector('.stage canvas').toDataURL()")
    page.get_by_role("button", name="Tool axes").click()
    drawn(page)
    assert page.evaluate("document.querySelector('.stage canvas').toDataURL()") != before_picture
