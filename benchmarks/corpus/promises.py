"""What every plan must keep, looked at without the certificate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.backends import Guarantee
from planner.backends.base import enforced
from planner.kinematics import tool_speeds
from planner.kinematics.forward import VELOCITIES
from planner.problems.actions import AtWaypoint
from planner.trajectories.polynomials import differentiate, horner

if TYPE_CHECKING:
    from planner.plans.result import Plan
    from planner.robots import Robot
    from planner.spatial import FloatArray

JOINT_QUANTITIES = ("position", "velocity", "acceleration", "jerk")

AT_ONCE = 4096
"""Number of pieces whose samples are looked at together, which bounds the memory that it takes."""


def keeps_joint_limits(result: Plan, samples: int = 33) -> None:
    """Return times, evenly on every piece."""
    trajectory, limits, guarantees = result.trajectory, result.path.limits, result.backend.guarantees
    tau = np.linspace(0.0, 1.0, samples) * trajectory.lengths[:, None]
    for order, quantity in enumerate(JOINT_QUANTITIES):
        values = horner(differentiate(trajectory.coefficients, order)[:, None], tau[..., None])
        if quantity == "position":
            assert (values >= limits.position.lower - 1e-9).all()
            assert (values <= limits.position.upper + 1e-9).all()
        elif guarantees[quantity] is Guarantee.HARD:
            lower, upper = (bound[trajectory.segments][:, None] for bound in limits.bounds(quantity))
            assert (values <= upper * (1.0 + 1e-9)).all()
            assert (values >= lower * (1.0 + 1e-9)).all()


def keeps_least_durations(result: Plan) -> None:
    """Check the arrivals and departures."""
    took = result.trajectory.arrivals[1:] - result.trajectory.departures[:-1]
    least = [waypoint.minimum_duration for waypoint in result.problem.waypoints[1:]]
    assert (took >= np.array(least) * (1.0 - 1e-9)).all()


def times_its_actions(result: Plan) -> None:
    """Check that actions come in order, each once, on the trajectory; at waypoints while the robot is there."""
    found = result.actions
    assert sorted(one.index for one in found) == list(range(len(result.problem.actions)))
    times = [one.time for one in found]
    assert times == sorted(times)
    assert all(0.0 <= time <= result.trajectory.duration for time in times)
    distances = [one.distance for one in found]
    assert (np.diff(distances) >= -1e-9).all()
    for one in found:
        if isinstance(one.action.at, AtWaypoint):
            at = one.action.at.waypoint
            start, end = result.trajectory.arrivals[at], result.trajectory.departures[at]
            assert start <= one.time <= end + 1e-9 * (1.0 + end)


def is_continuous(result: Plan, derivatives: int) -> None:
    """Check continuity from piece to piece, each derivative relative to its own largest value."""
    trajectory = result.trajectory
    tau = np.linspace(0.0, 1.0, 5) * trajectory.lengths[:, None]
    for order in range(derivatives + 1):
        values = horner(differentiate(trajectory.coefficients, order)[:, None], tau[..., None])
        jumps = np.abs(values[1:, 0] - values[:-1, -1]).max(initial=0.0)
        assert jumps <= 1e-9 * max(np.abs(values).max(), 1.0)
    assert int(result.certificate.continuity[1:]) >= derivatives


def robots_on_segments(result: Plan) -> list[Robot]:
    """Return the robot with the tool and the payload of each segment."""
    robot, with_tools = result.problem.robot, []
    for waypoint in result.problem.waypoints:
        robot = robot if waypoint.tool is None else robot.with_tool(waypoint.tool)
        with_tools.append(robot)
    carried = zip(with_tools[1:] or with_tools, result.problem.payloads, strict=False)
    return [robot if payload is None else robot.with_payload(payload) for robot, payload in carried]


def _keeps_tool_jerks(result: Plan, times: FloatArray, step: float = 1e-5) -> None:
    """Return differences of Pinocchio's accelerations of the tool, at times whose neighbours are on the same piece."""
    trajectory, robots, limits = result.trajectory, robots_on_segments(result), result.path.limits.of_tool
    limits = {name: limit for name, limit in limits.items() if name in enforced(result.backend) and "jerk" in name}
    pieces, since = trajectory.locate(times)
    inside = np.minimum(since, trajectory.lengths[pieces] - since) > step
    for time, segment in zip(times[inside], trajectory.segments[pieces[inside]], strict=True):
        robot, gains = robots[segment], []
        data = robot.model.createData()
        for shift in (-step, step) if limits else ():
            pin.forwardKinematics(robot.model, data, *trajectory.evaluate(time + shift, [0, 1, 2]))
            frame = robot.tool_frame_id, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            gain = pin.getFrameClassicalAcceleration(robot.model, data, *frame)
            gains.append({"tcp_linear_jerk": gain.linear.copy(), "tcp_angular_jerk": gain.angular.copy()})
        for name, limit in limits.items():
            jerk = np.linalg.norm(gains[1][name] - gains[0][name]) / (2.0 * step)
            assert jerk <= limit[segment] * (1.0 + 1e-4)


def keeps_sampled_limits(result: Plan, samples: int = 100) -> None:
    """Check torque with the payload and tool speeds by Pinocchio, at random times; the tool's speed evenly, too."""
    trajectory, limits, robots = result.trajectory, result.path.limits, robots_on_segments(result)
    data = [robot.model.createData() for robot in robots]
    times = trajectory.duration * np.random.default_rng(0).random(samples)
    segments = trajectory.segments[trajectory.locate(times)[0]]
    for segment, q, v, a in zip(segments, *trajectory.evaluate(times, [0, 1, 2]), strict=True):
        robot = robots[segment]
        if robot.has_dynamics:
            torque = pin.rnea(robot.model, data[segment], q, v, a)
            lower, upper = (bound[segment] for bound in limits.bounds("torque"))
            assert (torque <= upper * (1.0 + 1e-6)).all()
            assert (torque >= lower * (1.0 + 1e-6)).all()
        frame = robot.tool_frame_id, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.forwardKinematics(robot.model, data[segment], q, v, a)
        speed = pin.getFrameVelocity(robot.model, data[segment], *frame)
        assert np.linalg.norm(speed.linear) <= limits.magnitudes("tcp_linear_velocity")[segment, 0] * (1.0 + 1e-6)
        assert np.linalg.norm(speed.angular) <= limits.magnitudes("tcp_angular_velocity")[segment, 0] * (1.0 + 1e-6)
        gain = pin.getFrameClassicalAcceleration(robot.model, data[segment], *frame)
        assert np.linalg.norm(gain.linear) <= limits.magnitudes("tcp_linear_acceleration")[segment, 0] * (1.0 + 1e-6)
        assert np.linalg.norm(gain.angular) <= limits.magnitudes("tcp_angular_acceleration")[segment, 0] * (1.0 + 1e-6)
        if (fast := np.linalg.norm(speed.linear)) > 1e-6:
            across = min(np.linalg.norm(np.cross(speed.linear, gain.linear)) / fast, fast**2 / 1e-4)
            assert across <= limits.magnitudes("tcp_centripetal_acceleration")[segment, 0] * (1.0 + 1e-6)
    _keeps_tool_jerks(result, times)
    bounds = np.array([limits.magnitudes(name)[trajectory.segments, 0] for name in VELOCITIES])
    if np.isfinite(bounds).any():
        each = np.linspace(0.0, 1.0, 17)
        for first in range(0, len(trajectory.lengths), AT_ONCE):
            part = slice(first, first + AT_ONCE)
            times = (trajectory.breakpoints[:-1][part, None] + each * trajectory.lengths[part, None]).ravel()
            states, own = trajectory.evaluate(times, [0, 1]), np.repeat(trajectory.segments[part], len(each))
            allowed = np.repeat(bounds[:, part], len(each), axis=1) * (1.0 + 1e-6)
            for segment in np.unique(own).tolist():
                rows = own == segment
                speeds = np.array(tool_speeds(robots[segment], *(state[rows] for state in states)))
                assert (speeds <= allowed[:, rows]).all()
