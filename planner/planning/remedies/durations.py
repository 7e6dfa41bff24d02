"""Remedies for a requested duration that is too short: a longer one, higher limits, a lighter payload."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from planner.backends.base import enforced
from planner.backends.shared.assembly import sampled
from planner.constraints.peaks import SampledConstraints
from planner.dynamics import SegmentDynamics, inverse_dynamics
from planner.errors import InfeasibleDuration, Remedy
from planner.fields import FieldPath
from planner.guarantees import JOINT_DERIVATIVES
from planner.limits import Limits, SegmentLimits
from planner.paths import JointPath
from planner.planning.attempts import Attempt, Planned, Proposals, Refused
from planner.planning.proofs import Change, first_proved, of_plan, plan_with
from planner.planning.remedies.higher_limits import Needs, higher_limits, lighter_payload, limit_of
from planner.plans.result import Plan
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.timing.durations import durations_sharing, minimum_durations
from planner.trajectories.extrema import derivatives_on_unit_time, largest_magnitudes
from planner.trajectories.polynomials import SegmentedPolynomial
from planner.trajectories.trajectory import Trajectory

LIMIT_SHARES = (1.0 - 1e-9, 0.995, 0.95)
"""Shares of the limits that the motion may take; the first is offered with which the back end finds a motion."""

PIECE_SAMPLES = 65
"""The number of samples of torque and tool speeds on each piece."""

SCALE_BISECTIONS = 4
"""Number of times that a change of limits that suffices is halved, in search of the smallest."""

LIMITS_EXPLAINED = "wide enough for the requested durations, together with any other change of a limit"
"""The explanation of a higher limit, for a person."""

PAYLOAD_EXPLAINED = "the heaviest payload, kg, for which the requested durations suffice"
"""The explanation of a lighter payload, for a person."""


def duration_remedies(refused: Refused, refusal: InfeasibleDuration) -> Proposals[list[Remedy]]:
    """Find longer durations, and higher limits or a lighter payload if the request's limits or payload are the cause.

    The motion with the longer durations, played faster, fulfils the request except its limits. Its need of the limits
    is the smallest change for a time scaling of fixed shape, and a sufficient change for every other.
    """
    attempt, path = refused.attempt, refused.attempt.solved
    longer = yield from _longer_durations(attempt, refusal)
    if longer is None:
        return []
    remedies, plan = longer
    if any(remedy.field[-1] == "latest_arrival" for remedy in remedies):
        return remedies  # what has to be faster for it is not known
    if len(plan.problem.waypoints) != len(attempt.with_detours.waypoints):
        return remedies  # with these durations another detour was found: it does not tell what this one needs
    limits, durations = path.limits, path.durations
    duration = attempt.problem.duration
    if duration is not None:
        durations = durations_sharing(path, plan.trajectory, duration, minimum_durations(attempt.with_detours))
        if (durations[path.moving] <= 0.0).any():
            return remedies  # the requested durations leave no time: no limits are high enough for that
    faster, kept = _faster(plan.trajectory, path, durations), enforced(attempt.backend)
    needs = faster.needs(limits, kept)
    enough = yield from _higher_limits(attempt, limits, needs)
    if not enough:
        own = yield from _within_own_limits(attempt)
        enough = [] if own is None else (yield from _higher_limits(attempt, limits, own.needs(limits, kept)))
    remedies += enough
    if {quantity for quantity, *_ in needs} == {"torque"}:
        remedies += yield from first_proved(_lighter_payload(attempt, limits, faster), attempt)
    return remedies


def _longer_durations(attempt: Attempt, refusal: InfeasibleDuration) -> Proposals[tuple[list[Remedy], Plan] | None]:
    """Lengthen durations as back ends propose until a plan exists; if that fails, request no duration."""
    requested = [k for k, waypoint in enumerate(attempt.problem.waypoints) if waypoint.duration is not None]
    longer: dict[FieldPath, Remedy] = {}
    while True:
        named = {remedy.field: remedy for remedy in refusal.remedies}
        if not named.keys() - longer.keys():
            break
        longer |= named
        outcome = yield from plan_with(longer.values(), attempt)
        if isinstance(outcome, Planned):
            return of_plan(longer.values(), outcome.plan), outcome.plan
        if not isinstance(outcome.refusal, InfeasibleDuration):
            break
        refusal = outcome.refusal
    for left_out in (list(longer), [_duration(k) for k in requested]):
        free = [Remedy(field, None, "as fast as the limits allow") for field in left_out]
        outcome = yield from plan_with(free, attempt)
        if isinstance(outcome, Planned):
            return of_plan(free, outcome.plan), outcome.plan
    return None


def _duration(waypoint: int) -> FieldPath:
    return "waypoints", waypoint, "duration"


@dataclass(frozen=True, eq=False)
class _Motion:
    """Pieces of a trajectory of a robot."""

    dynamics: SegmentDynamics
    pieces: SegmentedPolynomial

    def needs(self, limits: SegmentLimits, kept: frozenset[str]) -> Needs:
        """Find the limits that the motion exceeds, and the excess."""
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
        sampled = SampledConstraints(self.dynamics, limits.constraints, len(limits.torque.upper))
        if sampled.constraints:
            values = np.abs(sampled.values(self.segments(), self.samples())[0])
            most = values.reshape(-1, PIECE_SAMPLES, len(sampled.joints)).max(axis=1)
            for k, name, column in zip(sampled.of_column.tolist(), sampled.joints, most.T, strict=True):
                joint = 0 if name is None else robot.joint_names.index(name)
                note(sampled.constraints[k].name, segment_of, joint, column)
        return needs

    def samples(self) -> tuple[FloatArray, ...]:
        """Return positions, velocities, accelerations and jerks, each (pieces x SAMPLES, joints)."""
        return sampled(self.pieces, PIECE_SAMPLES)

    def segments(self) -> np.ndarray:
        """Return the segment (pieces x SAMPLES,) of each sample."""
        return np.repeat(self.pieces.segments, PIECE_SAMPLES)

    def torques(self, robot: Robot, rows: np.ndarray) -> FloatArray:
        """Return the torques (rows, joints), N m or N, at samples given by their mask (pieces x SAMPLES,)."""
        return inverse_dynamics(robot, *(values[rows] for values in self.samples()[:3]))


def _faster(trajectory: Trajectory, path: JointPath, durations: FloatArray) -> _Motion:
    """Speed up the segments of a trajectory that take longer than their requested time."""
    took = trajectory.arrivals[1:] - trajectory.departures[:-1]
    ratio = np.where(durations < took, durations / took, 1.0)[trajectory.segments]
    own = ratio < 1.0
    return _Motion(path.dynamics, trajectory.of(own).stretched(ratio[own]))


def _within_own_limits(attempt: Attempt) -> Proposals[_Motion | None]:
    """Plan the requested motion without the requested limits; None: the robot's own are too narrow."""
    waypoints = tuple(replace(waypoint, limits=None) for waypoint in attempt.problem.waypoints)
    problem = replace(attempt.problem, limits=Limits(), waypoints=waypoints)
    outcome = yield from plan_with([], Attempt(problem, attempt.backend))
    if isinstance(outcome, Refused) or len(outcome.plan.path.durations) != len(attempt.solved.durations):
        return None
    return _Motion(outcome.plan.path.dynamics, outcome.plan.trajectory)


def _higher_limits(attempt: Attempt, limits: SegmentLimits, needs: Needs) -> Proposals[list[Remedy]]:
    """Raise limits as a motion needs, if that suffices, and by less if less suffices, too."""
    enough = yield from first_proved(higher_limits(attempt, needs, LIMIT_SHARES, LIMITS_EXPLAINED), attempt)
    too_little, sufficient = 0.0, 1.0
    for _ in range(SCALE_BISECTIONS if enough else 0):
        part = (too_little + sufficient) / 2.0
        less = {key: part * value + (1.0 - part) * limit_of(limits, *key) for key, value in needs.items()}
        smaller = yield from first_proved(higher_limits(attempt, less, (1.0,), LIMITS_EXPLAINED), attempt)
        if smaller:
            enough, sufficient = smaller, part
        else:
            too_little = part
    return enough


def _lighter_payload(attempt: Attempt, limits: SegmentLimits, motion: _Motion) -> Iterator[Change]:
    segments = motion.segments()
    limit = limits.torque.narrower[segments]
    return lighter_payload(attempt.with_detours, motion.torques, segments, limit, LIMIT_SHARES, PAYLOAD_EXPLAINED)
