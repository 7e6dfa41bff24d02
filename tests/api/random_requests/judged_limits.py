"""The judge of limits: by their definition, on dense samples of the polynomials that came back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from tests.api.random_requests.answered import Answered, segments
from tests.api.random_requests.poses import placement

if TYPE_CHECKING:
    from planner.robots import Robot
    from tests.api.random_requests.answered import Segment

STEP = 0.02
"""Share of a piece on either side of a sample over which accelerations of the tool are differenced."""

LONGEST_STEP = 1e-5
"""The longest time, s, that this is."""

SHARES = (0.0, 0.13, 0.37, 0.5, 0.71, 1.0)
"""Shares of each piece at which joints are sampled."""

ON_TOOL = 100
"""Number of random times at which the tool and the torques are sampled, at most."""


def bounds_of(robot: Robot, quantity: str, given: list[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper limit of each joint: the narrowest given limit times all scales."""
    lower, upper = -robot.bounds(quantity)[0], robot.bounds(quantity)[1]
    lower, upper = (np.minimum(side, robot.limit(quantity)) for side in (lower, upper))
    for limits in given:
        if (values := limits.get(quantity)) is not None:
            lower, upper = np.minimum(lower, values), np.minimum(upper, values)
        if (pairs := limits.get(f"{quantity}_range")) is not None:
            lower, upper = np.minimum(lower, -np.array(pairs)[:, 0]), np.minimum(upper, np.array(pairs)[:, 1])
    scale = np.prod([limits.get(f"{quantity}_scale", 1.0) for limits in given])
    return -lower * scale, upper * scale


def limits_hold(robot: Robot, request: dict[str, Any], answer: dict[str, Any], random: np.random.Generator) -> None:
    """Fail where an enforced limit is exceeded; the robot is mounted as in the request."""
    checks = {check["quantity"]: check for check in answer["certificate"]["checks"]}
    assert answer["certificate"]["satisfied"]
    enforced = {name for name, check in checks.items() if check["enforced"]}
    trajectory = Answered(answer["polynomials"])
    lengths = np.diff(trajectory.breakpoints)
    assert (lengths >= 0.0).all()
    middles = trajectory.breakpoints[:-1] + lengths / 2.0
    for segment in segments(request, answer):
        own = np.flatnonzero((middles > segment.first) & (middles < segment.last))
        if not len(own):
            continue
        pieces, share = np.repeat(own, len(SHARES)), np.tile(SHARES, len(own))
        values = trajectory.derivatives(pieces, share * lengths[pieces])
        _joints_hold(robot, values, enforced, segment)
        given = [name for name in enforced if any(name in limits for limits in segment.limits)]
        tool = {name: min(limits[name] for limits in segment.limits if name in limits) for name in given}
        tool = {name: limit for name, limit in tool.items() if name.startswith("tcp_")}
        pieces = random.choice(own, min(ON_TOOL, 4 * len(own)))
        since = random.random(len(pieces)) * lengths[pieces]
        if tool:
            _tool_holds(robot, segment.tool, trajectory, tool, pieces, since)
        if not enforced.isdisjoint({"torque", "power", "total_power"}):
            _torques_hold(robot, segment, trajectory.derivatives(pieces, since))


def _joints_hold(robot: Robot, values: list[np.ndarray], enforced: set[str], segment: Segment) -> None:
    if "position" in enforced:
        assert (values[0] >= robot.limit("lower") - 1e-6).all(), "position"
        assert (values[0] <= robot.limit("upper") + 1e-6).all(), "position"
    for order, quantity in enumerate(("velocity", "acceleration", "jerk"), 1):
        if quantity in enforced:
            low, high = bounds_of(robot, quantity, segment.limits)
            assert (values[order] <= high * (1.0 + 1e-6) + 1e-9).all(), quantity
            assert (values[order] >= low * (1.0 + 1e-6) - 1e-9).all(), quantity


def _torques_hold(robot: Robot, segment: Segment, values: list[np.ndarray]) -> None:
    """Check torques by Pinocchio's recursive Newton-Euler algorithm against limits, with attached objects."""
    model = robot.model.copy()
    if segment.payload:
        carried = segment.payload
        center, moments = (np.array(carried.get(name, [0.0] * 3)) for name in ("center_of_mass", "inertia"))
        tip = model.frames[robot.tip_frame_id]
        model.appendBodyToJoint(tip.parentJoint, pin.Inertia(carried["mass"], center, np.diag(moments)), tip.placement)
    data = model.createData()
    torques = np.array([pin.rnea(model, data, *row).copy() for row in zip(*values[:3], strict=True)])
    low, high = bounds_of(robot, "torque", segment.limits)
    assert (torques <= high * (1.0 + 1e-3) + 1e-6).all(), "torque"
    assert (torques >= low * (1.0 + 1e-3) - 1e-6).all(), "torque"
    powers, loose = torques * values[1], 1.0 + 1e-6
    for limits in segment.limits:
        assert (np.abs(powers) <= np.array(limits.get("power", [np.inf] * robot.dof)) * loose).all(), "power"
        assert np.abs(powers.sum(axis=1)).max() <= limits.get("total_power", np.inf) * loose, "total_power"


def _tool_holds(
    robot: Robot,
    tool: dict[str, Any] | None,
    trajectory: Answered,
    limits: dict[str, float],
    pieces: np.ndarray,
    since: np.ndarray,
) -> None:
    """Check the tool's motion by Pinocchio against limits; jerks are differences of accelerations."""
    data, axes = robot.model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    frame = robot.model.frames[robot.tool_frame_id if tool is None else robot.tip_frame_id]
    joint, where = frame.parentJoint, frame.placement * placement(tool)

    def motions(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return velocities and accelerations of the tool, linear over angular, each (N, 6)."""
        velocities, accelerations = [], []
        for q, v, a in zip(*trajectory.derivatives(pieces, times, 3), strict=True):
            pin.forwardKinematics(robot.model, data, q, v, a)
            velocities.append(pin.getFrameVelocity(robot.model, data, joint, where, axes).vector.copy())
            gain = pin.getFrameClassicalAcceleration(robot.model, data, joint, where, axes)
            accelerations.append(gain.vector.copy())
        return np.array(velocities), np.array(accelerations)

    velocity, acceleration = motions(since)
    speed = np.linalg.norm(velocity[:, :3], axis=1)
    across = np.linalg.norm(np.cross(velocity[:, :3], acceleration[:, :3]), axis=1)
    moving = speed > 1e-3
    found = {
        "tcp_linear_velocity": speed,
        "tcp_angular_velocity": np.linalg.norm(velocity[:, 3:], axis=1),
        "tcp_linear_acceleration": np.linalg.norm(acceleration[:, :3], axis=1),
        "tcp_angular_acceleration": np.linalg.norm(acceleration[:, 3:], axis=1),
        "tcp_centripetal_acceleration": np.minimum(across[moving] / speed[moving], speed[moving] ** 2 / 1e-4),
    }
    if any(name.endswith("jerk") for name in limits):
        step = np.minimum(STEP * np.diff(trajectory.breakpoints)[pieces], LONGEST_STEP)
        jerk = (motions(since + step)[1] - motions(since - step)[1]) / (2.0 * step[:, None])
        found["tcp_linear_jerk"] = np.linalg.norm(jerk[:, :3], axis=1)
        found["tcp_angular_jerk"] = np.linalg.norm(jerk[:, 3:], axis=1)
    for quantity, limit in limits.items():
        loose = 1e-3 if quantity.endswith("jerk") else 1e-5
        assert found[quantity].max(initial=0.0) <= limit * (1.0 + loose) + 1e-6, quantity
