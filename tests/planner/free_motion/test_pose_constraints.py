"""Free motions that keep constraints on the tool: against Pinocchio, dense samples, and ends that break them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.constraints.kept_poses import KeptPoses
from planner.problems.motion_around import FreeMotion
from planner.scene import Scene, SceneObject
from planner.shapes import Box
from planner.trajectories.polynomials import PiecewisePolynomial

if TYPE_CHECKING:
    from planner.constraints.pose_constraints import PoseConstraint
    from planner.spatial import FloatArray

ROBOTS = ("ur5e", "fr3")
DOWN = (0.0, 0.0, -1.0)
SAMPLES = 2_000
HOME = {"ur5e": [0.0, -1.5, 1.9, -1.97, -1.57, 0.0], "fr3": [0.0, -0.4, 0.0, -2.2, 0.0, 1.8, 0.8]}
"""Joint positions in which the tool points down."""


def poses_by_pinocchio(robot: planner.Robot, positions: FloatArray) -> list[pin.SE3]:
    """Return the poses of the tool by Pinocchio's own forward kinematics."""
    poses = []
    for position in positions:
        pin.framesForwardKinematics(robot.model, robot.data, position)
        poses.append(robot.data.oMf[robot.tool_frame_id].copy())
    return poses


def value_of(kept: PoseConstraint, pose: pin.SE3) -> float:
    """Return the value of a constraint, by formulas other than the library's."""
    p = pose.translation
    match kept:
        case planner.ToolAxis():
            axis = pose.rotation @ (np.array(kept.axis) / np.linalg.norm(kept.axis))
            across = np.linalg.norm(np.cross(axis, kept.direction))
            return float(np.arctan2(across, axis @ np.array(kept.direction)))
        case planner.ToolOrientation():
            xyzw = np.array(kept.orientation) / np.linalg.norm(kept.orientation)
            return float(np.linalg.norm(pin.log3(pin.Quaternion(xyzw).matrix().T @ pose.rotation)))
        case planner.ToolNearPlane():
            normal = np.array(kept.normal)
            return float(abs(p @ normal - np.array(kept.point) @ normal) / np.linalg.norm(normal))
        case planner.ToolNearLine():
            area = np.linalg.norm(np.cross(p - np.array(kept.point), kept.direction))
            return float(area / np.linalg.norm(kept.direction))
        case planner.ToolInBox():
            own = pin.SE3(np.eye(3) if kept.pose.rotation is None else kept.pose.rotation, kept.pose.position)
            corner = np.array(kept.size) / 2.0
            inside = own.actInv(p)
            return float(max((inside - corner).max(), (-corner - inside).max()))
        case planner.ToolInHalfSpace():
            return float((p @ np.array(kept.normal)) / np.linalg.norm(kept.normal) - kept.offset)
    raise TypeError(kept)


def largest_value(
    kept: PoseConstraint, robot: planner.Robot, motion: PiecewisePolynomial, samples: int = SAMPLES
) -> float:
    """Return the largest value at dense samples of a motion."""
    times = np.linspace(0.0, motion.breakpoints[-1], samples)
    return max(value_of(kept, pose) for pose in poses_by_pinocchio(robot, motion.evaluate(times, [0])[0]))


def kinds_around(robot: planner.Robot, position: list[float]) -> dict[str, PoseConstraint]:
    """Return a constraint of each kind that a joint position keeps with room."""
    pose = planner.forward_kinematics(robot, position)
    at, rotation = pose.position, pose.rotation
    x, y, z = at.tolist()
    quaternion = pin.Quaternion(rotation).coeffs().tolist()
    along = np.cross([0.0, 0.0, 1.0], at).tolist()
    return {
        "axis": planner.ToolAxis(tuple(2.0 * rotation[:, 2]), 0.15),
        "orientation": planner.ToolOrientation(tuple(quaternion), 0.2),
        "plane": planner.ToolNearPlane((0.1, 0.2, z), (0.0, 0.0, -3.0), 0.02),
        "line": planner.ToolNearLine((x, y, z), tuple(along), 0.15),
        "box": planner.ToolInBox(planner.Pose([x, y, z]), (0.3, 1.4, 0.4)),
        "half-space": planner.ToolInHalfSpace((0.0, 0.0, 2.0), z + 0.05),
    }


KINDS = ("axis", "orientation", "plane", "line", "box", "half-space")
DETOURS = (
    ("fr3", "axis"),
    ("fr3", "line"),
    ("fr3", "box"),
    ("fr3", "half-space"),
    ("ur5e", "orientation"),
    ("ur5e", "plane"),
    ("ur5e", "axis and plane"),
    ("ur5e", "orientation and half-space"),
)


@pytest.mark.long_table
@pytest.mark.parametrize(("name", "kind"), DETOURS)
def test_no_sample_of_a_detour_around_a_box_breaks_a_constraint(name: str, kind: str) -> None:
    robot, rng = planner.load_robot(name), np.random.default_rng(7)
    corners = 0
    for _ in range(2):
        if corners:
            break
        middle = np.array(HOME[name]) + rng.uniform(-0.05, 0.05, robot.dof)
        every = kinds_around(robot, middle.tolist())
        keep = tuple(every[own] for own in kind.split(" and "))
        turn = np.eye(robot.dof)[0] * rng.uniform(0.4, 0.5)
        start, end = (KeptPoses(robot, keep).projected(middle + side * turn) for side in (-1.0, 1.0))
        assert start is not None and end is not None
        at = planner.forward_kinematics(robot, middle.tolist()).position
        box = SceneObject("box", [Box([0.05, 0.05, 0.1])], planner.Pose(np.add(at, [0.03, 0.0, 0.05])))
        motion = FreeMotion(most_checks=3000, keep=keep)
        waypoints = (planner.JointWaypoint(start.tolist()), planner.JointWaypoint(end.tolist(), motion=motion))
        try:
            plan = planner.plan(planner.PlanningProblem(robot, waypoints, scene=Scene([box])))
        except planner.NoPathFound:
            continue  # the search has a budget
        corners += plan.detours[0].has_corners
        for own in keep:
            worst = largest_value(own, robot, plan.trajectory)
            (check,) = [check for check in plan.certificate.checks if check.quantity == own.quantity]
            assert worst <= check.peak + 1e-9
            assert worst <= own.limit + 2e-6
            assert check.method == "bounded"
    assert corners


@pytest.mark.long_table
@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("kind", KINDS)
def test_the_bound_of_random_motions_is_above_dense_samples_and_near_them_at_the_limit(name: str, kind: str) -> None:
    robot, rng = planner.load_robot(name).with_tool(planner.Pose([0.1, 0.0, 0.2])), np.random.default_rng(3)
    for _ in range(3):
        motion = PiecewisePolynomial(rng.uniform(0.3, 1.5, 2), rng.uniform(-1.0, 1.0, (2, robot.dof, 4)))
        kept = kinds_around(robot, motion.evaluate(np.array([0.4]), [0])[0][0].tolist())[kind]
        if isinstance(kept, planner.ToolAxis):
            kept = planner.ToolAxis(tuple(np.array(kept.direction) / 2.0), 0.5)
        worst = largest_value(kept, robot, motion, 2000)
        (found,) = KeptPoses(robot, (kept,)).largest_values(motion)
        assert found.reached <= found.bound
        assert worst <= found.bound + 1e-9
        assert found.bound <= worst + 0.002 * (1.0 + abs(worst - kept.limit)) / max(0.1, np.sin(min(worst, 3.0)))


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("kind", KINDS)
def test_slopes_equal_finite_differences(name: str, kind: str) -> None:
    robot, rng = planner.load_robot(name), np.random.default_rng(11)
    for _ in range(5):
        kept = kinds_around(robot, rng.uniform(-1.0, 1.0, robot.dof).tolist())[kind]
        if isinstance(kept, planner.ToolAxis):
            kept = planner.ToolAxis(tuple(np.array(kept.direction) / 2.0), 0.5)
        pose = planner.forward_kinematics(robot, rng.uniform(-1.0, 1.0, robot.dof).tolist())
        here = pin.SE3(pose.rotation, pose.position)
        slope = kept.slope(pose.position, pose.rotation)
        for k, step in enumerate(1e-6 * np.eye(6)):
            moved = [pin.SE3(pin.exp3(s * step[3:]) @ here.rotation, here.translation + s * step[:3]) for s in (-1, 1)]
            difference = (value_of(kept, moved[1]) - value_of(kept, moved[0])) / 2e-6
            assert slope[k] == pytest.approx(difference, abs=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_an_end_that_breaks_a_constraint_is_refused_with_its_waypoint_and_value(kind: str) -> None:
    robot = planner.load_robot("ur5e")
    kept = kinds_around(robot, HOME["ur5e"])[kind]
    drawn = np.array(HOME["ur5e"]) + np.random.default_rng(2).uniform(-0.8, 0.8, (100, 6))
    values = np.array([value_of(kept, pose) for pose in poses_by_pinocchio(robot, drawn)])
    outside, value = drawn[values.argmax()].tolist(), float(values.max())
    for order, broken in (((HOME["ur5e"], outside), 1), ((outside, HOME["ur5e"]), 0)):
        waypoints = (planner.JointWaypoint(order[0]), planner.JointWaypoint(order[1], motion=FreeMotion(keep=(kept,))))
        with pytest.raises(planner.InvalidProblem, match=f"got {value:.4g} (rad|m) ") as refusal:
            planner.plan(planner.PlanningProblem(robot, waypoints))
        assert refusal.value.faults[0][0] == ("waypoints", broken)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_motion_may_begin_on_the_border_of_a_constraint(name: str) -> None:
    robot = planner.load_robot(name)
    for end in (0.5, -0.5):
        start, goal = np.array(HOME[name]), np.array(HOME[name]) + end * np.eye(robot.dof)[0]
        first = planner.forward_kinematics(robot, start.tolist())
        z = float(first.position[2])
        tilted = np.array([0.2, 0.0, 1.0]) / np.linalg.norm([0.2, 0.0, 1.0])
        angle = float(np.arccos(first.rotation[:, 2] @ -tilted))
        goal_angle = float(np.arccos(planner.forward_kinematics(robot, goal.tolist()).rotation[:, 2] @ -tilted))
        for kept in (
            planner.ToolInHalfSpace((0.0, 0.0, 1.0), z),
            planner.ToolInBox(planner.Pose([0.0, 0.0, z - 0.2]), (3.0, 3.0, 0.4)),
            planner.ToolNearPlane((0.0, 0.0, z + 0.02), (0.0, 0.0, 1.0), 0.02),
            planner.ToolAxis(tuple(-tilted), max(angle, goal_angle)),
        ):
            waypoints = (
                planner.JointWaypoint(start.tolist()),
                planner.JointWaypoint(goal.tolist(), motion=FreeMotion(keep=(kept,))),
            )
            plan = planner.plan(planner.PlanningProblem(robot, waypoints))
            assert largest_value(kept, robot, plan.trajectory, 2000) <= kept.limit + 2e-6


def test_a_tool_near_a_line_through_a_singular_position_is_planned_or_refused() -> None:
    robot = planner.load_robot("ur5e")
    start, end = [0.0, -1.57, 0.0, -1.57, 0.0, 0.0], [0.0, -1.57, 0.3, -1.57, 0.0, 0.0]
    first, last = (planner.forward_kinematics(robot, position).position for position in (start, end))
    kept = planner.ToolNearLine(tuple(first), tuple(last - first), 0.01)
    motion = FreeMotion(most_checks=500, keep=(kept,))
    waypoints = (planner.JointWaypoint(start), planner.JointWaypoint(end, motion=motion))
    try:
        plan = planner.plan(planner.PlanningProblem(robot, waypoints))
    except planner.NoPathFound:
        return
    assert largest_value(kept, robot, plan.trajectory) <= kept.limit + 2e-6


@pytest.mark.parametrize(
    ("kept", "field"),
    [
        (planner.ToolAxis((0.0, 0.0, 0.0), 0.2), "direction"),
        (planner.ToolAxis(DOWN, 0.0), "angle"),
        (planner.ToolAxis(DOWN, np.nan), "angle"),
        (planner.ToolOrientation((0.0, 0.0, 0.0, 0.0), 0.2), "orientation"),
        (planner.ToolOrientation((0.0, 0.0, 0.0, 1.0), 4.0), "angle"),
        (planner.ToolNearPlane((0.0, 0.0, np.inf), DOWN, 0.1), "point"),
        (planner.ToolNearPlane((0.0, 0.0, 0.0), DOWN, 0.0), "distance"),
        (planner.ToolNearLine((0.0, 0.0, 0.0), (0.0, np.nan, 1.0), 0.1), "direction"),
        (planner.ToolNearLine((0.0, 0.0, 0.0), DOWN, np.inf), "distance"),
        (planner.ToolInBox(planner.Pose([0.0, 0.0, 0.0]), (0.1, 0.0, 0.1)), "size"),
        (planner.ToolInHalfSpace((0.0, 0.0, 0.0), 0.1), "normal"),
        (planner.ToolInHalfSpace(DOWN, np.nan), "offset"),
    ],
)
def test_an_invalid_constraint_is_a_fault_of_its_field(kept: PoseConstraint, field: str) -> None:
    start = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
    waypoints = (planner.JointWaypoint(start), planner.JointWaypoint(start, motion=FreeMotion(keep=(kept,))))
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.plan(planner.PlanningProblem(planner.load_robot("ur5e"), waypoints))
    assert refusal.value.faults[0][0] == ("waypoints", 1, "motion", "keep", 0, field)
