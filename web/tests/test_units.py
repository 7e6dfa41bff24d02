"""The units of lengths and angles that a person chooses."""

from __future__ import annotations

import json
import math
import re

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.api.conftest import RunningService
from web.tests.browser import TOO_SHORT, choose_example, opened, planned, shown_request, use_request
from web.tests.test_conditions import violations

METRES = {"mm": 0.001, "m": 1.0, "in": 0.0254}
RADIANS = {"°": math.pi / 180.0, "rad": 1.0}
OTHERS = {"mm": r"\d (m|in)(\b|/s)", "m": r"\d (mm|in)\b", "in": r"\d (mm|m)(\b|/s)", "°": r"\d rad", "rad": r"\d ?°"}
"""What no number has while a unit is chosen."""


def choose_units(page: Page, length: str, angle: str) -> None:
    page.get_by_label("Unit of lengths").select_option(length)
    page.get_by_label("Unit of angles").select_option(angle)


def typed(page: Page, label: str) -> float:
    return float(page.get_by_label(label, exact=True).first.input_value())


@pytest.mark.parametrize(("width", "length", "angle"), [(390, "in", "rad"), (1280, "m", "°")])
def test_every_number_is_in_the_chosen_units(
    browser: Browser, service: RunningService, width: int, length: str, angle: str
) -> None:
    """The service has the same numbers in m and rad. Notes on robots and warnings are texts of the service."""
    with opened(browser, f"{service.url}/", viewport={"width": width, "height": 844}) as page:
        planned(page)
        choose_example(page, "features/slow_beside_a_walkway")
        choose_units(page, length, angle)
        request = shown_request(page)
        page.get_by_role("tab", name="Certificate").click()
        page.get_by_role("button", name="Tool speed", exact=True).click()
        expect(page.locator(".plot figcaption").nth(0)).to_have_text(f"Position ({angle})")
        expect(page.locator(".plot figcaption").nth(2)).to_have_text(f"Tool speed ({length}/s)")
        zone = request["speed_zones"][0]
        unit = re.escape(length)
        assert typed(page, f"Nearer than ({length})") * METRES[length] == pytest.approx(zone["clearance"], rel=1e-3)
        assert typed(page, f"Speed up to ({length}/s)") * METRES[length] == pytest.approx(zone["speed"], rel=1e-3)
        speed = page.locator(".certificate tr", has_text="Speed nearer than").first.inner_text()
        [told] = re.findall(rf"/ ([\d.]+) {unit}/s", speed)
        assert float(told) * METRES[length] == pytest.approx(zone["speed"], rel=5e-3)
        expect(page.locator(".colour-key")).to_contain_text(f"{length}/s")
        for tab, own in (("Certificate", (".certificate",)), ("Robot", (".sliders", ".jog", ".wide-table"))):
            page.get_by_role("tab", name=tab).click()
            for part in (*own, ".stage", "#waypoints", ".plots"):
                text = page.locator(part).inner_text().replace("\u00a0", " ")
                for chosen in (length, angle):
                    assert not re.search(OTHERS[chosen], text), (part, chosen, text)
        assert violations(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_typed_numbers_are_sent_in_the_units_of_the_service(page: Page) -> None:
    choose_units(page, "in", "rad")
    page.locator("[data-waypoint='4']").click()
    before = shown_request(page)["waypoints"][4]["pose"]["position"]
    assert typed(page, "x") * METRES["in"] == pytest.approx(before[0], abs=1e-6)
    field = page.get_by_label("x", exact=True)
    field.click()
    page.keyboard.press("Control+a")
    page.keyboard.type(f"{typed(page, 'x') + 0.5:.4f}")
    with page.expect_response("**/v1/trajectories"):
        page.keyboard.press("Tab")
    after = shown_request(page)["waypoints"][4]["pose"]["position"]
    assert after == pytest.approx([before[0] + 0.0127, *before[1:]], abs=3e-6)


def test_the_choice_is_kept_and_jogging_has_its_steps(page: Page) -> None:
    choose_units(page, "in", "rad")
    page.reload()
    planned(page)
    expect(page.get_by_label("Unit of lengths")).to_have_value("in")
    expect(page.get_by_label("Unit of angles")).to_have_value("rad")
    page.get_by_role("tab", name="Robot").click()
    height = page.locator(".jog output").nth(2)
    expect(height).to_have_text(re.compile(r"^-?\d+\.\d{3} in$"))
    before = float(height.inner_text().removesuffix(" in"))
    page.get_by_label("Step (in)").select_option("0.1")
    page.get_by_role("button", name="More z").click()
    expect(height).to_have_text(f"{before + 0.1:.3f} in")
    choose_units(page, "mm", "°")
    expect(height).to_have_text(re.compile(r" mm$"))
    expect(page.get_by_label("Step (mm)")).to_be_visible()


def test_refusals_are_in_the_chosen_units(page: Page) -> None:
    """The tool cannot get there: the page says how near it gets."""
    far = {"kind": "pose", "pose": {"position": [5.0, 0.0, 0.5]}}
    use_request(page, json.dumps(TOO_SHORT | {"waypoints": [TOO_SHORT["waypoints"][0], far]}))
    refusal = page.get_by_role("alert", name="Refusal")
    near = refusal.get_by_text("The nearest that the tool gets is")
    expect(near).to_contain_text(re.compile(r"[\d.]+ mm away"))
    told = {}
    for unit in METRES:
        choose_units(page, unit, "°")
        expect(near).to_contain_text(f" {unit} away")
        told[unit] = float(re.findall(rf"([\d.]+) {unit} away", near.inner_text())[0]) * METRES[unit]
    assert told["in"] == pytest.approx(told["m"], rel=6e-3)
    assert told["mm"] == pytest.approx(told["m"], rel=6e-3)
