"""The judge of random requests: limits by their definition, on dense samples of the polynomials that came back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from planner.spatial import Pose, rotation_from_rpy

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.robots import Robot

STEP = 1e-5
"""Time on either side of a sample, s, over which accelerations of the tool are differenced."""

SHARES = (0.0, 0.13, 0.37, 0.5, 0.71, 1.0)
"""Shares of each piece at which joints are sampled."""

ON_TOOL = 150
"""Number of random times at which the tool is sampled, at most."""


class Answered:
    """Polynomials of an answer.

    Attributes:
        breakpoints: (pieces + 1,), s.
        coefficients: (pieces, joints, powers), ascending powers of the time since the piece began.
    """

    def __init__(self, answer: dict[str, Any]) -> None:
        joints = answer["polynomials"]
        self.breakpoints = np.array(joints[0]["breakpoints"])
        most = max(len(row) for joint in joints for row in joint["coefficients"])
        padded = [[row + [0.0] * (most - len(row)) for row in joint["coefficients"]] for joint in joints]
        self.coefficients = np.array(padded).transpose(1, 0, 2)

    def derivatives(self, pieces: np.ndarray, since: np.ndarray) -> list[np.ndarray]:
        """Positions, velocities, accelerations and jerks, each (N, joints), at times (N,) on pieces (N,)."""
        values, own = [], self.coefficients[pieces]
        for _ in range(4):
            values.append(np.einsum("njp,np->nj", own, since[:, None] ** np.arange(own.shape[2])))
            own = own[:, :, 1:] * np.arange(1, own.shape[2]) if own.shape[2] > 1 else 0.0 * own
        return values


def bounds_of(robot: Robot, quantity: str, given: list[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """The lower and the upper limit of each joint: the narrowest of all that are given, times all scales."""
    lower, upper = -robot.bounds(quantity)[0], robot.bounds(quantity)[1]
    lower, upper = (np.minimum(side, robot.limit(quantity)) for side in (lower, upper))
    for limits in given:
        if (values := limits.get(quantity)) is not None:
            lower, upper = np.minimum(lower, values), np.minimum(upper, values)
        if (pairs := limits.get(f"{quantity}_range")) is not None:
            lower, upper = np.minimum(lower, -np.array(pairs)[:, 0]), np.minimum(upper, np.array(pairs)[:, 1])
    scale = np.prod([limits.get(f"{quantity}_scale", 1.0) for limits in given])
    return -lower * scale, upper * scale


def holds(robot: Robot, request: dict[str, Any], answer: dict[str, Any], random: np.random.Generator) -> None:
    """Fail where an enforced limit is broken."""
    checks = {check["quantity"]: check for check in answer["certificate"]["checks"]}
    assert answer["certificate"]["satisfied"]
    enforced = {name for name, check in checks.items() if check["enforced"]}
    trajectory = Answered(answer)
    lengths = np.diff(trajectory.breakpoints)
    for first, last, given in _segments(request, answer):
        middles = trajectory.breakpoints[:-1] + lengths / 2.0
        own = np.flatnonzero((middles > first) & (middles < last))
        if not len(own):
            continue
        pieces, share = np.repeat(own, len(SHARES)), np.tile(SHARES, len(own))
        values = trajectory.derivatives(pieces, share * lengths[pieces])
        lower, upper = robot.limit("lower"), robot.limit("upper")
        assert (values[0] >= lower - 1e-6).all()
        assert (values[0] <= upper + 1e-6).all()
        for order, quantity in enumerate(("velocity", "acceleration", "jerk"), 1):
            if quantity in enforced:
                low, high = bounds_of(robot, quantity, given)
                assert (values[order] <= high * (1.0 + 1e-6) + 1e-9).all(), quantity
                assert (values[order] >= low * (1.0 + 1e-6) - 1e-9).all(), quantity
        tool = {
            name: min(limits[name] for limits in given if name in limits)
            for name in enforced
            if name.startswith("tcp_") and any(name in limits for limits in given)
        }
        if tool:
            pieces = random.choice(own, min(ON_TOOL, 4 * len(own)))
            since = random.random(len(pieces)) * lengths[pieces]
            _tool_holds(_with_tool(robot, request), trajectory, tool, pieces, since)


def _segments(request: dict[str, Any], answer: dict[str, Any]) -> Iterator[tuple[float, float, list[dict[str, Any]]]]:
    """Times between which limits hold together: of a plan those of each segment, of other trajectories all of it."""
    whole = request.get("limits", {})
    waypoints = request.get("waypoints")
    if waypoints is None:
        yield -1.0, np.inf, [whole]
        return
    times = answer["waypoints"]
    for k in range(1, len(times)):
        yield times[k - 1]["departure_time"], times[k]["arrival_time"], [whole, waypoints[k].get("limits", {})]


def _with_tool(robot: Robot, request: dict[str, Any]) -> Robot:
    tool = request.get("tool")
    if tool is None:
        return robot
    turn = tool["orientation"]
    return robot.with_tool(Pose(np.array(tool["position"]), rotation_from_rpy(*(turn["rpy"] if turn else (0.0,) * 3))))


def _tool_holds(
    robot: Robot, trajectory: Answered, limits: dict[str, float], pieces: np.ndarray, since: np.ndarray
) -> None:
    """Hold the tool's motion, as Pinocchio knows it, against limits; jerks by differences of its accelerations."""
    data, axes = robot.model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def motions(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Velocities and accelerations of the tool, linear over angular, each (N, 6)."""
        velocities, accelerations = [], []
        for q, v, a in zip(*trajectory.derivatives(pieces, times)[:3], strict=True):
            pin.forwardKinematics(robot.model, data, q, v, a)
            velocities.append(pin.getFrameVelocity(robot.model, data, robot.tool_frame_id, axes).vector.copy())
            gain = pin.getFrameClassicalAcceleration(robot.model, data, robot.tool_frame_id, axes)
            accelerations.append(gain.vector.copy())
        return np.array(velocities), np.array(accelerations)

    velocity, acceleration = motions(since)
    jerk = (motions(since + STEP)[1] - motions(since - STEP)[1]) / (2.0 * STEP)
    speed = np.linalg.norm(velocity[:, :3], axis=1)
    across = np.linalg.norm(np.cross(velocity[:, :3], acceleration[:, :3]), axis=1)
    moving = speed > 1e-3
    found = {
        "tcp_linear_velocity": speed,
        "tcp_angular_velocity": np.linalg.norm(velocity[:, 3:], axis=1),
        "tcp_linear_acceleration": np.linalg.norm(acceleration[:, :3], axis=1),
        "tcp_angular_acceleration": np.linalg.norm(acceleration[:, 3:], axis=1),
        "tcp_centripetal_acceleration": np.minimum(across[moving] / speed[moving], speed[moving] ** 2 / 1e-4),
        "tcp_linear_jerk": np.linalg.norm(jerk[:, :3], axis=1),
        "tcp_angular_jerk": np.linalg.norm(jerk[:, 3:], axis=1),
    }
    for quantity, limit in limits.items():
        loose = 1e-3 if quantity.endswith("jerk") else 1e-5
        assert found[quantity].max(initial=0.0) <= limit * (1.0 + loose) + 1e-6, quantity
