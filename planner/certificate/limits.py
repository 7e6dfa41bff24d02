"""The exact check of a trajectory against its limits.

It shares with the back ends only arithmetic with brute-force tests: polynomials and their extrema, and the
kinematics and dynamics of the robot.

Positions, velocities, accelerations and jerks are polynomials: the certificate finds their extrema. Torque and the
motion of the tool are no polynomials: Taylor models bound them at all times. Further quantities are sampled. Each check
names its method.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import copysign
from typing import NamedTuple

import numpy as np

from planner.certificate.checks import Certificate, Check
from planner.constraints import TORQUE, Bounds, Constraint, measures
from planner.constraints.bounded import KIND_OF, bounded_peaks
from planner.constraints.peaks import SampledConstraints, values_of
from planner.constraints.rms_torque import bound_rms_torque
from planner.dynamics import SegmentDynamics
from planner.guarantees import JOINT_DERIVATIVES, QUANTITIES, EndStates, Guarantee
from planner.kinematics.forward import JointStates
from planner.limits import SegmentLimits
from planner.quantities import MEASURES
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import CONTINUITY_TOLERANCE, POSITION_TOLERANCE
from planner.trajectories.extrema import UnitPolynomials, derivatives_on_unit_time, largest_magnitudes
from planner.trajectories.sampled_peaks import BROKEN, DERIVATIVES
from planner.trajectories.trajectory import Trajectory

MOST_CONTINUOUS = 4
"""Order of the highest derivative whose continuity is looked into, less than `DERIVATIVES`."""

FORCES = ("torque", "torque_at_speed", "torque_with_tolerances")
"""Quantities that have a bound although the velocity may jump: the certificate has no impulses of torque."""

MISS = 1e-6
"""Distance of a joint from its waypoint, rad or m, above which the waypoint is missed.

It is a micrometre at the end of an arm of 1 m.
"""


def certificate_of(
    trajectory: Trajectory,
    robot: Robot,
    limits: SegmentLimits,
    guarantees: Mapping[str, Guarantee],
    waypoint_positions: FloatArray,
    more_checks: Sequence[Check] = (),
    ends: EndStates | None = None,
    dynamics: SegmentDynamics | None = None,
) -> Certificate:
    """Check a trajectory against the limits in force on each of its segments.

    Args:
        trajectory: A trajectory from any source.
        robot: The robot, with its tool and payload.
        limits: The limits of each segment.
        guarantees: The guarantee of each quantity, which says whether it is enforced.
        waypoint_positions: Positions (waypoints, joints), rad or m, to be met at the trajectory's arrivals; NaN: not to
            be met.
        more_checks: Checks of other things than these limits.
        ends: The requested motion before and after the trajectory; None: rest.
        dynamics: The robot with its payload and tool on each segment; None: `robot` on all segments.
    """
    derivatives = derivatives_on_unit_time(trajectory, DERIVATIVES)
    still = np.zeros(robot.dof)
    smooth = continuity(derivatives, ends or EndStates(still, still, still))
    enforced = {quantity: guarantees[quantity] is Guarantee.HARD for quantity in QUANTITIES}
    checks = _polynomial_checks(trajectory, derivatives, robot, limits, enforced, smooth)
    dynamics = dynamics or SegmentDynamics.unchanged(robot)
    checks += _constraint_checks(trajectory, derivatives, dynamics, limits, enforced, smooth)
    checks += _rms_checks(trajectory, dynamics, limits)
    checks += more_checks
    return Certificate(
        satisfied=all(check.satisfied for check in checks if check.enforced),
        waypoint_error=float(np.fmax.reduce(np.abs(trajectory.at_arrivals - waypoint_positions), axis=None)),
        continuity=f"C{smooth}" if smooth >= 0 else "none",
        checks=tuple(checks),
    )


def unless_missed(certificate: Certificate) -> Certificate:
    """Return the certificate, which is not satisfied where a joint misses its waypoint."""
    return replace(certificate, satisfied=certificate.satisfied and certificate.waypoint_error <= MISS)


def continuity(derivatives: UnitPolynomials, requested: EndStates) -> int:
    """Return the highest k with continuous derivatives 0 to k, including the given end states; -1: none."""
    starts, ends = (values[: MOST_CONTINUOUS + 1] for values in (derivatives.starts, derivatives.ends))
    begin, end = starts[:, 0].copy(), ends[:, -1].copy()
    begin[1] -= requested.initial_velocity
    begin[2] -= requested.initial_acceleration
    end[1] -= requested.final_velocity
    end[2] -= requested.final_acceleration
    begin[0] = end[0] = 0.0  # it begins and ends where it is
    jumps = np.concatenate([starts[:, 1:] - ends[:, :-1], begin[:, None], end[:, None]], axis=1)
    # A bound on each derivative all over, since it may vanish at every breakpoint.
    scales = np.abs(derivatives.bernstein[: MOST_CONTINUOUS + 1]).max(axis=(1, 2, 3))
    jumping = np.flatnonzero(np.abs(jumps).max(axis=(1, 2)) > CONTINUITY_TOLERANCE * scales)
    return int(jumping[0]) - 1 if len(jumping) else MOST_CONTINUOUS


def _polynomial_checks(
    trajectory: Trajectory,
    derivatives: UnitPolynomials,
    robot: Robot,
    limits: SegmentLimits,
    enforced: Mapping[str, bool],
    smooth: int,
) -> list[Check]:
    """Return the checks of the joints' positions and of their derivatives, by exact extrema."""
    middle, half = limits.position.centred
    half = np.maximum(half, POSITION_TOLERANCE)  # of a joint without room to move in: rounding
    pieces, count = len(trajectory.lengths), len(JOINT_DERIVATIVES)
    middles = np.zeros((count, 1, robot.dof))
    middles[0] = middle
    rates = (limits.bounds(quantity).of(trajectory.segments) for quantity in JOINT_DERIVATIVES[1:])
    bounds, directions = measures([Bounds.of_magnitudes(half[None].repeat(pieces, axis=0)), *rates])
    # Without any limit the largest value is still worth knowing: measure every joint by 1.
    measure = np.where(np.isfinite(bounds).any(axis=(1, 2), keepdims=True), bounds, 1.0)
    of_pieces = np.repeat(np.arange(count), pieces)
    found = largest_magnitudes(derivatives[:count].minus(middles), measure, of_pieces, directions)
    checks = []
    for order, (row, joint, u, value) in enumerate(zip(*(values.tolist() for values in found), strict=True)):
        quantity, piece = JOINT_DERIVATIVES[order], row % pieces
        bound, offset = float(bounds[order, piece, joint]), float(middles[order, 0, joint])
        if directions is not None:
            weight = float(directions[int(value > 0.0), order, piece, joint])
            bound = bound / weight if weight > 0.0 else np.inf
        has_limit, bounded = np.isfinite(bound), smooth >= order - 1
        check = Check(
            quantity=quantity,
            joint=robot.joint_names[joint],
            peak=value + offset if order == 0 else abs(value),
            limit=None if not has_limit else copysign(bound, value) + offset if order == 0 else bound,
            ratio=abs(value) / bound if has_limit and bounded else None,
            time=float(trajectory.breakpoints[piece] + u * trajectory.lengths[piece]),
            method="exact",
            enforced=enforced[quantity],
            bounded=bounded,
        )
        checks.append(check)
    return checks


class _Peak(NamedTuple):
    """The peak of a constraint over a trajectory.

    Attributes:
        use: The share of its limit that it uses at most.
        reached: A share that it uses at a time; None: `use` is one.
        piece: The piece that this time is on.
        unit: The unit time there.
        column: The column of the constraints.
    """

    use: float
    reached: float | None
    piece: int
    unit: float
    column: int


def _constraint_checks(
    trajectory: Trajectory,
    derivatives: UnitPolynomials,
    dynamics: SegmentDynamics,
    limits: SegmentLimits,
    enforced: Mapping[str, bool],
    smooth: int,
) -> list[Check]:
    """Return the checks of the constraints; none of torque where inertias are unknown."""
    if not limits.constraints:
        return []
    segments, lengths, rows = trajectory.segments, trajectory.lengths, len(limits.torque.upper)
    checks: list[Check] = []

    def state_at(peak: _Peak) -> JointStates:
        motion = derivatives[:4].evaluate(np.array([peak.piece]), np.array([peak.unit]))
        return JointStates(dynamics.robot_on(int(segments[peak.piece])), *motion)

    def check(limited: SampledConstraints, peaks: Iterable[_Peak]) -> None:
        for constraint, peak in zip(limited.constraints, peaks, strict=True):
            found = _constraint_check(constraint, peak, limited, trajectory, enforced, smooth)
            if constraint.of_shares and found.limit is not None:
                found = _as_shown(found, constraint, peak, state_at(peak))
            if dynamics.robots[0].following_errors is not None and found.lower is not None:
                found = _without_overestimate(found, constraint, state_at(peak))
            if constraint is TORQUE:
                found = _by_direction(found, peak, limited, segments, derivatives, limits)
            if constraint.counts_at_rest:
                found = _held_at_changes(constraint, found, trajectory, dynamics, limits)
            checks.append(found)

    bounded = SampledConstraints(dynamics, [own for own in limits.constraints if own[0] in KIND_OF], rows)
    if bounded.constraints:
        found = bounded_peaks(bounded, segments, derivatives, lengths)
        parts = found.bound, found.reached, found.pieces, found.units, found.columns
        check(bounded, map(_Peak, *(part.tolist() for part in parts)))
    sampled = SampledConstraints(dynamics, [own for own in limits.constraints if own[0] not in KIND_OF], rows)
    if sampled.constraints:

        def shares(pieces: np.ndarray, states: Sequence[FloatArray]) -> FloatArray:
            return sampled.shares(segments[pieces], segments[pieces], states, lengths[pieces])

        use, *rest = sampled.peaks(shares, derivatives, lengths, np.zeros_like(segments), decided_at=BROKEN)
        columns = (part[0].tolist() for part in rest)
        check(sampled, map(_Peak, use[0].tolist(), [None] * len(sampled.constraints), *columns))
    exact = ((own, limit[segments]) for own, limit in sampled.exact)
    robot = dynamics.robots[0]
    return [*(_exact_check(trajectory, derivatives, robot, *own, enforced) for own in exact), *checks]


def _exact_check(
    trajectory: Trajectory,
    derivatives: UnitPolynomials,
    robot: Robot,
    constraint: Constraint,
    limits: FloatArray,
    enforced: Mapping[str, bool],
) -> Check:
    """Return the check of a constraint whose peaks are exact, with limits (pieces, columns)."""
    peaks = constraint.peaks(robot, derivatives, limits, np.zeros_like(trajectory.segments))
    ratio, piece, unit, column = (part[0, 0].item() for part in peaks)
    state = JointStates(robot, *derivatives[:4].evaluate(np.array([piece]), np.array([unit])))
    peak, limit = constraint.shown(state, column, float(limits[piece, column]))
    known = bool(np.isfinite(limit))
    return Check(
        quantity=constraint.name,
        joint=robot.joint_names[column] if constraint.of_joints else None,
        peak=peak,
        limit=limit if known else None,
        ratio=ratio if known else None,
        time=float(trajectory.breakpoints[piece] + unit * trajectory.lengths[piece]),
        method="exact",
        enforced=enforced.get(constraint.kept_with or constraint.name, True),
        bounded=True,
        own_unit=None if constraint.name in MEASURES else constraint.unit,
    )


def _constraint_check(
    constraint: Constraint,
    peak: _Peak,
    limited: SampledConstraints,
    trajectory: Trajectory,
    enforced: Mapping[str, bool],
    smooth: int,
) -> Check:
    """Return the check of a constraint with its peak."""
    limit = float(limited.half[trajectory.segments[peak.piece], peak.column])
    known = bool(np.isfinite(limit))  # if not, nothing is used anywhere that is limited
    bounded = constraint.order == 1 or constraint.name in FORCES or smooth >= constraint.order - 1
    return Check(
        quantity=constraint.name,
        joint=limited.joints[peak.column],
        peak=peak.use * limit if known else 0.0,
        limit=limit if known else None,
        ratio=peak.use if known and bounded else None,
        time=float(trajectory.breakpoints[peak.piece] + peak.unit * trajectory.lengths[peak.piece]),
        method="sampled" if peak.reached is None else "bounded",
        enforced=enforced.get(constraint.kept_with or constraint.name, True),
        bounded=bounded,
        lower=None if peak.reached is None else peak.reached * limit if known else 0.0,
        own_unit=None if constraint.name in MEASURES else constraint.unit,
    )


def _rms_checks(trajectory: Trajectory, dynamics: SegmentDynamics, limits: SegmentLimits) -> list[Check]:
    """Return the check of the RMS torque over the cycle; none without a limit or where inertias are unknown."""
    if limits.rms is None or not dynamics.has_dynamics:
        return []
    lower, upper = bound_rms_torque(dynamics, trajectory, limits.rms)
    ratios = upper / limits.rms.limits
    joint = int(ratios.argmax())
    check = Check(
        quantity="rms_torque",
        joint=dynamics.robots[0].joint_names[joint],
        peak=float(upper[joint]),
        limit=float(limits.rms.limits[joint]),
        ratio=float(ratios[joint]),
        time=trajectory.duration,
        method="bounded",
        enforced=True,
        bounded=True,
        lower=float(lower[joint]),
    )
    return [check]


def _as_shown(check: Check, constraint: Constraint, peak: _Peak, states: JointStates) -> Check:
    """Return the check of shares of limits that depend on the state, with the limit at its peak."""
    _, limit = constraint.shown(states, _column(check, states.robot), float(check.limit or 0.0))
    lower = None if peak.reached is None else peak.reached * limit
    return replace(check, peak=peak.use * limit, limit=limit, lower=lower)


def _without_overestimate(check: Check, constraint: Constraint, states: JointStates) -> Check:
    """Return the check whose lower bound is reached with some actual positions."""
    over = float(constraint.overestimates(states)[0, _column(check, states.robot)])
    return replace(check, lower=max((check.lower or 0.0) - over, 0.0))


def _column(check: Check, robot: Robot) -> int:
    """Return the number of the joint of a check; 0: it is of the tool."""
    return 0 if check.joint is None else robot.joint_names.index(check.joint)


def _by_direction(
    check: Check,
    peak: _Peak,
    limited: SampledConstraints,
    segments: np.ndarray,
    derivatives: UnitPolynomials,
    limits: SegmentLimits,
) -> Check:
    """Return the check of torque as a share of the limit in its direction."""
    if check.limit is None or limits.torque.is_symmetric:
        return check
    dynamics = limited.dynamics
    segment, joint = segments[peak.piece], dynamics.robots[0].joint_names.index(check.joint)
    states = derivatives[:3].evaluate(np.array([peak.piece]), np.array([peak.unit]))
    torque = dynamics.torques(np.array([segment]), *states)[0]
    middle = limited.middle[segment, peak.column]
    away = copysign(check.limit, torque[joint] - middle)
    torque[joint] = middle + peak.use * away
    used = limits.torque.used(segment, torque)
    if not used[joint] > 0.0:
        return check
    lower = None if peak.reached is None else abs(float(middle + peak.reached * away))
    return replace(_of_torque(check, joint, torque, used), lower=lower)


def _of_torque(check: Check, joint: int, torque: FloatArray, used: FloatArray) -> Check:
    """Return the check with the torque (joints,) of a joint, and the share (joints,) of its limit that it uses."""
    peak, ratio = abs(float(torque[joint])), float(used[joint])
    return replace(check, peak=peak, limit=peak / ratio, ratio=ratio, lower=None if check.lower is None else peak)


def _held_at_changes(
    constraint: Constraint, check: Check, trajectory: Trajectory, dynamics: SegmentDynamics, limits: SegmentLimits
) -> Check:
    """Return the check of torque, or that of rest where the payload changes if it uses more.

    During the rest, the limits of the segment before hold, with the payload of either segment.
    """
    last = len(limits.torque.upper) - 1
    for waypoint, robot in dynamics.changes:
        time = float(trajectory.arrivals[waypoint])
        position = trajectory.evaluate(np.array([time]), [0])[0]
        still = np.zeros_like(position)
        torque = values_of(constraint, JointStates(robot, position, still, still))[0]
        used = np.maximum(
            limits.torque.used(np.array(waypoint - 1), torque),
            limits.torque.used(np.array(min(waypoint, last)), torque),
        )
        joint = int(used.argmax())
        if used[joint] > (check.ratio or 0.0):
            name = robot.joint_names[joint]
            check = replace(_of_torque(check, joint, torque, used), joint=name, time=time)
    return check
