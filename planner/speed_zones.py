"""The proof of where a robot is near to objects, and of how fast its points move there, for whole intervals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner.constraints import Constraint
from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.kinematics.forward import JointStates
from planner.robots import Robot
from planner.scene.bodies import Bodies, Body, Placements, excursions
from planner.scene.checker import CollisionChecker
from planner.scene.continuous import DEFAULT_BUDGET
from planner.scene.scene import Scene
from planner.shapes import Sphere
from planner.spatial import FloatArray
from planner.tolerances import CONTINUITY_TOLERANCE, ROUNDING
from planner.trajectories.polynomials import PiecewisePolynomial, horner

INTERVALS_AT_ONCE = 512
"""The number of intervals that are looked at together: enough for array operations, in some MiB."""

RESOLUTION = 1e-3
"""Largest movement of the robot, m, in an interval that counts as near without proof.

Such an interval is closer than the requested distance plus twice this value.
"""

FIRST_PARTS = 32
"""Number of intervals that a motion is cut into at first."""

SPEED_BOUND_EXCESS = 5e-3
"""Relative amount by which the bound on a speed may exceed the largest speed that was seen."""

DECIDED_TO = 1e-4
"""The same where that decides whether a limit is kept."""

ZONE_TIME_ACCURACY = 1e-3
"""Accuracy of the times at which a motion is too fast, as a fraction of its duration."""

MOST_ZONE_INTERVALS = 50_000
"""The largest number of intervals with bounds on speeds.

Beyond it, the bounds found so far stand.
"""

TOOL_POINT = Sphere(1e-6)
"""The shape of the tool centre point, which belongs to the robot whether its shapes reach there or not."""


@dataclass(frozen=True)
class SpeedZone:
    """A speed limit for every point of the robot near objects.

    The points are all points of its links and carried objects, and the tool centre point. It is not a safety function.

    Attributes:
        clearance: The zone: where the distance of the robot from these objects may be less than this, m.
        speed: The highest speed there of any point, m/s.
        objects: Names of objects that have this zone about them, one or more; None: all of the scene that stand still.

    Examples:
        >>> import planner
        >>> planner.SpeedZone(clearance=0.5, speed=0.25, objects=["walkway"]).objects
        ('walkway',)
    """

    clearance: float
    speed: float
    objects: Sequence[str] | None = None

    def __post_init__(self) -> None:
        """Keep the names in a tuple, which cannot change."""
        if self.objects is not None:
            object.__setattr__(self, "objects", tuple(self.objects))


@dataclass(frozen=True, eq=False)
class PointSpeed(Constraint):
    """The highest speed of all points of bodies, as `point_speeds` bounds it."""

    bodies: Bodies
    name: str = "point_speed"
    unit: str = "m/s"
    order: int = 1

    def values(self, states: JointStates) -> FloatArray:
        """Return the speeds (N, 1), m/s."""
        return point_speeds(self.bodies, states.q, states.v)[:, None]


def refuse_zone_faults(scene: Scene | None, zones: Sequence[SpeedZone]) -> None:
    """Refuse speed zones that cannot be.

    Raises:
        InvalidProblem: With every fault found.
    """
    if faults := list(speed_zone_faults(scene, zones)):
        raise InvalidProblem(faults)


def speed_zone_faults(scene: Scene | None, zones: Sequence[SpeedZone]) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of the speed zones of a scene."""
    if scene is None:
        if zones:
            yield ("speed_zones",), "there is no scene with objects to be near to"
        return
    known = {thing.id for thing in scene.objects} | {held.id for held in scene.attached}
    moving = [thing.id for thing in scene.objects if thing.motion is not None]
    for i, zone in enumerate(zones):
        for name in ("clearance", "speed"):
            if not 0.0 < getattr(zone, name) < np.inf:
                yield ("speed_zones", i, name), "must be greater than 0, and have an end"
        if zone.objects is not None and not zone.objects:
            yield (
                ("speed_zones", i, "objects"),
                "a zone about no object slows nothing; without this field it is about all",
            )
        for k, name in enumerate(zone.objects or ()):
            if name not in known:
                yield ("speed_zones", i, "objects", k), f"nothing in the scene is called {name!r}"
            elif name in moving:
                yield ("speed_zones", i, "objects", k), f"must be a static object: {name!r} has a `motion`"
        if zone.objects is None and moving:
            yield ("speed_zones", i, "objects"), f"must name static objects: {moving[0]!r} has a `motion`"


def moving_bodies(robot: Robot, checker: CollisionChecker) -> Bodies:
    """Return the moving bodies: the pieces of a robot, its carried objects, and its tool centre point."""
    frame = robot.model.frames[robot.tool_frame_id]
    tool = Body.on(robot, "tool", int(frame.parentJoint), frame.placement, TOOL_POINT)
    return Bodies(checker.bodies.tree, [*checker.bodies.pieces, tool])


def near_intervals(
    checker: CollisionChecker, motion: PiecewisePolynomial, clearance: float, objects: Sequence[str] | None
) -> FloatArray:
    """Find the times outside of which a robot provably keeps a distance from objects.

    Pairs that may touch by the scene's word do not count.

    Args:
        checker: The robot and its obstacles.
        motion: The motion of the joints, rad or m.
        clearance: The distance, m.
        objects: Names of the objects that count; None: all.

    Returns:
        Intervals (N, 2), s, ascending and apart from each other.
    """
    counts = np.array([objects is None or obstacle.name in objects for obstacle in checker.obstacles.all], dtype=bool)
    wanted = np.where(np.isfinite(checker.margins) & counts, clearance, -np.inf)
    if not np.isfinite(wanted).any():
        return np.empty((0, 2))
    edges = np.linspace(0.0, float(motion.breakpoints[-1]), FIRST_PARTS + 1)
    waiting, near, looked_at = np.column_stack([edges[:-1], edges[1:]]), [np.empty((0, 2))], 0
    while len(waiting):
        now, waiting = waiting[:INTERVALS_AT_ONCE], waiting[INTERVALS_AT_ONCE:]
        looked_at += len(now)
        is_near, is_open = _nearness(checker, motion, now, wanted, clearance)
        if looked_at > DEFAULT_BUDGET.positions:
            near += [now[is_open], waiting]
            waiting = np.empty((0, 2))
        else:
            waiting = np.concatenate([waiting, _halved(now[is_open])])
        near.append(now[is_near])
    return _merged(np.concatenate(near))


def _nearness(
    checker: CollisionChecker, motion: PiecewisePolynomial, intervals: FloatArray, wanted: FloatArray, clearance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return which intervals (N, 2) count as near, and which (N,) to halve; all others are proved far."""
    starts, ends = intervals.T
    positions = motion.evaluate((starts + ends) / 2.0, [0])[0]
    placements = checker.bodies.at(positions)
    near = checker.near_items(positions, excursions(motion, starts, ends, positions), wanted, -np.inf)
    is_near, is_open = np.zeros((2, len(intervals)), dtype=bool)
    for item in np.argsort(near.bounds - near.motions, kind="stable").tolist():
        row, moved = int(near.rows[item]), near.motions[item]
        if is_near[row] or is_open[row]:
            continue
        apart = checker.separate(placements, row, int(near.pairs[item]))
        if apart.proved - moved < clearance:
            is_near[row] = moved < RESOLUTION or apart.distance + moved < clearance
            is_open[row] = not is_near[row]
    return is_near, is_open


def _halved(intervals: FloatArray) -> FloatArray:
    starts, ends = intervals.T
    middles = (starts + ends) / 2.0
    return np.concatenate([np.column_stack([starts, middles]), np.column_stack([middles, ends])])


def _merged(intervals: FloatArray) -> FloatArray:
    """Sort intervals (N, 2) and merge adjacent ones."""
    intervals = intervals[np.argsort(intervals[:, 0])]
    apart = intervals[1:, 0] > intervals[:-1, 1]
    starts, ends = intervals[:1, 0], intervals[-1:, 1]
    return np.column_stack([np.append(starts, intervals[1:, 0][apart]), np.append(intervals[:-1, 1][apart], ends)])


def point_speeds(bodies: Bodies, positions: FloatArray, velocities: FloatArray) -> FloatArray:
    """Bound the speed (N,) of every point of the bodies at joint positions and velocities (N, joints), m/s.

    The speed of a rigid body's points is a convex function of the point. Within a capsule it is largest on the spheres
    about the ends of its axis. There it is at most the speed of the centre plus the radius times the angular speed.
    """
    speeds: FloatArray = _speeds(bodies, bodies.at(positions), velocities).max(axis=1, initial=0.0)
    return speeds


def _speeds(bodies: Bodies, placements: Placements, velocities: FloatArray) -> FloatArray:
    """Return the bounds (N, bodies) of `point_speeds`."""
    angular, linear = _twists(bodies, placements, velocities)
    at_ends = np.linalg.norm(_at_ends(placements, angular, linear), axis=-1).max(axis=2)
    speeds: FloatArray = at_ends + np.linalg.norm(angular, axis=-1) * bodies.radii
    return speeds


def _twists(bodies: Bodies, placements: Placements, velocities: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the angular velocities (N, bodies, 3), rad/s, and the velocities at the origin of the base, m/s."""
    axes, origins = placements.rotations[:, 1:, :, 2], placements.origins[:, 1:]
    turning = np.where(bodies.is_angle[:, None], axes, 0.0) * velocities[..., None]
    shifting = np.where(bodies.is_angle[:, None], np.cross(origins, axes), axes) * velocities[..., None]
    moved = bodies.is_moved.astype(np.float64)
    return moved @ turning, moved @ shifting


def _at_ends(placements: Placements, angular: FloatArray, linear: FloatArray) -> FloatArray:
    """Return the velocities (N, bodies, 2, 3) of the ends of the axes of the capsules, m/s."""
    return np.cross(angular[:, :, None], placements.spheres[:, :, [0, -1]]) + linear[:, :, None]


def speed_reached(bodies: Bodies, motion: PiecewisePolynomial, time: float) -> tuple[float, str]:
    """Find a speed that a point of the bodies really reaches, close to the largest.

    Let v be the velocity at the origin and w the angular velocity. A point x then has the speed u.v + (u x w).x along
    a unit vector u. The support of a body's shape gives the largest such speed of the body. Along the velocities of the
    ends of its capsule it is close to the largest of all.

    Args:
        bodies: The moving bodies.
        motion: The motion of the joints, rad or m.
        time: When, s.

    Returns:
        A speed, m/s, that a point of a body reaches then, and the name of the body.
    """
    positions, velocities = motion.evaluate(np.array([time]), [0, 1])
    placements = bodies.at(positions)
    angular, linear = _twists(bodies, placements, velocities)
    ways = _at_ends(placements, angular, linear)[0]
    highest, name = 0.0, bodies.pieces[0].name
    for k, piece in enumerate(bodies.pieces):
        lengths = np.linalg.norm(ways[k], axis=1)
        along = ways[k][lengths > 0.0] / lengths[lengths > 0.0, None]
        turn, origin = placements.rotations[0, piece.joint], placements.origins[0, piece.joint]
        at = linear[0, k] + np.cross(angular[0, k], origin + turn @ piece.translation)
        reached = along @ at + piece.shape.support(np.cross(along, angular[0, k]) @ turn @ piece.rotation)
        if reached.max(initial=0.0) > highest:
            highest, name = float(reached.max()), piece.name
    return highest, name


def most_speed(
    bodies: Bodies, motion: PiecewisePolynomial, intervals: FloatArray, limit: float = np.inf
) -> tuple[float, float]:
    """Bound the speed of every point of the bodies at all times of intervals.

    A joint j moves a point with J_j(q) q_j'. Within an interval, the Bernstein coefficients bound the deviation of q_j'
    from its value in the middle. The joints before j turn J_j by at most the sum of their excursions. The joint j and
    the joints after it move the point by at most the bound in the proof of clearances. The function halves intervals
    until the bound of each is within `SPEED_BOUND_EXCESS` of a reached speed, or `DECIDED_TO` if the limit lies between
    the two.

    Args:
        bodies: The moving bodies.
        motion: The motion of the joints, rad or m.
        intervals: (N, 2), s.
        limit: The speed, m/s, of which it is to be decided whether it is kept.

    Returns:
        The bound, m/s, and when nearly that was seen, s.
    """
    rates = PiecewisePolynomial(motion.lengths, motion.derivative_coefficients(1))
    seen, time, bound, looked_at = 0.0, float(intervals[0, 0]), 0.0, 0
    waiting = _without_jumps(rates, intervals)
    while len(waiting):
        now, waiting = waiting[:INTERVALS_AT_ONCE], waiting[INTERVALS_AT_ONCE:]
        looked_at += len(now)
        starts, ends = now.T
        speeds, changes = _speeds_within(bodies, motion, rates, now)
        most = (speeds + changes).max(axis=1, initial=0.0) * (1.0 + ROUNDING)
        fastest = int(speeds.max(axis=1).argmax())
        if (speed := float(speeds[fastest].max())) > seen:
            seen, time = speed, float(starts[fastest] + ends[fastest]) / 2.0
        is_open = most > seen * (1.0 + SPEED_BOUND_EXCESS)
        if seen <= limit:
            is_open |= most > max(limit, seen * (1.0 + DECIDED_TO))
        is_open &= looked_at < MOST_ZONE_INTERVALS
        is_open &= ends - starts > ROUNDING * float(motion.breakpoints[-1])
        bound = max(bound, float(most[~is_open].max(initial=0.0)))
        waiting = np.concatenate([waiting, _halved(now[is_open])])
    return bound, time


def fast_intervals(bodies: Bodies, motion: PiecewisePolynomial, intervals: FloatArray, limit: float) -> FloatArray:
    """Find the times outside of which, within intervals, no point of the bodies is faster than a limit.

    Args:
        bodies: The moving bodies.
        motion: The motion of the joints, rad or m.
        intervals: (N, 2), s.
        limit: The speed, m/s.

    Returns:
        Intervals (M, 2), s, ascending and apart from each other; at their ends up to `ZONE_TIME_ACCURACY` of the
        motion too long.
    """
    rates = PiecewisePolynomial(motion.lengths, motion.derivative_coefficients(1))
    waiting, fast, looked_at = _without_jumps(rates, intervals), [np.empty((0, 2))], 0
    shortest = ZONE_TIME_ACCURACY * float(motion.breakpoints[-1])
    while len(waiting):
        now, waiting = waiting[:INTERVALS_AT_ONCE], waiting[INTERVALS_AT_ONCE:]
        looked_at += len(now)
        speeds, changes = _speeds_within(bodies, motion, rates, now)
        may_be = (speeds + changes).max(axis=1, initial=0.0) * (1.0 + ROUNDING) > limit
        is_fast = (speeds - changes).max(axis=1, initial=0.0) > limit
        is_fast |= (now[:, 1] - now[:, 0] <= shortest) | (looked_at >= MOST_ZONE_INTERVALS)
        fast.append(now[may_be & is_fast])
        waiting = np.concatenate([waiting, _halved(now[may_be & ~is_fast])])
    found = np.concatenate(fast)
    return _merged(found) if len(found) else found


def _without_jumps(rates: PiecewisePolynomial, intervals: FloatArray) -> FloatArray:
    """Cut intervals (N, 2), s, at jumps of a joint's velocity, where no bound on its change is small."""
    begin, end = rates.coefficients[:, :, 0], horner(rates.coefficients, rates.lengths[:, None])
    jumps = np.abs(begin[1:] - end[:-1]).max(axis=1) > CONTINUITY_TOLERANCE * np.abs(begin).max()
    at = rates.breakpoints[1:-1][jumps]
    first, last = np.searchsorted(at, intervals[:, 0], side="right"), np.searchsorted(at, intervals[:, 1], side="left")
    parts = [
        np.concatenate([[start], at[i:k], [stop]])
        for (start, stop), i, k in zip(intervals.tolist(), first.tolist(), last.tolist(), strict=True)
    ]
    return np.concatenate([np.column_stack([part[:-1], part[1:]]) for part in parts])


def _speeds_within(
    bodies: Bodies, motion: PiecewisePolynomial, rates: PiecewisePolynomial, intervals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Bound the speeds (N, bodies) in the middles of intervals (N, 2), s, and their changes within, m/s."""
    starts, ends = intervals.T
    positions, velocities = motion.evaluate((starts + ends) / 2.0, [0, 1])
    placements = bodies.at(positions)
    reach, faster = excursions(motion, starts, ends, positions), excursions(rates, starts, ends, velocities)
    changes = _speed_changes(bodies, placements, np.abs(velocities), reach, faster)
    return _speeds(bodies, placements, velocities), changes


def _speed_changes(
    bodies: Bodies, placements: Placements, velocities: FloatArray, reach: FloatArray, faster: FloatArray
) -> FloatArray:
    """Bound the changes of the speeds of points (N, bodies) for given excursions of the joints.

    Args:
        bodies: The moving bodies.
        placements: The placements at N joint positions.
        velocities: Magnitudes (N, joints) of the joints' velocities there.
        reach: Largest excursions of the joints (N, joints), rad or m.
        faster: Largest changes of their velocities (N, joints).
    """
    moved, is_angle = bodies.is_moved.astype(np.float64), bodies.is_angle
    displacements = bodies.displacements(placements, reach)
    from_here_on = np.flip(np.cumsum(np.flip(displacements, axis=2), axis=2), axis=2)
    turns = moved * np.where(is_angle, reach, 0.0)[:, None]
    turned = np.minimum(np.cumsum(turns, axis=2) - turns, np.pi)
    columns = placements.levers * 2.0 * np.sin(turned / 2.0) + np.where(is_angle, from_here_on, 0.0)
    changes = placements.levers * faster[:, None] + columns * moved * (velocities + faster)[:, None]
    total: FloatArray = changes.sum(axis=2)
    return total
