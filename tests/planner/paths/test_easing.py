"""Tangent lines and arcs are passed without a stop or a blend, though the curvature jumps."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.corpus.tracing import tool_at
from planner.backends import BackEnd, Cubic, Ruckig, Toppra, Trapezoidal
from planner.errors import InvalidProblem
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import CircularMotion, JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import StopTransition, ThroughTransition, Transition
from planner.robots import load_robot
from planner.spatial import FloatArray, Pose

HOME = (0.3, -1.2, 1.4, 0.2, 0.6, 0.1)
STRAIGHT = 0.2
RADIUS = 0.1
SPEED = 0.1


def bend(transition: Transition, backend: BackEnd, tilt: float = 0.0) -> Plan:
    """Plan a line, a quarter circle and a line, all tangent, or with the circle tilted by an angle, rad."""
    robot = load_robot("kuka_kr16_l6_2")
    home = tool_at(robot, np.array(HOME))

    def at(x: float, y: float) -> Pose:
        return Pose(home.position + np.array([x, -y, 0.0]), home.rotation)

    def on_circle(angle: float) -> Pose:
        c, s = np.cos(tilt), np.sin(tilt)
        x, y = RADIUS * (1.0 - np.cos(angle)), RADIUS * np.sin(angle)
        return at(c * x + s * y, STRAIGHT - s * x + c * y)

    end = on_circle(np.pi / 2.0)
    after = Pose(end.position + np.array([STRAIGHT, 0.0, 0.0]), home.rotation)
    ways = (
        JointWaypoint(HOME),
        PoseWaypoint(at(0.0, STRAIGHT), motion=LinearMotion(), transition=transition),
        PoseWaypoint(end, motion=CircularMotion(Pose(on_circle(0.6).position)), transition=transition),
        PoseWaypoint(after, motion=LinearMotion()),
    )
    return plan(PlanningProblem(robot, ways, Limits(tcp_linear_velocity=SPEED)), backend)


def from_the_way(point: FloatArray) -> float:
    """Return the distance, m, of a point (3,), relative to HOME, from the two lines and the quarter circle."""
    x, y, z = point * [1.0, -1.0, 1.0]
    if y <= STRAIGHT:
        return float(np.hypot(x, z))
    if x >= RADIUS:
        return float(np.hypot(y - STRAIGHT - RADIUS, z))
    return float(np.hypot(np.hypot(x - RADIUS, y - STRAIGHT) - RADIUS, z))


@pytest.mark.parametrize("backend", [Cubic(), Trapezoidal(), Toppra(), Ruckig()], ids=lambda backend: backend.kind)
def test_tangent_lines_and_arcs_are_passed_at_speed_within_their_tolerance(backend: BackEnd) -> None:
    made = bend(ThroughTransition(), backend)
    trajectory = made.trajectory
    assert made.certificate.satisfied
    assert made.certificate.waypoint_error < 1e-9
    robot, home = made.path.robot, tool_at(made.path.robot, np.array(HOME)).position
    times = np.linspace(0.0, trajectory.duration, 801)
    tools = np.array([tool_at(robot, q).position for q in trajectory.evaluate(times, [0])[0]])
    assert max(from_the_way(tool - home) for tool in tools) < 1e-4
    speeds = np.linalg.norm(np.diff(tools, axis=0), axis=1) / np.diff(times)
    if not isinstance(backend, Cubic):
        length = 2.0 * STRAIGHT + RADIUS * np.pi / 2.0
        assert np.mean(speeds > 0.98 * SPEED) > 0.9
        assert trajectory.duration < 1.1 * length / SPEED
    breakpoints = made.path.groups[0].curve.breakpoints[1:-1]
    for order in range(3):
        before, after = (made.path.groups[0].curve.evaluate(breakpoints + at, [order])[0] for at in (-1e-9, 1e-9))
        assert np.abs(after - before).max() < 1e-6 * max(1.0, float(np.abs(after).max()))
    assert trajectory.duration < bend(StopTransition(), backend).trajectory.duration


def test_a_corner_is_refused_and_one_of_rounding_is_not() -> None:
    assert bend(ThroughTransition(), Trapezoidal(), tilt=1e-3).certificate.satisfied
    with pytest.raises(InvalidProblem, match="corner"):
        bend(ThroughTransition(), Trapezoidal(), tilt=0.2)
