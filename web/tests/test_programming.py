"""Work of a robot programmer with the page, end to end: plan, edit, refuse and mend, compare, play, export."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from planner.quantities import MEASURES
from tests.api.requests import urdf_chain, urdf_robot
from tests.locations import ROOT
from web.tests.browser import (
    ARM_PIXELS,
    TOO_SHORT,
    WELDING,
    add_waypoint,
    addressed,
    changed_colours,
    choose_example,
    drawn,
    opened,
    planned,
    plays,
    seconds,
    use_request,
    wait_for_change,
)

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Route

    from tests.api.conftest import RunningService


def test_the_first_example_is_planned(page: Page) -> None:
    """The document prints 25.29 s for the six poses."""
    assert "25.29 s" in planned(page)
    assert page.locator("[data-waypoint]").count() == 6
    assert page.locator(".certificate tbody tr").count() >= 4
    assert page.locator(".plot canvas").count() == 2


PEOPLE = {"rad": "°", "rad/s": "°/s", "rad/s²": "°/s²", "rad/s³": "°/s³", "m": "mm"}
PEOPLE |= {"m/s": "mm/s", "m/s²": "mm/s²", "m/s³": "mm/s³"}
"""The units in which people read lengths and angles."""


def test_every_quantity_has_a_title_and_a_unit(browser: Browser, service: RunningService) -> None:
    """Whatever the certificate may check, of a joint that turns, of one that slides, and of the tool."""
    check = {"peak": 1.0, "limit": 2.0, "ratio": 0.5, "time": 0.0, "method": "exact", "enforced": True, "bounded": True}
    rows: list[tuple[dict[str, Any], str]] = []
    for name, measure in MEASURES.items():
        if measure.unit_of_sliding is None:
            rows.append((check | {"quantity": name, "joint": None}, PEOPLE.get(measure.unit, measure.unit)))
        else:
            rows.append((check | {"quantity": name, "joint": "theta1"}, PEOPLE.get(measure.unit, measure.unit)))
            sliding = measure.unit_of_sliding
            rows.append((check | {"quantity": name, "joint": "l1"}, PEOPLE.get(sliding, sliding)))

    def answer(route: Route) -> None:
        answered = route.fetch()
        plan = answered.json()
        plan["certificate"]["checks"] = [row for row, _ in rows]
        route.fulfill(response=answered, json=plan)

    robot = service.client.get("/v1/robots/date_sorting_arm").json()
    middle = [(one["lower"] + one["upper"]) / 2 if one["lower"] is not None else 0.0 for one in robot["joints"]]
    waypoints = [{"kind": "joint", "position": [value + step for value in middle]} for step in (0.0, 0.01)]
    with opened(browser, f"{service.url}/") as page:
        planned(page)
        page.route("**/v1/trajectories", answer)
        use_request(page, json.dumps({"robot": "date_sorting_arm", "waypoints": waypoints}))
        planned(page)
        page.get_by_role("tab", name="Certificate").click()
        shown = page.locator(".certificate tbody tr")
        expect(shown).to_have_count(len(rows))
        for text, (row, unit) in zip(shown.all_inner_texts(), rows, strict=True):
            assert text.startswith(MEASURES[row["quantity"]].title), text
            assert re.search(rf"/ [\d.]+ {re.escape(unit)}\s", text.replace("\u00a0", " ")), (text, unit)


def test_a_waypoint_is_edited_undone_and_redone(page: Page) -> None:
    page.locator("[data-waypoint='1']").click()
    page.get_by_label("Duration (s)").fill("9.33")
    page.keyboard.press("Tab")
    expect(page.locator(".verdict")).to_contain_text("27.29 s")
    page.get_by_role("button", name="Undo").click()
    expect(page.locator(".verdict")).to_contain_text("25.29 s")
    page.locator("h1").click()
    page.keyboard.press("Control+y")
    expect(page.locator(".verdict")).to_contain_text("27.29 s")


def test_waypoints_are_added_moved_and_deleted_by_keys(page: Page) -> None:
    names = page.locator("[data-waypoint] strong")
    page.locator("[data-waypoint='1']").click()
    page.keyboard.press("Alt+ArrowUp")
    expect(names.nth(0)).to_have_text("P2")
    expect(page.locator("[data-waypoint='0']")).to_be_focused()
    page.keyboard.press("Alt+ArrowDown")
    expect(names.nth(1)).to_have_text("P2")
    page.keyboard.press("Delete")
    expect(names).to_have_count(5)
    for count, kind in enumerate(("Current joint position", "Current pose", "Relative move"), 6):
        add_waypoint(page, kind)
        expect(names).to_have_count(count)
    assert planned(page)


def test_waypoints_are_moved_by_drag(page: Page) -> None:
    page.locator("li", has=page.locator("[data-waypoint='4']")).drag_to(page.locator("[data-waypoint='1']"))
    expect(page.locator("[data-waypoint='1'] strong")).to_have_text("P5")


def test_a_refusal_shows_its_place_and_its_remedy_applies(page: Page) -> None:
    use_request(page, json.dumps(TOO_SHORT))
    refusal = page.get_by_role("alert", name="Refusal")
    expect(refusal).to_contain_text("within the acceleration limit of joint_a1 it takes 0.938868 s")
    expect(refusal).to_contain_text("segment 0, from waypoint 0 to waypoint 1, joint_a1")
    expect(page.locator("li.wrong [data-waypoint='1']")).to_be_visible()
    refusal.get_by_role("button", name="Apply").first.click()
    expect(refusal).to_have_count(0)
    assert "0.939 s" in planned(page)


def test_what_is_out_of_reach_is_said_where(page: Page) -> None:
    page.locator("[data-waypoint='2']").click()
    page.get_by_label("x", exact=True).fill("9000")
    page.keyboard.press("Tab")
    refusal = page.get_by_role("alert", name="Refusal")
    expect(refusal).to_contain_text("“P3” (waypoint 2)")
    expect(refusal).to_contain_text(re.compile(r"nearest that the tool gets is \d+ mm away"))


def test_back_ends_are_compared(page: Page) -> None:
    choose_example(page, "features/pick_and_place")
    page.get_by_role("tab", name="Compare").click()
    page.get_by_role("button", name="Compare all back ends").click()
    rows = page.locator("table.compare tbody tr")
    expect(rows).to_have_count(7)
    expect(page.locator("table.compare thead")).to_contain_text("Effort per second")
    jerks: dict[str, str] = {}
    for row in rows.all():
        duration, _, power, energy, jerk, _, computed = row.locator("td.number").all_inner_texts()
        assert float(duration) > 0.0
        assert float(computed) > 0.0
        assert float(power) > 0.0 < float(energy)
        jerks[row.get_by_role("rowheader").inner_text().strip()] = jerk
    for name in ("cubic", "trapezoidal", "toppra"):  # accelerations jump
        assert jerks[name] == "∞"
    table, panel = (page.locator(part).bounding_box() for part in ("table.compare", ".panel.result"))
    assert table is not None and panel is not None
    assert table["x"] + table["width"] <= panel["x"] + panel["width"]
    assert float(jerks["quintic"]) > 0.0
    page.get_by_role("button", name="Use ruckig").click()
    expect(page.locator(".verdict")).to_contain_text("by ruckig")


def test_the_motion_is_played_and_scrubbed(page: Page) -> None:
    begun = perf_counter()
    page.get_by_role("button", name="Play").click()
    plays(page)
    page.get_by_role("button", name="Pause").click()
    assert 0.2 <= seconds(page) <= perf_counter() - begun
    slider = page.get_by_role("slider", name="Time")
    slider.press("Home")
    assert seconds(page) == 0.0
    slider.press("PageUp")
    assert seconds(page) == pytest.approx(2.529, abs=0.01)
    page.locator(".plot .u-over").first.click(position={"x": 100, "y": 50})
    assert seconds(page) > 3.0


def test_the_plots_are_zoomed_together_and_shown_whole_again(page: Page) -> None:
    plots = [page.locator(".plot").nth(number) for number in (0, 1)]
    surface = plots[0].locator(".u-over")
    box = surface.bounding_box()
    assert box is not None
    width = box["width"]

    def ends() -> list[float]:
        """Return the times at the left and the right end of both plots."""
        times = []
        for plot in plots:
            for at in (1, width - 2):
                plot.locator(".u-over").hover(position={"x": at, "y": 50})
                times.append(float(plot.locator(".u-value").first.inner_text().removesuffix(" s")))
        return times

    assert ends() == pytest.approx([0.0, 25.29, 0.0, 25.29], abs=0.1)
    surface.hover(position={"x": width / 4, "y": 50})
    page.mouse.down()
    surface.hover(position={"x": width / 2, "y": 50})
    page.mouse.up()
    assert ends() == pytest.approx([25.29 / 4, 25.29 / 2] * 2, abs=0.2)
    assert seconds(page) == 0.0  # nobody asked for another time
    surface.dblclick(position={"x": width / 2, "y": 50})
    assert ends() == pytest.approx([0.0, 25.29, 0.0, 25.29], abs=0.1)


FORMATS = {
    "report": (".html", b"<!DOCTYPE html>"),
    "svg": (".svg", b"<?xml"),
    "png": (".png", b"\x89PNG"),
    "json": (".json", b'{"'),
    "csv": (".csv", b"time,segment,position.joint_"),
    "ros2": (".ros2.json", b'{"'),
    "msgpack": (".msgpack", b"\x8a\xa5robot"),
    "npz": (".npz", b"PK"),
    "mcap": (".mcap", b"\x89MCAP0"),
    "urscript": (".script", b"# ngv_refuelling_arm"),
    "urscript_moves": (".moves.script", b"# ngv_refuelling_arm"),
    "krl": (".src", b"DEF plan"),
    "krl_kss5": (".kss5.src", b"DEF plan"),
    "krl_kss8": (".kss8.src", b"DEF plan"),
    "rapid": (".mod", b"MODULE"),
    "rapid_moves": (".moves.mod", b"MODULE"),
    "fanuc_ls": (".ls", b"/PROG"),
    "c_header": (".h", b"// ngv_refuelling_arm"),
}
"""The buttons of the formats, the endings of their files, and the first bytes of the files."""


def test_a_plan_is_saved_in_every_format(page: Page, tmp_path: Path) -> None:
    page.get_by_role("tab", name="Exports").click()
    buttons = page.locator(".wrap").get_by_role("button")
    assert buttons.all_inner_texts() == list(FORMATS)
    starts: dict[str, bytes] = {}
    for name, (ending, start) in FORMATS.items():
        with page.expect_download() as download:
            buttons.get_by_text(name, exact=True).click()
        assert download.value.suggested_filename == f"ngv_refuelling_arm{ending}"
        download.value.save_as(tmp_path / ending)
        starts[name] = (tmp_path / ending).read_bytes()[: len(start)]
    assert starts == {name: start for name, (_, start) in FORMATS.items()}


COMMANDS = {
    "curl": ["bash"],
    "Python": [sys.executable],
    "TypeScript": ["node", "--input-type=module"],
}


def test_the_code_is_copied_and_plans_what_is_shown(page: Page) -> None:
    """The document prints 25.29 s for the six poses."""
    page.get_by_role("tab", name="Exports").click()
    environment = {**os.environ, "NO_PROXY": "127.0.0.1", "no_proxy": "127.0.0.1"}
    for language, command in COMMANDS.items():
        page.get_by_role("button", name=language).click()
        page.get_by_role("button", name="Copy", exact=True).click()
        expect(page.get_by_role("button", name="Copied")).to_be_visible()
        expect(page.get_by_role("button", name="Copy", exact=True)).to_be_visible()
        code = page.evaluate("navigator.clipboard.readText()")
        run = subprocess.run(command, input=code, env=environment, capture_output=True, text=True, check=True)  # noqa: S603
        said = run.stdout
        if language == "curl":
            answer = json.loads(said)
            said = f"{answer['duration']} {answer['certificate']['satisfied']}"
        duration, satisfied = said.split()
        assert float(duration) == pytest.approx(25.29, abs=0.005), language
        assert satisfied.lower() == "true", language


def test_the_path_is_coloured_by_speed_or_by_the_use_of_limits(page: Page) -> None:
    stage = page.locator(".stage canvas")
    drawn(page)
    by_speed = stage.screenshot()
    page.get_by_role("button", name="tool speed 0").click()
    expect(page.get_by_role("button", name="use of limits 0 100 %")).to_be_visible()
    drawn(page)
    assert stage.screenshot() != by_speed


def test_two_tabs_plan_each_its_own(page: Page) -> None:
    other = page.context.new_page()
    other.goto(page.url)
    planned(other)
    choose_example(other, WELDING)
    page.bring_to_front()
    page.locator("[data-waypoint='1']").click()
    page.get_by_label("Duration (s)").fill("9.33")
    page.keyboard.press("Tab")
    expect(page.locator(".verdict")).to_contain_text("27.29 s")
    other.bring_to_front()
    expect(other.locator("[data-waypoint]")).to_have_count(11)
    assert "27.29" not in planned(other)


def test_a_scene_is_shown_with_what_comes_nearest(page: Page) -> None:
    choose_example(page, "documents/refuelling_beside_the_car")
    row = page.locator(".certificate tr", has_text="Clear of the scene")
    expect(row).to_contain_text("link_3 and car_body")
    expect(row).to_contain_text("66 mm / at least 50 mm")
    nearest = page.get_by_role("button", name="nearest: link_3 and car_body, 66 mm at 12.6")  # flat there
    nearest.click()
    assert seconds(page) == pytest.approx(12.65, abs=0.05)
    choose_example(page, "features/around_a_wall")
    expect(page.locator(".mark")).to_have_count(2)
    arrival = page.locator("[data-waypoint='1'] .when").inner_text()
    assert f"Certified, {arrival.strip()}" in planned(page)


def test_a_collision_is_shown_at_its_place_and_its_detour_applies(page: Page, service: RunningService) -> None:
    request = json.loads((ROOT / "examples/around_a_wall.json").read_text())
    del request["waypoints"][1]["motion"]
    problem = service.post("/v1/trajectories", request).json()
    assert problem["pair"] == ["link_3", "wall"]
    depth, time = f"{1000.0 * problem['depth']:.3g} mm", f"{problem['time']:.3f} s"
    use_request(page, json.dumps(request))
    refusal = page.get_by_role("alert", name="Refusal")
    expect(refusal).to_contain_text(f"link_3 and wall: {depth} too near, from {time} on.")
    expect(refusal).to_contain_text("The robot is shown there in red.")
    refusal.get_by_role("button", name="Apply").click()
    expect(refusal).to_have_count(0)
    planned(page)
    expect(page.get_by_role("button", name=re.compile(r"nearest: \S+ and wall"))).to_be_visible()


def test_without_a_plan_no_time_is_shown(browser: Browser, service: RunningService, page: Page) -> None:
    """The address has a time, but its request is refused."""
    with addressed(page):
        page.get_by_role("slider", name="Time").press("PageUp")
    page.locator("[data-waypoint='2']").click()
    with addressed(page):
        page.get_by_label("x", exact=True).fill("9000")
        page.keyboard.press("Tab")
    page.get_by_role("alert", name="Refusal").wait_for()
    with opened(browser, page.url) as other:
        other.get_by_role("alert", name="Refusal").wait_for()
        expect(other.locator("output.time")).to_have_text("no plan")


def test_what_is_no_request_is_said(page: Page) -> None:
    for text, said in (("{", "JSON"), ('{"robot": 1}', "/robot must be the id of a robot; got 1")):
        use_request(page, text)
        expect(page.locator(".wrong-text")).to_contain_text(said)
    use_request(page, json.dumps({**TOO_SHORT, "nonsense": 1}))
    expect(page.get_by_role("alert", name="Refusal")).to_contain_text("nonsense")


@pytest.mark.parametrize("form", ["estimates", "sticks"])
def test_a_robot_without_shapes_is_drawn_by_estimates_or_as_sticks(
    service: RunningService, browser: Browser, form: str
) -> None:
    """It is long and thin, and follows its joints; where sticks begin and end is tested where they are made."""
    service.post("/v1/robots", urdf_robot(urdf_chain(4), id="bare_chain"))
    assert service.client.get("/v1/robots/bare_chain").json().get("geometry", []) == []
    shapes = service.client.get("/v1/robots/bare_chain/geometry").json()["shapes"]
    assert {shape["source"] for shape in shapes} == {"estimate"}

    def answer(route: Route) -> None:
        answered = route.fetch()
        route.fulfill(response=answered, json=answered.json() | {"shapes": []})

    with opened(browser, f"{service.url}/") as page:
        planned(page)
        if form == "sticks":
            page.route("**/v1/robots/bare_chain/geometry", answer)
        page.get_by_label("Robot", exact=True).select_option("bare_chain")
        expect(page.locator("[data-waypoint]")).to_have_count(2)
        assert "Certified" in planned(page)
        page.get_by_role("tab", name="Robot").click()
        changed_colours(page)
        pixels, diagonal = page.evaluate(ARM_PIXELS)
        assert diagonal > 100.0
        assert 0.0 < pixels / diagonal**2 < 0.4
        page.get_by_role("region", name="Joints by hand").get_by_role("slider").nth(1).press("End")
        wait_for_change(page, 100)


def test_a_request_is_saved_to_a_file_and_opened_from_it(page: Page, tmp_path: Path) -> None:
    path = tmp_path / "request.json"
    page.get_by_role("tab", name="Request").click()
    shown = json.loads(page.get_by_label("The request as JSON").input_value())
    with page.expect_download() as download:
        page.get_by_role("button", name="Save file").click()
    download.value.save_as(path)
    assert json.loads(path.read_text()) == shown
    path.write_text(json.dumps(TOO_SHORT | {"backend": {"kind": "quintic"}}))
    page.get_by_label("Open file").set_input_files(path)
    page.get_by_role("alert", name="Refusal").wait_for()
    assert json.loads(page.get_by_label("The request as JSON").input_value())["backend"] == {"kind": "quintic"}


def test_the_stage_is_looked_at_from_axes_and_saved_as_a_picture(page: Page, tmp_path: Path) -> None:
    changed_colours(page)
    for view in ("Front", "Side", "Top", "Home"):
        page.get_by_role("button", name=view, exact=True).click()
        wait_for_change(page, 1000)
    with page.expect_download() as download:
        page.get_by_role("button", name="Picture").click()
    download.value.save_as(tmp_path / "stage.png")
    assert (tmp_path / "stage.png").read_bytes().startswith(b"\x89PNG")
