"""A path of the tool followed with the cheapest values of its open coordinates, made smooth."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from planner.kinematics.costs import tilts
from planner.kinematics.options import Preference
from planner.problems.regions import Region
from planner.robots import Robot
from planner.robots.tools import with_region_joints
from planner.spatial import FloatArray
from planner.tolerances import SAME_CONFIGURATION
from planner.tool_motions.follow import Lost
from planner.tool_motions.pose_paths import PosePath
from planner.tool_motions.position_limits import first_beyond
from planner.tool_motions.redundancy.coordinates import OpenCoordinates
from planner.tool_motions.redundancy.offset_paths import OffsetPath
from planner.tool_motions.redundancy.smoothing import curve_through, smoothed
from planner.tool_motions.redundancy.way import Way, cheapest_values, may_choose
from planner.trajectories.polynomials import PiecewisePolynomial, shifted

Follow = Callable[[Robot, PosePath, FloatArray, FloatArray | None], PiecewisePolynomial | Lost]
"""Follows a path with an arm from a joint position (joints,) to a given one or to any."""

FLAT_ENOUGH = 0.02
"""Mean tilt of the workpiece along a path, rad, up to which external axes alone are enough: a welder sees no more."""


def follow_by_choice(
    robot: Robot,
    path: PosePath,
    region: Region,
    start: FloatArray,
    ends: list[FloatArray],
    prefer: Preference,
    follow: Follow,
) -> Iterator[PiecewisePolynomial]:
    """Choose offsets and external axes along a path, and follow it with the arm.

    At first the external axes are chosen alone, then with the offsets. With `prefer` = `weld_flat` the cheaper comes
    first, unless the axes alone are flat enough. An arm of fewer than six joints has the last coordinates of the region
    as joints behind the tool.

    Args:
        robot: The robot, with its tool.
        path: The path as it is written, with rotations.
        region: The tolerance region of its poses; without ranges, the external axes alone are open.
        start: (joints,), at its start.
        ends: Joint positions (joints,), at one of which it ends; none: anywhere.
        prefer: The preference among the ways.
        follow: How the arm that is left follows a path.

    Yields:
        The positions of all joints over u from 0 to 1.
    """
    joints, names = robot.dof, list(region.ranges)
    missing = max(0, len(path.twist(0.0)) - (joints - len(robot.external_axes)))
    if missing > len(names):
        return
    if missing:
        longer = with_region_joints(robot, {name: region.ranges[name] for name in names[-missing:]})
        left = Region(**{name: region.ranges[name] for name in names[:-missing]})
        first, *last = (np.append(position, np.zeros(missing)) for position in (start, *ends))
        for curve in follow_by_choice(longer, path, left, first, last, prefer, follow):
            (end,) = curve.evaluate(curve.breakpoints[-1:], [0])[0]
            if first_beyond(longer, curve) is None and np.abs(end[joints:]).max() <= SAME_CONFIGURATION:
                yield PiecewisePolynomial(curve.lengths, curve.coefficients[:, :joints])
        return
    if not names and not robot.external_axes:  # the joints alone say where in the region the tool is
        curve_alone = follow(robot, path, start, ends[0] if ends else None)
        yield from [] if isinstance(curve_alone, Lost) else [curve_alone]
        return
    opened = (OpenCoordinates(robot, one) for one in dict.fromkeys([Region(), region]))
    found = (
        (coordinates, way)
        for coordinates in opened
        if may_choose(coordinates) and (way := cheapest_values(coordinates, path, start, ends, prefer)) is not None
    )
    for coordinates, way in _flattest_first(found) if prefer == "weld_flat" else found:
        chosen = _followed(coordinates, path, start, way, follow, ends_there=bool(ends))
        if chosen is not None:
            yield chosen


def _flattest_first(found: Iterator[tuple[OpenCoordinates, Way]]) -> Iterator[tuple[OpenCoordinates, Way]]:
    """Yield the cheaper way first, but do not search for more after one that is flat enough."""
    first = next(found, None)
    if first is not None and tilts(first[0].robot, first[1].positions).mean() <= FLAT_ENOUGH:
        yield first
        yield from found
        return
    yield from sorted([*([] if first is None else [first]), *found], key=lambda pair: pair[1].cost)


def _followed(
    coordinates: OpenCoordinates, path: PosePath, start: FloatArray, way: Way, follow: Follow, *, ends_there: bool
) -> PiecewisePolynomial | None:
    """Follow a path with the values of a way, made smooth; None: the arm cannot."""
    values, carried = np.clip(smoothed(way.values), coordinates.first, coordinates.last), coordinates.carried
    curve = curve_through(values, coordinates.lower, coordinates.upper)
    axes, offsets = (
        PiecewisePolynomial(curve.lengths, curve.coefficients[:, columns])
        for columns in (slice(None, carried), slice(carried, None))
    )
    breakpoints = np.union1d(path.breakpoints, curve.breakpoints[1:-1])
    moved = OffsetPath(path, coordinates.region, offsets, breakpoints, coordinates.frame, axes if carried else None)
    is_redundant = coordinates.arm.dof > len(path.twist(0.0))
    end = way.positions[-1, carried:] if ends_there or is_redundant else None
    arm = follow(coordinates.arm, moved, start[carried:], end)
    if isinstance(arm, Lost):
        return None
    return _beside(axes, arm) if carried else arm


def _beside(axes: PiecewisePolynomial, arm: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return the curve of external axes and of an arm whose pieces lie within the pieces of the axes."""
    begins = arm.breakpoints[:-1]
    pieces, _ = axes.locate(begins + 0.5 * arm.lengths)
    own = shifted(axes.coefficients[pieces], (begins - axes.breakpoints[pieces])[:, None])
    order = max(own.shape[2], arm.coefficients.shape[2])
    padded = PiecewisePolynomial(arm.lengths, own).padded(order), arm.padded(order)
    return PiecewisePolynomial(arm.lengths, np.concatenate([one.coefficients for one in padded], axis=1))
