"""Circles through a pose with a rotation: the tool turns on by way of it, also by more than half a turn."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.certificate.lines_and_circles import Circle
from planner.spatial import rotation_from_rpy
from planner.tool_motions.pose_paths import Arc

DOWN = np.diag([1.0, -1.0, -1.0])
CENTER = np.array([0.5, 0.0, 0.4])


def on_circle(angle: float, turn: float, radius: float = 0.1) -> planner.Pose:
    """Return a pose on a level circle, turned about the vertical."""
    spoke = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
    return planner.Pose(CENTER + spoke, rotation_from_rpy(0.0, 0.0, turn) @ DOWN)


def parabola(share: float, at_share: float, end: float, u: float) -> float:
    """Return the value at u of the parabola through 0, `at_share` at `share` and `end` at 1."""
    return float(np.polyval(np.polyfit([0.0, share, 1.0], [0.0, at_share, end], 2), u))


def turned_by_certificate(poses: list[planner.Pose], u: float) -> np.ndarray:
    """Return the rotation (3, 3) that the certificate expects at u."""
    _, rotations = Circle.through(*poses).poses(np.array([u]))
    assert rotations is not None
    return np.asarray(rotations[0])


TURNED = [
    (degrees, share)
    for degrees in (-330.0, -270.0, -180.0, -90.0, 90.0, 170.0, 180.0, 190.0, 270.0, 330.0, 359.0)
    for share in (0.1, 0.3, 0.5, 0.6)
    if abs(degrees) * max(share, 1.0 - share) < 180.0
]
"""Whole turns, degrees, and the share at via, from which less than half a turn leads to both ends."""


@pytest.mark.parametrize(("degrees", "share"), TURNED)
def test_tool_that_turns_evenly_to_via_goes_on_to_the_end(degrees: float, share: float) -> None:
    """The truth: the tool turns with the spoke, as a nozzle along a seam."""
    angle = np.radians(degrees)
    poses = [on_circle(u * angle, u * angle) for u in (0.0, share, 1.0)]
    arc, circle = Arc.through(*poses), Circle.through(*poses)
    shares = np.linspace(0.0, 1.0, 41)
    wanted = [on_circle(u * angle, u * angle) for u in shares.tolist()]
    positions, rotations = circle.poses(shares)
    assert rotations is not None
    for k, u in enumerate(shares.tolist()):
        for pose in (arc.pose(u), planner.Pose(positions[k], rotations[k])):
            assert pose.position == pytest.approx(wanted[k].position, abs=1e-9)
            assert pose.rotation == pytest.approx(wanted[k].rotation, abs=1e-7)


def test_tool_that_is_turned_back_at_the_end_turns_back() -> None:
    """A turn to one side until via, and then the shorter way to the end, which lies before via."""
    poses = [on_circle(0.0, 0.0), on_circle(1.5, 1.7), on_circle(3.0, 0.2)]
    for u, turn in ((0.5, 1.7), (1.0, 0.2)):
        for found in (Arc.through(*poses).pose(u).rotation, turned_by_certificate(poses, u)):
            assert found == pytest.approx(on_circle(0.0, turn).rotation, abs=1e-9)


@pytest.mark.parametrize("share", [0.02, 0.1, 0.9])
def test_small_turn_soon_after_the_start_does_not_go_round(share: float) -> None:
    poses = [on_circle(0.0, 0.0), on_circle(6.0 * share, 0.4), on_circle(6.0, -0.3)]
    for u in np.linspace(0.0, 1.0, 21).tolist():
        for found in (Arc.through(*poses).pose(u).rotation, turned_by_certificate(poses, u)):
            assert found is not None
            assert found == pytest.approx(on_circle(0.0, parabola(share, 0.4, -0.3, u)).rotation, abs=1e-9)


def test_plan_of_three_quarters_of_a_turn_keeps_to_the_circle() -> None:
    """Dense forward kinematics against the spoke."""
    robot, angle = planner.load_robot("kuka_kr16_2"), 1.5 * np.pi
    at = np.array([1.2, 0.0, 1.0]) - CENTER
    start, via, end = (
        planner.Pose(pose.position + at, pose.rotation)
        for pose in (on_circle(u * angle - 2.0, u * angle - 2.0) for u in (0.0, 0.5, 1.0))
    )
    circle = planner.PoseWaypoint(end, motion=planner.CircularMotion(via))
    plan = planner.plan(planner.PlanningProblem(robot, [planner.PoseWaypoint(start), circle]), "toppra")
    for position in plan.trajectory(plan.trajectory.sample_times(0.02)):
        reached = planner.forward_kinematics(robot, position)
        away = reached.position - CENTER - at
        turn = np.arctan2(away[1], away[0])
        assert reached.rotation == pytest.approx(rotation_from_rpy(0.0, 0.0, turn) @ DOWN, abs=3e-3)
