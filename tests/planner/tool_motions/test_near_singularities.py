"""Lines and circles that pass near a singular wrist: refused, slowed down, or led right through it.

The lines keep the tool's orientation except for an angle by which they miss the singular joint position. The truth is
Pinocchio's forward kinematics, and a chain of joint positions traced along poses, densely where the wrist turns over.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.corpus.tracing import reach, tool_at, trace
from planner.backends import BackEnd, Cubic, Ruckig, Toppra
from planner.errors import SingularPath
from planner.kinematics import forward_kinematics
from planner.kinematics.search import pose_errors
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import (
    CircularMotion,
    JointWaypoint,
    LinearMotion,
    PlanningProblem,
    PoseWaypoint,
    Singularity,
)
from planner.robots import Robot, catalogue_ids, load_robot
from planner.spatial import FloatArray, Pose, rotation_from_rpy

ROBOTS = [
    "kuka_kr16_l6_2",
    pytest.param("ur5", marks=pytest.mark.skipif("ur5" not in catalogue_ids(), reason="example-robot-data is missing")),
]


def line_past(name: str, missed: float) -> tuple[Robot, FloatArray, Pose, Pose]:
    """Return a robot, a joint position, and a line from there that misses a straight wrist by an angle.

    The line is given by its two poses; the angle is in rad.
    """
    robot = load_robot(name)
    if name == "ur5":  # across the plane of the arm, so that the first joint turns the wrist
        middle = tool_at(robot, np.array((0.3, -1.2, 1.4, -0.2, 0.0, 0.0)))
        outwards = middle.position * [1.0, 1.0, 0.0] / np.hypot(*middle.position[:2])
        aside = np.cross([0.0, 0.0, 1.0], outwards)
        rotation = pin.exp3(outwards * missed) @ middle.rotation
        ends = [Pose(middle.position + way * 0.08 * aside, rotation) for way in (-1.0, 1.0)]
        near = np.array((0.2, -1.2, 1.4, -0.2, 0.1, 0.0))
    else:  # in the plane of the arm
        near = np.array((0.3, -1.2, 1.4, 0.0, 0.3, 0.0))
        turn = rotation_from_rpy(0.0, 0.0, missed)
        poses = [tool_at(robot, q) for q in (near, np.array((0.3, -1.1, 1.3, 0.0, -0.2, 0.0)))]
        ends = [Pose(pose.position, turn @ pose.rotation) for pose in poses]
    start = reach(robot, ends[0], near)
    assert start is not None
    return robot, start, ends[0], ends[1]


def pose_on(start: Pose, end: Pose, u: float) -> Pose:
    turn = pin.log3(end.rotation @ np.asarray(start.rotation).T)
    return Pose(start.position + u * (end.position - start.position), pin.exp3(u * turn) @ start.rotation)


def planned(name: str, missed: float, singularity: Singularity, backend: BackEnd, **tolerances: float) -> Plan:
    robot, start, _, end = line_past(name, missed)
    goal = PoseWaypoint(end, motion=LinearMotion(singularity=singularity, **tolerances))
    made = plan(PlanningProblem(robot, [JointWaypoint(start), goal]), backend)
    assert made.certificate.satisfied
    return made


def times_of(made: Plan) -> FloatArray:
    """Return times, s, that are dense where the time scaling has many pieces."""
    breakpoints = made.trajectory.breakpoints
    inside = [np.linspace(a, b, 4) for a, b in itertools.pairwise(breakpoints)]
    return np.unique(np.concatenate([np.linspace(0.0, breakpoints[-1], 300), *inside]))


def off_the_line(made: Plan, start: Pose, end: Pose) -> tuple[float, float]:
    """Return the largest deviations of the tool from the line, m, and from the orientation on it, rad."""
    way = end.position - start.position
    worst = np.zeros(2)
    for tool in forward_kinematics(made.problem.robot, made.trajectory.evaluate(times_of(made), [0])[0]):
        share = float((tool.position - start.position) @ way / (way @ way))
        distance, angle = pose_errors(pose_on(start, end, share), tool)
        worst = np.maximum(worst, [distance, angle or 0.0])
    return float(worst[0]), float(worst[1])


def within_velocities(made: Plan) -> bool:
    velocities = made.trajectory.evaluate(times_of(made), [1])[0]
    return bool((np.abs(velocities) <= made.problem.robot.limit("velocity") * (1.0 + 1e-6)).all())


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("missed", "backend"),
    [*itertools.product([1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 3e-6], [Toppra()]), (1e-3, Ruckig()), (1e-5, Ruckig())],
)
@pytest.mark.parametrize("name", ROBOTS)
def test_slow_keeps_the_line_and_the_joint_speeds(name: str, missed: float, backend: BackEnd) -> None:
    robot, _, start, end = line_past(name, missed)
    made = planned(name, missed, "slow", backend)
    distance, angle = off_the_line(made, start, end)
    assert distance < 1e-4
    assert angle < 1e-3
    assert within_velocities(made)
    q = made.trajectory.evaluate(times_of(made), [0])[0]
    turned = np.ptp(q, axis=0)
    assert np.abs(q[:, 4]).min() == pytest.approx(missed, rel=0.1)  # the wrist is led past, not through
    assert turned[5] > 1.5
    # Time stretches for the half turn of the wrist, not for the whole line.
    turning = float((turned / robot.limit("velocity")).sum())
    assert made.trajectory.duration < 0.8 + 1.5 * turning
    codes = [warning.code for warning in made.warnings]
    assert missed == 1e-2 or ("near_singularity" in codes) == (missed < 1e-2)


@pytest.mark.long_table
@pytest.mark.parametrize("missed", [1e-1, 1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("name", ROBOTS)
def test_slow_is_the_chain_of_joint_positions_along_the_line(name: str, missed: float) -> None:
    robot, q, start, end = line_past(name, missed)
    made = planned(name, missed, "slow", Toppra())
    motion = made.path.waypoints[1].tool_motion
    assert motion is not None
    u = np.linspace(0.0, 1.0, 1001)
    nearest = u[np.abs(motion.curve.evaluate(u, [0])[0][:, 4]).argmin()]
    around = missed * np.geomspace(1e-3, 1e3, 300)
    u = np.unique(np.clip(np.concatenate([u[1:], nearest - around, nearest + around]), 1e-4, 1.0))
    chain = trace(robot, [pose_on(start, end, share) for share in u.tolist()], q)
    assert chain is not None
    exact = motion.curve.evaluate(u, [0])[0]
    # The joints may deviate by the tool's tolerance divided by the smallest singular value.
    assert np.abs(exact - chain)[[0, -1]].max() < 1e-6
    assert np.abs(exact[:, :3] - chain[:, :3]).max() < 1e-3


@pytest.mark.long_table
@pytest.mark.parametrize("missed", [1e-4, 3e-6])
@pytest.mark.parametrize("name", ROBOTS)
def test_refused_where_a_joint_would_all_but_jump_with_remedies_that_help(name: str, missed: float) -> None:
    robot, start, _, end = line_past(name, missed)
    problem = PlanningProblem(robot, [JointWaypoint(start), PoseWaypoint(end, motion=LinearMotion())])
    with pytest.raises(SingularPath, match="further than 1000 rad") as refusal:
        plan(problem, Toppra())
    offered = {remedy.value: remedy for remedy in refusal.value.remedies if remedy.field[-1] == "singularity"}
    assert set(offered) == {"slow", "deviate"}
    for remedy in offered.values():
        assert plan(remedy.applied_to(problem), Toppra()).certificate.satisfied


@pytest.mark.long_table
@pytest.mark.parametrize("missed", [2e-2, 1e-2, 1e-3, 1e-4, 1e-5, 3e-6])
@pytest.mark.parametrize("name", ROBOTS)
def test_deviate_goes_right_through_within_the_tolerance(name: str, missed: float) -> None:
    _, _, start, end = line_past(name, missed)
    made = planned(name, missed, "deviate", Cubic(), tolerance_orientation=0.03)
    distance, angle = off_the_line(made, start, end)
    assert distance < 1e-4
    assert angle < missed * 1.01 + 1e-4  # no further than by the distance of the line from the joint position
    assert within_velocities(made)
    q = made.trajectory.evaluate(times_of(made), [0])[0]
    assert np.sign(q[0, 4]) == -np.sign(q[-1, 4])
    assert np.abs(q[-1, 4]) > 0.05
    assert np.ptp(q[:, 5]) < 0.5  # the wrist does not turn over
    assert made.trajectory.duration < 2.5
    assert [warning.code for warning in made.warnings] == ["orientation_deviates"]


@pytest.mark.large_only
def test_deviate_where_the_tolerance_is_less_than_it_takes() -> None:
    """A feasible line is followed exactly; an infeasible one is refused."""
    made = planned("kuka_kr16_l6_2", 1e-2, "deviate", Toppra())
    exact = planned("kuka_kr16_l6_2", 1e-2, "refuse", Toppra())
    assert made.trajectory.duration == pytest.approx(exact.trajectory.duration, rel=1e-6)
    with pytest.raises(SingularPath):
        planned("kuka_kr16_l6_2", 1e-4, "deviate", Toppra(), tolerance_orientation=5e-5)


@pytest.mark.parametrize("singularity", ["slow", "deviate"])
def test_what_is_no_wrist_and_what_would_have_to_jump_stays_refused(singularity: Singularity) -> None:
    """The cases are a stretched elbow, and a stretched wrist that leaves its plane."""
    arm = load_robot("three_dof_arm")
    stretched = np.array((0.3, -0.9, 0.0))
    inwards = Pose(0.9 * tool_at(arm, stretched).position)
    robot = load_robot("kuka_kr16_l6_2")
    straight = np.array((0.3, -1.2, 1.4, 0.0, 0.0, 0.0))
    tool = tool_at(robot, straight)
    aside = Pose(tool.position + 0.1 * np.array([-np.sin(0.3), -np.cos(0.3), 0.0]), tool.rotation)
    for arm_asked, start, end in ((arm, stretched, inwards), (robot, straight, aside)):
        goal = PoseWaypoint(end, motion=LinearMotion(singularity=singularity))
        with pytest.raises(SingularPath):
            plan(PlanningProblem(arm_asked, [JointWaypoint(start), goal]), Cubic())


@pytest.mark.parametrize("singularity", ["slow", "deviate"])
def test_a_circle_near_a_straight_wrist(singularity: Singularity) -> None:
    """A flat arc replaces the line; the tool keeps to the circle."""
    robot, start, first, last = line_past("kuka_kr16_l6_2", 1e-4)
    sagging = pose_on(first, last, 0.5).position + np.array([0.0, 0.0, 0.01])
    circle = CircularMotion(Pose(sagging), singularity=singularity)
    problem = PlanningProblem(robot, [JointWaypoint(start), PoseWaypoint(last, motion=circle)])
    made = plan(problem, Toppra())
    checks = {check.quantity: check for check in made.certificate.checks}
    assert checks["path_position_deviation"].peak < 1e-4
    assert checks["path_orientation_deviation"].peak < 1e-3
    refused = [problem.waypoints[0], replace(problem.waypoints[1], motion=CircularMotion(Pose(sagging)))]
    with pytest.raises(SingularPath):
        plan(replace(problem, waypoints=refused), Toppra())


@pytest.mark.large_only
def test_random_lines_past_singular_wrists() -> None:
    """Each goes through a random stretched joint position, off by a random angle, in a random direction of the tool."""
    robot, rng, tried = load_robot("kuka_kr16_l6_2"), np.random.default_rng(3), 0
    while tried < 8:
        position = np.concatenate([rng.uniform((-1.0, -1.5, 0.9, -1.0), (1.0, -0.9, 1.6, 1.0)), np.zeros(2)])
        middle, missed = tool_at(robot, position), 10.0 ** rng.uniform(-5.5, -1.0)
        way, turn, spin = 0.06 * unit(rng), missed * unit(rng), rng.uniform(0.05, 0.3) * unit(rng)
        first, last = (
            Pose(middle.position + s * way, pin.exp3(s * spin) @ pin.exp3(turn) @ middle.rotation) for s in (-1.0, 1.0)
        )
        start = reach(robot, first, position + np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0]))
        if start is None or not ((start > robot.limit("lower")) & (start < robot.limit("upper"))).all():
            continue
        tried += 1
        for singularity, most in (("slow", 2e-3), ("deviate", 0.2)):
            motion = LinearMotion(singularity=singularity, tolerance_orientation=most)  # type: ignore[arg-type]
            problem = PlanningProblem(robot, [JointWaypoint(start), PoseWaypoint(last, motion=motion)])
            made = plan(problem, Toppra())
            distance, angle = off_the_line(made, first, last)
            assert distance < 1e-4
            assert angle < most + 1e-3  # the share of the way is known to 1e-4 m
            assert within_velocities(made)


def unit(rng: np.random.Generator) -> FloatArray:
    direction = rng.normal(size=3)
    return np.asarray(direction / np.linalg.norm(direction))
