"""Programs of robots, each read back by a grammar of the allowed statements."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin
import pytest

from planner.backends import Cubic, Quintic, Ruckig
from planner.errors import UnsupportedFormat
from planner.export import ExportOptions, render
from planner.export.urscript import set_output
from planner.kinematics import tool_pose
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.actions import AtTime, SetOutput
from planner.problems.moves import CartesianMove
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, RelativeWaypoint
from planner.problems.transitions import ThroughTransition
from planner.robots import ExternalAxis, load_robot
from planner.scene import ConstantVelocity, Scene, SceneObject
from planner.shapes import Box
from planner.spatial import Pose
from tests.planner.problems_of_tests import problem_of

FOR_PENDANTS = ("krl_kss5", "krl_kss8", "urscript_moves", "rapid_moves")
NUMBER = r"-?\d+(?:\.\d+)?"
PERIOD = 0.05
ROBOT = replace(load_robot("kuka_kr16_l6_2"), source="")  # an arm of no known maker
START = np.array([0.0, -1.57, 1.57, 0.0, 0.5, 0.0])
THIRD = START + np.array([0.3, 0.4, 0.1, -0.2, 0.3, 0.4])
WAYPOINTS = [
    JointWaypoint(START, dwell=0.3),
    JointWaypoint(START + 0.2, transition=ThroughTransition()),
    JointWaypoint(THIRD, dwell=0.4567),
    JointWaypoint(THIRD),  # rests
    JointWaypoint(START - 0.1),
]


@pytest.fixture(scope="module")
def solved() -> Plan:
    return plan(PlanningProblem(ROBOT, WAYPOINTS), Quintic())


@pytest.fixture(scope="module")
def solved_moves() -> Plan:
    """Plan a motion that every format can carry."""
    return plan(PlanningProblem(ROBOT, [JointWaypoint(START), JointWaypoint(THIRD)]), Cubic())


@dataclass
class Read:
    """The motion of a program: the positions that it passes (degrees), their times, and its stops."""

    times: list[float] = field(default_factory=lambda: [0.0])
    positions: list[list[float]] = field(default_factory=list)
    stops: list[int] = field(default_factory=list)
    rest: float = 0.0

    def go(self, seconds: float, position: list[float]) -> None:
        self.times.append(self.times[-1] + self.rest + seconds)
        self.positions.append(position)
        self.rest = 0.0


LOOPS = {
    "krl": ([r"DECL INT cycle"], "FOR cycle = 1 TO N", "ENDFOR", "LOOP", "ENDLOOP"),
    "rapid": ([], "FOR cycle FROM 1 TO N DO", "ENDFOR", "WHILE TRUE DO", "ENDWHILE"),
    "urscript": (["cycle = 0", "cycle = cycle + 1"], "while cycle < N:", "end", "while True:", "end"),
    "fanuc_ls": ([], "FOR R[1]=1 TO N ;", "ENDFOR ;", "LBL[1] ;", "JMP LBL[1] ;"),
}
"""By language, the further lines of a counted loop, and the lines around a counted and an endless one."""
FORMS = {"krl": "krl", "krl_kss5": "krl", "krl_kss8": "krl", "rapid": "rapid", "rapid_moves": "rapid"}
FORMS |= {"urscript": "urscript", "urscript_moves": "urscript", "fanuc_ls": "fanuc_ls"}
FIRST_IN_LOOP = {
    "krl": "PTP_SPLINE",
    "krl_kss5": "axis_speed(",
    "krl_kss8": "axis_speed(",
    "rapid": "MoveAbsJ",
    "rapid_moves": "AccSet",
    "urscript": "servoj(",
    "urscript_moves": "# waypoint 1",
    "fanuc_ls": "J P[2]",
}
"""How the first line of the trajectory begins, after the approach to its start."""


@pytest.mark.parametrize("count", [1, 2, 5000, 0])
@pytest.mark.parametrize("form", FORMS)
def test_a_program_repeats_the_trajectory_alone(form: str, count: int) -> None:
    corners = [JointWaypoint(START), JointWaypoint(THIRD), JointWaypoint(START)]
    closed = plan(PlanningProblem(ROBOT, corners), Cubic())

    def lines(repeat: int) -> list[str]:
        text = render(closed, form, ExportOptions(PERIOD, repeat=repeat)).decode()
        return [re.sub(r"^ *\d+:", "", line).strip() for line in text.splitlines() if line.strip()]

    once, several = lines(1), lines(count)
    if count == 1:
        assert several == once
        return
    further, opened, ended, endless, ended_endless = LOOPS[FORMS[form]]
    before, after = (opened.replace("N", str(count)), ended) if count else (endless, ended_endless)
    begin = several.index(before)
    end = several.index(after, begin)  # the trajectory has no blocks of its own that end so
    assert several[begin + 1].startswith(FIRST_IN_LOOP[form])
    rest = [*several[:begin], *several[begin + 1 : end], *several[end + 1 :]]
    assert [line for line in rest if line not in (further if count else [])] == once
    assert len(rest) == len(once) + (len(further) if count else 0)
    moving = r"PTP_SPLINE|S?PTP|movej|servoj|J P\[|MoveAbsJ"
    assert len([line for line in several[:begin] if re.match(moving, line)]) == 1  # to the start
    assert not [line for line in several[end + 1 :] if re.match(moving, line)]


@pytest.mark.parametrize("form", FORMS)
def test_a_program_repeats_only_a_closed_trajectory(form: str, solved_moves: Plan) -> None:
    with pytest.raises(UnsupportedFormat, match="repeats trajectories that end with the joint position of their start"):
        render(solved_moves, form, ExportOptions(PERIOD, repeat=2))


@pytest.fixture(scope="module")
def beside_a_belt() -> Plan:
    """Plan a motion and its way back in a scene with a moving object."""
    far, belt = Pose([9.0, 0.0, 0.0]), ConstantVelocity([0.0, 0.1, 0.0])
    scene = Scene([SceneObject("part", [Box([0.1] * 3)], far, motion=belt)])
    corners = [JointWaypoint(position) for position in (START, THIRD, START)]
    return plan(PlanningProblem(ROBOT, corners, scene=scene), Cubic())


@pytest.mark.parametrize("form", [form for form in FORMS if form not in FOR_PENDANTS])
def test_a_program_repeats_no_trajectory_beside_moving_objects(form: str, beside_a_belt: Plan) -> None:
    """The clearance is proved for the first run alone."""
    assert render(beside_a_belt, form, ExportOptions(PERIOD))
    with pytest.raises(UnsupportedFormat, match="'part' is elsewhere when the next run begins"):
        render(beside_a_belt, form, ExportOptions(PERIOD, repeat=2))


@pytest.mark.parametrize("form", FOR_PENDANTS)
def test_instructions_refuse_plans_beside_moving_objects(form: str, beside_a_belt: Plan) -> None:
    """The clearance is proved for the certified times alone, which the controller does not keep."""
    with pytest.raises(UnsupportedFormat, match="does not know where 'part' is"):
        render(beside_a_belt, form, ExportOptions(PERIOD))


def angles(text: str) -> list[float]:
    return [float(found) for found in re.findall(rf"(?:[AJ]\d\s*=?\s*|(?<=[\[,])\s*)({NUMBER})", text)]


def read_krl(program: str) -> Read:
    read, lines = Read(), [line for line in program.splitlines() if not line.startswith(";")]
    position = r"\{A1 N, A2 N, A3 N, A4 N, A5 N, A6 N\}".replace("N", NUMBER)
    assert lines[0] == "DEF planned_trajectory()" and lines[-1] == "END"
    condition = " OR ".join(rf"\(ABS\(\$AXIS_ACT\.A{i} - \({NUMBER}\)\) > 0\.573\)" for i in range(1, 7))
    assert re.fullmatch(f"IF {condition} THEN", lines[1])
    assert [line.partition(" ;")[0] for line in lines[2:5]] == ["HALT", "RETURN", "ENDIF"]
    assert re.fullmatch(f"PTP {position}", lines[5])
    read.positions.append(angles(lines[5]))
    block: list[tuple[list[float], float]] | None = None
    rows = iter(lines[6:-1])
    for line in rows:
        if line == "PTP_SPLINE":
            assert block is None and next(rows) == "TIME_BLOCK START"
            block = []
        elif re.fullmatch(f"SPTP {position}", line):
            part = re.fullmatch(rf"TIME_BLOCK PART = ({NUMBER})", next(rows))
            assert block is not None and part is not None
            block.append((angles(line), float(part[1])))
        elif found := re.fullmatch(rf"TIME_BLOCK END = ({NUMBER})", line):
            assert block and next(rows) == "ENDSPLINE"
            assert sum(share for _, share in block) == pytest.approx(100.0)
            for row, share in block:
                read.go(float(found[1]) * share / 100.0, row)
            read.stops.append(len(read.positions) - 1)
            block = None
        else:
            found = re.fullmatch(rf"WAIT SEC ({NUMBER})", line)
            assert found is not None and block is None, line
            read.rest += float(found[1])
    return read


def read_rapid(program: str) -> Read:
    read, lines = Read(), [line.strip() for line in program.splitlines() if not line.strip().startswith("!")]
    condition = " OR ".join(rf"Abs\(actual\.robax\.rax_{i}-\(({NUMBER})\)\)>0\.573" for i in range(1, 7))
    head = ["MODULE PlannedTrajectory", r"PROC planned_trajectory\(\)", "VAR jointtarget actual;"]
    head += [r"actual:=CJointT\(\);", f"IF {condition} THEN", 'TPWrite "[^"]{1,80}";', "EXIT;", "ENDIF"]
    matches = [re.fullmatch(pattern, line) for pattern, line in zip(head, lines, strict=False)]
    assert all(matches) and matches[4] is not None
    read.positions.append([float(value) for value in matches[4].groups()])
    assert lines[-2:] == ["ENDPROC", "ENDMODULE"]
    row = ",".join([NUMBER] * 6)
    approach = rf"MoveAbsJ \[\[({row})\],\[(?:9E9,){{5}}9E9\]\],v1000\\T:=1\.0+,fine,tool0;"
    first = re.fullmatch(approach, lines[len(head)])
    assert first is not None and [float(value) for value in first[1].split(",")] == read.positions[0]
    for line in lines[len(head) + 1 : -2]:
        if found := re.fullmatch(rf"WaitTime ({NUMBER});", line):
            read.rest += float(found[1])
            continue
        found = re.fullmatch(
            rf"MoveAbsJ \[\[({row})\],\[(?:9E9,){{5}}9E9\]\],v1000\\T:=({NUMBER}),(fine|z0),tool0;", line
        )
        assert found is not None, line
        read.go(float(found[2]), [float(value) for value in found[1].split(",")])
        if found[3] == "fine":
            read.stops.append(len(read.positions) - 1)
    return read


def read_fanuc(program: str) -> Read:
    """Read a Fanuc program; its J3 counts from the horizontal, so the third joint is J3 plus J2."""
    read = Read()
    head, _, rest = program.partition("/MN\r\n")
    statements, _, points = rest.partition("/POS\r\n")
    assert head.splitlines()[:2] == ["/PROG  PLANNED", "/ATTR"] and points.endswith("/END\r\n")
    pattern = r"P\[(\d+)\]\{\r\n   GP1:\r\n\tUF : 0, UT : 1,\r\n((?:\tJ\d = N deg,?\r\n){6})\};\r\n".replace(
        "N", NUMBER
    )
    assert re.sub(pattern, "", points) == "/END\r\n"
    taught = [[float(v) for v in re.findall(rf"= ({NUMBER}) deg", block)] for _, block in re.findall(pattern, points)]
    assert [int(number) for number, _ in re.findall(pattern, points)] == list(range(1, len(taught) + 1))
    for number, line in enumerate(statements.splitlines(), 1):
        found = re.fullmatch(r" *(\d+):  (.*) ;", line)
        assert found is not None and int(found[1]) == number
        statement = found[2]
        if found := re.fullmatch(r"J P\[(\d+)\] (?:(\d+)msec|5%) (CNT100|FINE)", statement):
            position = taught[int(found[1]) - 1]
            position[2] += position[1]
            if found[2] is None:
                read.positions.append(position)
                continue
            assert int(found[2]) >= 1
            read.go(int(found[2]) / 1000.0, position)
            if found[3] == "FINE":
                read.stops.append(len(read.positions) - 1)
        elif found := re.fullmatch(rf"WAIT ({NUMBER})\(sec\)", statement):
            read.rest += float(found[1])
        else:
            assert re.fullmatch(r"!.{1,32}|UFRAME_NUM=0|UTOOL_NUM=1", statement), statement
    return read


@pytest.mark.parametrize(
    ("name", "reader", "precision"),
    [("krl", read_krl, 1e-5), ("rapid", read_rapid, 1e-5), ("fanuc_ls", read_fanuc, 0.005)],
)
def test_a_program_passes_the_positions_at_their_times(
    solved: Plan, name: str, reader: object, precision: float
) -> None:
    """Programs count in degrees, from stop to stop; the times of Fanuc have steps of 1 ms, its dwells of 10 ms."""
    assert callable(reader)
    read = reader(render(solved, name, ExportOptions(PERIOD)).decode())
    trajectory = solved.trajectory
    assert read.times[-1] + read.rest == pytest.approx(trajectory.duration, abs=2.0 * precision)
    times = np.minimum(read.times, trajectory.duration)
    expected, speeds = trajectory.evaluate(times, [0, 1])
    off = np.abs(np.radians(read.positions) - expected).max(axis=1)
    assert (off <= 1e-7 + 2.0 * precision * (1e-9 + np.abs(speeds).max())).all()
    assert len(read.stops) == 2
    assert np.abs(np.radians(np.array(read.positions)[read.stops]) - solved.path.positions[[2, 4]]).max() < 1e-7
    assert np.diff(read.times).max() < PERIOD + 0.4567 + 0.01


@pytest.mark.parametrize("name", ["krl", "rapid", "fanuc_ls", "urscript", "urscript_moves"])
def test_programs_refuse_other_arms_and_motion_at_the_ends(name: str) -> None:
    with pytest.raises(UnsupportedFormat, match="three_dof_arm"):
        render(plan(problem_of("three_dof_arm", 0, 2)), name)
    problem = PlanningProblem(ROBOT, [JointWaypoint(START), JointWaypoint(START + 0.3)])
    moving = plan(problem, Ruckig(initial_velocity=[0.1] * 6))
    with pytest.raises(UnsupportedFormat, match="begins and ends at rest"):
        render(moving, name)
    if name == "urscript":  # which the controller follows by itself, at any period
        return
    with pytest.raises(UnsupportedFormat, match="apart or more"):
        render(plan(problem), name, ExportOptions(0.001))


RAIL = ExternalAxis("rail", "prismatic", (1, 0, 0), lower=0.0, upper=3.0, velocity=1.0)
TABLE = ExternalAxis("table", "revolute", (0, 0, 1), lower=-3.0, upper=3.0, velocity=1.0)
ROWS = {
    "krl": r"\{" + ", ".join(f"{axis} ({NUMBER})" for axis in ("A1", "A2", "A3", "A4", "A5", "A6", "E1", "E2")) + r"\}",
    "rapid": rf"\[\[{','.join([f'({NUMBER})'] * 6)}\],\[({NUMBER}),({NUMBER}),9E9,9E9,9E9,9E9\]\]",
    "fanuc_ls": ",\r\n".join(
        [rf"\tJ{i} = ({NUMBER}) deg" for i in range(1, 7)] + [rf"\tE1 = ({NUMBER}) mm", rf"\tE2 = ({NUMBER}) deg"]
    ),
}
"""Positions of an arm on a rail and a turntable, as each language writes them."""


@pytest.mark.parametrize("name", ["krl", "krl_kss5", "rapid", "rapid_moves", "urscript", "urscript_moves", "fanuc_ls"])
@pytest.mark.parametrize("mark", ["\n", "\r\n", "\x0b", "\x85", "\u2028", '"; ', "\x00"])
def test_what_a_robot_is_called_becomes_no_statement(solved_moves: Plan, name: str, mark: str) -> None:
    robot = replace(ROBOT, id=f"arm{mark}HALT;")
    path = replace(solved_moves.path, robot=robot)
    plain, odd = (
        render(each, name, ExportOptions(PERIOD)).decode().splitlines()
        for each in (solved_moves, replace(solved_moves, path=path))
    )
    assert len(odd) == len(plain)
    (line,) = [line for line, as_plain in zip(odd, plain, strict=True) if line != as_plain]
    assert line.lstrip().startswith((";", "!", "#", 'COMMENT = "arm'))
    assert name != "fanuc_ls" or re.fullmatch('COMMENT = "[^"]{1,16}";', line)


def test_digits_of_outputs_are_those_that_controllers_read() -> None:
    output = SetOutput(AtTime(0.0), "standard_digital_out_\N{ARABIC-INDIC DIGIT THREE}", True)
    with pytest.raises(UnsupportedFormat, match="no output called"):
        set_output(output)


@pytest.mark.parametrize("name", ROWS)
def test_external_axes_come_behind_the_arm_in_degrees_and_millimetres(name: str) -> None:
    robot = ROBOT.derived(external_axes=[RAIL, TABLE])
    end = [1.25, -0.5, *(START + 0.2)]
    solved = plan(PlanningProblem(robot, [JointWaypoint([0.5, 0.1, *START]), JointWaypoint(end)]), Cubic())
    program = render(solved, name, ExportOptions(PERIOD)).decode()
    rows = np.array([[float(value) for value in row] for row in re.findall(ROWS[name], program)])
    assert len(rows) >= solved.trajectory.duration / PERIOD
    arm = np.degrees(START + 0.2)
    arm[2] -= arm[1] if name == "fanuc_ls" else 0.0
    np.testing.assert_allclose(rows[-1], [*arm, 1250.0, np.degrees(-0.5)], atol=1e-5)
    for near in re.findall(r"(?:E1|eax_a) ?- ?\(500\.0+\)\)+ ?> ?([\d.]+)", program):
        assert float(near) == 10.0
    if name != "fanuc_ls":
        assert len(re.findall(r"(?:E1|eax_a) ?- ?\(500\.0+\)", program)) == 1


def test_axes_of_a_positioner_come_behind_the_others_from_its_foot_on() -> None:
    tilt = ExternalAxis("tilt", "revolute", (0, 1, 0), lower=-1.0, upper=1.0)
    robot = ROBOT.derived(external_axes=[RAIL], positioner=[tilt, TABLE])
    ends = [[0.1, 0.2, 0.5, *START], [-0.5, 0.7, 1.25, *(START + 0.2)]]
    assert robot.joint_names[:3] == ("table", "tilt", "rail")
    program = render(plan(PlanningProblem(robot, ends), Cubic()), "krl", ExportOptions(PERIOD)).decode()
    last = re.findall(r"E1 ([-\d.]+), E2 ([-\d.]+), E3 ([-\d.]+)", program)[-1]
    np.testing.assert_allclose(np.array(last, dtype=float), [1250.0, np.degrees(0.7), np.degrees(-0.5)], atol=1e-5)
    for name in ("krl_kss8", "rapid_moves", "urscript"):
        with pytest.raises(UnsupportedFormat, match="6 joints that turn"):
            render(plan(PlanningProblem(robot, ends), Cubic()), name, ExportOptions(PERIOD))


def test_programs_of_an_arm_that_holds_the_workpiece_have_its_axes_from_the_base_on() -> None:
    """RAPID has a stationary tool and a held work object: the poses of its lines are reached by the arm alone."""
    part, tool = Pose.from_rpy([0.02, 0.0, 0.1], [0.1, 0.2, 0.0]), Pose.from_rpy([1.2, 0.2, 0.9], [0.0, -1.5, 0.0])
    robot = ROBOT.derived(fixed_tool=tool, workpiece=part)
    line = RelativeWaypoint(CartesianMove((0.05, 0.0, 0.0)), frame="base", motion=LinearMotion())
    made = plan(PlanningProblem(robot, [JointWaypoint(START[::-1]), line]), Cubic())
    for name in ("krl", "rapid", "fanuc_ls", "urscript"):
        text = render(made, name, ExportOptions(PERIOD)).decode()
        written = np.array(re.findall(NUMBER, re.sub(r"[AJ]\d", "", text)), dtype=float)
        start = START.copy() if name == "urscript" else np.degrees(START)
        if name == "fanuc_ls":
            start[2] -= start[1]
        rows = np.lib.stride_tricks.sliding_window_view(written, len(start))
        assert np.abs(rows - start).max(axis=1).min() < 1e-4, name
    for name in ("krl_kss8", "urscript_moves"):
        with pytest.raises(UnsupportedFormat, match="holds the workpiece under a fixed tool"):
            render(made, name, ExportOptions(PERIOD))
    text = render(made, "rapid_moves", ExportOptions(PERIOD)).decode()
    pose = rf"\[\[({NUMBER}),({NUMBER}),({NUMBER})\],\[({NUMBER}),({NUMBER}),({NUMBER}),({NUMBER})\]"

    def placement(pattern: str) -> pin.SE3:
        found = re.search(pattern.replace("POSE", pose), text)
        assert found is not None, pattern
        x, y, z, w, i, j, k = (float(number) for number in found.groups())
        return pin.SE3(pin.Quaternion(w, i, j, k).normalized().matrix(), np.array([x, y, z]) / 1e3)

    in_world = placement(r"tooldata planned_tool_1:=\[FALSE,POSE")
    in_wrist = placement(r'wobjdata planned_part:=\[TRUE,TRUE,"",POSE')
    in_part = placement(r"MoveL POSE.*planned_tool_1\\WObj:=planned_part;")
    end = tool_pose(ROBOT, made.path.positions[-1][::-1])
    wrist = pin.SE3(np.array(end.rotation), end.position)
    np.testing.assert_allclose((wrist * in_wrist * in_part).homogeneous, in_world.homogeneous, atol=1e-6)


def test_programs_without_external_axes_refuse_them() -> None:
    robot = ROBOT.derived(external_axes=[RAIL])
    solved = plan(PlanningProblem(robot, [JointWaypoint([0.5, *START]), JointWaypoint([0.6, *START])]), Cubic())
    for name in ("urscript", "urscript_moves"):
        with pytest.raises(UnsupportedFormat, match="6 joints that turn"):
            render(solved, name, ExportOptions(PERIOD))
