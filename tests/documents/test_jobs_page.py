"""docs/jobs.md and the requests of examples/jobs equal their scripts' output, and the jobs run as described."""

from __future__ import annotations

import math
import re
import runpy
from typing import Any

import numpy as np
import pytest

from cli.work.local_plan import plan_request, read_request
from docs.tools.jobs import IMAGES, PAGE, document
from planner.kinematics import tool_velocities
from planner.plans.result import Plan
from tests.locations import ROOT

FOLDER = ROOT / "examples/jobs"
SCRIPT = runpy.run_path(str(ROOT / "examples/jobs.py"))
NUMBER = re.compile(r"(?<![\w.])\d+\.\d+")


def planned(name: str) -> Plan:
    return plan_request(read_request((FOLDER / f"{name}.json").read_bytes()))


def speeds(plan: Plan, segment: int) -> Any:
    """Return the tool's speed at 1,000 times of a segment, m/s."""
    trajectory = plan.trajectory
    time = np.linspace(trajectory.departures[segment], trajectory.arrivals[segment + 1], 1_000)
    return np.linalg.norm(tool_velocities(plan.path.robot, *trajectory.evaluate(time, (0, 1)))[0], axis=1)


def test_the_requests_are_what_the_script_writes() -> None:
    written = {f"{job.__name__}.json": SCRIPT["text"](job()) for job in SCRIPT["JOBS"]}
    assert {path.name: path.read_text(encoding="utf-8") for path in FOLDER.iterdir()} == written


@pytest.mark.large_only
def test_the_page_is_what_the_script_makes() -> None:
    """All ten are planned; the result of an optimisation differs slightly between machines."""
    shown, made = PAGE.read_text(encoding="utf-8"), document()
    assert NUMBER.sub("", shown) == NUMBER.sub("", made)
    numbers, expected = ([float(text) for text in NUMBER.findall(page)] for page in (shown, made))
    assert numbers == pytest.approx(expected, rel=0.01)
    assert re.findall(r"\(images/jobs/(.*?)\)", shown) == [f"{job.__name__}.png" for job in SCRIPT["JOBS"]]
    assert sorted(path.name for path in IMAGES.iterdir()) == sorted(f"{job.__name__}.png" for job in SCRIPT["JOBS"])


def test_the_seam_is_welded_at_its_speed() -> None:
    """Two lines of 100 mm and a half circle of 50 mm between arc on and arc off, at 8 mm/s."""
    plan = planned("seam")
    names = [waypoint.name for waypoint in plan.path.waypoints]
    on, off = names.index("arc on"), names.index("arc off")
    seconds = plan.trajectory.arrivals[off] - plan.trajectory.departures[on]
    assert seconds == pytest.approx((0.2 + 0.05 * math.pi) / 0.008, rel=0.01)


def test_the_spray_gun_keeps_its_speed_over_the_panel() -> None:
    """From 100 mm after the turn to 100 mm before the next one."""
    plan = planned("spraying")
    for segment in range(1, 12, 2):
        assert speeds(plan, segment)[150:-150] == pytest.approx(0.4, rel=0.002)


def test_the_glue_flows_without_a_stop() -> None:
    plan = planned("gluing")
    for segment in range(2, 9):
        assert speeds(plan, segment) == pytest.approx(0.15, rel=0.02)
