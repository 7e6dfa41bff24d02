"""Constraints on the tool of a free motion: chosen, drawn, planned and checked."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from tests.locations import ROOT
from web.tests.browser import changed_colours, opened, planned, shown_request, wait_for_change
from web.tests.test_conditions import violations
from web.tests.test_forms import POSES, fill, show

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from tests.api.conftest import RunningService

KINDS = {
    "orientation": ("its orientation", "Tool off its orientation"),
    "box": ("inside a box", "Tool beyond its box"),
    "half_space": ("on one side of a border", "Tool beyond its half-space"),
    "plane": ("near a plane", "Tool off its plane"),
    "line": ("near a line", "Tool off its line"),
}
"""The kinds besides the first: the page's words, and the title of the check."""


def add_constraint(page: Page) -> None:
    page.locator("[data-waypoint='2']").click()
    with page.expect_response("**/v1/trajectories"):
        page.get_by_label("Motion to here").select_option(label="around obstacles")
    with page.expect_response("**/v1/trajectories"):
        page.get_by_role("button", name="+ Constraint on the tool").click()


def test_each_kind_of_constraint_is_chosen_drawn_and_certified(page: Page) -> None:
    """Each begins with values that both ends of the motion keep."""
    show(page, POSES)
    changed_colours(page)
    add_constraint(page)
    assert "Certified" in planned(page)
    wait_for_change(page, 200)
    for kind, (words, title) in KINDS.items():
        with page.expect_response("**/v1/trajectories"):
            page.get_by_label("The tool keeps").select_option(label=words)
        assert "Certified" in planned(page), kind
        wait_for_change(page, 200)
        page.get_by_role("tab", name="Certificate").click()
        expect(page.locator(".certificate tbody")).to_contain_text(title)
        assert shown_request(page)["waypoints"][2]["motion"]["keep"][0]["kind"] == kind
    page.get_by_role("button", name="Remove constraint 0").click()
    assert shown_request(page)["waypoints"][2]["motion"] == {"kind": "free"}


def test_values_of_a_constraint_are_written_in_the_units_of_people(page: Page) -> None:
    show(page, POSES)
    add_constraint(page)
    with page.expect_response("**/v1/trajectories"):
        fill(page.get_by_label("Largest angle (°)"), "15")
    (constraint,) = shown_request(page)["waypoints"][2]["motion"]["keep"]
    assert constraint["angle"] == pytest.approx(math.radians(15.0), rel=1e-9)
    assert constraint["direction"] == pytest.approx([0.0, 0.0, -1.0], abs=1e-6)
    fill(page.get_by_role("group", name="Direction").get_by_label("z", exact=True), "0")
    assert shown_request(page)["waypoints"][2]["motion"]["keep"] == [constraint]  # no direction has length 0
    page.get_by_label("The tool keeps").select_option(label="inside a box")
    with page.expect_response("**/v1/trajectories"):
        fill(page.get_by_role("group", name="Size").get_by_label("x", exact=True), "350")
    (box,) = shown_request(page)["waypoints"][2]["motion"]["keep"]
    assert box["size"][0] == 0.35
    assert "Certified" in planned(page)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_constraints_of_an_example_are_shown_in_german(browser: Browser, service: RunningService, scheme: str) -> None:
    """They are the orientation of a tray and the box that it stays in."""
    example = json.loads((ROOT / "examples/level_tray.json").read_text())
    with opened(browser, f"{service.url}/", locale="de-DE", color_scheme=scheme) as page:
        planned(page)
        page.get_by_role("tab", name="Anfrage").click()
        page.get_by_label("Die Anfrage als JSON").fill(json.dumps(example))
        with page.expect_response("**/v1/trajectories"):
            page.get_by_role("button", name="Diese Anfrage verwenden").click()
        page.locator("[data-waypoint='1']").click()
        kinds = page.get_by_label("Das Werkzeug bleibt")
        expect(kinds.nth(0)).to_have_value("orientation")
        expect(kinds.nth(1)).to_have_value("box")
        expect(page.get_by_role("group", name="Bedingung 1")).to_contain_text("Das Werkzeug bleibt im Quader")
        planned(page)
        assert violations(page) == []
