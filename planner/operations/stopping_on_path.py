"""The fastest stop of a trajectory on its own path.

The stop is q(s(t)). q is the given trajectory; s is its own time, whose rate s' falls from 1 to 0. With sigma = s', a
joint has these rates and torques:

    - velocity      q' sigma
    - acceleration  q'' sigma^2 + q' sigma'
    - jerk          q''' sigma^3 + 3 q'' sigma sigma' + q' sigma''
    - torque        M(q) q' sigma' + h(q, q', q'') sigma^2 + gravity(q)

A candidate time scaling ends at rest in a given distance, and begins with the trajectory's own acceleration times
sigma^2. The solver of `planner.time_scaling.retiming` finds the one with the highest sigma at the start. The result
uses the shortest distance for which this sigma is at least 1: then the stop can begin at the trajectory's own speed.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from planner.certificate import certify
from planner.constraints.rows import INSCRIBED
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.guarantees import JOINT_DERIVATIVES, QUANTITIES, EndStates
from planner.kernels.retiming import Objective
from planner.limits import Limits, SegmentLimits, segment_limits
from planner.operations.certified import (
    CertifiedTrajectory,
    JointState,
    bounded_quantities,
    certified,
    refuse_other_joints,
)
from planner.operations.editing import slice_of
from planner.operations.stopping import Braking, Phase, fastest_stop, joined_phases
from planner.paths.segment_groups import JOINT_TOLERANCE
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.time_scaling.compose import compose, split_at_knots
from planner.time_scaling.fastest import retimed
from planner.time_scaling.limits_on_curve import LimitsOnCurve
from planner.time_scaling.linear_limits import GRIDPOINTS
from planner.time_scaling.retiming import best_retiming, of_duration
from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial, horner
from planner.trajectories.trajectory import PlanWarning, Trajectory

OFF_LINE = 1e-9
"""Distance from the straight line, rad or m, or share of an acceleration across it, that counts as rounding."""

PROGRESS_SHARES = np.linspace(0.0, 1.0, 9)
"""Fractions of the duration of a piece at which the trajectory's progress along the line is measured."""


def stop_on_line(
    state: JointState, trajectory: Trajectory, limits: SegmentLimits, *, limits_jerk: bool
) -> Trajectory | None:
    """Find the fastest synchronous stop on a straight line; None: the trajectory leaves the line before.

    Args:
        state: The state in which the stop begins.
        trajectory: What would follow from there on; it ends the line that the stop may use.
        limits: Limits in force, of which the joints' accelerations and jerks count.
        limits_jerk: Whether jerks are limited.
    """
    speed = float(np.linalg.norm(state.velocity))
    if speed == 0.0:
        return None
    direction = state.velocity / speed
    along = float(state.acceleration @ direction)
    if np.abs(state.acceleration - along * direction).max() > OFF_LINE * max(1.0, abs(along)):
        return None
    with np.errstate(divide="ignore", over="ignore"):
        most, jerk = (float((own.narrower[0] / np.abs(direction)).min()) for own in (limits.acceleration, limits.jerk))
    jerk = jerk if limits_jerk else np.inf
    if not np.isfinite(most):
        return None
    phases = fastest_stop((0.0, speed, along), Braking(most, jerk))
    ends = [phase.at(phase.duration) for phase in phases]
    if not phases or min(velocity for _, velocity, _ in ends) < -OFF_LINE * speed:
        return None
    if not _follows(trajectory, state.position, direction, ends[-1][0]):
        return None
    motions = [
        [
            Phase(phase.duration, start + part * phase.position, *(part * value for value in phase[2:]))
            for phase in phases
        ]
        if part != 0.0
        else []
        for start, part in zip(state.position.tolist(), direction.tolist(), strict=True)
    ]
    return joined_phases(state.position, motions)


def _follows(trajectory: Trajectory, start: FloatArray, direction: FloatArray, way: float) -> bool:
    """Tell whether a trajectory keeps to the line from a position (joints,) on for so far, rad or m."""
    for length, coefficients in zip(trajectory.lengths.tolist(), trajectory.coefficients, strict=True):
        powers = coefficients * length ** np.arange(coefficients.shape[1])
        powers[:, 0] -= start
        along = direction @ powers
        if np.abs(powers - np.outer(direction, along)).max() > OFF_LINE:
            return False
        if (PROGRESS_SHARES[:, None] ** np.arange(len(along)) @ along).max() >= way - OFF_LINE:
            return True
    return False


FIRST = 0.1
"""Share of the rest of the path in which a stop is tried first."""

LEAST_STOP_PIECES = 48
"""Number of pieces of the time scaling of a stop, at least."""

MOST_STOP_DISTANCES = 16
"""Number of distances in which a stop is tried, at most."""

STOP_DISTANCE_RATIO = 1.01
"""Ratio up to which the distance that is taken exceeds one that is too short."""

STOP_DURATION_WEIGHT = 0.5
"""Weight of the duration beside the speed at the start: of stops in the same distance the quicker one is found."""

STOP_SPEED_GAP = 1e-3
"""Relative gap to the highest speed that may be left."""

FREE = 0.25
"""Share of the stop over which half of the margin grows from nothing where the trajectory uses all of a limit."""

MARGINS = (1e-3, 1e-2, 5e-2)
"""Fractions of the limits reserved for peaks between the probes, tried in turn until the certificate accepts the
result.

A place always allows the share of a limit that the trajectory itself uses there. At first it is all of it, later all
except half of this fraction. The trajectory may use a whole limit when the stop begins. Its polygon of the tool's
acceleration counts slightly more.
"""

TOLERANCE = 1e-3 * JOINT_TOLERANCE
"""Distance of a joint from its path, rad or m, that timing may leave: its third derivative is to be exact, too."""


def stop_on_path(
    robot: Robot,
    trajectory: Trajectory,
    time: float,
    *,
    limits: Limits = Limits(),
    enforced: Collection[str] | None = None,
) -> CertifiedTrajectory:
    """Stop a trajectory on its own path, as fast as the limits allow; on curved paths, to some percent.

    The result begins in the trajectory's state at that time. If no faster stop is found, the result is the rest of the
    trajectory, with the warning `stops_at_the_end`. This happens if one joint after the other uses its whole jerk
    limit, as in time-optimal motions with one profile for each joint. Such a trajectory leaves hardly any reserve for
    braking on the path. A payload above the robot's rating is a warning, since the robot already moves.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        trajectory: A trajectory of any origin.
        time: When the stop begins, s.
        limits: Additional limits, no wider than the robot's.
        enforced: The quantities of `QUANTITIES` with enforced limits; None: every quantity that the trajectory bounds.

    Raises:
        InvalidProblem: The time is not within the trajectory; or as for `reverse_trajectory`.
        LimitsUnsatisfiable: No stop within the limits is found before the end of the trajectory, or nothing that is
            kept limits how fast it stops.
    """
    refuse_other_joints(robot, [trajectory])
    if not 0.0 <= time < trajectory.duration:
        message = f"{time:g} s is not within the trajectory, which takes {trajectory.duration:g} s"
        raise InvalidProblem([(("time",), message)])
    kept = bounded_quantities([trajectory]) if enforced is None else frozenset(enforced)
    rest = slice_of(trajectory, time)
    own = segment_limits(robot, limits, (None,))
    v, a = rest.evaluate(0.0, [1, 2])
    ends = EndStates(v, a, np.zeros(robot.dof))
    state = JointState(*(values[0] for values in rest.evaluate(np.zeros(1), [0, 1, 2])))
    line = stop_on_line(state, rest, own, limits_jerk="jerk" in kept)
    if line is not None and certify(robot, line, limits=limits, enforced=kept, ends=ends).satisfied:
        return certified(robot, line, limits, kept, ends=ends, is_stop=True)
    for margin in MARGINS:
        stop = _shortest(robot, rest, own, kept, margin)
        if stop is None:
            break
        if certify(robot, stop, limits=limits, enforced=kept, ends=ends).satisfied:
            return certified(robot, stop, limits, kept, ends=ends, is_stop=True)
    if certify(robot, rest, limits=limits, enforced=kept, ends=ends).continuity in ("none", "C0"):
        message = "no stop on the path within the limits is found before the trajectory ends in motion"
        raise LimitsUnsatisfiable(message, time=time)
    done = certified(robot, rest, limits, kept, ends=ends, is_stop=True)
    warning = PlanWarning(
        "stops_at_the_end", f"no faster stop is found than that after {rest.duration:.6g} s, at the end"
    )
    return replace(done, warnings=(*done.warnings, warning))


def _shortest(
    robot: Robot, rest: Trajectory, limits: SegmentLimits, kept: frozenset[str], margin: float
) -> Trajectory | None:
    """Return the fastest stop found; None: no stop is faster than the rest of the trajectory."""
    limits = limits.without(set(QUANTITIES) - kept)
    finite = [np.isfinite(limits.bounds(quantity).upper) for quantity in JOINT_DERIVATIVES[1:]]
    if not (np.any(finite) or limits.constraints):
        raise LimitsUnsatisfiable("no enforced limit bounds the deceleration; request an acceleration limit")
    is_smooth, curve = bool(finite[-1].all()), rest.of_segments(np.zeros(len(rest.lengths), dtype=int))
    bounds = LimitsOnCurve(robot, limits, curve)
    shortest, longest, found = 0.0, np.inf, None
    distance = FIRST * rest.duration
    for _ in range(MOST_STOP_DISTANCES):
        speed, stop = _fastest(bounds, distance, margin, is_smooth=is_smooth)
        if speed >= 1.0:
            longest, found = distance, stop
        elif distance == rest.duration:
            return None
        else:
            shortest = distance
        if longest <= STOP_DISTANCE_RATIO * shortest:
            break
        if found is None:
            distance = min(2.0 * distance, rest.duration)
        else:
            distance = (shortest * longest) ** 0.5 if shortest else longest / 2.0
    if found is None or found.lengths.sum() >= rest.duration:
        return None
    pieces = compose(rest.between(0.0, longest), found, TOLERANCE)[0]
    ends = np.array([0.0, float(pieces.lengths.sum())])
    return Trajectory(pieces.lengths, pieces.coefficients, np.zeros(len(pieces.lengths), dtype=int), ends, ends)


def _slowing(curve: SegmentedPolynomial, distance: float, *, is_smooth: bool) -> PiecewisePolynomial:
    """Return a time scaling s(t) from speed 1 to rest in a distance; smooth: without a jump of s''."""
    units = [0.0, 1.0, 0.0, -1.0, 0.5] if is_smooth else [0.0, 1.0, -0.5]
    whole = PiecewisePolynomial(np.ones(1), 2.0 * distance * np.array([[units]]))
    knots = curve.breakpoints[1:-1]
    knots = knots[knots < distance * (1.0 - ROUNDING)]
    scaling = split_at_knots(whole, knots, np.zeros(len(knots) + 1, dtype=int))
    scaling.coefficients[1:, 0, 0] = knots
    return scaling.split(np.ceil(scaling.lengths * LEAST_STOP_PIECES).astype(int)).stretched(2.0 * distance)


def _fastest(
    bounds: LimitsOnCurve, distance: float, margin: float, *, is_smooth: bool
) -> tuple[float, PiecewisePolynomial]:
    """Find the highest speed from which s(t) can stop in a distance, and s(t) from speed 1 at most.

    Args:
        bounds: The limits on the curve.
        distance: The distance, s.
        margin: Fraction of the limits in reserve, unless the trajectory itself uses it.
        is_smooth: Whether s(t) begins with s'' = 0.
    """
    scaling = _slowing(bounds.curve, distance, is_smooth=is_smooth)
    within = bounds.along(scaling)
    if not np.isfinite(within.scale(np.array([[1.0], [0.0], [0.0]]))):
        return 1.0, scaling  # the trajectory rests
    s = np.append(scaling.coefficients[:, 0, 0], horner(scaling.coefficients[-1, 0], scaling.lengths[-1]))
    coefficients = np.stack([s[:-1], np.ones(len(scaling.lengths))], axis=1)[:, None]
    own = bounds.along(PiecewisePolynomial(np.diff(s), coefficients)).used()
    passed = scaling.breakpoints[:-1] + GRIDPOINTS[:, None] * scaling.lengths
    growth = np.minimum(passed.ravel() / (FREE * scaling.breakpoints[-1]), 1.0)
    allowed = np.clip(own * (1.0 - 0.5 * margin * growth), 1.0 - margin, 1.0 / INSCRIBED)
    within = within.narrowed(1.0 / allowed)
    for part in (within.by_b, within.by_a, within.by_c):
        part[within.inverse[:, 0] == 0.0, 0] = 0.0  # but for the jerk, what is there at the start is given
    weights = of_duration(scaling.lengths).weights * STOP_DURATION_WEIGHT / scaling.breakpoints[-1]
    weights[0] += 1.0
    found = best_retiming(scaling.lengths, within, Objective(weights), None, STOP_SPEED_GAP, begins_evenly=is_smooth)
    unknowns = found.unknowns
    speed = float(unknowns[0] ** 0.5)
    return speed, retimed(scaling, unknowns / max(speed, 1.0) ** 2)
