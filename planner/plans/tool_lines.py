"""Straight lines of the tool as polynomials of time, x(t), y(t) and z(t), read from a plan.

The tool is at p(t) = p0 + u(t) (p1 - p0), with the time-scaling function u(t) from 0 to 1. See document 002, Eq. 3.1 to
3.9 and Tables 3.0 to 3.6, and document 004, Section 7, where u is s. The joints follow the line on a curve whose
parameter is linear in u. So their position, velocity and acceleration at a breakpoint give u, u' and u'' there. The
quintics through these values are the time-scaling function itself: no back end has one of a higher degree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.kinematics import tool_poses
from planner.paths import SegmentGroup
from planner.plans.result import Plan
from planner.robots import Robot
from planner.spatial import FloatArray, rotation_vector
from planner.tool_motions.pose_paths import Line
from planner.trajectories.polynomials import PiecewisePolynomial, differentiate, horner, powers, quintic_hermite

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
    share: FloatArray = np.clip(along / whole, 0.0, 1.0)
    return share


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
