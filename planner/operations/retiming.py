"""Time put on a dense list of joint positions: smoothed within a tolerance, timed by any back end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from planner.backends import BackEnd
from planner.backends.base import enforced
from planner.backends.shared.assembly import assemble
from planner.backends.splines.cubic import Cubic
from planner.errors import InvalidProblem, JointPositionLimit
from planner.fields import BACK_END, KIND
from planner.guarantees import END_OPTIONS, end_states, leaves_straight_motions
from planner.kinematics.turns import counted_velocity
from planner.limits import Limits
from planner.operations.certified import CertifiedTrajectory, certified, kept_clear
from planner.operations.smoothing import smooth_curve_near
from planner.paths import JointPath, solve_path
from planner.paths.segment_groups import SegmentGroup
from planner.problems.check import check_problem
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import StopTransition, ThroughTransition
from planner.robots import Robot
from planner.scene import Scene
from planner.spatial import FloatArray
from planner.speed_zones import SpeedZone
from planner.timing.slowing import slowed
from planner.tolerances import POSITION_TOLERANCE
from planner.tool_motions.position_limits import first_beyond
from planner.trajectories.polynomials import PiecewisePolynomial

MAX_DEVIATION = 1e-3
"""Default largest distance of a joint from the points, rad or m: a millimetre at the end of an arm of 1 m."""

SHARE_OF_TIMING = 0.05
"""Share of this distance that timing may use up."""

MOST_KNOTS = 16
"""Number of intervals, at most, on each of which a back end chooses a speed, without intervals of no length."""

STRAIGHT_CURVATURE = 1e-9
"""Second derivative by the curve's length of 1, rad or m, below which a curve of one piece is a straight motion."""


@dataclass(frozen=True, eq=False)
class RetimedTrajectory(CertifiedTrajectory):
    """A list of joint positions with time on it.

    Attributes:
        backend: What put time on it.
        deviation: The largest distance of a joint from the points and the chords between them, rad or m.
    """

    backend: BackEnd
    deviation: float


def retime_trajectory(
    robot: Robot,
    points: ArrayLike,
    backend: BackEnd = Cubic(),
    *,
    max_deviation: float = MAX_DEVIATION,
    limits: Limits = Limits(),
    scene: Scene | None = None,
    self_collision: bool | None = None,
    speed_zones: Sequence[SpeedZone] = (),
) -> RetimedTrajectory:
    """Time a dense list of joint positions, from rest to rest.

    First, the function smooths the points. The path is the stiffest curve found within the allowed distance from the
    points and from the chords between them. Smaller noise vanishes, and corners are rounded. In a speed zone the robot
    slows down on this path.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        points: (N, joints), rad or m, of any origin; repeated points count once.
        backend: What puts time on the path.
        max_deviation: Largest distance of a joint from the points and the chords between them, rad or m.
        limits: Additional limits, no wider than the robot's.
        scene: The obstacles; the clearance of the result from them is proved. None: none.
        self_collision: Whether the arm is checked against itself; see `PlanningProblem.self_collision`.
        speed_zones: Speeds that no point of the robot exceeds near objects of the scene.

    Raises:
        InvalidProblem: Points of another shape or not finite, limits wider than the robot's, or a back end that leaves
            the curve. Also ramps of given times where a speed zone slows the motion; see also `kept_clear`.
        JointPositionLimit: A point, or the curve between points, is beyond a joint's position limits.
        LimitsUnsatisfiable: No duration keeps the limits.
        Collision: The robot would come too near to itself, or to something around it.
        ClearanceUnproved: That it does not could not be proved.
    """
    requested = PlanningProblem(
        robot,
        (),
        limits=limits,
        start_tolerance=0.0,
        scene=scene,
        self_collision=self_collision,
        speed_zones=speed_zones,
    )
    path, deviation = _path(requested, np.asarray(points, dtype=np.float64), backend, max_deviation)
    trajectory = backend.parametrize(path) if len(path.moving) else assemble(path, [])
    trajectory = slowed(replace(requested, waypoints=_waypoints(path.positions)), backend, path, trajectory)
    done = certified(robot, replace(trajectory, warnings=()), limits, enforced(backend))
    done = kept_clear(done, scene, self_collision, speed_zones)
    warnings = (*done.warnings, *trajectory.warnings)
    return RetimedTrajectory(**vars(done) | {"warnings": warnings}, backend=backend, deviation=deviation)


def _path(
    requested: PlanningProblem, points: np.ndarray, backend: BackEnd, max_deviation: float
) -> tuple[JointPath, float]:
    """Return the path along a smooth curve near the points, and its distance from them after timing."""
    robot = requested.robot
    if points.ndim != 2 or len(points) < 1 or points.shape[1] != robot.dof:
        shape = " x ".join(map(str, points.shape))
        message = f"{shape} values: rows of the {robot.dof} joints of {robot.id} are needed"
        raise InvalidProblem([(("points",), message)])
    if not np.isfinite(points).all():
        raise InvalidProblem([(("points",), "must be finite numbers")])
    if not 0.0 < max_deviation < np.inf:
        raise InvalidProblem([(("max_deviation",), "must be greater than 0")])
    check_problem(replace(requested, waypoints=_waypoints(points[[0, -1]])), backend)
    problem = replace(requested, waypoints=_waypoints(points[[0, -1]]), scene=None, self_collision=None, speed_zones=())
    _refuse_other_ways(backend, robot.dof)
    velocity = counted_velocity(problem.segment_limits().velocity.narrower[0])
    smooth = smooth_curve_near(points, velocity, max_deviation)
    if smooth is None:
        still = replace(problem, waypoints=_waypoints(points[[0, 0]]))
        return solve_path(still), float(np.abs(points - points[0]).max())
    curve = smooth.curve
    _refuse_beyond(robot, curve)
    by_phase = getattr(backend, "synchronization", "phase") == "phase"  # which moves the joints straight by itself
    if by_phase and len(curve.lengths) == 1 and _is_straight(curve):
        return solve_path(problem), smooth.deviation
    timing = SHARE_OF_TIMING * max_deviation
    knots = np.array([0, len(curve.lengths)])
    if np.abs(points[0] - points[-1]).max() <= POSITION_TOLERANCE:  # between two waypoints there is to be a way
        at = curve.evaluate(curve.breakpoints, [0])[0]
        knots = np.insert(knots, 1, int(np.abs(at - at[0]).max(axis=1).argmax()))
    solved = solve_path(replace(problem, waypoints=_waypoints(curve.evaluate(curve.breakpoints[knots], [0])[0])))
    steps = 2 if requested.speed_zones else 1  # the back end's, and that which slows its motion
    return _along(solved, curve, knots, timing / steps), smooth.deviation + timing


def _waypoints(positions: FloatArray) -> tuple[JointWaypoint, ...]:
    """Make waypoints at joint positions (N, joints), all passed except the ends."""
    last = len(positions) - 1
    return tuple(
        JointWaypoint(tuple(position), transition=ThroughTransition() if 0 < k < last else StopTransition())
        for k, position in enumerate(positions.tolist())
    )


def _refuse_other_ways(backend: BackEnd, joints: int) -> None:
    """Refuse back ends that choose their own path, or that request motion at the ends."""
    kind = backend.kind
    if leaves_straight_motions(backend):
        message = f"{kind} chooses its own path between waypoints; use a back end that keeps to the path"
        raise InvalidProblem([((BACK_END, KIND), message)])
    ends = end_states(backend, joints)
    if ends.starts_moving or ends.ends_moving:
        requested = [name for name in END_OPTIONS if any(getattr(backend, name) or ())]
        raise InvalidProblem([((BACK_END, name), "points are timed from rest to rest") for name in requested])


def _is_straight(curve: PiecewisePolynomial) -> bool:
    bends = np.abs(curve.coefficients[0, :, 2:]) * curve.lengths[0] ** np.arange(2, curve.coefficients.shape[2])
    return bool(bends.max() <= STRAIGHT_CURVATURE)


def _along(path: JointPath, curve: PiecewisePolynomial, waypoint_knots: np.ndarray, tolerance: float) -> JointPath:
    """Return a path with one segment group along a curve; back ends choose their speed by parts."""
    pieces, segments = len(curve.lengths), np.arange(len(waypoint_knots) - 1)
    knots = np.unique(np.linspace(0, pieces, min(pieces, MOST_KNOTS) + 1).round().astype(int))
    group = SegmentGroup(
        segments=segments,
        curve=curve.of_segments(np.repeat(segments, np.diff(waypoint_knots))),
        waypoint_knots=waypoint_knots,
        blend_knots=knots[1:-1],
        is_spline=False,
        tolerance=tolerance,
    )
    return replace(path, groups=(group,))


def _refuse_beyond(robot: Robot, curve: PiecewisePolynomial) -> None:
    """Refuse a curve that leaves the position limits.

    Raises:
        JointPositionLimit: Naming the joint.
    """
    beyond = first_beyond(robot, curve)
    if beyond is None:
        return
    _, position, joint = beyond
    own, value = robot.joints[joint], float(position[joint])
    limit = own.lower if value < (own.lower + own.upper) / 2.0 else own.upper
    message = f"the curve near the points takes {own.name} to {value:.6g}, beyond its position limit {limit:.6g}"
    raise JointPositionLimit(message, joint=own.name, value=value, limit=limit)
