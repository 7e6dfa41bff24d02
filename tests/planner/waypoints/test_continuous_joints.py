"""Continuous joints between joint waypoints: the shorter direction, or all turns as given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.backends import Cubic, Ruckig, Toppra
from planner.kinematics import FloatArray, forward_kinematics
from planner.planning import plan
from planner.problems.problem import JointMotion, JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint, Turns
from planner.robots import DHJoint, Robot
from planner.spatial import Pose

TURN = 2.0 * np.pi
PLANAR = Robot.from_dh(
    [
        DHJoint("continuous", a=0.4, velocity=2.0),
        DHJoint("revolute", a=0.3, lower=-3.2, upper=3.2, velocity=2.0),
        DHJoint("continuous", alpha=1.0, velocity=2.0),
    ]
)
"""The first and the last joint are continuous; the second has a range of more than a turn."""


def reached(*waypoints: JointWaypoint | PoseWaypoint) -> FloatArray:
    made = plan(PlanningProblem(PLANAR, waypoints), Cubic())
    positions: FloatArray = made.trajectory.evaluate(made.trajectory.arrivals, [0])[0]
    assert made.path.positions == pytest.approx(positions, abs=1e-9)
    return positions


def joints(*position: float, turns: Turns = "nearest") -> JointWaypoint:
    return JointWaypoint(position, motion=JointMotion(turns))


def test_the_short_way_and_the_long_one() -> None:
    """From 3.1 to -3.1 the short path is 0.083 rad; a joint with limits has only one path."""
    start = JointWaypoint([3.1, 3.1, -3.1])
    short = reached(start, joints(-3.1, -3.1, 3.1))
    assert short[-1] == pytest.approx([TURN - 3.1, -3.1, 3.1 - TURN])
    long = reached(start, joints(-3.1, -3.1, 3.1, turns="as_given"))
    assert long[-1] == pytest.approx([-3.1, -3.1, 3.1])
    assert np.array([long[0], short[0]]) == pytest.approx(np.array([[3.1, 3.1, -3.1]] * 2))


def test_the_short_way_takes_less_time() -> None:
    start = JointWaypoint([3.1, 0.0, 0.0])
    for backend in (Cubic(), Toppra(), Ruckig()):
        short, long = (
            plan(PlanningProblem(PLANAR, [start, joints(-3.1, 0.0, 0.0, turns=turns)]), backend).trajectory.duration
            for turns in ("nearest", "as_given")
        )
        assert short < 0.3 * long


def test_the_way_goes_on_from_where_the_joint_is() -> None:
    """Small steps cross the end of the range of angles, as in programs that keep angles within it."""
    angles = 2.5 + 0.4 * np.arange(40)
    written = (angles + np.pi) % TURN - np.pi
    positions = reached(JointWaypoint([2.5, 0.1, 0.0]), *(joints(float(a), 0.1, 0.0) for a in written[1:]))
    assert positions[:, 0] == pytest.approx(angles)


def test_whole_turns_are_counted_where_they_are_written() -> None:
    """A screwdriver turns twice and back."""
    positions = reached(JointWaypoint([0.0, 0.1, 0.5]), joints(0.0, 0.1, 0.5 + 2.0 * TURN), joints(0.0, 0.1, 0.5))
    assert positions[:, 2] == pytest.approx([0.5, 0.5 + 2.0 * TURN, 0.5])
    half = reached(JointWaypoint([0.0, 0.1, -np.pi / 2.0]), joints(0.0, 0.1, np.pi))
    assert half[1, 2] == pytest.approx(-np.pi)  # by a quarter of a turn


def test_after_a_pose_and_along_a_line() -> None:
    (home,) = forward_kinematics(PLANAR, np.array([[3.0, 1.0, 0.2]]))
    after_pose = reached(JointWaypoint([3.1, 0.9, 0.2]), PoseWaypoint(Pose(home.position)), joints(-3.05, 1.0, 0.2))
    assert np.abs(np.diff(after_pose[:, 0])).max() < 1.0
    line = JointWaypoint([-3.1, 1.0, 0.2], motion=LinearMotion())
    along = reached(JointWaypoint([3.1, 1.0, 0.2]), line)
    assert along[-1] == pytest.approx([TURN - 3.1, 1.0, 0.2], abs=1e-6)


def test_random_lists_go_the_short_way_at_every_waypoint() -> None:
    rng = np.random.default_rng(7)
    for _ in range(20):
        requested = rng.uniform(-np.pi, np.pi, (6, 3)) * [1.0, 0.5, 1.0]
        positions = reached(*(joints(*q) for q in requested.tolist()))
        steps = np.diff(positions, axis=0)
        assert (np.abs(steps[:, [0, 2]]) <= np.pi + 1e-9).all()
        turns = (positions - requested) / TURN
        assert turns == pytest.approx(np.round(turns), abs=1e-9)
        assert (turns[0] == 0.0).all()
        literal = reached(*(replace(joints(*q), motion=JointMotion("as_given")) for q in requested.tolist()))
        assert literal == pytest.approx(requested)
