"""Segment groups: segments traversed without stopping, joined to one smooth joint-space curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.errors import InvalidProblem, JointPositionLimit, Remedy
from planner.kinematics.turns import counted_velocity
from planner.limits import SegmentLimits
from planner.paths.blends import Corners, cut_corners
from planner.paths.easing import eased
from planner.problems.problem import AnyWaypoint, CartesianMotion, JointMotion
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tool_motions.position_limits import first_beyond
from planner.trajectories.polynomials import PiecewisePolynomial, SegmentedPolynomial, joined, quintic_hermite
from planner.trajectories.splines import slopes_between
from planner.waypoints.solve import SolvedWaypoint

TANGENT = 1e-6
"""The relative difference of the joints' directions, and of their change, up to which two motions of the tool are one
smooth one."""

ALMOST_TANGENT = 0.02
"""The relative difference of the joints' directions up to which two motions of the tool are joined within their
tolerances: of a line and a circle whose poses are rounded to a tenth of a millimetre. More is a corner."""

MOST_END_SLOPE = 4.0
"""Slope at the end of a joint motion beside one of the tool, as a multiple of its mean slope, that is not exceeded:
near a singularity a motion of the tool ends as steeply as can be, and the joints would swing far beyond where they go.
The joint motion is made shorter in s."""

BENT = 100.0
"""Second derivative there, as a multiple of the mean slope by its length, that is not exceeded."""

JOINT_TOLERANCE = 1e-6
"""Distance of a joint from its curve, rad or m, that timing may leave; less where a motion of the tool allows less."""

SHORTEST_TOOL_MOTION = 1e-5
"""Travel of the joints, rad or m, below which a tool motion counts as a joint motion.

It bends by less than 1e-10, and its direction is rounding.
"""

RADIUS = 0.01
"""The radius of the blend that is offered where a corner cannot be passed, m."""

JOINT_TOLERANCE_SHARE = 0.02
"""The share of a tolerance of the tool (m, rad) that each joint may use up, in rad or m, when time is put on."""


@dataclass(frozen=True, eq=False)
class SegmentGroup:
    """A segment group: segments traversed without stopping.

    Attributes:
        segments: Indices of its segments, ascending; without segments of no length.
        curve: Joint positions over a length in s: the time that the slowest joint needs at full speed, about. C2.
        waypoint_knots: (segments + 1,), index of the curve's breakpoint at each waypoint; at a blended one, the middle
            of its blend.
        blend_knots: Indices of the breakpoints where blends begin and end, ascending.
        is_spline: Whether it has only joint motions and exact passages: the path between the waypoints is then free.
        tolerance: largest deviation of a joint of the trajectory from the curve, rad or m.
        tool_motions: Indices of the segments that are motions of the tool.
        blended: Indices of the waypoints that are blended.
        path_knots: Indices of the breakpoints where the tool's path goes from one piece to the next, ascending.
    """

    segments: np.ndarray
    curve: SegmentedPolynomial = field(repr=False)
    waypoint_knots: np.ndarray
    blend_knots: np.ndarray
    is_spline: bool
    tolerance: float
    tool_motions: tuple[int, ...] = ()
    blended: tuple[int, ...] = ()
    path_knots: np.ndarray = field(default_factory=lambda: np.array([], dtype=int))

    @property
    def first(self) -> int:
        """Index of the first segment."""
        return int(self.segments[0])

    @property
    def knots(self) -> np.ndarray:
        """The knots of waypoints, of blends and of the tool's path together, ascending."""
        return np.union1d(np.union1d(self.waypoint_knots, self.blend_knots), self.path_knots)


def is_joint_motion(end: SolvedWaypoint) -> bool:
    """Tell whether the joints move straight to a waypoint, up to a tool motion too short to differ."""
    if end.tool_motion is None:
        return True
    curve = end.tool_motion.curve
    if np.abs(end.position - curve.coefficients[0, :, 0]).max() > SHORTEST_TOOL_MOTION:
        return False
    return float(np.abs(_steps(curve)).sum(axis=0).max()) <= SHORTEST_TOOL_MOTION


def travel_time(end: SolvedWaypoint, travel: FloatArray, speeds: FloatArray) -> float:
    """Return the time, s, that the slowest joint takes at full speed for the way to a waypoint.

    Args:
        end: The waypoint.
        travel: (joints,), from where the segment starts; where it is nought, the tool goes around and comes back.
        speeds: (joints,), of the joints.
    """
    steps = _steps(end.tool_motion.curve) if end.tool_motion is not None and not travel.any() else travel[None]
    return float((np.abs(steps) / speeds).max(axis=1).sum())


def _steps(curve: PiecewisePolynomial) -> FloatArray:
    """Return the travels (pieces, joints) from breakpoint to breakpoint."""
    return np.diff(curve.evaluate(curve.breakpoints, [0])[0], axis=0)


def straight_group(segment: int, start: FloatArray, end: FloatArray, velocity: FloatArray) -> SegmentGroup:
    """Build one straight joint motion from rest to rest."""
    time = float((np.abs(end - start) / counted_velocity(velocity)).max())
    coefficients = np.stack([start, (end - start) / time], axis=-1)[None]
    return SegmentGroup(
        segments=np.array([segment]),
        curve=SegmentedPolynomial(np.array([time]), coefficients, np.array([segment])),
        waypoint_knots=np.array([0, 1]),
        blend_knots=np.array([], dtype=int),
        is_spline=False,
        tolerance=JOINT_TOLERANCE,
    )


def build_group(
    robot: Robot,
    waypoints: Sequence[AnyWaypoint],
    solved: Sequence[SolvedWaypoint],
    limits: SegmentLimits,
    segments: np.ndarray,
    transitions: Sequence[Transition],
) -> SegmentGroup:
    """Build the segment group of some segments, from rest to rest.

    Args:
        robot: The robot, with its tool.
        waypoints: All of the problem.
        solved: The solved waypoints, with their joint positions.
        limits: The limits in force on each segment of the problem.
        segments: Indices of the segments; without segments of no length.
        transitions: (segments - 1,), how the robot passes from each to the next.

    Raises:
        InvalidProblem: Two motions of the tool meet in a corner that is to be passed without stopping.
        JointPositionLimit: The curve that passes a waypoint smoothly leaves the position limits.
    """
    builder = _Builder(robot, waypoints, solved, limits, segments, transitions)
    curves = builder.curves()
    waypoint_knots = np.cumsum([0, *(len(curve.lengths) for curve in curves)])
    whole = joined(curves).of_segments(np.repeat(segments, np.diff(waypoint_knots)))
    blend_knots = np.array([], dtype=int)
    radii = {k: passed.radius for k, passed in enumerate(transitions, 1) if isinstance(passed, BlendTransition)}
    if radii:
        positions = np.array([solved[segments[k]].pose.position for k in radii])
        corners = Corners(waypoint_knots[list(radii)], positions, np.array(list(radii.values())))
        whole, waypoint_knots, blend_knots = cut_corners(robot, whole, waypoint_knots, corners)
    if (beyond := first_beyond(robot, whole)) is not None:
        raise _leaves_limits_error(robot, segments, whole, *beyond)
    ends = [waypoints[segment + 1] for segment in segments]
    return SegmentGroup(
        segments=segments,
        curve=whole,
        waypoint_knots=waypoint_knots,
        blend_knots=blend_knots,
        is_spline=all(isinstance(waypoint.motion, JointMotion) for waypoint in ends)
        and all(isinstance(transition, ThroughTransition) for transition in transitions),
        tolerance=_joint_tolerance(ends),
        tool_motions=tuple(segments[list(builder.tool)].tolist()),
        blended=tuple(waypoint for k in radii for waypoint in range(segments[k - 1] + 1, segments[k] + 1)),
        path_knots=builder.path_knots(whole),
    )


class _Builder:
    """The curve of each segment by itself."""

    def __init__(
        self,
        robot: Robot,
        waypoints: Sequence[AnyWaypoint],
        solved: Sequence[SolvedWaypoint],
        limits: SegmentLimits,
        segments: np.ndarray,
        transitions: Sequence[Transition],
    ) -> None:
        self.robot, self.waypoints, self.segments = robot, waypoints, segments
        self.passed = [isinstance(transition, ThroughTransition) for transition in transitions]
        self.positions = np.array([solved[k].position for k in (*segments, segments[-1] + 1)])
        self.speeds = counted_velocity(limits.velocity.narrower[segments])
        self.tool: dict[int, PiecewisePolynomial] = {}
        self.short: set[int] = set()
        self.knots: set[tuple[float, ...]] = set()
        for k, segment in enumerate(segments):
            motion = solved[segment + 1].tool_motion
            if motion is None:
                continue
            if is_joint_motion(solved[segment + 1]):
                self.short.add(k)
            else:
                self.tool[k] = self._tool_motion(k, motion.curve)
                inner = motion.path.breakpoints[1:-1]
                at = np.abs(motion.curve.breakpoints[:, None] - inner).argmin(axis=0)
                self.knots |= set(map(tuple, motion.curve.coefficients[at, :, 0].tolist()))
        self.times = (np.abs(np.diff(self.positions, axis=0)) / self.speeds).max(axis=1)
        for k, curve in self.tool.items():
            self.times[k] = curve.breakpoints[-1]
        for k, curve in self.tool.items():
            for beside, at in ((k - 1, 0.0), (k + 1, curve.breakpoints[-1])):
                if 0 <= beside < len(segments) and beside not in self.tool and self.passed[min(k, beside)]:
                    derivatives = np.concatenate(curve.evaluate(np.array([at]), [1, 2]))
                    slope, bend = (np.abs(derivatives) / self.speeds[beside]).max(axis=1)
                    self.times[beside] /= max(1.0, slope / MOST_END_SLOPE, np.sqrt(bend * self.times[beside] / BENT))

    def path_knots(self, curve: SegmentedPolynomial) -> np.ndarray:
        """Return indices of the breakpoints of a curve where a tool's path goes from one piece to the next.

        They are known by their joint positions, which neither stretching nor cutting corners changes.
        """
        starts = curve.coefficients[:, :, 0].tolist() if self.knots else []
        return np.array([k for k, start in enumerate(starts) if tuple(start) in self.knots], dtype=int)

    def curves(self) -> list[PiecewisePolynomial]:
        """Return the curve of each segment from the first to the last, in order.

        Joint motions are straight, or quintics beside a waypoint that is passed exactly. Between two of them each joint
        passes with the harmonic mean of its slopes, or zero where it reverses. So no joint overshoots (Fritsch and
        Butland 1984). Next to a tool motion they continue its derivatives.
        """
        lengths, positions = self.times, self.positions
        means = np.diff(positions, axis=0) / lengths[:, None]
        starts, ends = np.stack([means, np.zeros_like(means)]), np.stack([means, np.zeros_like(means)])
        passed = self.passed
        starts[0, 1:][passed] = ends[0, :-1][passed] = slopes_between(means[:-1], means[1:])[passed]
        for k, curve in self.tool.items():
            if k > 0 and passed[k - 1]:
                ends[:, k - 1] = np.concatenate(curve.evaluate(np.zeros(1), [1, 2]))
            if k < len(passed) and passed[k]:
                starts[:, k + 1] = np.concatenate(curve.evaluate(curve.breakpoints[-1:], [1, 2]))
        coefficients = quintic_hermite(lengths, (positions[:-1], *starts), (positions[1:], *ends))
        return [
            self.tool[k] if k in self.tool else PiecewisePolynomial(lengths[k : k + 1], own[None])
            for k, own in enumerate(coefficients)
        ]

    def _tool_motion(self, k: int, curve: PiecewisePolynomial) -> PiecewisePolynomial:
        """Scale a tool motion to its joints' time at full speed; one that continues another keeps its pace."""
        last = k - 1
        while last > 0 and self.passed[last] and last in self.short:
            last -= 1
        if k == 0 or not all(self.passed[last:k]) or last not in self.tool:
            return curve.stretched(float((np.abs(_steps(curve)) / self.speeds[k]).max(axis=1).sum()))
        before = self.tool[last].evaluate(self.tool[last].breakpoints[-1:], [1, 2])
        after = curve.evaluate(np.zeros(1), [1, 2])
        factor = float(np.linalg.norm(after[0]) / np.linalg.norm(before[0]))
        if last < k - 1:
            return curve.stretched(factor)
        turn = np.abs(before[0] - after[0] / factor).max() / np.abs(before[0]).max()
        bend = np.abs(before[1] - after[1] / factor**2).max() / max(1.0, np.abs(before[1]).max())
        if turn > ALMOST_TANGENT:
            message = (
                "the tool cannot pass this waypoint without stopping: its path has a corner here; blend it, or stop"
            )
            waypoint = int(self.segments[k])
            field = "waypoints", waypoint, "transition"
            remedies = [Remedy(field, StopTransition(), "come to rest at the waypoint")]
            if self.segments[k - 1] == waypoint - 1:  # of several at one position a stop of one is enough
                remedies.insert(0, Remedy(field, BlendTransition(RADIUS), "cut the corner within this radius, m"))
            raise InvalidProblem([(field, message)], remedies)
        curve = curve.stretched(factor)
        if max(turn, bend) > TANGENT:
            tolerances = [_tolerances(self.waypoints[segment + 1]) for segment in self.segments[[last, k]]]
            self.tool[last], curve = eased(self.robot, self.tool[last], curve, np.min(tolerances, axis=0))
        return curve


def _leaves_limits_error(
    robot: Robot,
    segments: np.ndarray,
    curve: SegmentedPolynomial,
    at: float,
    position: FloatArray,
    joint: int,
) -> JointPositionLimit:
    segment = int(curve.segments[curve.locate(np.array([at]))[0][0]])
    name, value = robot.joint_names[joint], float(position[joint])
    lower, upper = robot.joints[joint].lower, robot.joints[joint].upper
    limit = lower if value < (lower + upper) / 2.0 else upper
    ends = [k for k in (segment, segment + 1) if segments[0] < k <= segments[-1]]
    return passing_error(ends, segment, name, value, limit)


def _joint_tolerance(waypoints: Sequence[AnyWaypoint]) -> float:
    requested = [min(_tolerances(waypoint)) for waypoint in waypoints if not isinstance(waypoint.motion, JointMotion)]
    return min([JOINT_TOLERANCE, *(JOINT_TOLERANCE_SHARE * tolerance for tolerance in requested)])


def _tolerances(waypoint: AnyWaypoint) -> tuple[float, float]:
    """Return the tolerances, m and rad, of the motion of the tool to a waypoint."""
    motion = waypoint.motion
    assert isinstance(motion, CartesianMotion)  # noqa: S101 - asked of motions of the tool only
    return motion.tolerance_position, motion.tolerance_orientation


def passing_error(waypoints: Sequence[int], segment: int, joint: str, value: float, limit: float) -> JointPositionLimit:
    """Return the error where passing one of some waypoints without stopping takes a joint beyond its limit.

    Args:
        waypoints: Indices of the waypoints at the ends of the segment that are passed without stopping.
        segment: Index of the segment.
        joint: Name of the joint.
        value: The position at which the joint would be, rad or m.
        limit: The position limit that it breaks, rad or m.
    """
    return JointPositionLimit(
        f"passing waypoint {{waypoint}} without stopping would take {joint} beyond its limit {limit:.6g}",
        waypoint=waypoints[0],
        segment=segment,
        joint=joint,
        value=value,
        limit=limit,
        remedies=[Remedy(("waypoints", k, "transition"), StopTransition(), "come to rest there") for k in waypoints],
    )
