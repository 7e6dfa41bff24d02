"""The work to plan long contours."""

from __future__ import annotations

import sys
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner.backends.ruckig.ruckig import Ruckig
from planner.backends.trapezoidal.trapezoidal import Trapezoidal
from planner.kinematics.forward import tool_pose
from planner.planning import plan
from planner.problems.problem import LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import BlendTransition
from planner.robots import load_robot
from planner.spatial import Pose

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

GROWTH = 1.5
"""Allowed work for a contour with four times as many points, relative to four times the work for the shorter one. It is
linear, apart from the needs of single points."""


def contour(count: int) -> PlanningProblem:
    """Return a closed wavy contour of `count` points, blended, the tool pointing down."""
    robot = load_robot("kuka_kr16_2")
    center = tool_pose(robot, [0.0, -1.57, 1.57, 0.0, 1.57, 0.0])
    angles = np.linspace(0.0, 6.0, count)
    radii = 0.2 * (1.0 + 0.2 * np.sin(5.0 * angles))
    points = center.position + np.stack([radii * np.cos(angles) - 0.24, radii * np.sin(angles), 0.0 * angles], axis=1)
    blend = BlendTransition(0.25 * float(np.linalg.norm(np.diff(points, axis=0), axis=1).min()))
    corners = [
        PoseWaypoint(pose=Pose(point, center.rotation), motion=LinearMotion(), transition=blend) for point in points[1:]
    ]
    last = PoseWaypoint(pose=corners[-1].pose, motion=LinearMotion())
    return PlanningProblem(robot, (PoseWaypoint(pose=Pose(points[0], center.rotation)), *corners[:-1], last))


@pytest.mark.parametrize("backend", [Trapezoidal(), Ruckig()], ids=lambda backend: backend.kind)
def test_the_work_to_plan_a_contour_grows_with_its_length(backend: Trapezoidal | Ruckig) -> None:
    """Calls of functions of Python measure the work, independently of the machine's load."""
    short, long = (calls_of(partial(plan, contour(count), backend)) for count in (20, 80))
    assert long < 4.0 * GROWTH * short


def calls_of(work: Callable[[], object]) -> int:
    """Count the calls of Python functions."""
    calls = 0

    def count(_frame: FrameType, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    sys.setprofile(count)
    try:
        work()
    finally:
        sys.setprofile(None)
    return calls
