"""Answers about the same request planned by several back ends."""

from __future__ import annotations

from api.contract.answers import PlanAnswer  # noqa: TC001
from api.contract.parts.common import Answer
from api.contract.parts.problem_documents import ProblemDocument  # noqa: TC001


class ComparedBackend(Answer):
    """The result of one back end."""

    backend: str
    """The kind of the back end."""
    status: str
    """`planned`, or the code of the problem document. What follows is null where it is not `planned`."""
    duration: float | None
    """The duration of the trajectory, s."""
    peak_jerk: float | None
    """The largest jerk of any joint, rad/s^3 or m/s^3; null: an acceleration jumps, so that the jerk has no bound."""
    jerk_is_bounded: bool | None
    """Whether no acceleration jumps, rest before and after included; false: the jerk has no bound."""
    rms_jerk: float | None
    """The root of the mean over time of the sum over joints of jerk^2, rad/s^3 or m/s^3; null: it has no bound."""
    effort: float | None
    """The integral over time of the sum over joints of (torque / limit)^2, s; null: torques are unknown or
    unlimited. A longer trajectory has more of it."""
    mean_effort: float | None
    """The effort by the duration, without unit, by which trajectories of different durations are compared; null: the
    effort is unknown."""
    mechanical_energy: float | None
    """The integral over time of the sum over joints of |torque times velocity|, J; null: torques are unknown."""
    peak_power: float | None
    """The largest magnitude of the mechanical power of all joints together, W, as a bound at all times; null: torques
    are unknown."""
    rms_torque: list[float] | None
    """The root of the mean over time of the squared torque of each joint, N m or N; null: torques are unknown."""
    waypoint_error: float | None
    """The largest distance of a joint from a waypoint that is to be met, rad or m."""
    path_deviation: float | None
    """The largest distance of the tool from the path that it takes when it stops at every waypoint, m."""
    trajectory: PlanAnswer | None
    """The plan, as POST /v1/trajectories answers it; null: there is none."""
    problem: ProblemDocument | None
    """Why there is no plan; null: there is one."""


class ComparisonAnswer(Answer):
    """The same waypoints through several back ends, in the requested order."""

    results: list[ComparedBackend]
    """The result of each back end."""
