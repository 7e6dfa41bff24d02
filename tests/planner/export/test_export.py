"""Export formats, each read back by an independent reader."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner.backends import Quintic
from planner.errors import UnsupportedFormat
from planner.export import FORMATS, INCLUDABLE, ExportOptions, render
from planner.export.csv import quoted
from planner.planning import plan
from planner.plans.result import Plan
from tests.planner.problems_of_tests import problem_of


@pytest.fixture(scope="module")
def result() -> Plan:
    return plan(problem_of("kuka_kr16_l6_2", 2, 4), Quintic())


EVERYTHING = ExportOptions(sample_period=0.05, include=frozenset(INCLUDABLE))


def test_csv_is_a_table_that_the_csv_module_reads(result: Plan) -> None:
    rows = list(csv.DictReader(io.StringIO(FORMATS["csv"].render(result, EVERYTHING).decode(), newline="")))
    time = np.array([float(row["time"]) for row in rows])
    assert time[-1] == result.trajectory.duration
    velocity = [[float(row[f"velocity.{name}"]) for name in result.path.robot.joint_names] for row in rows]
    assert (np.array(velocity) == result.trajectory.evaluate(time, [1])[0]).all()
    assert {"torque.joint_a1", "tcp_position.x", "tcp_quaternion.w", "jerk.joint_a6"} <= set(rows[0])


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_no_name_of_a_joint_becomes_a_formula_in_a_spreadsheet(separator: str) -> None:
    """The rule holds for every separator of cells that a spreadsheet may use."""
    problem = problem_of("three_dof_arm", 2, 2)
    names = ("a,=1+1", 'b;=HYPERLINK("x")', "c\t@SUM(1)\r\n-2")
    joints = tuple(replace(joint, name=name) for joint, name in zip(problem.robot.joints, names, strict=True))
    made = plan(replace(problem, robot=replace(problem.robot, joints=joints)))
    text = FORMATS["csv"].render(made, ExportOptions()).decode()
    header = next(csv.reader(io.StringIO(text, newline=""), delimiter=separator))
    assert not [cell for cell in header if cell.startswith(("=", "+", "-", "@", "\t", "\r"))]
    columns = next(csv.reader(io.StringIO(text, newline="")))
    assert [f"position.{name}" for name in names] == [column.replace("'", "") for column in columns[2:5]]


@pytest.mark.parametrize("cell", ["=1+1", "+1", "-1", "@SUM(1)"])
def test_a_cell_that_is_a_formula_is_made_text(cell: str) -> None:
    assert next(csv.reader(io.StringIO(quoted(cell), newline=""))) == [f"'{cell}"]


def test_the_tools_rates_are_differences_of_its_poses(result: Plan) -> None:
    """The rates agree with central differences of the poses among the samples, 1 ms apart."""
    h = 0.001
    samples = result.samples(h, ["tcp_pose", "tcp_rpy", "tcp_velocity", "tcp_acceleration"])
    assert samples.tcp_position is not None
    assert samples.tcp_quaternion is not None
    assert samples.tcp_rpy is not None
    place = samples.tcp_position[:-1]  # the last is nearer
    turned = Rotation.from_quat(samples.tcp_quaternion[:-1])
    assert (Rotation.from_euler("xyz", samples.tcp_rpy[:-1]) * turned.inv()).magnitude().max() < 1e-9
    spin = (turned[2:] * turned[:-2].inv()).as_rotvec() / (2.0 * h)
    velocity, acceleration = (
        {kind: rows[:-1] for kind, rows in zip(("linear", "angular"), rates or (), strict=True)}
        for rates in (samples.tcp_velocity, samples.tcp_acceleration)
    )
    for found, expected in (
        (velocity["linear"][1:-1], (place[2:] - place[:-2]) / (2.0 * h)),
        (velocity["angular"][1:-1], spin),
        (acceleration["linear"][1:-1], (velocity["linear"][2:] - velocity["linear"][:-2]) / (2.0 * h)),
        (acceleration["angular"][1:-1], (velocity["angular"][2:] - velocity["angular"][:-2]) / (2.0 * h)),
    ):
        away = np.abs(found - expected).max(axis=1)
        smooth = samples_of_one_piece(result, h, len(place))[1:-1]  # at a waypoint the jerk jumps
        assert away[smooth].max() < 1e-3 * np.abs(found).max()


def samples_of_one_piece(result: Plan, h: float, count: int) -> np.ndarray:
    """Tell for each of `count` samples, h apart, whether its neighbours are on one piece."""
    time = h * np.arange(count)
    pieces = [np.searchsorted(result.trajectory.breakpoints, t, side="right") for t in (time - h, time + h)]
    return pieces[0] == pieces[1]


def test_ros2_message_has_the_fields_of_joint_trajectory(result: Plan) -> None:
    message = json.loads(FORMATS["ros2"].render(result, EVERYTHING))
    assert set(message) == {"header", "joint_names", "points"}
    assert message["joint_names"] == list(result.path.robot.joint_names)
    fields = {"positions", "velocities", "accelerations", "effort", "time_from_start"}
    assert all(set(point) == fields for point in message["points"])
    stamps = [p["time_from_start"]["sec"] + p["time_from_start"]["nanosec"] * 1e-9 for p in message["points"]]
    assert (np.diff(stamps) > 0.0).all()
    assert stamps[-1] == pytest.approx(result.trajectory.duration, abs=1e-9)
    assert all(0 <= p["time_from_start"]["nanosec"] < 10**9 for p in message["points"])


def test_a_form_is_named(result: Plan) -> None:
    assert render(result, "csv", EVERYTHING) == FORMATS["csv"].render(result, EVERYTHING)
    with pytest.raises(ValueError, match="'xml'; the formats are csv, ros2"):
        render(result, "xml")


def test_npz_holds_the_arrays(result: Plan) -> None:
    found = np.load(io.BytesIO(render(result, "npz", EVERYTHING)), allow_pickle=False)
    samples = result.samples(0.05, INCLUDABLE)
    for name in ("time", "position", "velocity", "acceleration", "segment", "jerk", "torque", "tcp_rpy"):
        assert (found[name] == getattr(samples, name)).all(), name
    assert (found["tcp_quaternion"] == samples.tcp_quaternion).all()
    assert samples.tcp_velocity is not None
    assert (found["tcp_angular_velocity"] == samples.tcp_velocity[1]).all()
    assert tuple(found["joint_names"]) == result.path.robot.joint_names
    assert (found["arrivals"] == result.trajectory.arrivals).all()
    assert (found["breakpoints"] == result.trajectory.breakpoints).all()
    assert (found["coefficients"] == result.trajectory.coefficients).all()
    again = np.load(io.BytesIO(render(result, "npz")), allow_pickle=False)
    assert set(found.files) - set(again.files) >= {"jerk", "breakpoints", "tcp_linear_acceleration"}


def test_urscript_streams_the_positions(result: Plan) -> None:
    """A grammar of the few used statements reads them; blocks end where they should."""
    program = render(result, "urscript", ExportOptions(sample_period=0.008)).decode().splitlines()
    number, depth = r"-?\d+(?:\.\d+)?(?:e-?\d+)?", 0
    joints = r"\[(" + number + r"(?:, " + number + r"){5})\]"
    statements = {
        "comment": r"#.*",
        "start": r"start = " + joints,
        "approach": r"movej\(start, t=1\.0\)",
        "servoj": rf"servoj\({joints}, t=({number}), lookahead_time=({number}), gain=(\d+)\)",
        "other": r"(i = 0|i = i \+ 1|halt|actual = get_actual_joint_positions\(\)|stopj\(2\.0\)|popup\(.*error=True\))",
        "begin": r"(def planned_trajectory\(\)|while i < 6|if norm\(actual\[i\] - start\[i\]\) > 0\.01):",
        "end": r"end",
        "call": r"planned_trajectory\(\)",
    }
    time, rows, times, kinds = 0.0, [], [], []
    for line in program:
        (kind,) = (name for name, pattern in statements.items() if re.fullmatch(r" *" + pattern, line))
        depth += {"begin": 1, "end": -1}.get(kind, 0)
        assert depth >= 0
        assert kind != "call" or depth == 0
        kinds.append(kind)
        if kind in ("start", "servoj"):
            found = re.fullmatch(r" *" + statements[kind], line)
            assert found is not None
            rows.append([float(cell) for cell in found[1].split(", ")])
            time += float(found[2]) if kind == "servoj" else 0.0
            times.append(time)
            # Bounds of the function in Universal Robots' script manual.
            assert kind == "start" or (0.03 <= float(found[3]) <= 0.2 and 100 <= int(found[4]) <= 2000)
    assert depth == 0
    assert kinds.count("approach") == 1 and kinds.index("approach") == kinds.index("servoj") - 1
    assert time == pytest.approx(result.trajectory.duration, rel=1e-12)
    expected = result.trajectory.evaluate(np.minimum(times, result.trajectory.duration), [0])[0]
    assert np.abs(np.array(rows) - expected).max() <= 1e-9


def test_urscript_is_for_six_joints_that_turn() -> None:
    for robot_id in ("three_dof_arm", "date_sorting_arm"):
        solved = plan(problem_of(robot_id, 0, 2), Quintic())
        with pytest.raises(UnsupportedFormat, match=robot_id):
            render(solved, "urscript")
