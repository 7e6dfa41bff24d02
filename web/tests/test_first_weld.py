"""A new user's actions for a weld with six waypoints, counted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from playwright.sync_api import expect

from web.tests.browser import drawn, planned, shown_request

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

    from tests.api.conftest import RunningService

MOST_ACTIONS = 20


@dataclass
class Hand:
    """A user, whose clicks, choices and typed values count as one action each."""

    page: Page
    actions: int = 0

    def click(self, target: Locator) -> None:
        self.actions += 1
        target.click()
        self.settle()

    def choose(self, label: str, option: str) -> None:
        self.actions += 1
        self.page.get_by_label(label, exact=True).select_option(label=option)
        self.settle()

    def type(self, label: str, value: str) -> None:
        self.actions += 1
        field = self.page.get_by_label(label)
        field.fill(value)
        field.press("Tab")
        self.settle()

    def press(self, key: str) -> None:
        self.actions += 1
        self.page.keyboard.press(key)
        self.settle()

    def settle(self) -> None:
        """Look until the page shows the plan of the action."""
        drawn(self.page)
        planned(self.page)

    def jog(self, step: str) -> None:
        before = self.page.locator(".jog").inner_text()
        self.click(self.page.get_by_role("button", name=step, exact=True))
        self.page.wait_for_function("(before) => document.querySelector('.jog').innerText !== before", arg=before)

    def add(self) -> None:
        rows = self.page.locator("[data-waypoint]")
        count = rows.count()
        self.click(self.page.get_by_role("button", name="Add as waypoint"))
        expect(rows).to_have_count(count + 1)
        expect(self.page.locator(f"[data-waypoint='{count}'] .when")).to_contain_text("s")


def test_a_weld_with_six_waypoints_takes_a_new_user_few_actions(page: Page, service: RunningService) -> None:
    """From the home position to an approach, along two sides of a part, up again; the seams are lines at 15 mm/s."""
    hand = Hand(page)
    hand.choose("Robot", "kuka_kr16_2")
    expect(page.locator("[data-waypoint]")).to_have_count(2)
    hand.click(page.get_by_role("tab", name="Robot"))
    hand.choose("Step (mm)", "50")
    for step, is_seam in (("Less x", False), ("Less z", False), ("More y", True), ("Less x", True), ("More z", False)):
        hand.jog(step)
        hand.add()
        if is_seam:
            hand.choose("Motion to here", "line")
            hand.type("Tool speed up to (mm/s)", "15")
    hand.click(page.locator("[data-waypoint='6']"))
    hand.press("Delete")
    expect(page.locator("[data-waypoint]")).to_have_count(6)
    assert "Certified" in planned(page)
    request = shown_request(page)
    print(f"{hand.actions} actions")
    assert hand.actions <= MOST_ACTIONS
    answer = service.post("/v1/trajectories", request | {"include": ["tcp_pose", "tcp_velocity"]}).json()
    corners = [np.array(waypoint["pose"]["position"]) for waypoint in answer["waypoints"]]
    sides = np.diff(corners, axis=0)[1:]
    expected = 0.05 * np.array([[0, 0, -1], [0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(sides, expected, atol=1e-4)
    segments = np.array(answer["samples"]["segment"])
    speeds = np.linalg.norm(answer["samples"]["tcp_velocity"]["linear"], axis=1)
    assert speeds[(segments == 2) | (segments == 3)].max() <= 0.015 * (1.0 + 1e-6)
