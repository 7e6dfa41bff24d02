"""Paths from files: the stage and the page show their extent and their unreachable waypoints first."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from web.tests.browser import changed_colours, opened, planned, shown_request, wait_for_change
from web.tests.test_conditions import violations
from web.tests.test_forms import POSES, fill, more, show

if TYPE_CHECKING:
    from playwright.sync_api import Browser, FilePayload, Locator, Page

    from tests.api.conftest import RunningService

SEAM = "G0 X0 Y0 Z0\nG1 X60 F3000\nG3 X80 Y20 J20\nG1 Y60\nM3\n"
FAR = "x,y,z\n0,0,0\n0.05,0,0\n5,0,0\n"


BY = "\N{MULTIPLICATION SIGN}"


def choose(form: Locator, name: str, text: str) -> None:
    file: FilePayload = {"name": name, "mimeType": "text/plain", "buffer": text.encode()}
    form.get_by_label("Open CSV, G-code, DXF").set_input_files(file)


def test_a_program_is_shown_before_it_is_taken_and_planned(page: Page) -> None:
    """Its frame begins where the tool is; the extent is written in mm, in inch where a person says so."""
    show(page, POSES)
    form = more(page, "Path from a file")
    changed_colours(page)
    choose(form, "seam.ngc", SEAM)
    preview = form.get_by_role("region", name="Path of the file")
    expect(preview).to_contain_text(f"4 waypoints, extent 80.0 {BY} 60.0 {BY} 0.0 mm")
    expect(preview).to_contain_text("The tool reaches every waypoint.")
    expect(preview).to_contain_text("line 5: left out M codes")
    wait_for_change(page, 200)
    assert shown_request(page)["waypoints"] == POSES["waypoints"]
    form.get_by_label("Unit of the file").select_option("inch")
    expect(preview).to_contain_text(f"extent 2032.0 {BY} 1524.0 {BY} 0.0 mm")
    form.get_by_label("Unit of the file").select_option(label="as in the file")
    expect(preview).to_contain_text(f"extent 80.0 {BY} 60.0 {BY} 0.0 mm")
    fill(form.get_by_label("z", exact=True), "300")
    with page.expect_response("**/v1/trajectories"):
        preview.get_by_role("button", name="Add behind the waypoints").click()
    assert "Certified" in planned(page)
    asked = shown_request(page)
    assert len(asked["waypoints"]) == len(POSES["waypoints"]) + 4
    assert asked["frames"]["path"]["position"][2] == pytest.approx(0.3)
    assert asked["waypoints"][5]["motion"]["kind"] == "circular"


def test_waypoints_out_of_reach_and_faults_of_a_file_are_named(page: Page) -> None:
    show(page, POSES)
    form = more(page, "Path from a file")
    choose(form, "far.csv", FAR)
    preview = form.get_by_role("region", name="Path of the file")
    expect(preview).to_contain_text("The tool cannot reach 1 of them: 2.")
    choose(form, "cycle.nc", "G0 X0 Y0 Z0\nG81 X1\n")
    expect(form.get_by_role("alert")).to_contain_text("line 2")
    expect(preview).to_have_count(0)
    choose(form, "seam.NGC", SEAM)
    preview.get_by_role("button", name="Discard").click()
    expect(preview).to_have_count(0)
    assert shown_request(page)["waypoints"] == POSES["waypoints"]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_drawing_is_shown_in_german(browser: Browser, service: RunningService, scheme: str) -> None:
    drawing: list[Any] = [0, "SECTION", 2, "ENTITIES", 0, "LINE", 8, 0, 10, 0, 20, 0, 30, 0, 11, 100, 21, 0, 31, 0]
    text = "\n".join(map(str, [*drawing, 0, "ENDSEC", 0, "EOF", ""]))
    with opened(browser, f"{service.url}/", locale="de-DE", color_scheme=scheme) as page:
        planned(page)
        page.get_by_text("Bahn aus einer Datei").click()
        file: FilePayload = {"name": "line.dxf", "mimeType": "image/vnd.dxf", "buffer": text.encode()}
        page.get_by_label("CSV, G-Code, DXF öffnen").set_input_files(file)
        preview = page.get_by_role("region", name="Bahn der Datei")
        expect(preview).to_contain_text(f"2 Wegpunkte, Ausdehnung 100.0 {BY} 0.0 {BY} 0.0 mm")
        expect(preview).to_contain_text("Die Zeichnung nennt keine bekannte Einheit")
        assert violations(page) == []
