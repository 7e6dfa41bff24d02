"""Times of constant tool speed, against dense differences of Pinocchio's poses; the limits that interrupt it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.corpus.tracing import tool_at
from planner.backends import BackEnd, Cubic, Ruckig, Toppra
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.plans.tool_reports import HELD, tool_speed_reports
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PolylineMotion, PoseWaypoint
from planner.robots import load_robot
from planner.spatial import FloatArray, Pose

HOME = (0.3, -1.2, 1.4, 0.2, 0.6, 0.1)
STEP = 1e-5


def around_corners(backend: BackEnd, limits: Limits, duration: float | None = None) -> Plan:
    """Return a joint motion, then a polyline around two sharp corners."""
    robot = load_robot("kuka_kr16_l6_2")
    home = tool_at(robot, np.array(HOME))
    corners = [Pose(home.position + np.array(shift)) for shift in ((0.0, -0.3, 0.0), (0.0, -0.3, -0.2))]
    end = Pose(home.position + np.array([0.2, -0.3, -0.2]), home.rotation)
    goal = PoseWaypoint(end, motion=PolylineMotion(corners, 0.01), duration=duration)
    aside = JointWaypoint([0.2, *HOME[1:]])
    return plan(PlanningProblem(robot, [aside, JointWaypoint(HOME), goal], limits), backend)


def speeds_at(made: Plan, times: FloatArray) -> FloatArray:
    """Return tool speeds by differences, m/s."""
    tools = [
        np.array([tool_at(made.path.robot, q).position for q in made.trajectory.evaluate(times + at, [0])[0]])
        for at in (-STEP, STEP)
    ]
    speeds: FloatArray = np.linalg.norm(tools[1] - tools[0], axis=1) / (2.0 * STEP)
    return speeds


@pytest.mark.long_table
@pytest.mark.parametrize("backend", [Toppra(), Ruckig(), Cubic()], ids=lambda backend: backend.kind)
@pytest.mark.parametrize("speed", [0.1, 0.5])
def test_the_parts_are_where_the_tool_is_slow_by_differences(backend: BackEnd, speed: float) -> None:
    made = around_corners(backend, Limits(tcp_linear_velocity=speed))
    (report,) = tool_speed_reports(made)
    assert (report.segment, report.limit) == (1, speed)
    begins, ends = made.trajectory.departures[1], made.trajectory.arrivals[2]
    times = np.linspace(begins + 2.0 * STEP, ends - 2.0 * STEP, 1501)
    speeds = speeds_at(made, times)
    inside = np.zeros(len(times), dtype=bool)
    for part in report.slow:
        inside |= (times >= part.start_time) & (times <= part.end_time)
        own = speeds[(times >= part.start_time) & (times <= part.end_time)]
        assert own.min() == pytest.approx(part.lowest_speed, abs=0.02 * speed)
        gone = np.trapezoid(np.where(times <= part.end_time, speeds, 0.0), times)
        assert gone == pytest.approx(part.end_distance, abs=2e-3)
    blurred = np.abs(speeds - HELD * speed) < 2e-3 * speed
    edges = np.abs(times[:, None] - [(part.start_time, part.end_time)[k] for part in report.slow for k in (0, 1)])
    blurred |= edges.min(axis=1) < 2.0 * made.trajectory.lengths.max() / 16.0
    assert ((speeds < HELD * speed) == inside)[~blurred].all()
    held = np.trapezoid(np.where(speeds >= HELD * speed, speeds, 0.0), times) / np.trapezoid(speeds, times)
    assert report.held == pytest.approx(held, abs=0.02)


def test_the_limit_that_binds_is_used_up_where_the_tool_is_slowest() -> None:
    made = around_corners(Toppra(), Limits(tcp_linear_velocity=0.5))
    (report,) = tool_speed_reports(made)
    assert len(report.slow) == 4  # both ends and both corners
    for part in report.slow[1:3]:
        assert part.quantity == "acceleration"
        joint = made.path.robot.joint_names.index(str(part.joint))
        times = np.linspace(part.start_time, part.end_time, 400)[1:-1]
        slowest = times[speeds_at(made, times).argmin()]
        (v,) = made.trajectory.evaluate(slowest + np.linspace(-2e-3, 2e-3, 41), [1])
        accelerations = np.abs(np.diff(v[:, joint])) / 1e-4
        assert accelerations.max() == pytest.approx(made.path.limits.acceleration.narrower[1, joint], rel=0.05)


@pytest.mark.parametrize(
    ("limits", "duration", "quantity"),
    [
        (Limits(tcp_linear_velocity=0.5, tcp_angular_velocity=0.2), None, "tcp_angular_velocity"),
        (Limits(tcp_linear_velocity=5.0, velocity_scale=0.05), None, "velocity"),
        (Limits(tcp_linear_velocity=0.5), 30.0, "duration"),
    ],
)
def test_other_reasons(limits: Limits, duration: float | None, quantity: str) -> None:
    robot = load_robot("kuka_kr16_l6_2")
    home = tool_at(robot, np.array(HOME))
    turned = home.rotation @ tool_at(robot, np.array([*HOME[:5], 0.9])).rotation.T @ home.rotation
    goal = PoseWaypoint(
        Pose(home.position + np.array([0.0, -0.2, 0.0]), turned), motion=LinearMotion(), duration=duration
    )
    made = plan(PlanningProblem(robot, [JointWaypoint(HOME), goal], limits), Toppra())
    (report,) = tool_speed_reports(made)
    longest = max(report.slow, key=lambda part: part.end_distance - part.start_distance)
    middle = tool_speed_reports(made)[0].slow
    assert quantity in {part.quantity for part in middle}
    assert report.held < 0.5
    assert longest.use <= 1.0 + 1e-6


def test_motions_without_a_limit_and_joint_motions_are_left_out() -> None:
    assert tool_speed_reports(around_corners(Toppra(), Limits())) == []
