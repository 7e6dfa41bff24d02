"""Motions of the tool with a tolerance region: its axis by Pinocchio, feasible lines by dense kinematics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.corpus.tracing import tool_at
from planner.backends import Quintic, Ruckig
from planner.certificate.goal_regions import misses_of_region
from planner.certificate.lines_and_circles import Line
from planner.certificate.tool_path import PATH_DEVIATIONS
from planner.errors import InvalidProblem, PlanningError
from planner.kinematics.inverse import solution_layers
from planner.kinematics.options import InverseKinematicsOptions
from planner.paths import solve_path
from planner.planning import plan
from planner.problems.problem import (
    CartesianMotion,
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PolylineMotion,
    PoseWaypoint,
    SplineMotion,
)
from planner.problems.regions import Free, Region, region_of
from planner.robots import Robot, load_robot
from planner.spatial import FloatArray, Pose, rotation_from_rpy, rotation_x, rotation_y, rotation_z

HOME = np.array([0.3, -1.2, 1.4, 0.2, 0.6, 0.1])
LAST = "joint_a6"
NARROW = load_robot("kuka_kr16_l6_2").derived(limits={LAST: {"lower": -0.1, "upper": 0.3}})
FIVE = load_robot("kuka_kr16_l6_2").derived(locked={LAST: 0.1})
NARROW_LINES = (3, 5, 10, 12, 15, 25, 28, 35)
"""Seeds of lines on which the last joint of that arm would have to leave its limits."""


def line(robot: Robot, seed: int, motion: CartesianMotion) -> PlanningProblem:
    """Return a line from a joint position within the limits to a pose with a free rotation."""
    rng, lower, upper = np.random.default_rng(seed), robot.limit("lower"), robot.limit("upper")
    start = HOME[: robot.dof] + rng.uniform(-0.5, 0.5, robot.dof)
    start = np.clip(start, 0.9 * lower + 0.1 * upper, 0.9 * upper + 0.1 * lower)
    before = tool_at(robot, start)
    shift, turn = rng.uniform(-0.3, 0.3, 3), rotation_from_rpy(*rng.uniform(-0.5, 0.5, 2), rng.uniform(-0.3, 0.3))
    goal = PoseWaypoint(Pose(before.position + shift, before.rotation @ turn), free="rotation_z", motion=motion)
    return PlanningProblem(robot, [JointWaypoint(start), goal])


def can_be_driven(robot: Robot, start: FloatArray, end: Pose, step: float = 0.35) -> bool:
    """Return whether dense inverse kinematics leads along the line within the limits, without a large step.

    The line has 31 points, with 36 turns about the tool's axis at each.
    """
    before, reached = tool_at(robot, start), np.array([start])
    turn = pin.log3(before.rotation.T @ end.rotation)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    for u in np.linspace(0.0, 1.0, 31)[1:]:
        rotation = before.rotation @ pin.exp3(u * turn)
        point = before.position + u * (end.position - before.position)
        poses = [Pose(point, rotation @ rotation_z(angle)) for angle in np.arange(36) * np.pi / 18.0]
        layers = solution_layers(robot, poses, InverseKinematicsOptions(), start)
        found = np.array([q for layer in layers for q in layer])
        away = found[:, None] - reached
        turned = found[:, None] - 2.0 * np.pi * np.round(away / (2.0 * np.pi))
        near = (np.abs(turned - reached) <= step).all(axis=2) & (turned >= lower).all(axis=2)
        near &= (turned <= upper).all(axis=2)
        if not near.any():
            return False
        rows = np.flatnonzero(near.any(axis=1))
        reached = np.array([turned[row, near[row].argmax()] for row in rows])
    return True


def keeps_its_axis(problem: PlanningProblem, region: Region | None = None) -> None:
    """Assert that the point keeps within 0.1 mm of the line and the axis within 1 mrad.

    The axis of the line turns evenly. In a region, offsets are by scipy.
    """
    made = plan(problem, Quintic())
    assert made.certificate.satisfied
    assert {"path_position_deviation", "path_orientation_deviation"} <= {c.quantity for c in made.certificate.checks}
    robot = problem.robot
    start, end = (tool_at(robot, q) for q in made.path.positions)
    turn, way = pin.log3(start.rotation.T @ end.rotation), end.position - start.position
    for q in made.trajectory.evaluate(np.linspace(0.0, made.trajectory.duration, 200), [0])[0]:
        assert (q >= robot.limit("lower") - 1e-9).all()
        assert (q <= robot.limit("upper") + 1e-9).all()
        there = tool_at(robot, q)
        u = (there.position - start.position) @ way / (way @ way)
        assert np.linalg.norm(there.position - start.position - u * way) <= 1e-4
        written = start.rotation @ pin.exp3(u * turn)
        rate = np.linalg.norm(turn) / np.linalg.norm(way)  # a tenth of a millimetre along the line turns it so far
        tilt = np.arccos(np.clip(there.rotation[:, 2] @ written[:, 2], -1.0, 1.0))
        assert tilt <= 1.01e-3 + 1e-4 * rate
        if region is not None and region.rotation_z is not None:
            angle = Rotation.from_matrix(written.T @ there.rotation).as_euler("XYZ")[2]
            assert region.rotation_z[0] - 2e-3 <= angle <= region.rotation_z[1] + 2e-3


@pytest.mark.long_table
@pytest.mark.parametrize("seed", NARROW_LINES)
def test_what_dense_kinematics_can_drive_is_driven_by_the_free_turn(seed: int) -> None:
    fixed, free = (line(NARROW, seed, LinearMotion(free=free)) for free in (None, "rotation_z"))
    with pytest.raises(PlanningError, match=LAST):
        solve_path(fixed)
    end = fixed.waypoints[1]
    assert isinstance(end, PoseWaypoint)
    assert can_be_driven(NARROW, np.array(fixed.waypoints[0].position), end.pose)  # type: ignore[union-attr]
    keeps_its_axis(free)


@pytest.mark.long_table
@pytest.mark.parametrize("seed", [2, 4, 5, 6, 7])
def test_an_arm_with_five_joints_drives_lines(seed: int) -> None:
    """With a fixed orientation, it cannot follow any line."""
    with pytest.raises(PlanningError):
        solve_path(line(FIVE, seed, LinearMotion()))
    keeps_its_axis(line(FIVE, seed, LinearMotion(free="rotation_z")))


@pytest.mark.parametrize("kind", ["circle", "polyline", "spline"])
def test_other_curves_use_the_freedom_too(kind: str) -> None:
    problem = line(FIVE, 4, LinearMotion())
    start, goal = tool_at(FIVE, np.array(problem.waypoints[0].position)), problem.waypoints[1]  # type: ignore[union-attr]
    assert isinstance(goal, PoseWaypoint)
    middle = (start.position + goal.pose.position) / 2.0 + np.array([0.0, 0.0, 0.04])
    motions = {
        "circle": CircularMotion(Pose(middle), free="rotation_z"),
        "polyline": PolylineMotion([Pose(middle)], 0.02, free="rotation_z"),
        "spline": SplineMotion([Pose(middle)], free="rotation_z"),
    }
    with pytest.raises(PlanningError):
        solve_path(replace(problem, waypoints=[problem.waypoints[0], replace(goal, motion=motions[kind], free=None)]))
    made = plan(replace(problem, waypoints=[problem.waypoints[0], replace(goal, motion=motions[kind])]), Ruckig())
    tools = [
        tool_at(FIVE, q).position for q in made.trajectory.evaluate(np.linspace(0, made.trajectory.duration, 400))[0]
    ]
    nearest = min(float(np.linalg.norm(tool - middle)) for tool in tools)
    assert nearest < (0.02 if kind == "polyline" else 2e-3)
    assert made.certificate.satisfied


def test_a_range_is_kept_to_and_one_that_is_too_narrow_is_refused() -> None:
    wide = Region(rotation_z=(-0.8, 0.8))
    keeps_its_axis(line(NARROW, 3, LinearMotion(free=wide)), wide)
    with pytest.raises(PlanningError, match=LAST):
        solve_path(line(NARROW, 3, LinearMotion(free=Region(rotation_z=(-1e-3, 1e-3)))))


def test_a_line_that_can_be_driven_as_it_is_written_is() -> None:
    robot = load_robot("kuka_kr16_l6_2")
    fixed, free = (solve_path(line(robot, 2, LinearMotion(free=free))) for free in (None, "rotation_z"))
    (first,), (second,) = fixed.groups, free.groups
    assert (first.curve.coefficients == second.curve.coefficients).all()


def test_the_certificate_finds_what_is_outside_of_a_region() -> None:
    """The truth is the nearest of very many poses of the region: never nearer, and no further for small deviations."""
    rng = np.random.default_rng(0)
    region = Region(x=(-0.01, 0.02), rotation_x=(-0.2, 0.1), rotation_z=(-0.5, 0.5))
    requested = Pose(rng.uniform(-1.0, 1.0, 3), rotation_from_rpy(*rng.uniform(-1.0, 1.0, 3)))
    assert requested.rotation is not None
    for _ in range(6):
        x, a, c = rng.uniform(-0.03, 0.03), rng.uniform(-0.3, 0.3), rng.uniform(-0.7, 0.7)
        y, b = rng.uniform(-1e-3, 1e-3), rng.uniform(-1e-3, 1e-3)
        reached = requested.position + requested.rotation @ [x, y, 0.0]
        turned = requested.rotation @ rotation_x(a) @ rotation_y(b) @ rotation_z(c)
        found = misses_of_region(
            region, requested.position[None], requested.rotation[None], reached[None], turned[None]
        )
        nearest = [
            requested.rotation @ rotation_x(tilt) @ rotation_z(turn)
            for tilt in np.linspace(-0.2, 0.1, 16)
            for turn in np.linspace(-0.5, 0.5, 51)
        ]
        angle = min(float(np.linalg.norm(pin.log3(pose.T @ turned))) for pose in nearest)
        assert found[0][0] == pytest.approx(np.hypot(x - np.clip(x, -0.01, 0.02), y), abs=1e-12)
        assert angle - 0.02 <= found[1][0] <= 1.1 * angle + 0.02


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["quintic", "ruckig", "toppra"])
@pytest.mark.parametrize(
    "free", ["rotation_z", Region(rotation_z=(-0.8, 0.8)), Region(x=(-0.01, 0.02), rotation_y=(-0.3, 0.2))]
)
def test_no_sample_is_farther_from_a_tolerance_region_than_the_bound(kind: str, free: Free) -> None:
    """The truth is the nearest of many points of the line, refined."""
    problem = line(load_robot("kuka_kr16_l6_2"), 2, LinearMotion(free=free))
    made = plan(replace(problem, waypoints=[problem.waypoints[0], replace(problem.waypoints[1], free=None)]), kind)
    checks = {check.quantity: check for check in made.certificate.checks}
    start, end = (tool_at(problem.robot, q) for q in made.trajectory.at_arrivals)
    followed = Line.between(start, end)
    for q in made.trajectory.evaluate(np.linspace(0.0, made.trajectory.duration, 60), [0])[0]:
        tool, low, high = tool_at(problem.robot, q), 0.0, 1.0
        assert tool.rotation is not None
        least = np.full(2, np.inf)
        for _ in range(6):
            u = np.linspace(low, high, 41)
            points, axes = followed.poses(u)
            assert axes is not None
            reached = np.tile(tool.position, (41, 1)), np.tile(tool.rotation, (41, 1, 1))
            found = np.array(misses_of_region(region_of(free), points, axes, *reached))
            least, best = np.minimum(least, found.min(axis=1)), int(found[0].argmin())
            low, high = u[max(best - 1, 0)], u[min(best + 1, 40)]
        for quantity, true in zip(PATH_DEVIATIONS, least, strict=True):
            assert checks[quantity].method == "bounded"
            assert true <= checks[quantity].peak + 1e-9
            assert checks[quantity].lower == 0.0


def test_a_range_along_a_motion_has_nought_in_it() -> None:
    with pytest.raises(InvalidProblem) as refused:
        plan(line(NARROW, 3, LinearMotion(free=Region(rotation_z=(0.1, 0.5)))))
    assert refused.value.faults[0].field == ("waypoints", 1, "motion", "free", "rotation_z")


@pytest.mark.parametrize("seed", [401, 403])
def test_an_arm_with_five_joints_leaves_the_line_by_shifts_and_a_turn(seed: int) -> None:
    """The turn makes up for the sixth joint; the shifts help where limits are near."""
    rng = np.random.default_rng(seed)
    start = np.array(HOME[:5]) + rng.uniform(-0.3, 0.3, 5)
    start = np.clip(
        start, *(0.9 * FIVE.limit(a) + 0.1 * FIVE.limit(b) for a, b in (("lower", "upper"), ("upper", "lower")))
    )
    end = np.clip(start + rng.uniform(-0.5, 0.5, 5), FIVE.limit("lower"), FIVE.limit("upper"))
    region = Region(x=(-0.05, 0.05), y=(-0.05, 0.05), rotation_z=(-0.5, 0.5))
    goal = JointWaypoint(end, motion=LinearMotion(free=region))
    made = plan(PlanningProblem(FIVE, [JointWaypoint(start), goal]), Quintic())
    assert made.certificate.satisfied
    points, axes = Line.between(tool_at(FIVE, start), tool_at(FIVE, end)).poses(np.linspace(0.0, 1.0, 20001))
    assert axes is not None
    for q in made.trajectory.evaluate(np.linspace(0.0, made.trajectory.duration, 15), [0])[0]:
        tool = tool_at(FIVE, q)
        assert tool.rotation is not None
        every = np.tile(tool.position, (20001, 1)), np.tile(tool.rotation, (20001, 1, 1))
        distances, angles = misses_of_region(region, points, axes, *every)
        assert np.maximum(distances / 1e-4, angles / 1e-3).min() <= 1.1
