"""Poses in the frame of a work object equal those poses in the base frame, and remedies use the frame too."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import UnreachableWaypoint
from planner.kinematics import tool_pose
from planner.planning import plan
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import BlendTransition
from planner.robots import load_robot
from planner.spatial import Pose, rotation_from_rpy
from tests.planner.robots.frames import product, rot, trans

KUKA = load_robot("kuka_kr16_2")
HOME = (0.0, -1.5, 1.5, 0.0, 0.5, 0.0)
ANGLES = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
POINTS = st.tuples(*[st.floats(-2.0, 2.0)] * 3)


def matrix(position: tuple[float, ...], rpy: tuple[float, ...]) -> np.ndarray:
    return product(trans(*position), rot("z", rpy[2]), rot("y", rpy[1]), rot("x", rpy[0]))


@given(frame=st.tuples(POINTS, ANGLES), inside=st.tuples(POINTS, ANGLES))
def test_frames_are_homogeneous_matrices(frame: tuple, inside: tuple) -> None:
    placed = Pose.from_rpy(*inside).from_frame(Pose.from_rpy(*frame))
    expected = matrix(*frame) @ matrix(*inside)
    np.testing.assert_allclose(placed.position, expected[:3, 3], atol=1e-12)
    np.testing.assert_allclose(placed.rotation, expected[:3, :3], atol=1e-12)
    back = placed.to_frame(Pose.from_rpy(*frame))
    np.testing.assert_allclose(back.position, inside[0], atol=1e-12)
    np.testing.assert_allclose(back.rotation, rotation_from_rpy(*inside[1]), atol=1e-12)
    point = Pose(np.array(inside[0])).from_frame(Pose.from_rpy(*frame))
    assert point.rotation is None
    np.testing.assert_allclose(point.position, expected[:3, 3], atol=1e-12)
    shifted = Pose.from_rpy(*inside).from_frame(Pose(np.array(frame[0])))
    np.testing.assert_allclose(shifted.position, np.add(*[np.array(part[0]) for part in (frame, inside)]), atol=1e-12)
    np.testing.assert_allclose(shifted.to_frame(Pose(np.array(frame[0]))).position, inside[0], atol=1e-12)


def test_a_list_on_a_pallet_is_the_same_list_in_the_base_frame() -> None:
    home = tool_pose(KUKA, np.array(HOME))
    pallet = Pose.from_rpy([0.9, 0.4, 0.2], [0.1, -0.2, 0.7])
    on_pallet, in_base = [], []
    for k, shift in enumerate(([0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, -0.1])):
        pose = Pose(home.position + np.array(shift), home.rotation)
        more = {} if k == 0 else {"motion": LinearMotion()}
        transition = {"transition": BlendTransition(0.02)} if k == 1 else {}
        in_base.append(PoseWaypoint(pose, **more, **transition))
        on_pallet.append(PoseWaypoint(pose.to_frame(pallet), frame=pallet, **more, **transition))
    first, second = (plan(PlanningProblem(KUKA, waypoints)) for waypoints in (in_base, on_pallet))
    assert first.trajectory.duration == pytest.approx(second.trajectory.duration, rel=1e-9)
    for one, other in zip(first.path.waypoints, second.path.waypoints, strict=True):
        np.testing.assert_allclose(one.position, other.position, atol=1e-9)
        np.testing.assert_allclose(one.pose.position, other.pose.position, atol=1e-9)


@pytest.mark.parametrize("position", [[3.0, 0.0, 0.5], [900.0, 0.0, 200.0]])
def test_remedies_are_in_the_frame_of_the_waypoint(position: list[float]) -> None:
    """The pose is out of reach, and meant in millimetres: the problem with the remedy is planned."""
    frame = Pose.from_rpy([0.2, 0.1, 0.4], [0.0, 0.0, 1.5])
    turned = rotation_from_rpy(0.0, np.pi / 2.0, 0.0)
    problem = PlanningProblem(KUKA, [JointWaypoint(HOME), PoseWaypoint(Pose(position, turned), frame=frame)])
    with pytest.raises(UnreachableWaypoint) as refused:
        plan(problem)
    (remedy,) = [remedy for remedy in refused.value.remedies if remedy.field == ("waypoints", 1, "pose")]
    mended = remedy.applied_to(problem)
    assert isinstance(mended.waypoints[1], PoseWaypoint)
    assert mended.waypoints[1].frame is frame
    reached = plan(mended).path.waypoints[1].pose.position
    np.testing.assert_allclose(reached, mended.waypoints[1].pose_in_base.position, atol=1e-5)
    if position[0] > 100.0:
        np.testing.assert_allclose(mended.waypoints[1].pose.position, np.array(position) / 1000.0)
