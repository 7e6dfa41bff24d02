"""What helps where an asked duration is too short: a longer one, higher limits, a lighter payload."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.base import enforced
from planner.backends.shared.assembly import sampled
from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, PlanningError, Remedy
from planner.guarantees import JOINT_DERIVATIVES
from planner.kinematics.forward import tool_rates_on
from planner.limits import Limits
from planner.planning.remedies.higher_limits import higher_limits, limit_of
from planner.planning.remedies.lighter_payload import lighter_payload
from planner.planning.remedies.proved import first_proved, of_plan, plan_with
from planner.timing.durations import durations_sharing, minimum_durations
from planner.trajectories.extrema import derivatives_on_unit_time, largest_magnitudes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.backends.base import BackEnd
    from planner.dynamics import SegmentDynamics
    from planner.fields import FieldPath
    from planner.limits import SegmentLimits
    from planner.paths import JointPath
    from planner.planning.remedies.higher_limits import Change, Needs
    from planner.plans.result import Plan
    from planner.problems.problem import PlanningProblem
    from planner.robots import Robot
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import SegmentedPolynomial
    from planner.trajectories.trajectory import Trajectory

SHARES = (1.0 - 1e-9, 0.995, 0.95)
"""Shares of the limits that the motion may take; the first is offered with which the back end finds a motion."""

SAMPLES = 65
"""The number of samples of torque and tool speeds on each piece."""

HALVINGS = 4
"""Number of times that a change of limits that suffices is halved, in search of the smallest."""

LIMITS_EXPLAINED = "wide enough for the asked durations, together with any other change of a limit"
"""The explanation of a higher limit, for a person."""

PAYLOAD_EXPLAINED = "the heaviest payload, kg, with which the asked durations are long enough"
"""The explanation of a lighter payload, for a person."""


def duration_remedies(
    refusal: InfeasibleDuration, problem: PlanningProblem, backend: BackEnd, path: JointPath
) -> list[Remedy]:
    """Longer durations; and if limits asked by the request or its payload are what stands against it, these.

    The motion with the longer durations, played faster, does what is asked but for the limits: what it needs of them
    is the smallest change for a law of fixed shape, and a sufficient one for every other.
    """
    longer = _longer_durations(refusal, problem, backend)
    if longer is None:
        return []
    remedies, plan = longer
    limits, kept = path.limits, enforced(backend)
    durations = path.durations
    if problem.duration is not None:
        durations = durations_sharing(path, plan.trajectory, problem.duration, minimum_durations(problem))
        if (durations[path.moving] <= 0.0).any():
            return remedies  # the durations asked leave no time: no limits are high enough for that
    faster = _faster(plan.trajectory, path, durations)
    needs = faster.needs(limits, kept)
    others = (motion.needs(limits, kept) for motion in _within_own_limits(problem, backend))
    remedies += _higher_limits(problem, limits, chain([needs], others), backend)
    if {quantity for quantity, *_ in needs} == {"torque"}:
        remedies += first_proved(_lighter_payload(problem, limits, faster), problem, backend)
    return remedies


def _longer_durations(
    refusal: InfeasibleDuration, problem: PlanningProblem, backend: BackEnd
) -> tuple[list[Remedy], Plan] | None:
    """Return the durations that back ends name, until there is a plan; where they do not help, none asked."""
    asked = [k for k, waypoint in enumerate(problem.waypoints) if waypoint.duration is not None]
    longer: dict[FieldPath, Remedy] = {}
    while True:
        named = {remedy.field: remedy for remedy in refusal.remedies}
        if not named.keys() - longer.keys():
            break
        longer |= named
        try:
            made = plan_with(longer.values(), problem, backend)
        except InfeasibleDuration as another:
            refusal = another
        except PlanningError:
            break
        else:
            return of_plan(longer.values(), made), made
    for left_out in (list(longer), [_duration(k) for k in asked]):
        free = [Remedy(field, None, "as fast as the limits allow") for field in left_out]
        try:
            made = plan_with(free, problem, backend)
        except PlanningError:
            continue
        return of_plan(free, made), made
    return None


def _duration(waypoint: int) -> FieldPath:
    return "waypoints", waypoint, "duration"


@dataclass(frozen=True, eq=False)
class _Motion:
    """Pieces of a trajectory of a robot."""

    dynamics: SegmentDynamics
    pieces: SegmentedPolynomial

    def needs(self, limits: SegmentLimits, kept: frozenset[str]) -> Needs:
        """Find what the motion needs of the kept limits, where that is more than they are."""
        needs: Needs = {}
        if not len(self.pieces.lengths):
            return needs
        segment_of = self.pieces.segments
        segments, groups = np.unique(segment_of, return_inverse=True)

        def note(quantity: str, segments: np.ndarray, joint: int, values: FloatArray) -> None:
            for segment, value in zip(segments.tolist(), np.abs(values).tolist(), strict=True):
                key = quantity, segment, joint
                if quantity in kept and value > limit_of(limits, *key):
                    needs[key] = max(value, needs.get(key, 0.0))

        derivatives = derivatives_on_unit_time(self.pieces, len(JOINT_DERIVATIVES))
        robot = self.dynamics.robots[0]
        for order, quantity in list(enumerate(JOINT_DERIVATIVES))[1:]:
            for joint in range(robot.dof):
                only = np.full((len(groups), robot.dof), np.inf)
                only[:, joint] = 1.0
                note(quantity, segments, joint, largest_magnitudes(derivatives[order], only, groups).values)
        sampled = {}
        if self.dynamics.has_dynamics and np.isfinite(limits.torque.upper).any():
            sampled["torque"] = np.abs(self.dynamics.torques(self.segments(), *self.samples()[:3]))
        if limits.of_tool:
            sampled |= tool_rates_on(self.dynamics, self.segments(), limits.of_tool, *self.samples())
        for quantity, values in sampled.items():
            for joint, column in enumerate(values.reshape(len(segment_of) * SAMPLES, -1).T):
                note(quantity, segment_of, joint, column.reshape(-1, SAMPLES).max(axis=1))
        return needs

    def samples(self) -> tuple[FloatArray, ...]:
        """Positions, velocities, accelerations and jerks, each (pieces x SAMPLES, joints)."""
        return sampled(self.pieces, SAMPLES)

    def segments(self) -> np.ndarray:
        """Return the segment (pieces x SAMPLES,) of each sample."""
        return np.repeat(self.pieces.segments, SAMPLES)

    def torques(self, robot: Robot, rows: np.ndarray) -> FloatArray:
        """Return the torques (rows, joints), N m or N, at samples given by their mask (pieces x SAMPLES,)."""
        return inverse_dynamics(robot, *(values[rows] for values in self.samples()[:3]))


def _faster(trajectory: Trajectory, path: JointPath, durations: FloatArray) -> _Motion:
    """Return the segments of a trajectory that take longer than asked, played in the time that is asked."""
    took = trajectory.arrivals[1:] - trajectory.departures[:-1]
    ratio = np.where(durations < took, durations / took, 1.0)[trajectory.segments]
    own = ratio < 1.0
    return _Motion(path.dynamics, trajectory.of(own).stretched(ratio[own]))


def _within_own_limits(problem: PlanningProblem, backend: BackEnd) -> Iterator[_Motion]:
    """Return the motion that is asked, but for the limits asked; none where the robot's own are too narrow for it."""
    waypoints = tuple(replace(waypoint, limits=None) for waypoint in problem.waypoints)
    try:
        plan = plan_with([], replace(problem, limits=Limits(), waypoints=waypoints), backend)
    except PlanningError:
        return
    yield _Motion(plan.path.dynamics, plan.trajectory)


def _higher_limits(
    problem: PlanningProblem, limits: SegmentLimits, needs: Iterable[Needs], backend: BackEnd
) -> list[Remedy]:
    """Raise limits as the first of some motions needs for which that suffices, and by less if less suffices, too."""
    for all_of_it in needs:
        changes = higher_limits(problem, all_of_it, SHARES, LIMITS_EXPLAINED)
        enough = first_proved(changes, problem, backend)
        if not enough:
            continue
        too_little, sufficient = 0.0, 1.0
        for _ in range(HALVINGS):
            part = (too_little + sufficient) / 2.0
            less = {key: part * value + (1.0 - part) * limit_of(limits, *key) for key, value in all_of_it.items()}
            changes = higher_limits(problem, less, (1.0,), LIMITS_EXPLAINED)
            if smaller := first_proved(changes, problem, backend):
                enough, sufficient = smaller, part
            else:
                too_little = part
        return enough
    return []


def _lighter_payload(problem: PlanningProblem, limits: SegmentLimits, motion: _Motion) -> Iterator[Change]:
    segments = motion.segments()
    limit = limits.torque.narrower[segments]
    return lighter_payload(problem, motion.torques, segments, limit, SHARES, PAYLOAD_EXPLAINED)
