"""Free motions that keep an axis of the tool near a direction: against Pinocchio, dense samples and broken ends."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.constraints.tool_axes import ToolAxis
from planner.problems.motion_around import FreeMotion
from planner.scene import Scene, SceneObject
from planner.shapes import Box
from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial

ROBOTS = ("ur5e", "fr3")
DOWN = (0.0, 0.0, -1.0)
SAMPLES = 10_000
HOME = {"ur5e": [0.0, -1.5, 1.9, -1.97, -1.57, 0.0], "fr3": [0.0, -0.4, 0.0, -2.2, 0.0, 1.8, 0.8]}
"""Joint positions in which the tool points down."""


def angles_by_pinocchio(robot: planner.Robot, kept: ToolAxis, positions: FloatArray) -> FloatArray:
    """Return the angles (N,) by Pinocchio's own forward kinematics."""
    angles = []
    for position in positions:
        pin.framesForwardKinematics(robot.model, robot.data, position)
        axis = robot.data.oMf[robot.tool_frame_id].rotation @ np.array(kept.axis)
        across = np.linalg.norm(np.cross(axis, kept.direction))
        angles.append(float(np.arctan2(across, axis @ np.array(kept.direction))))
    return np.array(angles)


def drawn_ends(robot: planner.Robot, kept: ToolAxis, rng: np.random.Generator) -> list[list[float]]:
    """Draw two joint positions, more than 1 rad apart, that keep the constraint."""
    lower, upper = np.maximum(robot.limit("lower"), -2.5), np.minimum(robot.limit("upper"), 2.5)
    ends: list[list[float]] = []
    while len(ends) < 2:
        found = kept.projected(robot, rng.uniform(lower, upper))
        if found is None or (found < lower).any() or (found > upper).any():
            continue
        if not ends or np.linalg.norm(found - ends[0]) > 1.0:
            ends.append(found.tolist())
    return ends


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("angle", [0.15, 0.4])
def test_no_sample_of_a_detour_around_a_box_leaves_the_angle(name: str, angle: float) -> None:
    robot, kept = planner.load_robot(name), ToolAxis(DOWN, angle)
    rng = np.random.default_rng(int(1000 * angle))
    solved = corners = 0
    for _ in range(4):
        middle = np.array(HOME[name]) + rng.uniform(-0.1, 0.1, robot.dof)
        turn = np.eye(robot.dof)[0] * rng.uniform(0.6, 0.9)
        start, end = (kept.projected(robot, middle + side * turn) for side in (-1.0, 1.0))
        assert start is not None and end is not None
        at = planner.forward_kinematics(robot, middle.tolist()).position
        box = SceneObject("box", [Box([0.1, 0.1, 0.1])], planner.Pose(at))
        motion = FreeMotion(most_checks=3000, keep=(kept,))
        waypoints = (planner.JointWaypoint(start.tolist()), planner.JointWaypoint(end.tolist(), motion=motion))
        try:
            plan = planner.plan(planner.PlanningProblem(robot, waypoints, scene=Scene([box])))
        except planner.NoPathFound:
            continue  # the search has a budget
        solved += 1
        corners += plan.detours[0].has_corners
        times = np.linspace(0.0, plan.trajectory.duration, SAMPLES)
        worst = angles_by_pinocchio(robot, kept, plan.trajectory.evaluate(times, [0])[0]).max()
        (check,) = [check for check in plan.certificate.checks if check.quantity == "tool_axis_angle"]
        assert worst <= check.peak + 1e-9
        assert worst <= angle + 1e-9
        assert check.method == "bounded"
    assert solved >= 3
    assert corners


@pytest.mark.parametrize("name", ROBOTS)
def test_the_bound_of_random_motions_is_above_dense_samples_and_near_them(name: str) -> None:
    robot, rng = planner.load_robot(name), np.random.default_rng(3)
    kept = ToolAxis((0.3, -0.2, 0.9), 0.5, (0.1, 1.0, 0.2))
    axis, direction = (np.array(values) / np.linalg.norm(values) for values in (kept.axis, kept.direction))
    unit = ToolAxis(tuple(direction.tolist()), 0.5, tuple(axis.tolist()))
    for _ in range(5):
        motion = PiecewisePolynomial(rng.uniform(0.3, 1.5, 2), rng.uniform(-1.0, 1.0, (2, robot.dof, 4)))
        found = kept.largest_angle(robot, motion)
        inside = np.linspace(0.0, motion.breakpoints[-1], SAMPLES, endpoint=False)
        worst = angles_by_pinocchio(robot, unit, motion.evaluate(inside, [0])[0]).max()
        assert found.reached <= found.bound
        assert worst <= found.bound + 1e-9
        assert found.bound <= worst + 2e-3


def test_an_end_beyond_the_angle_is_refused_with_its_waypoint() -> None:
    robot, kept = planner.load_robot("ur5e"), ToolAxis(DOWN, 0.15)
    start, end = drawn_ends(robot, kept, np.random.default_rng(5))
    end[4] += 0.8
    for order, broken in (((start, end), 1), ((end, start), 0)):
        waypoints = (planner.JointWaypoint(order[0]), planner.JointWaypoint(order[1], motion=FreeMotion(keep=(kept,))))
        with pytest.raises(planner.InvalidProblem, match="beyond its `angle`") as refusal:
            planner.plan(planner.PlanningProblem(robot, waypoints))
        assert refusal.value.faults[0][0] == ("waypoints", broken)


@pytest.mark.parametrize(
    ("kept", "field"),
    [(ToolAxis((0.0, 0.0, 0.0), 0.2), "direction"), (ToolAxis(DOWN, 0.0), "angle"), (ToolAxis(DOWN, np.nan), "angle")],
)
def test_an_invalid_constraint_is_a_fault_of_its_field(kept: ToolAxis, field: str) -> None:
    start = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
    waypoints = (planner.JointWaypoint(start), planner.JointWaypoint(start, motion=FreeMotion(keep=(kept,))))
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.plan(planner.PlanningProblem(planner.load_robot("ur5e"), waypoints))
    assert refusal.value.faults[0][0] == ("waypoints", 1, "motion", "keep", 0, field)
