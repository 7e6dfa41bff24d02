"""Distances of convex shapes that are proved by a plane between them.

A distance algorithm of coal (GJK, or EPA where shapes overlap) suggests a direction n. The separation
of the supports of both shapes along n is a lower bound of their signed distance, for any n. It is separation(n) = min
over b of n . b - max over a of n . a. The algorithm's own distance and verdict prove nothing.
"""

from __future__ import annotations

import threading
from typing import NamedTuple

import coal
import numpy as np

from planner.scene.point_cloud import Cluster
from planner.shapes import Capsule, HalfSpace, Shape, Sphere
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

GJK_TOLERANCE = 1e-9
"""Tolerance of GJK's distance, m: with its default of a micrometre curved shapes come out up to 40 micrometres off."""

SUSPICIOUS = 1e-4
"""Difference between a distance and the distance proved by its plane, m, above which another algorithm is tried.

It is usually some nanometres, and several millimetres for one in a million pairs of hulls.
"""

TOUCHING = 1e-8
"""Difference between a distance and the distance proved by its plane, m, above which the algorithm runs again.

The second run has the second shape a little further away. For touching flat shapes, GJK's normal is off by 1e-4 and
proves up to 0.1 mm less.
"""

SPECK = Sphere(1e-6)
"""The ball that replaces balls of point clouds, so that coal needs one geometry for all of them."""

WITHOUT_TURN = np.eye(3)
"""The rotation of balls."""

NO_NORMAL = np.zeros(3)
"""The normal if no single plane proves a distance, or no other joint position has a use for it."""

UNIT_ERROR = 0.5
"""Difference of the length of a normal from 1 above which it is none, or no number."""


class Separation(NamedTuple):
    """The signed distance of two shapes; negative: the depth of their overlap.

    Attributes:
        proved: A lower bound of the signed distance, m, rounding included.
        distance: An upper bound of it, as computed, m.
        point: (3,), m: a point of the first shape that is nearest to, or deepest in, the second.
        normal: (3,): of the plane that proves it, from the first shape to the second; zero: no other joint position has
            a use for it.
    """

    proved: float
    distance: float
    point: FloatArray
    normal: FloatArray


class Placed(NamedTuple):
    """A shape where it stands.

    Attributes:
        shape: The shape in its own frame.
        rotation: (3, 3).
        translation: (3,), m.
    """

    shape: Shape
    rotation: FloatArray
    translation: FloatArray

    def support(self, direction: FloatArray) -> float:
        """Compute the support of the shape along a unit vector (3,), m."""
        reach = self.shape.support((direction @ self.rotation)[None])[0]
        return float(reach + direction @ self.translation)


def separation(first: Placed, second: Placed) -> Separation:
    """Compute the distance of two convex shapes; the second may be a half space."""
    if isinstance(second.shape, HalfSpace):
        return _above_plane(first, second)
    found = _by_gjk(first, second, _request)
    if found.distance - found.proved > TOUCHING and abs(found.distance) < SUSPICIOUS:
        moved = second._replace(translation=second.translation + SUSPICIOUS * found.normal)
        n = _by_gjk(first, moved, _request).normal
        proved = _across(first, second, n)
        if proved > found.proved:
            found = found._replace(proved=proved, distance=max(found.distance, proved), normal=n)
    if found.distance - found.proved < SUSPICIOUS:
        return found
    again = [_by_gjk(first, second, request) for request in _more_requests]
    back = _by_gjk(second, first, _request)
    back = back._replace(normal=-back.normal)
    best = max([found, *again, back], key=lambda each: each.proved)
    distances = (each.distance for each in (found, *again, back) if each.distance >= best.proved)
    return best._replace(distance=min(distances, default=best.proved))


def cluster_separation(first: Placed, balls: Cluster) -> Separation:
    """Compute the distance of a shape from the balls of a static cluster, the nearest balls first."""
    capsule = first.shape.bounding_capsule
    if capsule is None:
        raise ValueError("what moves with a robot has an end")
    start, end = (first.rotation @ point + first.translation for point in capsule[:2])
    bounds = _distances_to_segment(balls.centers, start, end) - capsule.radius - balls.radii
    if isinstance(first.shape, Sphere | Capsule):  # which is its own bound
        row = int(np.argmin(bounds))
        scale = 1.0 + float(np.abs(balls.centers[row]).max() + np.abs(start).max())
        return Separation(float(bounds[row]) - ROUNDING * scale, float(bounds[row]), balls.centers[row], NO_NORMAL)
    best: Separation | None = None
    least = np.inf
    for row in np.argsort(bounds, kind="stable").tolist():
        if bounds[row] - ROUNDING * 10.0 >= least:
            break
        # A ball is as far away as a smaller one around the same center, less what its radius is larger.
        more = float(balls.radii[row]) - SPECK.radius
        found = separation(first, Placed(SPECK, WITHOUT_TURN, balls.centers[row]))
        least = min(least, found.proved - more)
        if best is None or found.distance - more < best.distance:
            best = found._replace(distance=found.distance - more)
    if best is None:
        raise ValueError("a cluster has balls")
    return best._replace(proved=least, normal=NO_NORMAL)


def _by_gjk(first: Placed, second: Placed, request: coal.DistanceRequest) -> Separation:
    """Compute a distance by coal and prove it by the plane across its normal."""
    here, there = (coal.Transform3s(placed.rotation, placed.translation) for placed in (first, second))
    result = _scratch.result
    result.clear()
    distance = float(coal.distance(first.shape.geometry, here, second.shape.geometry, there, request, result))
    normal, point = result.normal, result.getNearestPoint1()
    length = float(np.sqrt(normal @ normal))
    if not abs(length - 1.0) < UNIT_ERROR:  # none, or no number
        apart = second.translation - first.translation
        normal, length = apart, float(np.sqrt(apart @ apart))
        if length == 0.0:
            normal, length = np.array([0.0, 0.0, 1.0]), 1.0
    n = normal / length
    proved = _across(first, second, n)
    distance = max(distance, proved) if np.isfinite(distance) else proved
    return Separation(proved, distance, point, n)


def _across(first: Placed, second: Placed, normal: FloatArray) -> float:
    """Compute the distance of two shapes along a unit vector (3,), m, minus rounding."""
    scale = 1.0 + float(np.abs(first.translation).max() + np.abs(second.translation).max())
    return float(-second.support(-normal) - first.support(normal) - ROUNDING * scale)


def _above_plane(first: Placed, second: Placed) -> Separation:
    """Compute the distance of a shape above a half space, by its support alone."""
    plane = second.shape
    if not isinstance(plane, HalfSpace):
        raise TypeError("the second shape is no half space")
    normal = second.rotation @ plane.normal
    offset = plane.offset + float(normal @ second.translation)
    distance = -first.support(-normal) - offset
    scale = 1.0 + abs(offset) + float(np.abs(first.translation).max())
    capsule = first.shape.bounding_capsule
    ends = [first.translation] if capsule is None else [first.rotation @ p + first.translation for p in capsule[:2]]
    lowest = min(ends, key=lambda point: float(point @ normal))
    foot = lowest - normal * (float(normal @ lowest) - offset - distance)
    return Separation(distance - ROUNDING * scale, distance, foot, NO_NORMAL)


def _distances_to_segment(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Compute the distances (N,) of points (N, 3) from a line segment, m."""
    along = end - start
    square = float(along @ along)
    share = np.clip((points - start) @ along / square, 0.0, 1.0) if square > 0.0 else np.zeros(len(points))
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1), dtype=np.float64)


def _distance_request(guess: coal.GJKInitialGuess, variant: coal.GJKVariant) -> coal.DistanceRequest:
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_tolerance = GJK_TOLERANCE
    request.gjk_initial_guess = guess
    request.gjk_variant = variant
    return request


_request = _distance_request(coal.GJKInitialGuess.DefaultGuess, coal.GJKVariant.DefaultGJK)
_more_requests = (
    _distance_request(coal.GJKInitialGuess.BoundingVolumeGuess, coal.GJKVariant.DefaultGJK),
    _distance_request(coal.GJKInitialGuess.DefaultGuess, coal.GJKVariant.NesterovAcceleration),
)


class _Scratch(threading.local):
    """What coal writes its answer into, of each thread its own."""

    def __init__(self) -> None:
        self.result = coal.DistanceResult()


_scratch = _Scratch()
