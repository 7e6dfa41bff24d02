"""The choice of branches of a whole waypoint list, against every combination of them and of followed motions."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
import pytest

from planner.errors import ConfigurationChange, PathPoint, PlanningError, SingularPath, UnreachableWaypoint
from planner.kinematics import FloatArray, Pose, all_solutions, forward_kinematics, jacobian
from planner.kinematics.options import InverseKinematicsOptions
from planner.problems.moves import CartesianMove
from planner.problems.problem import (
    AnyWaypoint,
    JointMotion,
    JointWaypoint,
    LinearMotion,
    PoseWaypoint,
    RelativeWaypoint,
)
from planner.robots import DHJoint, Robot, load_robot
from planner.tool_motions.tool_motion import RefusedMotion, RequestedMotion, ToolMotion
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.waypoints.solve import SolvedWaypoint, solve_waypoints
from tests.planner.problems_of_tests import random_position

if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = InverseKinematicsOptions()
TURN = 2.0 * np.pi
LINE = LinearMotion()


def pose_at(robot: Robot, q: FloatArray) -> Pose:
    return forward_kinematics(robot, np.array([q]))[0]


def at(q: FloatArray) -> JointWaypoint:
    return JointWaypoint(position=tuple(q.tolist()))


def time_of(robot: Robot, way: Sequence[FloatArray]) -> float:
    """Return the time of the slowest joint of every motion, s."""
    return sum(float((np.abs(b - a) / robot.limit("velocity")).max()) for a, b in itertools.pairwise(way))


def turned(robot: Robot, q: FloatArray) -> list[FloatArray]:
    """Return the same configuration with every joint turned by up to two turns either way, within its limits."""
    ways = itertools.product(*([0.0] if not angle else [-2.0, -1.0, 0.0, 1.0, 2.0] for angle in robot.is_angle))
    lower, upper = robot.limit("lower"), robot.limit("upper")
    candidates = (q + TURN * np.array(way) for way in ways)
    return [p for p in candidates if (p >= lower).all() and (p <= upper).all()]


def motion_cost(robot: Robot, start: FloatArray, end: FloatArray, *, turning: bool = False) -> float:
    """Return the slowest joint's time plus 1 % of all joints' times; `turning`: whole turns do not count."""
    change = np.abs(end - start)
    if turning:
        change = np.abs((change + np.pi) % TURN - np.pi)
    times = change / robot.limit("velocity")
    return float(times.max() + 0.01 * times.sum())


def penalty(robot: Robot, q: FloatArray, solutions: Sequence[FloatArray]) -> float:
    """Return the penalty of a solution: a hundredth of a second at a limit, and as much at a singularity."""
    w, best = yoshikawa(robot, q), max(yoshikawa(robot, other) for other in solutions)
    lower, upper = robot.limit("lower"), robot.limit("upper")
    nearness = 0.0
    if np.isfinite(lower).all():
        nearness = float(np.abs((2.0 * q - lower - upper) / (upper - lower)).max())
    return 0.01 * nearness + 0.01 * (1.0 - w / best)


def yoshikawa(robot: Robot, q: FloatArray) -> float:
    return float(abs(np.linalg.det(jacobian(robot, q))))


@pytest.mark.long_table
@pytest.mark.parametrize("robot_id", ["date_sorting_arm", "kuka_kr16_l6_2"])
@pytest.mark.parametrize("seed", range(4))
def test_the_way_is_the_shortest_of_all_combinations(robot_id: str, seed: int) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(seed)
    positions = [np.array(random_position(robot, rng)) for _ in range(4)]
    poses = [pose_at(robot, q) for q in positions[1:3]]
    waypoints = (at(positions[0]), *(PoseWaypoint(pose=pose) for pose in poses), at(positions[3]))
    solved = solve_waypoints(robot, waypoints, OPTIONS)
    branches = [all_solutions(robot, pose, OPTIONS) for pose in poses]
    layers = [[q for branch in found for q in turned(robot, branch)] for found in branches]

    def cost(way: Sequence[FloatArray]) -> float:
        motions = sum(motion_cost(robot, a, b) for a, b in itertools.pairwise(way))
        return motions + sum(penalty(robot, q, found) for q, found in zip(way[1:3], branches, strict=True))

    first, last = ([motion_cost(robot, positions[end], q) for q in layers[i]] for i, end in ((0, 0), (1, 3)))
    own = [[penalty(robot, q, found) for q in layer] for layer, found in zip(layers, branches, strict=True)]
    best = min(
        first[i] + own[0][i] + motion_cost(robot, p, q) + own[1][k] + last[k]
        for i, p in enumerate(layers[0])
        for k, q in enumerate(layers[1])
    )
    assert cost([waypoint.position for waypoint in solved]) == pytest.approx(best, abs=1e-6)
    for waypoint, pose in zip(solved[1:3], poses, strict=True):
        reached = pose_at(robot, waypoint.position)
        assert reached.position == pytest.approx(pose.position, abs=1e-6)
        assert reached.rotation == pytest.approx(pose.rotation, abs=2e-6)


@pytest.mark.parametrize("seed", range(4))
def test_joints_without_limits_turn_the_shorter_way(seed: int) -> None:
    """The refuelling arm has no position limits: between poses, every angle changes by half a turn at most."""
    robot, rng = load_robot("ngv_refuelling_arm"), np.random.default_rng(seed)
    start, *others = (np.array(random_position(robot, rng)) for _ in range(4))
    poses = [pose_at(robot, q) for q in others]
    waypoints = (at(start), *(PoseWaypoint(pose=pose) for pose in poses))
    way = [waypoint.position for waypoint in solve_waypoints(robot, waypoints, OPTIONS)]
    branches = [all_solutions(robot, pose, OPTIONS) for pose in poses]
    own = [[penalty(robot, q, found) for q in found] for found in branches]

    def cost(picked: tuple[int, ...]) -> float:
        ends = [start, *(found[i] for found, i in zip(branches, picked, strict=True))]
        motions = sum(motion_cost(robot, a, b, turning=True) for a, b in itertools.pairwise(ends))
        return motions + sum(penalties[i] for penalties, i in zip(own, picked, strict=True))

    best = min(cost(picked) for picked in itertools.product(*(range(len(found)) for found in branches)))
    motions = sum(motion_cost(robot, a, b) for a, b in itertools.pairwise(way))
    penalties = sum(penalty(robot, q, found) for q, found in zip(way[1:], branches, strict=True))
    assert motions + penalties == pytest.approx(best, abs=1e-6)
    assert max(float(np.abs(b - a).max()) for a, b in itertools.pairwise(way)) <= np.pi + 1e-6


def greedy(robot: Robot, waypoints: Sequence[AnyWaypoint]) -> list[FloatArray]:
    """Return each waypoint on the branch that is nearest in time to the one before."""
    way: list[FloatArray] = []
    for waypoint in waypoints:
        if isinstance(waypoint, JointWaypoint):
            way.append(np.array(waypoint.position))
        elif isinstance(waypoint, PoseWaypoint):
            reach = all_solutions(robot, waypoint.pose, OPTIONS, way[-1])
            way.append(min(reach, key=lambda q: time_of(robot, [way[-1], q])))
    return way


@pytest.mark.parametrize("robot_id", ["date_sorting_arm", "kuka_kr16_l6_2", "ngv_refuelling_arm"])
def test_never_longer_than_from_branch_to_nearest_branch_and_often_shorter(robot_id: str) -> None:
    robot, rng = load_robot(robot_id), np.random.default_rng(11)
    shorter = 0
    for _ in range(3):
        start, *others = (np.array(random_position(robot, rng)) for _ in range(5))
        waypoints = (at(start), *(PoseWaypoint(pose=pose_at(robot, q)) for q in others))
        way = [waypoint.position for waypoint in solve_waypoints(robot, waypoints, OPTIONS)]
        taken, nearest = time_of(robot, way), time_of(robot, greedy(robot, waypoints))
        assert taken <= 1.06 * nearest + 4 * 0.02  # as much as six joints and four waypoints may be penalised
        shorter += taken < 0.99 * nearest
    assert shorter


def planar(*joints: DHJoint) -> Robot:
    return Robot.from_dh(joints)


def elbow_arm(second: float = 3.0) -> Robot:
    """Make a plane arm with two links of 1 m: both elbow configurations reach every point within reach."""
    return planar(
        DHJoint("revolute", a=1.0, lower=-3.0, upper=3.0, velocity=1.0),
        DHJoint("revolute", a=1.0, lower=-second, upper=second, velocity=1.0),
    )


def test_the_nearest_branch_is_left_when_the_way_is_shorter_through_another() -> None:
    """From (0, -0.1) the branch (0.4, -1.0) of the point is nearest, but the motion ends with the elbow at +1.6."""
    robot = elbow_arm()
    point = Pose(pose_at(robot, np.array([0.4, -1.0])).position)  # also (0.4 - 1.0, 1.0)
    waypoints = (at(np.array([0.0, -0.1])), PoseWaypoint(pose=point), at(np.array([-1.0, 1.6])))
    _, through, _ = solve_waypoints(robot, waypoints, OPTIONS)
    # By way of (0.4, -1.0): 0.9 + 2.6 s; by way of (-0.6, 1.0): 1.1 + 0.6 s.
    assert through.position == pytest.approx([-0.6, 1.0], abs=1e-6)
    assert (through.solutions, through.solution, through.choice) == (2, 1, "shortest_path")


def test_equal_ways_are_decided_by_the_limits() -> None:
    """Both elbows are equally far away; one puts the first joint at 2.9 of 3 rad."""
    robot = elbow_arm()
    point = Pose(pose_at(robot, np.array([2.9, -1.0])).position)
    from_between = InverseKinematicsOptions(reference=(2.4, 0.0))  # 1 s from (2.9, -1.0) and from (1.9, 1.0)
    (solved,) = solve_waypoints(robot, (PoseWaypoint(pose=point),), from_between)
    assert solved.position == pytest.approx([1.9, 1.0], abs=1e-6)


def test_no_joint_moves_for_nothing_behind_a_slower_one() -> None:
    """The wrist could flip while the slow first joint turns, without a longer duration."""
    robot = load_robot("kuka_kr16_l6_2")
    q = np.array([-1.5, -1.2, 1.1, 0.0, 0.3, 0.0])
    turned_about_the_base = q + np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    waypoints = (at(q), PoseWaypoint(pose=pose_at(robot, turned_about_the_base)))
    solved = solve_waypoints(robot, waypoints, OPTIONS)[1]
    assert solved.position == pytest.approx(turned_about_the_base, abs=1e-6)


def test_reasons() -> None:
    robot = elbow_arm(second=0.5)
    inner = Pose(pose_at(robot, np.array([0.2, 0.4])).position)
    waypoints = (at(np.array([0.0, 0.1])), PoseWaypoint(pose=inner))
    given, free = solve_waypoints(robot, waypoints, OPTIONS)
    assert (given.solutions, given.solution, given.choice) == (None, None, "given")
    assert (free.solutions, free.choice) == (2, "shortest_path")
    slider = planar(DHJoint("prismatic", lower=0.0, upper=1.0, velocity=1.0))
    waypoints = (at(np.array([0.1])), PoseWaypoint(pose=pose_at(slider, np.array([0.7]))))
    only = solve_waypoints(slider, waypoints, OPTIONS)[1]
    assert (only.solutions, only.solution, only.choice) == (1, 0, "only")


def test_whole_turns_within_limits_are_part_of_the_choice() -> None:
    """Joint 6 may turn by 700 degrees: the pose at -2.9 rad is also reached at -2.9 + 2 pi."""
    robot = load_robot("kuka_kr16_l6_2")
    q = np.array([0.3, -1.2, 1.1, 0.4, 0.7, 0.0])

    def sixth(angle: float) -> FloatArray:
        return q + np.array([0.0, 0.0, 0.0, 0.0, 0.0, angle])

    onwards = PoseWaypoint(pose=pose_at(robot, sixth(-2.9)))
    waypoints = (at(sixth(2.9)), onwards, at(sixth(4.0)))
    assert solve_waypoints(robot, waypoints, OPTIONS)[1].position == pytest.approx(sixth(-2.9 + TURN), abs=1e-5)
    waypoints = (at(sixth(-2.0)), onwards, at(sixth(-3.5)))
    assert solve_waypoints(robot, waypoints, OPTIONS)[1].position == pytest.approx(sixth(-2.9), abs=1e-5)


def test_a_joint_without_limits_is_where_the_joint_waypoint_behind_it_needs_it() -> None:
    """The pose at a half turn is 0.02 nearer in one direction, and the next joint waypoint is in the other."""
    robot = planar(DHJoint("continuous", a=1.0, velocity=1.0))
    half = PoseWaypoint(pose=pose_at(robot, np.array([np.pi - 0.01])))
    as_given = replace(at(np.array([-np.pi + 0.2])), motion=JointMotion("as_given"))
    waypoints = (at(np.array([0.0])), half, as_given)
    assert solve_waypoints(robot, waypoints, OPTIONS)[1].position == pytest.approx([-np.pi - 0.01], abs=1e-9)
    turning = [at(np.array([0.0])), *(RelativeWaypoint(frame="tool", move=quarter()) for _ in range(10))]
    way = solve_waypoints(robot, turning, OPTIONS)
    assert [waypoint.position[0] for waypoint in way] == pytest.approx([k * np.pi / 2.0 for k in range(11)], abs=1e-6)


def quarter() -> CartesianMove:
    """Return a quarter turn about the base of an arm with one link of 1 m."""
    c, s = np.cos(np.pi / 2.0), np.sin(np.pi / 2.0)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return CartesianMove((-1.0 + c, s, 0.0), rotation)


def test_the_reference_is_where_the_way_starts() -> None:
    robot = elbow_arm()
    point = PoseWaypoint(pose=Pose(pose_at(robot, np.array([0.4, -1.0])).position))
    for reference, expected in (((0.3, -0.9), [0.4, -1.0]), ((-0.5, 0.8), [-0.6, 1.0])):
        (solved,) = solve_waypoints(robot, (point,), InverseKinematicsOptions(reference=reference))
        assert solved.position == pytest.approx(expected, abs=1e-6)
    # Without one the start is free: it is where the second waypoint is near.
    first, _ = solve_waypoints(robot, (point, at(np.array([-0.6, 1.1]))), OPTIONS)
    assert first.position == pytest.approx([-0.6, 1.0], abs=1e-6)


def test_moves_in_the_axes_of_an_open_orientation_start_from_what_was_chosen() -> None:
    robot = load_robot("kuka_kr16_l6_2")
    point = Pose(pose_at(robot, np.array([0.3, -1.2, 1.1, 0.4, 0.7, -0.5])).position)
    ahead = RelativeWaypoint(frame="tool", move=CartesianMove((0.0, 0.0, 0.05)))
    up = RelativeWaypoint(frame="base", move=CartesianMove((0.0, 0.0, 0.02)))
    first, second, third = solve_waypoints(robot, (PoseWaypoint(pose=point), ahead, up), OPTIONS)
    axes = pose_at(robot, first.position).rotation
    assert axes is not None
    assert second.wanted.position == pytest.approx(point.position + 0.05 * axes[:, 2], abs=1e-12)
    assert third.wanted.position == pytest.approx(second.wanted.position + np.array([0.0, 0.0, 0.02]), abs=1e-12)
    for waypoint in (first, second, third):
        assert waypoint.wanted.rotation is None
        assert pose_at(robot, waypoint.position).position == pytest.approx(waypoint.wanted.position, abs=1e-6)


def test_the_first_waypoint_that_cannot_be_reached_is_named() -> None:
    robot = elbow_arm()
    far = PoseWaypoint(pose=Pose(np.array([3.0, 0.0, 0.0])))
    with pytest.raises(UnreachableWaypoint) as refusal:
        solve_waypoints(robot, (at(np.array([0.1, 0.2])), far, far), OPTIONS)
    assert refusal.value.waypoint == 1


class Dense:
    """A follower of straight lines of the tool in 200 Newton steps that refuses a singularity or any `barrier`."""

    def __init__(self, robot: Robot, barrier: tuple[int, float] | None = None) -> None:
        self.robot, self.barrier = robot, barrier
        self.calls: list[tuple[int, FloatArray]] = []

    def __call__(self, requested: RequestedMotion, start: FloatArray) -> ToolMotion | RefusedMotion:
        self.calls.append((requested.index, start))
        path = requested.pose_path(start)
        try:
            end = self.end(requested.index, start, requested.before, requested.after)
        except PlanningError as error:
            return RefusedMotion(requested, start, path, PathPoint(0.0, pose_at(self.robot, start), start), error)
        straight = PiecewisePolynomial(np.ones(1), np.stack([start, end - start], axis=-1)[None])
        return ToolMotion(path, straight, end)

    def end(self, index: int, start: FloatArray, before: Pose, after: Pose) -> FloatArray:
        """Solve the end of the straight line from one pose to the other."""
        q = start.copy()
        for u in np.linspace(0.0, 1.0, 201)[1:]:
            for _ in range(4):
                here = pose_at(self.robot, q)
                missing = before.position + u * (after.position - before.position) - here.position
                if after.rotation is not None:
                    assert before.rotation is not None
                    assert here.rotation is not None
                    due = before.rotation @ pin.exp3(u * pin.log3(before.rotation.T @ after.rotation))
                    missing = np.concatenate([missing, here.rotation @ pin.log3(here.rotation.T @ due)])
                step = np.linalg.pinv(jacobian(self.robot, q)[: len(missing)], rcond=1e-9) @ missing
                q = q + step
            if np.abs(step).max() > 1e-6:
                raise SingularPath(f"stuck on the way to {index} from {start.round(3).tolist()}", waypoint=index)
            if self.barrier is not None and q[self.barrier[0]] > self.barrier[1]:
                raise ConfigurationChange(f"from {start.round(3).tolist()}", waypoint=index)
        return q


def line_to(robot: Robot, q: FloatArray) -> PoseWaypoint:
    return PoseWaypoint(pose=Pose(pose_at(robot, q).position), motion=LINE)


def solved_by(follow: Dense, robot: Robot, waypoints: Sequence[AnyWaypoint]) -> tuple[SolvedWaypoint, ...]:
    """Return the solved waypoints with another follower of motions of the tool."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("planner.waypoints.choice.follow_motion", follow)
        return solve_waypoints(robot, waypoints, OPTIONS)


def test_a_line_goes_on_in_the_branch_it_starts_in() -> None:
    """The start of the line is free, and only the elbow of the start leads to its end."""
    robot = elbow_arm()
    first = PoseWaypoint(pose=Pose(pose_at(robot, np.array([0.4, -1.0])).position))
    waypoints = (at(np.array([0.0, 0.3])), first, line_to(robot, np.array([0.6, -0.8])), at(np.array([0.2, 0.9])))
    follow = Dense(robot)
    solved = solved_by(follow, robot, waypoints)
    assert np.sign(solved[1].position[1]) == np.sign(solved[2].position[1]) == 1.0
    assert [waypoint.choice for waypoint in solved] == ["given", "shortest_path", "continued", "given"]
    # Only the line from the chosen start was followed.
    assert [(index, start.tolist()) for index, start in follow.calls] == [(2, solved[1].position.tolist())]


def test_another_branch_is_taken_when_the_best_cannot_be_followed() -> None:
    """The line from the nearer branch takes joint 1 beyond a barrier; the other elbow stays below it."""
    robot = elbow_arm()
    first = PoseWaypoint(pose=Pose(pose_at(robot, np.array([0.4, -1.0])).position))
    waypoints = (at(np.array([0.3, -0.9])), first, line_to(robot, np.array([0.9, -1.2])))
    free = solved_by(Dense(robot), robot, waypoints)
    assert free[1].position == pytest.approx([0.4, -1.0], abs=1e-6)
    assert free[2].position == pytest.approx([0.9, -1.2], abs=1e-6)
    follow = Dense(robot, barrier=(0, 0.8))
    other = solved_by(follow, robot, waypoints)
    assert other[1].position == pytest.approx([-0.6, 1.0], abs=1e-6)
    assert other[2].position == pytest.approx([-0.3, 1.2], abs=1e-6)
    assert len(follow.calls) == 2


def test_where_no_branch_can_be_followed_the_best_ones_error_comes() -> None:
    robot = elbow_arm()
    first = PoseWaypoint(pose=Pose(pose_at(robot, np.array([0.4, -1.0])).position))
    waypoints = (at(np.array([0.3, -0.9])), first, line_to(robot, np.array([0.9, -1.2])))
    follow = Dense(robot, barrier=(0, -0.7))  # even (-0.6, 1.0) lies beyond
    with pytest.raises(ConfigurationChange, match=r"from \[0\.4, -1\.0\]") as refusal:
        solved_by(follow, robot, waypoints)
    assert refusal.value.waypoint == 2
    assert {tuple(start.round(3)) for _, start in follow.calls} == {(0.4, -1.0), (-0.6, 1.0)}


@pytest.mark.large_only
def test_lines_through_a_list_of_a_six_axis_arm_are_all_followed() -> None:
    """On joint motion, two lines, joint motion and line, every line starts and ends on the followed joint path."""
    robot = load_robot("kuka_kr16_l6_2")
    q = np.array([0.3, -1.2, 1.1, 0.4, 0.7, -0.5])
    down = CartesianMove((0.0, 0.0, 0.05))
    free = PoseWaypoint(pose=pose_at(robot, q))
    lines = [RelativeWaypoint(frame="tool", move=down, motion=LINE) for _ in range(2)]
    back = RelativeWaypoint(frame="base", move=CartesianMove((0.1, 0.1, 0.0)))
    waypoints: list[AnyWaypoint] = [at(q + 0.2), free, *lines, back, lines[0]]
    follow = Dense(robot)
    solved = solved_by(follow, robot, waypoints)
    assert_followed(robot, waypoints, solved)
    assert len(follow.calls) == 3


def test_a_redundant_arm_goes_on_from_where_a_line_ends() -> None:
    """With six joints and positions only, a line ends in one of a continuum, which no candidate foresees."""
    robot = load_robot("kuka_kr16_l6_2")
    q = np.array([0.3, -1.2, 1.1, 0.4, 0.7, -0.5])
    corner = pose_at(robot, q).position
    lines = [PoseWaypoint(pose=Pose(corner + shift), motion=LINE) for shift in (0.1 * np.eye(3))[:2]]
    waypoints = [at(q), *lines, PoseWaypoint(pose=Pose(corner + 0.1))]
    solved = solved_by(Dense(robot), robot, waypoints)
    assert_followed(robot, waypoints, solved)
    assert [waypoint.choice for waypoint in solved] == ["given", "continued", "continued", "shortest_path"]


def assert_followed(robot: Robot, waypoints: Sequence[AnyWaypoint], solved: Sequence[SolvedWaypoint]) -> None:
    follow = Dense(robot)
    for index, (before, after) in enumerate(itertools.pairwise(solved), start=1):
        if isinstance(waypoints[index].motion, LinearMotion):
            end = follow.end(index, before.position, before.wanted, after.wanted)
            assert after.position == pytest.approx(end, abs=1e-9)
            assert after.choice == "continued"
