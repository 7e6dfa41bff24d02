"""Segment groups of joint motions: waypoints are passed without stopping, and the ends may be in motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner.backends.jerk_limited.s_curves import s_curves, with_ramps
from planner.backends.ruckig.state_to_state import Rates, Synchronization
from planner.backends.ruckig.via_passages import pass_waypoints
from planner.backends.ruckig.via_problem import ViaMotion, ViaProblem
from planner.backends.shared.assembly import largest_speeds
from planner.backends.shared.straight_lines import NOTICED
from planner.constraints import Bounds
from planner.errors import InfeasibleDuration, JointPositionLimit, LimitsUnsatisfiable, Remedy
from planner.fields import BACK_END, FieldPath
from planner.guarantees import END_OPTIONS, JOINT_DERIVATIVES, EndStates
from planner.limits import SegmentLimits
from planner.paths import JointPath
from planner.spatial import FloatArray
from planner.time_scaling.refusals import BindingLimit, infeasible_duration_error, no_duration_error
from planner.time_scaling.uniform import TimeScaling, time_scalings
from planner.tolerances import DURATION_TOLERANCE, POSITION_TOLERANCE, ROUNDING
from planner.trajectories.polynomials import SegmentedPolynomial, joined

MOST_SLOWINGS = 10
"""Number of times that segments are slowed, at most, until they keep the limits of torque and tool speed."""

ENOUGH_SLOWINGS = 4
"""Number of times after which a motion is accepted that keeps them once it is stretched as a whole."""

SLOWING_EXCESS = 1.0 + 1e-4
"""Factor by which segments are slowed beyond their need, so that the search ends."""

MOST_DURATION_TRIALS = 4
"""Number of trials of longer durations before the durations of a motion with stops become the remedy."""

SURELY = 1.0 + 1e-6
"""Factor by which a duration offered as a remedy exceeds the duration found."""


def time_joint_group(
    path: JointPath, segments: np.ndarray, ends: EndStates, synchronization: Synchronization, enforced: frozenset[str]
) -> tuple[SegmentedPolynomial, bool]:
    """Find the fastest motion through the waypoints of joint motions, never slower than with stops.

    Args:
        path: The path, with limits and durations.
        segments: Indices (segments,) of segments that follow each other.
        ends: The motion at their ends.
        synchronization: How the joints are synchronised where there are no waypoints between.
        enforced: The quantities whose limits are kept.

    Returns:
        The motion, and whether torque or tool speed slowed it down.

    Raises:
        InfeasibleDuration: A requested duration is too short.
        JointPositionLimit: From the state at an end, a joint cannot stay within its position limits.
        LimitsUnsatisfiable: The state at an end breaks a limit, nothing limits a duration, or gravity exceeds a torque
            limit.
    """
    return _JointGroup(path, segments, ends, synchronization, enforced).time()


def least_stopping_time(travels: FloatArray, limits: SegmentLimits) -> float:
    """Return the least duration, s, of a motion with a stop at each waypoint, by the joints' own limits."""
    d, limits = np.abs(travels), limits.along(travels)
    with np.errstate(divide="ignore"):
        v, a, j = ((limits.bounds(quantity).upper / d).ravel() for quantity in JOINT_DERIVATIVES[1:])
        brakes = None if limits.acceleration.is_symmetric else (-limits.acceleration.lower / d).ravel()
    times = s_curves(v, a, j, brakes)[0].reshape(d.shape)
    return float(np.where(d > 0.0, times, 0.0).max(axis=1).sum())


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A motion that keeps its limits, but perhaps not the requested durations.

    Attributes:
        pieces: The motion.
        durations: Durations (segments,), s.
        shortest: Durations (segments,), s, of the segments without a request.
        motion: The motion before it was stretched.
        needed: The factor on time with which each segment just keeps its limits, by segment.
        slowed: Whether torque or tool speed take noticeably more time than the joints' own limits.
    """

    pieces: SegmentedPolynomial
    durations: FloatArray
    shortest: FloatArray
    motion: ViaMotion
    needed: dict[int, TimeScaling]
    slowed: bool


class _JointGroup:
    """A segment group of joint motions with the requested durations and end states."""

    def __init__(
        self,
        path: JointPath,
        segments: np.ndarray,
        ends: EndStates,
        synchronization: Synchronization,
        enforced: frozenset[str],
    ) -> None:
        self.path, self.segments, self.enforced = path, segments, enforced
        self.requested = path.durations[segments]
        start = Rates(ends.initial_velocity, ends.initial_acceleration)
        end = Rates(ends.final_velocity, np.zeros(path.robot.dof))
        own = path.limits.of(segments)
        self.of_speed = {constraint.name for constraint, _ in own.constraints if constraint.order == 1}
        positions = path.positions[np.append(segments, segments[-1] + 1)]
        rates = own.velocity.narrower, own.acceleration.narrower, own.jerk.narrower
        jerk = with_ramps(np.diff(positions, axis=0), *rates, self.requested)
        self.problem = ViaProblem(
            positions,
            replace(own, jerk=Bounds.of_magnitudes(jerk)),
            self.requested,
            start,
            end,
            synchronization if len(segments) == 1 else "time",
        )
        self.starts_moving, self.ends_moving = (any(r.any() for r in rates) for rates in (start, end))
        self.at_rest = not (self.starts_moving or self.ends_moving)

    def time(self) -> tuple[SegmentedPolynomial, bool]:
        """Return the pieces of the best candidate, and whether it was slowed down."""
        idle = np.flatnonzero(self.problem.least_times.max(axis=1) <= 0.0)
        if len(idle):
            raise no_duration_error(int(self.segments[idle[0]]))
        free = np.full(len(self.requested), np.nan)
        through = None
        if self.at_rest and len(self.segments) > 1 and np.isnan(self.requested).all():
            through = self._slowed(free, stopping=False)
            if through is not None and through.durations.sum() <= least_stopping_time(
                self.problem.travels, self.problem.limits
            ):
                return through.pieces, through.slowed
        stopping = self._stopping() if self.at_rest else self._slowed(free, stopping=True)
        stop_times = None if stopping is None else stopping.shortest
        if through is None and (len(self.segments) > 1 or not self.at_rest):
            through = self._slowed(self.requested, stopping=False, stop_times=stop_times)
        if stopping is not None and not self.at_rest:
            stopping = self._slowed(self.requested, stopping=True, stop_times=stop_times)
        candidates = [candidate for candidate in (stopping, through) if candidate is not None]
        feasible = [candidate for candidate in candidates if not self._too_short(candidate).any()]
        if feasible:
            best = min(feasible, key=lambda candidate: float(candidate.durations.sum()))
            return best.pieces, best.slowed
        if not candidates:
            raise self._leaves_limits()
        raise self._infeasible_error(candidates[-1], stop_times)

    def _too_short(self, candidate: _Candidate) -> np.ndarray:
        too_short: np.ndarray = candidate.durations > self.requested * (1.0 + DURATION_TOLERANCE)
        return too_short

    def _stopping(self) -> _Candidate | None:
        """Time each segment from rest to rest; a longer duration stretches it."""
        alone = replace(self.problem, requested=np.full(len(self.requested), np.nan))
        motion = pass_waypoints(alone, stopping=True)
        if motion is None:
            return None
        pieces = self._pieces(motion)
        needed = time_scalings(self.path, pieces, self.enforced)
        parts, durations = [], []
        for k, segment in enumerate(self.segments.tolist()):
            shortest = float(motion.durations[k] * needed[segment].factor)
            duration = max(shortest, self.requested[k]) if self.requested[k] > 0.0 else shortest
            if shortest * (1.0 - DURATION_TOLERANCE) <= self.requested[k] < shortest:
                duration = self.requested[k]
            own = pieces.of(pieces.segments == segment)
            parts.append(own.stretched(duration / float(own.lengths.sum())))
            durations.append(duration)
        factors = np.array([needed[segment].factor for segment in self.segments.tolist()])
        slowed = bool((factors > NOTICED).any())
        return _Candidate(joined(parts), np.array(durations), motion.durations * factors, motion, needed, slowed)

    def _slowed(
        self, requested: FloatArray, *, stopping: bool, stop_times: FloatArray | None = None
    ) -> _Candidate | None:
        """Narrow the joints' limits until torque and tool speed keep theirs, too; None: no motion is found."""
        slowness = np.ones(len(requested))
        if stop_times is not None:
            # Where there is more time than from rest to rest, a slow motion rather than a detour.
            slowness = np.fmax(1.0, requested / stop_times)
            if self.starts_moving:
                slowness[0] = 1.0
            if self.ends_moving:
                slowness[-1] = 1.0
        best: _Candidate | None = None
        speeds = np.full_like(self.problem.travels, np.inf)
        slowed = False
        for slowing in range(MOST_SLOWINGS):
            if best is not None and slowing >= ENOUGH_SLOWINGS:
                break
            problem = replace(self.problem, requested=requested, limits=self._slowed_limits(slowness, speeds))
            motion = pass_waypoints(problem, stopping=stopping)
            if motion is None or self._outside(motion) is not None:
                break
            pieces = self._pieces(motion)
            needed = time_scalings(self.path, pieces, self.enforced)
            factors = np.array([needed[segment].factor for segment in self.segments.tolist()])
            worst = float(factors.max())
            slowed = slowed or worst > NOTICED
            if worst <= 1.0 + DURATION_TOLERANCE:
                found = _Candidate(pieces, motion.durations, motion.durations, motion, needed, slowed)
                return found if best is None or found.durations.sum() < best.durations.sum() else best
            if self.at_rest and np.isnan(requested).all():
                total = motion.durations * worst
                whole = _Candidate(pieces.stretched(worst), total, total, motion, needed, slowed)
                best = whole if best is None or whole.durations.sum() < best.durations.sum() else best
                if worst <= SLOWING_EXCESS:
                    return best
            # The tool's speed takes slower joints, but no gentler ones; torque and its acceleration take both.
            limits = [needed[segment].binding.quantity for segment in self.segments.tolist()]
            by_tool = np.array([quantity in self.of_speed for quantity in limits])
            excess = np.maximum(factors * SLOWING_EXCESS, 1.0)
            slowness = slowness * np.where(by_tool, 1.0, excess)
            fastest = largest_speeds(pieces)
            fastest = np.array([fastest[pieces.segments == segment].max(axis=0) for segment in self.segments])
            # A joint at rest beside the others has nothing to slow; a speed limit of 0 would be none at all.
            slower = np.where(fastest > ROUNDING * fastest.max(), fastest / excess[:, None], np.inf)
            speeds = np.where((by_tool & (excess > 1.0))[:, None], np.minimum(speeds, slower), speeds)
        return best

    def _slowed_limits(self, slowness: FloatArray, speeds: FloatArray) -> SegmentLimits:
        """Narrow the limits by factors on time (segments,), and velocities to speeds (segments, joints).

        They remain wide enough for the motion at the ends.
        """
        limits, k = self.problem.limits, slowness[:, None]
        jerk = limits.jerk.divided_by(k**3)
        fastest, gains = np.zeros((2, *speeds.shape))
        for row, rates in ((0, self.problem.start), (-1, self.problem.end)):
            after = rates.velocity + rates.acceleration * np.abs(rates.acceleration) / (2.0 * jerk.upper[row])
            fastest[row] = np.maximum(np.abs(rates.velocity), np.abs(after)) * (1.0 + DURATION_TOLERANCE)
            gains[row] = np.abs(rates.acceleration)
        velocity, acceleration = limits.velocity.divided_by(k).within(speeds), limits.acceleration.divided_by(k**2)
        return replace(
            limits,
            velocity=velocity.at_least(fastest).within(limits.velocity),
            acceleration=acceleration.at_least(gains),
            jerk=jerk,
        )

    def _pieces(self, motion: ViaMotion) -> SegmentedPolynomial:
        return motion.pieces.of_segments(self.segments[motion.pieces.segments])

    def _outside(self, motion: ViaMotion) -> tuple[int, int, float, float] | None:
        """Segment (within the group), joint, position and limit, where a position limit is left the farthest."""
        lower, upper = self.problem.limits.position
        below, above = lower - motion.lowest, motion.highest - upper
        excess = np.maximum(below, above)
        k, joint = np.unravel_index(int(np.argmax(excess)), excess.shape)
        if excess[k, joint] <= POSITION_TOLERANCE:
            return None
        if above[k, joint] > below[k, joint]:
            return int(k), int(joint), float(motion.highest[k, joint]), float(upper[joint])
        return int(k), int(joint), float(motion.lowest[k, joint]), float(lower[joint])

    def _leaves_limits(self) -> JointPositionLimit | LimitsUnsatisfiable:
        """Return the refusal where the motion at the ends leaves no way, or none within the position limits."""
        motion = pass_waypoints(self.problem, stopping=True)
        beyond = None if motion is None else self._outside(motion)
        rates = (*self.problem.start, self.problem.end.velocity)
        fields: list[FieldPath] = [(BACK_END, option) for option in END_OPTIONS]
        for waypoint, options in ((int(self.segments[0]), (0, 1)), (int(self.segments[-1]) + 1, (2,))):
            if waypoint in self.path.passed_at:
                for option in options:
                    fields[option] = "waypoints", waypoint, "transition", "velocity"
        requested = [field for field, rate in zip(fields, rates, strict=True) if rate.any()]
        remedies = [Remedy(field, None, "none there") for field in requested]
        if beyond is None:
            message = "with the motion at the ends no other was found that keeps the torque and tool speed limits"
            return LimitsUnsatisfiable(message, segment=int(self.segments[0]), remedies=remedies)
        k, joint, value, limit = beyond
        name = self.path.robot.joint_names[joint]
        return JointPositionLimit(
            f"with the motion at the ends, {name} would pass its limit {limit:.6g} on segment {{segment}}",
            segment=int(self.segments[k]),
            joint=name,
            value=value,
            limit=limit,
            remedies=remedies,
        )

    def _infeasible_error(self, candidate: _Candidate, stop_times: FloatArray | None) -> InfeasibleDuration:
        """Return the refusal of requested durations, with longer ones as remedies that are found by trying them."""
        short = self._too_short(candidate)
        needed = self._longer_durations(candidate.durations, stop_times)
        first = int(np.flatnonzero(short)[0])
        segment = int(self.segments[first])
        if needed is None:
            given = np.flatnonzero(self.requested > 0.0)
            return InfeasibleDuration(
                "no motion within the limits was found with the requested durations around segment {segment}",
                waypoint=segment + 1,
                segment=segment,
                value=float(self.requested[first]),
                remedies=[
                    Remedy(("waypoints", k + 1, "duration"), None, "as fast as the limits allow")
                    for k in self.segments[given].tolist()
                ],
            )
        changed = np.flatnonzero(needed > self.requested)
        # The first that was too short may do as it is, once others are longer.
        first = first if first in changed else int(changed[0])
        segment = int(self.segments[first])
        longer = {int(self.segments[k]): float(needed[k]) for k in (first, *changed)}
        binding = candidate.needed[segment].binding
        if binding.joint is not None or candidate.needed[segment].factor <= 1.0:
            binding = BindingLimit(joint=self.path.robot.joint_names[int(candidate.motion.slowest[first])])
        return infeasible_duration_error(float(self.requested[first]), longer, binding)

    def _longer_durations(self, durations: FloatArray, stop_times: FloatArray | None) -> FloatArray | None:
        """Return durations (segments,) with which a motion exists: the requested ones, or longer."""
        needed = self.requested
        if len(self.requested) > 1 or not self.at_rest:
            for _ in range(MOST_DURATION_TRIALS):
                needed = np.where(durations > needed * (1.0 + DURATION_TOLERANCE), durations * SURELY, needed)
                tried = self._slowed(needed, stopping=False, stop_times=stop_times)
                if tried is None:
                    break
                durations = tried.durations
                if not (durations > needed * (1.0 + DURATION_TOLERANCE)).any():
                    return needed
        if stop_times is None or not self.at_rest:
            return None
        return np.where(stop_times > self.requested, stop_times, self.requested)
