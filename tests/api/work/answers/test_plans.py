"""Answers for plans, read back by other readers."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import msgpack
import numpy as np
import pytest

import planner
from api.work.answers.formats import FORMATS
from api.work.answers.plans import AnswerOptions, as_dict
from planner.backends import Quintic
from planner.errors import MissingDynamics
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import LinearMotion, PlanningProblem, PoseWaypoint
from planner.proofs import check_proof
from planner.robots import load_robot
from planner.robots.payload import Payload
from planner.spatial import Pose
from tests.api.requests import PARTS
from tests.planner.free_motion.cases import ARM, LEFT, RIGHT, WALL
from tests.planner.problems_of_tests import problem_of


@pytest.fixture(scope="module")
def result() -> Plan:
    return plan(problem_of("kuka_kr16_l6_2", 2, 4), Quintic())


EVERYTHING = AnswerOptions(sample_period=0.05, include=frozenset(PARTS))


def test_json_numbers_read_back_exactly(result: Plan) -> None:
    answer = json.loads(FORMATS["json"].render(result, EVERYTHING))
    samples, trajectory = answer["samples"], result.trajectory
    time = np.array(samples["time"])
    assert (time[0], time[-1], answer["duration"]) == (0.0, trajectory.duration, trajectory.duration)
    assert np.diff(time[:-1]) == pytest.approx(0.05)
    expected = trajectory.evaluate(time, range(4))
    for name, values in zip(("position", "velocity", "acceleration", "jerk"), expected, strict=True):
        assert (np.array(samples[name]) == values).all()
    assert np.array(samples["torque"]).shape == (len(time), 6)
    assert np.linalg.norm(samples["tcp_pose"]["quaternion_xyzw"], axis=1) == pytest.approx(1.0)
    assert (np.diff(samples["segment"]) >= 0).all()


def test_polynomials_give_the_samples_again(result: Plan) -> None:
    answer = json.loads(FORMATS["json"].render(result, EVERYTHING))
    for j, joint in enumerate(answer["polynomials"]):
        breakpoints = np.array(joint["breakpoints"])
        for time, row in zip(answer["samples"]["time"], answer["samples"]["position"], strict=True):
            piece = min(int(np.searchsorted(breakpoints, time, side="right")) - 1, len(joint["coefficients"]) - 1)
            value = np.polynomial.Polynomial(joint["coefficients"][piece])(time - breakpoints[piece])
            assert value == pytest.approx(row[j], abs=1e-12)


def test_the_tools_columns_are_the_same_in_json_and_csv(result: Plan) -> None:
    samples = json.loads(FORMATS["json"].render(result, EVERYTHING))["samples"]
    table = list(csv.DictReader(io.StringIO(FORMATS["csv"].render(result, EVERYTHING).decode(), newline="")))
    for quantity in ("velocity", "acceleration"):
        for kind, rows in samples[f"tcp_{quantity}"].items():
            columns = [[float(row[f"tcp_{kind}_{quantity}.{axis}"]) for axis in "xyz"] for row in table]
            assert columns == rows
    angles = [[float(row[f"tcp_rpy.{name}"]) for name in ("roll", "pitch", "yaw")] for row in table]
    assert angles == samples["tcp_rpy"]


def test_lines_are_polynomials_in_json_only() -> None:
    """The document's line of Table 3.0: rows of coefficients by axis; a plan without lines has none."""
    robot = load_robot("three_dof_arm")
    start, end = (PoseWaypoint(Pose(place)) for place in ([0.175, 0.0, -0.1], [0.1, -0.09, -0.14]))
    line = replace(end, motion=LinearMotion(), duration=5.0)
    options = AnswerOptions(include=frozenset({"tcp_polynomials"}))
    drawn = plan(PlanningProblem(robot, [start, line]))
    (found,) = json.loads(FORMATS["json"].render(drawn, options))["tcp_polynomials"]
    assert (found["segment"], found["breakpoints"]) == (0, [0.0, 5.0])
    assert found["path_parameter"][0] == pytest.approx([0.0, 0.0, 0.12, -0.016])
    for axis, row in {"x": [0.175, 0.0, -0.009, 0.0012], "y": [0.0, 0.0, -0.0108, 0.00144]}.items():
        assert found[axis][0] == pytest.approx(row, abs=1e-12)
    assert FORMATS["csv"].render(drawn, options) == FORMATS["csv"].render(drawn, AnswerOptions())
    joint = plan(PlanningProblem(robot, [start, end]))
    assert json.loads(FORMATS["json"].render(joint, options))["tcp_polynomials"] == []


def test_the_proof_in_an_answer_is_checked(result: Plan) -> None:
    options = AnswerOptions(include=frozenset({"proof"}))
    answer = json.loads(FORMATS["json"].render(result, options))
    claims = check_proof(answer["proof"])
    assert {"continuity", "waypoints", "velocity"} <= set(claims)
    assert "proof" not in json.loads(FORMATS["json"].render(result, AnswerOptions()))


def test_torques_of_a_robot_without_inertias_are_refused_unless_it_carries_something() -> None:
    problem = problem_of("ngv_refuelling_arm", 2, 3)
    torque = AnswerOptions(include=frozenset({"torque"}))
    with pytest.raises(MissingDynamics):
        FORMATS["json"].render(plan(problem), torque)
    carrying = plan(replace(problem, payload=Payload(mass=1.0)))
    assert [warning.code for warning in carrying.warnings] == ["position_unchecked", "payload_only"]
    answer = json.loads(FORMATS["json"].render(carrying, torque))
    assert np.abs(answer["samples"]["torque"]).max() > 0.0


def test_messagepack_is_the_answer(result: Plan) -> None:
    """Read by another library."""
    assert msgpack.unpackb(FORMATS["msgpack"].render(result, EVERYTHING)) == json.loads(
        FORMATS["json"].render(result, EVERYTHING)
    )


def test_corners_of_a_detour_have_the_index_of_the_waypoint_that_they_lead_to() -> None:
    waypoints = [planner.JointWaypoint(LEFT), planner.JointWaypoint(RIGHT, motion=planner.FreeMotion(), name="there")]
    around = plan(PlanningProblem(ARM, waypoints, scene=planner.Scene([WALL], margin=0.01)))
    answered = as_dict(around, AnswerOptions(0.1))["waypoints"]
    corners = len(around.detours[0].positions) - 2
    assert corners > 0
    assert [waypoint["index"] for waypoint in answered] == [0, *[1] * corners, 1]
    assert [waypoint["choice"] for waypoint in answered] == ["given", *["detour"] * corners, "given"]
    assert answered[-1]["name"] == "there"


def test_actions_are_answered_with_their_times_and_fields(result: Plan) -> None:
    at = planner.AtWaypoint(2)
    actions = [planner.SetOutput(at, "close", True), planner.Wait(at, 0.2)]
    waypoints = [replace(waypoint, dwell=0.5) for waypoint in result.problem.waypoints]
    solved = plan(replace(result.problem, waypoints=waypoints, actions=actions))
    first, second = as_dict(solved, AnswerOptions())["actions"]
    assert first | {"time": 0, "distance": 0} == {
        "index": 0, "time": 0, "distance": 0, "kind": "set_output", "name": "close", "value": True,
    }  # fmt: skip
    assert first["time"] == second["time"] == solved.trajectory.arrivals[2]
    assert (second["kind"], second["duration"]) == ("wait", 0.2)
    assert "actions" not in as_dict(result, AnswerOptions())


@pytest.mark.parametrize("dwell", [0.0, 2.0])
def test_the_last_sample_of_a_rest_is_at_its_end(dwell: float) -> None:
    home = planner.JointWaypoint(load_robot("kuka_kr16_l6_2").middle, dwell=dwell)
    found = plan(PlanningProblem(load_robot("kuka_kr16_l6_2"), [home]))
    assert as_dict(found, AnswerOptions())["samples"]["time"][-1] == found.trajectory.duration
