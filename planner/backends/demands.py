"""What limits demand of durations: the sampled ones, and the refusal where a duration is too short."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, InvalidProblem, LimitsUnsatisfiable, Remedy
from planner.kinematics.forward import tool_speeds

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.kinematics.poses import FloatArray
    from planner.limits import SegmentLimits
    from planner.paths import JointPath, Run
    from planner.robots import Robot

SAMPLED_MARGIN = 1.002
"""Durations set by sampled quantities (torque, tool speed) are longer by this, for what lies between samples."""


class SampledLimits:
    """Limits that no polynomial has: torque and tool speed, found on samples.

    Attributes:
        limited: (segments,), where there is any.
        causes: The limits there are: for a message, with a verb, and the joint's name if it is one of a joint.
    """

    def __init__(self, robot: Robot, limits: SegmentLimits) -> None:
        self.robot = robot
        self.linear, self.angular = limits.tcp_linear_velocity, limits.tcp_angular_velocity
        self.torque = limits.torque if robot.has_dynamics else np.full_like(limits.torque, np.inf)
        self.limited = np.isfinite(self.linear) | np.isfinite(self.angular) | np.isfinite(self.torque).any(axis=1)
        self.causes: list[tuple[str, str | None]] = [
            *((f"the torque limit of {name} asks", name) for name in robot.joint_names),
            ("the limit of the tool's speed asks", None),
            ("the limit of the tool's angular speed asks", None),
        ]

    def stretch(
        self,
        rows: np.ndarray,
        segments: np.ndarray,
        positions: FloatArray,
        velocities: FloatArray,
        accelerations: FloatArray,
    ) -> tuple[FloatArray, np.ndarray]:
        """(N,): factors on all times with which samples keep these limits, less than 1 where they could be faster.

        And (N,): index of the cause of each.

        Args:
            rows: (N,), of the limits.
            segments: (N,), indices for the refusal.
            positions: (N, joints), samples of the motion.
            velocities: (N, joints).
            accelerations: (N, joints).

        Raises:
            LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
        """
        linear, angular, torque = self.linear[rows], self.angular[rows], self.torque[rows]
        needed = np.zeros((len(rows), len(self.causes)))
        if np.isfinite(linear).any() or np.isfinite(angular).any():
            speeds = tool_speeds(self.robot, positions, velocities)
            needed[:, -2], needed[:, -1] = speeds[0] / linear, speeds[1] / angular
        if np.isfinite(torque).any():
            needed[:, :-2] = self._stretch_for_torque(torque, segments, positions, velocities, accelerations)
        return needed.max(axis=1) * SAMPLED_MARGIN, needed.argmax(axis=1)

    def _stretch_for_torque(
        self,
        limit: FloatArray,
        segments: np.ndarray,
        positions: FloatArray,
        velocities: FloatArray,
        accelerations: FloatArray,
    ) -> FloatArray:
        """(N, joints). With q(t / T) the torque is g(q) + b / T^2, b being the torque of T = 1 without gravity."""
        still = np.zeros_like(positions)
        gravity = inverse_dynamics(self.robot, positions, still, still)
        refuse_what_gravity_exceeds(self.robot, segments, gravity, limit)
        inertial = inverse_dynamics(self.robot, positions, velocities, accelerations) - gravity
        headroom = limit - np.sign(inertial) * gravity
        factors: FloatArray = np.sqrt(np.abs(inertial) / headroom)
        return factors


def largest_of_each(values: FloatArray, owners: np.ndarray) -> np.ndarray:
    """(owners,): index of the largest of the values (N,) of each owner (N,), from 0 on without gaps."""
    order = np.argsort(values, kind="stable")
    largest = np.empty(int(owners.max()) + 1, dtype=int)
    largest[owners[order]] = order  # the last one stays
    return largest


def refuse_what_gravity_exceeds(robot: Robot, segments: np.ndarray, gravity: FloatArray, limit: FloatArray) -> None:
    """No duration helps where standing still takes too much torque.

    Args:
        robot: With its payload.
        segments: (...,), index of each row.
        gravity: (..., joints), torques without motion.
        limit: (..., joints).

    Raises:
        LimitsUnsatisfiable: Gravity alone reaches a torque limit.
    """
    worst = np.unravel_index(np.argmax(np.abs(gravity) / limit), gravity.shape)
    if abs(gravity[worst]) >= limit[worst]:
        segment, joint = int(segments[worst[:-1]]), robot.joint_names[worst[-1]]
        raise LimitsUnsatisfiable(
            f"gravity alone asks {abs(gravity[worst]):.6g} of {joint} on segment {segment}, "
            f"its torque limit is {limit[worst]:.6g}",
            segment=segment,
            joint=joint,
            value=float(abs(gravity[worst])),
            limit=float(limit[worst]),
        )


def infeasible_duration(
    asked: float, too_short: Mapping[int, float], cause: str, joint: str | None
) -> InfeasibleDuration:
    """The refusal of durations.

    Args:
        asked: Duration of the first segment that is too short, s.
        too_short: By segment, the first at fault first: the duration that will do. To be applied together.
        cause: What asks for more, with a verb: "the velocity limit of joint_1 asks".
        joint: The joint at fault, if it is one.
    """
    segment, needed = next(iter(too_short.items()))
    return InfeasibleDuration(
        f"segment {segment} cannot be done in {asked:g} s: {cause} for {needed:.6g} s",
        waypoint=segment + 1,
        segment=segment,
        joint=joint,
        value=asked,
        limit=needed,
        remedies=[
            Remedy(
                f"/waypoints/{k + 1}/duration", seconds, "the shortest duration of this segment that keeps the limits"
            )
            for k, seconds in too_short.items()
        ],
    )


def nothing_limits(segment: int) -> LimitsUnsatisfiable:
    """The refusal where a duration is to be the shortest, and nothing sets it."""
    return LimitsUnsatisfiable(
        f"segment {segment} has neither a duration nor a velocity or acceleration limit that would set one",
        segment=segment,
        remedies=[Remedy(f"/waypoints/{segment + 1}/duration", 1.0, "any duration will do")],
    )


def duration_of_run(path: JointPath, run: Run) -> float:
    """The duration asked of a run as a whole, s; NaN: none.

    Raises:
        InvalidProblem: It is asked of one of several segments: this back end cannot say when it passes a waypoint.
    """
    asked = path.durations[run.segments]
    if len(asked) > 1 and not np.isnan(asked).all():
        message = "this back end cannot give a duration to a segment that is passed without stopping; leave it out"
        raise InvalidProblem([(f"/waypoints/{run.first + k + 1}/duration", message) for k in np.flatnonzero(asked > 0)])
    return float(asked[0])
