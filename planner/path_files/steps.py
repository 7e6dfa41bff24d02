"""Steps of a tool path, lines and arcs, and their conversion to waypoints."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from planner.limits import Limits
from planner.path_files.texts import refused
from planner.problems.problem import CircularMotion, LinearMotion, Motion, PolylineMotion, PoseWaypoint
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition, Transition
from planner.spatial import FloatArray, Pose

SHORTEST_STEP = 1e-6
"""Distance, m, below which two points of a path file are the same."""

SMALLEST_CORNER = 5e-3
"""Angle, rad, below which a path has no corner: coordinates with three decimals turn the ends of small arcs so far."""

TURNING_BACK = 2.9
"""Angle of a corner, rad, above which the tool stops there, also with a blend."""

SMALLEST_BLEND = 1e-5
"""The smallest distance of a blend from its corner, m."""


@dataclass(frozen=True)
class Step:
    """A line or an arc of the tool, from the end of the step before.

    Attributes:
        end: The pose at its end.
        via: (3,), m: the middle of an arc; None: a line.
        speed: The limit on the speed of the tool, m/s; None: none.
    """

    end: Pose
    via: FloatArray | None = None
    speed: float | None = None


@dataclass
class ToolPath:
    """A tool path as it is read.

    Attributes:
        start: The first pose; None: none yet.
        steps: The steps from there.
        notes: Remarks on omissions, for a person.
    """

    start: Pose | None = None
    steps: list[Step] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def arc_steps(
    point: Callable[[float], FloatArray], angle: float, end: FloatArray, rotation: FloatArray, speed: float | None
) -> Iterator[Step]:
    """Yield an arc, in two halves if it is longer than half a circle.

    Args:
        point: The point at a fraction of the arc, from 0 to 1.
        angle: The angle of the arc, rad, positive.
        end: (3,), m: its last point.
        rotation: (3, 3): the orientation of the tool.
        speed: The limit on the speed of the tool, m/s; None: none.
    """
    if angle > math.pi * (1.0 + SMALLEST_CORNER):
        yield Step(Pose(point(0.5), rotation), point(0.25), speed)
        yield Step(Pose(end, rotation), point(0.75), speed)
    else:
        yield Step(Pose(end, rotation), point(0.5), speed)


def to_waypoints(path: ToolPath, frame: Pose | None, blend: float | None) -> list[PoseWaypoint]:
    """Convert a tool path to waypoints.

    The tool passes joins without a corner. It stops at corners, or rounds them with a blend; then lines of one speed
    become one polyline.

    Args:
        path: The path; steps without length are left out.
        frame: The pose in the base frame of the frame that all poses are in; None: the base frame.
        blend: The distance from a corner at which the tool leaves its path, m; None: it stops.

    Raises:
        InvalidProblem: No step moves the tool.
    """
    start = path.start
    kept = [] if start is None else _with_length(start, path.steps)
    if start is None or not kept:
        raise refused("must have a motion: at least two different points.")
    starts = [start, *(step.end for step in kept)]
    ends = [_Ends.of(before, step) for before, step in zip(starts[:-1], kept, strict=True)]
    joins = [*(_join(before, after, blend) for before, after in pairwise(ends)), StopTransition()]
    waypoints = [PoseWaypoint(start, frame=frame)]
    corners: list[Pose] = []
    for k, (step, transition) in enumerate(zip(kept, joins, strict=True)):
        following = kept[k + 1] if k + 1 < len(kept) else None
        is_inside = (
            isinstance(transition, BlendTransition | ThroughTransition)
            and following is not None
            and step.via is None
            and following.via is None
            and step.speed == following.speed
        )
        if blend is not None and is_inside:
            corners.append(step.end)
            continue
        motion = _motion(step, corners, frame, blend)
        limits = None if step.speed is None else Limits(tcp_linear_velocity=step.speed)
        waypoints.append(PoseWaypoint(step.end, frame=frame, motion=motion, transition=transition, limits=limits))
        corners = []
    return waypoints


def _with_length(start: Pose, steps: Sequence[Step]) -> list[Step]:
    """Return the steps that move the tool."""
    kept: list[Step] = []
    before = start
    for step in steps:
        moved = float(np.linalg.norm(step.end.position - before.position))
        if moved > SHORTEST_STEP or not _is_parallel(before, step.end):
            kept.append(step)
            before = step.end
    return kept


def _motion(step: Step, corners: Sequence[Pose], frame: Pose | None, blend: float | None) -> Motion:
    """Return the motion of a step, with the corners of the steps before that it takes in."""
    if step.via is not None:
        return CircularMotion(_in_base(Pose(step.via), frame))
    if corners and blend is not None:
        return PolylineMotion([_in_base(corner, frame) for corner in corners], blend)
    return LinearMotion()


def _in_base(pose: Pose, frame: Pose | None) -> Pose:
    return pose if frame is None else pose.from_frame(frame)


@dataclass(frozen=True)
class _Ends:
    """Directions of a step at its ends.

    Attributes:
        first: (3,), unit, at the start; zeros: the tool only turns.
        last: The same at the end.
        length: The distance from start to end, m.
        turns: Whether the tool turns on the way.
    """

    first: FloatArray
    last: FloatArray
    length: float
    turns: bool

    @classmethod
    def of(cls, start: Pose, step: Step) -> _Ends:
        """Compute the directions; the middle of an arc bisects it."""
        chord = step.end.position - start.position
        length, turns = float(np.linalg.norm(chord)), not _is_parallel(start, step.end)
        if step.via is None:
            return cls(_unit(chord), _unit(chord), length, turns)
        u, w, d = _unit(step.via - start.position), _unit(step.end.position - step.via), _unit(chord)
        return cls(2.0 * (u @ d) * u - d, 2.0 * (w @ d) * w - d, length, turns)


def _join(before: _Ends, after: _Ends, blend: float | None) -> Transition:
    """Return the transition between two steps: through without a corner, else a blend or a stop."""
    cosine = float(np.clip(before.last @ after.first, -1.0, 1.0))
    corner = math.acos(cosine)
    if corner < SMALLEST_CORNER and not before.turns and not after.turns:
        return ThroughTransition()
    radius = min(blend or 0.0, 0.5 * before.length, 0.5 * after.length)
    return BlendTransition(radius) if radius >= SMALLEST_BLEND and corner < TURNING_BACK else StopTransition()


def _unit(vector: FloatArray) -> FloatArray:
    """Return a vector of length 1; zeros if it is shorter than the shortest step."""
    length = float(np.linalg.norm(vector))
    return vector / length if length > SHORTEST_STEP else np.zeros(3)


def _is_parallel(one: Pose, other: Pose) -> bool:
    """Return whether two poses have the same orientation."""
    if one.rotation is None or other.rotation is None:
        return one.rotation is other.rotation
    return bool(np.abs(one.rotation - other.rotation).max() < SHORTEST_STEP)
