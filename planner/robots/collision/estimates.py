"""Collision shapes without a model: capsules along an arm, and outlines of machines by their reach in directions.

The links of a joint run from that joint to the next one the way arms are built and Denavit-Hartenberg tables describe
them: along its own axis, along the common normal of the two axes, along the next axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from planner.shapes import Capsule, ConvexHull, Sphere
from planner.shapes.shape import LEAST_SIZE, MOST_SIZE
from planner.spatial import FloatArray, rotation_with_z_along

OUTLINE_UNCERTAINTY = 0.01
"""Largest distance of a machine's surface outside the outline of its maker's drawings, m: cables, covers, later
changes."""

DIRECTIONS_IN_A_PLANE = 16
"""Number of directions in each of the planes xy, yz and zx: a cylinder along an axis becomes 2 % wider at most."""


def outline_directions() -> FloatArray:
    """Return the unit vectors (42, 3) of an outline: in the planes xy, yz and zx, each direction once."""
    angles = 2.0 * np.pi * np.arange(DIRECTIONS_IN_A_PLANE) / DIRECTIONS_IN_A_PLANE
    c, s, zero = np.round(np.cos(angles), 12), np.round(np.sin(angles), 12), np.zeros(DIRECTIONS_IN_A_PLANE)
    directions = np.concatenate([np.column_stack(plane) for plane in ((c, s, zero), (zero, c, s), (s, zero, c))])
    first = np.unique(directions, axis=0, return_index=True)[1]
    return directions[np.sort(first)]


class Outline(NamedTuple):
    """A convex part of a machine.

    Attributes:
        reach: Largest n . x over the part, of each of the directions (42,), m; positive: the origin is inside.
    """

    reach: tuple[float, ...]

    def hull(self) -> ConvexHull:
        """Return the largest convex shape with this reach."""
        from scipy.spatial import ConvexHull as Qhull  # here: a process that needs no hull stays small

        # The corners are the polars of the faces of the polar hull.
        faces = Qhull(outline_directions() / np.array(self.reach)[:, None]).equations
        return ConvexHull(np.unique(np.round(-faces[:, :3] / faces[:, 3:], 7), axis=0))


RADIUS_PER_REACH = 0.05
"""Radius of a derived capsule per length of the arm: that of the forearms of UR5e and FR3 is 0.05 to 0.06 of it."""

LONGEST_DETOUR = 1.75
"""Length of the way along axes and their common normal relative to the straight one, up to which a link is built that
way: three legs at right angles have the square root of 3. Axes that nearly meet far away have more."""

PARALLEL = 1e-6
"""Sine of the angle between two axes below which they have no common normal of their own."""


def derived_capsules(
    model: pin.Model, tip_frame: str, travels: Sequence[float], radii: Sequence[float]
) -> Iterator[tuple[str, pin.SE3, Capsule | Sphere]]:
    """Derive capsules along an arm.

    Args:
        model: A serial chain in which every joint moves along its own z axis.
        tip_frame: Name of the link at its end.
        travels: Largest extension of each prismatic joint, m, which is the length of the rod behind it; 0 for a
            revolute joint.
        radii: Radius of the base and of what each joint carries, m; none: `RADIUS_PER_REACH` of the arm's length.

    Yields:
        The link of a capsule, the placement of the capsule in that link, and the capsule. It is a ball if two joints
        are at one point.
    """
    tip = model.frames[model.getFrameId(tip_frame, pin.FrameType.BODY)].placement
    nexts = [*model.jointPlacements.tolist()[1:], tip]  # of what each joint carries: where it ends
    lengths = [float(np.linalg.norm(placement.translation)) for placement in nexts]
    radius = min(max(RADIUS_PER_REACH * (sum(lengths) + sum(travels)), LEAST_SIZE), MOST_SIZE)
    for number, after in enumerate(nexts):
        links = (own for own in model.frames if own.type == pin.FrameType.BODY and own.parentJoint == number)
        frame = next(links, None)
        if frame is None or (number == 0 and lengths[0] < LEAST_SIZE):
            continue
        own_radius = radii[number] if radii else radius
        points = _corners(after)
        if number == 0 or (number == 1 and lengths[0] < LEAST_SIZE):
            leg = points[1] - points[0]  # the arm stands on its support
            length = float(np.linalg.norm(leg))
            points[0] = points[0] + (min(1.0, own_radius / length) * leg if length else leg)
        if number and travels[number - 1] > LEAST_SIZE:
            behind = points[0] - np.array([0.0, 0.0, travels[number - 1]])
            points = [behind, *points] if lengths[number] >= LEAST_SIZE else [behind, points[0]]
        for start, end in pairwise(points):
            yield frame.name, *_between(frame.placement, start, end, own_radius)


def _corners(after: pin.SE3) -> list[FloatArray]:
    """Return points from the origin to the next frame along z, the common normal and the next frame's z."""
    start, end = np.zeros(3), after.translation
    own, other = np.array([0.0, 0.0, 1.0]), after.rotation[:, 2]
    normal = np.cross(own, other)
    sine = float(np.linalg.norm(normal))
    if sine < PARALLEL:
        corners = [start, end * own, end]
    else:
        # The feet of the common normal: s own + h normal = end + t other.
        s, _, t = np.linalg.solve(np.column_stack([own, normal / sine, -other]), end)
        corners = [start, s * own, end + t * other, end]
    points = [start]
    for corner in corners[1:]:
        if np.linalg.norm(corner - points[-1]) > LEAST_SIZE:
            points.append(corner)
    if sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points)) > LONGEST_DETOUR * float(np.linalg.norm(end)):
        points = [start, end]
    return points if len(points) > 1 else [start, start]


def _between(link: pin.SE3, start: FloatArray, end: FloatArray, radius: float) -> tuple[pin.SE3, Capsule | Sphere]:
    """Return the capsule between two points in a joint's frame, and its placement in a link that the joint carries."""
    length = float(np.linalg.norm(end - start))
    if length < LEAST_SIZE:
        return link.actInv(pin.SE3(np.eye(3), start)), Sphere(radius)
    rotation = rotation_with_z_along((end - start) / length)
    return link.actInv(pin.SE3(rotation, (start + end) / 2.0)), Capsule(radius, min(length, MOST_SIZE))
