"""URScript for the pendant, read back by a grammar of its statements and checked with Pinocchio and scipy."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from planner.backends import Cubic, MinEffort, Quintic, Ruckig
from planner.errors import UnsupportedFormat
from planner.export import ExportOptions, render
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.actions import AtWaypoint, SetOutput
from planner.problems.problem import (
    AnyWaypoint,
    CircularMotion,
    LinearMotion,
    PlanningProblem,
    PolylineMotion,
    PoseWaypoint,
)
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.robots import load_robot
from planner.spatial import Pose
from tests.planner.export.programs import joints, pinocchio_pose, pose_beside

ROBOT = load_robot("ur5e")
HOME = np.array([0.0, -1.5, 1.7, -1.2, -1.4, 0.0])
moved = partial(pose_beside, ROBOT, HOME)
N = r"(-?\d+(?:\.\d+)?(?:e-?\d+)?)"
ROW = ", ".join([N] * 6)
PLACED = rf"pose_trans\(base, p\[{ROW}\]\)"
ENDING = r"a=(\d+\.\d{4}), v=(\d+\.\d{4})(?:, r=(\d+\.\d{4}))?"
BASE_OF_CONTROLLER = np.eye(4)
BASE_OF_CONTROLLER[:3] = np.column_stack([np.diag([-1.0, -1.0, 1.0]), [0.1, -0.2, 0.3]])
"""The plan's base in the base of a controller, which has its own."""


@dataclass
class Statement:
    """A motion of a program, its joint positions or poses in the controller's base, and the rest after it."""

    kind: str
    waypoint: int
    values: list[np.ndarray]
    acceleration: float
    speed: float
    radius: float
    rest: list[object] = field(default_factory=list)
    tool: np.ndarray | None = None


def matrix(values: list[str]) -> np.ndarray:
    """Return the transform of a position, m, and a rotation vector, rad, by scipy."""
    numbers = np.array([float(value) for value in values])
    found = np.eye(4)
    found[:3, 3] = numbers[:3]
    found[:3, :3] = Rotation.from_rotvec(numbers[3:]).as_matrix()
    return found


def read(program: str) -> tuple[list[object], list[Statement]]:
    """Parse a program into its first rest and its motions, or fail at a line outside the grammar."""
    lines = [line for line in program.split("\n") if not line.startswith("#")]
    assert lines[0] == "def planned_trajectory():" and lines[-3:] == ["end", "planned_trajectory()", ""]
    start = re.fullmatch(rf"  start = \[{ROW}\]", lines[1])
    assert start is not None
    position = np.array([float(value) for value in start.groups()])
    approach = lines.index("  movej(start, t=1.0)")
    base, tool, waypoint = np.full((4, 4), np.nan), None, 0
    before: list[object] = []
    found: list[Statement] = []
    for line in (row.removeprefix("  ") for row in lines[approach + 1 : -3]):
        rest = found[-1].rest if found else before
        if match := re.fullmatch(r"# waypoint (\d+)", line):
            waypoint = int(match[1])
        elif match := re.fullmatch(rf"base = pose_trans\(get_forward_kin\(start\), pose_inv\(p\[{ROW}\]\)\)", line):
            base = BASE_OF_CONTROLLER @ pinocchio_pose(ROBOT, position) @ np.linalg.inv(matrix(list(match.groups())))
        elif match := re.fullmatch(rf"set_tcp\(p\[{ROW}\]\)", line):
            tool = matrix(list(match.groups()))
        elif match := re.fullmatch(rf"movej\(\[{ROW}\], {ENDING}\)", line):
            values = [np.array([float(value) for value in match.groups()[:6]])]
            found.append(Statement("joint", waypoint, values, *map(float, (match[7], match[8], match[9] or 0))))
        elif match := re.fullmatch(rf"movel\({PLACED}, {ENDING}\)", line):
            values = [base @ matrix(list(match.groups()[:6]))]
            ending = map(float, (match[7], match[8], match[9] or 0))
            found.append(Statement("line", waypoint, values, *ending, tool=tool))
        elif match := re.fullmatch(rf"movec\({PLACED}, {PLACED}, {ENDING}, mode=0\)", line):
            values = [base @ matrix(list(match.groups()[i : i + 6])) for i in (0, 6)]
            found.append(Statement("circle", waypoint, values, *map(float, (match[13], match[14], match[15] or 0))))
        elif match := re.fullmatch(rf"sleep\({N}\)", line):
            rest.append(float(match[1]))
        else:
            match = re.fullmatch(r"set_standard_digital_out\(([0-7]), (True|False)\)", line)
            assert match is not None, line
            rest.append((int(match[1]), match[2] == "True"))
    assert all(each.acceleration > 0.0 and each.speed > 0.0 for each in found)
    return before, found


@pytest.fixture(scope="module")
def mixed() -> Plan:
    """Plan a motion of every kind that URScript has, with blends, waits and an output."""
    waypoints: list[AnyWaypoint] = [
        joints(HOME, dwell=0.3),
        joints(HOME + 0.1),
        PoseWaypoint(moved(0.0, 0.1, 0.0), motion=LinearMotion(), transition=BlendTransition(0.02)),
        PoseWaypoint(moved(0.0, 0.1, 0.1), motion=LinearMotion(), dwell=0.5),
        PoseWaypoint(
            moved(0.0, -0.1, 0.1),
            motion=CircularMotion(via=Pose(moved(0.0, 0.0, 0.2).position)),
        ),
        joints(HOME, transition=BlendTransition(0.0512)),
        joints(HOME - [0.3, 0.1, 0.1, 0.0, 0.2, 0.1]),
    ]
    actions = [SetOutput(AtWaypoint(3), "standard_digital_out_3", True)]
    return plan(PlanningProblem(ROBOT, waypoints, actions=actions), Quintic())


def test_each_waypoint_is_one_instruction_at_its_pose(mixed: Plan) -> None:
    _, found = read(render(mixed, "urscript_moves", ExportOptions()).decode())
    assert [each.kind for each in found] == ["joint", "line", "line", "circle", "joint", "joint"]
    assert [each.waypoint for each in found] == list(range(1, 7))
    for each, position in zip(found, mixed.path.positions[1:], strict=True):
        if each.kind == "joint":
            np.testing.assert_allclose(each.values[0], position, atol=1e-12)
        else:
            np.testing.assert_allclose(each.values[-1], BASE_OF_CONTROLLER @ pinocchio_pose(ROBOT, position), atol=1e-9)
    via = np.append(moved(0.0, 0.0, 0.2).position, 1.0)
    np.testing.assert_allclose(found[3].values[0][:, 3], BASE_OF_CONTROLLER @ via, atol=1e-9)


def test_blends_and_rests_stand_at_their_waypoints(mixed: Plan) -> None:
    before, found = read(render(mixed, "urscript_moves", ExportOptions()).decode())
    assert [each.radius for each in found] == [0.0, 0.02, 0.0, 0.0, 0.0512, 0.0]
    assert before == [pytest.approx(0.3)]
    assert [each.rest for each in found if each.rest] == [[(3, True), pytest.approx(0.5)]]


def test_speeds_are_within_those_of_the_certified_segments(mixed: Plan) -> None:
    step = 1e-6
    for segment, each in enumerate(read(render(mixed, "urscript_moves", ExportOptions()).decode())[1]):
        start, end = mixed.trajectory.departures[segment], mixed.trajectory.arrivals[segment + 1]
        q, v, a = mixed.trajectory.evaluate(np.linspace(start, end - step, 2001), [0, 1, 2])
        if each.kind == "joint":
            most = [float(np.abs(values).max()) for values in (a, v)]
            assert each.acceleration <= most[0] * 1.0001 and each.speed <= most[1] * 1.0001
            assert [each.acceleration, each.speed] == pytest.approx(most, rel=5e-3)
            continue
        later = mixed.trajectory.evaluate(np.linspace(start + step, end, 2001), [0])[0]
        pairs = zip(*([pinocchio_pose(ROBOT, each) for each in rows] for rows in (q, later)), strict=True)
        speed = max(float(np.linalg.norm(b[:3, 3] - a[:3, 3])) for a, b in pairs) / step
        assert each.speed <= speed * 1.0001
        assert each.speed == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize("seed", range(3))
def test_joint_points_follow_a_curve_that_urscript_does_not_have(seed: int) -> None:
    random = np.random.default_rng(seed)
    first, second, third = HOME + random.uniform(-0.4, 0.4, (3, 6))
    passed = [joints(position, transition=ThroughTransition()) for position in (first, second)]
    waypoints = [joints(HOME), *passed, joints(third)]
    solved = plan(PlanningProblem(ROBOT, waypoints), Ruckig())
    program = render(solved, "urscript_moves", ExportOptions()).decode()
    _, found = read(program)
    assert "# Joint points stand for curves that URScript does not have." in program
    dense = solved.trajectory(np.linspace(0.0, solved.trajectory.duration, 20001))
    points = np.array([each.values[0] for each in found])
    for point in points:
        assert np.abs(dense - point).max(axis=1).min() < 4e-4
    assert np.abs(np.diff(points, axis=0)).max() < 0.2
    for waypoint in waypoints[1:]:
        assert np.abs(points - waypoint.position).max(axis=1).min() < 1e-5
    assert found[-1].radius == 0.0
    places = [pinocchio_pose(ROBOT, position)[:3, 3] for position in (HOME, *points)]
    gaps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    radii = np.array([0.0, *(each.radius for each in found)])
    assert radii[1:-1].min() > 0.0
    assert (radii[:-1] + radii[1:] < gaps).all()


def test_a_path_of_the_back_ends_own_becomes_joint_points() -> None:
    problem = PlanningProblem(ROBOT, [joints(HOME), joints(HOME + 0.3, duration=2.0)])
    _, found = read(render(plan(problem, MinEffort(iterations=0)), "urscript_moves").decode())
    assert len(found) > 1
    np.testing.assert_allclose(found[-1].values[0], HOME + 0.3, atol=1e-9)


def test_a_polyline_is_a_line_for_each_corner() -> None:
    corners = [moved(0.0, 0.1, 0.0), Pose(moved(0.0, 0.1, 0.1).position)]
    motion = PolylineMotion(poses=corners, blend=0.01)
    waypoints: list[AnyWaypoint] = [joints(HOME + 0.1), PoseWaypoint(moved(0.0, 0.0, 0.1), motion=motion)]
    _, found = read(render(plan(PlanningProblem(ROBOT, waypoints), Cubic()), "urscript_moves").decode())
    assert [each.kind for each in found] == ["line"] * 3
    assert [each.radius for each in found] == [0.01, 0.01, 0.0]
    for each, pose in zip(found, [*corners, moved(0.0, 0.0, 0.1)], strict=True):
        expected = np.eye(4)
        expected[:3] = np.column_stack([pinocchio_pose(ROBOT, HOME + 0.1)[:3, :3], pose.position])
        np.testing.assert_allclose(each.values[0], BASE_OF_CONTROLLER @ expected, atol=1e-9)


def test_a_tool_is_set_before_the_line_that_it_makes() -> None:
    tool = Pose([0.02, -0.01, 0.15], Rotation.from_euler("xyz", [0.3, -0.4, 0.5]).as_matrix())
    start = pinocchio_pose(ROBOT, HOME + 0.1) @ pin.SE3(tool.rotation, tool.position).homogeneous
    target = Pose(start[:3, 3] + [0.0, 0.1, 0.05], start[:3, :3])
    waypoints: list[AnyWaypoint] = [joints(HOME + 0.1), PoseWaypoint(target, motion=LinearMotion(), tool=tool)]
    solved = plan(PlanningProblem(ROBOT, waypoints), Cubic())
    (line,) = read(render(solved, "urscript_moves").decode())[1]
    assert line.tool is not None
    flange = BASE_OF_CONTROLLER @ pinocchio_pose(ROBOT, solved.path.positions[-1])
    np.testing.assert_allclose(line.values[0], flange @ line.tool, atol=1e-9)


def test_the_base_is_found_with_the_tool_of_the_start() -> None:
    tool = Pose([0.02, -0.01, 0.15], Rotation.from_euler("xyz", [0.3, -0.4, 0.5]).as_matrix())
    end = pinocchio_pose(ROBOT, HOME + 0.1) @ pin.SE3(tool.rotation, tool.position).homogeneous
    line = PoseWaypoint(Pose(end[:3, 3] + [0.0, 0.1, 0.05], end[:3, :3]), motion=LinearMotion())
    solved = plan(PlanningProblem(ROBOT, [joints(HOME + 0.1, tool=tool), line]), Cubic())
    program = render(solved, "urscript_moves").decode()
    assert program.index("set_tcp(") < program.index("get_forward_kin(")
    (pose,) = re.findall(rf"pose_inv\(p\[{ROW}\]\)", program)
    np.testing.assert_allclose(matrix(list(pose)), end, atol=1e-9)


def test_an_arm_of_another_maker_is_refused_by_name() -> None:
    robot = load_robot("kuka_kr16_2")
    start = np.array([0.0, -1.57, 1.57, 0.0, 0.5, 0.0])
    solved = plan(PlanningProblem(robot, [joints(start), joints(start + 0.2)]), Cubic())
    with pytest.raises(
        UnsupportedFormat, match="URScript is the language of Universal Robots; kuka_kr16_2 is an arm of"
    ):
        render(solved, "urscript_moves")
