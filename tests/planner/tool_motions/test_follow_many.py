"""Lines followed all at once, compared with the same lines one by one, and with the requested poses by Pinocchio."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from planner.errors import JointPositionLimit
from planner.kinematics.forward import tool_pose
from planner.paths import solve_path
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import BlendTransition
from planner.robots import Robot, load_robot
from planner.spatial import Pose, rotation_from_rpy
from planner.tool_motions.follow import SINGULAR_TRAVEL, Track, follow
from planner.tool_motions.follow_many import follow_at_once, follow_lines
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_paths import Line
from planner.tool_motions.pose_splines import PoseSpline
from planner.trajectories.polynomials import PiecewisePolynomial

ARMS = {
    "kuka_kr16_2": [0.2, -1.5, 1.4, 0.3, 1.0, 0.1],
    "date_sorting_arm": [0.3, 0.4, 0.5, 0.3, 0.6, 0.2],
    "three_dof_arm": [0.2, -0.4, 1.5],
    "ur5": [0.0, -1.5, 1.6, -1.6, -1.5, 0.2],
    "panda": [0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.5],
}
TOLERANCE = (1e-4, 1e-3)
GUESS = 3e-8
"""Allowed error of the expected ends, rad or m, smaller than the distance of another configuration."""


def allowed(count: int) -> tuple[np.ndarray, np.ndarray]:
    return np.tile(TOLERANCE, (count, 1)), np.full(count, SINGULAR_TRAVEL)


def robot_of(arm: str) -> Robot:
    return load_robot(arm)


def contour(robot: Robot, start: list[float], size: float, count: int, free: bool) -> list[Pose]:
    """Make poses around the tool at `start`, some mm or cm apart, with a small turn between neighbours."""
    rng, pose = np.random.default_rng(4), tool_pose(robot, start)
    poses = [Pose(pose.position, None if free else pose.rotation)]
    for k in range(count):
        turn = rotation_from_rpy(*(0.3 * size * rng.uniform(-1.0, 1.0, 3)))
        way = size * np.array([np.cos(2.0 * np.pi * k / count), np.sin(2.0 * np.pi * k / count), 0.2 * rng.uniform()])
        before = poses[-1]
        poses.append(Pose(before.position + way, None if before.rotation is None else before.rotation @ turn))
    return poses


def one_by_one(robot: Robot, lines: list[Line], start: np.ndarray) -> list[PiecewisePolynomial]:
    curves = []
    for line in lines:
        curve = follow(Track(robot, line, start, None, TOLERANCE))
        assert isinstance(curve, PiecewisePolynomial)
        start = curve.evaluate(curve.breakpoints[-1:], [0])[0][0]
        curves.append(curve)
    return curves


@pytest.mark.long_table
@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize(("size", "count"), [(0.002, 30), (0.03, 12), (1e-5, 10)])
def test_lines_are_where_they_are_asked_to_be_and_where_each_is_followed_to(arm: str, size: float, count: int) -> None:
    robot, start = robot_of(arm), np.array(ARMS[arm])
    poses = contour(robot, ARMS[arm], size, count, free=robot.dof == 3)
    lines = [Line(before, after) for before, after in pairwise(poses)]
    expected = one_by_one(robot, lines, start)
    ends = np.array([curve.evaluate(np.ones(1), [0])[0][0] for curve in expected])
    guesses = ends + GUESS * np.random.default_rng(5).uniform(-1.0, 1.0, ends.shape)
    none = np.zeros(count, dtype=bool)
    found = follow_lines(robot, lines, start, guesses, none, *allowed(count))
    assert len(found.curves) == count
    u = np.linspace(0.0, 1.0, 41)
    for line, curve, alone, end in zip(lines, found.curves, expected, found.ends, strict=True):
        q = curve.evaluate(u, [0])[0]
        assert np.array_equal(q[0], start)
        assert np.abs(q[-1] - end).max() < 1e-12
        assert np.abs(q - alone.evaluate(u, [0])[0]).max() < 1e-4
        assert np.abs(end - alone.evaluate(np.ones(1), [0])[0][0]).max() < 1e-9
        for share, position in zip(u, q, strict=True):
            wanted, reached = line.pose(share), tool_pose(robot, position)
            assert np.linalg.norm(wanted.position - reached.position) < TOLERANCE[0] / 3.0
            if wanted.rotation is not None:
                turned = wanted.rotation.T @ reached.rotation
                assert np.arccos(min(1.0, (np.trace(turned) - 1.0) / 2.0)) < TOLERANCE[1] / 3.0
        inner = curve.breakpoints[1:-1]
        for order in (0, 1, 2):  # C2: the difference across a knot is what the next derivative makes of 2e-9
            before, after = (curve.evaluate(inner + side * 1e-9, [order])[0] for side in (-1.0, 1.0))
            assert np.abs(before - after).max(initial=0.0) < 1e-6
        start = end


def test_given_ends_are_met_exactly_and_a_wrong_one_ends_the_chain() -> None:
    robot, start = load_robot("kuka_kr16_2"), np.array(ARMS["kuka_kr16_2"])
    poses = contour(robot, ARMS["kuka_kr16_2"], 0.01, 10, free=False)
    lines = [Line(before, after) for before, after in pairwise(poses)]
    ends = np.array([curve.evaluate(np.ones(1), [0])[0][0] for curve in one_by_one(robot, lines, start)])
    guesses = ends + GUESS
    guesses[6, 3] += 2.0 * np.pi
    found = follow_lines(robot, lines, start, guesses, np.ones(10, dtype=bool), *allowed(10))
    assert len(found.curves) == 6
    assert np.array_equal(found.ends, guesses[:6])


def test_the_chain_ends_before_a_singularity() -> None:
    """The wrist of the KUKA is stretched at joint 5 = 0, which a line passes in its middle."""
    robot = load_robot("kuka_kr16_2")
    positions = [np.array([0.2, -1.5, 1.4, 0.0, angle, 0.0]) for angle in (0.4, 0.2, -0.2, -0.4)]
    lines = [Line(tool_pose(robot, a), tool_pose(robot, b)) for a, b in pairwise(positions)]
    guesses, none = np.array(positions[1:]), np.zeros(3, dtype=bool)
    found = follow_lines(robot, lines, positions[0], guesses, none, *allowed(3))
    assert len(found.curves) == 1


@pytest.mark.long_table
@pytest.mark.parametrize("arm", ["kuka_kr16_2", "ur5", "panda"])
def test_a_contour_with_joint_waypoints_is_solved_as_one_by_one(arm: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = robot_of(arm)
    poses = contour(robot, ARMS[arm], 0.005, 40, free=False)
    blend, line = BlendTransition(0.001), LinearMotion()
    corners = [PoseWaypoint(pose=pose, motion=line, transition=blend) for pose in poses[1:]]
    problem = PlanningProblem(robot, (JointWaypoint(ARMS[arm]), *corners, PoseWaypoint(pose=poses[0], motion=line)))
    together = solve_path(problem)
    monkeypatch.setattr("planner.waypoints.choice.FEWEST_TOGETHER", 1000)
    alone = solve_path(problem)
    assert together.positions == pytest.approx(alone.positions, abs=1e-7)
    (group,), (other,) = together.groups, alone.groups
    assert len(group.curve.lengths) < 0.6 * len(other.curve.lengths)
    assert group.curve.lengths.sum() == pytest.approx(other.curve.lengths.sum(), rel=1e-3)


def test_a_chain_that_leaves_the_position_limits_is_refused_as_one_line_is() -> None:
    robot = load_robot("kuka_kr16_2")
    q = np.array([3.2, -1.5, 1.4, 0.0, 1.0, 0.0])  # joint 1 ends at 3.2289
    pose = tool_pose(robot, q)
    side = np.array([-np.sin(-q[0]), -np.cos(-q[0]), 0.0])
    ways = [sign * 0.004 * k * side for sign in (1.0, -1.0) for k in range(1, 30)]
    refused = 0
    for chain in (ways[:29], ways[29:]):
        poses = [PoseWaypoint(pose=Pose(pose.position + way, pose.rotation), motion=LinearMotion()) for way in chain]
        try:
            path = solve_path(PlanningProblem(robot, (JointWaypoint(q), *poses)))
        except JointPositionLimit:
            refused += 1
        else:
            assert (path.positions[:, 0] <= robot.limit("upper")[0]).all()
    assert refused == 1


def pieced(kind: str, poses: list[Pose]) -> Polyline | PoseSpline:
    """Return the path of a kind through poses."""
    if kind == "spline":
        return PoseSpline.through(poses[0], poses[1:-1], poses[-1])
    return Polyline.through(poses[0], poses[1:-1], poses[-1], 0.002)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["polyline", "spline"])
@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("count", [4, 30])
def test_a_path_followed_at_once_ends_where_it_does_from_knot_to_knot(arm: str, kind: str, count: int) -> None:
    robot, start = robot_of(arm), np.array(ARMS[arm])
    size = {"three_dof_arm": 0.001, "date_sorting_arm": 0.005}.get(arm, 0.01)
    path = pieced(kind, contour(robot, ARMS[arm], size, count, arm == "three_dof_arm"))
    at_once, alone = (run(Track(robot, path, start, None, TOLERANCE)) for run in (follow_at_once, follow))
    assert isinstance(at_once, PiecewisePolynomial)
    assert isinstance(alone, PiecewisePolynomial)
    u = np.linspace(0.0, 1.0, 301)
    ours, theirs = (curve.evaluate(u, [0])[0] for curve in (at_once, alone))
    assert np.abs(ours - theirs).max() < 1e-3  # each may be off by the tolerance
    assert ours[-1] == pytest.approx(theirs[-1], abs=1e-9)
    for share, q in zip(u.tolist(), ours, strict=True):
        wanted, reached = path.pose(share), tool_pose(robot, q)
        assert np.linalg.norm(wanted.position - reached.position) < TOLERANCE[0]
        if wanted.rotation is not None:
            assert np.abs(wanted.rotation - reached.rotation).max() < TOLERANCE[1]
    coefficients = at_once.coefficients.transpose(2, 0, 1)
    for _ in range(3):  # the derivatives of pieces where they meet
        ends = (coefficients * at_once.lengths[:, None] ** np.arange(len(coefficients))[:, None, None]).sum(axis=0)
        assert ends[:-1] == pytest.approx(coefficients[0, 1:], abs=1e-7 * np.abs(coefficients[0]).max())
        coefficients = np.polynomial.polynomial.polyder(coefficients)


def test_a_path_through_a_singular_wrist_is_left_to_follow() -> None:
    robot, start = robot_of("kuka_kr16_2"), np.array([0.2, -1.5, 1.4, 0.0, 0.0, 0.1])
    path = pieced("polyline", contour(robot, start.tolist(), 0.01, 20, free=False))
    assert follow_at_once(Track(robot, path, start, None, TOLERANCE)) is None
