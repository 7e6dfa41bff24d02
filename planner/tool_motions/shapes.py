"""Tool motions by kind: their names, and the paths of the tool from pose to pose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from planner.problems.problem import CartesianMotion, CircularMotion, LinearMotion, PolylineMotion, SplineMotion
from planner.spatial import Pose
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_paths import Arc, Line, PosePath
from planner.tool_motions.pose_splines import PoseSpline


class Shape(NamedTuple):
    """The shape of the tool's path on a motion of one kind.

    Attributes:
        name: In words.
        path: Makes the path from the pose before, the motion, and the pose where it ends; raises `NoPath`.
    """

    name: str
    path: Callable[[Pose, Any, Pose], PosePath]


SHAPES: dict[type[CartesianMotion], Shape] = {
    LinearMotion: Shape("straight line", lambda before, _, after: Line(before, after)),
    CircularMotion: Shape("circle", lambda before, motion, after: Arc.through(before, motion.via, after)),
    PolylineMotion: Shape(
        "polyline", lambda before, motion, after: Polyline.through(before, motion.poses, after, motion.blend)
    ),
    SplineMotion: Shape("spline", lambda before, motion, after: PoseSpline.through(before, motion.poses, after)),
}
"""All there are, one line each."""
