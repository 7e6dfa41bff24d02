"""Reports of the tool on a plan: its speed beside the limit, and its straight lines as polynomials of time.

On a straight line the tool is at p(t) = p0 + u(t) (p1 - p0), with the time-scaling function u(t) from 0 to 1. See
document 002, Eq. 3.1 to 3.9 and Tables 3.0 to 3.6, and document 004, Section 7, where u is s. The joints follow the
line on a curve whose parameter is linear in u. So their position, velocity and acceleration at a breakpoint give u, u'
and u'' there. The quintics through these values are the time-scaling function itself: no back end has one of a higher
degree.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.guarantees import Guarantee
from planner.kinematics import tool_poses
from planner.kinematics.forward import JointStates, tool_speeds
from planner.limits import JOINT_QUANTITIES
from planner.paths import SegmentGroup
from planner.plans.result import Plan
from planner.robots import Robot
from planner.spatial import FloatArray, rotation_vector
from planner.tool_motions.pose_paths import Line
from planner.trajectories.polynomials import PiecewisePolynomial, differentiate, horner, powers, quintic_hermite

HELD = 0.99
"""Fraction of the speed limit above which the speed counts as kept.

A weld seam or a bead of glue shows no difference of 1 %.
"""

TOOL_SAMPLES = 17
"""Number of samples of each piece of a trajectory, both ends included."""

SLOWEST_PART = 0.1
"""Fraction of the missing speed that defines the slowest samples of a part.

The limit that binds at these samples explains the part; elsewhere the limits of acceleration and deceleration bind.
"""

BINDS = 0.9
"""Fraction of a limit above which the limit counts as binding; back ends leave some reserve."""

DURATION = "duration"
"""The reason for a low speed if the segment has a requested duration and no limit binds."""

TIME_LAW = "time_law"
"""The reason for a low speed otherwise: the form of the back end's time scaling, such as a single cubic."""


@dataclass(frozen=True)
class SlowPart:
    """A part of a motion on which the tool goes slower than its speed limit.

    Attributes:
        start_time: Start of the part, s from the start of the trajectory.
        end_time: End of the part, s.
        start_distance: Distance travelled by the tool from the start of the motion to the start of the part, m.
        end_distance: The same to the end of the part, m.
        lowest_speed: The lowest speed of the part, m/s.
        quantity: The limit that binds where the tool is slowest: `velocity`, `acceleration`, `jerk`, `torque`,
            `tcp_angular_velocity`, or an acceleration or a jerk of the tool. `duration`: no limit binds and the request
            has a duration. `time_law`: neither; the form of the back end's time scaling.
        joint: Name of the joint that the limit belongs to; None: the limit is not one of a joint.
        use: The largest ratio to that limit; for `duration` and `time_law`, the largest ratio to any limit.
    """

    start_time: float
    end_time: float
    start_distance: float
    end_distance: float
    lowest_speed: float
    quantity: str
    joint: str | None
    use: float


@dataclass(frozen=True)
class ToolSpeedReport:
    """The speed of one tool motion, compared with its limit.

    Attributes:
        segment: Index of the segment.
        limit: The limit of the tool's speed there, m/s.
        held: The fraction of the path with a speed within 1 % of the limit.
        slow: The parts with a lower speed, in order.
    """

    segment: int
    limit: float
    held: float
    slow: tuple[SlowPart, ...]


def tool_speed_reports(plan: Plan) -> list[ToolSpeedReport]:
    """Report the speed of every tool motion with a speed limit: its slow parts and their reasons."""
    limits = plan.path.limits.magnitudes("tcp_linear_velocity")[:, 0]
    segments = [k for k, path in enumerate(plan.path.tool_motions) if path is not None and np.isfinite(limits[k])]
    moving = set(plan.path.moving.tolist())
    return [_report(plan, segment, float(limits[segment])) for segment in segments if segment in moving]


class _Samples(NamedTuple):
    """A motion at N times: s, joint positions and their derivatives (N, joints), speeds (N,), and distances (N,)."""

    times: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    j: FloatArray
    speeds: FloatArray
    distances: FloatArray

    def of(self, rows: np.ndarray) -> _Samples:
        return _Samples(*(values[rows] for values in self))


def _report(plan: Plan, segment: int, limit: float) -> ToolSpeedReport:
    samples = _sampled(plan, segment)
    slow = samples.speeds < HELD * limit
    steps = np.diff(samples.distances)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]])))
    parts = tuple(
        _slow_part(plan, segment, limit, samples, first, last) for first, last in edges.reshape(-1, 2).tolist()
    )
    slow_way = float(steps[slow[:-1] & slow[1:]].sum())
    return ToolSpeedReport(segment, limit, 1.0 - slow_way / max(float(steps.sum()), np.finfo(float).tiny), parts)


def _sampled(plan: Plan, segment: int) -> _Samples:
    """Sample the motion of a segment, without the rests at its ends."""
    trajectory = plan.trajectory
    begins, ends = trajectory.departures[segment], trajectory.arrivals[segment + 1]
    middles = trajectory.breakpoints[:-1] + trajectory.lengths / 2.0
    rows = np.flatnonzero((middles > begins) & (middles < ends))
    since = np.linspace(0.0, 1.0, TOOL_SAMPLES) * trajectory.lengths[rows, None]
    q, v, a, j = (
        horner(differentiate(trajectory.coefficients[rows], order)[:, None], since[..., None]).reshape(since.size, -1)
        for order in range(4)
    )
    times = (trajectory.breakpoints[rows, None] + since).ravel()
    speeds, _ = tool_speeds(plan.path.dynamics.robot_on(segment), q, v)
    steps = np.diff(times) * (speeds[1:] + speeds[:-1]) / 2.0
    return _Samples(times, q, v, a, j, speeds, np.concatenate([[0.0], np.cumsum(steps)]))


def _slow_part(plan: Plan, segment: int, limit: float, samples: _Samples, first: int, last: int) -> SlowPart:
    """Return what there is to say of samples `first` to before `last`."""
    speeds = samples.speeds[first:last]
    lowest = float(speeds.min())
    rows = first + np.flatnonzero(speeds <= lowest + SLOWEST_PART * (limit - lowest))
    shares = {(quantity, joint): use for quantity, joint, use in _uses(plan, segment, samples.of(rows))}
    binds = min(BINDS, max(float(use.max()) for use in shares.values()))
    # Of several limits that are used up, in braking and in cruising, it is the one that is for the longest time.
    periods = np.gradient(samples.times)[rows]
    quantity, joint = max(shares, key=lambda one: float(periods @ (shares[one] >= binds)))
    use = float(shares[quantity, joint].max())
    if use < BINDS:
        requested = not np.isnan(plan.path.durations[segment])
        quantity, joint = DURATION if requested else TIME_LAW, None
    ends = [first, last - 1]
    (start, end), (gone, reached) = samples.times[ends].tolist(), samples.distances[ends].tolist()
    return SlowPart(start, end, gone, reached, lowest, quantity, joint, use)


def _uses(plan: Plan, segment: int, samples: _Samples) -> Iterator[tuple[str, str | None, FloatArray]]:
    """Yield each limit that is kept: its quantity, its joint, and the shares (N,) of it that samples use."""
    limits, names, dynamics = plan.path.limits, plan.path.robot.joint_names, plan.path.dynamics
    states = JointStates(dynamics.robot_on(segment), samples.q, samples.v, samples.a, samples.j)
    for quantity, limit in limits.of_tool.items():
        if quantity != "tcp_linear_velocity":
            yield quantity, None, states.tool_rate(quantity) / limit[segment]
    values = {"velocity": samples.v, "acceleration": samples.a, "jerk": samples.j}
    if dynamics.has_dynamics and np.isfinite(limits.torque.upper[segment]).any():
        segments = np.full(len(samples.times), segment)
        values["torque"] = dynamics.torques(segments, samples.q, samples.v, samples.a)
    for quantity in JOINT_QUANTITIES:
        if quantity in values and plan.backend.guarantees[quantity] is Guarantee.HARD:
            uses = limits.bounds(quantity).used(np.full(len(samples.times), segment), values[quantity])
            yield from ((quantity, name, uses[:, joint]) for joint, name in enumerate(names))


NEWTON_STEPS = 8
"""Number of Gauss-Newton steps from the line parameter of the tool to the curve parameter of the joints.

Each step squares the error: an error of a tenth vanishes after five.
"""

SAME_SCALING = 1e-9
"""Largest difference of two time-scaling functions, as a fraction of the path, that still counts as one polynomial.

It is below any measurable value and a thousand times the rounding error on a line of a millimetre.
"""

SAME_RATE = 0.01
"""Weight of the difference of two time-scaling functions' rates, times their duration, beside the smaller difference of
their values.
"""

LINE_SAMPLES = 17
"""Number of samples of each piece, both ends included, at which the tool is compared with its polynomial.

A piece is a quintic, whose error has few extrema.
"""


@dataclass(frozen=True, eq=False)
class LinePolynomial:
    """The tool's motion along a straight line: one polynomial of time for each phase of the time scaling.

    Where the line begins or ends in a blend, it is the part outside of the blend.

    Attributes:
        segment: Index of the segment.
        breakpoints: (pieces + 1,), s from the start of the trajectory.
        path_parameter: (pieces, order), coefficients of u(t), the traversed fraction of the line, in ascending powers
            of the time since the start of the piece, s.
        position: (pieces, 3, order), coefficients of x, y and z in the base frame, m.
        deviation: Largest distance of the planned tool from that line, m: the joints follow the line within its
            tolerance. It is measured at 17 times of each piece of the trajectory.
    """

    segment: int
    breakpoints: FloatArray
    path_parameter: FloatArray
    position: FloatArray
    deviation: float


def line_polynomials(plan: Plan) -> list[LinePolynomial]:
    """Write the straight lines of a plan as polynomials of time, one for each linear motion that has a length."""
    found = []
    for group in plan.path.groups:
        for k, segment in enumerate(group.segments.tolist()):
            line = plan.path.tool_motions[segment]
            if isinstance(line, Line):
                found.append(_line_polynomial(plan, group, k, line))
    return found


def _line_polynomial(plan: Plan, group: SegmentGroup, k: int, line: Line) -> LinePolynomial:
    """Return the polynomial of a line, the segment `k` of a segment group."""
    segment = int(group.segments[k])
    trajectory, robot, curve = plan.trajectory, plan.path.dynamics.robot_on(segment), group.curve
    first, last = curve.breakpoints[group.waypoint_knots[k : k + 2]]
    of_blends = curve.breakpoints[group.blend_knots]
    leaves = of_blends[(of_blends > first) & (of_blends < last)]
    begins = leaves[0] if segment in group.blended else first
    ends = leaves[-1] if segment + 1 in group.blended else last
    starts, durations = trajectory.breakpoints[:-1], trajectory.lengths
    middles = starts + durations / 2.0
    in_motion = (middles > trajectory.departures[segment]) & (middles < trajectory.arrivals[segment + 1])
    rows = np.flatnonzero((trajectory.segments == segment) & in_motion)

    def path_positions(positions: FloatArray) -> FloatArray:
        """Return the positions (N,) on the curve of joint positions (N, joints) of the trajectory."""
        s: FloatArray = first + (last - first) * _share_behind(robot, line, positions)
        for _ in range(NEWTON_STEPS):
            q, slope = curve.evaluate(s, [0, 1])
            s += ((positions - q) * slope).sum(axis=1) / (slope * slope).sum(axis=1)
            np.clip(s, first, last, out=s)
        return s

    halves = horner(trajectory.coefficients[rows], durations[rows, None] / 2.0)
    on_line = path_positions(halves)
    rows = rows[(on_line > begins) & (on_line < ends)]
    lengths, states = durations[rows], []
    for at in (np.zeros_like(lengths), lengths):
        q, v, a = (horner(differentiate(trajectory.coefficients[rows], order), at[:, None]) for order in range(3))
        s = path_positions(q)
        slope, bend = curve.evaluate(s, [1, 2])
        squared = (slope * slope).sum(axis=1)
        rate = (slope * v).sum(axis=1) / squared
        rates = rate, (slope * (a - bend * rate[:, None] ** 2)).sum(axis=1) / squared
        states.append(np.array([s - first, *rates])[..., None] / (last - first))
    scaling = PiecewisePolynomial(lengths, quintic_hermite(lengths, tuple(states[0]), tuple(states[1])))
    ends_of_pieces, path_parameter = _in_few_pieces(scaling)
    way = line.end.position - line.start.position
    position = path_parameter[:, None] * way[:, None] + 0.0  # no minus before a zero
    position[:, :, 0] += line.start.position
    breakpoints = trajectory.breakpoints[rows[0] + np.array([0, *ends_of_pieces])]
    deviation = _deviation(plan, robot, rows, breakpoints, position)
    return LinePolynomial(segment, breakpoints, path_parameter, position, deviation)


def _deviation(plan: Plan, robot: Robot, rows: np.ndarray, breakpoints: FloatArray, position: FloatArray) -> float:
    """Return the largest distance of the tool, m, on pieces (rows,) of the trajectory from its polynomials."""
    trajectory = plan.trajectory
    since = np.linspace(0.0, 1.0, LINE_SAMPLES) * trajectory.lengths[rows, None]
    joints = horner(trajectory.coefficients[rows][:, None], since[..., None])
    reached = tool_poses(robot, joints.reshape(-1, joints.shape[-1]))[0].reshape(*since.shape, 3)
    starts = trajectory.breakpoints[rows]
    pieces = np.searchsorted(breakpoints, starts, side="right") - 1
    times = (starts - breakpoints[pieces])[:, None] + since
    return float(np.linalg.norm(reached - horner(position[pieces][:, None], times[..., None]), axis=2).max())


def _share_behind(robot: Robot, line: Line, positions: FloatArray) -> FloatArray:
    """Return the fraction (N,) of a line traversed at joint positions (N, joints), from translation and rotation."""
    reached, turned = tool_poses(robot, positions)
    way = line.end.position - line.start.position
    along, whole = (reached - line.start.position) @ way, float(way @ way)
    if line.start.rotation is not None and line.end.rotation is not None:
        turn = rotation_vector(line.start.rotation.T @ line.end.rotation)
        along += np.array([rotation_vector(line.start.rotation.T @ rotation) for rotation in turned]) @ turn
        whole += float(turn @ turn)
    return np.clip(along / whole, 0.0, 1.0)


def _in_few_pieces(scaling: PiecewisePolynomial) -> tuple[list[int], FloatArray]:
    """Join adjacent quintics of a time-scaling function that are one polynomial.

    Returns:
        The index of the piece that follows each joined piece, and the coefficients (joined pieces, order); coefficients
        within rounding of zero are zero.
    """
    ends: list[int] = []
    coefficients: list[FloatArray] = []
    while (first := ends[-1] if ends else 0) < len(scaling.lengths):
        end, step, found = first + 1, 1, scaling.coefficients[first, 0]
        while step:
            longer = _one_polynomial(scaling, first, end + step) if end + step <= len(scaling.lengths) else None
            if longer is None:
                step //= 2
            else:
                end, step, found = end + step, 2 * step, longer
        ends.append(end)
        length = float(scaling.lengths[first:end].sum())
        coefficients.append(np.where(np.abs(found) * powers(length, 6) > SAME_SCALING, found, 0.0))
    rows = np.array(coefficients)
    return ends, rows[:, : 1 + int(np.flatnonzero(rows.any(axis=0)).max(initial=0))]


def _one_polynomial(scaling: PiecewisePolynomial, first: int, end: int) -> FloatArray | None:
    """Return the coefficients (6,) of the one polynomial that pieces `first` to before `end` are; None: of none."""
    lengths, rows = scaling.lengths[first:end], scaling.coefficients[first:end, 0]
    whole = lengths.sum()
    start, last = (
        tuple(horner(differentiate(row, order), at).reshape(1, 1) for order in range(3))
        for row, at in ((rows[0], np.zeros(1)), (rows[-1], lengths[-1:]))
    )
    one: FloatArray = quintic_hermite(np.array([whole]), start, last)[0, 0]
    begins = np.cumsum(lengths) - lengths
    apart = [
        scale * (horner(differentiate(one, order), begins + at) - horner(differentiate(rows, order), at))
        for at in (np.zeros_like(lengths), lengths / 2.0)
        for order, scale in enumerate((1.0, SAME_RATE * whole))
    ]
    return one if np.abs(apart).max() <= SAME_SCALING else None
