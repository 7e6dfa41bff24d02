"""Motions of least effort within the limits by nonlinear programming: joint motions, and time scalings of a path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from planner.backends.min_effort.optimum import OnCurve, Optimum, ThroughWaypoints
from planner.backends.min_effort.options import LEAST_DEVIATION, MinEffortOptions
from planner.backends.shared.assembly import assemble
from planner.errors import Fault, InvalidProblem, MissingDynamics
from planner.guarantees import ALL_HARD, Capabilities, Guarantee
from planner.paths import JointPath
from planner.trajectories.trajectory import PlanWarning, Trajectory

MOST_SEGMENTS = 100
"""Largest number of segments from stop to stop.

With six joints they take 0.5 s an iteration and 200 MB; 300 segments take more than 1 GB. Windows of a longer list
would need less memory, but as much time. Each segment takes 0.1 s until the optimum is found. So 300 segments take 30
s, more than the deadline of a request allows.
"""


@dataclass(frozen=True)
class MinEffort(MinEffortOptions):
    """The motion that minimises the integral of the sum of (torque / limit)^2, or another cost.

    Between joint waypoints each joint is a cubic B-spline in time (`program.py`) through the waypoints. It starts and
    ends at rest without acceleration. The geometry between the waypoints is free, and so are passing times without a
    request. Lines, circles and blends keep their path; the search finds its time scaling (`on_curve.py`).

    The search starts with the quintic of the same duration. Along a given path it starts with the fastest jerk-limited
    time scaling, stretched to that duration. The start is the answer if the search finds nothing better within the
    limits.

    Between two stops the tool stays within `max_deviation` of the straight joint motion, and each joint within
    `max_joint_deviation`. Without these options the motion of least torque may be far off, near the body or hanging
    down. If the motion passes waypoints, both deviations are measured from the quintic through them.

    A motion without a requested duration takes as long as the quintic, times `slowdown`. So back ends can be compared
    at equal durations. With `time_weight` the search finds the duration, too: it minimises
    cost + `time_weight` x duration.

    In a scene the optimum may collide although the first motion does not. Then half-spaces of the joint positions cut
    off the collisions, and the search repeats within them until its motion is free. If that fails, the motion stays
    nearer to the first one, or is the first one (`planner.plans.result.certified`).

    If accelerations of the tool are limited, there is no search between waypoints: the quintic is the answer, with a
    warning. Along a given path the time scaling keeps these limits. There is no search either for joints that turn tens
    of times between two stops, since the instants would miss changes of their torques.

    Efforts are relative to the robot's own torque limits, not to requested ones. A joint without a limit counts like
    the strongest one of its kind, turning or sliding. If no joint of a kind has a limit, the largest torque or force of
    the kind in the first motion stands in.

    If links have no masses, the payload alone causes torques, and many motions need none. Then the cost also has the
    integral of the sum of (jerk / limit)^2. Its weight makes both costs of the first motion equal. So the optimum has
    at most twice the first motion's integral of the jerk.
    """

    kind: ClassVar[str] = "min_effort"
    summary: ClassVar[str] = "The least torque within all limits, between waypoints on the way that takes least, C2."
    guarantees: ClassVar[Mapping[str, Guarantee]] = ALL_HARD
    capabilities: ClassVar[Capabilities] = Capabilities(
        leaves_straight_motions=True, is_shaped_by_duration=True, searches=True
    )

    def without_search(self) -> MinEffort:
        """Return the back end that takes the motion which the search begins with, if that keeps all limits."""
        return replace(self, iterations=0)

    def held_nearer(self, share: float) -> MinEffort:
        """Return the back end with its deviation from the first motion limited to this share."""
        tool, joints = self.max_deviation, self.max_joint_deviation
        tool = MinEffortOptions.max_deviation if tool is None and joints is None else tool
        held = [None if most is None else max(share * most, LEAST_DEVIATION) for most in (tool, joints)]
        return replace(self, max_deviation=held[0], max_joint_deviation=held[1])

    def parametrize(self, path: JointPath) -> Trajectory:
        """Return the motion of least cost of each group.

        Raises:
            InvalidProblem: More waypoints are passed between two stops than can be planned at once.
            MissingDynamics: The robot has neither inertias nor a payload.
            InfeasibleDuration: A segment's duration is shorter than its limits allow.
            LimitsUnsatisfiable: No duration keeps the limits.
        """
        known = (path.dynamics.robot_on(group.first).has_dynamics for group in path.every_group)
        if self.objective != "jerk" and not all(known):
            raise MissingDynamics(f"{path.robot.id} has no link inertias and carries no payload: its effort is unknown")
        _refuse_long_groups(path)
        optima: list[Optimum] = [
            (OnCurve if group.tool_motions or group.blended else ThroughWaypoints)(self, path, group)
            for group in path.every_group
        ]
        trajectory = assemble(path, [optimum.find() for optimum in optima])
        stopped = [int(optimum.group.first) for optimum in optima if not optimum.converged]
        warnings = []
        if any(optimum.cost.adds_jerk for optimum in optima):
            message = f"{path.robot.id} has links without masses: {self.objective} and jerk are minimised together"
            warnings.append(PlanWarning("effort_incomplete", message))
        if stopped:
            message = (
                "the search ended before it reached an optimum: the motion keeps all limits and costs no more "
                f"than the quintic (segments from {', '.join(map(str, stopped))} on)"
            )
            warnings.append(PlanWarning("suboptimal", message))
        return replace(trajectory, warnings=tuple(warnings)) if warnings else trajectory


def _refuse_long_groups(path: JointPath) -> None:
    """Refuse at once what would take more time and memory than there are.

    Raises:
        InvalidProblem: Too many waypoints are passed between two stops; the fault is at the first that is too many.
    """
    faults = [
        Fault(
            ("waypoints", int(group.segments[MOST_SEGMENTS]), "transition"),
            f"{MinEffort.kind} passes at most {MOST_SEGMENTS - 1} waypoints between two stops, and here are "
            f"{len(group.segments) - 1}: stop at this one, or choose another back end",
        )
        for group in path.every_group
        if len(group.segments) > MOST_SEGMENTS
    ]
    if faults:
        raise InvalidProblem(faults)
