"""Titles and units of the quantities of the certificate."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import pytest

from planner.backends import Cubic
from planner.certificate import Check
from planner.guarantees import QUANTITIES
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.quantities import MEASURES
from planner.robots import load_robot
from tests.locations import ROOT

CHECK = Check("velocity", "joint_1", 1.0, None, None, 0.0, "exact", enforced=True, bounded=True)


def test_no_check_is_made_of_a_quantity_without_a_unit() -> None:
    with pytest.raises(ValueError, match="snap"):
        replace(CHECK, quantity="snap")


def test_everything_that_can_be_limited_has_a_title_of_its_own() -> None:
    assert set(QUANTITIES) <= set(MEASURES)
    assert len({measure.title for measure in MEASURES.values()}) == len(MEASURES)


def test_units_are_those_of_joints_that_turn_or_slide() -> None:
    """The second joint of RPPRRR slides."""
    robot = load_robot("date_sorting_arm")
    units = [replace(CHECK, joint=name).unit(robot) for name in robot.joint_names]
    assert units == ["rad/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s"]
    waypoints = [JointWaypoint(robot.middle), JointWaypoint(robot.middle + 0.1)]
    checks = plan(PlanningProblem(robot, waypoints), Cubic()).certificate.checks
    assert {check.unit(robot) for check in checks} <= {"rad", "m", "rad/s", "m/s", "rad/s²", "m/s²", "rad/s³", "m/s³"}


def test_the_page_is_given_the_same_titles_and_units() -> None:
    """The table of the page's build has all of them in JSON."""
    command = [sys.executable, "web/quantities.py"]
    ran = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    assert json.loads(ran.stdout) == {name: measure._asdict() for name, measure in MEASURES.items()}
