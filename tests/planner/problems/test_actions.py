"""Actions along a trajectory besides motion: their times, and their form in programs and recordings."""

from __future__ import annotations

import io
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from planner.backends import Cubic, Quintic
from planner.errors import InvalidProblem, UnsupportedFormat
from planner.export import FORMATS, ExportOptions, render
from planner.kinematics import forward_kinematics
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.actions import Action, AtDistance, AtTime, AtWaypoint, SetOutput, Wait
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import ThroughTransition
from planner.robots import load_robot
from planner.spatial import Pose
from planner.timing.action_times import action_times
from tests.planner.problems_of_tests import problem_of
from tests.sizes import SIZE

ROBOT = replace(load_robot("kuka_kr16_l6_2"), source="")  # an arm of no known maker
START = np.array([0.0, -1.57, 1.57, 0.0, 0.5, 0.0])


def planned(*actions: Action, dwell: float = 0.5) -> Plan:
    waypoints = [
        JointWaypoint(START),
        JointWaypoint(START + 0.2, transition=ThroughTransition()),
        JointWaypoint(START + 0.3, dwell=dwell),
        JointWaypoint(START - 0.1),
    ]
    return plan(PlanningProblem(ROBOT, waypoints, actions=actions), Quintic())


@settings(max_examples=max(SIZE.examples // 5, 5))
@given(st.integers(0, 2**32), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=4))
def test_a_distance_is_gone_at_its_time(seed: int, shares: list[float]) -> None:
    """The truth is chords between very many poses, which are slightly shorter than the path."""
    problem = problem_of("kuka_kr16_l6_2", seed, 3)
    solved = plan(problem, Cubic())
    times = np.linspace(0.0, solved.trajectory.duration, 2001)
    places = np.array([pose.position for pose in forward_kinematics(ROBOT, solved.trajectory.evaluate(times, [0])[0])])
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    requested = [float(share * gone[-1]) for share in shares]
    actions = [SetOutput(AtDistance(distance), "x", True) for distance in requested]
    found = action_times(solved.path.dynamics, solved.trajectory, actions)
    assert [one.distance for one in found] == pytest.approx(sorted(requested), rel=1e-9, abs=1e-9)
    for one in found:
        assert np.interp(one.time, times, gone) == pytest.approx(one.distance, rel=1e-5, abs=1e-5 * gone[-1])


def test_the_way_of_a_line_is_its_length() -> None:
    robot = load_robot("three_dof_arm")
    ends = [Pose(place) for place in ([0.175, 0.0, -0.1], [0.1, -0.09, -0.14])]
    waypoints = [PoseWaypoint(ends[0]), PoseWaypoint(ends[1], motion=LinearMotion(), duration=4.0)]
    length = float(np.linalg.norm(np.subtract([0.1, -0.09, -0.14], [0.175, 0.0, -0.1])))
    actions = [SetOutput(AtDistance(length / 2.0), "x", True), SetOutput(AtTime(4.0), "x", False)]
    middle, end = plan(PlanningProblem(robot, waypoints, actions=actions)).actions
    assert middle.time == pytest.approx(2.0, abs=1e-3)
    assert end.distance == pytest.approx(length, rel=1e-5)


def test_actions_happen_in_order_and_waits_are_waited_for() -> None:
    solved = planned(
        SetOutput(AtWaypoint(2), "close", True),
        Wait(AtWaypoint(2), 0.2),
        SetOutput(AtWaypoint(2), "closed", 1.0),
        SetOutput(AtWaypoint(1), "passed", True),
        SetOutput(AtTime(0.0), "began", True),
    )
    arrivals = solved.trajectory.arrivals
    found = [(one.index, one.time) for one in solved.actions]
    expected = [(4, 0.0), (3, arrivals[1]), (0, arrivals[2]), (1, arrivals[2]), (2, arrivals[2] + 0.2)]
    assert [index for index, _ in found] == [index for index, _ in expected]
    assert [time for _, time in found] == pytest.approx([time for _, time in expected])


@pytest.mark.parametrize(
    ("action", "field"),
    [
        (SetOutput(AtWaypoint(4), "x", True), ("at", "waypoint")),
        (SetOutput(AtTime(1e3), "x", True), ("at", "time")),
        (SetOutput(AtDistance(1e3), "x", True), ("at", "distance")),
        (Wait(AtTime(0.1), 0.1), ("at",)),
        (Wait(AtWaypoint(1), 0.1), ("duration",)),
        (Wait(AtWaypoint(2), 0.6), ("duration",)),
    ],
)
def test_actions_that_cannot_be_are_refused(action: Action, field: tuple[str, ...]) -> None:
    with pytest.raises(InvalidProblem) as refused:
        planned(SetOutput(AtWaypoint(0), "x", True), action)
    (fault,) = refused.value.faults
    assert fault.field == ("actions", 1, *field)


NAMES = {
    "krl": ("gripper", "speed", r"gripper = TRUE", r"speed = 2\.5", r"WAIT SEC 0\.[23]00000"),
    "krl_kss5": ("gripper", "speed", r"gripper = TRUE", r"speed = 2\.5", r"WAIT SEC 0\.(204|300)"),
    "krl_kss8": ("gripper", "speed", r"gripper = TRUE", r"speed = 2\.5", r"WAIT SEC 0\.(204|300)"),
    "rapid": ("gripper", "speed", r"SetDO gripper,1;", r"SetAO speed,2\.5;", r"WaitTime 0\.[23]00000;"),
    "rapid_moves": ("gripper", "speed", r"SetDO gripper,1;", r"SetAO speed,2\.5;", r"WaitTime 0\.[23]00000;"),
    "fanuc_ls": ("DO_3", "AO_1", r"DO\[3\]=ON ;", r"AO\[1\]=2 ;", r"WAIT 0\.[23]0\(sec\) ;"),
    "urscript_moves": (
        "standard_digital_out_3", "standard_analog_out_0", r"set_standard_digital_out\(3, True\)",
        r"set_standard_analog_out\(0, 2\.5\)", r"sleep\(0\.[23]\d*\)",
    ),
}  # fmt: skip


@pytest.mark.parametrize("form", NAMES)
def test_programs_set_outputs_where_the_robot_rests(form: str) -> None:
    digital, analog, *patterns = NAMES[form]
    actions = [
        SetOutput(AtWaypoint(1), digital, True),
        Wait(AtWaypoint(1), 0.2),
        SetOutput(AtWaypoint(1), analog, 2.5),
    ]
    waypoints = [JointWaypoint(START), JointWaypoint(START + 0.2, dwell=0.5), JointWaypoint(START)]
    program = render(plan(PlanningProblem(ROBOT, waypoints, actions=actions)), form).decode()
    at = {
        pattern: [match.start() for match in re.finditer(rf"^[ \d:]*{pattern}\r?$", program, re.MULTILINE)]
        for pattern in patterns
    }
    on, value, waits = at.values()
    assert len(on) == len(value) == 1
    assert len(waits) == 2
    assert on[0] < waits[0] < value[0] < waits[1]
    moving = [SetOutput(AtTime(0.1), digital, True)]
    with pytest.raises(UnsupportedFormat, match="where the robot rests"):
        render(plan(PlanningProblem(ROBOT, waypoints, actions=moving)), form)
    for value_of in (True, 1.0):
        unknown = [SetOutput(AtWaypoint(1), "no such output", value_of)]
        with pytest.raises(UnsupportedFormat, match="no such output"):
            render(plan(PlanningProblem(ROBOT, waypoints, actions=unknown)), form)


def test_a_stream_sets_outputs_with_the_nearest_point() -> None:
    solved = planned(SetOutput(AtTime(0.101), "standard_digital_out_3", False))
    lines = render(solved, "urscript", ExportOptions(0.02)).decode().splitlines()
    (k,) = (k for k, line in enumerate(lines) if line == "  set_standard_digital_out(3, False)")
    assert sum(line.startswith("  servoj") for line in lines[:k]) == 5


def test_recordings_and_arrays_hold_outputs_and_tables_refuse() -> None:
    solved = planned(SetOutput(AtWaypoint(2), "close", True), SetOutput(AtTime(0.25), "speed", 2.5))
    reader = make_reader(io.BytesIO(render(solved, "mcap")), decoder_factories=[DecoderFactory()])
    found = [
        (message.log_time * 1e-9, pair.key, json.loads(pair.value))
        for _, _, message, pair in reader.iter_decoded_messages(topics=["/outputs"])
    ]
    expected = [(0.25, "speed", 2.5), (solved.trajectory.arrivals[2], "close", True)]
    assert [one[1:] for one in found] == [one[1:] for one in expected]
    assert [one[0] for one in found] == pytest.approx([one[0] for one in expected])
    arrays = np.load(io.BytesIO(render(solved, "npz")), allow_pickle=False)
    assert arrays["output_name"].tolist() == ["speed", "close"]
    assert arrays["output_value"].tolist() == [2.5, 1.0]
    assert arrays["output_time"] == pytest.approx([one[0] for one in expected])
    for form in ("csv", "ros2", "c_header"):
        with pytest.raises(UnsupportedFormat, match="actions"):
            render(solved, form)
    assert set(FORMATS) == {"npz", "mcap", "csv", "ros2", "c_header", "urscript", *NAMES}
