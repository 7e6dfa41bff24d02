"""The scene editor: objects are added, attached, moved, sized, named, imported and kept by the service."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from playwright.sync_api import expect

from web.tests.browser import drawn, opened, planned, shown_request, use_request
from web.tests.test_conditions import violations
from web.tests.test_poses import MARK

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser, Locator, Page

    from tests.api.conftest import RunningService

HOME = [0.0, -1.4, 1.6, -1.77, -1.57, 0.0]
TURN: dict[str, Any] = {
    "robot": "ur5e",
    "waypoints": [{"kind": "joint", "position": [turn, *HOME[1:]]} for turn in (0.0, 0.4)],
    "frames": {"bench": {"position": [0.0, 0.0, -0.5], "orientation": {"kind": "rpy", "rpy": [0.0, 0.0, 0.5]}}},
}


def open_editor(page: Page) -> Locator:
    use_request(page, json.dumps(TURN))
    planned(page)
    page.get_by_text("Scene (0 objects)").click()
    return page.locator("details", has=page.get_by_text("Scene ("))


def add(page: Page, kind: str) -> None:
    """Add an object, and wait for the plan beside it."""
    page.get_by_role("button", name="+ Add object").click()
    with page.expect_response("**/v1/trajectories"):
        page.get_by_role("menuitem", name=kind).click()


def write(page: Page, field: Locator, text: str) -> None:
    """Type a text in place of the old one, and wait for the next plan."""
    field.click()
    page.keyboard.press("Control+a")
    page.keyboard.type(text)
    with page.expect_response("**/v1/trajectories"):
        page.keyboard.press("Tab")


def objects(page: Page) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = shown_request(page)["scene"]["objects"]
    return found


@pytest.mark.parametrize("width", [390, 1280])
def test_an_object_is_added_named_sized_and_moved_by_the_handles(
    browser: Browser, service: RunningService, width: int
) -> None:
    with opened(browser, f"{service.url}/", viewport={"width": width, "height": 900}) as page:
        editor = open_editor(page)
        add(page, "box")
        write(page, editor.get_by_label("Name", exact=True), "table")
        size = editor.get_by_role("group", name="Size").get_by_label("y", exact=True)
        write(page, size, "350")
        write(page, editor.get_by_label("Margin (mm)", exact=True), "25")
        [table] = objects(page)
        assert (table["id"], table["shape"]["size"], table["margin"]) == ("table", [0.2, 0.35, 0.2], 0.025)
        assert violations(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        if width > 1200:  # the panels scroll, the page does not
            assert page.evaluate("document.documentElement.scrollHeight") <= 900
        page.locator(".stage").scroll_into_view_if_needed()
        drawn(page)
        x, y = page.evaluate(MARK)
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 15, y - 8, steps=6)
        with page.expect_response("**/v1/trajectories"):
            page.mouse.up()
        [moved] = objects(page)
        assert 0.005 < math.dist(moved["pose"]["position"], table["pose"]["position"]) < 1.0
        assert moved | {"pose": None} == table | {"pose": None}
        page.get_by_role("button", name="Undo").click()
        assert objects(page) == [table]
        page.get_by_role("button", name="Delete object").click()
        assert objects(page) == []


def test_an_object_in_the_way_is_refused_and_stays_in_its_place_in_another_frame(page: Page) -> None:
    """The corners of the box in the world are computed here, from the frame of the request."""
    editor = open_editor(page)
    add(page, "box")
    editor.get_by_label("In the frame").select_option("bench")
    [box] = objects(page)
    at, turn = (
        np.array(box["pose"]["position"]),
        np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]]),
    )
    assert [*(turn @ at[:2]), at[2] - 0.5] == pytest.approx([0.8, -0.8, 0.1], abs=1e-9)
    editor.get_by_label("In the frame").select_option("base")
    for axis, value in zip("xyz", ("0", "0", "400"), strict=True):
        write(page, editor.get_by_label(axis, exact=True).first, value)
    expect(page.get_by_role("alert", name="Refusal")).to_contain_text("box")
    write(page, editor.get_by_label("Name", exact=True), "post")
    expect(page.get_by_role("alert", name="Refusal")).to_contain_text("post")
    add(page, "sphere")
    field = editor.get_by_label("Name", exact=True)
    field.fill("post")
    page.keyboard.press("Tab")
    expect(editor.get_by_role("alert")).to_have_text("Another object has the name “post”.")
    assert [one["id"] for one in objects(page)] == ["post", "sphere"]


def pose_in_base(service: RunningService, attached: dict[str, Any], link: str) -> np.ndarray:
    """Return the matrix (4, 4) of an object on a link at the start, by the service's forward kinematics."""
    asked = {"robot": "ur5e", "positions": [TURN["waypoints"][0]["position"]], "include": ["links"]}
    links = service.client.post("/v1/kinematics/forward", json=asked).json()["links"]
    found = next(one for one in links[0] if one["link"] == link)
    placed: np.ndarray = matrix(found) @ matrix(attached["pose"])
    return placed


def matrix(pose: dict[str, Any]) -> np.ndarray:
    quaternion = pose["orientation"]["xyzw"]
    matrix: np.ndarray = np.eye(4)
    matrix[:3, :3] = pin.Quaternion(np.array(quaternion)).matrix()
    matrix[:3, 3] = pose["position"]
    return matrix


def test_an_object_is_attached_to_a_link_and_may_touch_another(page: Page, service: RunningService) -> None:
    """The service says where the object is, before and after another link holds it, and refuses contacts."""
    editor = open_editor(page)
    page.get_by_role("button", name="+ Attach object").click()
    with page.expect_response("**/v1/trajectories"):
        page.get_by_role("menuitem", name="box").click()
    write(page, editor.get_by_label("Name", exact=True), "gripper")
    write(page, editor.get_by_label("z", exact=True).first, "-60")
    expect(page.get_by_role("alert", name="Refusal")).to_contain_text("gripper")
    with page.expect_response("**/v1/trajectories"):
        editor.get_by_label("Allow contact with").select_option("link_5")
    planned(page)
    [on_tool] = shown_request(page)["scene"]["attached"]
    assert (on_tool["id"], on_tool["touch_links"]) == ("gripper", ["link_5"])
    with page.expect_response("**/v1/trajectories"):
        editor.get_by_label("Moves with").select_option("link_6")
    [on_link] = shown_request(page)["scene"]["attached"]
    before, after = pose_in_base(service, on_tool, "flange"), pose_in_base(service, on_link, on_link["link"])
    np.testing.assert_allclose(after, before, atol=1e-6)
    editor.get_by_label("Link or object").select_option("link_2")
    editor.get_by_label("and", exact=True).select_option("link_4")
    with page.expect_response("**/v1/trajectories"):
        editor.get_by_role("button", name="Allow this pair").click()
    assert shown_request(page)["scene"]["allowed_pairs"] == [["link_2", "link_4"]]
    assert violations(page) == []


def test_files_become_objects(page: Page, tmp_path: Path) -> None:
    """trimesh writes the files; the service plans beside their objects."""
    editor = open_editor(page)
    body = trimesh.creation.icosphere(subdivisions=1, radius=120.0)
    for suffix in ("stl", "obj", "ply"):
        body.export(tmp_path / f"ball.{suffix}")
        with page.expect_response("**/v1/trajectories"):
            editor.get_by_label("Import STL, OBJ, PLY, PCD").set_input_files(tmp_path / f"ball.{suffix}")
        expect(editor.get_by_role("listitem")).to_have_count(len(objects(page)))
    cloud = trimesh.PointCloud(body.vertices)  # type: ignore[no-untyped-call]
    cloud.export(tmp_path / "scan.ply")  # type: ignore[no-untyped-call]
    with page.expect_response("**/v1/trajectories"):
        editor.get_by_label("Import STL, OBJ, PLY, PCD").set_input_files(tmp_path / "scan.ply")
    *meshes, points = objects(page)
    assert [one["id"] for one in meshes] == ["ball", "ball_2", "ball_3"]
    for one in meshes:
        shape = one["shape"]
        read = trimesh.Trimesh(shape["vertices"], shape["triangles"])
        assert read.is_watertight
        assert read.volume == pytest.approx(body.volume * 1e-9, rel=1e-4)
    assert points["id"] == "scan"
    assert np.array(points["shape"]["points"]) == pytest.approx(body.vertices * 1e-3, abs=2e-6)
    planned(page)
    (tmp_path / "broken.stl").write_bytes(b"no triangles")
    editor.get_by_label("Import STL, OBJ, PLY, PCD").set_input_files(tmp_path / "broken.stl")
    expect(editor.get_by_role("alert")).to_contain_text("broken.stl cannot be imported")
    assert violations(page) == []


def test_a_scene_is_kept_by_the_service_and_changed_there(page: Page, service: RunningService) -> None:
    editor = open_editor(page)
    add(page, "cylinder")
    write_name = editor.get_by_label("Name on the service")
    write_name.fill("cell_of_the_page")
    with page.expect_response("**/v1/trajectories"):
        editor.get_by_role("button", name="Save scene").click()
    assert shown_request(page)["scene"] == "cell_of_the_page"
    first = service.client.get("/v1/scenes/cell_of_the_page").json()["objects"]
    assert [one["shape"]["kind"] for one in first] == ["cylinder"]
    editor.get_by_role("button", name="cylinder").click()
    write(page, editor.get_by_label("Radius (mm)", exact=True), "70")
    assert objects(page)[0]["shape"]["radius"] == 0.07
    assert service.client.get("/v1/scenes/cell_of_the_page").json()["objects"] == first
    add(page, "box")
    write_name.fill("cell_of_the_page")
    with page.expect_response("**/v1/trajectories"):
        editor.get_by_role("button", name="Save scene").click()
    kept = service.client.get("/v1/scenes/cell_of_the_page").json()["objects"]
    assert sorted((one["id"], one["shape"].get("radius")) for one in kept) == [("box", None), ("cylinder", 0.07)]
    for choice in ("", "cell_of_the_page"):
        with page.expect_response("**/v1/trajectories"):
            editor.get_by_label("Scene", exact=True).select_option(choice)
        assert shown_request(page).get("scene", "") == choice
    expect(editor.get_by_role("listitem")).to_have_count(2)
