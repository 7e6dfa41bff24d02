"""Poses with free ranges: their ends by scipy's angles, the nearest joint position by dense kinematics."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.corpus.tracing import tool_at
from planner.errors import InvalidProblem
from planner.kinematics.configurations import Configuration, configurations
from planner.kinematics.inverse import solution_layers
from planner.kinematics.options import InverseKinematicsOptions
from planner.paths import solve_path
from planner.planning import plan
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.regions import Region
from planner.robots import Robot, load_robot
from planner.robots.tools import with_region_joints
from planner.spatial import FloatArray, Pose, rotation_from_rpy

ARMS = {
    "kuka_kr16_l6_2": (0.3, -1.2, 1.4, 0.2, 0.6, 0.1),
    "ur5": (0.0, -1.5, 1.6, -1.6, -1.5, 0.2),
    "panda": (0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.5),
}
NAMES = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")
REGIONS = {
    "along the tool": Region(z=(-0.06, 0.02)),
    "about the tool, in part": Region(rotation_z=(-0.4, 0.7)),
    "beside what is written": Region(rotation_z=(0.3, 0.6)),
    "on a plate": Region(x=(-0.05, 0.05), y=(-0.03, 0.06)),
    "tilted": Region(rotation_x=(-0.2, 0.3), rotation_y=(-0.3, 0.1)),
    "a tilted drill": Region(rotation_y=(-0.3, 0.3), rotation_z=(-np.pi, np.pi)),
}
DENSE = {1: 81, 2: 17}
"""Points along each free direction, by the number of directions."""


def robot_of(arm: str) -> Robot:
    return load_robot(arm)


def at(requested: Pose, offsets: dict[str, float]) -> Pose:
    """Return the pose at offsets by scipy: turns about the axes of the pose, x first."""
    shift = np.array([offsets.get(name, 0.0) for name in NAMES[:3]])
    turn = Rotation.from_euler("XYZ", [offsets.get(name, 0.0) for name in NAMES[3:]]).as_matrix()
    assert requested.rotation is not None
    return Pose(requested.position + requested.rotation @ shift, requested.rotation @ turn)


def offsets_of(requested: Pose, reached: Pose) -> dict[str, float]:
    assert requested.rotation is not None
    shift = requested.rotation.T @ (reached.position - requested.position)
    turn = Rotation.from_matrix(requested.rotation.T @ reached.rotation).as_euler("XYZ")
    return dict(zip(NAMES, [*shift.tolist(), *turn.tolist()], strict=True))


def is_in(region: Region, requested: Pose, reached: Pose) -> None:
    for name, offset in offsets_of(requested, reached).items():
        lower, upper = region.ranges.get(name, (0.0, 0.0))
        assert lower - 2e-6 <= offset <= upper + 2e-6


def somewhere(robot: Robot, start: FloatArray, seed: int) -> Pose:
    rng, before = np.random.default_rng(seed), tool_at(robot, start)
    turn = rotation_from_rpy(*rng.uniform(-0.4, 0.4, 3))
    return Pose(before.position + rng.uniform(-0.12, 0.12, 3), before.rotation @ turn)


@pytest.mark.long_table
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("arm", ["kuka_kr16_l6_2", "ur5"])
@pytest.mark.parametrize("name", REGIONS)
def test_no_pose_of_a_dense_grid_has_a_nearer_joint_position(name: str, arm: str, seed: int) -> None:
    robot, region, start = robot_of(arm), REGIONS[name], np.array(ARMS[arm])
    requested = somewhere(robot, start, seed)
    goal = PoseWaypoint(requested, free=region)
    reached = solve_path(PlanningProblem(robot, [JointWaypoint(start), goal])).waypoints[1]
    is_in(region, requested, tool_at(robot, reached.position))
    assert region.offsets(requested, reached.pose) == pytest.approx(
        {name: value for name, value in offsets_of(requested, reached.pose).items() if name in region.ranges}, abs=1e-9
    )
    grids = (np.linspace(*ends, DENSE[len(region.ranges)]) for ends in region.ranges.values())
    poses = [at(requested, dict(zip(region.ranges, values, strict=True))) for values in product(*grids)]
    velocity = robot.limit("velocity")
    layers = solution_layers(robot, poses, InverseKinematicsOptions(), start)
    nearest = min(float((np.abs(q - start) / velocity).max()) for layer in layers for q in layer)
    taken = float((np.abs(reached.position - start) / velocity).max())
    assert taken <= 1.02 * nearest + 1e-6  # beside the slowest joint a hundredth of all others counts


def test_an_arm_with_seven_joints_goes_no_further_than_without_the_region() -> None:
    """It also goes no further than to any of a grid of poses in it, each by many descents from around the start."""
    robot, region = robot_of("panda"), Region(z=(-0.05, 0.05), rotation_z=(-0.5, 0.5))
    start, velocity = np.array(ARMS["panda"]), robot_of("panda").limit("velocity")
    requested = somewhere(robot, start, 3)
    goals = [PoseWaypoint(requested, free=region), PoseWaypoint(requested)]
    ways = [solve_path(PlanningProblem(robot, [JointWaypoint(start), goal])).positions[1] for goal in goals]
    is_in(region, requested, tool_at(robot, ways[0]))
    times = [float((np.abs(q - start) / velocity).max()) for q in ways]
    assert times[0] < 0.9 * times[1]
    for z, turn in product(np.linspace(-0.05, 0.05, 3), np.linspace(-0.5, 0.5, 3)):
        there = PoseWaypoint(at(requested, {"z": z, "rotation_z": turn}))
        q = solve_path(PlanningProblem(robot, [JointWaypoint(start), there])).positions[1]
        assert times[0] <= 1.02 * float((np.abs(q - start) / velocity).max())


def test_a_pose_out_of_reach_is_reached_at_the_near_end_of_its_range() -> None:
    robot = robot_of("kuka_kr16_l6_2")
    stretched = tool_at(robot, np.array([0.3, -0.4, 0.45, 0.2, 0.6, 0.1]))
    far = Pose(stretched.position * np.array([1.12, 1.12, 1.0]), stretched.rotation)
    start = JointWaypoint(ARMS["kuka_kr16_l6_2"])
    region = Region(x=(-0.4, 0.4), y=(-0.4, 0.4), z=(-0.4, 0.4))
    reached = solve_path(PlanningProblem(robot, [start, PoseWaypoint(far, free=region)])).waypoints[1]
    is_in(region, far, reached.pose)


@pytest.mark.large_only
def test_the_configuration_asked_is_kept() -> None:
    robot, start = robot_of("kuka_kr16_l6_2"), np.array(ARMS["kuka_kr16_l6_2"])
    requested, region = somewhere(robot, start, 1), Region(rotation_z=(-1.0, 1.0), z=(-0.02, 0.02))
    for wrist in ("flip", "no_flip"):
        goal = PoseWaypoint(requested, Configuration(wrist=wrist), free=region)  # type: ignore[arg-type]
        reached = solve_path(PlanningProblem(robot, [JointWaypoint(start), goal])).waypoints[1]
        assert configurations(robot, [reached.position])[0].wrist == wrist
        is_in(region, requested, reached.pose)


def test_a_line_goes_to_a_region_in_a_frame() -> None:
    robot, start = robot_of("kuka_kr16_l6_2"), np.array(ARMS["kuka_kr16_l6_2"])
    frame, requested = Pose.from_rpy([0.2, -0.1, 0.3], [0.1, 0.2, 0.3]), somewhere(robot, start, 2)
    region = Region(z=(-0.02, 0.02), rotation_x=(-0.1, 0.1))
    goal = PoseWaypoint(requested.to_frame(frame), frame=frame, free=region, motion=LinearMotion())
    made = plan(PlanningProblem(robot, [JointWaypoint(start), goal]))
    is_in(region, requested, made.path.waypoints[1].pose)


@pytest.mark.parametrize("tool", [None, Pose.from_rpy([0.1, 0.0, 0.2], [0.3, -0.5, 0.7])])
def test_region_coordinates_are_joints_behind_the_tool(tool: Pose | None) -> None:
    """The pose of the robot with free directions is T D: T of the arm, D by scipy."""
    robot, rng = load_robot("kuka_kr16_l6_2"), np.random.default_rng(0)
    robot = robot if tool is None else robot.with_tool(tool)
    ranges = {"y": (-0.1, 0.1), "z": (-0.2, 0.3), "rotation_x": (-0.5, 0.5), "rotation_y": (-1.0, 1.0)}
    ranges["rotation_z"] = (-np.pi, np.pi)
    free = with_region_joints(robot, ranges)
    assert (free.dof, free.joints[6].kind, free.joints[-1].upper) == (11, "continuous", 0.1)
    for _ in range(5):
        q = np.array(ARMS["kuka_kr16_l6_2"]) + rng.uniform(-0.3, 0.3, 6)
        offsets = {name: float(rng.uniform(*ends)) for name, ends in ranges.items()}
        goal = tool_at(free, np.concatenate([q, list(offsets.values())[::-1]]))
        there, expected = tool_at(robot, q), at(goal, offsets)
        assert there.position == pytest.approx(expected.position, abs=1e-12)
        assert there.rotation == pytest.approx(expected.rotation, abs=1e-12)


@pytest.mark.parametrize(
    ("region", "field"),
    [
        (Region(), ("free",)),
        (Region(z=(0.1, -0.1)), ("free", "z")),
        (Region(rotation_x=(-2.0, 0.0)), ("free", "rotation_x")),
        (Region(x=(0.0, np.inf)), ("free", "x")),
    ],
)
def test_ranges_that_are_none_are_refused(region: Region, field: tuple[str, ...]) -> None:
    robot = load_robot("kuka_kr16_l6_2")
    with pytest.raises(InvalidProblem) as refused:
        plan(PlanningProblem(robot, [PoseWaypoint(Pose([1.0, 0.0, 0.5], np.eye(3)), free=region)]))
    assert refused.value.faults[0].field == ("waypoints", 0, *field)
