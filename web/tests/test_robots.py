"""Robots of the user's own on the page: uploaded with their meshes, moved by hand, refused with the reason."""

from __future__ import annotations

import base64
import json
from typing import TYPE_CHECKING

from playwright.sync_api import expect

from tests.locations import ROOT
from web.tests.browser import planned
from web.tests.test_conditions import violations

if TYPE_CHECKING:
    from playwright.sync_api import FilePayload, Page

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
    expect(page.locator(".joints input[type=number]").first).to_have_value(str(round(highest, 3)))
    assert violations(page) == []


def test_what_is_no_robot_is_refused_with_the_reason(page: Page) -> None:
    page.get_by_role("tab", name="Robot").click()
    page.get_by_label("URDF").set_input_files(payload("stone.urdf", b"<robot name='stone'><link name='it'/></robot>"))
    page.get_by_role("button", name="Add robot").click()
    refused = page.get_by_role("alert", name="The robot was refused")
    expect(refused).to_contain_text("Error:")
    expect(page.get_by_role("combobox", name="Robot")).not_to_have_value("stone")
    assert violations(page) == []
