"""Joint motions beside motions of the tool that end near a singularity, where the joints' slopes have no bound."""

from __future__ import annotations

import numpy as np
import pytest

from planner.backends import Quintic, Ruckig, Toppra
from planner.backends.base import BackEnd
from planner.planning import plan
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import ThroughTransition
from planner.robots import Robot
from planner.robots.dh import DHJoint
from planner.spatial import Pose

LINKS = 0.4, 0.3
TURNED = 0.5


def two_links() -> Robot:
    return Robot.from_dh([DHJoint(kind="continuous", theta=0.0, d=0.0, a=length, alpha=0.0) for length in LINKS])


@pytest.mark.long_table
@pytest.mark.parametrize("backend", [Quintic(), Toppra(), Ruckig()], ids=lambda backend: backend.kind)
@pytest.mark.parametrize("short", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("backwards", [False, True])
def test_no_joint_swings_far_beyond_its_goal(backend: BackEnd, short: float, backwards: bool) -> None:
    """The line ends so many metres before full stretch, where the elbow follows the root of the remaining distance.

    Beyond the line, no joint goes further than the length of its joint motion. On the line no joint turns by more than
    from its start to its end. The tool stays on the line until its end (law of cosines, not our inverse kinematics).
    """
    robot, start, goal = two_links(), np.array([0.3, 1.0]), np.array([TURNED, 0.5])
    stretched = PoseWaypoint(
        Pose(np.array([sum(LINKS) - short, 0.0, 0.0])),
        motion=LinearMotion(singularity="slow"),
        transition=ThroughTransition(),
    )
    waypoints = [JointWaypoint(start), stretched, JointWaypoint(goal)]
    if backwards:
        line = PoseWaypoint(_tool_at(start), motion=LinearMotion(singularity="slow"))
        before = PoseWaypoint(stretched.pose, transition=ThroughTransition())
        waypoints = [JointWaypoint(goal), before, line]
    trajectory = plan(PlanningProblem(robot, waypoints), backend).trajectory
    q = trajectory.evaluate(np.linspace(0.0, trajectory.duration, 1001), [0])[0]
    assert np.abs(q[:, 1]).max() < 1.0 + 2.0 * TURNED
    assert np.ptp(q[:, 0]) < 1.0 + 2.0 * TURNED
    along = trajectory.segments[trajectory.locate(np.linspace(0.0, trajectory.duration, 1001))[0]] == int(backwards)
    ends = _tool_at(start).position, stretched.pose.position
    direction = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    for row in q[along]:
        beside = np.cross(_tool_at(row).position - ends[0], direction)
        assert np.abs(beside).max() < 1e-4


def _tool_at(q: np.ndarray) -> Pose:
    first, second = LINKS
    x, y = (turn(q[0]) * first + turn(q[0] + q[1]) * second for turn in (np.cos, np.sin))
    return Pose(np.array([x, y, 0.0]))
