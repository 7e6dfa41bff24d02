"""Peaks of torques and of the tool's motion, bounded at all times and not only at samples (docs/certificate.md)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner.constraints.at_speed import ACCELERATION_AT_SPEED, JERK_AT_SPEED, TORQUE_AT_SPEED
from planner.constraints.constraint import Constraint
from planner.constraints.peaks import SampledConstraints
from planner.constraints.quantities import POWER, TOOL, TORQUE, TOTAL_POWER
from planner.constraints.torque_with_tolerances import TORQUE_WITH_TOLERANCES
from planner.dynamics import SegmentDynamics
from planner.dynamics.torque_tolerances import torque_tolerances
from planner.errors import InvalidProblem
from planner.kernels.bounded_peaks import KINDS, BoundedPeaks, Columns, Motion, ToolChain, ToolPaths, bound_peaks
from planner.kernels.library import TooManySamples
from planner.kinematics.following_errors import tool_following
from planner.kinematics.forward import TIGHTEST_BEND
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import LIMIT_TOLERANCE
from planner.trajectories.extrema import UnitPolynomials
from planner.trajectories.sampled_peaks import TOO_FAR

AT_SPEED = (TORQUE_AT_SPEED, ACCELERATION_AT_SPEED, JERK_AT_SPEED)
"""The constraints by curves of speed, in the order of the kernels."""

KIND_OF: Mapping[Constraint, int] = {
    own: KINDS.index(own.name)
    for own in (TORQUE, *AT_SPEED, TORQUE_WITH_TOLERANCES, POWER, TOTAL_POWER, *TOOL.values())
}
"""The constraints whose peaks are bounded, and their kinds in the kernels."""

BOUND_KNOWN_TO = 1e-6
"""Relative amount by which the bound on a peak may exceed a value that is reached."""

TOO_FAR_OFF = (
    "`waypoints` must be so near that the deviation of the tool from its path can be bounded; a joint travels too far. "
    "Add waypoints between them, or ask for shorter motions."
)
"""Message for a motion whose deviation from requested paths would need too many intervals."""

MOST_BOUND_PARTS = 1_000_000
"""Number of intervals evaluated in addition to the pieces of a motion; they take about 2 s."""

MOST_INTERVALS_OF_PIECE = 24
"""The same on each of many pieces."""


def bounded_peaks(
    limited: SampledConstraints, segments: np.ndarray, derivatives: UnitPolynomials, lengths: FloatArray
) -> BoundedPeaks:
    """Bound the peak of each constraint over all pieces of a motion.

    Args:
        limited: The constraints, all of `KIND_OF`, and their limits.
        segments: The segment (pieces,) of each piece.
        derivatives: The motion on unit time, and its derivatives.
        lengths: (pieces,), s.

    Raises:
        InvalidProblem: A joint travels so far that the bounds would take too many intervals.
    """
    dynamics, constraints = limited.dynamics, limited.constraints
    kinds = np.array([KIND_OF[constraints[k]] for k in limited.of_column])
    starts = np.searchsorted(limited.of_column, limited.of_column)
    joints = np.arange(len(kinds)) - starts
    known = np.array([[own.is_known(robot) for own in constraints] for robot in dynamics.robots])[:, limited.of_column]
    half = np.where(known[dynamics.indices_on(segments)], limited.half[segments], np.inf)
    columns = Columns(kinds, joints, limited.of_column, limited.middle[segments], half)
    return bound_by_robot(dynamics, segments, (derivatives, lengths), columns, BOUND_KNOWN_TO)


def bound_by_robot(
    dynamics: SegmentDynamics,
    segments: np.ndarray,
    motion: tuple[UnitPolynomials, FloatArray],
    columns: Columns,
    known_to: float,
    paths: ToolPaths | None = None,
) -> BoundedPeaks:
    """Bound the peaks of functions of a motion, on each segment with its robot.

    Args:
        dynamics: The robot on each segment.
        segments: The segment (pieces,) of each piece.
        motion: The motion on unit time and its derivatives, and the lengths (pieces,) of the pieces, s.
        columns: The functions.
        known_to: Relative amount by which the bound on a peak may exceed a value that is reached.
        paths: The requested paths, for deviations from them.

    Raises:
        InvalidProblem: A joint travels so far that the bounds would take too many intervals.
    """
    derivatives, lengths = motion
    wish = np.array(
        [
            known_to,
            1.0 + LIMIT_TOLERANCE,
            TIGHTEST_BEND,
            MOST_BOUND_PARTS + MOST_INTERVALS_OF_PIECE * len(lengths),
        ]
    )
    robots, takes_time = dynamics.indices_on(segments), lengths > 0.0
    peaks = BoundedPeaks.nothing(int(columns.quantities.max()) + 1)
    for index in np.unique(robots[takes_time]).tolist():
        rows = np.flatnonzero(takes_time & (robots == index))  # a piece of no length has no rates
        of_robot = columns._replace(middle=columns.middle[rows], half=columns.half[rows])
        pieces = Motion(lengths[rows], derivatives.coefficients[0][rows], derivatives.bernstein[0][rows])
        own = None if paths is None else paths._replace(of_piece=paths.of_piece[rows])
        try:
            robot = dynamics.robots[index]
            found = bound_peaks(_tool_chain(robot), pieces, of_robot, wish, peaks, _pieces_of_curves(robot), own)
        except TooManySamples:
            raise InvalidProblem([(("limits",), TOO_FAR) if paths is None else (("waypoints",), TOO_FAR_OFF)]) from None
        higher, at = found.reached > peaks.reached, peaks.pieces.copy()
        at[higher] = rows[found.pieces[higher]]
        peaks = found._replace(pieces=at)
    return peaks


def _tool_chain(robot: Robot) -> ToolChain:
    """Return the chain of joints that move the tool, for the kernels."""
    frame = robot.model.frames[robot.tool_frame_id]
    tool = frame.placement
    joints, axes = int(frame.parentJoint), tool.rotation.T.copy()
    tolerances, following = torque_tolerances(robot), tool_following(robot)
    return ToolChain(robot.chain, joints, tool.translation.copy(), axes, tolerances, following)


def _pieces_of_curves(robot: Robot) -> FloatArray:
    """Return the pieces (`AT_SPEED`, 3, joints, pieces) of the speed curves of a robot: ends, intercepts and slopes."""
    each = [robot.torque_curves, *robot.rate_curves.values()]
    if not any(each):
        return np.empty((len(each), 3, robot.dof, 0))
    most = max(curves.speed.shape[1] for curves in each if curves is not None)
    found = np.full((len(each), 3, robot.dof, most), np.inf)
    found[:, 2] = 0.0
    for own, curves in zip(found, each, strict=True):
        if curves is not None:
            own[..., : curves.speed.shape[1]] = [curves.ends, curves.intercepts, curves.slope]
    return found
