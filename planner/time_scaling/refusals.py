"""What back ends refuse: durations that are too short, limits that nothing keeps, and durations that nothing sets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planner.constraints.quantities import NAMED
from planner.dynamics import SegmentDynamics
from planner.errors import InfeasibleDuration, InvalidProblem, LimitsUnsatisfiable, Remedy
from planner.paths import JointPath, SegmentGroup
from planner.spatial import FloatArray

RAMPS = "ramps"
"""The quantity of a `BindingLimit` that is no limit but given times of acceleration and deceleration."""


class BindingLimit(NamedTuple):
    """The limit that sets the shortest duration.

    Attributes:
        quantity: One of `QUANTITIES`, or `RAMPS`; None: all limits of the joint together, or nothing without a joint.
        joint: Name of the joint; None: the limit is not one of a joint.
    """

    quantity: str | None = None
    joint: str | None = None

    @property
    def named(self) -> str:
        """The name of the limit in a sentence."""
        match self.quantity:
            case _ if self.quantity == RAMPS:
                return "the acceleration and deceleration times"
            case None:
                return f"the limits of {self.joint}"
            case quantity if self.joint is not None:
                return f"the {NAMED.get(quantity, quantity)} limit of {self.joint}"
            case quantity:
                return f"the limit of {NAMED.get(quantity) or quantity.replace('_', ' ')}"


def infeasible_duration_error(
    requested: float, too_short: Mapping[int, float], binding: BindingLimit
) -> InfeasibleDuration:
    """Build the refusal of durations that are too short.

    Args:
        requested: The requested duration of the first segment with too short a duration, s.
        too_short: Durations, s, that will do if applied together, by segment, the first one at fault first.
        binding: The limit that takes more time.
    """
    segment, needed = next(iter(too_short.items()))
    return InfeasibleDuration(
        f"segment {{segment}} cannot be done in {requested:g} s: within {binding.named} it takes {needed:.6g} s",
        waypoint=segment + 1,
        segment=segment,
        joint=binding.joint,
        value=requested,
        limit=needed,
        remedies=[
            Remedy(
                ("waypoints", k + 1, "duration"), seconds, "the shortest duration of this segment that keeps the limits"
            )
            for k, seconds in too_short.items()
        ],
    )


def no_duration_error(segment: int) -> LimitsUnsatisfiable:
    """Return the error where a duration is to be the shortest, and nothing sets it."""
    return LimitsUnsatisfiable(
        "segment {segment} has neither a duration nor a velocity or acceleration limit that would set one",
        segment=segment,
        remedies=[Remedy(("waypoints", segment + 1, "duration"), 1.0, "any duration will do")],
    )


def ramps_error(binding: BindingLimit) -> LimitsUnsatisfiable:
    """Return error where given times of acceleration and deceleration break a limit at every duration that is tried."""
    return LimitsUnsatisfiable(f"no duration was found with which these ramps keep {binding.named}")


def refuse_what_gravity_exceeds(
    dynamics: SegmentDynamics, segments: np.ndarray, gravity: FloatArray, middle: FloatArray, half: FloatArray
) -> None:
    """Refuse a path on which standing still takes too much torque, which no duration helps.

    Args:
        dynamics: The robot on each segment.
        segments: Index (...,) of the segment of each row.
        gravity: Torques (..., rows) without motion, N m or N; each joint has as many rows.
        middle: The middle (..., rows) between the lower and the upper torque limits, N m or N.
        half: Their distance (..., rows) from there.

    Raises:
        LimitsUnsatisfiable: Gravity alone reaches a torque limit.
    """
    beyond = gravity - middle
    worst = np.unravel_index(np.argmax(np.abs(beyond) / half), gravity.shape)
    if abs(beyond[worst]) >= half[worst]:
        limit = abs(middle[worst] + np.copysign(half[worst], beyond[worst]))
        segment = int(segments[worst[:-1]])
        robot = dynamics.robot_on(segment)
        number = int(worst[-1]) * robot.dof // gravity.shape[-1]
        joint, unit = robot.joint_names[number], "N m" if robot.is_angle[number] else "N"
        others = ["the process force"] * (robot.process_force is not None) + ["friction"] * any(
            own.friction or own.damping for own in robot.joints
        )
        standing = f"gravity with {' and '.join(others)}" if others else "gravity alone"
        within = ["the tolerances of the payload"] * bool(robot.uncertain_payloads)
        within += ["the tolerances of friction"] * (robot.friction_tolerance is not None)
        within += ["the following errors"] * (robot.following_errors is not None)
        if within:
            standing += f", within {' and '.join(within)},"
        raise LimitsUnsatisfiable(
            f"{standing} requires {abs(gravity[worst]):.6g} {unit} of {joint} on segment {{segment}}; "
            f"its torque limit is {limit:.6g} {unit}",
            segment=segment,
            joint=joint,
            value=float(abs(gravity[worst])),
            limit=float(limit),
        )


def duration_of_group(path: JointPath, group: SegmentGroup) -> float:
    """Return the requested duration of a segment group as a whole, s; NaN: none.

    Raises:
        InvalidProblem: Only one of several segments has a duration; this back end cannot set the times of passed
            waypoints.
    """
    requested = path.durations[group.segments]
    if len(requested) > 1 and not np.isnan(requested).all():
        message = "this back end cannot give a duration to a segment that is passed without stopping; leave it out"
        raise InvalidProblem(
            [(("waypoints", k + 1, "duration"), message) for k in group.segments[requested > 0].tolist()]
        )
    return float(requested[0])
