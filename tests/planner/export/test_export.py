"""The formats, each read back by somebody else's reader."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

from planner.backends import Quintic
from planner.errors import MissingDynamics
from planner.export import FORMATS, INCLUDABLE, ExportOptions, render
from planner.planning import plan
from planner.result import Plan
from planner.robots.payload import Payload
from tests.planner.problems import problem_of


@pytest.fixture(scope="module")
def result() -> Plan:
    return plan(problem_of("kuka_kr16_l6_2", 2, 4), Quintic())


EVERYTHING = ExportOptions(sample_period=0.05, include=frozenset(INCLUDABLE))


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


def test_csv_is_a_table_that_the_csv_module_reads(result: Plan) -> None:
    rows = list(csv.DictReader(io.StringIO(FORMATS["csv"].render(result, EVERYTHING).decode(), newline="")))
    time = np.array([float(row["time"]) for row in rows])
    assert time[-1] == result.trajectory.duration
    velocity = [[float(row[f"velocity.{name}"]) for name in result.path.robot.joint_names] for row in rows]
    assert (np.array(velocity) == result.trajectory.evaluate(time, [1])[0]).all()
    assert {"torque.joint_a1", "tcp_position.x", "tcp_quaternion.w", "jerk.joint_a6"} <= set(rows[0])


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


def test_torques_of_a_robot_without_inertias_are_refused_unless_it_carries_something() -> None:
    problem = problem_of("ngv_refuelling_arm", 2, 3)
    torque = ExportOptions(include=frozenset({"torque"}))
    with pytest.raises(MissingDynamics):
        FORMATS["json"].render(plan(problem), torque)
    carrying = plan(replace(problem, payload=Payload(mass=1.0)))
    assert [warning.code for warning in carrying.warnings] == ["payload_only"]
    answer = json.loads(FORMATS["json"].render(carrying, torque))
    assert np.abs(answer["samples"]["torque"]).max() > 0.0


def test_a_form_is_named(result: Plan) -> None:
    assert render(result) == FORMATS["json"].render(result, ExportOptions())
    assert render(result, "csv", EVERYTHING) == FORMATS["csv"].render(result, EVERYTHING)
    with pytest.raises(ValueError, match="'xml'; the formats are json, csv, ros2"):
        render(result, "xml")
