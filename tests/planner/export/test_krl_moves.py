"""KRL programs for the pendant, read back by a grammar of KUKA's statements and checked with Pinocchio and scipy."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from planner.backends import Cubic, Quintic, Ruckig
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

ROBOT = load_robot("kuka_kr16_2")
EXAMPLES = Path(__file__).parents[3] / "examples"
HOME = np.array([0.0, -1.57, 1.57, 0.0, 0.5, 0.0])
moved = partial(pose_beside, ROBOT, HOME)
FORMS = ("krl_kss5", "krl_kss8")
N = r"(-?\d+\.\d+)"
AXES = r"\{" + ", ".join(f"A{i} {N}" for i in range(1, 7)) + r"\}"
FRAME = r"\{" + ", ".join(f"{axis} {N}" for axis in "XYZABC") + r"\}"
SUBPROGRAM = [
    "DEF axis_speed(velocity :IN, acceleration :IN)", "DECL INT velocity, acceleration, axis", "FOR axis = 1 TO 6",
    "$VEL_AXIS[axis] = velocity", "$ACC_AXIS[axis] = acceleration", "ENDFOR", "END",
]  # fmt: skip


@dataclass
class Statement:
    """A motion of a program, with the settings in force there and the waits and outputs after it."""

    kind: str
    waypoint: int
    numbers: list[list[float]]
    ending: str
    settings: dict[str, float]
    rest: list[object] = field(default_factory=list)
    tool: list[float] | None = None


def read(program: str) -> list[Statement]:
    """Parse a program by the grammar of KRL, or fail at the statement that is none."""
    lines = program.split("\r\n")
    assert lines[0] == "DEF planned_trajectory()" and lines[-1] == ""
    assert lines[-8:-1] == SUBPROGRAM and lines[-9] == "END"
    settings: dict[str, float] = {}
    found: list[Statement] = []
    waypoint, tool = 0, None
    rows = iter(lines[1:-9])
    for line in rows:
        if match := re.fullmatch(r"; waypoint (\d+)", line):
            waypoint = int(match[1])
        elif line.startswith(";"):
            assert not found
        elif line.startswith("IF "):
            assert [next(rows).split(" ;")[0] for _ in range(3)] == ["HALT", "RETURN", "ENDIF"] and not found
        elif line in ("$BASE = $ROBROOT", "$ORI_TYPE = #VAR", "$CIRC_TYPE = #BASE", "PTP_SPLINE"):
            pass
        elif match := re.fullmatch(r"axis_speed\((\d+), (\d+)\)(?: ; percent)?", line):
            settings |= {"velocity": int(match[1]), "acceleration": int(match[2])}
            assert all(1 <= settings[name] <= 100 for name in ("velocity", "acceleration"))
        elif match := re.fullmatch(r"(\$(?:VEL|ACC)\.(?:CP|ORI[12])|\$APO\.C(?:DIS|PTP)) = (\d+(?:\.\d+)?)", line):
            settings[match[1]] = float(match[2])
            assert settings[match[1]] > 0.0
        elif match := re.fullmatch(rf"\$TOOL = {FRAME}", line):
            tool = [float(value) for value in match.groups()]
        elif match := re.fullmatch(rf"S?PTP {AXES}((?: C_PTP| C_DIS| C_SPL)*)", line):
            found.append(Statement("joint", waypoint, [[float(v) for v in match.groups()[:6]]], match[7], {**settings}))
        elif match := re.fullmatch(rf"S?LIN {FRAME}( C_DIS| C_SPL)?", line):
            values = [float(v) for v in match.groups()[:6]]
            found.append(Statement("line", waypoint, [values], match[7] or "", {**settings}, tool=tool))
        elif match := re.fullmatch(rf"S?CIRC {FRAME}, {FRAME}( C_DIS| C_SPL)?", line):
            values = [float(v) for v in match.groups()[:12]]
            found.append(Statement("circle", waypoint, [values[:6], values[6:]], match[13] or "", {**settings}))
        elif match := re.fullmatch(r"ENDSPLINE( C_SPL)?", line):
            found[-1].ending = match[1] or ""
        elif match := re.fullmatch(rf"WAIT SEC {N}", line):
            found[-1].rest.append(float(match[1]))
        else:
            match = re.fullmatch(r"([A-Za-z]\w{0,23}) = (TRUE|FALSE)", line)
            assert match is not None, line
            found[-1].rest.append((match[1], match[2] == "TRUE"))
    return found


def matrix(values: list[float]) -> np.ndarray:
    """Return the transform of X, Y, Z, mm, and A, B, C, degrees, by scipy."""
    found = np.eye(4)
    found[:3, 3] = np.array(values[:3]) / 1e3
    found[:3, :3] = Rotation.from_euler("ZYX", values[3:], degrees=True).as_matrix()
    return found


@pytest.fixture(scope="module")
def mixed() -> Plan:
    """Plan a motion of every kind that KRL has, with a blend, waits and an output."""
    waypoints: list[AnyWaypoint] = [
        joints(HOME, dwell=0.3),
        joints(HOME + 0.1),
        PoseWaypoint(moved(0.0, 0.1, 0.0), motion=LinearMotion(), transition=BlendTransition(0.02)),
        PoseWaypoint(moved(0.0, 0.1, 0.1), motion=LinearMotion(), dwell=0.5),
        PoseWaypoint(
            moved(0.0, -0.1, 0.1),
            motion=CircularMotion(via=Pose(moved(0.0, 0.0, 0.2).position)),
        ),
        joints(HOME, transition=BlendTransition(0.05)),
        joints(HOME - [0.3, 0.1, 0.1, 0.0, 0.2, 0.1]),
    ]
    return plan(PlanningProblem(ROBOT, waypoints, actions=[SetOutput(AtWaypoint(3), "gripper", True)]), Quintic())


@pytest.mark.parametrize("form", FORMS)
def test_each_waypoint_is_one_instruction_at_its_pose(mixed: Plan, form: str) -> None:
    found = read(render(mixed, form, ExportOptions()).decode())
    assert [each.kind for each in found] == ["joint", "joint", "line", "line", "circle", "joint", "joint"]
    assert [each.waypoint for each in found] == list(range(7))
    for each, position in zip(found, mixed.path.positions, strict=True):
        reached = pinocchio_pose(ROBOT, position)
        if each.kind == "joint":
            np.testing.assert_allclose(pinocchio_pose(ROBOT, np.radians(each.numbers[0])), reached, atol=1e-5)
        else:
            np.testing.assert_allclose(matrix(each.numbers[-1]), reached, atol=1e-5)
    np.testing.assert_allclose(matrix(found[4].numbers[0])[:3, 3], moved(0.0, 0.0, 0.2).position, atol=1e-6)


@pytest.mark.parametrize(("form", "endings"), [("krl_kss5", (" C_DIS", " C_PTP")), ("krl_kss8", (" C_SPL",) * 2)])
def test_blends_and_rests_stand_at_their_waypoints(mixed: Plan, form: str, endings: tuple[str, str]) -> None:
    found = read(render(mixed, form, ExportOptions()).decode())
    assert [each.ending for each in found] == ["", "", endings[0], "", "", endings[1], ""]
    assert found[2].settings["$APO.CDIS"] == 20.0
    assert [each.rest for each in found if each.rest] == [[0.3], [0.0, ("gripper", True), pytest.approx(0.504)]]


@pytest.mark.parametrize("form", FORMS)
def test_speeds_are_within_those_of_the_certified_segments(mixed: Plan, form: str) -> None:
    step = 1e-6
    for segment, each in enumerate(read(render(mixed, form, ExportOptions()).decode())[1:]):
        start, end = mixed.trajectory.departures[segment], mixed.trajectory.arrivals[segment + 1]
        times = np.linspace(start, end - step, 2001)
        q, v, a = mixed.trajectory.evaluate(times, [0, 1, 2])
        if each.kind == "joint":
            for name, values in (("velocity", v), ("acceleration", a)):
                most = 100.0 * (np.abs(values) / ROBOT.limit(name)).max()
                assert most - 1.5 < each.settings[name] <= most + 1e-6
            continue
        later = mixed.trajectory.evaluate(times + step, [0])[0]
        poses, next_poses = ([pinocchio_pose(ROBOT, row) for row in rows] for rows in (q, later))
        pairs = list(zip(poses, next_poses, strict=True))
        speed = max(float(np.linalg.norm(b[:3, 3] - a[:3, 3])) for a, b in pairs) / step
        assert each.settings["$VEL.CP"] <= speed * 1.0001
        assert each.settings["$VEL.CP"] == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("form", FORMS)
def test_joint_points_follow_a_curve_that_krl_does_not_have(form: str, seed: int) -> None:
    first, second, third = HOME + np.random.default_rng(seed).uniform(-0.4, 0.4, (3, 6))
    passed = [joints(position, transition=ThroughTransition()) for position in (first, second)]
    waypoints = [joints(HOME), *passed, joints(third)]
    solved = plan(PlanningProblem(ROBOT, waypoints), Ruckig())
    program = render(solved, form, ExportOptions()).decode()
    found = read(program)
    assert "; joint points stand for curves that KRL does not have" in program
    assert ("PTP_SPLINE" in program) == (form == "krl_kss8")
    dense = np.degrees(solved.trajectory(np.linspace(0.0, solved.trajectory.duration, 20001)))
    points = np.array([each.numbers[0] for each in found])
    for point in points:
        assert np.abs(dense - point).max(axis=1).min() < 0.02
    travel = np.degrees(0.1) * 2.0
    assert np.abs(np.diff(points, axis=0)).max() < travel
    for waypoint in waypoints:
        assert np.abs(points - np.degrees(waypoint.position)).max(axis=1).min() < 1e-3


@pytest.mark.parametrize("form", FORMS)
def test_a_polyline_is_a_line_for_each_corner(form: str) -> None:
    corners = [moved(0.0, 0.1, 0.0), Pose(moved(0.0, 0.1, 0.1).position)]
    motion = PolylineMotion(poses=corners, blend=0.01)
    waypoints: list[AnyWaypoint] = [joints(HOME + 0.1), PoseWaypoint(moved(0.0, 0.0, 0.1), motion=motion)]
    found = read(render(plan(PlanningProblem(ROBOT, waypoints), Cubic()), form, ExportOptions()).decode())[1:]
    assert [each.kind for each in found] == ["line"] * 3
    assert [bool(each.ending) for each in found] == [True, True, False]
    for each, pose in zip(found, [*corners, moved(0.0, 0.0, 0.1)], strict=True):
        np.testing.assert_allclose(matrix(each.numbers[0])[:3, 3], pose.position, atol=1e-6)
        np.testing.assert_allclose(
            matrix(each.numbers[0])[:3, :3], pinocchio_pose(ROBOT, HOME + 0.1)[:3, :3], atol=1e-5
        )
        assert each.settings["$APO.CDIS"] == 10.0


@pytest.mark.parametrize("form", FORMS)
def test_a_tool_is_set_before_the_line_that_it_makes(form: str) -> None:
    tool = Pose([0.02, -0.01, 0.15], Rotation.from_euler("xyz", [0.3, -0.4, 0.5]).as_matrix())
    start = pinocchio_pose(ROBOT, HOME + 0.1) @ pin.SE3(tool.rotation, tool.position).homogeneous
    target = Pose(start[:3, 3] + [0.0, 0.1, 0.05], start[:3, :3])
    waypoints: list[AnyWaypoint] = [joints(HOME + 0.1), PoseWaypoint(pose=target, motion=LinearMotion(), tool=tool)]
    solved = plan(PlanningProblem(ROBOT, waypoints), Cubic())
    (line,) = [each for each in read(render(solved, form, ExportOptions()).decode()) if each.kind == "line"]
    assert line.tool is not None
    np.testing.assert_allclose(matrix(line.numbers[0])[:3, 3], target.position, atol=1e-5)
    flange = pinocchio_pose(ROBOT, solved.path.positions[-1])
    np.testing.assert_allclose(matrix(line.numbers[0]), flange @ matrix(line.tool), atol=1e-5)


def test_an_arm_of_another_maker_is_refused_by_name() -> None:
    robot = load_robot("ur5e")
    start = np.array([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
    solved = plan(PlanningProblem(robot, [joints(start), joints(start + 0.2)]), Cubic())
    for form in FORMS:
        with pytest.raises(UnsupportedFormat, match="KRL is the language of KUKA; ur5e is an arm of Universal Robots"):
            render(solved, form, ExportOptions())


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("case", [1, 2])
def test_a_case_of_the_refuelling_document_is_one_motion_a_point(case: int, form: str) -> None:
    request = json.loads((EXAMPLES / f"refuelling_case_{case}.json").read_text())
    rows = [(np.array(row["position"]), row.get("duration")) for row in request["waypoints"]]
    waypoints = [joints(position, duration=duration) for position, duration in rows]
    solved = plan(PlanningProblem(load_robot(request["robot"]), waypoints), Cubic())
    found = read(render(solved, form, ExportOptions()).decode())
    assert {each.kind for each in found} == {"joint"}
    np.testing.assert_allclose([each.numbers[0] for each in found], [np.degrees(row) for row, _ in rows], atol=1e-4)
    for each, waypoint, reached in zip(found[1:], waypoints[1:], range(1, len(rows)), strict=True):
        assert waypoint.duration is not None
        travel = np.abs(rows[reached][0] - rows[reached - 1][0]) / solved.path.robot.limit("velocity")
        assert each.settings["velocity"] <= max(1.0, 100.0 * 1.5 * travel.max() / waypoint.duration)  # a cubic's peak
