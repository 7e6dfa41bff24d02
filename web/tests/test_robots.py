"""Robots of the user's own on the page: uploaded with their meshes, moved by hand, refused with the reason."""

from __future__ import annotations

import base64
import json
import math
import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.api.conftest import wait_until
from tests.api.mesh_archives import archive
from tests.locations import ROOT
from tests.planner.shapes.mesh_files import box, stl
from web.tests.browser import (
    ARM_PIXELS,
    FRAMES,
    changed_colours,
    choose_example,
    drawn,
    leave_unanswered,
    opened,
    planned,
    use_request,
    wait_for_change,
)
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Browser, FilePayload, Page

    from tests.api.conftest import RunningService

ARM = json.loads((ROOT / "examples/robots/arm_with_meshes.json").read_text())


def payload(name: str, content: bytes) -> FilePayload:
    return {"name": name, "mimeType": "application/octet-stream", "buffer": content}


def test_a_robot_is_uploaded_moved_by_hand_and_planned_with(page: Page) -> None:
    page.get_by_role("tab", name="Robot").click()
    page.get_by_label("URDF").set_input_files(payload("my arm.urdf", ARM["urdf"].encode()))
    page.get_by_label("Meshes as zip").set_input_files(payload("meshes.zip", base64.b64decode(ARM["meshes"])))
    page.get_by_role("button", name="Add robot").click()
    expect(page.get_by_text("my_arm is added.")).to_be_visible()
    expect(page.get_by_role("combobox", name="Robot")).to_have_value("my_arm")
    assert "Certified" in planned(page)
    expect(page.locator(".findings li")).not_to_have_count(0)
    expect(page.get_by_role("region", name="Limits and where they come from")).to_contain_text("default")
    sliders = page.get_by_role("region", name="Joints by hand").get_by_role("slider")
    joints = sliders.count()
    assert joints == len(page.locator(".wide-table tbody tr").all())
    sliders.first.press("End")
    page.get_by_role("button", name="Add as waypoint").click()
    expect(page.locator("[data-waypoint]")).to_have_count(3)
    highest = float(sliders.first.get_attribute("max") or "nan")
    expect(page.locator(".joints input[type=number]").first).to_have_value(str(round(math.degrees(highest), 3)))
    assert violations(page) == []


FIGURES: dict[str, Callable[[float, float, float], float]] = {
    "Nearest to the base": math.hypot,
    "Farthest from the base": math.hypot,
    "Lowest": lambda _x, _y, z: z,
    "Highest": lambda _x, _y, z: z,
    "Farthest from the z axis": lambda x, y, _z: math.hypot(x, y),
}
"""Figures of the workspace, as functions of the position of the tool."""


@pytest.mark.parametrize("robot", ["kuka_kr16_2", "of_ones_own"])
def test_the_workspace_is_shown_with_its_figures(page: Page, service: RunningService, robot: str) -> None:
    """Forward kinematics has the tool at each figure where the page shows the robot."""
    if robot == "of_ones_own":
        body = {"kind": "urdf", "id": robot, "urdf": ARM["urdf"], "meshes": ARM["meshes"]}
        assert service.post("/v1/robots", body).status_code == 201
        page.reload()
        planned(page)
    page.get_by_label("Robot", exact=True).select_option(robot)
    page.get_by_role("tab", name="Robot").click()
    changed_colours(page)
    section = page.get_by_role("region", name="Workspace")
    section.get_by_label("Show where the tool can be").check()
    section.get_by_role("table").wait_for()
    wait_for_change(page, 1000)
    section.get_by_label("Cut open towards the viewer").uncheck()
    wait_for_change(page, 1000)
    assert violations(page) == []
    values = page.get_by_role("region", name="Joints by hand").locator("output")
    for figure, measure in FIGURES.items():
        row = section.get_by_role("row", name=figure)
        told = float(row.get_by_role("cell").first.inner_text().removesuffix(" mm"))
        row.get_by_role("button").click()
        drawn(page)
        shown = [math.radians(float(re.findall(r"-?[\d.]+", text)[0])) for text in values.all_inner_texts()]
        answer = service.post("/v1/kinematics/forward", {"robot": robot, "positions": [shown]}).json()
        assert 1e3 * measure(*answer["poses"][0]["position"]) == pytest.approx(
            told, abs=4.0
        )  # sliders show 0.1 degrees
    section.get_by_label("Show where the tool can be").uncheck()
    expect(section.get_by_role("table")).to_have_count(0)


def test_the_cloud_follows_the_robot(page: Page) -> None:
    page.get_by_role("tab", name="Robot").click()
    section = page.get_by_role("region", name="Workspace")
    section.get_by_label("Show where the tool can be").check()
    highest = section.get_by_role("row", name="Highest").get_by_role("cell").first
    before = highest.inner_text()
    page.get_by_role("combobox", name="Robot").select_option("fr3")
    expect(highest).not_to_have_text(before)


def test_what_is_no_robot_is_refused_with_the_reason(page: Page) -> None:
    page.get_by_role("tab", name="Robot").click()
    page.get_by_label("URDF").set_input_files(payload("stone.urdf", b"<robot name='stone'><link name='it'/></robot>"))
    page.get_by_role("button", name="Add robot").click()
    refused = page.get_by_role("alert", name="The robot was refused")
    expect(refused).to_contain_text("Error:")
    expect(page.get_by_role("combobox", name="Robot")).not_to_have_value("stone")
    assert violations(page) == []


def test_an_unknown_robot_is_said_and_none_is_drawn(browser: Browser, service: RunningService) -> None:
    """The plan that was under way for the request before is given up, and a robot that there is leads on."""
    with opened(browser, f"{service.url}/", may_fail=("status of 404",)) as page:
        planned(page)
        page.route("**/v1/trajectories", leave_unanswered)
        plan = page.get_by_role("button", name="Plan", exact=True)
        plan.click()
        expect(page.get_by_role("button", name="Planning")).to_be_visible()
        use_request(page, json.dumps({"robot": "nobody", "waypoints": [{"kind": "named", "name": "home"}]}))
        expect(page.get_by_role("alert", name="Refusal")).to_contain_text("There is no such robot")
        expect(plan).to_be_visible()
        expect(page.locator(".stage-failed")).to_contain_text("nobody")
        expect(page.get_by_role("combobox", name="Robot").locator("option:checked")).to_have_text("nobody (unknown)")
        expect(page.locator("[data-waypoint]")).to_have_count(1)
        page.evaluate(FRAMES)
        assert page.evaluate(ARM_PIXELS)[0] == 0
        assert violations(page) == []
        page.unroute("**/v1/trajectories")
        page.get_by_role("combobox", name="Robot").select_option("kuka_kr16_2")
        planned(page)
        expect(page.locator(".stage-failed")).to_have_count(0)
        page.wait_for_function(f"() => ({ARM_PIXELS})()[0] > 1000")


def test_notes_stand_where_the_robot_is_chosen_and_by_the_plan(page: Page, service: RunningService) -> None:
    notes = service.client.get("/v1/robots/three_dof_arm").json()["notes"]
    assert any("z axis of its base points downwards" in note for note in notes)
    page.get_by_role("combobox", name="Robot").select_option("three_dof_arm")
    planned(page)
    chosen = page.locator(".robot-notes")
    chosen.locator("summary").click()
    for note in notes:
        expect(chosen).to_contain_text(note)
    hint = page.get_by_text("No joint has position limits").last
    expect(hint).to_be_visible()
    assert violations(page) == []
    hint.get_by_role("button", name=f"Read the {len(notes)} notes on three_dof_arm").click()
    expect(page.get_by_role("region", name="Notes on this robot").get_by_role("listitem")).to_have_text(notes)


def test_the_robot_of_an_example_is_added_with_it(
    browser: Browser, start_service: Callable[..., RunningService]
) -> None:
    service = start_service(workers=1)
    assert service.client.get("/v1/robots/ur5e_on_rail").status_code == 404
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        choose_example(page, "features/along_a_rail")
        expect(page.get_by_role("alert")).to_contain_text("ur5e_on_rail, was added to the service")
        expect(page.get_by_role("combobox", name="Robot")).to_have_value("ur5e_on_rail")
        page.get_by_role("button", name="Close").click()
        choose_example(page, "features/around_a_wall")
        choose_example(page, "features/along_a_rail")
        expect(page.get_by_role("alert")).to_have_count(0)


BLUE_PIXELS = """() => {
  const stage = document.querySelector('.stage canvas');
  const copy = Object.assign(document.createElement('canvas'), { width: stage.width, height: stage.height });
  const context = copy.getContext('2d');
  context.drawImage(stage, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4)
    if (data[i + 3] > 200 && data[i + 2] > 90 && data[i + 2] > 3 * data[i] && data[i + 2] > 3 * data[i + 1]) count += 1;
  return count;
}"""
"""Counts the pixels of the stage that are blue: nothing of the page's own is."""


def test_visual_meshes_are_drawn_in_their_colours_and_collision_shapes_on_request(
    browser: Browser, service: RunningService
) -> None:
    mesh = '<geometry><mesh filename="package://look/box.stl"/></geometry>'
    blue = '<material name="blue"><color rgba="0 0 1 1"/></material>'
    links = "".join(
        f'<link name="{name}"><visual>{mesh}{blue}</visual>'
        '<collision><origin xyz="0 0 0.2"/><geometry><box size="0.1 0.1 0.4"/></geometry></collision></link>'
        for name in ("base", "arm")
    )
    ends = '<parent link="base"/><child link="arm"/><origin xyz="0 0 0.4"/><axis xyz="0 1 0"/>'
    limit = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
    urdf = f'<robot name="look">{links}<joint name="a" type="revolute">{ends}{limit}</joint></robot>'
    meshes = archive({"look/box.stl": stl(box((-0.05, -0.05, 0.0), (0.05, 0.05, 0.4)))})
    added = service.post("/v1/robots", {"kind": "urdf", "id": "look", "urdf": urdf, "meshes": meshes})
    assert added.status_code == 201, added.text
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        page.get_by_role("combobox", name="Robot").select_option("look")
        wait_until(lambda: page.evaluate(BLUE_PIXELS) > 500)
        solids = page.get_by_role("button", name="Collision shapes")
        solids.click()
        wait_until(lambda: page.evaluate(BLUE_PIXELS) == 0 and page.evaluate(ARM_PIXELS)[0] > 500)
        assert violations(page) == []
        solids.click()
        wait_until(lambda: page.evaluate(BLUE_PIXELS) > 500)
    service.client.delete("/v1/robots/look")
