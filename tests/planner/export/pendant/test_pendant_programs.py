"""Programs for the pendant in every language, read back and checked with Pinocchio and dense samples."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from rapidchecker.check import check_format
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
from planner.robots import Robot, load_robot
from planner.spatial import Pose
from tests.planner.export.pendant import krl, rapid, urscript
from tests.planner.export.pendant.program import Program
from tests.planner.export.pendant.waypoints import joints, pinocchio_pose, pose_beside

EXAMPLES = Path(__file__).parents[4] / "examples"
EXACT = 1e-5
"""Largest error of a pose: KRL has 0.1 um and 1e-4 degrees."""


@dataclass(frozen=True)
class Language:
    """A format, what reads it, an arm that it moves and an arm of another maker.

    Attributes:
        read: What reads a program back.
        robot: The name of an arm.
        home: A joint position of it, rad.
        output: The name of an output.
        cycle: Waits are multiples of it, s.
        refusal: How the refusal of `other` begins.
    """

    read: Callable[[str], Program]
    robot: str
    home: tuple[float, ...]
    output: str
    cycle: float
    other: str
    refusal: str


AT_KUKA = (0.0, -1.57, 1.57, 0.0, 0.5, 0.0)
KRL = partial(
    Language, krl.read, "kuka_kr16_2", AT_KUKA, "gripper", 0.012, "ur5e",
    "KRL is the language of KUKA; ur5e is an arm of Universal Robots",
)  # fmt: skip
LANGUAGES = {
    "krl_kss5": KRL(),
    "krl_kss8": KRL(),
    "urscript_moves": Language(
        urscript.read, "ur5e", (0.0, -1.5, 1.7, -1.2, -1.4, 0.0), "standard_digital_out_3", 0.0, "kuka_kr16_2",
        "URScript is the language of Universal Robots; kuka_kr16_2 is an arm of KUKA",
    ),
    "rapid_moves": Language(
        rapid.read, "welding_arm", (1.6, 1.6, -0.5, 0.2, 1.8, 1.6), "doGripper", 0.0, "kuka_kr16_2",
        "RAPID is the language of ABB; kuka_kr16_2 is an arm of KUKA",
    ),
}  # fmt: skip
every_language = pytest.mark.parametrize("form", LANGUAGES)


def arm(form: str) -> tuple[Robot, np.ndarray, Callable[..., Pose]]:
    """Return an arm, its home position and a function of poses beside it."""
    robot, home = load_robot(LANGUAGES[form].robot), np.array(LANGUAGES[form].home)
    return robot, home, partial(pose_beside, robot, home)


def program_of(solved: Plan, form: str) -> Program:
    return LANGUAGES[form].read(render(solved, form).decode())


@cache
def mixed(form: str) -> Plan:
    """Plan a motion of every kind that the languages have, with blends, waits and an output."""
    robot, home, moved = arm(form)
    waypoints: list[AnyWaypoint] = [
        joints(home, dwell=0.3),
        joints(home + 0.1),
        PoseWaypoint(moved(0.0, 0.1, 0.0), motion=LinearMotion(), transition=BlendTransition(0.02)),
        PoseWaypoint(moved(0.0, 0.1, 0.1), motion=LinearMotion(), dwell=0.5),
        PoseWaypoint(moved(0.0, -0.1, 0.1), motion=CircularMotion(via=Pose(moved(0.0, 0.0, 0.2).position))),
        joints(home, transition=BlendTransition(0.05)),
        joints(home - [0.3, 0.1, 0.1, 0.0, 0.2, 0.1]),
    ]
    actions = [SetOutput(AtWaypoint(3), LANGUAGES[form].output, True)]
    return plan(PlanningProblem(robot, waypoints, actions=actions), Quintic())


@every_language
def test_each_waypoint_is_one_instruction_at_its_pose(form: str) -> None:
    solved, found = mixed(form), program_of(mixed(form), form)
    robot, _, moved = arm(form)
    np.testing.assert_allclose(found.start, solved.path.positions[0], atol=EXACT)
    assert [each.kind for each in found.statements] == ["joint", "line", "line", "circle", "joint", "joint"]
    assert [each.waypoint for each in found.statements] == list(range(1, 7))
    for each, position in zip(found.statements, solved.path.positions[1:], strict=True):
        expected = position if each.kind == "joint" else pinocchio_pose(robot, position)
        np.testing.assert_allclose(each.values[-1], expected, atol=EXACT)
    via = found.statements[3].values[0][:3, 3]
    np.testing.assert_allclose(via, moved(0.0, 0.0, 0.2).position, atol=1e-6)


@pytest.mark.large_only
def test_a_module_has_the_grammar_of_abb() -> None:
    assert check_format(render(mixed("rapid_moves"), "rapid_moves").decode()) == []
    assert check_format("MODULE Wrong\r\n  PROC move()\r\n    MoveAbsJ start,;\r\n  ENDPROC\r\nENDMODULE\r\n")


@pytest.mark.long_table
@pytest.mark.parametrize("repeat", [0, 3])
@pytest.mark.parametrize("form", ["rapid", "rapid_moves"])
def test_a_loop_has_the_grammar_of_abb(form: str, repeat: int) -> None:
    robot, home, _ = arm("rapid_moves")
    closed = plan(PlanningProblem(robot, [joints(home, dwell=0.2), joints(home + 0.1), joints(home)]), Cubic())
    assert check_format(render(closed, form, ExportOptions(0.1, repeat=repeat)).decode()) == []


@every_language
def test_a_program_that_changes_the_tool_is_not_repeated(form: str) -> None:
    robot, home, _ = arm(form)
    longer = Pose([0.0, 0.0, 0.2], np.eye(3))
    solved = plan(PlanningProblem(robot, [joints(home), joints(home + 0.1, tool=longer), joints(home)]), Cubic())
    with pytest.raises(UnsupportedFormat, match="end with the tool of their start"):
        render(solved, form, ExportOptions(repeat=2))


@every_language
def test_blends_and_rests_stand_at_their_waypoints(form: str) -> None:
    found = program_of(mixed(form), form)
    assert [each.is_passed for each in found.statements] == [False, True, False, False, True, False]
    assert [each.blend for each in found.statements if not each.is_passed] == [0.0] * 4
    assert [found.statements[i].blend for i in (1, 4)] in ([0.02, 0.05], [0.02, None])
    assert [each.rest for each in found.statements if each.rest] == [found.statements[2].rest]
    waits = [step for step in (*found.before, *found.statements[2].rest) if isinstance(step, float) and step > 0.0]
    for wait, planned in zip(waits, (0.3, 0.5), strict=True):
        assert planned - 1e-6 <= wait <= planned + LANGUAGES[form].cycle + 1e-6
    outputs = [step for step in found.statements[2].rest if not isinstance(step, float)]
    assert outputs == [(LANGUAGES[form].output, True)]


@pytest.mark.long_table
@every_language
def test_speeds_are_within_those_of_the_certified_segments(form: str) -> None:
    solved, robot, step = mixed(form), arm(form)[0], 1e-6
    for segment, each in enumerate(program_of(solved, form).statements):
        start, end = solved.trajectory.departures[segment], solved.trajectory.arrivals[segment + 1]
        times = np.linspace(start, end - step, 601)
        q, v, a = solved.trajectory.evaluate(times, [0, 1, 2])
        later = solved.trajectory.evaluate(times + step, [0])[0]
        pairs = zip(*([pinocchio_pose(robot, row) for row in rows] for rows in (q, later)), strict=True)
        moves = [(after[:3, 3] - before[:3, 3], pin.log3(before[:3, :3].T @ after[:3, :3])) for before, after in pairs]
        expected = {
            "joint": (np.abs(v) / robot.limit("velocity")).max(),
            "joint_acceleration": (np.abs(a) / robot.limit("acceleration")).max(),
            "leading": np.abs(v).max(),
            "leading_acceleration": np.abs(a).max(),
            "linear": max(float(np.linalg.norm(move)) for move, _ in moves) / step,
            "angular": max(float(np.linalg.norm(turn)) for _, turn in moves) / step,
        }
        assert each.speeds
        for name, (value, resolution) in each.speeds.items():
            if name in expected:
                assert value <= max(expected[name] * 1.0001, resolution) + 1e-9, name
                assert value >= expected[name] * 0.998 - resolution, name


@pytest.mark.long_table
@every_language
@pytest.mark.parametrize("seed", range(3))
def test_joint_points_follow_a_curve_that_no_language_has(form: str, seed: int) -> None:
    robot, home, _ = arm(form)
    first, second, third = home + np.random.default_rng(seed).uniform(-0.4, 0.4, (3, 6))
    passed = [joints(position, transition=ThroughTransition()) for position in (first, second)]
    waypoints = [joints(home), *passed, joints(third)]
    solved = plan(PlanningProblem(robot, waypoints), Ruckig())
    text = render(solved, form).decode()
    assert "oint points stand for curves" in text
    assert ("PTP_SPLINE" in text) == (form == "krl_kss8")
    found = LANGUAGES[form].read(text)
    dense = solved.trajectory(np.linspace(0.0, solved.trajectory.duration, 20001))
    points = np.array([found.start, *(each.values[0] for each in found.statements)])
    for point in points:
        assert np.abs(dense - point).max(axis=1).min() < 4e-4
    assert np.abs(np.diff(points, axis=0)).max() < 0.2
    for waypoint in waypoints:
        assert np.abs(points - waypoint.position).max(axis=1).min() < EXACT
    assert [each.is_passed for each in found.statements][-1] is False
    if form == "urscript_moves":  # a controller refuses blends that overlap
        places = [pinocchio_pose(robot, position)[:3, 3] for position in points]
        radii = np.array([0.0, *(each.blend for each in found.statements)])
        assert radii[1:-1].min() > 0.0
        assert (radii[:-1] + radii[1:] < np.linalg.norm(np.diff(places, axis=0), axis=1)).all()


@every_language
def test_a_path_of_the_back_ends_own_becomes_joint_points(form: str) -> None:
    robot, home, _ = arm(form)
    problem = PlanningProblem(robot, [joints(home), joints(home + 0.3, duration=2.0)])
    found = program_of(plan(problem, MinEffort(objective="jerk", iterations=0)), form).statements
    assert len(found) > 1
    np.testing.assert_allclose(found[-1].values[0], home + 0.3, atol=EXACT)


@every_language
def test_a_polyline_is_a_line_for_each_corner(form: str) -> None:
    robot, home, moved = arm(form)
    corners = [moved(0.0, 0.1, 0.0), Pose(moved(0.0, 0.1, 0.1).position)]
    motion = PolylineMotion(poses=corners, blend=0.01)
    waypoints: list[AnyWaypoint] = [joints(home + 0.1), PoseWaypoint(moved(0.0, 0.0, 0.1), motion=motion)]
    found = program_of(plan(PlanningProblem(robot, waypoints), Cubic()), form).statements
    assert [each.kind for each in found] == ["line"] * 3
    assert [each.is_passed for each in found] == [True, True, False]
    assert [each.blend for each in found] == [0.01, 0.01, 0.0]
    rotation = pinocchio_pose(robot, home + 0.1)[:3, :3]
    for each, pose in zip(found, [*corners, moved(0.0, 0.0, 0.1)], strict=True):
        np.testing.assert_allclose(each.values[0][:3, 3], pose.position, atol=1e-6)
        np.testing.assert_allclose(each.values[0][:3, :3], rotation, atol=EXACT)


@every_language
def test_a_tool_is_set_before_the_line_that_it_makes(form: str) -> None:
    robot, home, _ = arm(form)
    tool = Pose([0.02, -0.01, 0.15], Rotation.from_euler("xyz", [0.3, -0.4, 0.5]).as_matrix())
    start = pinocchio_pose(robot, home + 0.1) @ pin.SE3(tool.rotation, tool.position).homogeneous
    target = Pose(start[:3, 3] + [0.0, 0.1, 0.05], start[:3, :3])
    waypoints: list[AnyWaypoint] = [joints(home + 0.1), PoseWaypoint(target, motion=LinearMotion(), tool=tool)]
    solved = plan(PlanningProblem(robot, waypoints), Cubic())
    (line,) = program_of(solved, form).statements
    assert line.tool is not None
    np.testing.assert_allclose(line.values[0][:3, 3], target.position, atol=EXACT)
    flange = pinocchio_pose(robot, solved.path.positions[-1])
    np.testing.assert_allclose(line.values[0], flange @ line.tool, atol=EXACT)


@every_language
def test_the_tool_of_the_start_holds_from_the_start(form: str) -> None:
    robot, home, _ = arm(form)
    tool = Pose([0.02, -0.01, 0.15], Rotation.from_euler("xyz", [0.3, -0.4, 0.5]).as_matrix())
    end = pinocchio_pose(robot, home + 0.1) @ pin.SE3(tool.rotation, tool.position).homogeneous
    line = PoseWaypoint(Pose(end[:3, 3] + [0.0, 0.1, 0.05], end[:3, :3]), motion=LinearMotion())
    solved = plan(PlanningProblem(robot, [joints(home + 0.1, tool=tool), line]), Cubic())
    (found,) = program_of(solved, form).statements
    expected = pinocchio_pose(robot, solved.path.positions[-1])
    expected = expected @ pin.SE3(tool.rotation, tool.position).homogeneous
    np.testing.assert_allclose(found.values[0], expected, atol=EXACT)


@every_language
def test_an_arm_of_another_maker_is_refused_by_name(form: str) -> None:
    start = np.array([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
    other = load_robot(LANGUAGES[form].other)
    derived = replace(other, source=f"derived from mine: derived from {other.id}: {other.source}")  # as HTTP names it
    for robot in (other, derived):
        problem = PlanningProblem(robot, [joints(start), joints(start + 0.2)])
        with pytest.raises(UnsupportedFormat, match=LANGUAGES[form].refusal):
            render(plan(problem, Cubic()), form)


@pytest.mark.parametrize("form", ["krl_kss5", "krl_kss8", "rapid_moves"])
@pytest.mark.parametrize("case", [1, 2])
def test_a_case_of_the_refuelling_document_is_one_motion_a_point(case: int, form: str) -> None:
    request = json.loads((EXAMPLES / f"refuelling_case_{case}.json").read_text())
    rows = [(np.array(row["position"]), row.get("duration")) for row in request["waypoints"]]
    waypoints = [joints(position, duration=duration) for position, duration in rows]
    solved = plan(PlanningProblem(load_robot(request["robot"]), waypoints), Cubic())
    found = program_of(solved, form)
    assert {each.kind for each in found.statements} == {"joint"}
    points = [found.start, *(each.values[0] for each in found.statements)]
    np.testing.assert_allclose(points, [position for position, _ in rows], atol=EXACT)
    for reached, each in enumerate(found.statements, 1):
        if "joint" not in each.speeds:
            continue
        travel = np.abs(rows[reached][0] - rows[reached - 1][0]) / solved.path.robot.limit("velocity")
        assert each.speeds["joint"][0] <= max(0.01, 1.5 * travel.max() / rows[reached][1])  # a cubic's peak
